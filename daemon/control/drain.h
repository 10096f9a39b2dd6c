/* SPDX-License-Identifier: GPL-2.0-or-later */
/* From the realtime side's event ring to the log and to readers, a few of a kind at a time. */
#ifndef CONTROL_DRAIN_H
#define CONTROL_DRAIN_H

#include "daemon/control/desk.h"
#include "daemon/control/keeper.h"
#include "daemon/control/log.h"
#include "daemon/control/tell.h"
#include "daemon/device/event.h"

/* What comes again and again is shown to readers once in a minute. */
struct drain_noise {
	uint64_t shown_ns; /* 0 = never */
	uint32_t held;
};

struct drain {
	const struct teller *teller;
	struct event_ring *ring;
	struct desk *desk;     /* hears of each event; NULL = nobody */
	struct keeper *keeper; /* as well */
	uint64_t dropped_told;
	struct log_limit dropped_limit;
	struct log_limit limit[TRANSPORT_CHANNELS + 1][EVENT_CODES];
	struct drain_noise noise[TRANSPORT_CHANNELS + 1][EVENT_CODES];
};

void drain_init(struct drain *drain, const struct teller *teller, struct event_ring *ring,
		struct desk *desk, struct keeper *keeper);

/* Say what has come, at most one ring full. Returns how many events there were. */
uint32_t drain_run(struct drain *drain, uint64_t now_ns);

#endif
