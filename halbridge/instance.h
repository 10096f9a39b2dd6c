/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * One device of the module: its exchange, its pins, its client.
 */
#ifndef HALBRIDGE_INSTANCE_H
#define HALBRIDGE_INSTANCE_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <pokeys/shm.h>
#include "halbridge/binding.h"
#include "halbridge/exchange.h"
#include "halbridge/legacy_link.h"
#include "halbridge/legacy_range.h"
#include "halbridge/legacy_settings.h"
#include "halbridge/timing.h"
#include "halbridge/wisher.h"
#include "shm/handover.h"

enum { INSTANCE_PREFIX = 32 };

struct instance {
	unsigned int number;              /* from 0 */
	char prefix[INSTANCE_PREFIX];     /* of its names, e.g. "pokeys.0" */
	unsigned int schemes;             /* of names, enum table_scheme */
	char device[POKEYS_SHM_NAME_MAX]; /* of the daemon; empty = look for it */
	uint32_t serial;                  /* of the device to look for; 0 = the only one */
	bool no_serial;                   /* what names it is no number: none is looked for */
	/*
	 * The client as the two functs see it, NULL before the device is known
	 * and after the end. A visit covers a whole run of the funct, so that
	 * nothing of the instance is freed under it.
	 */
	struct handover reader, writer;
	_Atomic uintptr_t read_by, write_by; /* threads; 0 = not yet */
	_Atomic bool refused;                /* the monitor's word, when nothing can be read */
	_Atomic bool closed;                 /* no visits any more */
	pokeys_client *client;               /* the monitor's, and of who starts and ends */
	struct values *values;               /* in HAL's memory, as the pointers to the pins */
	void **pointers;
	struct exchange exchange;
	struct binding binding;
	struct legacy_link link;
	struct timing timing;
	struct wisher wisher;            /* the monitor's */
	struct pokeys_diag diag;         /* the monitor's */
	struct legacy_settings settings; /* the monitor's, as the two below */
	struct legacy_range range;
};

/*
 * Make it and export its names. *out is set in any case, for instance_end().
 * 0, -ENOMEM, or what HAL said, after a line in the log. After hal_init(). Cold.
 */
int instance_make(struct instance **out, int component, unsigned int number, const char *prefix,
		  unsigned int schemes);

/*
 * Free it. HAL must not have its names any more, and nobody be in a visit.
 * NULL is allowed. Cold.
 */
void instance_end(struct instance *instance);

/* From now on, the two below do nothing. Who is in a visit ends it. */
void instance_close(struct instance *instance);

/*
 * The pins say that nothing is connected. Signals keep the last value of a component that is
 * unloaded: without this, LinuxCNC would go on with a device that nobody drives. Closed before, and
 * nobody is in a visit. Cold.
 */
void instance_leave(struct instance *instance);

/* Newest state to the pins; pins to the command. Realtime, one thread for both. */
void instance_read(struct instance *instance);
void instance_write(struct instance *instance, uint64_t period_ns);

/* CLOCK_MONOTONIC. Realtime. */
uint64_t instance_now(void);

#endif
