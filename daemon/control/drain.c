// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * A device on a bad line can have a great deal to say. Each kind of event of
 * each device may speak ten times in ten seconds, then it is only counted, so
 * that one device's noise hides neither another device nor another kind of
 * fault, and the journal does not fill. Only what was changed in a device is
 * always told: there are as many lines as there are settings, and the one that
 * is not there would be looked for.
 */
#include <string.h>
#include "daemon/control/drain.h"

void drain_init(struct drain *drain, const struct config *config, struct event_ring *ring,
		struct desk *desk, struct keeper *keeper)
{
	memset(drain, 0, sizeof(*drain));
	drain->config = config;
	drain->ring = ring;
	drain->desk = desk;
	drain->keeper = keeper;
}

static void write_down(struct drain *drain, const struct event *event, uint64_t now_ns)
{
	bool known = event->device < drain->config->devices;
	const char *name = known ? drain->config->device[event->device].name : NULL;
	uint32_t row = known ? event->device : TRANSPORT_CHANNELS;
	uint32_t code = event->code < EVENT_CODES ? event->code : EVENT_NONE;
	char text[256];
	uint32_t held = 0;

	if (code != EVENT_CONFIG_CHANGED && !log_permit(&drain->limit[row][code], now_ns, &held))
		return;
	event_format(event, name, text, sizeof(text));
	if (held)
		log_line(event->level, "%s (%u more of this kind were not written)", text, held);
	else
		log_line(event->level, "%s", text);
}

static void tell_dropped(struct drain *drain, uint64_t now_ns)
{
	uint64_t dropped = atomic_load_explicit(&drain->ring->dropped, memory_order_relaxed);
	uint32_t held;

	if (dropped == drain->dropped_told || !log_permit(&drain->dropped_limit, now_ns, &held))
		return;
	log_line(EVENT_WARNING, "%llu events came faster than they could be written and are lost",
		 (unsigned long long)(dropped - drain->dropped_told));
	drain->dropped_told = dropped;
}

uint32_t drain_run(struct drain *drain, uint64_t now_ns)
{
	struct event event;
	uint32_t count = 0;

	while (count < EVENT_RING && event_pop(drain->ring, &event) == 1) {
		write_down(drain, &event, now_ns);
		if (drain->desk)
			desk_event(drain->desk, &event, now_ns);
		if (drain->keeper)
			keeper_event(drain->keeper, &event, now_ns);
		count++;
	}
	tell_dropped(drain, now_ns);
	return count;
}
