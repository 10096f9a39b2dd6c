/* SPDX-License-Identifier: MIT */
/*
 * How long to wait for an answer: RFC 6298's smoothed round trip and
 * variation, with five differences that a device polled a thousand times a
 * second asks for.
 *
 * - RFC 6298 takes one sample a round trip; here every request gives one, and
 *   with its gain of a quarter the variation would be forgotten in a few
 *   milliseconds, just before the next slow answer. It rises with a quarter
 *   and falls with a 64th.
 * - The margin is never below half the round trip: on a quiet link the
 *   variation goes to zero, and any hiccup would be a resend.
 * - Several requests time out together when a packet burst is lost. The
 *   deadline doubles once for all of them: only a try that was sent after the
 *   last doubling can double it again.
 * - One-shots neither update the estimate nor double the deadline. Some keep
 *   the device busy for long (flash), some are never answered (reboot). As there
 *   is no second try to hurry for, they get the ceiling.
 * - On a bad link, some of the requests that are sent in every cycle are always lost. They
 *   double the deadline only after several misses in a row, and only once; their own is never
 *   doubled more than once. A longer wait would only extend a gap, which the first reply
 *   ends; other requests find out how long replies take now. In a silence, after many misses
 *   in a row, both limits end.
 *
 * A request that was sent more than once teaches nothing, for it is unknown
 * which try was answered (Karn); the doubled deadline stays until a request
 * answered at its first try shows what the link is like now. This is what
 * lets the deadline grow past a round trip that has become longer than it.
 *
 * A caller may say how long a try waits instead. Its timeout is taken as it
 * is: what it misses says nothing about the adaptive deadline, so it doubles
 * nothing. A one-shot still gets the ceiling if that is longer, for a timeout
 * chosen for resends would end it as unknown while its answer is on its way.
 */

#include "daemon/engine/mailbox.h"

enum {
	SMOOTHED_GAIN = 8,
	VARIATION_RISE = 4,
	VARIATION_FALL = 64,
	VARIATIONS = 4,
	BACKOFF_MAX = 20,
	IN_ROW = 4,
	SILENT = 24, /* in a row */
	ONCE_MAX = 1,
};

static uint64_t adaptive(const pokeys_device_t *dev, unsigned int doublings)
{
	const struct pokeys_statistics *s = &dev->statistics;
	const uint64_t ceiling = dev->options.deadline_ceiling_ns;
	uint64_t margin, deadline = dev->options.deadline_initial_ns;

	if (s->rtt_smoothed_ns) {
		margin = VARIATIONS * s->rtt_variation_ns;
		if (margin < s->rtt_smoothed_ns / 2)
			margin = s->rtt_smoothed_ns / 2;
		deadline = s->rtt_smoothed_ns + margin;
	}
	if (deadline < dev->options.deadline_floor_ns)
		deadline = dev->options.deadline_floor_ns;
	deadline = deadline < ceiling ? deadline << doublings : ceiling;
	return deadline < ceiling ? deadline : ceiling;
}

static uint64_t of_oneshot(const pokeys_device_t *dev)
{
	const uint64_t ceiling = dev->options.deadline_ceiling_ns;

	return dev->timeout_ns > ceiling ? dev->timeout_ns : ceiling;
}

uint64_t mailbox_deadline(const pokeys_device_t *dev, const mailbox_entry_t *entry)
{
	if (entry && entry->fixed_deadline_ns)
		return entry->fixed_deadline_ns;
	if (entry && entry->request_class == POKEYS_CLASS_ONESHOT)
		return of_oneshot(dev);
	if (dev->timeout_ns)
		return dev->timeout_ns;
	if (entry && entry->once && dev->missed_in_row < SILENT && dev->backoff > ONCE_MAX)
		return adaptive(dev, ONCE_MAX);
	return adaptive(dev, dev->backoff);
}

void mailbox_wait(const pokeys_device_t *dev, mailbox_entry_t *entry, uint64_t since_ns)
{
	const uint64_t wait = mailbox_deadline(dev, entry);

	entry->waiting_since = since_ns;
	entry->deadline = wait < UINT64_MAX - since_ns ? since_ns + wait : UINT64_MAX;
}

void pokeys_device_set_timeout(pokeys_device_t *dev, uint64_t timeout_ns)
{
	/* an adaptive deadline in force stays what it was when its try was sent */
	if (timeout_ns == dev->timeout_ns)
		return;
	dev->timeout_ns = timeout_ns;
	for (uint32_t i = 0; i < dev->in_flight_count; i++) {
		mailbox_entry_t *entry = &dev->mailbox[dev->in_flight[i]];

		mailbox_wait(dev, entry, entry->waiting_since);
	}
}

static bool teaches(const mailbox_entry_t *entry)
{
	return entry->tries == 1 && entry->request_class != POKEYS_CLASS_ONESHOT &&
	       !entry->fixed_deadline_ns;
}

static void smooth(struct pokeys_statistics *s, uint64_t rtt)
{
	const uint64_t old = s->rtt_smoothed_ns, variation = s->rtt_variation_ns;
	const uint64_t off = rtt > old ? rtt - old : old - rtt;

	if (!old) {
		s->rtt_smoothed_ns = rtt;
		s->rtt_variation_ns = rtt / 2;
		return;
	}
	s->rtt_smoothed_ns = rtt > old ? old + off / SMOOTHED_GAIN : old - off / SMOOTHED_GAIN;
	if (off > variation)
		s->rtt_variation_ns += (off - variation) / VARIATION_RISE;
	else
		s->rtt_variation_ns -= (variation - off) / VARIATION_FALL;
}

void mailbox_deadline_learn(pokeys_device_t *dev, const mailbox_entry_t *entry)
{
	struct pokeys_statistics *s = &dev->statistics;
	uint64_t rtt = 1; /* 0 stands for "no sample yet" */

	if (!teaches(entry))
		return;
	if (entry->timestamp_received > entry->timestamp_sent)
		rtt = entry->timestamp_received - entry->timestamp_sent;
	smooth(s, rtt);
	s->rtt_last_ns = rtt;
	if (!s->rtt_min_ns || rtt < s->rtt_min_ns)
		s->rtt_min_ns = rtt;
	if (rtt > s->rtt_max_ns)
		s->rtt_max_ns = rtt;
	dev->backoff = 0;
	dev->missed_in_row = 0;
}

void mailbox_deadline_missed(pokeys_device_t *dev, const mailbox_entry_t *entry, uint64_t now_ns)
{
	if (!entry->tries || entry->request_class == POKEYS_CLASS_ONESHOT ||
	    entry->fixed_deadline_ns || dev->timeout_ns)
		return;
	if (dev->missed_in_row < SILENT)
		dev->missed_in_row++;
	if (entry->timestamp_sent < dev->backoff_time || dev->backoff >= BACKOFF_MAX)
		return;
	if (entry->once && (dev->missed_in_row < IN_ROW ||
			    (dev->missed_in_row < SILENT && dev->backoff >= ONCE_MAX)))
		return;
	dev->backoff++;
	dev->backoff_time = now_ns;
}

void mailbox_deadline_forget(pokeys_device_t *dev)
{
	struct pokeys_statistics *s = &dev->statistics;

	s->rtt_last_ns = s->rtt_smoothed_ns = s->rtt_variation_ns = 0;
	s->rtt_min_ns = s->rtt_max_ns = 0;
	dev->backoff = 0;
	dev->missed_in_row = 0;
}
