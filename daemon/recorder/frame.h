/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A datagram as it was on the wire: Ethernet, IPv4, UDP. Pure.
 */
#ifndef RECORDER_FRAME_H
#define RECORDER_FRAME_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { FRAME_HEADERS = 14 + 20 + 8 };

struct frame_end {
	uint8_t mac[6];
	uint32_t address;		/* IPv4, host byte order */
	uint16_t port;
};

struct frame {
	struct frame_end from, to;
	size_t length;			/* of the datagram's payload */
	size_t kept;			/* bytes of it in `data`, at most `length` */
	const uint8_t *data;
};

/*
 * Headers and what is kept of the payload, with both checksums; the one of UDP is
 * left out (0) where a part of the payload is missing. Returns the bytes written,
 * FRAME_HEADERS + kept, or 0 if `size` does not hold them.
 */
size_t frame_build(const struct frame *frame, uint8_t *out, size_t size);

/*
 * The other way round; out->data points into `bytes`. False: no IPv4 datagram of
 * UDP, a fragment, cut off within its headers, or of impossible lengths.
 */
bool frame_parse(const uint8_t *bytes, size_t size, struct frame *out);

#endif
