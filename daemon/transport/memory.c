/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Memory as network: what is sent goes to a hook, what arrives was put into a
 * queue ordered by time, and waiting moves the clock instead of sleeping.
 *
 * It keeps to the contract of the real ones where the loop could notice the
 * difference: datagrams leave at the flush and not before, a wait flushes
 * first and ends at the first arrival or at the deadline, never earlier, and
 * receive gives out only what has arrived by now. It counts one system call
 * for each of flush (if anything was queued) and wait (unless a packet was
 * there already), as the ring would, so that a test can hold the loop to its
 * allowance.
 */
#include <errno.h>
#include <string.h>
#include "daemon/transport/kind.h"
#include "daemon/transport/memory.h"

struct arrival {
	uint64_t at_ns;
	struct transport_address from;
	uint32_t channel;
	size_t length;
	uint8_t data[TRANSPORT_MEMORY_MAX];
};

struct leaving {
	uint32_t channel;
	size_t length;
	uint8_t data[TRANSPORT_SEND_MAX];
};

struct memory {
	struct transport base;
	struct transport_memory_hooks hooks;
	bool attached[TRANSPORT_CHANNELS], started;
	uint32_t queued;
	struct leaving queue[TRANSPORT_QUEUE];
	uint32_t count;
	/* slots, first to arrive first; then the free ones */
	uint32_t order[TRANSPORT_MEMORY_QUEUE];
	struct arrival slot[TRANSPORT_MEMORY_QUEUE];
};

static struct memory *self(struct transport *t)
{
	return (struct memory *)t;
}

static int memory_open(struct transport *t, const struct transport_options *options)
{
	(void)options;
	for (uint32_t i = 0; i < TRANSPORT_MEMORY_QUEUE; i++)
		self(t)->order[i] = i;
	return 0;
}

static void memory_close(struct transport *t)
{
	transport_memory_unmap(t, sizeof(struct memory));
}

static int memory_attach(struct transport *t, uint32_t channel)
{
	struct memory *m = self(t);

	if (channel >= TRANSPORT_CHANNELS)
		return -EINVAL;
	if (m->started || m->attached[channel])
		return -EBUSY;
	m->attached[channel] = true;
	return 0;
}

static int memory_start(struct transport *t)
{
	if (self(t)->started)
		return -EBUSY;
	self(t)->started = true;
	return 0;
}

static int memory_aim(struct transport *t, uint32_t channel, const struct transport_address *to)
{
	struct memory *m = self(t);

	if (channel >= TRANSPORT_CHANNELS || !m->attached[channel])
		return -EINVAL;
	t->statistics.system_calls++;
	return transport_aimed(t, channel, to,
			       m->hooks.aimed ? m->hooks.aimed(m->hooks.context, channel, to) : 0);
}

static int memory_flush(struct transport *t)
{
	struct memory *m = self(t);

	if (m->queued)
		t->statistics.system_calls++;
	for (uint32_t i = 0; i < m->queued; i++) {
		const struct leaving *l = &m->queue[i];

		m->hooks.sent(m->hooks.context, l->channel, l->data, l->length, *m->hooks.now_ns);
	}
	m->queued = 0;
	return 0;
}

static int memory_send(struct transport *t, uint32_t channel, const uint8_t *data, size_t length)
{
	struct memory *m = self(t);
	int rc = 0;

	if (length > TRANSPORT_SEND_MAX)
		rc = -EMSGSIZE;
	else if (channel >= TRANSPORT_CHANNELS || !m->attached[channel])
		rc = -EINVAL;
	else
		rc = t->error[channel];
	if (rc < 0) {
		t->statistics.send_failed++;
		return rc;
	}
	if (m->queued == TRANSPORT_QUEUE)
		memory_flush(t);
	m->queue[m->queued].channel = channel;
	m->queue[m->queued].length = length;
	memcpy(m->queue[m->queued++].data, data, length);
	t->statistics.sent++;
	return 0;
}

static bool arrived(const struct memory *m, uint64_t by_ns)
{
	return m->count && m->slot[m->order[0]].at_ns <= by_ns;
}

static int memory_receive(struct transport *t, struct transport_packet *out)
{
	struct memory *m = self(t);
	uint32_t first = m->order[0];
	const struct arrival *a = &m->slot[first];

	if (!arrived(m, *m->hooks.now_ns))
		return 0;
	*out = (struct transport_packet){
		.data = a->data,
		.length = a->length,
		.channel = a->channel,
		.address = a->from.address,
		.port = a->from.port,
		.t_ns = a->at_ns,
	};
	/* To the very end of the free ones: it is reused last, out->data stays valid. */
	memmove(m->order, m->order + 1, sizeof m->order - sizeof m->order[0]);
	m->order[TRANSPORT_MEMORY_QUEUE - 1] = first;
	m->count--;
	t->statistics.received++;
	return 1;
}

static enum transport_wait memory_wait(struct transport *t, uint64_t deadline_ns)
{
	struct memory *m = self(t);
	uint64_t *now = m->hooks.now_ns;

	if (arrived(m, *now)) {
		t->statistics.waits_avoided += !m->queued;
		memory_flush(t);
		return TRANSPORT_WAIT_PACKET;
	}
	t->statistics.system_calls += !m->queued;
	memory_flush(t);
	if (arrived(m, deadline_ns)) {
		if (m->slot[m->order[0]].at_ns > *now)
			*now = m->slot[m->order[0]].at_ns;
		return TRANSPORT_WAIT_PACKET;
	}
	if (deadline_ns > *now)
		*now = deadline_ns;
	return TRANSPORT_WAIT_DEADLINE;
}

static const struct transport_ops memory_ops = {
	.name = "memory",
	.open = memory_open,
	.close = memory_close,
	.attach = memory_attach,
	.start = memory_start,
	.aim = memory_aim,
	.send = memory_send,
	.flush = memory_flush,
	.receive = memory_receive,
	.wait = memory_wait,
};

int transport_memory_open(struct transport **out, const struct transport_memory_hooks *hooks)
{
	static const struct transport_kind kind = { &memory_ops, sizeof(struct memory) };
	const struct transport_options options = { 0 };
	int rc = transport_open_kind(out, &kind, &options);

	if (rc == 0)
		self(*out)->hooks = *hooks;
	return rc;
}

int transport_memory_arrive(struct transport *t, uint64_t at_ns, uint32_t channel,
			    const struct transport_address *from, const uint8_t *data,
			    size_t length)
{
	struct memory *m = self(t);
	uint32_t at = m->count, slot;

	if (m->count == TRANSPORT_MEMORY_QUEUE)
		return -ENOBUFS;
	slot = m->order[m->count];
	while (at > 0 && m->slot[m->order[at - 1]].at_ns > at_ns) {
		m->order[at] = m->order[at - 1];
		at--;
	}
	m->order[at] = slot;
	m->count++;
	m->slot[slot].at_ns = at_ns;
	m->slot[slot].from = *from;
	m->slot[slot].channel = channel;
	m->slot[slot].length = length;
	memcpy(m->slot[slot].data, data,
	       length < TRANSPORT_MEMORY_MAX ? length : TRANSPORT_MEMORY_MAX);
	return 0;
}
