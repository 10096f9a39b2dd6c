/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef TESTS_SIM_TALK_H
#define TESTS_SIM_TALK_H

/* One client talking to one simulated device in virtual time. */

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "sim/device.h"

#define MS UINT64_C(1000000)

struct talk {
	struct sim_device dev;
	uint64_t now_ns;
	uint8_t id;
	uint8_t rq[WIRE_PK]; /* the next request: fill in, then ask() */
	uint8_t rp[WIRE_PK];
};

/* A device of that hardware (0: 57CNC) one second after it was switched on. */
void talk_start(struct talk *t, uint8_t hardware);

/* Clears the request and sets its header. */
void talk_begin(struct talk *t, uint8_t op, uint8_t p1, uint8_t p2, uint8_t p3, uint8_t p4);

/* Sends it and checks the reply's header, operation, id and checksum. */
const uint8_t *talk_send(struct talk *t);

/* begin and send a request without payload. */
const uint8_t *talk_ask(struct talk *t, uint8_t op, uint8_t p1, uint8_t p2);

/* Lets time pass. */
void talk_wait(struct talk *t, unsigned int ms);

/* Pulse engine: status now; and the setting up of axes for tests. */
const uint8_t *talk_status(struct talk *t);
uint8_t talk_engine_state(struct talk *t);
uint8_t talk_axis_state(struct talk *t, unsigned int axis);
int32_t talk_position(struct talk *t, unsigned int axis);
void talk_axes(struct talk *t, uint8_t count);
void talk_axis(struct talk *t, uint8_t axis, uint8_t options, uint8_t switches, float speed,
	       float accel, float decel);
void talk_set_state(struct talk *t, uint8_t state);

#define TALK_MOVING (SIM_AC_ENABLED | SIM_AC_PLANNER | SIM_AC_POSITION)
#define TALK_TURNING (SIM_AC_ENABLED | SIM_AC_PLANNER)

/* A 57CNC with three axes as in the vendor's first example; running. */
void talk_start_axes(struct talk *t, uint8_t options);
void talk_start_running(struct talk *t, uint8_t options);

/* Lets time pass until the engine leaves `busy`, at most a minute; its state then. */
uint8_t talk_wait_while(struct talk *t, uint8_t busy);
void talk_move(struct talk *t, unsigned int axis, int32_t reference);

#endif
