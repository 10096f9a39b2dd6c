/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The ring at work: sending, receiving and the one wait for
 * packet-or-deadline in a single system call.
 *
 * Rules kept here, each of which was once broken and cost a stall:
 *  - Never wait for more than one completion: with DEFER_TASKRUN and a
 *    multishot receive, two or more sleep until the deadline.
 *  - The kernel posts completions only when this thread enters it. So an
 *    empty queue means nothing by itself: the TASKRUN flag in the ring says
 *    whether entering would show something. Looking at it costs no call.
 *  - A multishot receive ends by itself: buffers used up (-ENOBUFS), queue
 *    full, an error on the socket (nobody listens there), an empty datagram.
 *    It shows as a missing F_MORE; the packets are still in the socket, so
 *    the next wait arms it again, once: an error that repeats must not become
 *    a busy loop at realtime priority.
 *  - Buffers go back to the kernel as soon as the caller is done with them.
 *  - recvmsg, not recv: that one cuts long datagrams off silently.
 *  - Submitting and waiting are one call; and there is no call when a packet
 *    is in the ring already and nothing is to be submitted.
 *  - Never IOSQE_ASYNC: it makes kernel threads.
 *
 * Sends copy into a slot of their own, fixed to the submission entry: UDP
 * sends complete inside io_uring_enter (MSG_DONTWAIT), so a slot is free as
 * soon as the kernel took the entry. A success leaves no completion.
 */
#include <errno.h>
#include <string.h>
#include <sys/syscall.h>
#include <unistd.h>
#include "daemon/transport/uring.h"

static struct uring *self(struct transport *t)
{
	return (struct uring *)t;
}

static unsigned int pending(const struct uring *u)
{
	return u->ring.sq.sqe_tail - io_uring_smp_load_acquire(u->ring.sq.khead);
}

/* Flags of the ring: entering the kernel would show more. */
static bool deferred(const struct uring *u)
{
	return IO_URING_READ_ONCE(*u->ring.sq.kflags) & (IORING_SQ_TASKRUN | IORING_SQ_CQ_OVERFLOW);
}

int uring_enter(struct uring *u, unsigned int min, const uint64_t *deadline_ns)
{
	unsigned int flags = IORING_ENTER_GETEVENTS | IORING_ENTER_EXT_ARG | u->enter_flags;
	struct io_uring_getevents_arg argument = { .sigmask_sz = _NSIG / 8 };
	struct __kernel_timespec time;
	long rc;

	if (deadline_ns) {
		uint64_t t = *deadline_ns;

		if (!(flags & URING_ABS_TIMER)) {
			uint64_t now = stamp_now();

			t = t > now ? t - now : 0;
		}
		time.tv_sec = (int64_t)(t / 1000000000u);
		time.tv_nsec = (int64_t)(t % 1000000000u);
		argument.ts = (uintptr_t)&time;
	}
	if (IO_URING_READ_ONCE(*u->ring.sq.kflags) & IORING_SQ_CQ_OVERFLOW)
		u->base.statistics.overflow++;
	io_uring_smp_store_release(u->ring.sq.ktail, u->ring.sq.sqe_tail);
	u->base.statistics.system_calls++;
	rc = syscall(__NR_io_uring_enter, u->enter_fd, pending(u), min, flags, &argument,
		     sizeof argument);
	return rc < 0 ? -errno : (int)rc;
}

/* Errors that pass by themselves; the others mean that the ring is lost. */
static bool passing(int rc)
{
	return rc == -EINTR || rc == -ETIME || rc == -EAGAIN || rc == -EBUSY || rc == -ENOMEM ||
	       rc == -ENOBUFS;
}

/* Enter, and judge the result: -errno only if the ring is broken for good. */
static int enter(struct uring *u, unsigned int min, const uint64_t *deadline_ns)
{
	int rc = uring_enter(u, min, deadline_ns);

	if (rc >= 0 || rc == -EINTR || rc == -ETIME)
		return 0;
	if (!passing(rc)) {
		u->base.failed = rc;
		return rc;
	}
	if (min)
		transport_pause(&u->base);
	return 0;
}

/* The entry that the next submission goes into, or NULL if all are taken. */
static struct io_uring_sqe *entry(struct uring *u, unsigned int *index)
{
	struct io_uring_sqe *sqe;

