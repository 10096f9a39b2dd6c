// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * AF_XDP at work: frames past the kernel's network stack, in both directions.
 *
 * Every channel has a connected UDP socket all the same ("the kernel's way", the
 * plain socket kind). It owns the port, so nobody else can take it; the kernel
 * resolves and refreshes the neighbour for it; it carries whatever the other way
 * cannot: the first datagrams after an aim, fragments, replies while no XDP
 * program is there, replies that another queue of the card received. So
 * nothing that happens to the guard, the card or the neighbour ends the
 * exchange; it only costs some microseconds until tend() has mended it.
 *
 * A frame leaves by AF_XDP if tend() has found the way for exactly the present
 * aim. Way and aim are written by two threads; each word carries the number of
 * the aim it belongs to, so that no lock is needed and nothing is sent to the
 * last device with the new one's address.
 *
 * Received frames are sorted into a list for each channel and served in turn,
 * so that a flood from one device does not hold back another. A list takes at
 * most half of all places. What is not whole, not for us, or not from the
 * device (or the one before it, see transport.h) is dropped and counted; of checksums that
 * were left to a card, tend() says so.
 *
 * Once the socket is lost (interface down or gone) the realtime thread lets go
 * of it in the next wait or receive, when no packet that it has handed out is
 * read any more.
 */
#include <errno.h>
#include <poll.h>
#include <string.h>
#include <sys/socket.h>
#include "daemon/transport/stamp.h"
#include "daemon/transport/xdp.h"

#define LOOK_NS UINT64_C(50000)	/* spinning: how often the kernel's way is looked at */

enum { FRUITLESS_MAX = 4, LIST_MAX = XDP_RX_FRAMES / 2 };

static struct xdp *self(struct transport *t)
{
	return (struct xdp *)t;
}

/* What the kernel's way has counted and found out is ours. */
static void adopt(struct xdp *x)
{
	struct transport_statistics *from = &x->under->statistics, *to = &x->base.statistics;

	to->sent += from->sent;
	to->send_failed += from->send_failed;
	to->received += from->received;
	to->receive_failed += from->receive_failed;
	to->truncated += from->truncated;
	to->system_calls += from->system_calls;
	to->stamps_refused += from->stamps_refused;
	memset(from, 0, sizeof(*from));
	memcpy(x->base.error, x->under->error, sizeof(x->base.error));
	memcpy(x->base.local, x->under->local, sizeof(x->base.local));
	x->base.failed = x->under->failed;
}

static bool ready(const struct xdp *x)
{
	return !x->lost && atomic_load_explicit(&x->link, memory_order_acquire) == XDP_READY;
}

static void let_go(struct xdp *x)
{
	for (uint32_t i = 0; i < x->channels; i++) {
		x->channel[i].first = x->channel[i].last = -1;
		x->channel[i].waiting = 0;
	}
	x->lent = NULL;
	x->lost = false;
	atomic_store_explicit(&x->link, XDP_BROKEN, memory_order_release);
}

/* Without its note, which is no later frame's. */
static void give_back(struct xdp *x, uint8_t *frame)
{
	memset(frame - sizeof(struct handover_note), 0, sizeof(struct handover_note));
	xdp_socket_give_back(&x->socket, frame);
}

/* The packet that was handed out is not read any more. */
static void settle(struct xdp *x)
{
	if (x->lent) {
		give_back(x, x->lent);
		x->lent = NULL;
	}
	if (x->lost)
		let_go(x);
}

/* The new aim for tend(), which answers with the words of the way. */
static void tell_aim(struct xdp_channel *c)
{
	uint64_t target = (uint64_t)c->now.address << 16 | c->now.port;

	c->aims = c->aims == UINT16_MAX ? 1 : (uint16_t)(c->aims + 1);
	atomic_store_explicit(&c->way.own, xdp_word(c->now.own, c->aims), memory_order_relaxed);
	atomic_store_explicit(&c->way.target, xdp_word(target, c->aims), memory_order_release);
}

static int xdp_aim(struct transport *t, uint32_t channel, const struct transport_address *to)
{
	struct xdp *x = self(t);
	struct xdp_channel *c;
	int rc = x->under->ops->aim(x->under, channel, to);

	adopt(x);
	if (channel >= TRANSPORT_CHANNELS || !x->channel[channel].attached)
		return rc;
	c = &x->channel[channel];
	if (c->now.address)
		c->before = c->now;
	memset(&c->now, 0, sizeof(c->now));
	if (rc == 0 && to->address) {
		c->now.port = to->port;
		c->now.address = to->address;
		c->now.own = x->under->local[channel].address;
	}
	tell_aim(c);
	return rc;
}

