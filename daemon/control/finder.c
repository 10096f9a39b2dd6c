// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * A search waits for answers, so it has a thread of its own: the control
 * thread, which feeds the watchdog, never waits for the network. What crosses is one
 * atomic word for each device, and a line for the log.
 *
 * Nothing is sent while nothing is missing: a device that answers is not
 * disturbed, and several daemons in one network do not shout all day.
 *
 * What was found is aimed at by the control thread, if it is nobody else's (claim.h).
 * An answer is only somebody's word. Where a datagram came from decides, not the address
 * written in it: behind a router they differ, and a liar can write anything.
 * Whether the device really is the one it says, identification finds out.
 */
#include <errno.h>
#include <string.h>
#include <time.h>
#include "daemon/control/finder.h"
#include "daemon/control/thread.h"
#include "daemon/transport/discovery.h"
#include "wire/model.h"

enum { SEARCH_MS = 200, NAP_MS = 50 };

/* So many lines on what is missing in a minute. */
enum { MINUTE_LINES = 3 };
#define MINUTE_NS UINT64_C(60000000000)

static bool wanted(const struct config *config, const struct loop_shared *shared, uint32_t i)
{
	return config->device[i].serial &&
	       atomic_load_explicit(&shared->wanted, memory_order_relaxed) >> i & 1;
}

static uint64_t all_wanted(const struct config *config, const struct loop_shared *shared)
{
	uint64_t all = 0;

	for (uint32_t i = 0; i < config->devices; i++)
		all |= (uint64_t)wanted(config, shared, i) << i;
	return all;
}

/* The lowest of them, in order: the next search has the same ones, whoever answers first. */
static void take_other(struct finder_answers *answers, uint32_t serial)
{
	unsigned int at = 0;

	while (at < answers->others && answers->other[at] < serial)
		at++;
	if (at == FINDER_OTHERS) {
		answers->more_others = true;
		return;
	}
	if (at < answers->others && answers->other[at] == serial)
		return;
	if (answers->others == FINDER_OTHERS) {
		answers->more_others = true;
		answers->others--;
	}
	memmove(&answers->other[at + 1], &answers->other[at],
		(answers->others - at) * sizeof(answers->other[0]));
	answers->other[at] = serial;
	answers->others++;
}

static bool is_ours(const struct config *config, uint32_t serial)
{
	for (uint32_t i = 0; i < config->devices; i++)
		if (config->device[i].serial == serial)
			return true;
	return false;
}

void finder_take(const struct config *config, const struct loop_shared *shared,
		 _Atomic uint64_t found[TRANSPORT_CHANNELS], struct finder_answers *answers,
		 const uint8_t *data, size_t length, const struct transport_address *from)
{
	struct wire_discovery answer;

	if (wire_discovery_decode(data, length, &answer) != WIRE_OK || !answer.serial)
		return;
	if (!is_ours(config, answer.serial))
		take_other(answers, answer.serial);
	for (uint32_t i = 0; i < config->devices; i++) {
		const struct device_config *device = &config->device[i];

		if (device->serial != answer.serial)
			continue;
		answers->ours |= UINT64_C(1) << i;
		if (!wanted(config, shared, i) || (from->interface && answers->routed >> i & 1))
			continue;
		answers->routed |= (uint64_t)!from->interface << i;
		atomic_store_explicit(&found[i],
				      (uint64_t)from->interface << 48 |
					      (uint64_t)from->address << 16 | device->port,
				      memory_order_relaxed);
	}
}

static bool found(void *context, const uint8_t *data, size_t length,
		  const struct transport_address *from)
{
	struct finder *finder = context;

	finder_take(finder->teller->config, finder->shared, finder->found, &finder->answers, data,
		    length, from);
	return atomic_load_explicit(&finder->stop, memory_order_relaxed);
}

/* A device that starts just now may miss one question. */
static void judge(struct finder *finder, uint64_t missing)
{
	char why[FINDER_WHY] = "";

	missing &= ~finder->answers.ours;
	finder->misses = missing ? finder->misses + 1 : 0;
	if (finder->misses == 1)
		return;
	if (missing)
		finder_why(finder->teller->config, missing, &finder->answers, &finder->report, why);
	pthread_mutex_lock(&finder->lock);
	strcpy(finder->why, why);
	pthread_mutex_unlock(&finder->lock);
}