	if (pending(u) >= u->sizes.submissions)
		return NULL;
	*index = u->ring.sq.sqe_tail & (u->sizes.submissions - 1);
	sqe = &u->ring.sq.sqes[*index];
	/* liburing 2.8 and newer set only the fields that an operation uses */
	memset(sqe, 0, sizeof(*sqe));
	u->ring.sq.sqe_tail++;
	return sqe;
}

static uint64_t token(enum uring_kind kind, uint32_t channel)
{
	return (uint64_t)kind << 32 | channel;
}

void uring_arm(struct uring *u)
{
	for (uint32_t i = 0; i < u->channels; i++) {
		struct uring_channel *c = &u->channel[i];
		struct io_uring_sqe *sqe;
		unsigned int index;

		if (c->udp.fd < 0 || c->armed || (c->armed_before && c->armed_in == u->waits))
			continue;
		sqe = entry(u, &index);
		if (!sqe)
			return;
		io_uring_prep_recvmsg_multishot(sqe, (int)i, &c->shape, MSG_TRUNC);
		sqe->flags |= IOSQE_FIXED_FILE | IOSQE_BUFFER_SELECT;
		sqe->user_data = token(URING_RECEIVE, i);
		u->base.statistics.rearmed += c->armed_before;
		c->armed = c->armed_before = true;
		c->armed_in = u->waits;
	}
}

void uring_recycle(struct uring *u, int id)
{
	io_uring_buf_ring_add(u->pool, u->buffers + (size_t)id * URING_BUFFER, URING_BUFFER,
			      (unsigned short)id, (int)u->sizes.buffers - 1, 0);
	io_uring_buf_ring_advance(u->pool, 1);
}

static void return_lent(struct uring *u)
{
	if (u->lent >= 0)
		uring_recycle(u, u->lent);
	u->lent = -1;
}

static struct io_uring_cqe *head(struct uring *u)
{
	unsigned int h = *u->ring.cq.khead;

	if (h == io_uring_smp_load_acquire(u->ring.cq.ktail))
		return NULL;
	return &u->ring.cq.cqes[h & *u->ring.cq.kring_mask];
}

/* Take a completion that carries no packet. */
static void note(struct uring *u, const struct io_uring_cqe *cqe)
{
	uint32_t channel = (uint32_t)cqe->user_data % TRANSPORT_CHANNELS;

	if (cqe->user_data >> 32 == URING_SEND) {
		transport_send_failed(&u->base, channel, cqe->res);
		return;
	}
	if (!(cqe->flags & IORING_CQE_F_MORE))
		u->channel[channel].armed = false;
	if (cqe->res == -ENOBUFS)
		u->base.statistics.no_buffers++;
	else
		u->base.statistics.receive_failed++;
}

/* Take all completions without a packet; true if one with a packet is at the head. */
static bool settle(struct uring *u)
{
	struct io_uring_cqe *cqe;

	while ((cqe = head(u))) {
		if (cqe->flags & IORING_CQE_F_BUFFER)
			return true;
		note(u, cqe);
		io_uring_cq_advance(&u->ring, 1);
	}
	return false;
}

/* Take a completed buffer apart; false if it holds no whole packet. */
static bool dissect(struct uring *u, int id, int length, uint32_t channel,
		    struct transport_packet *out)
{
	struct msghdr *shape = &u->channel[channel].shape;
	struct io_uring_recvmsg_out *o =
		io_uring_recvmsg_validate(u->buffers + (size_t)id * URING_BUFFER, length, shape);
	struct msghdr control = { 0 };
	uint64_t now, stamp;

	if (!o)
		return false;
	out->channel = channel;
	out->data = io_uring_recvmsg_payload(o, shape);
	out->length = o->payloadlen;
	udp_source(io_uring_recvmsg_name(o), o->namelen, out);
	control.msg_control = (uint8_t *)io_uring_recvmsg_name(o) + shape->msg_namelen;
	control.msg_controllen = o->controllen;
	now = stamp_read(&u->stamp);
	stamp = udp_stamp(&control);
	out->t_ns = stamp ? stamp_convert(&u->stamp, stamp, now) : 0;
	if (stamp && !out->t_ns)
		u->base.statistics.stamps_refused++;
	if (o->flags & MSG_TRUNC)
		u->base.statistics.truncated++;
	return true;
}

