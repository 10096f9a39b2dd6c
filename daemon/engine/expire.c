/* SPDX-License-Identifier: MIT */
/*
 * What happens when a deadline passes: resend, or end, or wait on for a late answer.
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

static void count_unsent(pokeys_device_t *dev, const mailbox_entry_t *entry)
{
	if (entry->tries)
		return;
	dev->statistics.missed++;
	dev->statistics.lost++;
}

/* A newer one takes its place. Until then its answer is welcome, and it is sent once more. */
static int expire_once(pokeys_device_t *dev, mailbox_entry_t *entry, uint64_t now_ns)
{
	const uint64_t end = entry->waiting_since + dev->options.deadline_ceiling_ns;

	if (entry->tries == 1 && entry->retries_left > 0 && mailbox_once_is_newest(dev, entry) &&
	    mailbox_budget_spares_resend(dev)) {
		entry->retries_left = 1;
		return resend(dev, entry, now_ns);
	}
	if (entry->tries && end > now_ns) {
		entry->deadline = end;
		return 0;
	}
	count_unsent(dev, entry);
	mailbox_end(dev, entry, POKEYS_REQUEST_CANCELLED, now_ns);
	return 1;
}

static int expire(pokeys_device_t *dev, mailbox_entry_t *entry, uint64_t now_ns)
{
	if (!entry->once || entry->missed < entry->tries)
		mailbox_deadline_missed(dev, entry, now_ns);
	mailbox_try_missed(dev, entry);
	if (entry->once)
		return expire_once(dev, entry, now_ns);
	if (entry->request_class == POKEYS_CLASS_ONESHOT) {
		mailbox_end(dev, entry, POKEYS_REQUEST_UNKNOWN, now_ns);
		return 1;
	}
	if (entry->retries_left <= 0) {
		count_unsent(dev, entry); /* the transport took none of them */
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
