/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What each terminal is used for, and which uses exclude one another: a digital
 * output cannot be the channel of an encoder as well.
 *
 * Pure, no allocation, realtime safe unless a function says that it is cold. Any thread.
 */
#ifndef SETTINGS_TERMINAL_H
#define SETTINGS_TERMINAL_H

#include <stddef.h>
#include <stdint.h>
#include <pokeys/settings.h>
#include "settings/key.h"
#include "wire/model.h"

enum terminal_kind {
	TERMINAL_INPUT,   /* a digital input */
	TERMINAL_COUNTER, /* ... whose edges are counted */
	TERMINAL_ANALOG,
	TERMINAL_OUTPUT,    /* a digital output */
	TERMINAL_LISTENER,  /* a switch, an encoder: only reads its level */
	TERMINAL_SCANNED,   /* of the matrix keyboard */
	TERMINAL_DRIVEN,    /* an output of another part of the device */
	TERMINAL_COMMANDED, /* the same, by a commander and not by a setting */
	TERMINAL_FOLLOWER,  /* a digital output that an axis switches */
	TERMINAL_SENSOR,    /* an analog input of a heater */
	TERMINAL_LOOP,      /* a digital output of a heater or a servo motor */
	TERMINAL_SAFE_ON,   /* a digital output, after a loss */
	TERMINAL_SAFE_HOLD,
	TERMINAL_RESUME,
	TERMINAL_KINDS
};

struct terminal_owner {
	uint64_t terminals; /* bit = terminal - 1; 0 = it uses none */
	const char *key;    /* of pokeysd.conf; '#' stands for the index */
	uint8_t index;
	uint8_t kind;   /* enum terminal_kind */
	uint8_t number; /* always the same one for the same key and index */
};

/* Keys of pokeysd.conf that are no settings of the device; bit = terminal - 1. */
struct terminal_daemon {
	uint64_t safe_on, safe_hold, resume;
	uint32_t pwm; /* channels that a commander enables */
	uint8_t heaters;
	struct {
		uint64_t sensor, output, fan;
		uint8_t pwm, fan_pwm; /* channel + 1; 0 = none */
	} heater[POKEYS_HEATERS];
	uint8_t servos;
	struct {
		uint64_t direction, enable, low, high, home;
		uint8_t pwm, reverse_pwm; /* channel + 1; 0 = none */
	} servo[POKEYS_SERVOS];
};

/* Terminals that both use, and only one of them can. */
struct terminal_conflict {
	struct terminal_owner a, b;
	uint64_t terminals;
};

enum { TERMINAL_CONFLICTS_MAX = 64 };

/*
 * Who uses terminals on this board that others use as well, each two once, at most
 * TERMINAL_CONFLICTS_MAX. board = NULL: what no board that is known can do, either
 * because it is a conflict there, too, or because the terminal cannot be used in this way.
 */
size_t terminal_conflicts(const struct pokeys_settings *settings,
			  const struct terminal_daemon *daemon, const struct wire_pinmap *board,
			  struct terminal_conflict out[TERMINAL_CONFLICTS_MAX]);

/* The key of an owner's number, and its index; NULL if there is no such owner. */
const char *terminal_key(unsigned int number, unsigned int *index);

/* The same as a person writes it: "axis.2.limit-minus-pin", or "". Cold. Returns `out`. */
const char *terminal_owner_name(unsigned int number, char out[SETTINGS_NAME_MAX]);

enum { TERMINAL_LIST_MAX = 240 };

/* "terminal 8", "terminals 1, 2 and 5". Cold. Returns `out`. */
const char *terminal_list(uint64_t terminals, char out[TERMINAL_LIST_MAX]);

#endif