static int uring_receive(struct transport *t, struct transport_packet *out)
{
	struct uring *u = self(t);

	return_lent(u);
	while (settle(u)) {
		struct io_uring_cqe *cqe = head(u);
		uint32_t channel = (uint32_t)cqe->user_data % TRANSPORT_CHANNELS;
		int id = (int)(cqe->flags >> IORING_CQE_BUFFER_SHIFT);
		int length = cqe->res;

		if (!(cqe->flags & IORING_CQE_F_MORE))
			u->channel[channel].armed = false;
		io_uring_cq_advance(&u->ring, 1);
		if (dissect(u, id, length, channel, out)) {
			u->lent = id;
			t->statistics.received++;
			return 1;
		}
		uring_recycle(u, id);
		t->statistics.receive_failed++;
	}
	return 0;
}

static int uring_flush(struct transport *t)
{
	struct uring *u = self(t);

	return pending(u) ? enter(u, 0, NULL) : 0;
}

static int refuse(struct transport *t, int rc)
{
	t->statistics.send_failed++;
	return rc;
}

static int uring_send(struct transport *t, uint32_t channel, const uint8_t *data, size_t length)
{
	struct uring *u = self(t);
	struct io_uring_sqe *sqe;
	unsigned int index;

	if (length > TRANSPORT_SEND_MAX)
		return refuse(t, -EMSGSIZE);
	if (channel >= TRANSPORT_CHANNELS || u->channel[channel].udp.fd < 0)
		return refuse(t, -EINVAL);
	if (t->error[channel])
		return refuse(t, t->error[channel]);
	if (pending(u) >= u->sizes.submissions)
		uring_flush(t);
	sqe = entry(u, &index);
	if (!sqe)
		return refuse(t, -ENOBUFS);
	memcpy(u->slot[index], data, length);
	io_uring_prep_send(sqe, (int)channel, u->slot[index], length, MSG_DONTWAIT);
	sqe->flags |= IOSQE_FIXED_FILE | IOSQE_CQE_SKIP_SUCCESS;
	sqe->user_data = token(URING_SEND, channel);
	t->statistics.sent++;
	return 0;
}

static int uring_aim(struct transport *t, uint32_t channel, const struct transport_address *to)
{
	struct uring *u = self(t);

	if (channel >= TRANSPORT_CHANNELS || u->channel[channel].udp.fd < 0)
		return -EINVAL;
	return transport_aimed(t, channel, to,
			       udp_aim(&u->channel[channel].udp, to, &t->local[channel],
				       &t->statistics.system_calls));
}

/* Polling: the ring's own memory says whether there is anything to enter for. */
static enum transport_wait spin(struct uring *u, uint64_t deadline_ns)
{
	for (;;) {
		if ((pending(u) || deferred(u)) && enter(u, 0, NULL) < 0)
			return TRANSPORT_WAIT_DEADLINE;
		if (settle(u))
			return TRANSPORT_WAIT_PACKET;
		if (stamp_now() >= deadline_ns)
			return TRANSPORT_WAIT_DEADLINE;
		uring_arm(u);
		transport_relax();
	}
}

static enum transport_wait sleep_until(struct uring *u, uint64_t deadline_ns)
{
	for (;;) {
		if (enter(u, 1, deadline_ns == UINT64_MAX ? NULL : &deadline_ns) < 0)
			return TRANSPORT_WAIT_DEADLINE;
		if (settle(u))
			return TRANSPORT_WAIT_PACKET;
		if (stamp_now() >= deadline_ns)
			return TRANSPORT_WAIT_DEADLINE;
		uring_arm(u);
	}
}

static enum transport_wait uring_wait(struct transport *t, uint64_t deadline_ns)
{
	struct uring *u = self(t);
	bool packet;

	return_lent(u);
	u->waits++;
	packet = settle(u);
	uring_arm(u);
	if (packet) {
		if (pending(u))
			enter(u, 0, NULL);
		else
			t->statistics.waits_avoided++;
		return TRANSPORT_WAIT_PACKET;
	}
	return t->spin ? spin(u, deadline_ns) : sleep_until(u, deadline_ns);
}

const struct transport_ops uring_ops = {
	.name = "io_uring",
	.open = uring_open,
	.close = uring_close,
	.attach = uring_attach,
	.start = uring_start,
	.aim = uring_aim,
	.send = uring_send,
	.flush = uring_flush,
	.receive = uring_receive,
	.wait = uring_wait,
};
