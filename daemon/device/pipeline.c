/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Requests that are sent in every cycle, also while older ones of the same kind are open.
 *
 * A reply that is lost, or late, then costs nothing but itself: the next request is out
 * already. Only one that is late while it is the newest is repeated. Replies may overtake
 * each other; one is taken if its request is newer than that of the one taken before.
 *
 * A device that needs more than a cycle for the requests of a cycle must not get another one
 * before it has replied. Otherwise requests queue in the device, and everything reaches it
 * later by the length of the queue. Round trips alone do not show whether the connection or
 * the device is slow, because a connection that keeps packets in order has a queue of its own.
 * The delay does show it: the round trip and the time to the next reply. On a slow
 * connection, more open requests shorten the second part. In a slow device, they lengthen the
 * first part by more than that.
 *
 * So one additional 0xCC is tried first. If it does not make the delay of the status longer,
 * the depth of all is raised by one, and so on. It returns to one if the delay gets longer than
 * it was with one at a time, or twice as long as the least one since then. Above a depth of
 * 2, two comparisons in a row have to say so, because round trips come in waves. The pause
 * until the next attempt doubles if failures repeat.
 *
 * If no replies arrive, one open request is enough to find the device again.
 */

#include "daemon/device/internal.h"

#define HOLD_NS (100 * MS)
#define HOLD_MAX_NS (10 * SECOND)

enum {
	SPAN = 32,    /* replies that tell the delay with one at a time */
	FEW = 16,     /* with others before them show a queue */
	VERY_FEW = 3, /* ... if it is long */
	LONG = 1024,
	FOUND_GOOD = 2, /* a depth above this was tried before */
	DEPTH_MAX = 16,
	SILENT = 32, /* so many replies missing in a row */
	KEPT = 6,    /* places for everything else */
};

static void add(struct device *device, const mailbox_entry_t *entry)
{
	struct pipeline *pipeline = &device->pipeline;
	struct pipeline_span *span = &pipeline->span;
	const uint64_t before_ns = pipeline->reply_ns, now_ns = entry->timestamp_received;

	pipeline->reply_ns = now_ns;
	if (span->round_trips >= LONG) /* nothing is behind others: this is the past */
		*span = (struct pipeline_span){ .behind = span->behind };
	if (before_ns && now_ns >= before_ns && !pipeline->skipped &&
	    now_ns - before_ns <= plan_answers_ns(device, SILENT)) {
		span->intervals++;
		span->interval_ns += now_ns - before_ns;
	}
	pipeline->skipped = false;
	if (entry->tries == 1 && now_ns >= entry->timestamp_sent) {
		span->round_trips++;
		span->round_trip_ns += now_ns - entry->timestamp_sent;
	}
}

static uint64_t delay_ns(const struct pipeline_span *span)
{
	return span->round_trips && span->intervals ? span->round_trip_ns / span->round_trips +
							      span->interval_ns / span->intervals :
						      0;
}

/* Enough replies to compare. */
static bool is_long(const struct pipeline_span *span)
{
	return span->behind >= FEW && span->round_trips >= FEW;
}

static bool queues_up(struct device *device)
{
	struct pipeline *pipeline = &device->pipeline;
	const uint64_t cycle_ns = device->config.period_ns * device->config.fast_divider;
	const uint64_t ns = delay_ns(&pipeline->span), one_ns = pipeline->one_by_one_ns;
	const bool before = pipeline->doubted;

	if (pipeline->depth == 1 && !pipeline->trying)
		return false;
	if (!is_long(&pipeline->span))
		return pipeline->span.behind >= VERY_FEW && ns > 2 * one_ns + cycle_ns;
	pipeline->doubted = ns > one_ns + one_ns / 8 || ns > 2 * pipeline->least_ns;
	return pipeline->doubted && (before || pipeline->depth <= FOUND_GOOD);
}

/* With one at a time: how long is the delay? */
static void look(struct device *device)
{
	struct pipeline *pipeline = &device->pipeline;

	if (pipeline->span.round_trips < SPAN)
		return;
	pipeline->one_by_one_ns = pipeline->least_ns = delay_ns(&pipeline->span);
	pipeline->span = (struct pipeline_span){ 0 };
	if (device->now_ns - pipeline->since_ns < pipeline->hold_ns)
		return;
	pipeline->trying = true;
	pipeline->since_ns = device->now_ns;
}

static void go_on(struct device *device)
{
	struct pipeline *pipeline = &device->pipeline;

	if (pipeline->depth == 1 && !pipeline->trying) {
		look(device);
		return;
	}
	if (!is_long(&pipeline->span))
		return;
	if (delay_ns(&pipeline->span) < pipeline->least_ns)
		pipeline->least_ns = delay_ns(&pipeline->span);
	pipeline->trying = false;
	pipeline->depth += pipeline->depth < DEPTH_MAX && !pipeline->doubted;
	pipeline->span = (struct pipeline_span){ 0 };
}

static void go_back(struct device *device)
{
	struct pipeline *pipeline = &device->pipeline;
	const bool soon = device->now_ns - pipeline->since_ns < SECOND;
	const uint64_t longer_ns = 2 * pipeline->hold_ns;

	*pipeline = (struct pipeline){
		.depth = 1,
		.since_ns = device->now_ns,
		.hold_ns = !soon                   ? 0 :
			   longer_ns < HOLD_NS     ? HOLD_NS :
			   longer_ns < HOLD_MAX_NS ? longer_ns :
						     HOLD_MAX_NS,
	};
}

void pipeline_skip(struct device *device)
{
	device->pipeline.skipped = true;
}

void pipeline_learn(struct device *device, const mailbox_entry_t *entry, bool status)
{
	if (!status)
		device->pipeline.span.behind += entry->context != NULL && entry->tries == 1;
	if (status == (device->image.capability.pulse_engine >= 2))
		add(device, entry);
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
