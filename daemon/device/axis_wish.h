/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What an axis of the pulse engine is commanded, and how fast its position moves on. Part of
 * struct device. Realtime thread only.
 */
#ifndef DEVICE_AXIS_WISH_H
#define DEVICE_AXIS_WISH_H

#include <stdbool.h>
#include <stdint.h>

/* Where the position was. */
struct axis_mark {
	int32_t position;
	uint64_t ns;			/* 0 = never */
};

enum { AXIS_MARKS = 3 };

struct axis_wish {
	int32_t position;		/* pulses */
	float velocity;			/* pulses/s, with a sign in velocity mode */
	uint8_t mode;			/* enum pokeys_axis_mode */
	bool enable;
	bool good;			/* nothing was wrong with it in the newest image */
	uint64_t moved_ns, moved_before_ns;	/* position changed, the last times; 0 = never */
	struct axis_mark mark[AXIS_MARKS];	/* oldest first */
	float forward;			/* pulses/s: how fast the position has changed of late */
};

/* The position in an image, or of a path in a cycle, also if it is the same as before. */
void axis_wish_move(struct axis_wish *wish, int32_t position, uint64_t now_ns);
/* No further position will come: it goes to this one as fast as it can. */
void axis_wish_rest(struct axis_wish *wish);
/* A position that is commanded in a stream. */
bool axis_wish_moves_on(const struct axis_wish *wish, uint64_t now_ns);
/*
 * How fast the position moves on, pulses/s with a sign; 0 if it stands, jumps or turns. This is
 * the commanded velocity where that may be it. It may also be just a limit.
 */
float axis_wish_speed(const struct axis_wish *wish);

#endif
