/* SPDX-License-Identifier: MIT */
/*
 * What a board's maker calls its terminals and outputs (protocol sections 2.5 and
 * 3.24.2). Constant tables.
 */
#ifndef WIRE_LABEL_H
#define WIRE_LABEL_H

#include <stdint.h>

enum { WIRE_LABEL_OUTPUTS = 8 };

struct wire_labels {
	uint8_t hardware;
	/* Of the outputs that are no terminals, by bit of the second byte of 0x85/04. */
	const char *output[WIRE_LABEL_OUTPUTS];
	const char *terminal[56]; /* 1-based; NULL = none but its number */
};

/* NULL: nothing but numbers is documented. */
const struct wire_labels *wire_labels(uint8_t hardware);

#endif
