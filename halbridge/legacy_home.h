/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Homing by AxesCommand and AxesState, as the older homing module speaks it.
 */
#ifndef HALBRIDGE_LEGACY_HOME_H
#define HALBRIDGE_LEGACY_HOME_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/command.h>
#include <pokeys/state.h>
#include "halbridge/one_shot.h"
#include "halbridge/values.h"

/* AxesCommand */
enum legacy_home_command {
	LEGACY_HOME_IDLE = 0,
	LEGACY_HOME_START = 1,
	LEGACY_HOME_ARM = 2,
	LEGACY_HOME_WAIT = 3,
	LEGACY_HOME_FINAL = 4,
	LEGACY_HOME_CANCEL = 5,
	LEGACY_HOME_FINALIZE = 6,
};

enum legacy_home_phase {
	LEGACY_PHASE_IDLE,
	LEGACY_PHASE_HOMING,    /* the device homes; at its state 10 ready to finalize */
	LEGACY_PHASE_FINISHING, /* the request to end homing was sent */
	LEGACY_PHASE_FINISHED,  /* ready to arm */
	LEGACY_PHASE_ARMING,    /* the position is being set */
	LEGACY_PHASE_ARMED,     /* it is; waits for the final move */
	LEGACY_PHASE_MOVING,    /* final move */
	LEGACY_PHASE_FAILED,    /* the daemon or the device refused */
};

struct legacy_home {
	uint8_t phase;
	bool open;            /* the one-shot below has not ended */
	uint32_t id, session; /* of that one-shot */
	uint32_t command;     /* as last obeyed */
};

struct legacy;
struct exchange;

/* See how the one-shots stand; at the begin of a period with fresh data. Realtime. */
void legacy_home_read(struct exchange *exchange, struct values *values);

/* Obey changed commands, and drive the final move. Realtime. */
void legacy_home_write(struct exchange *exchange, struct values *values);

/* AxesState and HomingStatus of an axis. Realtime. */
uint32_t legacy_home_state(const struct legacy_home *home, const struct pokeys_axis *axis);
uint32_t legacy_home_status(const struct legacy_home *home);

#endif
