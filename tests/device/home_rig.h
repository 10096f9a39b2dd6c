/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A machine of three axes with home switches, in virtual time, for the tests of homing by
 * the device.
 */
#ifndef TESTS_DEVICE_HOME_RIG_H
#define TESTS_DEVICE_HOME_RIG_H

#include "tests/device/world.h"

#define HOME_AT (-500)	/* pulses: where the home switches are */

extern struct world world;

/* The limit switch of an axis, pulses. */
void wire_limit(unsigned int axis, int32_t from, int32_t to);

/* All of it from the start, machine on; `options` (WIRE_AXIS_) and `switches` for each axis. */
void set_up(uint8_t options, uint8_t switches);
/* ... some of which (one bit each) have no home switch. */
void set_up_without(uint8_t options, uint8_t switches, uint8_t without);
int begin(void **state); /* for cmocka, without any */

/* Axes to home; their counts are to be 100, 200, 300 at the switch. */
struct pokeys_one_shot home(uint8_t mask, uint8_t flags);
/* A one-shot without parameters, until its outcome. */
enum pokeys_outcome act(uint8_t operation);
/* Homing that finishes itself; returns when the device is at it. */
void start(uint8_t mask);

/* For world_until(). */
bool is_idle(struct world *w);
bool is_working(struct world *w);
bool is_complete(struct world *w);

#endif
