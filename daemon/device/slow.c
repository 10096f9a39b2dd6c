/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The slow groups: each with a rate of its own, one request of them a cycle
 * (protocol section 3.25).
 *
 * Rates go by the clock, not by counting cycles: the next turn of a group is
 * one period after this one began. So a stall or a run of lost packets is
 * never caught up with a burst. Whoever has waited longest goes first, which
 * makes the list rotate by itself when there is less room than work.
 *
 * What a firmware has never answered is asked less and less often, so that it
 * costs nothing to those that do answer.
 *
 * With slow_together all groups share their moments, which are counted from the
 * beginning: a group that was asked in between (an index pulse, a doubt) is back in
 * step at the next one. PoNET stays outside, for its readings take several steps.
 */

#include <string.h>
#include "daemon/device/internal.h"

#define OVERDUE_NS (4 * MS)	/* then it takes the place of a fast request */

#define RATE_NS (1 * SECOND)	/* over which rates are measured */

enum {
	OPEN_MAX = 2, /* awaited at once: a slow device must not drown in them */
	FAILURES_FEW = 3,
	FAILURES_MAX = 6, /* doublings of the period */
};

static bool is_together(const struct device *device, unsigned int group)
{
	return device->config.slow_together && group != SLOW_PONET;
}

/* 0 = never by itself. */
static uint64_t period_of(const struct device *device, unsigned int group)
{
	const double hertz = is_together(device, group) ? device->config.slow_hz :
							  slow_groups[group].hertz(&device->config);
	const unsigned int failures = device->plan.slow[group].failures;

	if (!(hertz > 0.001))
		return 0;
	return (uint64_t)(1e9 / hertz) << (failures < FAILURES_MAX ? failures : FAILURES_MAX);
}

static uint64_t next_due(const struct device *device, unsigned int group)
{
	const uint64_t period = period_of(device, group);

	if (!period)
		return UINT64_MAX;
	if (!is_together(device, group))
		return device->now_ns + period;
	return device->now_ns + period - (device->now_ns - device->plan.slow_since_ns) % period;
}

static void ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
		  uint64_t now_ns)
{
	struct device *device = device_of(mailbox);
	const unsigned int group = (unsigned int)(uintptr_t)context;
	struct slow *slow = &device->plan.slow[group];

	device->now_ns = now_ns;
	slow->open = false;
	if (!answered(entry)) {
		if (!slow->answered && slow->failures < FAILURES_MAX)
			slow->failures++;
		if (group == SLOW_PONET && entry->state != POKEYS_REQUEST_CANCELLED)
			ponet_unanswered(device);
		return;
	}
	slow->failures = 0;
	slow->answered = true;
	slow->count++;
	slow_groups[group].take(device, entry);
	device->image.t_slow_ns = entry->timestamp_received;
	meter_reply(device, entry, false);
}

/* The group that has waited longest, SLOW_GROUPS = none is due, or enough are open. */
static unsigned int longest_due(const struct device *device)
{
	uint64_t oldest = device->now_ns + 1;
	unsigned int found = SLOW_GROUPS, open = 0;

	for (unsigned int i = 0; i < SLOW_GROUPS; i++) {
		const struct slow *slow = &device->plan.slow[i];

		open += slow->open && !is_together(device, i);
		if (slow->open || slow->due_ns >= oldest || !slow_groups[i].has(device))
			continue;
		oldest = slow->due_ns;
		found = i;
	}
	if (found < SLOW_GROUPS && is_together(device, found))
		return found;
	return open < OPEN_MAX ? found : SLOW_GROUPS;
}

bool slow_overdue(const struct device *device)
{
	const unsigned int group = longest_due(device);

	return group < SLOW_GROUPS &&
	       device->now_ns - device->plan.slow[group].due_ns >= OVERDUE_NS;
}

static bool send_group(struct device *device, unsigned int group)
{
	union slow_request request;
	struct slow *slow;
	enum wire_op op;

	memset(&request, 0, sizeof(request));
	op = slow_groups[group].ask(device, &request);
	if (!request_send(device, op, &request, ended, NULL, (void *)(uintptr_t)group))
		return false;
	slow = &device->plan.slow[group];
	slow->open = true;
	slow->due_ns = next_due(device, group);
	return true;
}

bool slow_send(struct device *device)
{
	const unsigned int group = longest_due(device);

	return group < SLOW_GROUPS && send_group(device, group);
}

/* These have a place of their own in a cycle's budget. */
bool slow_send_together(struct device *device)
{
	const unsigned int group = longest_due(device);

	if (group == SLOW_GROUPS || !is_together(device, group))
		return false;
	device->budget++;
	if (send_group(device, group))
		return true;
	device->budget--;
	return false;
}

static void at_once(struct device *device, unsigned int group)
{
	struct slow *slow = &device->plan.slow[group];
	const uint64_t when = device->now_ns > OVERDUE_NS ? device->now_ns - OVERDUE_NS : 0;

	if (slow->due_ns > when)
		slow->due_ns = when;
}

void slow_encoders_now(struct device *device, unsigned int bank)
{
	const unsigned int group = bank ? SLOW_ENCODERS_HIGH : SLOW_ENCODERS_LOW;

	if (device->plan.slow[group].failures < FAILURES_FEW)
		at_once(device, group);
}

/*
 * However often they had no answer before: these every device has answered while
 * it was identified, and outputs and axes wait for them.
 */
void slow_identity_now(struct device *device)
{
	at_once(device, SLOW_TICK);
	at_once(device, SLOW_IDENTITY);
}

void slow_rates(struct device *device)
{
	struct plan *plan = &device->plan;
	const uint64_t elapsed = device->now_ns - plan->rates_ns;

	if (elapsed < RATE_NS)
		return;
	for (unsigned int i = 0; i < SLOW_GROUPS; i++) {
		device->image.slow_millihertz[i] = (uint32_t)(plan->slow[i].count *
							      UINT64_C(1000000000000) / elapsed);
		plan->slow[i].count = 0;
	}
	plan->rates_ns = device->now_ns;
}

void slow_counters(struct device *device)
{
	struct plan *plan = &device->plan;

	plan->counters = 0;
	for (unsigned int i = 0; i < POKEYS_PINS; i++) {
		if (device->image.pin_function[i] & WIRE_PIN_COUNTER)
			plan->counter_pin[plan->counters++] = (uint8_t)i;
	}
	/* functions are read often: the turn goes on, or the last ones would never have it */
	if (plan->counter_next >= plan->counters)
		plan->counter_next = 0;
}

/* All are due at the beginning, so that the image is soon complete. */
void slow_begin(struct device *device)
{
	for (unsigned int i = 0; i < SLOW_GROUPS; i++)
		device->plan.slow[i].due_ns = device->now_ns;
	device->plan.rates_ns = device->now_ns;
	device->plan.slow_since_ns = device->now_ns;
	slow_counters(device);
}
