/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What transport.c and the kinds share; private to this room. */
#ifndef TRANSPORT_KIND_H
#define TRANSPORT_KIND_H

#include "daemon/transport/transport.h"

/* `size` bytes of the whole struct, of which struct transport is the first member. */
struct transport_kind {
	const struct transport_ops *ops;
	size_t size;
};

extern const struct transport_kind transport_uring;
extern const struct transport_kind transport_socket;
/* xdp_setup.c, or xdp_absent.c where the build has no libxdp. */
extern const struct transport_kind transport_xdp;
/* The static text for an AF_XDP transport that open() refused with `rc`. */
const char *transport_xdp_refused(int rc);

/* The descriptor of a channel of the plain socket kind, -1 = not attached. Realtime. */
int transport_socket_fd(const struct transport *t, uint32_t channel);

/* Zeroed memory whose pages are there already; NULL if there is none. Cold. */
void *transport_memory_map(size_t size);
void transport_memory_unmap(void *memory, size_t size);

/* Open one kind, without any fallback. 0 or -errno. Cold. */
int transport_open_kind(struct transport **out, const struct transport_kind *kind,
			const struct transport_options *options);

/*
 * A send failed: count it, and remember an errno that only aiming anew can
 * mend. Realtime.
 */
void transport_send_failed(struct transport *t, uint32_t channel, int error);

/* Note the result of an aim in error[channel], and return it. Realtime. */
int transport_aimed(struct transport *t, uint32_t channel, const struct transport_address *to,
		    int rc);

/*
 * The kernel refuses to wait (out of memory, for one): sleep for a moment
 * instead, so that trying again is not a busy loop. Realtime.
 */
void transport_pause(struct transport *t);

/* Tell the core that this is a polling loop. Realtime. */
#if defined(__x86_64__) || defined(__i386__)
static inline void transport_relax(void)
{
	__builtin_ia32_pause();
}
#elif defined(__aarch64__)
static inline void transport_relax(void)
{
	__asm__ volatile("yield");
}
#else
static inline void transport_relax(void)
{
}
#endif

#endif
