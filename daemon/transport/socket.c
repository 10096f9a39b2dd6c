/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Plain sockets: for kernels and containers where the ring is refused.
 *
 * The same behaviour with more system calls: one sendmmsg() for each device
 * that has something to send, one ppoll() for packet-or-deadline, one
 * recvmmsg() for each batch that arrived. What would cost more is avoided:
 *  - SO_RCVTIMEO and the timeout of recvmmsg() are not used; both are late by
 *    milliseconds. ppoll() takes a relative time only, so it is computed
 *    from the absolute deadline right before each call and after EINTR.
 *  - after a batch that was not full a socket is empty: no call is spent on
 *    hearing EAGAIN.
 *  - an error of a connected socket (ICMP: nobody listens there) makes
 *    ppoll() return although there is no packet; the error is taken off and
 *    the wait goes on, but a socket that keeps on failing is left out of this
 *    wait, or it would be a busy loop at realtime priority.
 */
#include <errno.h>
#include <poll.h>
#include <string.h>
#include <time.h>
#include "daemon/transport/kind.h"
#include "daemon/transport/stamp.h"
#include "daemon/transport/udp.h"

enum {
	BATCH = 32,
	FRUITLESS_MAX = 4, /* errors in a row of one socket in one wait */
};

struct out {
	uint32_t channel;
	uint8_t data[TRANSPORT_SEND_MAX];
};

struct socket_transport {
	struct transport base;
	bool started;
	uint32_t channels; /* the highest attached one + 1 */
	struct transport_options options;
	struct stamp stamp;
	struct udp udp[TRANSPORT_CHANNELS];
	struct pollfd poll[TRANSPORT_CHANNELS];
	uint32_t fruitless[TRANSPORT_CHANNELS];
	uint64_t ready; /* bit = there may be more to receive */

	uint32_t queued;
	struct out queue[TRANSPORT_QUEUE];
	struct iovec send_vector[TRANSPORT_QUEUE];
	struct mmsghdr send_message[TRANSPORT_QUEUE];

	uint32_t batch_channel, batch_count, batch_next;
	struct mmsghdr message[BATCH];
	struct iovec vector[BATCH];
	struct sockaddr_in source[BATCH];
	uint8_t control[BATCH][UDP_CONTROL] __attribute__((aligned(8)));
	uint8_t data[BATCH][TRANSPORT_PACKET_MAX];
};

static struct socket_transport *self(struct transport *t)
{
	return (struct socket_transport *)t;
}

int transport_socket_fd(const struct transport *t, uint32_t channel)
{
	return ((const struct socket_transport *)t)->udp[channel].fd;
}

static int socket_open(struct transport *t, const struct transport_options *options)
{
	struct socket_transport *s = self(t);

	s->options = *options;
	for (uint32_t i = 0; i < TRANSPORT_CHANNELS; i++) {
		s->udp[i].fd = -1;
		s->poll[i].events = POLLIN;
	}
	for (uint32_t i = 0; i < TRANSPORT_QUEUE; i++) {
		s->send_vector[i].iov_base = s->queue[i].data;
		s->send_message[i].msg_hdr.msg_iov = &s->send_vector[i];
		s->send_message[i].msg_hdr.msg_iovlen = 1;
	}
	for (uint32_t i = 0; i < BATCH; i++)
		s->vector[i] = (struct iovec){ s->data[i], sizeof s->data[i] };
	return 0;
}

static void socket_close(struct transport *t)
{
	struct socket_transport *s = self(t);

	for (uint32_t i = 0; i < TRANSPORT_CHANNELS; i++)
		udp_close(&s->udp[i]);
	transport_memory_unmap(s, sizeof *s);
}

static int socket_attach(struct transport *t, uint32_t channel)
{
	struct socket_transport *s = self(t);
	int rc;

	if (channel >= TRANSPORT_CHANNELS)
		return -EINVAL;
	if (s->started || s->udp[channel].fd >= 0)
		return -EBUSY;
	rc = udp_open(&s->udp[channel], &s->options);
	if (rc == 0 && channel >= s->channels)
		s->channels = channel + 1;
	return rc;
}

static int socket_start(struct transport *t)
{
	struct socket_transport *s = self(t);

	if (s->started)
		return -EBUSY;
	s->started = true;
	stamp_read(&s->stamp);
	return 0;
}

static int socket_aim(struct transport *t, uint32_t channel, const struct transport_address *to)
{
	struct socket_transport *s = self(t);

	if (channel >= TRANSPORT_CHANNELS || s->udp[channel].fd < 0)
		return -EINVAL;
	return transport_aimed(t, channel, to,
			       udp_aim(&s->udp[channel], to, &t->local[channel],
				       &t->statistics.system_calls));
}

/* Send s->queue[from .. to-1], all of one channel. */
static void send_run(struct socket_transport *s, uint32_t from, uint32_t to)
{
	uint32_t channel = s->queue[from].channel;

	while (from < to) {
		int n;

		s->base.statistics.system_calls++;
		n = sendmmsg(s->udp[channel].fd, &s->send_message[from], to - from, MSG_DONTWAIT);
		if (n > 0) {
			from += (uint32_t)n;
		} else if (n == 0 || errno != EINTR) {
			transport_send_failed(&s->base, channel, n == 0 ? -EAGAIN : -errno);
			from++;
		}
	}
}

static int socket_flush(struct transport *t)
{
	struct socket_transport *s = self(t);
	uint32_t from = 0;

	while (from < s->queued) {
		uint32_t to = from + 1;

		while (to < s->queued && s->queue[to].channel == s->queue[from].channel)
			to++;
		send_run(s, from, to);
		from = to;
	}
	s->queued = 0;
	return 0;
}

