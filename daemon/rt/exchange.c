/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Packets in and out, for all devices together.
 *
 * Two bounds keep a bad network from eating the cycle. Taking packets stops
 * at a time limit, so that a flood from a device's own address cannot hold up
 * the next tick. And a device whose deadline has passed and stays passed is
 * not checked again before CHECK_NS have gone by, or this would be a busy
 * loop at realtime priority.
 *
 * An answer that waits in the socket must not be taken for a lost one: a thread
 * that woke up late finds the deadline passed and the answer there. So as long as
 * packets are waiting, only what is overdue by GRACE_NS is given up.
 *
 * A socket that lost its route or its local address stays broken until it is
 * connected again, so that is done here, every AIM_NS while it is needed; so
 * the daemon may be started before the network.
 */
#include "daemon/rt/internal.h"
#include "daemon/rt/probes.h"

#define AIM_NS		UINT64_C(100000000)
#define CHECK_NS	UINT64_C(20000)
#define GRACE_NS	UINT64_C(5000000)

static void tell_aim(struct loop *loop, uint32_t i, int rc, uint64_t now_ns)
{
	struct loop_member *m = &loop->own->member[i];
	const struct event e = {
		.t_ns = now_ns,
		.code = EVENT_TRANSPORT,
		.level = EVENT_WARNING,
		.device = (uint8_t)i,
		.a = rc,
	};

	if (rc < 0 && rc != m->aim_error)
		event_push(&loop->events, &e);
	m->aim_error = rc;
}

static void aim(struct loop *loop, uint32_t i, uint64_t now_ns)
{
	struct loop_member *m = &loop->own->member[i];
	const struct transport_address to = {
		.address = (uint32_t)(m->address >> 16),
		.port = (uint16_t)m->address,
		.interface = (uint16_t)(m->address >> 48),
	};
	int rc = loop->transport->ops->aim(loop->transport, i, &to);

	m->aimed = rc == 0;
	m->aim_after_ns = now_ns + AIM_NS;
	tell_aim(loop, i, rc, now_ns);
}

void exchange_aim(struct loop *loop, uint64_t now_ns)
{
	const uint64_t in_use = atomic_load_explicit(&loop->shared.in_use, memory_order_relaxed);

	for (uint32_t i = 0; i < loop->count; i++) {
		struct loop_member *m = &loop->own->member[i];
		uint64_t wish = atomic_load_explicit(&loop->shared.address[i],
						     memory_order_relaxed);

		device_set_in_use(loop->devices[i].device, in_use >> i & 1);
		if (wish != m->address) {
			m->address = wish;
			aim(loop, i, now_ns);
			device_set_address(loop->devices[i].device, (uint32_t)(wish >> 16),
					   (uint16_t)wish, now_ns);
		} else if (wish && (!m->aimed || loop->transport->error[i]) &&
			   now_ns >= m->aim_after_ns) {
			aim(loop, i, now_ns);
		}
	}
}

static void deliver(struct loop *loop, const struct transport_packet *p, uint64_t now_ns)
{
	const struct pokeys_rx rx = { .t_ns = p->t_ns, .address = p->address, .port = p->port };
	struct loop_private *own = loop->own;
	struct device *device;

	if (p->channel >= loop->count)
		return;
	device = loop->devices[p->channel].device;
	PROBE4(receive, p->channel, p->t_ns, now_ns, p->length);
	device_deliver(device, p->data, p->length, &rx, now_ns);
	point_received(loop, p, now_ns);
	if (own->pending >> p->channel & 1 && device_fast_complete(device))
		publish_state(loop, p->channel);
}

bool exchange_take(struct loop *loop, uint64_t limit_ns)
{
	struct transport_packet p;
	uint64_t now;

	while (loop->transport->ops->receive(loop->transport, &p)) {
		now = loop_now(loop);
		deliver(loop, &p, now);
		if (now >= limit_ns)
			return false;
	}
	return true;
}

uint64_t exchange_deadline(const struct loop *loop)
{
	uint64_t first = UINT64_MAX;

	for (uint32_t i = 0; i < loop->count; i++) {
		uint64_t due = device_next_deadline(loop->devices[i].device);

		if (due < first)
			first = due;
	}
	return first;
}

/* Deadlines that have passed, by more than `grace_ns`. */
static void check(struct loop *loop, uint64_t now_ns, uint64_t grace_ns)
{
	bool looked = false;

	loop->own->checked_ns = now_ns;
	for (uint32_t i = 0; i < loop->count; i++) {
		if (device_next_deadline(loop->devices[i].device) > now_ns - grace_ns)
			continue;
		if (!looked)
			suspend_look(loop, now_ns);
		looked = true;
		/* a suspend has lost it meanwhile */
		device_check(loop->devices[i].device, now_ns);
	}
}

void exchange_once(struct loop *loop, uint64_t until_ns)
{
	uint64_t due = exchange_deadline(loop);
	bool drained;

	if (due < loop->own->checked_ns + CHECK_NS)
		due = loop->own->checked_ns + CHECK_NS;
	pace_wait(loop, due < until_ns ? due : until_ns);
	drained = exchange_take(loop, until_ns);
	check(loop, loop_now(loop), drained ? 0 : GRACE_NS);
}
