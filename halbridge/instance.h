/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * One device of the module: its exchange, its pins, its client.
 */
#ifndef HALBRIDGE_INSTANCE_H
#define HALBRIDGE_INSTANCE_H

#include <stdatomic.h>
#include <stdbool.h>
#include <pokeys/shm.h>
#include "halbridge/binding.h"
#include "halbridge/exchange.h"
#include "halbridge/legacy_link.h"
#include "halbridge/legacy_settings.h"
#include "halbridge/wisher.h"
#include "shm/handover.h"

struct instance {
	unsigned int number;			/* pokeys.<number> */
	unsigned int schemes;			/* of names, enum table_scheme */
	char device[POKEYS_SHM_NAME_MAX];	/* of the daemon; empty = its only one */
	/*
	 * The client as the two functs see it, NULL before the device is known
	 * and after the end. A visit covers a whole run of the funct, so that
	 * nothing of the instance is freed under it.
	 */
	struct handover reader, writer;
	_Atomic bool refused;			/* the monitor's word, when nothing can be read */
	pokeys_client *client;			/* the monitor's, and of who starts and ends */
	struct values *values;			/* in HAL's memory, as the pointers to the pins */
	void **pointers;
	struct exchange exchange;
	struct binding binding;
	struct legacy_link link;
	struct wisher wisher;			/* the monitor's */
	struct legacy_settings settings;	/* the monitor's */
};

#endif
