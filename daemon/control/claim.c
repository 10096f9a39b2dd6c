// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Two daemons with runtime folders of their own would both drive one device: each
 * switches the other's outputs off, and its safe state is nobody's. The runtime
 * folder's lock does not see it, so the device's address is claimed as well: an
 * abstract socket has its name. The kernel takes the name back however its owner
 * ends, and it belongs to the network namespace, as the meaning of an address does.
 *
 * Who comes second does not end: its other devices are its own. It says who has the
 * device and tries again, so that it takes over when the first one ends.
 *
 * Anybody may take such a name, and keep us waiting. A file would be somebody's, but it
 * would have to lie in one folder that every daemon of the machine may write to, whoever
 * runs it, and none but daemons; and a folder knows no network namespace, nor is it the
 * same one in a container that has the machine's network. Who wants to be in the way has
 * only to send the device a packet. So it is told whose process it is, and that is all.
 *
 * A socket that cannot be made at all is no reason to be without a device.
 */
#include <errno.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include "daemon/control/claim.h"

#define AGAIN_NS UINT64_C(100000000)

enum { TEXT_MAX = 32, QUEUE = 4 };

static const char *put(char text[TEXT_MAX], uint64_t where)
{
	const uint32_t ip = (uint32_t)(where >> 16);

	snprintf(text, TEXT_MAX, "%u.%u.%u.%u:%u", ip >> 24, ip >> 16 & 255, ip >> 8 & 255,
		 ip & 255, (unsigned int)(where & 0xffff));
	return text;
}

/* The device at this address, whichever interface leads to it. */
static uint64_t device_at(uint64_t where)
{
	return where & ((UINT64_C(1) << 48) - 1);
}

/* A name without a file begins with a NUL and ends with its length. */
static socklen_t name_of(struct sockaddr_un *name, uint64_t where)
{
	char text[TEXT_MAX];
	int length;

	*name = (struct sockaddr_un){ .sun_family = AF_UNIX };
	length = snprintf(name->sun_path + 1, sizeof(name->sun_path) - 1, "pokeysd/device/%s",
			  put(text, where));
	return (socklen_t)(offsetof(struct sockaddr_un, sun_path) + 1 + (size_t)length);
}

static int new_socket(void)
{
	return socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
}

/* The descriptor that holds the claim, or -errno. */
static int take(uint64_t where)
{
	struct sockaddr_un name;
	socklen_t length = name_of(&name, where);
	int fd = new_socket();
	int error;

	if (fd < 0)
		return -errno;
	if (!bind(fd, (const struct sockaddr *)&name, length) && !listen(fd, QUEUE))
		return fd;
	error = errno;
	close(fd);
	return -error;
}

/* The process that has it, and whose it is; pid 0 = not to be found out. */
static struct ucred holder(uint64_t where)
{
	struct sockaddr_un name;
	socklen_t length = name_of(&name, where);
	struct ucred who = { .pid = 0 };
	socklen_t size = sizeof(who);
	int fd = new_socket();

	if (fd < 0)
		return who;
	if (connect(fd, (const struct sockaddr *)&name, length) ||
	    getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &who, &size))
		who.pid = 0;
	close(fd);
	return who;
}

/*
 * Whoever asked for our pid: room for the next ones. Everybody on this machine may
 * ask, as often as he likes, so in one round it is no more than wait.
 */
static void answer(const struct claim *claim)
{
	for (int i = 0; claim->fd >= 0 && i <= QUEUE; i++) {
		int fd = accept4(claim->fd, NULL, NULL, SOCK_CLOEXEC);

		if (fd < 0)
			return;
		close(fd);
	}
}

