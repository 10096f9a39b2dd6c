// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * A device on a bad line can have a great deal to say. Each kind of event of
 * each device may speak ten times in ten seconds, then it is only counted, so
 * that one device's noise hides neither another device nor another kind of
 * fault, and the journal does not fill. Only what was changed in a device is
 * always told: there are as many lines as there are settings, and the one that
 * is not there would be looked for.
 */
#include <stdio.h>
#include <string.h>
#include <time.h>
#include "daemon/control/drain.h"
#include "daemon/device/event_name.h"

void drain_init(struct drain *drain, const struct config *config, struct event_ring *ring,
		struct desk *desk, struct keeper *keeper)
{
	memset(drain, 0, sizeof(*drain));
	drain->config = config;
	drain->ring = ring;
	drain->desk = desk;
	drain->keeper = keeper;
}

/* What concerns no device concerns each of them. */
static void tell(const struct drain *drain, uint32_t device, const struct pokeys_event *said)
{
	if (!drain->tell)
		return;
	for (uint32_t i = 0; i < drain->config->devices; i++)
		if (i == device || device >= drain->config->devices)
			drain->tell(drain->tell_context, i, said);
}

static void set_times(struct pokeys_event *said, uint64_t t_ns, uint64_t now_ns)
{
	struct timespec wall;

	clock_gettime(CLOCK_REALTIME, &wall);
	said->t_ns = t_ns;
	said->wall_ns = (uint64_t)wall.tv_sec * UINT64_C(1000000000) + (uint64_t)wall.tv_nsec -
			(now_ns > t_ns ? now_ns - t_ns : 0);
}

static void log_event(const struct pokeys_event *said, const char *name)
{
	char held[64] = "";

	if (said->held)
		snprintf(held, sizeof(held), " (%u more of this kind were not written)",
			 said->held);
	log_line((int)said->level, "%s%s%s%s", name ? name : "", name ? ": " : "", said->text,
		 held);
}

static void write_down(struct drain *drain, const struct event *event, uint64_t now_ns)
{
	bool known = event->device < drain->config->devices;
	const char *name = known ? drain->config->device[event->device].name : NULL;
	uint32_t row = known ? event->device : TRANSPORT_CHANNELS;
	uint32_t code = event->code < EVENT_CODES ? event->code : EVENT_NONE;
	struct pokeys_event said = { .level = event->level };

	if (code != EVENT_CONFIG_CHANGED &&
	    !log_permit(&drain->limit[row][code], now_ns, &said.held))
		return;
	event_format(event, NULL, said.text, sizeof(said.text));
	snprintf(said.kind, sizeof(said.kind), "%s", event_kind_name(code));
	set_times(&said, event->t_ns, now_ns);
	log_event(&said, name);
	tell(drain, event->device, &said);
}

static void tell_dropped(struct drain *drain, uint64_t now_ns)
{
	uint64_t dropped = atomic_load_explicit(&drain->ring->dropped, memory_order_relaxed);
	struct pokeys_event said = { .level = EVENT_WARNING, .kind = "events-lost" };

	if (dropped == drain->dropped_told ||
	    !log_permit(&drain->dropped_limit, now_ns, &said.held))
		return;
	snprintf(said.text, sizeof(said.text),
		 "%llu events came faster than they could be written and are lost",
		 (unsigned long long)(dropped - drain->dropped_told));
	set_times(&said, now_ns, now_ns);
	said.held = 0;			/* they are in the number */
	log_event(&said, NULL);
	tell(drain, UINT32_MAX, &said);
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
