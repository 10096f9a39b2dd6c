/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Images out: the state every cycle, the diagnostic image ten times a second,
 * the report of the device's settings when it has changed.
 *
 * The state is built in the shared cell itself (loan and commit), because it
 * is some kilobytes and the copy would be the larger part of the cost. What
 * others may read is then still the previous one, whole.
 *
 * The diagnostic images of several devices are spread over their tenth of a
 * second: no cycle has to carry more than one where there are fewer devices
 * than cycles in between. Each is built in memory of its own, since device and
 * loop each write only their part of it.
 */
#include <string.h>
#include "daemon/device/histogram.h"
#include "daemon/rt/internal.h"
#include "daemon/rt/probes.h"

static uint32_t own_flags(const struct loop *loop)
{
	uint32_t flags = atomic_load_explicit(&loop->shared.flags, memory_order_relaxed);

	flags &= POKEYS_STATE_REALTIME | POKEYS_STATE_FALLBACK | POKEYS_STATE_GUARD;
	return loop->own->stopping ? flags | POKEYS_STATE_STOPPING : flags;
}

/* What changed is news for those who wait for it. */
static void notice(struct loop *loop, uint32_t i, uint8_t link, uint8_t fault)
{
	struct loop_member *m = &loop->own->member[i];

	if (link == m->link && fault == m->fault && loop->own->cycle > 1)
		return;
	PROBE4(link, i, link, m->link, fault);
	m->link = link;
	m->fault = fault;
	atomic_store_explicit(&loop->shared.link[i], link, memory_order_relaxed);
	atomic_fetch_or_explicit(&loop->shared.notify, UINT64_C(1) << i, memory_order_release);
}

/* Before the state, whose report_count must not run ahead of the report. */
static void publish_report(struct loop *loop, uint32_t i, uint64_t now)
{
	struct pokeys_report *report = &loop->own->member[i].report;

	if (!device_report(loop->devices[i].device, report))
		return;
	report->t_publish_ns = now;
	shm_device_write_report(loop->devices[i].shm, report);
	atomic_fetch_or_explicit(&loop->shared.notify, UINT64_C(1) << i, memory_order_release);
}

void publish_state(struct loop *loop, uint32_t i)
{
	struct loop_private *own = loop->own;
	struct shm_device *shm = loop->devices[i].shm;
	uint64_t now = loop_now(loop), done;
	struct pokeys_state *image = shm_device_loan(shm);
	uint8_t link, fault;

	publish_report(loop, i, now);
	device_publish(loop->devices[i].device, now, image);
	image->flags |= own_flags(loop);
	follow_show(loop, &image->phase);
	link = image->link;
	fault = image->fault;
	shm_device_commit(shm);
	notice(loop, i, link, fault);
	own->pending &= ~(UINT64_C(1) << i);
	done = loop_now(loop);
	histogram_add(&own->publish, done - now);
	follow_published(loop, i, done);
	point_published(loop, i, now, done);
	shm_device_mirror(shm); /* the commander has its image already */
}

void publish_states(struct loop *loop, uint64_t mask)
{
	for (uint32_t i = 0; i < loop->count; i++)
		if (mask >> i & 1)
			publish_state(loop, i);
}

/*
 * A thread that polls has its urgent requests on their way by now. Those of one that
 * sleeps wait for it, for less than what is saved when the image is written.
 */
void publish_prepare(struct loop *loop)
{
	for (uint32_t i = 0; i < loop->count; i++)
		shm_device_prepare(loop->devices[i].shm);
}

void publish_complete(struct loop *loop)
{
	for (uint32_t i = 0; i < loop->count; i++)
		if (loop->own->pending >> i & 1 && device_fast_complete(loop->devices[i].device))
			publish_state(loop, i);
}

static void put_transport(const struct loop *loop, struct pokeys_diag *diag)
{
	const struct transport_statistics *s = &loop->transport->statistics;

	/* the loop's own sleeps as well: all that the thread does */
	diag->transport_system_calls = s->system_calls + loop->own->sleeps;
	diag->transport_waits_avoided = s->waits_avoided;
	diag->transport_rearmed = s->rearmed;
	diag->transport_no_buffers = s->no_buffers;
	diag->transport_overflow = s->overflow;
	diag->transport_truncated = s->truncated;
	strncpy(diag->transport,
		atomic_load_explicit(&loop->transport->title, memory_order_relaxed),
		sizeof diag->transport - 1);
}

static uint64_t relaxed(const _Atomic uint64_t *value)
{
	return atomic_load_explicit(value, memory_order_relaxed);
}

void publish_diag(struct loop *loop, uint32_t i)
{
	struct loop_private *own = loop->own;
	struct pokeys_diag *diag = &own->member[i].diag;

	device_diag(loop->devices[i].device, diag);
	diag->cycle = own->cycle;
	diag->t_publish_ns = loop_now(loop);
	diag->cycles_skipped = own->skipped;
	diag->events_dropped = relaxed(&loop->events.dropped);
	diag->event_high_water = atomic_load_explicit(&loop->events.high_water,
						      memory_order_relaxed);
	diag->minor_faults = relaxed(&loop->shared.minor_faults);
	diag->major_faults = relaxed(&loop->shared.major_faults);
	diag->guard_passed = relaxed(&loop->shared.guard_passed);
	diag->guard_dropped = relaxed(&loop->shared.guard_dropped);
	put_transport(loop, diag);
	diag->wakeup = own->wakeup;
	diag->publish = own->publish;
	diag->cycle_work = own->work;
	shm_device_write_diag(loop->devices[i].shm, diag);
	atomic_fetch_or_explicit(&loop->shared.notify, UINT64_C(1) << i, memory_order_release);
}

void publish_diags(struct loop *loop)
{
	const struct loop_private *own = loop->own;

	for (uint32_t i = 0; i < loop->count; i++)
		if (own->cycle % own->diag_cycles == i * own->diag_cycles / loop->count)
			publish_diag(loop, i);
}