static void aim(struct claims *claims, uint32_t i, uint64_t where, int fd)
{
	struct claim *claim = &claims->device[i];

	if (claim->refused && device_at(claim->refused) == device_at(where))
		tell_line(claims->teller, i, EVENT_NOTICE, "in-use",
			  "the device is free; driving it");
	if (claim->fd >= 0)
		close(claim->fd);
	*claim = (struct claim){ .fd = fd, .held = where };
	atomic_store_explicit(&claims->shared->address[i], where, memory_order_relaxed);
}

/* Another section of ours that has it, or NULL. */
static const char *ours(const struct claims *claims, uint64_t where)
{
	for (uint32_t i = 0; i < claims->teller->config->devices; i++)
		if (device_at(claims->device[i].held) == device_at(where))
			return claims->teller->config->device[i].name;
	return NULL;
}

static void tell_refused(const struct claims *claims, uint32_t i, uint64_t where)
{
	const char *other = ours(claims, where);
	char text[TEXT_MAX];
	struct ucred who;

	if (other) {
		tell_line(claims->teller, i, EVENT_ERROR, "in-use",
			  "the device at %s is that of [device %s]; it is driven as %s only, "
			  "remove one of the sections",
			  put(text, where), other, other);
		return;
	}
	who = holder(where);
	tell_line(claims->teller, i, EVENT_ERROR, "in-use",
		  "the device at %s is driven by another pokeysd (process %d of user %u); waiting "
		  "until that one ends",
		  put(text, where), who.pid, who.uid);
}

static void claim(struct claims *claims, uint32_t i, uint64_t where, uint64_t now_ns)
{
	struct claim *claim = &claims->device[i];
	const bool again = claim->refused && device_at(claim->refused) == device_at(where);
	int fd;

	if (again && now_ns < claim->next_ns)
		return;
	if (claim->held && device_at(where) == device_at(claim->held)) {
		claim->held = where;
		atomic_store_explicit(&claims->shared->address[i], where, memory_order_relaxed);
		return;
	}
	fd = take(where);
	if (fd == -EADDRINUSE) {
		if (!again)
			tell_refused(claims, i, where);
		claim->refused = where;
		claim->next_ns = now_ns + AGAIN_NS;
		return;
	}
	if (fd < 0)
		tell_line(claims->teller, i, EVENT_WARNING, "in-use",
			  "cannot find out whether another pokeysd drives the device: %s; "
			  "driving it",
			  strerror(-fd));
	aim(claims, i, where, fd < 0 ? -1 : fd);
}

/* For the loop, which publishes why a device is not driven. */
static void mark(struct claims *claims, uint32_t i, bool in_use)
{
	if (in_use)
		atomic_fetch_or(&claims->shared->in_use, UINT64_C(1) << i);
	else
		atomic_fetch_and(&claims->shared->in_use, ~(UINT64_C(1) << i));
}

void claims_init(struct claims *claims, const struct teller *teller, struct loop_shared *shared)
{
	memset(claims, 0, sizeof(*claims));
	claims->teller = teller;
	claims->shared = shared;
	for (uint32_t i = 0; i < TRANSPORT_CHANNELS; i++)
		claims->device[i].fd = -1;
}

void claims_run(struct claims *claims, const _Atomic uint64_t found[TRANSPORT_CHANNELS],
		uint64_t now_ns)
{
	for (uint32_t i = 0; i < claims->teller->config->devices; i++) {
		const struct device_config *device = &claims->teller->config->device[i];
		uint64_t where = atomic_load_explicit(&found[i], memory_order_relaxed);

		if (!where && device->address)
			where = (uint64_t)device->address << 16 | device->port;
		if (where && where != claims->device[i].held)
			claim(claims, i, where, now_ns);
		mark(claims, i, where && where != claims->device[i].held);
		answer(&claims->device[i]);
	}
}

void claims_close(struct claims *claims)
{
	for (uint32_t i = 0; i < TRANSPORT_CHANNELS; i++) {
		if (claims->device[i].fd >= 0)
			close(claims->device[i].fd);
		claims->device[i] = (struct claim){ .fd = -1 };
	}
}
