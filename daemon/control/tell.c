// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The log and the readers get the same words, from one place: what somebody sees on a display
 * can be looked for in the journal. The time of day is the log's, so it is taken when something
 * is written down, less the time since it happened.
 */
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include "daemon/control/clock.h"
#include "daemon/control/log.h"
#include "daemon/control/tell.h"
#include "daemon/device/event.h"

#define SECOND_NS UINT64_C(1000000000)

void tell_log(const struct teller *teller, uint32_t device, const struct pokeys_event *said)
{
	const bool known = device < teller->config->devices;
	char held[64] = "";

	if (said->held)
		snprintf(held, sizeof(held), " (%u more of this kind were not written)",
			 said->held);
	log_line(said->level, "%s%s%s%s", known ? teller->config->device[device].name : "",
		 known ? ": " : "", said->text, held);
}

/* The time of day of something that was a moment ago. */
static uint64_t wall_time(uint64_t t_ns, uint64_t now_ns)
{
	struct timespec wall;

	clock_gettime(CLOCK_REALTIME, &wall);
	return (uint64_t)wall.tv_sec * SECOND_NS + (uint64_t)wall.tv_nsec -
	       (now_ns > t_ns ? now_ns - t_ns : 0);
}

void tell_show(const struct teller *teller, uint32_t device, const struct pokeys_event *said,
	       uint64_t t_ns, uint64_t now_ns)
{
	const bool all = device >= teller->config->devices;
	struct pokeys_event event = *said;

	if (!teller->show || said->level >= EVENT_DEBUG)
		return;
	event.t_ns = t_ns;
	event.wall_ns = wall_time(t_ns, now_ns);
	event.flags = all ? POKEYS_EVENT_ALL_DEVICES : 0;
	for (uint32_t i = 0; i < teller->config->devices; i++)
		if (all || i == device)
			teller->show(teller->context, i, &event);
}

void tell_line(const struct teller *teller, uint32_t device, int level, const char *kind,
	       const char *format, ...)
{
	struct pokeys_event said = { .level = (uint16_t)level };
	const uint64_t now_ns = clock_now();
	va_list arguments;

	snprintf(said.kind, sizeof(said.kind), "%s", kind);
	va_start(arguments, format);
	vsnprintf(said.text, sizeof(said.text), format, arguments);
	va_end(arguments);
	tell_log(teller, device, &said);
	tell_show(teller, device, &said, now_ns, now_ns);
}
