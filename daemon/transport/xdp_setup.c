// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Getting an AF_XDP socket, and keeping what send() needs to know fresh.
 *
 * open() is strict: whatever is missing is an error, so that the daemon takes
 * another kind and says why. What happens later is not: tend(), called by the
 * control thread a few times a second, mends it. A guard that ended is
 * connected to again, a socket that was lost (the interface went) is replaced,
 * each channel's way is looked up anew, and meanwhile all goes the kernel's way. A
 * guard that hangs is not waited for as at the beginning, nor asked at each call: the
 * control thread has the watchdog to feed and orders to take.
 *
 * The kernel refreshes a neighbour only if a socket sends to it, and frames of
 * ours do not count. So an entry that has become stale is answered by sending
 * the next datagram the kernel's way, after which it asks for itself.
 */
#include <arpa/inet.h>
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>
#include "daemon/transport/neighbour.h"
#include "daemon/transport/xdp.h"

enum { QUEUE = 0, PATIENCE_MS = 1000, TEND_MS = 200, PASSED_OVER = 8 };

#define PAST "replies pass the kernel's network stack by (AF_XDP, "
#define PAST_COPY PAST "copied once: the driver has no zero-copy, or not as the card is set up)"
#define PAST_ZERO PAST "zero-copy)"
#define APART "pokeys-guard has ended or taken its program off; replies come through the " \
	"kernel's network stack until it is back"
#define LOST "the AF_XDP socket is lost, for the interface is down or gone; all goes through the " \
	"kernel's network stack until it is back"

#define HALF_SUMMED "answers are refused, for their UDP checksum was left to a card and nobody " \
	"has completed it (a veth, a virtual machine); switch that off at the other end: " \
	"ethtool -K INTERFACE tx off"

/* A socket of the guard's, bound. 0 or -errno. */
static int get_socket(struct xdp *x, uint32_t patience_ms)
{
	int fd, rc;

	x->index = if_nametoindex(x->interface);
	if (!x->index)
		return -ENODEV;
	if (x->connection < 0)
		x->connection = handover_connect(x->helper, patience_ms ? patience_ms : TEND_MS);
	if (x->connection < 0)
		return x->connection;
	rc = handover_ask(x->connection, x->index, &fd);
	if (rc == 0)
		rc = xdp_socket_open(&x->socket, fd, x->index, QUEUE, patience_ms);
	if (rc < 0)
		return rc;
	atomic_store_explicit(&x->base.title, x->socket.zero_copy ? "xdp zero-copy" : "xdp copy",
			      memory_order_relaxed);
	atomic_store_explicit(&x->link, XDP_READY, memory_order_release);
	return 0;
}

static void disconnect(struct xdp *x)
{
	if (x->connection >= 0)
		close(x->connection);
	x->connection = -1;
	x->joined = false;
}

static int join(struct xdp *x)
{
	uint16_t port[HANDOVER_PORTS] = { 0 };
	uint32_t ports = 0;
	int rc;

	_Static_assert((int)HANDOVER_PORTS == (int)TRANSPORT_CHANNELS, "a port for each");
	for (uint32_t i = 0; i < x->channels; i++)
		if (x->channel[i].attached)
			port[ports++] = x->channel[i].port;
	rc = handover_join(x->connection, x->index, QUEUE, port, x->socket.fd);
	x->joined = rc == 0;
	if (!x->joined)
		disconnect(x);
	return rc;
}

static void release(struct xdp *x)
{
	disconnect(x);
	if (atomic_load_explicit(&x->link, memory_order_acquire) != XDP_NONE)
		xdp_socket_close(&x->socket);
	if (x->netlink >= 0)
		close(x->netlink);
	if (x->under)
		transport_close(x->under);
}

static int set_names(struct xdp *x, const struct transport_options *options)
{
	const char *helper = options->helper ? options->helper : HANDOVER_PATH;

	if (!options->interface)
		return -EDESTADDRREQ;
	if (strlen(options->interface) >= sizeof(x->interface))
		return -ENODEV;
	if (strlen(helper) >= sizeof(x->helper))
		return -ENAMETOOLONG;
	strcpy(x->interface, options->interface);
	strcpy(x->helper, helper);
	return neighbour_is_upper(x->interface) ? -EPROTONOSUPPORT : 0;
}

