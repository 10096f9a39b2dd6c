/* SPDX-License-Identifier: GPL-2.0-or-later */
/* pokeysctl axis: one axis is moved or homed. Cold, main thread. */
#ifndef TOOLS_AXIS_H
#define TOOLS_AXIS_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/shm.h>
#include "tools/pokeysctl.h"

enum axis_verb { AXIS_MOVE, AXIS_MOVE_TO, AXIS_HOME, AXIS_STOP, AXIS_CLEAR };

/* What the command line wants. */
struct axis_order {
	enum axis_verb verb;
	unsigned int axis;
	int32_t pulses; /* to go, or where to */
};

/* A run of the command. */
struct axis {
	const char *device;
	unsigned int number;
	double speed; /* pulses/s, 0 = not said */
	pokeys_client *client;
	struct pokeys_state state; /* read last */
	struct pokeys_state began; /* as it was at the beginning */
	struct pokeys_command command;
	uint64_t read_ns;            /* when `state` was read */
	uint64_t fresh_ms, given_ms; /* when it was fresh last, and something commanded */
	bool fresh;                  /* the last look has seen a device that is well */
	bool given;                  /* something is commanded */
	bool lapsed;                 /* it was not, for a while */
	bool on;                     /* the machine is, or was until something stopped it */
	bool homing, ending;         /* then positions, or signals, do not matter */
	bool told;                   /* it has been said what is wrong */
};

/* Judge the command line. False if it is wrong, and it has been said. */
bool axis_take(const struct options *options, struct axis_order *wanted);

/* Do it; `axis` has device, number, speed, client, state and command.session. */
bool axis_run(struct axis *axis, const struct axis_order *wanted);

#endif