static void put_mac(uint8_t mac[FRAME_MAC], uint64_t word)
{
	for (int i = 0; i < FRAME_MAC; i++)
		mac[i] = (uint8_t)(word >> (56 - 8 * i));
}

/* The way past the kernel, if there is one for the present aim. */
static bool find_way(struct xdp *x, uint32_t channel, struct frame_path *path)
{
	struct xdp_channel *c = &x->channel[channel];
	uint64_t to = atomic_load_explicit(&c->way.to_mac, memory_order_acquire);
	uint64_t from = atomic_load_explicit(&c->way.from_mac, memory_order_acquire);

	if (XDP_AIM(to) != c->aims || XDP_AIM(from) != c->aims || !c->now.address)
		return false;
	if (atomic_load_explicit(&x->ask_kernel, memory_order_relaxed) >> channel & 1) {
		atomic_fetch_and_explicit(&x->ask_kernel, ~(UINT64_C(1) << channel),
					  memory_order_relaxed);
		return false;
	}
	put_mac(path->to_mac, to);
	put_mac(path->from_mac, from);
	path->to = c->now.address;
	path->to_port = c->now.port;
	path->from = c->now.own;
	path->from_port = c->port;
	return true;
}

static void kick(struct xdp *x)
{
	if (ready(x) && xdp_socket_kick(&x->socket, &x->base.statistics.system_calls) < 0)
		x->lost = true;
}

static int xdp_flush(struct transport *t)
{
	struct xdp *x = self(t);
	int rc = x->under->ops->flush(x->under);

	adopt(x);
	kick(x);
	return rc;
}

/* True if it is queued; all else is for the kernel's way to do or to refuse. */
static bool send_past(struct xdp *x, uint32_t channel, const uint8_t *data, size_t length)
{
	struct frame_path path;
	uint8_t *room;

	if (channel >= TRANSPORT_CHANNELS || length > TRANSPORT_SEND_MAX || !ready(x) ||
	    x->base.error[channel] || !find_way(x, channel, &path))
		return false;
	room = xdp_socket_room(&x->socket);
	if (!room) {
		kick(x);
		room = ready(x) ? xdp_socket_room(&x->socket) : NULL;
	}
	if (!room)
		return false;
	xdp_socket_put(&x->socket, frame_make(room, &path, data, length));
	x->base.statistics.sent++;
	return true;
}

static int xdp_send(struct transport *t, uint32_t channel, const uint8_t *data, size_t length)
{
	struct xdp *x = self(t);
	int rc;

	if (send_past(x, channel, data, length))
		return 0;
	rc = x->under->ops->send(x->under, channel, data, length);
	adopt(x);
	return rc;
}

static bool fits(const struct xdp_ends *ends, const struct frame_datagram *d)
{
	return ends->address && d->from == ends->address && d->from_port == ends->port &&
	       (!ends->own || d->to == ends->own);
}

/* The channel that a datagram is for, NULL if it is for none. */
static struct xdp_channel *channel_of(struct xdp *x, const struct frame_datagram *d)
{
	for (uint32_t i = 0; i < x->channels; i++) {
		struct xdp_channel *c = &x->channel[i];

		if (c->attached && c->port == d->to_port)
			return fits(&c->now, d) || fits(&c->before, d) ? c : NULL;
	}
	return NULL;
}

static void sort(struct xdp *x, uint8_t *frame, size_t length)
{
	uint32_t number = xdp_socket_place(&x->socket, frame);
	struct xdp_place *place = &x->place[number];
	struct xdp_channel *c = NULL;

	if (frame_read(frame, length, &place->datagram))
		c = channel_of(x, &place->datagram);
	else if (frame_half_summed(frame, length))
		atomic_store_explicit(&x->half_summed, true, memory_order_relaxed);
	if (!c || c->waiting == LIST_MAX) {
		x->base.statistics.receive_failed++;
		give_back(x, frame);
		return;
	}
	place->frame = frame;
	place->next = -1;
	if (c->last >= 0)
		x->place[c->last].next = (int)number;
	else
		c->first = (int)number;
	c->last = (int)number;
	c->waiting++;
}

/*
 * Sort what has come; true if something waits for some channel. What is dropped is
 * filled again at once, so a flood that nobody wants is left at one round of the ring.
 */
static bool sorted(struct xdp *x)
{
	uint8_t *frame;
	size_t length;

	if (!ready(x))
		return false;
	for (int i = 0; i < XDP_RX_FRAMES && (frame = xdp_socket_take(&x->socket, &length)); i++)
		sort(x, frame, length);
	for (uint32_t i = 0; i < x->channels; i++)
		if (x->channel[i].waiting)
			return true;
	return false;
}

