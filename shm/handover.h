/* SPDX-License-Identifier: MIT */
/*
 * One pointer that a cold thread gives to a realtime thread and takes back.
 *
 * The realtime thread may be inside the object when the cold thread wants to
 * free it, and must never wait for it. So it marks its visits: `use` is odd
 * while it is inside. The cold thread swaps the pointer first and then waits
 * until the visit that may still see the old one is over; a later visit sees
 * the new one. Waiting for `use` to *change* (not to be even) means that a
 * thread which visits in a tight loop cannot keep the cold one out.
 *
 * Sequentially consistent on purpose: the mark must be visible before the
 * pointer is read, which is a store-load order that release and acquire do
 * not give.
 */
#ifndef SHM_HANDOVER_H
#define SHM_HANDOVER_H

#include <stdatomic.h>
#include <stdint.h>
#include <time.h>

struct handover {
	_Atomic(void *) pointer;
	_Atomic uint32_t use;
};

/* Realtime, one thread at a time. Every take is followed by a give_back. */
static inline void *handover_take(struct handover *handover)
{
	uint32_t use = atomic_load_explicit(&handover->use, memory_order_relaxed);

	atomic_store(&handover->use, use + 1);
	return atomic_load(&handover->pointer);
}

static inline void handover_give_back(struct handover *handover)
{
	uint32_t use = atomic_load_explicit(&handover->use, memory_order_relaxed);

	atomic_store_explicit(&handover->use, use + 1, memory_order_release);
}

/* Cold. Put `next` in place; the old one, which nobody uses any more. */
static inline void *handover_swap(struct handover *handover, void *next)
{
	static const struct timespec moment = { .tv_nsec = 50000 };
	void *old = atomic_exchange(&handover->pointer, next);
	uint32_t use = atomic_load(&handover->use);

	while ((use & 1) && atomic_load(&handover->use) == use)
		nanosleep(&moment, NULL);
	return old;
}

#endif
