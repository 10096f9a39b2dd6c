/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Ethernet frames with an IPv4 UDP datagram in them: made and judged; see frame.c. */
#ifndef TRANSPORT_FRAME_H
#define TRANSPORT_FRAME_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
	FRAME_MAC = 6,
	FRAME_HEAD = 14 + 20 + 8, /* of a frame that is made here */
};

/* From where to where; addresses and ports in host byte order. */
struct frame_path {
	uint8_t to_mac[FRAME_MAC], from_mac[FRAME_MAC];
	uint32_t to, from;
	uint16_t to_port, from_port;
};

/* A datagram in a frame; `data` points into the frame. */
struct frame_datagram {
	const uint8_t *data;
	size_t length;
	uint32_t to, from;
	uint16_t to_port, from_port;
};

/*
 * Make a frame of `data` (at most 1472 bytes, as long as a plain Ethernet
 * takes) in `out`, which has room for FRAME_HEAD + length bytes. Its length.
 * Realtime, pure.
 */
size_t frame_make(uint8_t *out, const struct frame_path *path, const uint8_t *data, size_t length);

/*
 * The same for a record that kept only the first `kept` of `length` bytes (at most 65507):
 * the headers tell the true length, and a cut one has no UDP checksum. FRAME_HEAD + kept.
 */
size_t frame_make_cut(uint8_t *out, const struct frame_path *path, const uint8_t *data, size_t kept,
		      size_t length);

/*
 * Take a frame apart: false if it is not a whole, untagged, unfragmented IPv4
 * UDP datagram whose lengths and checksums are right. Realtime, pure.
 */
bool frame_read(const uint8_t *frame, size_t length, struct frame_datagram *out);

/*
 * Of a frame that was refused: true if it is for its UDP checksum, which holds the sum over
 * the pseudo header alone. So a kernel sends it that leaves the rest to a card, and one in
 * 65536 damaged frames looks so. Realtime, pure.
 */
bool frame_half_summed(const uint8_t *frame, size_t length);

#endif
