// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * An AF_XDP socket, made of one that somebody else has opened.
 *
 * libxdp's xsk_socket__create() opens the socket itself, and that is the one
 * step which wants a capability; so the rings are mapped here, and of libxdp
 * only the ring operations of its header are used, with their memory barriers.
 * Nothing is linked: its library would bring libbpf into a process whose
 * memory is locked.
 *
 * One socket on one queue. Memory is divided for good: the kernel has all
 * places for receiving in its fill ring or we have them, and each place for
 * sending is idle or on its way. So no ring can ever be full when something
 * is put into it.
 *
 * Bound without XDP_COPY and XDP_ZEROCOPY, the kernel takes zero-copy where
 * the driver has it and copies where not. XDP_USE_NEED_WAKEUP: otherwise a
 * driver that shares our core would never know when to run.
 */
#include <errno.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>
#include "daemon/transport/kind.h"
#include "daemon/transport/xdp_socket.h"

enum {
	MEMORY = (XDP_RX_FRAMES + XDP_TX_FRAMES) * XDP_FRAME,
	KICKS = 8, /* the kernel sends 32 frames at most for each */
};

static int set_memory(struct xdp_socket *s)
{
	struct xdp_umem_reg memory = { .len = MEMORY, .chunk_size = XDP_FRAME };

	s->frames = transport_memory_map(MEMORY);
	if (!s->frames)
		return -ENOMEM;
	memory.addr = (uintptr_t)s->frames;
	return setsockopt(s->fd, SOL_XDP, XDP_UMEM_REG, &memory, sizeof(memory)) < 0 ? -errno : 0;
}

static int set_sizes(const struct xdp_socket *s)
{
	static const struct {
		int ring;
		uint32_t entries;
	} rings[] = {
		{ XDP_UMEM_FILL_RING, XDP_RX_FRAMES },
		{ XDP_UMEM_COMPLETION_RING, XDP_TX_FRAMES },
		{ XDP_RX_RING, XDP_RX_FRAMES },
		{ XDP_TX_RING, XDP_TX_FRAMES },
	};

	for (size_t i = 0; i < sizeof(rings) / sizeof(rings[0]); i++)
		if (setsockopt(s->fd, SOL_XDP, rings[i].ring, &rings[i].entries,
			       sizeof(rings[i].entries)) < 0)
			return -errno;
	return 0;
}

/* A ring's memory; NULL if it cannot be had. */
static char *map_ring(struct xdp_socket *s, int number, const struct xdp_ring_offset *offset,
		      size_t bytes, off_t where)
{
	size_t size = offset->desc + bytes;
	void *at = mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, s->fd,
			where);

	if (at == MAP_FAILED)
		return NULL;
	s->map[number].at = at;
	s->map[number].size = size;
	return at;
}

static int map_producer(struct xdp_socket *s, int number, struct xsk_ring_prod *ring,
			const struct xdp_ring_offset *offset, uint32_t entries, size_t entry,
			off_t where)
{
	char *at = map_ring(s, number, offset, entries * entry, where);

	if (!at)
		return -errno;
	*ring = (struct xsk_ring_prod){
		.mask = entries - 1,
		.size = entries,
		.cached_cons = entries,
		.producer = (void *)(at + offset->producer),
		.consumer = (void *)(at + offset->consumer),
		.flags = (void *)(at + offset->flags),
		.ring = at + offset->desc,
	};
	return 0;
}

static int map_consumer(struct xdp_socket *s, int number, struct xsk_ring_cons *ring,
			const struct xdp_ring_offset *offset, uint32_t entries, size_t entry,
			off_t where)
{
	char *at = map_ring(s, number, offset, entries * entry, where);

	if (!at)
		return -errno;
	*ring = (struct xsk_ring_cons){
		.mask = entries - 1,
		.size = entries,
		.producer = (void *)(at + offset->producer),
		.consumer = (void *)(at + offset->consumer),
		.flags = (void *)(at + offset->flags),
		.ring = at + offset->desc,
	};
	return 0;
}

static int map_rings(struct xdp_socket *s)
{
	struct xdp_mmap_offsets at;
	socklen_t size = sizeof(at);
	int rc;

	if (getsockopt(s->fd, SOL_XDP, XDP_MMAP_OFFSETS, &at, &size) < 0)
		return -errno;
	rc = map_producer(s, 0, &s->fill, &at.fr, XDP_RX_FRAMES, sizeof(uint64_t),
			  XDP_UMEM_PGOFF_FILL_RING);
	if (rc == 0)
		rc = map_consumer(s, 1, &s->done, &at.cr, XDP_TX_FRAMES, sizeof(uint64_t),
				  XDP_UMEM_PGOFF_COMPLETION_RING);
	if (rc == 0)
		rc = map_consumer(s, 2, &s->rx, &at.rx, XDP_RX_FRAMES, sizeof(struct xdp_desc),
				  XDP_PGOFF_RX_RING);
	if (rc == 0)
		rc = map_producer(s, 3, &s->tx, &at.tx, XDP_TX_FRAMES, sizeof(struct xdp_desc),
				  XDP_PGOFF_TX_RING);
	return rc;
}

/* All places for receiving to the kernel, all for sending to us. */
static void share_out(struct xdp_socket *s)
{
	for (uint32_t i = 0; i < XDP_RX_FRAMES; i++)
		xdp_socket_give_back(s, s->frames + (size_t)i * XDP_FRAME);
	for (uint32_t i = 0; i < XDP_TX_FRAMES; i++)
		s->idle[i] = XDP_RX_FRAMES + i;
	s->idles = XDP_TX_FRAMES;
}

