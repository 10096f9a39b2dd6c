/* SPDX-License-Identifier: MIT */
/*
 * What happens when a deadline passes: resend, or end.
 *
 * The list of what is in flight is copied first, for parsers and refresh
 * callbacks may create, send and cancel while we go through it; each id is
 * then looked at again. A request that was sent meanwhile has a deadline in
 * the future and is left alone.
 *
 * After a stall of the caller every deadline has passed at once. Nothing is
 * caught up: each request is resent at most once, as far as the budget goes,
 * and its next deadline counts from now (invariant I5).
 */

#include <string.h>
#include "daemon/engine/mailbox.h"

static int resend(pokeys_device_t *dev, mailbox_entry_t *entry, uint64_t now_ns)
{
	entry->retries_left--;
	if (!mailbox_budget_resend(dev)) {
		dev->statistics.refused_budget++;
		mailbox_wait(dev, entry, now_ns);
		return 0;
	}
	if (!mailbox_refresh(dev, entry))
		return 1;
	mailbox_transmit(dev, entry, now_ns);
	return 1;
}

static int expire(pokeys_device_t *dev, mailbox_entry_t *entry, uint64_t now_ns)
{
	mailbox_deadline_missed(dev, entry, now_ns);
	mailbox_try_missed(dev, entry);
	if (entry->request_class == POKEYS_CLASS_ONESHOT) {
		mailbox_end(dev, entry, POKEYS_REQUEST_UNKNOWN, now_ns);
		return 1;
	}
	if (entry->retries_left <= 0) {
		if (!entry->tries) {	/* the transport took none of them */
			dev->statistics.missed++;
			dev->statistics.lost++;
		}
		mailbox_end(dev, entry, POKEYS_REQUEST_TIMED_OUT, now_ns);
		return 1;
	}
	return resend(dev, entry, now_ns);
}

int pokeys_device_check(pokeys_device_t *dev, uint64_t now_ns)
{
	const uint64_t now = mailbox_time(dev, now_ns);
	const uint32_t count = dev->in_flight_count;
	uint8_t ids[POKEYS_WINDOW_MAX];
	int handled = 0;

	mailbox_budget_fill(dev, now);
	memcpy(ids, dev->in_flight, count);
	for (uint32_t i = 0; i < count; i++) {
		mailbox_entry_t *entry = &dev->mailbox[ids[i]];

		if (entry->state == POKEYS_REQUEST_IN_FLIGHT && entry->deadline <= now)
			handled += expire(dev, entry, now);
	}
	return handled;
}

uint64_t pokeys_device_next_deadline(const pokeys_device_t *dev)
{
	uint64_t next = UINT64_MAX;

	for (uint32_t i = 0; i < dev->in_flight_count; i++) {
		const uint64_t deadline = dev->mailbox[dev->in_flight[i]].deadline;

		if (deadline < next)
			next = deadline;
	}
	return next;
}
