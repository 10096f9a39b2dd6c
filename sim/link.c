// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The queue of the faulty link: one pool of packets, one binary heap per
 * direction ordered by the moment of arrival.
 *
 * A heap and not a list, because delays are random: a packet pushed later may
 * arrive earlier, and the soak test pushes 10^8 of them. Packets due at the
 * same moment leave in the order they came, or a constant delay would reorder.
 *
 * What a fault does to a packet is decided in link_fault.c when it is pushed.
 * Nothing is decided at delivery, so asking twice for the next arrival, or
 * polling more often, never changes the course of a seeded run.
 */
#include "sim/link.h"

#include <string.h>

#include "sim/link_fault.h"

static bool is_before(const struct sim_link *link, uint16_t a, uint16_t b)
{
	const struct sim_link_packet *pa = &link->packets[a];
	const struct sim_link_packet *pb = &link->packets[b];

	if (pa->due_ns != pb->due_ns)
		return pa->due_ns < pb->due_ns;
	return pa->order < pb->order;
}

static void heap_push(struct sim_link *link, struct sim_link_way *way, uint16_t slot)
{
	unsigned int at = way->waiting++;

	while (at > 0) {
		unsigned int up = (at - 1) / 2;

		if (!is_before(link, slot, way->heap[up]))
			break;
		way->heap[at] = way->heap[up];
		at = up;
	}
	way->heap[at] = slot;
}

static uint16_t heap_pop(struct sim_link *link, struct sim_link_way *way)
{
	uint16_t top = way->heap[0];
	uint16_t last = way->heap[--way->waiting];
	unsigned int at = 0;

	for (;;) {
		unsigned int down = 2 * at + 1;

		if (down >= way->waiting)
			break;
		if (down + 1 < way->waiting &&
		    is_before(link, way->heap[down + 1], way->heap[down]))
			down++;
		if (!is_before(link, way->heap[down], last))
			break;
		way->heap[at] = way->heap[down];
		at = down;
	}
	way->heap[at] = last;
	return top;
}

void sim_link_init(struct sim_link *link, const struct sim_link_options *options, uint64_t seed)
{
	memset(link, 0, sizeof(*link));
	link->free_count = SIM_LINK_PACKETS;
	for (unsigned int i = 0; i < SIM_LINK_PACKETS; i++)
		link->free_slots[i] = (uint16_t)i;
	for (unsigned int dir = 0; dir < SIM_LINK_DIRS; dir++) {
		sim_prng_init(&link->way[dir].prng, 2 * seed + dir);
		if (options)
			link->way[dir].faults = options->faults[dir];
	}
}

void sim_link_set_faults(struct sim_link *link, enum sim_link_dir dir,
			 const struct sim_link_faults *faults)
{
	link->way[dir].faults = *faults;
	link->way[dir].burst_started = false;
}

void sim_link_silence(struct sim_link *link, enum sim_link_dir dir, uint64_t from_ns,
		      uint64_t until_ns)
{
	link->way[dir].silent_from_ns = from_ns;
	link->way[dir].silent_until_ns = until_ns;
}

bool sim_link_is_silent(const struct sim_link *link, enum sim_link_dir dir, uint64_t now_ns)
{
	const struct sim_link_way *way = &link->way[dir];

	return now_ns >= way->silent_from_ns && now_ns < way->silent_until_ns;
}

/* Queues one packet; a full pool drops it, as a full switch would. */
static void enqueue(struct sim_link *link, enum sim_link_dir dir, uint64_t due_ns, uint64_t peer,
		    const uint8_t *bytes, size_t len)
{
	struct sim_link_way *way = &link->way[dir];
	struct sim_link_packet *packet;
	uint16_t slot;

	if (!link->free_count || len > SIM_LINK_BYTES) {
		way->stats.overflow++;
		return;
	}
	slot = link->free_slots[--link->free_count];
	packet = &link->packets[slot];
	packet->due_ns = due_ns;
	packet->order = link->order++;
	packet->peer = peer;
	packet->len = (uint16_t)len;
	if (len)
		memcpy(packet->bytes, bytes, len);
	heap_push(link, way, slot);
}

void sim_link_push_from(struct sim_link *link, enum sim_link_dir dir, uint64_t now_ns,
			uint64_t peer, const uint8_t *bytes, size_t len)
{
	struct sim_link_way *way = &link->way[dir];
	uint8_t damaged[SIM_LINK_BYTES];
	struct sim_link_fate fate;

	way->stats.pushed++;
	if (len > sizeof(damaged)) {
		way->stats.overflow++;
		return;
	}
	if (len)
		memcpy(damaged, bytes, len);
	sim_link_decide(way, now_ns, damaged, len, &fate);
	for (unsigned int i = 0; i < fate.copies; i++)
		enqueue(link, dir, fate.due_ns + i * way->faults.copy_gap_ns, peer, damaged,
			fate.len);
}

void sim_link_push(struct sim_link *link, enum sim_link_dir dir, uint64_t now_ns,
		   const uint8_t *bytes, size_t len)
{
	sim_link_push_from(link, dir, now_ns, 0, bytes, len);
}

void sim_link_inject(struct sim_link *link, enum sim_link_dir dir, uint64_t due_ns, uint64_t peer,
		     const uint8_t *bytes, size_t len)
{
	link->way[dir].stats.pushed++;
	enqueue(link, dir, due_ns, peer, bytes, len);
}

bool sim_link_pop_from(struct sim_link *link, enum sim_link_dir dir, uint64_t now_ns,
		       uint64_t *peer, uint8_t *bytes, size_t cap, size_t *len)
{
	struct sim_link_way *way = &link->way[dir];
	const struct sim_link_packet *packet;
	uint16_t slot;

	if (!way->waiting || link->packets[way->heap[0]].due_ns > now_ns)
		return false;
	slot = heap_pop(link, way);
	packet = &link->packets[slot];
	*len = packet->len < cap ? packet->len : cap;
	if (*len)
		memcpy(bytes, packet->bytes, *len);
	if (peer)
		*peer = packet->peer;
	link->free_slots[link->free_count++] = slot;
	way->stats.delivered++;
	return true;
}

size_t sim_link_pop(struct sim_link *link, enum sim_link_dir dir, uint64_t now_ns, uint8_t *bytes,
		    size_t cap)
{
	size_t len;

	return sim_link_pop_from(link, dir, now_ns, NULL, bytes, cap, &len) ? len : 0;
}

uint64_t sim_link_next(const struct sim_link *link, enum sim_link_dir dir)
{
	const struct sim_link_way *way = &link->way[dir];

	return way->waiting ? link->packets[way->heap[0]].due_ns : SIM_LINK_NEVER;
}

void sim_link_flush(struct sim_link *link, enum sim_link_dir dir)
{
	struct sim_link_way *way = &link->way[dir];

	while (way->waiting)
		link->free_slots[link->free_count++] = way->heap[--way->waiting];
}
