/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What is asked in every cycle, although older requests of the same kind are under way.
 *
 * A reply that is lost, or late, then costs nothing but itself: the next request is out
 * already. Only one that is late while it is the newest is repeated. Replies may overtake
 * each other; one is taken if its request is newer than that of the one taken before.
 *
 * A device that needs longer for the requests of a cycle than a cycle lasts must not get
 * one more before it has replied: they would queue up in it, and all values would be older
 * by the length of the queue. Whether replies are slow because the device is or because the
 * way is long cannot be seen from one of them. But in a device that works them off one after
 * the other, a request waits for those before it, while on a long way it does not. So the
 * round trips of requests with others before them are compared with those of requests that
 * had none. This is tried with one of the kinds, and with one more at a time. If they take
 * longer by the better part of a cycle, there is one at a time again, for a while that grows
 * as long as this happens. Round trips come in waves, so what was found good is given up
 * only if two comparisons say so.
 *
 * When nothing is heard, one at a time is enough to find the device again.
 */

#include "daemon/device/internal.h"

#define HOLD_NS (100 * MS)
#define HOLD_MAX_NS (10 * SECOND)

enum {
	SAMPLES = 32,
	FEW = 16,		/* show a queue */
	VERY_FEW = 3,		/* ... if it is long */
	FOUND_GOOD = 2,		/* a depth above this was tried before */
	DEPTH_MAX = 16,
	SILENT = 32,		/* so many replies missing in a row */
	KEPT = 6,		/* places for everything else */
};

static uint64_t towards(uint64_t mean_ns, uint64_t ns, uint32_t samples)
{
	return ns > mean_ns ? mean_ns + (ns - mean_ns) / samples :
			      mean_ns - (mean_ns - ns) / samples;
}

static void add(struct pipeline_mean *mean, uint64_t ns)
{
	if (mean->samples < SAMPLES)
		mean->samples++;
	mean->ns = towards(mean->ns, ns, mean->samples);
	mean->off_ns = towards(mean->off_ns, ns > mean->ns ? ns - mean->ns : mean->ns - ns,
			       mean->samples);
}

static bool queues_up(struct device *device)
{
	struct pipeline *pipeline = &device->pipeline;
	bool before = pipeline->doubted;
	const uint64_t cycle_ns = device->config.period_ns * device->config.fast_divider;
	const uint64_t alone_ns = pipeline->alone.ns, behind_ns = pipeline->behind.ns;

	if (pipeline->behind.samples < FEW)
		return pipeline->behind.samples >= VERY_FEW &&
		       behind_ns > 2 * alone_ns + cycle_ns;
	pipeline->doubted = behind_ns > alone_ns + (pipeline->alone.off_ns + cycle_ns) / 4 * 3;
	return pipeline->doubted && (before || pipeline->depth <= FOUND_GOOD);
}

static void go_on(struct device *device)
{
	struct pipeline *pipeline = &device->pipeline;

	if (pipeline->depth == 1 && !pipeline->trying) {
		if (pipeline->alone.samples < SAMPLES ||
		    device->now_ns - pipeline->since_ns < pipeline->hold_ns)
			return;
		pipeline->trying = true;
		pipeline->since_ns = device->now_ns;
	} else {
		if (pipeline->behind.samples < FEW)
			return;
		pipeline->trying = false;
		pipeline->depth += pipeline->depth < DEPTH_MAX && !pipeline->doubted;
	}
	pipeline->behind = (struct pipeline_mean){ 0 };
}

static void go_back(struct device *device)
{
	struct pipeline *pipeline = &device->pipeline;
	const bool soon = device->now_ns - pipeline->since_ns < SECOND;
	const uint64_t longer_ns = 2 * pipeline->hold_ns;

	*pipeline = (struct pipeline){
		.depth = 1, .since_ns = device->now_ns,
		.hold_ns = !soon ? 0 : longer_ns < HOLD_NS ? HOLD_NS :
			   longer_ns < HOLD_MAX_NS ? longer_ns : HOLD_MAX_NS,
	};
}

void pipeline_learn(struct device *device, const mailbox_entry_t *entry)
{
	struct pipeline *pipeline = &device->pipeline;

	if (entry->tries != 1 || entry->timestamp_received < entry->timestamp_sent)
		return;
	add(entry->context ? &pipeline->behind : &pipeline->alone,
	    entry->timestamp_received - entry->timestamp_sent);
	if (queues_up(device))
		go_back(device);
	else
		go_on(device);
}

unsigned int pipeline_open(const struct device *device, pokeys_parser_t parser)
{
	const pokeys_device_t *mailbox = &device->mailbox;
	unsigned int open = 0;

	for (uint32_t i = 0; i < mailbox->in_flight_count; i++)
		open += mailbox->mailbox[mailbox->in_flight[i]].parser == parser;
	return open;
}

unsigned int pipeline_awaited(const struct device *device, pokeys_parser_t parser)
{
	const pokeys_device_t *mailbox = &device->mailbox;
	unsigned int awaited = 0;

	for (uint32_t i = 0; i < mailbox->in_flight_count; i++) {
		const mailbox_entry_t *entry = &mailbox->mailbox[mailbox->in_flight[i]];

		awaited += entry->parser == parser && !entry->missed;
	}
	return awaited;
}

const mailbox_entry_t *pipeline_find(const struct device *device, uint64_t serial)
{
	const pokeys_device_t *mailbox = &device->mailbox;

	for (uint32_t i = 0; i < mailbox->in_flight_count; i++) {
		const mailbox_entry_t *entry = &mailbox->mailbox[mailbox->in_flight[i]];

		if (entry->serial == serial)
			return entry;
	}
	return NULL;
}

static bool silent(const struct device *device)
{
	return device->now_ns - device->plan.last_io_ns > plan_answers_ns(device, SILENT);
}

bool pipeline_may(const struct device *device, pokeys_parser_t parser, bool first)
{
	const unsigned int awaited = pipeline_awaited(device, parser);
	const struct pipeline *pipeline = &device->pipeline;

	if (!awaited)
		return true;
	if (silent(device) || device->mailbox.open_count + KEPT >= device->mailbox.options.window)
		return false;
	return awaited < pipeline->depth + (first && pipeline->trying);
}

bool pipeline_send(struct device *device, enum wire_op op, const void *value,
		   pokeys_parser_t parser, pokeys_refresh_t refresh)
{
	const bool behind = pipeline_awaited(device, parser) != 0;

	return request_send_once(device, op, value, parser, refresh, (void *)(uintptr_t)behind);
}

bool pipeline_take(struct device *device, const mailbox_entry_t *entry, uint64_t *taken)
{
	if (entry->serial < *taken) {
		device->meter.overtaken++;
		return false;
	}
	*taken = entry->serial;
	return true;
}

void pipeline_begin(struct device *device)
{
	device->pipeline = (struct pipeline){ .depth = 1, .since_ns = device->now_ns };
}