static int search(struct finder *finder)
{
	const struct config *config = finder->teller->config;
	struct transport_address also[CONFIG_ADDRESSES] = { 0 };
	struct discovery_options options = {
		.timeout_ms = SEARCH_MS,
		.interface = *config->interface ? config->interface : NULL,
		.also = also,
		.also_count = config->discovery_addresses,
		.report = &finder->report,
	};
	const uint64_t missing = all_wanted(config, finder->shared);
	int result;

	memset(&finder->answers, 0, sizeof(finder->answers));
	for (uint32_t i = 0; i < config->discovery_addresses; i++)
		also[i].address = config->discovery_address[i];
	result = discovery_search(&options, found, finder);
	if (result >= 0)
		judge(finder, missing);
	return result;
}

static void *run(void *argument)
{
	const struct timespec nap = { .tv_nsec = NAP_MS * 1000000 };
	struct finder *finder = argument;
	uint64_t waited = UINT64_MAX;

	while (!atomic_load_explicit(&finder->stop, memory_order_relaxed)) {
		if (waited >= finder->teller->config->discovery_interval_ns &&
		    all_wanted(finder->teller->config, finder->shared)) {
			atomic_store_explicit(&finder->result, search(finder),
					      memory_order_relaxed);
			waited = SEARCH_MS * UINT64_C(1000000);
		}
		nanosleep(&nap, NULL);
		if (waited < UINT64_MAX / 2)
			waited += NAP_MS * UINT64_C(1000000);
	}
	return NULL;
}

int finder_start(struct finder *finder, const struct teller *teller,
		 const struct loop_shared *shared)
{
	const struct config *config = teller->config;
	bool needed = false;
	int result;

	memset(finder, 0, sizeof(*finder));
	pthread_mutex_init(&finder->lock, NULL);
	finder->teller = teller;
	finder->shared = shared;
	for (uint32_t i = 0; i < config->devices; i++)
		needed |= config->device[i].serial != 0;
	if (!needed)
		return 0;
	result = thread_make(&finder->thread, run, finder);
	finder->running = !result;
	return result;
}

static void report_result(struct finder *finder)
{
	int result = atomic_load_explicit(&finder->result, memory_order_relaxed);

	/* only trouble is news, and its end; how many answered is not */
	result = result < 0 ? result : 0;
	if (result == finder->told)
		return;
	if (result)
		tell_line(finder->teller, TELL_ALL, EVENT_WARNING, "search",
			  "the network cannot be searched for devices: %s", strerror(-result));
	else
		tell_line(finder->teller, TELL_ALL, EVENT_NOTICE, "search",
			  "the network can be searched again");
	finder->told = result;
}

/* A cause that changes with each search does not fill the log. */
static bool may_tell(struct finder *finder, uint64_t now_ns)
{
	if (!finder->minute_ns || now_ns - finder->minute_ns >= MINUTE_NS) {
		finder->minute_ns = now_ns;
		finder->minute_lines = 0;
	}
	if (finder->minute_lines == MINUTE_LINES)
		return false;
	finder->minute_lines++;
	return true;
}

/* Once for each cause, and again after it was found meanwhile. */
static void report_missing(struct finder *finder, uint64_t now_ns)
{
	char why[FINDER_WHY];

	pthread_mutex_lock(&finder->lock);
	strcpy(why, finder->why);
	pthread_mutex_unlock(&finder->lock);
	if (*why && strcmp(why, finder->told_why) != 0) {
		if (!may_tell(finder, now_ns))
			return;
		tell_line(finder->teller, TELL_ALL, EVENT_WARNING, "search", "%s", why);
	}
	strcpy(finder->told_why, why);
}

void finder_report(struct finder *finder, uint64_t now_ns)
{
	if (!finder->running)
		return;
	report_result(finder);
	report_missing(finder, now_ns);
}

void finder_stop(struct finder *finder)
{
	if (!finder->running)
		return;
	atomic_store_explicit(&finder->stop, true, memory_order_relaxed);
	pthread_join(finder->thread, NULL);
	finder->running = false;
}
