/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A lathe in virtual time for the tests of threading by the device: axes in buffered
 * mode, a spindle at the ultra-fast encoder, a commander that leads Z and X.
 */
#ifndef TESTS_DEVICE_THREAD_RIG_H
#define TESTS_DEVICE_THREAD_RIG_H

#include "tests/device/world.h"

enum { Z = 0, X = 1, STEPS = 4096, TARGET = 600, FEED = 10 }; /* FEED: pulses a ms */

extern struct world world;

const struct pokeys_engine *engine(void);
const struct pokeys_threading *threading(void);
/* Where the simulated device has an axis. */
int64_t pulses(unsigned int axis);

/* For world_until(). */
bool is_idle(struct world *w);
bool is_prepared(struct world *w);
bool is_active(struct world *w);

/* The command of an axis; the spindle's speed. */
void go(unsigned int axis, int32_t position);
void spin(double rpm);

/* A daemon that begins, and a commander; the axes stay where they are. */
void switch_on(uint32_t session);
/* All of it anew, the spindle at 500/min; `ignore` are axes that stand. begin() for cmocka. */
void begin_with(bool count_free, uint8_t ignore);
int begin(void **state);

enum pokeys_outcome shot(uint8_t operation);
uint32_t queue(uint8_t operation);
void prepare(void);

/* Z goes so many ms with FEED, X half of it, as at the target speed; `each` sees every ms. */
void run(int32_t ms, void (*each)(int32_t ms));
void arm_with_the_motion(int32_t ms);

/* Everything stands, and stays so although the spindle turns and the command goes on. */
void stopped(uint8_t result);

#endif
