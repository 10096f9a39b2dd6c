/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * When the thread runs and when it does not.
 *
 * sleep mode: while requests are in flight the thread sleeps in the
 * transport's wait, which a reply or a deadline ends; so a late reply is
 * taken when it comes, and a lost one is asked for again at its deadline, not
 * in the next cycle. When nothing is in flight it sleeps in clock_nanosleep
 * instead: stray packets then wake nobody.
 *
 * spin mode: the thread polls after a tick, and again from a little before
 * the next one so that it is awake when it comes. In between it sleeps,
 * because the kernel stops a SCHED_FIFO thread that never does for 50 ms in
 * each second (sched_rt_runtime_us). So in each period it runs for at most
 * `duty` of it. Only with duty = 1, which needs that throttling switched off,
 * does it poll all the time.
 *
 * Ticks lie on a grid, which the phase lock may shift (follow.c). One that is
 * missed by more than half a period is skipped and counted, never caught up:
 * after a stall of five seconds there is one cycle and not a burst of them. The
 * thread's lateness at its first wake-up goes into the histogram whether or not
 * the tick was skipped.
 */
#include <errno.h>
#include <time.h>
#include "daemon/device/histogram.h"
#include "daemon/rt/internal.h"

#define LEAD_NS		UINT64_C(60000)
#define TELL_NS		UINT64_C(10000000000)
#define DIAG_NS		UINT64_C(100000000)

static uint64_t read_clock(clockid_t clock)
{
	struct timespec t;

	clock_gettime(clock, &t);
	return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

static uint64_t clock_now(void *context)
{
	(void)context;
	return read_clock(CLOCK_MONOTONIC);
}

static uint64_t clock_boot(void *context)
{
	(void)context;
	return read_clock(CLOCK_BOOTTIME);
}

static void clock_sleep_until(void *context, uint64_t until_ns)
{
	const struct timespec t = {
		(time_t)(until_ns / 1000000000u),
		(long)(until_ns % 1000000000u),
	};

	(void)context;
	while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL) == EINTR)
		;
}

void pace_init(struct loop *loop)
{
	const struct loop_options *o = &loop->options;
	struct loop_private *own = loop->own;
	double running = o->duty * (double)o->period_ns;

	own->clock = (struct loop_clock){ clock_now, clock_boot, clock_sleep_until, NULL };
	own->window_ns = (uint64_t)(o->collect * (double)o->period_ns);
	own->diag_cycles = DIAG_NS / o->period_ns;
	follow_init(loop);
	if (o->mode == LOOP_SLEEP)
		return;
	if (o->duty >= 1.0) {
		own->spin_ns = o->period_ns;
		own->lead_ns = o->period_ns;
		return;
	}
	own->lead_ns = running / 2 < (double)LEAD_NS ? (uint64_t)(running / 2) : LEAD_NS;
	own->spin_ns = (uint64_t)running - own->lead_ns;
}

void pace_begin(struct loop *loop)
{
	loop->own->tick_ns = loop_now(loop) + loop->options.period_ns;
}

/*
 * Until when to poll, from `now`: 0 = sleep. Between the two polling parts of
 * a period *until_ns is brought forward to the beginning of the second.
 */
static bool polls(const struct loop *loop, uint64_t now, uint64_t *until_ns)
{
	const struct loop_private *own = loop->own;
	uint64_t stop = own->began_ns + own->spin_ns;
	uint64_t again = own->tick_ns - own->lead_ns;

	if (loop->options.mode == LOOP_SLEEP)
		return false;
	if (again <= stop || now >= again)
		return true;
	if (now < stop) {
		if (*until_ns > stop)
			*until_ns = stop;
		return true;
	}
	if (*until_ns > again)
		*until_ns = again;
	return false;
}

void pace_wait(struct loop *loop, uint64_t until_ns)
{
	struct transport *t = loop->transport;

	t->spin = polls(loop, loop_now(loop), &until_ns);
	t->ops->wait(t, until_ns);
}

/* Nothing is in flight: away until then, awake for the tick in spin mode. */
static void idle(struct loop *loop, uint64_t until_ns)
{
	struct loop_private *own = loop->own;
	uint64_t now = loop_now(loop), sleep_until = until_ns;

	if (loop->options.mode == LOOP_SPIN)
		sleep_until = until_ns - own->lead_ns;
	if (sleep_until > now) {
		own->sleeps++;
		own->clock.sleep_until(own->clock.context, sleep_until);
	}
	while (sleep_until < until_ns && loop_now(loop) < until_ns && !loop->transport->failed) {
		loop->transport->spin = true;
		loop->transport->ops->wait(loop->transport, until_ns);
		exchange_take(loop, until_ns);
	}
}

/* Until the tick: take late replies, resend what was lost, else be away. */
static void serve(struct loop *loop, uint64_t until_ns)
{
	while (loop_now(loop) < until_ns && !loop->transport->failed) {
		if (exchange_deadline(loop) == UINT64_MAX)
			idle(loop, until_ns);
		else
			exchange_once(loop, until_ns);
	}
}

static void tell_skipped(struct loop *loop, uint64_t now)
{
	struct loop_private *own = loop->own;
	struct event e = {
		.t_ns = now,
		.code = EVENT_CYCLE_SKIPPED,
		.level = EVENT_WARNING,
		.device = 255,
		.a = (int64_t)(own->skipped - own->skipped_told),
	};

	if (!e.a || (own->skipped_told && now - own->skipped_told_ns < TELL_NS))
		return;
	event_push(&loop->events, &e);
	own->skipped_told = own->skipped;
	own->skipped_told_ns = now;
}

uint64_t pace_await_tick(struct loop *loop)
{
	struct loop_private *own = loop->own;
	uint64_t period = loop->options.period_ns, now, missed;
	bool first = true;

	do {
		serve(loop, own->tick_ns);
		now = loop_now(loop);
		if (now < own->tick_ns) /* the transport has failed */
			now = own->tick_ns;
		if (first)
			histogram_add(&own->wakeup, now - own->tick_ns);
		first = false;
		missed = (now - own->tick_ns + period / 2) / period;
		own->tick_ns += missed * period;
		own->skipped += missed;
	} while (missed);
	atomic_store_explicit(&loop->shared.skipped, own->skipped, memory_order_relaxed);
	tell_skipped(loop, now);
	own->began_ns = own->tick_ns;
	own->tick_ns += period;
	return now;
}
