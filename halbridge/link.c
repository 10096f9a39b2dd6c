/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Fresh or not: decided here, by the time stamps and our own clock.
 *
 * A dead daemon cannot raise its stale flag, so the flag is believed only
 * when it says "stale". A daemon that has not published for five of its cycles
 * (and 5 ms) is taken for dead, and its data with it, however long a silence
 * of the device may be tolerated. The age is that of inputs or positions, whichever is
 * older (pokeys_state_age_ns()); a time stamp in the future (a foreign writer) is as bad as
 * an old one.
 *
 * packet-error and its level follow hm2_eth, with one difference: at the limit
 * nothing latches. The device may have been unplugged and be back, and then
 * data are good again; whoever wants a latch on it builds one in HAL. Before anything was
 * there to attach to, nothing is an error of packets.
 */
#include "halbridge/link.h"
#include <stddef.h>
#include <string.h>

#define STALE_DEFAULT	UINT64_C(10000000)	/* the image says 0 */
#define STALE_MOST	UINT64_C(60000000000)	/* whatever the image says */
#define ALIVE_LEAST	UINT64_C(5000000)
#define ALIVE_CYCLES	5
/*
 * The device's clock is read at least every 10 s (slow-hz), and the image may have been looked
 * at as late as that behind its reading: its start seems too late then, never too early.
 */
#define START_EARLIER_MS 12000u
#define START_LATER_MS	2000u
#define START_DRIFT	1024		/* one part in so many: more than two crystals differ */

void link_init(struct link *link)
{
	memset(link, 0, sizeof(*link));
	link->limit = 10;
	link->increment = 2;
	link->decrement = 1;
}

static bool is_fresh(const struct pokeys_state *state, uint64_t age_ns)
{
	uint64_t limit = state->stale_after_ns ? state->stale_after_ns : STALE_DEFAULT;

	if (limit > STALE_MOST)
		limit = STALE_MOST;
	return state->link == POKEYS_LINK_RUNNING && !(state->flags & POKEYS_STATE_STALE) &&
	       age_ns <= limit;
}

static bool is_alive(const struct pokeys_state *state, uint64_t now_ns)
{
	uint64_t limit = state->period_ns < STALE_MOST / ALIVE_CYCLES ?
				 ALIVE_CYCLES * state->period_ns :
				 STALE_MOST;

	if (limit < ALIVE_LEAST)
		limit = ALIVE_LEAST;
	return pokeys_age_ns(state->t_publish_ns, now_ns) <= limit;
}

/* Grows while nothing comes, also when there is no image any more to tell it. */
static void show_age(struct link *link, struct values *values, uint64_t age_ns, uint64_t now_ns)
{
	if (age_ns != POKEYS_NEVER)
		link->data_ns = now_ns - age_ns;
	else if (!link->data_ns)
		link->data_ns = now_ns;
	values->age_us = (double)(now_ns - link->data_ns) / 1e3;
}

static void fill_link(struct values *values, const struct pokeys_state *state)
{
	const struct pokeys_link_statistics *statistics = &state->statistics;

	values->link_state = state->link;
	values->fault = state->fault;
	values->fault_count = state->fault_count;
	values->cycle = (uint32_t)state->cycle;
	values->reconnects = (uint32_t)statistics->reconnects;
	values->rtt_us = statistics->rtt_last_ns / 1e3;
	values->rtt_avg_us = statistics->rtt_smoothed_ns / 1e3;
	values->rtt_max_us = statistics->rtt_max_ns / 1e3;
	values->rtt_jitter_us = statistics->rtt_variation_ns / 1e3;
	values->phase_error_us = state->phase.error_ns / 1e3;
}

/* One or more, else the last good one. */
static int32_t positive(struct refusals *refusals, bool *was, int32_t *good, int32_t wanted,
			size_t offset)
{
	refusal_mark(refusals, was, wanted < 1, offset, REFUSAL_RANGE, wanted);
	if (wanted >= 1)
		*good = wanted;
	return *good;
}

