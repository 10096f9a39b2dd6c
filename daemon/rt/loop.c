/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * From the first cycle to the last.
 *
 * All memory is allocated in loop_prepare and mapped with MAP_POPULATE, so
 * that the realtime thread is not the first to touch it. From loop_run on
 * nothing in this room allocates, locks, logs or blocks but for the waits in
 * pace.c; what has to be said goes into the event ring.
 *
 * Stopping is a state of the devices, not of the loop: when it is asked to
 * end, the loop tells every device to seek its safe state and goes on cycling
 * until each has acknowledged it or does not answer. A device that never gets
 * there must not hold up the machine's shutdown: after STOP_NS the loop ends
 * anyway, and says which it was. The last image says that the daemon is ending, so
 * that readers need not wait for it to grow old.
 */
#include <errno.h>
#include <sys/mman.h>
#include "daemon/rt/internal.h"
#include "daemon/rt/realtime.h"

#define STOP_NS		UINT64_C(800000000)
#define PERIOD_MIN_NS	UINT64_C(250000)
#define PERIOD_MAX_NS	UINT64_C(4000000)

static bool valid(const struct loop *loop)
{
	const struct loop_options *o = &loop->options;

	return o->period_ns >= PERIOD_MIN_NS && o->period_ns <= PERIOD_MAX_NS &&
	       o->collect >= 0.1 && o->collect <= 0.9 &&
	       (o->mode == LOOP_SLEEP || (o->duty >= 0.1 && o->duty <= 1.0)) && loop->count >= 1 &&
	       loop->count <= TRANSPORT_CHANNELS;
}

int loop_prepare(struct loop *loop)
{
	double limit = realtime_duty_limit();
	int rc = 0;

	if (!valid(loop))
		return -EINVAL;
	if (loop->options.duty > limit)
		loop->options.duty = limit;
	loop->own = mmap(NULL, sizeof *loop->own, PROT_READ | PROT_WRITE,
			 MAP_PRIVATE | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
	if (loop->own == MAP_FAILED) {
		loop->own = NULL;
		return -ENOMEM;
	}
	pace_init(loop);
	for (uint32_t i = 0; i < loop->count && rc == 0; i++)
		rc = loop->transport->ops->attach(loop->transport, i);
	if (rc < 0)
		loop_release(loop);
	return rc;
}

void loop_release(struct loop *loop)
{
	if (loop->own)
		munmap(loop->own, sizeof *loop->own);
	loop->own = NULL;
}

static int port_send(void *context, const uint8_t *packet, size_t length)
{
	const struct loop_port *port = context;
	struct transport *t = port->loop->transport;
	int rc = t->ops->send(t, port->channel, packet, length);

	if (rc == 0)
		point_sent(port->loop, port->channel, packet, length);
	return rc;
}

void loop_io(struct loop *loop, uint32_t channel, struct pokeys_io *out)
{
	struct loop_port *port = &loop->port[channel];

	*port = (struct loop_port){ loop, channel };
	*out = (struct pokeys_io){ .send = port_send, .context = port };
}

static void begin_stop(struct loop *loop)
{
	uint64_t now = loop_now(loop);

	loop->own->stopping = true;
	loop->own->stop_ns = now;
	for (uint32_t i = 0; i < loop->count; i++)
		device_stop(loop->devices[i].device, now);
}

static bool all_stopped(const struct loop *loop)
{
	for (uint32_t i = 0; i < loop->count; i++)
		if (!device_stopped(loop->devices[i].device))
			return false;
	return true;
}

/* After a cycle: is it time to end? */
static bool finished(struct loop *loop)
{
	if (!loop->own->stopping) {
		if (atomic_load_explicit(&loop->shared.stop, memory_order_relaxed))
			begin_stop(loop);
		return false;
	}
	return all_stopped(loop) || loop_now(loop) - loop->own->stop_ns >= STOP_NS;
}

/* The transport is broken for good: say so, there is no next cycle. */
static int give_up(struct loop *loop, int rc)
{
	const struct event e = {
		.t_ns = loop_now(loop),
		.code = EVENT_TRANSPORT,
		.level = EVENT_ERROR,
		.device = 255,
		.a = rc,
	};

	event_push(&loop->events, &e);
	return rc;
}

static void end_devices(struct loop *loop)
{
	for (uint32_t i = 0; i < loop->count; i++)
		device_ended(loop->devices[i].device, loop_now(loop));
}

static void publish_last(struct loop *loop)
{
	loop->own->stopping = true;
	publish_states(loop, loop_all(loop));
	for (uint32_t i = 0; i < loop->count; i++)
		publish_diag(loop, i);
}

int loop_run(struct loop *loop)
{
	struct transport *t = loop->transport;
	int rc = t->ops->start(t);

	faults_begin(loop);
	if (rc == 0) {
		pace_begin(loop);
		do {
			cycle_run(loop);
			rc = t->failed;
		} while (rc == 0 && !finished(loop));
	}
	if (rc < 0)
		give_up(loop, rc);
	end_devices(loop);
	publish_last(loop);
	t->ops->flush(t);
	atomic_store(&loop->shared.ended, true);
	return rc;
}
