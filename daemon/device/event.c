/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The event ring.
 *
 * The realtime thread must say what happened without formatting, locking or
 * waiting: it stores numbers. Somebody else turns them into text, later and
 * elsewhere (event_text.c). So an event holds no pointer.
 *
 * Writer and reader each own one index and only read the other's (release and
 * acquire), so a slot is never read half written. A full ring drops the newest
 * event: those already in it are the cause of what came after.
 */

#include "daemon/device/event.h"

void event_push(struct event_ring *ring, const struct event *event)
{
	const uint32_t head = atomic_load_explicit(&ring->head, memory_order_relaxed);
	const uint32_t used = head - atomic_load_explicit(&ring->tail, memory_order_acquire);

	if (ring->tap)
		ring->tap(ring->tap_context, event);
	if (used >= EVENT_RING) {
		atomic_fetch_add_explicit(&ring->dropped, 1, memory_order_relaxed);
		return;
	}
	ring->slot[head % EVENT_RING] = *event;
	atomic_store_explicit(&ring->head, head + 1, memory_order_release);
	if (used + 1 > atomic_load_explicit(&ring->high_water, memory_order_relaxed))
		atomic_store_explicit(&ring->high_water, used + 1, memory_order_relaxed);
}

int event_pop(struct event_ring *ring, struct event *out)
{
	const uint32_t tail = atomic_load_explicit(&ring->tail, memory_order_relaxed);

	if (tail == atomic_load_explicit(&ring->head, memory_order_acquire))
		return 0;
	*out = ring->slot[tail % EVENT_RING];
	atomic_store_explicit(&ring->tail, tail + 1, memory_order_release);
	return 1;
}
