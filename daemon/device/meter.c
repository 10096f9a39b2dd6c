/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * How well the link does: counters, histograms, and the few lines that are
 * worth a line.
 *
 * A bad cable makes thousands of bad packets. Each kind is told the first
 * time and then at most once in ten seconds, with how many there were; the
 * counters in the images have them all.
 *
 * The error level follows hm2_eth: two up for a missed deadline, one down for an answer,
 * so that it shows how things are now and a good minute clears a bad second.
 */

#include "daemon/device/internal.h"

#define SAY_AGAIN_NS (10 * SECOND)

enum {
	LEVEL_UP = 2,
	LEVEL_MAX = 10000,
};

static uint64_t stray(const struct pokeys_statistics *s)
{
	return s->not_in_flight + s->bad_operation;
}

static uint64_t corrupt(const struct device *device, const struct pokeys_statistics *s)
{
	return s->bad_length + s->bad_magic + s->bad_checksum + s->bad_check + device->meter.odd;
}

static void say_kind(struct device *device, enum event_packets kind, uint64_t count)
{
	struct meter *meter = &device->meter;
	uint64_t *said = &meter->said_ns[kind];

	if (count == meter->said_count[kind] || (*said && device->now_ns - *said < SAY_AGAIN_NS))
		return;
	device_say(device, EVENT_PACKETS, EVENT_WARNING, kind,
		   (int64_t)(count - meter->said_count[kind]), 0);
	*said = device->now_ns;
	meter->said_count[kind] = count;
}

static void follow_level(struct meter *meter, const struct pokeys_statistics *now)
{
	const uint64_t misses = now->missed - meter->before.missed;
	const uint64_t answers = now->accepted - meter->before.accepted;
	const uint64_t up = meter->level + misses * LEVEL_UP;
	const uint64_t level = up > answers ? up - answers : 0;

	meter->level = level < LEVEL_MAX ? (uint32_t)level : LEVEL_MAX;
}

void meter_cycle(struct device *device)
{
	const struct pokeys_statistics *now = &device->mailbox.statistics;

	follow_level(&device->meter, now);
	device->meter.before = *now;
	/* While nobody is there, lost packets are no news, and the fault says who cannot send. */
	if (running(device)) {
		say_kind(device, EVENT_PACKETS_MISSED, now->missed);
		say_kind(device, EVENT_PACKETS_NOT_SENT, now->send_failed);
	}
	say_kind(device, EVENT_PACKETS_STRAY, stray(now));
	say_kind(device, EVENT_PACKETS_CORRUPT, corrupt(device, now));
	say_kind(device, EVENT_PACKETS_WRONG_SOURCE, now->bad_source);
}

void meter_reply(struct device *device, const mailbox_entry_t *entry, bool fast)
{
	struct meter *meter = &device->meter;
	const uint64_t came = entry->timestamp_received;

	if (device->now_ns >= came)
		histogram_add(&meter->receive, device->now_ns - came);
	if (entry->tries != 1 || came < entry->timestamp_sent)
		return; /* which try it answers is not known */
	histogram_add(&meter->round_trip, came - entry->timestamp_sent);
	histogram_add(&meter->class_round_trip[entry->request_class], came - entry->timestamp_sent);
	if (fast)
		histogram_add(&meter->fast_round_trip, came - entry->timestamp_sent);
}

static uint32_t narrow(uint64_t ns)
{
	return ns < UINT32_MAX ? (uint32_t)ns : UINT32_MAX;
}

void meter_publish(const struct device *device, struct pokeys_link_statistics *out)
{
	struct pokeys_statistics s;

	pokeys_device_statistics(&device->mailbox, &s);
	*out = (struct pokeys_link_statistics){
		.sent = s.sent,
		.resent = s.resent,
		.received = s.received,
		.accepted = s.accepted,
		.missed = s.missed,
		.late = s.late,
		.lost = s.lost,
		.timed_out = s.timed_out,
		.stray = stray(&s),
		.duplicate = s.duplicate,
		.stale = s.stale + device->meter.overtaken,
		.corrupt = corrupt(device, &s),
		.wrong_source = s.bad_source,
		.send_failed = s.send_failed,
		.cycles_late = device->meter.cycles_late,
		.reconnects = device->meter.reconnects,
		.rtt_last_ns = narrow(s.rtt_last_ns),
		.rtt_smoothed_ns = narrow(s.rtt_smoothed_ns),
		.rtt_variation_ns = narrow(s.rtt_variation_ns),
		.rtt_min_ns = narrow(s.rtt_min_ns),
		.rtt_max_ns = narrow(s.rtt_max_ns),
		.deadline_ns = narrow(s.deadline_ns),
		.in_flight = s.in_flight,
		.packet_error_level = device->meter.level,
		.refused_command = device->intake.refused,
		.one_shot_refused = device->one_shots.refused,
	};
}
