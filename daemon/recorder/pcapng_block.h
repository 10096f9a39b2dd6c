/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Numbers of the format that writing and reading share. */
#ifndef RECORDER_PCAPNG_BLOCK_H
#define RECORDER_PCAPNG_BLOCK_H

#define PCAPNG_SECTION 0x0A0D0D0Au
#define PCAPNG_BYTE_ORDER 0x1A2B3C4Du

enum {
	/* blocks */
	PCAPNG_INTERFACE = 1,
	PCAPNG_PACKET = 6,
	PCAPNG_JOURNAL = 9,
	/* link types */
	PCAPNG_ETHERNET = 1,
	/* options, each of its block */
	PCAPNG_COMMENT = 1,
	PCAPNG_APPLICATION = 4,
	PCAPNG_NAME = 2,
	PCAPNG_DESCRIPTION = 3,
	PCAPNG_RESOLUTION = 9,
	PCAPNG_DIRECTION = 2,
};

#endif
