/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What an axis of the pulse engine is commanded, and how fast its position moves on. Part of
 * struct device. Realtime thread only.
 */
#ifndef DEVICE_AXIS_WISH_H
#define DEVICE_AXIS_WISH_H

#include <stdbool.h>
#include <stdint.h>

enum { AXIS_PAST = 9 }; /* positions: two spans of four images each */

struct axis_wish {
	int32_t position; /* pulses */
	float velocity;   /* pulses/s, with a sign in velocity mode */
	uint8_t mode;     /* enum pokeys_axis_mode */
	bool enable;
	bool good;                          /* nothing was wrong with it in the newest image */
	uint64_t moved_ns, moved_before_ns; /* position changed, the last times; 0 = never */
	int32_t past[AXIS_PAST];            /* the positions of the last images, newest first */
	uint64_t past_ns[AXIS_PAST];        /* ... when they were seen */
	uint8_t known;                      /* so many of them */
	uint8_t steady;                     /* for so many images it has moved on one way */
	float forward; /* it moves on so fast, pulses/s with a sign; 0 = unknown */
	float way;     /* pulses: the reference leads by so much, at most */
};

/* New images of a commander: how many there were, and how far apart it says that it writes them. */
struct axis_images {
	uint64_t count;    /* 1 or more */
	uint64_t apart_ns; /* 0 = it does not say */
	uint64_t seen_ns;
};

/* The position in the newest image, or of a path in a cycle, also if it is the same as before. */
void axis_wish_position(struct axis_wish *wish, int32_t position, uint64_t now_ns);
/* A position that is commanded in a stream. */
bool axis_wish_moves_on(const struct axis_wish *wish, uint64_t now_ns);

/*
 * After position and velocity of the newest image: how fast the position moves on. It is not known
 * while the position stands, has jumped or turned, or has moved for a few images only.
 */
void axis_wish_follow(struct axis_wish *wish, const struct axis_images *images);
/* It is not known, and what was before does not count: the axis is not driven, or has stopped. */
void axis_wish_rest(struct axis_wish *wish);

#endif
