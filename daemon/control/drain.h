/* SPDX-License-Identifier: GPL-2.0-or-later */
/* From the realtime side's event ring to the log and to readers, a few of a kind at a time. */
#ifndef CONTROL_DRAIN_H
#define CONTROL_DRAIN_H

#include <pokeys/events.h>
#include "daemon/control/config.h"
#include "daemon/control/desk.h"
#include "daemon/control/keeper.h"
#include "daemon/control/log.h"
#include "daemon/device/event.h"

struct drain {
	const struct config *config;		/* names of the devices */
	struct event_ring *ring;
	struct desk *desk;			/* hears of each event; NULL = nobody */
	struct keeper *keeper;			/* as well */
	/* Gets what is written down of a device (index); NULL = nobody. */
	void (*tell)(void *context, uint32_t device, const struct pokeys_event *said);
	void *tell_context;
	uint64_t dropped_told;
	struct log_limit dropped_limit;
	struct log_limit limit[TRANSPORT_CHANNELS + 1][EVENT_CODES];
};

void drain_init(struct drain *drain, const struct config *config, struct event_ring *ring,
		struct desk *desk, struct keeper *keeper);

/* Write down and tell what has come, at most one ring full. Returns how many events it was. */
uint32_t drain_run(struct drain *drain, uint64_t now_ns);

#endif