static int open_under(struct xdp *x, const struct transport_options *options)
{
	struct transport_options under = *options;

	under.spin = false;
	under.busy_poll_us = 0;
	under.keep_port = true;
	return transport_open_kind(&x->under, &transport_socket, &under);
}

int xdp_open(struct transport *t, const struct transport_options *options)
{
	struct xdp *x = (struct xdp *)t;
	uint8_t mac[FRAME_MAC];
	int rc;

	x->connection = x->netlink = x->socket.fd = -1;
	for (uint32_t i = 0; i < TRANSPORT_CHANNELS; i++)
		x->channel[i].first = x->channel[i].last = -1;
	rc = set_names(x, options);
	if (rc == 0)
		rc = neighbour_own(x->interface, mac);
	if (rc == 0) {
		x->netlink = neighbour_open();
		rc = x->netlink < 0 ? x->netlink : 0;
	}
	if (rc == 0)
		rc = open_under(x, options);
	if (rc == 0)
		rc = get_socket(x, PATIENCE_MS);
	if (rc < 0)
		release(x);
	return rc;
}

void xdp_close(struct transport *t)
{
	release((struct xdp *)t);
	transport_memory_unmap(t, sizeof(struct xdp));
}

int xdp_attach(struct transport *t, uint32_t channel)
{
	struct xdp *x = (struct xdp *)t;
	struct sockaddr_in own;
	socklen_t size = sizeof(own);
	int rc = x->under->ops->attach(x->under, channel);

	if (rc < 0)
		return rc;
	if (getsockname(transport_socket_fd(x->under, channel), (struct sockaddr *)&own, &size) < 0)
		return -errno;
	x->channel[channel].port = ntohs(own.sin_port);
	x->channel[channel].attached = true;
	if (channel >= x->channels)
		x->channels = channel + 1;
	return 0;
}

int xdp_start(struct transport *t)
{
	struct xdp *x = (struct xdp *)t;
	int rc = x->under->ops->start(x->under);

	if (rc < 0)
		return rc;
	x->started = true;
	join(x);
	t->statistics.system_calls = 0;
	return 0;
}

static uint64_t mac_value(const uint8_t mac[FRAME_MAC])
{
	uint64_t value = 0;

	for (int i = 0; i < FRAME_MAC; i++)
		value = value << 8 | mac[i];
	return value;
}

/* Look one channel's way up anew; without one it goes the kernel's. */
static void renew(struct xdp *x, uint32_t channel, const uint8_t mac[FRAME_MAC])
{
	struct xdp_way *way = &x->channel[channel].way;
	uint64_t target = atomic_load_explicit(&way->target, memory_order_acquire);
	uint64_t own = atomic_load_explicit(&way->own, memory_order_relaxed);
	uint32_t address = (uint32_t)(target >> 32);
	struct neighbour found = { .stale = false };
	int rc = -EDESTADDRREQ;

	if (address && own >> 16 && XDP_AIM(own) == XDP_AIM(target))
		rc = neighbour_find(x->netlink, x->index, (uint32_t)(own >> 16), address, &found);
	if (rc < 0) {
		atomic_store_explicit(&way->to_mac, 0, memory_order_release);
		return;
	}
	atomic_store_explicit(&way->from_mac, xdp_word(mac_value(mac), XDP_AIM(target)),
			      memory_order_release);
	atomic_store_explicit(&way->to_mac, xdp_word(mac_value(found.mac), XDP_AIM(target)),
			      memory_order_release);
	if (found.stale)
		atomic_fetch_or_explicit(&x->ask_kernel, UINT64_C(1) << channel,
					 memory_order_relaxed);
}

static void renew_all(struct xdp *x)
{
	uint8_t mac[FRAME_MAC];
	int rc = neighbour_own(x->interface, mac);

	for (uint32_t i = 0; i < x->channels; i++) {
		if (rc < 0)
			atomic_store_explicit(&x->channel[i].way.to_mac, 0, memory_order_release);
		else if (x->channel[i].attached)
			renew(x, i, mac);
	}
}