static int socket_send(struct transport *t, uint32_t channel, const uint8_t *data, size_t length)
{
	struct socket_transport *s = self(t);
	int rc = 0;

	if (length > TRANSPORT_SEND_MAX)
		rc = -EMSGSIZE;
	else if (channel >= TRANSPORT_CHANNELS || s->udp[channel].fd < 0)
		rc = -EINVAL;
	else if (t->error[channel])
		rc = t->error[channel];
	if (rc < 0) {
		t->statistics.send_failed++;
		return rc;
	}
	if (s->queued == TRANSPORT_QUEUE)
		socket_flush(t);
	s->queue[s->queued].channel = channel;
	memcpy(s->queue[s->queued].data, data, length);
	s->send_vector[s->queued].iov_len = length;
	s->queued++;
	t->statistics.sent++;
	return 0;
}

/* Fetch a batch from one socket that may have something. */
static void fetch(struct socket_transport *s, uint32_t channel)
{
	int n;

	for (uint32_t i = 0; i < BATCH; i++)
		s->message[i].msg_hdr = (struct msghdr){
			.msg_name = &s->source[i],
			.msg_namelen = sizeof s->source[i],
			.msg_iov = &s->vector[i],
			.msg_iovlen = 1,
			.msg_control = s->control[i],
			.msg_controllen = sizeof s->control[i],
		};
	s->base.statistics.system_calls++;
	n = recvmmsg(s->udp[channel].fd, s->message, BATCH, MSG_DONTWAIT | MSG_TRUNC, NULL);
	if (n < BATCH)
		s->ready &= ~(UINT64_C(1) << channel);
	if (n <= 0) {
		if (n < 0 && errno == EINTR) {
			s->ready |= UINT64_C(1) << channel;
		} else if (n < 0 && errno != EAGAIN) {
			s->base.statistics.receive_failed++;
			s->fruitless[channel]++;
		}
		return;
	}
	s->fruitless[channel] = 0;
	s->batch_channel = channel;
	s->batch_count = (uint32_t)n;
	s->batch_next = 0;
}

/* The ready channel after the last one, so that a flooded one starves nobody. */
static uint32_t next_ready(const struct socket_transport *s)
{
	uint64_t later = s->ready & ~((UINT64_C(2) << s->batch_channel) - 1);

	return (uint32_t)__builtin_ctzll(later ? later : s->ready);
}

/* True if there is a packet to hand out, fetching from ready sockets if need be. */
static bool fetched(struct socket_transport *s)
{
	while (s->batch_next == s->batch_count && s->ready)
		fetch(s, next_ready(s));
	return s->batch_next < s->batch_count;
}

static int socket_receive(struct transport *t, struct transport_packet *out)
{
	struct socket_transport *s = self(t);
	struct mmsghdr *m;
	uint64_t now, stamp;

	if (!fetched(s))
		return 0;
	m = &s->message[s->batch_next];
	out->data = s->data[s->batch_next];
	out->length = m->msg_len;
	out->channel = s->batch_channel;
	udp_source(&s->source[s->batch_next], m->msg_hdr.msg_namelen, out);
	now = stamp_read(&s->stamp);
	stamp = udp_stamp(&m->msg_hdr);
	out->t_ns = stamp ? stamp_convert(&s->stamp, stamp, now) : 0;
	if (stamp && !out->t_ns)
		t->statistics.stamps_refused++;
	if (m->msg_hdr.msg_flags & MSG_TRUNC)
		t->statistics.truncated++;
	t->statistics.received++;
	s->batch_next++;
	return 1;
}

/* One look at all sockets, sleeping until `until` if that is in the future. */
static void look(struct socket_transport *s, uint64_t until)
{
	uint64_t now = stamp_now();
	uint64_t left = until > now ? until - now : 0;
	struct timespec t = { (time_t)(left / 1000000000u), (long)(left % 1000000000u) };
	int n;

	for (uint32_t i = 0; i < s->channels; i++)
		s->poll[i].fd = s->fruitless[i] < FRUITLESS_MAX ? s->udp[i].fd : -1;
	s->base.statistics.system_calls++;
	n = ppoll(s->poll, s->channels, &t, NULL);
	if (n < 0 && errno != EINTR)
		transport_pause(&s->base);
	for (uint32_t i = 0; n > 0 && i < s->channels; i++)
		if (s->poll[i].fd >= 0 && s->poll[i].revents)
			s->ready |= UINT64_C(1) << i;
}

static enum transport_wait socket_wait(struct transport *t, uint64_t deadline_ns)
{
	struct socket_transport *s = self(t);

	socket_flush(t);
	memset(s->fruitless, 0, sizeof s->fruitless);
	if (s->batch_next < s->batch_count) {
		t->statistics.waits_avoided++;
		return TRANSPORT_WAIT_PACKET;
	}
	for (;;) {
		if (fetched(s))
			return TRANSPORT_WAIT_PACKET;
		look(s, t->spin ? 0 : deadline_ns);
		if (!s->ready && stamp_now() >= deadline_ns)
			return TRANSPORT_WAIT_DEADLINE;
	}
}

static const struct transport_ops socket_ops = {
	.name = "socket",
	.open = socket_open,
	.close = socket_close,
	.attach = socket_attach,
	.start = socket_start,
	.aim = socket_aim,
	.send = socket_send,
	.flush = socket_flush,
	.receive = socket_receive,
	.wait = socket_wait,
};

const struct transport_kind transport_socket = {
	.ops = &socket_ops,
	.size = sizeof(struct socket_transport),
};
