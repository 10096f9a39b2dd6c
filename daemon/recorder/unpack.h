/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The datagram in an Ethernet frame of a capture. Pure. */
#ifndef RECORDER_UNPACK_H
#define RECORDER_UNPACK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct unpacked {
	uint32_t from, to; /* IPv4, host byte order */
	uint16_t from_port, to_port;
	size_t length;       /* of the datagram's payload */
	size_t kept;         /* bytes of it in `data`, at most `length` */
	const uint8_t *data; /* points into the frame */
};

/*
 * `size` bytes of a frame, which may have been cut behind its headers. False: no IPv4
 * datagram of UDP, a fragment, cut off within its headers, or of impossible lengths.
 */
bool unpack_frame(const uint8_t *frame, size_t size, struct unpacked *out);

#endif