static void count_errors(struct link *link, struct values *values, bool error,
			 struct refusals *refusals)
{
	int32_t limit = positive(refusals, &link->limit_bad, &link->limit,
				 values->packet_error_limit,
				 offsetof(struct values, packet_error_limit));
	int32_t up = positive(refusals, &link->increment_bad, &link->increment,
			      values->packet_error_increment,
			      offsetof(struct values, packet_error_increment));
	int32_t down = positive(refusals, &link->decrement_bad, &link->decrement,
				values->packet_error_decrement,
				offsetof(struct values, packet_error_decrement));
	int64_t level = (int64_t)values->packet_error_level + (error ? up : -down);

	level = level < 0 ? 0 : level;
	values->packet_error = error;
	values->packet_error_level = (int32_t)(level > limit ? limit : level);
	values->packet_error_exceeded = values->packet_error_level >= limit;
}

static bool missed_deadlines(struct link *link, struct values *values,
			     const struct pokeys_state *state, bool new_daemon)
{
	uint64_t missed = state->statistics.missed;
	bool more = !new_daemon && missed > link->missed;

	if (more)
		values->packet_error_total += (uint32_t)(missed - link->missed);
	link->missed = missed;
	return more;
}

static uint32_t start_ms(const struct pokeys_state *state)
{
	return (uint32_t)(state->t_publish_ns / 1000000) - state->device_tick_ms;
}

/* By the clock of the device, which an image of another daemon tells as just read. */
static bool same_start(const struct link *link, const struct pokeys_state *state)
{
	const uint32_t drift = (uint32_t)((state->t_publish_ns - link->tick_ns) / 1000000 /
					  START_DRIFT);
	const uint32_t earliest = link->start_ms - START_EARLIER_MS - drift;

	return state->device_tick_ms &&
	       start_ms(state) - earliest <= START_EARLIER_MS + START_LATER_MS + 2 * drift;
}

/*
 * A daemon says whether the device was restarted. Another daemon than before cannot know,
 * but for the device's clock.
 */
static bool counts_anew(struct link *link, const struct pokeys_state *state)
{
	const bool same = state->epoch == link->counts_of;
	const bool anew = same ? state->encoder_epoch != link->encoder_epoch :
				 !same_start(link, state);
	const bool first = !link->counts_of;

	if (!same || state->device_tick_ms != link->tick_ms) {
		link->tick_ns = state->t_publish_ns;
		link->tick_ms = state->device_tick_ms;
		link->start_ms = start_ms(state);
	}
	link->counts_of = state->epoch;
	link->encoder_epoch = state->encoder_epoch;
	return anew && !first;
}

/* Data of this time are fresh. They may have grown old before they were stale. */
static uint64_t silent_since(struct link *link, uint64_t data_ns)
{
	const uint64_t before_ns = link->fresh_ns;

	link->fresh_ns = data_ns;
	return before_ns && data_ns > before_ns && data_ns - before_ns >= LINK_SILENCE_NS ?
		       before_ns :
		       0;
}

struct link_news link_read(struct link *link, struct values *values,
			   const struct pokeys_state *state, bool refused, uint64_t now_ns,
			   struct refusals *refusals)
{
	struct link_news news = { 0 };
	uint64_t age_ns = state ? pokeys_state_age_ns(state, now_ns) : POKEYS_NEVER;
	bool error = false;

	values->attach_state = refused ? 2 : state ? 1 : 0;
	values->daemon_alive = state && is_alive(state, now_ns);
	values->phase_locked = values->daemon_alive && state->phase.state == POKEYS_PHASE_LOCKED;
	if (state) {
		link->attached = true;
		news.new_daemon = state->epoch != link->epoch;
		news.restarted = news.new_daemon && link->epoch;
		news.fresh = values->daemon_alive && is_fresh(state, age_ns);
		news.counts_anew = news.fresh && counts_anew(link, state);
		if (news.fresh)
			news.silent_ns = silent_since(link, now_ns - age_ns);
		error = missed_deadlines(link, values, state, news.new_daemon);
		link->epoch = state->epoch;
		fill_link(values, state);
	}
	show_age(link, values, age_ns, now_ns);
	values->connected = news.fresh;
	values->stale = !news.fresh;
	count_errors(link, values, link->attached && (error || !news.fresh), refusals);
	return news;
}