static int attach(struct xdp_socket *s, uint32_t index, uint32_t queue)
{
	const struct sockaddr_xdp at = {
		.sxdp_family = AF_XDP,
		.sxdp_flags = XDP_USE_NEED_WAKEUP,
		.sxdp_ifindex = index,
		.sxdp_queue_id = queue,
	};
	struct xdp_options options = { 0 };
	socklen_t size = sizeof(options);

	if (bind(s->fd, (const struct sockaddr *)&at, sizeof(at)) < 0)
		return -errno;
	if (getsockopt(s->fd, SOL_XDP, XDP_OPTIONS, &options, &size) == 0)
		s->zero_copy = options.flags & XDP_OPTIONS_ZEROCOPY;
	return 0;
}

int xdp_socket_open(struct xdp_socket *s, int fd, uint32_t index, uint32_t queue,
		    uint32_t patience_ms)
{
	const struct timespec moment = { .tv_nsec = 1000000 };
	int rc;

	memset(s, 0, sizeof(*s));
	s->fd = fd;
	rc = set_memory(s);
	if (rc == 0)
		rc = set_sizes(s);
	if (rc == 0)
		rc = map_rings(s);
	if (rc == 0) {
		share_out(s);
		rc = attach(s, index, queue);
		/* the kernel clears a closed socket's queue a moment later */
		for (; rc == -EBUSY && patience_ms; patience_ms--) {
			nanosleep(&moment, NULL);
			rc = attach(s, index, queue);
		}
	}
	if (rc < 0)
		xdp_socket_close(s);
	return rc;
}

void xdp_socket_close(struct xdp_socket *s)
{
	for (size_t i = 0; i < sizeof(s->map) / sizeof(s->map[0]); i++)
		transport_memory_unmap(s->map[i].at, s->map[i].size);
	if (s->fd >= 0)
		close(s->fd);
	transport_memory_unmap(s->frames, MEMORY);
	memset(s, 0, sizeof(*s));
	s->fd = -1;
}

/* Take back the places of frames that have left. */
static void collect(struct xdp_socket *s)
{
	uint32_t first, n = xsk_ring_cons__peek(&s->done, XDP_TX_FRAMES - s->idles, &first);

	for (uint32_t i = 0; i < n; i++) {
		uint64_t address = *xsk_ring_cons__comp_addr(&s->done, first + i);

		s->idle[s->idles++] = (uint32_t)(address / XDP_FRAME);
	}
	if (n)
		xsk_ring_cons__release(&s->done, n);
}

uint8_t *xdp_socket_room(struct xdp_socket *s)
{
	if (!s->idles)
		collect(s);
	return s->idles ? s->frames + (size_t)s->idle[s->idles - 1] * XDP_FRAME : NULL;
}

void xdp_socket_put(struct xdp_socket *s, size_t length)
{
	uint32_t at;

	if (xsk_ring_prod__reserve(&s->tx, 1, &at) != 1)
		return; /* as many entries as places: cannot be */
	*xsk_ring_prod__tx_desc(&s->tx, at) = (struct xdp_desc){
		.addr = (uint64_t)s->idle[--s->idles] * XDP_FRAME,
		.len = (uint32_t)length,
	};
	xsk_ring_prod__submit(&s->tx, 1);
	s->queued++;
}

/* What the next kick may mend; a frame that cannot leave now leaves with that. */
static bool passing(int error)
{
	return error == EAGAIN || error == EBUSY || error == ENOBUFS || error == EINTR ||
	       error == ENOMEM;
}

int xdp_socket_kick(struct xdp_socket *s, uint64_t *calls)
{
	int error = 0;

	if (!s->queued)
		return 0;
	s->queued = 0;
	if (s->zero_copy && !xsk_ring_prod__needs_wakeup(&s->tx))
		return 0;
	for (int i = 0; i < KICKS; i++) {
		(*calls)++;
		error = sendto(s->fd, NULL, 0, MSG_DONTWAIT, NULL, 0) < 0 ? errno : 0;
		if (error != EAGAIN && error != EINTR)
			break;
	}
	collect(s);
	if (error && passing(error))
		s->queued = 1; /* kick again */
	return error && !passing(error) ? -error : 0;
}

uint8_t *xdp_socket_take(struct xdp_socket *s, size_t *length)
{
	const struct xdp_desc *d;
	uint8_t *frame;
	uint32_t at;

	if (!xsk_ring_cons__peek(&s->rx, 1, &at))
		return NULL;
	d = xsk_ring_cons__rx_desc(&s->rx, at);
	frame = s->frames + d->addr;
	*length = d->len;
	xsk_ring_cons__release(&s->rx, 1);
	return frame;
}

void xdp_socket_give_back(struct xdp_socket *s, const uint8_t *frame)
{
	uint32_t at;

	if (xsk_ring_prod__reserve(&s->fill, 1, &at) != 1)
		return; /* as many entries as places: cannot be */
	*xsk_ring_prod__fill_addr(&s->fill, at) = (uint64_t)xdp_socket_place(s, frame) * XDP_FRAME;
	xsk_ring_prod__submit(&s->fill, 1);
}

uint32_t xdp_socket_place(const struct xdp_socket *s, const uint8_t *frame)
{
	return (uint32_t)((size_t)(frame - s->frames) / XDP_FRAME);
}
