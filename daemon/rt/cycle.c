/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * One cycle: orders, wishes and commands in, requests out, replies in, images out.
 *
 * Each device's image is published as soon as its own fast replies are in,
 * not when everybody's are: a device that is slow, or whose reply was lost,
 * costs the others nothing. At the end of the window the rest is published as
 * it is, with the ages that show it.
 *
 * Requests and the wait for the first reply go to the kernel in one system
 * call, with two exceptions. A thread that polls hands the urgent requests over
 * before it plans the others: that is done while these are on their way, and a
 * call more costs it nothing. And in a cycle in which some devices wait for
 * replies and others do not, all are handed over before those others are
 * published.
 */
#include "daemon/device/histogram.h"
#include "daemon/rt/internal.h"

/* The newest command, NULL if there is none; *refused tells a foreign one. */
static const struct pokeys_command *read_command(struct loop *loop, uint32_t i, int *refused)
{
	struct pokeys_command *command = &loop->own->member[i].command;
	int rc = shm_device_read_command(loop->devices[i].shm, command);

	*refused = rc < 0 ? rc : 0;
	return rc == 1 ? command : NULL;
}

static void tell_foreign_wish(struct loop *loop, uint32_t i)
{
	const struct event e = {
		.t_ns = loop_now(loop),
		.code = EVENT_FOREIGN_WISH,
		.level = EVENT_WARNING,
		.device = (uint8_t)i,
	};

	event_push(&loop->events, &e);
}

/*
 * A wish that was written since the last cycle. One that says 0 where a number
 * has to be is none of a commander that knows what it does.
 */
static void read_wish(struct loop *loop, uint32_t i)
{
	struct loop_member *m = &loop->own->member[i];
	const struct pokeys_wish *wish = &m->wish;
	int rc = shm_device_read_wish(loop->devices[i].shm, &m->wish);

	if (rc < 0 || (rc == 1 && (!wish->session || !wish->generation))) {
		tell_foreign_wish(loop, i);
		return;
	}
	if (rc != 1 || (wish->session == m->wish_session && wish->generation == m->wish_generation))
		return;
	m->wish_session = wish->session;
	m->wish_generation = wish->generation;
	device_wish(loop->devices[i].device, wish);
}

/* What must not wait. */
static void ask_urgent(struct loop *loop)
{
	struct loop_private *own = loop->own;

	for (uint32_t i = 0; i < loop->count; i++) {
		const struct pokeys_command *command;
		int refused;

		read_wish(loop, i);
		command = read_command(loop, i, &refused);
		follow_command(loop, i, command);
		device_cycle(loop->devices[i].device, own->cycle, own->began_ns, loop_now(loop),
			     command, refused);
	}
	if (loop->options.mode == LOOP_SPIN) {
		own->points.asked_ns = loop_now(loop);
		loop->transport->ops->flush(loop->transport);
	}
}

/* Every device plans and queues its requests; those that wait for fast replies. */
static uint64_t ask(struct loop *loop)
{
	uint64_t wanted = 0, waiting = 0;

	ask_urgent(loop);
	publish_prepare(loop);
	for (uint32_t i = 0; i < loop->count; i++) {
		struct device *device = loop->devices[i].device;

		device_spare(device);
		waiting |= (uint64_t)!device_fast_complete(device) << i;
		wanted |= (uint64_t)device_wants_address(device) << i;
	}
	atomic_store_explicit(&loop->shared.wanted, wanted, memory_order_relaxed);
	return waiting;
}

/* Wait for fast replies until all are in or the window ends. */
static void collect(struct loop *loop, uint64_t waiting)
{
	struct loop_private *own = loop->own;
	uint64_t end = own->began_ns + own->window_ns;

	own->pending = loop_all(loop);
	if (waiting && waiting != own->pending)
		loop->transport->ops->flush(loop->transport);
	publish_states(loop, own->pending & ~waiting);
	while (own->pending && !loop->transport->failed && loop_now(loop) < end) {
		exchange_once(loop, end);
		publish_complete(loop);
	}
	publish_states(loop, own->pending);
}

void cycle_run(struct loop *loop)
{
	struct loop_private *own = loop->own;
	uint64_t skipped = own->skipped, tick = own->tick_ns, now = pace_await_tick(loop);
	uint64_t waiting;

	own->cycle++;
	point_woke(loop, tick, now, own->skipped - skipped);
	suspend_look(loop, loop_now(loop));
	exchange_aim(loop, now);
	orders_run(loop);
	waiting = ask(loop);
	if (loop->options.mode == LOOP_SLEEP)
		own->points.asked_ns = loop_now(loop);
	collect(loop, waiting);
	follow_cycle(loop);
	publish_diags(loop);
	now = loop_now(loop);
	histogram_add(&own->work, now - own->began_ns);
	point_ended(loop, now);
	atomic_store_explicit(&loop->shared.cycles, own->cycle, memory_order_relaxed);
}
