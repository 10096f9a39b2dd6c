// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * A device on a bad line can have a great deal to say. Each kind of event of
 * each device may speak ten times in ten seconds, then it is only counted, so
 * that one device's noise hides neither another device nor another kind of
 * fault, and the journal does not fill. Only what was changed in a device is
 * always logged: there are as many lines as there are settings, and the one that
 * is not there would be looked for.
 *
 * For readers only the last events are kept, and a busy network or the setting up
 * of a device would push everything else out. So they get no more than ten
 * settings, and of lost packets and missed cycles one line a minute.
 */
#include <stdio.h>
#include <string.h>
#include "daemon/control/drain.h"
#include "daemon/device/event_name.h"

#define MINUTE_NS UINT64_C(60000000000)

void drain_init(struct drain *drain, const struct teller *teller, struct event_ring *ring,
		struct desk *desk, struct keeper *keeper)
{
	memset(drain, 0, sizeof(*drain));
	drain->teller = teller;
	drain->ring = ring;
	drain->desk = desk;
	drain->keeper = keeper;
}

static bool is_noise(uint32_t code)
{
	return code == EVENT_PACKETS || code == EVENT_CYCLE_SKIPPED;
}

/* True: show it, as one that stands for so many more. */
static bool stands_out(struct drain_noise *noise, uint64_t now_ns, uint32_t *held)
{
	noise->held += *held;
	if (noise->shown_ns && now_ns - noise->shown_ns < MINUTE_NS) {
		noise->held++;
		return false;
	}
	*held = noise->held;
	*noise = (struct drain_noise){ .shown_ns = now_ns };
	return true;
}

static void write_down(struct drain *drain, const struct event *event, uint64_t now_ns)
{
	const bool known = event->device < drain->teller->config->devices;
	const uint32_t device = known ? event->device : TELL_ALL;
	const uint32_t row = known ? event->device : TRANSPORT_CHANNELS;
	const uint32_t code = event->code < EVENT_CODES ? event->code : EVENT_NONE;
	const bool settings = code == EVENT_CONFIG_CHANGED;
	struct pokeys_event said = { .level = event->level }, shown;
	const bool permitted = log_permit(&drain->limit[row][code], now_ns, &said.held);

	if (!permitted && !settings)
		return;
	snprintf(said.kind, sizeof(said.kind), "%s", event_kind_name(code));
	event_format(event, NULL, said.text, sizeof(said.text));
	shown = said;
	if (permitted &&
	    (!is_noise(code) || stands_out(&drain->noise[row][code], now_ns, &shown.held)))
		tell_show(drain->teller, device, &shown, event->t_ns, now_ns);
	if (settings)
		said.held = 0;
	tell_log(drain->teller, device, &said);
}

static void tell_dropped(struct drain *drain, uint64_t now_ns)
{
	uint64_t dropped = atomic_load_explicit(&drain->ring->dropped, memory_order_relaxed);
	uint32_t held;

	if (dropped == drain->dropped_told || !log_permit(&drain->dropped_limit, now_ns, &held))
		return;
	tell_line(drain->teller, TELL_ALL, EVENT_WARNING, "events-lost",
		  "%llu events came faster than they could be written and are lost",
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
