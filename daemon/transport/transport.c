/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Opening a transport by name, and the few things all kinds share.
 *
 * The ring is the better one, and it is refused more often than one thinks:
 * kernel.io_uring_disabled, a container's seccomp filter, a kernel older than
 * a flag we need. "auto" then takes plain sockets, which are as fast for two
 * requests a cycle and only cost more system calls; the reason goes up so
 * that the daemon can say it once. A ring asked for by name is never
 * silently replaced.
 *
 * AF_XDP is asked for by name only: it wants a guard that somebody has
 * started, an interface of its own, and what it carries is seen by no
 * firewall and no tcpdump. So "auto" never takes it. It depends on so many
 * others that where it is not to be had the daemon starts all the same.
 *
 * A transport lives in memory of its own that is mapped with MAP_POPULATE:
 * the realtime thread must not be the first to touch a page, whether or not
 * the process could lock its memory.
 */
#include <errno.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>
#include "daemon/transport/kind.h"

void *transport_memory_map(size_t size)
{
	void *memory = mmap(NULL, size, PROT_READ | PROT_WRITE,
			    MAP_PRIVATE | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);

	return memory == MAP_FAILED ? NULL : memory;
}

void transport_memory_unmap(void *memory, size_t size)
{
	if (memory)
		munmap(memory, size);
}

int transport_open_kind(struct transport **out, const struct transport_kind *kind,
			const struct transport_options *options)
{
	struct transport *t = transport_memory_map(kind->size);
	int rc;

	if (!t)
		return -ENOMEM;
	t->ops = kind->ops;
	atomic_init(&t->title, kind->ops->name);
	t->spin = options->spin;
	for (uint32_t i = 0; i < TRANSPORT_CHANNELS; i++)
		t->error[i] = -EDESTADDRREQ;
	rc = kind->ops->open(t, options);
	if (rc < 0) {
		transport_memory_unmap(t, kind->size);
		return rc;
	}
	*out = t;
	return 0;
}

/* The static text for a ring that was refused. */
static const char *ring_refused(int rc)
{
	switch (-rc) {
	case EPERM:
	case EACCES:
		return "io_uring is not permitted here (kernel.io_uring_disabled, or a seccomp "
		       "filter); set transport = socket, or permit it";
	case ENOSYS:
		return "this kernel has no io_uring, or a seccomp filter hides it; "
		       "set transport = socket";
	case EINVAL:
		return "this kernel's io_uring is too old (6.1 is needed); set transport = socket";
	case ENOMEM:
		return "no memory for the ring (LimitMEMLOCK= too small?)";
	default:
		return "the ring could not be set up";
	}
}

static bool not_to_be_had(int rc)
{
	return rc == -EPERM || rc == -EACCES || rc == -ENOSYS || rc == -EINVAL;
}

int transport_open(struct transport **out, const char *name,
		   const struct transport_options *options, const char **why)
{
	bool xdp = !strcmp(name, "xdp"), any = xdp || !strcmp(name, "auto");
	const char *refused;
	int rc;

	*why = NULL;
	if (xdp) {
		rc = transport_open_kind(out, &transport_xdp, options);
		if (rc == 0)
			return 0;
		*why = transport_xdp_refused(rc);
	}
	if (any || !strcmp(name, "io_uring")) {
		rc = transport_open_kind(out, &transport_uring, options);
		refused = rc < 0 ? ring_refused(rc) : NULL;
		if (refused && (!*why || !not_to_be_had(rc)))
			*why = refused;
		if (rc == 0 || !any || !not_to_be_had(rc))
			return rc;
	} else if (strcmp(name, "socket")) {
		*why = "no such transport (io_uring, socket, auto, xdp)";
		return -EINVAL;
	}
	rc = transport_open_kind(out, &transport_socket, options);
	if (rc < 0)
		*why = "plain sockets could not be set up";
	return rc;
}

void transport_close(struct transport *t)
{
	if (t)
		t->ops->close(t);
}

/*
 * ICMP "port unreachable" and full queues pass by themselves: the next try
 * may work, and the mailbox makes it at its deadline. All else means that the
 * route or the source address is gone, and a connected socket keeps those
 * until it is connected again.
 */
static bool passes_by_itself(int error)
{
	switch (-error) {
	case ECONNREFUSED:
	case EAGAIN:
	case ENOBUFS:
	case ENOMEM:
	case EINTR:
	case ECANCELED:
		return true;
	default:
		return false;
	}
}

void transport_send_failed(struct transport *t, uint32_t channel, int error)
{
	t->statistics.send_failed++;
	if (channel < TRANSPORT_CHANNELS && !passes_by_itself(error))
		t->error[channel] = error;
}

int transport_aimed(struct transport *t, uint32_t channel, const struct transport_address *to,
		    int rc)
{
	t->error[channel] = rc == 0 && !to->address ? -EDESTADDRREQ : rc;
	return rc;
}

void transport_pause(struct transport *t)
{
	const struct timespec moment = { .tv_nsec = 50000 };

	t->statistics.system_calls++;
	clock_nanosleep(CLOCK_MONOTONIC, 0, &moment, NULL);
}
