/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The polling plan: what is asked when, the slow groups, and PoNET, which is one
 * of them with steps of its own.
 */
#ifndef DEVICE_PLAN_H
#define DEVICE_PLAN_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/state.h>
#include "daemon/device/device.h"
#include "daemon/engine/mailbox.h"
#include "wire/bus.h"
#include "wire/encoder.h"
#include "wire/io.h"
#include "wire/panel.h"
#include "wire/pulse.h"
#include "wire/system.h"

/* plan.c, slow.c */
enum slow_group {
	SLOW_ENCODERS_LOW,
	SLOW_ENCODERS_HIGH,
	SLOW_ANALOG,
	SLOW_COUNTERS,
	SLOW_POEXTBUS,
	SLOW_TICK,
	SLOW_PWM,
	SLOW_LOAD,
	SLOW_CLOCK,
	SLOW_EXTERNAL,
	SLOW_IDENTITY,
	SLOW_PONET,
	SLOW_DEDICATED,
	SLOW_MATRIX,
	SLOW_BACKLASH,
	SLOW_POSTEP,
	SLOW_POSTEP_RARE,
	SLOW_GROUPS
};

_Static_assert((int)SLOW_POSTEP_RARE == (int)POKEYS_SLOW_POSTEP_RARE, "groups are one list");
_Static_assert((int)SLOW_GROUPS <= (int)POKEYS_SLOW_GROUPS, "groups have room in the image");

union slow_request {
	struct wire_encoders_req encoders;
	struct wire_analog_req analog;
	struct wire_counters_req counters;
	struct wire_poextbus_req poextbus;
	struct wire_pwm_req pwm;
	struct wire_rtc_req clock;
	struct wire_pulse_status_req status;
	struct wire_pulse_outputs_req external;
	struct wire_kb_status_req matrix;
	struct wire_ponet_module_req module;
	struct wire_ponet_option_req ponet;
};

struct slow_kind {
	double (*hertz)(const struct device_config *config);
	bool (*has)(const struct device *device);
	enum wire_op (*ask)(struct device *device, union slow_request *request);
	void (*take)(struct device *device, const mailbox_entry_t *entry);
};

/* ponet.c */
enum ponet_step {
	PONET_STATE,
	PONET_SETTINGS,
	PONET_VERSION,
	PONET_START, /* from here on a module is read */
	PONET_FETCH,
	PONET_LIGHT_START,
	PONET_LIGHT_FETCH,
};

struct ponet {
	uint8_t step; /* enum ponet_step */
	uint8_t module;
	uint8_t fetches;
	bool complete;               /* all modules have been looked at */
	bool ready;                  /* the bus, when it was last asked */
	uint8_t round[POKEYS_PONET]; /* readings of each module */
	uint32_t readings;
	uint32_t since_keys; /* answers, or none, since the keyboard's data came */
	bool again;          /* the keyboard is read again, for keys that are new */
	uint64_t keys;       /* what the first of the two readings had */
	uint64_t after_ns;   /* nothing to do before */
};

struct slow {
	bool open, answered;
	uint8_t failures;
	uint32_t count; /* answers since rates were measured */
	uint64_t due_ns;
};

enum { PLAN_GAP = 8 }; /* so many fast answers missing in a row: is it still the same device? */

/* fast.c. Serials are the mailbox's, of requests. */
struct fast {
	bool io_open, status_open;  /* the newest one is awaited */
	bool measuring;             /* the replies are still awaited ... */
	uint64_t measured_tick_ns;  /* ... of this tick */
	uint64_t io_sent, io_taken; /* the newest one, and of the reply taken last */
	uint64_t status_sent, status_taken;
	uint64_t io_outputs, io_mask; /* as they were sent last */
	uint64_t clear[POKEYS_PINS];  /* from this one on, answers tell an output */
	uint64_t clear_high;          /* the highest of them */
};

struct plan {
	uint64_t cycle;                  /* the last cycle that was planned */
	uint64_t next_cycle;             /* in which to ask for everything fast */
	uint64_t last_io_ns;             /* when the last 0xCC was answered */
	bool doubt_tick, doubt_identity; /* was it another one that answered? */
	struct slow slow[SLOW_GROUPS];
	uint64_t blocked_ns;              /* the next safe 0xCC while the link cannot run */
	bool output_sent;                 /* the last lesser request wrote an output */
	uint64_t rates_ns;                /* slow_millihertz[] are measured since then */
	uint64_t slow_since_ns;           /* slow_together: its moments count from here */
	uint8_t counter_pin[POKEYS_PINS]; /* 0-based pins that count */
	uint8_t counters, counter_next;
	uint8_t counter_asked[WIRE_COUNTERS];
	uint8_t postep_next, postep_asked; /* which of the rare ones */
};

#endif
