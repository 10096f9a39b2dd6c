// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The choice between three ways to wait for replies.
 *
 *   sleep  in the kernel until a packet's interrupt wakes the thread: costs
 *          nothing, and the wake-up is most of a round trip
 *   napi   the tick by clock_nanosleep, then in the ring, which polls the
 *          card's queue for a while before it sleeps: no interrupt, no wake-up
 *          for a reply that comes soon; processor time only while one is awaited
 *   spin   the thread polls from before the tick on: the fastest, and the core
 *          is for nothing else
 *
 * auto never spins on a core that it might have to share: LinuxCNC puts its
 * servo thread on the isolated core of the highest number, and two that spin
 * there starve each other. One isolated core alone is therefore LinuxCNC's.
 *
 * Asked for by name, napi is refused only if the ring cannot; whether the card
 * can is not always to be seen (no interface named, an older kernel), and a card
 * that cannot makes it sleep.
 */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "daemon/control/waiting.h"

static const char *const names[] = {
	[CONFIG_WAIT_AUTO] = "auto",
	[CONFIG_WAIT_SLEEP] = "sleep",
	[CONFIG_WAIT_NAPI] = "napi",
	[CONFIG_WAIT_SPIN] = "spin",
};

const char *waiting_name(enum config_wait wait)
{
	return names[wait];
}

/* Why no ring can poll; false = it can. */
static bool lacks_ring(const struct waiting_facts *f, char *why, size_t size)
{
	if (f->transport == CONFIG_SOCKET || f->transport == CONFIG_XDP)
		snprintf(why, size, "napi is for io_uring only (transport)");
	else if (f->ring < 0)
		snprintf(why, size, "there is no io_uring to poll with");
	else if (f->ring_napi < 0)
		snprintf(why, size, "this kernel's io_uring cannot poll a card (Linux 6.9 can)");
	else
		return false;
	return true;
}

/* Why napi is none to choose unasked; false = it is one. */
static bool lacks_napi(const struct waiting_facts *f, char *why, size_t size)
{
	if (lacks_ring(f, why, size))
		return true;
	if (!f->busy_poll_us)
		snprintf(why, size, "busy-poll-us = 0");
	else if (!*f->interface)
		snprintf(why, size, "no interface is named whose card could be polled");
	else if (f->card_napi < 0)
		snprintf(why, size, "the kernel does not say whether %s can be polled: %s",
			 f->interface, strerror(-f->card_napi));
	else if (!f->card_napi)
		snprintf(why, size, "%s cannot be polled", f->interface);
	else
		return false;
	return true;
}

/* Why spin is none to choose unasked; false = it is one. */
static bool lacks_core(const struct waiting_facts *f, char *why, size_t size)
{
	if (f->cpu < 0)
		snprintf(why, size, "no core is given (cpu)");
	else if (!f->isolated)
		snprintf(why, size, "core %d is not isolated", f->cpu);
	else if (f->servo)
		snprintf(why, size, "core %d is the one that LinuxCNC takes", f->cpu);
	else
		return false;
	return true;
}

static void take(struct waiting *out, enum config_wait wait, const struct waiting_facts *f)
{
	out->wait = wait;
	out->mode = wait == CONFIG_WAIT_SPIN ? LOOP_SPIN : LOOP_SLEEP;
	out->busy_poll_us = wait == CONFIG_WAIT_NAPI ? f->busy_poll_us : 0;
}

static void choose_best(const struct waiting_facts *f, struct waiting *out)
{
	char core[80], napi[140];

	if (!lacks_core(f, core, sizeof(core))) {
		take(out, CONFIG_WAIT_SPIN, f);
		snprintf(out->why, sizeof(out->why), "core %d is isolated and not LinuxCNC's",
			 f->cpu);
	} else if (!lacks_napi(f, napi, sizeof(napi))) {
		take(out, CONFIG_WAIT_NAPI, f);
		snprintf(out->why, sizeof(out->why), "%s can be polled; not spin, for %s",
			 f->interface, core);
	} else {
		take(out, CONFIG_WAIT_SLEEP, f);
		snprintf(out->why, sizeof(out->why), "%s; not spin, for %s", napi, core);
	}
}

void waiting_choose(const struct waiting_facts *facts, struct waiting *out)
{
	memset(out, 0, sizeof(*out));
	if (facts->wanted == CONFIG_WAIT_AUTO) {
		choose_best(facts, out);
		return;
	}
	take(out, facts->wanted, facts);
	snprintf(out->why, sizeof(out->why), "as configured");
	if (facts->wanted == CONFIG_WAIT_NAPI && lacks_ring(facts, out->why, sizeof(out->why))) {
		take(out, CONFIG_WAIT_SLEEP, facts);
		out->refused = true;
	}
}

bool waiting_in_list(const char *list, int cpu, bool *highest)
{
	bool in = false;
	long last = -1;

	while (*list >= '0' && *list <= '9') {
		char *end;
		long from = strtol(list, &end, 10), to = from;

		if (*end == '-')
			to = strtol(end + 1, &end, 10);
		in |= cpu >= from && cpu <= to;
		last = to > last ? to : last;
		list = *end == ',' ? end + 1 : "";
	}
	*highest = in && cpu == last;
	return in;
}