/* Guard and socket, as far as they are to be had. 0 or -errno. */
static int reconnect(struct xdp *x)
{
	int rc;

	if (x->connection >= 0 && !handover_alive(x->connection))
		disconnect(x);
	if (atomic_load_explicit(&x->link, memory_order_acquire) == XDP_NONE) {
		rc = get_socket(x, 0);
		if (rc < 0) {
			disconnect(x);
			return rc;
		}
	}
	if (x->connection < 0)
		x->connection = handover_connect(x->helper, TEND_MS);
	if (x->connection < 0)
		return x->connection;
	return x->joined ? 0 : join(x);
}

/* One that let us wait is left alone for a while. */
static void mend(struct xdp *x)
{
	int rc;

	if (x->passed_over > 0) {
		x->passed_over--;
		return;
	}
	rc = reconnect(x);
	if (rc == -ETIMEDOUT || rc == -EAGAIN)
		x->passed_over = PASSED_OVER;
}

/* Damage can look so once, and whoever sends so does it always: said once. */
static bool half_summed(struct xdp *x)
{
	if (x->told_half_summed || !atomic_load_explicit(&x->half_summed, memory_order_relaxed))
		return false;
	x->told_half_summed = true;
	return true;
}

int xdp_tend(struct transport *t, const char **news)
{
	struct xdp *x = (struct xdp *)t;
	bool lost = atomic_load_explicit(&x->link, memory_order_acquire) == XDP_BROKEN;

	*news = NULL;
	if (!x->started)
		return -EAGAIN;
	if (lost) {
		xdp_socket_close(&x->socket);
		x->joined = false;
		atomic_store_explicit(&x->link, XDP_NONE, memory_order_release);
	}
	mend(x);
	renew_all(x);
	if (!x->joined && !x->told_apart)
		*news = lost ? LOST : APART;
	else if (x->joined && !x->told_past)
		*news = x->socket.zero_copy ? PAST_ZERO : PAST_COPY;
	x->told_apart = !x->joined;
	x->told_past = x->joined;
	if (!*news && half_summed(x)) {
		*news = HALF_SUMMED;
		return -EBADMSG;
	}
	return x->joined ? 0 : -ENOTCONN;
}

/* The static text for what was refused. */
const char *transport_xdp_refused(int rc)
{
	switch (-rc) {
	case ENOENT:
	case ECONNREFUSED:
		return "pokeys-guard, which hands an AF_XDP socket over, does not run or was "
		       "started with another transport (systemctl restart pokeys-guard, then "
		       "pokeysd)";
	case EACCES:
	case EPERM:
	case EPIPE:
	case ECONNRESET:
		return "pokeys-guard gives an AF_XDP socket to root and the user pokeys only, or "
		       "may not make one (CAP_NET_RAW)";
	case EAFNOSUPPORT:
		return "this kernel has no AF_XDP (CONFIG_XDP_SOCKETS)";
	case EOPNOTSUPP:
		return "the interface's driver has no XDP of its own, or refuses it (pokeys-guard "
		       "says why); the generic one gains nothing";
	case EPROTONOSUPPORT:
		return "AF_XDP needs an Ethernet interface that is no VLAN and no bond; give the "
		       "device one of its own";
	case EDESTADDRREQ:
		return "AF_XDP belongs to one interface; name it (interface =)";
	case EPROTO:
		return "pokeys-guard and pokeysd are of different versions; install the same "
		       "one of both, then, with the machine off: systemctl restart pokeys-guard "
		       "pokeysd";
	case EXDEV:
		return "pokeys-guard is on another interface (systemctl restart pokeys-guard)";
	case ETIMEDOUT:
		return "pokeys-guard does not answer; does it serve another daemon?";
	case EBUSY:
		return "another program has the AF_XDP socket of that interface";
	case ENOMEM:
	case ENOBUFS:
		return "there is no memory for an AF_XDP socket (LimitMEMLOCK= too small?)";
	case ENODEV:
		return "there is no such interface";
	default:
		return "the AF_XDP socket could not be set up";
	}
}

const struct transport_kind transport_xdp = {
	.ops = &xdp_ops,
	.size = sizeof(struct xdp),
};