/* When the driver had the frame, if the XDP program has noted it. */
static uint64_t note_of(struct xdp *x, const uint8_t *frame)
{
	struct handover_note note;

	memcpy(&note, frame - sizeof(note), sizeof(note));
	if (note.magic != HANDOVER_NOTE)
		return 0;
	if (note.t_ns <= stamp_now())
		return note.t_ns;
	x->base.statistics.stamps_refused++;
	return 0;
}

static void hand_out(struct xdp *x, uint32_t channel, struct transport_packet *out)
{
	struct xdp_channel *c = &x->channel[channel];
	struct xdp_place *place = &x->place[c->first];

	*out = (struct transport_packet){
		.data = place->datagram.data,
		.length = place->datagram.length,
		.channel = channel,
		.address = place->datagram.from,
		.port = place->datagram.from_port,
		.t_ns = note_of(x, place->frame),
	};
	x->lent = place->frame;
	c->first = place->next;
	if (c->first < 0)
		c->last = -1;
	c->waiting--;
	x->turn = channel;
	x->base.statistics.received++;
}

static int xdp_receive(struct transport *t, struct transport_packet *out)
{
	struct xdp *x = self(t);

	settle(x);
	if (x->under_more) {
		x->under_more = x->under->ops->receive(x->under, out);
		adopt(x);
		if (x->under_more)
			return 1;
	}
	for (uint32_t i = 1; i <= x->channels; i++) {
		uint32_t channel = (x->turn + i) % x->channels;

		if (x->channel[channel].waiting) {
			hand_out(x, channel, out);
			return 1;
		}
	}
	return 0;
}

/*
 * Look at both ways, sleeping until `until` if that is in the future. True if
 * there is a packet. *fruitless counts looks at the kernel's way that found an
 * error and no packet: one that keeps failing must not become a busy loop.
 */
static bool look(struct xdp *x, uint64_t until, uint32_t *fruitless)
{
	uint64_t now = stamp_now(), left = until > now ? until - now : 0;
	const struct timespec limit = {
		(time_t)(left / 1000000000u),
		(long)(left % 1000000000u),
	};
	struct pollfd poll[TRANSPORT_CHANNELS + 1];
	bool kernel = false;
	nfds_t count = 0;
	int n;

	if (ready(x))
		poll[count++] = (struct pollfd){ .fd = x->socket.fd, .events = POLLIN };
	else
		poll[count++] = (struct pollfd){ .fd = -1 };
	for (uint32_t i = 0; *fruitless < FRUITLESS_MAX && i < x->channels; i++)
		if (x->channel[i].attached)
			poll[count++] = (struct pollfd){ .fd = transport_socket_fd(x->under, i),
							 .events = POLLIN };
	x->base.statistics.system_calls++;
	n = ppoll(poll, count, &limit, NULL);
	if (n < 0 && errno != EINTR)
		transport_pause(&x->base);
	if (n <= 0)
		return sorted(x);
	if (poll[0].revents & (POLLERR | POLLHUP | POLLNVAL))
		x->lost = true;
	for (nfds_t i = 1; i < count; i++)
		kernel |= poll[i].revents != 0;
	if (kernel) {
		x->under_more = x->under->ops->wait(x->under, 0) == TRANSPORT_WAIT_PACKET;
		*fruitless += !x->under_more;
		adopt(x);
	}
	return sorted(x) || x->under_more;
}

static enum transport_wait xdp_wait(struct transport *t, uint64_t deadline_ns)
{
	struct xdp *x = self(t);
	uint64_t calls = t->statistics.system_calls, looked = 0;
	uint32_t fruitless = 0;

	settle(x);
	xdp_flush(t);
	if (sorted(x) || x->under_more) {
		t->statistics.waits_avoided += t->statistics.system_calls == calls;
		return TRANSPORT_WAIT_PACKET;
	}
	for (;;) {
		uint64_t now = stamp_now();

		if (!t->spin) {
			if (look(x, deadline_ns, &fruitless))
				return TRANSPORT_WAIT_PACKET;
		} else if (now - looked >= LOOK_NS) {
			looked = now;
			if (look(x, 0, &fruitless))
				return TRANSPORT_WAIT_PACKET;
		} else if (sorted(x)) {
			return TRANSPORT_WAIT_PACKET;
		}
		if (x->lost)
			settle(x);
		if (stamp_now() >= deadline_ns)
			return TRANSPORT_WAIT_DEADLINE;
		transport_relax();
	}
}

const struct transport_ops xdp_ops = {
	.name = "xdp",
	.open = xdp_open,
	.close = xdp_close,
	.attach = xdp_attach,
	.start = xdp_start,
	.aim = xdp_aim,
	.send = xdp_send,
	.flush = xdp_flush,
	.receive = xdp_receive,
	.wait = xdp_wait,
	.tend = xdp_tend,
};
