/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A transport without a network, in virtual time, for tests of what stands
 * above it.
 */
#ifndef TRANSPORT_MEMORY_H
#define TRANSPORT_MEMORY_H

#include "daemon/transport/transport.h"

enum {
	TRANSPORT_MEMORY_QUEUE = 512, /* datagrams on their way */
	TRANSPORT_MEMORY_MAX = 576,   /* the longest whose bytes are kept */
};

struct transport_memory_hooks {
	/* The time: wait moves it forward, everybody may. Required. */
	uint64_t *now_ns;
	/* A datagram left (at the flush); may call transport_memory_arrive. Required. */
	void (*sent)(void *context, uint32_t channel, const uint8_t *data, size_t length,
		     uint64_t now_ns);
	/* A channel was aimed; what it returns is the result of aim. NULL = 0. */
	int (*aimed)(void *context, uint32_t channel, const struct transport_address *to);
	void *context;
};

int transport_memory_open(struct transport **out, const struct transport_memory_hooks *hooks);

/*
 * A datagram will arrive at that time. 0, or -ENOBUFS if too many are on their
 * way. `length` may be more than TRANSPORT_MEMORY_MAX; only so many bytes are kept.
 */
int transport_memory_arrive(struct transport *t, uint64_t at_ns, uint32_t channel,
			    const struct transport_address *from, const uint8_t *data,
			    size_t length);

#endif
