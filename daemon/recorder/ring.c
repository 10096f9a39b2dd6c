/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The realtime thread's part: two cache lines written, one counter moved on.
 *
 * There is no lock and no reader to wait for. A slot is whole before `written`
 * counts it, so a reader that looks at `written` after its copy knows which of
 * the slots it copied may have been overwritten meanwhile: those that are
 * older than one round. That costs the writer nothing.
 *
 * The ring is larger than the cache, so the next slot is never in it when it
 * is needed. It is fetched here already, to be there in some microseconds.
 *
 * Users send records to the people who look for a fault. So a password, and the
 * hash that proves one, never get into the ring.
 */
#include <string.h>
#include "daemon/recorder/ring.h"
#include "wire/packet.h"

enum { AUTHORISE = 0xE2, PASSWORD = 0xE3 }; /* protocol section 1.11 */

/* All but `data`, which is written by itself. */
#define SLOT_HEAD offsetof(struct recorder_slot, data)

/* How many bytes of a packet may be kept. A reply has its result in the first of the payload. */
static size_t without_secret(const struct recorder_slot *slot, const uint8_t *packet, size_t size)
{
	if (size <= WIRE_PAYLOAD_AT ||
	    (slot->kind != RECORDER_SENT && slot->kind != RECORDER_RECEIVED) ||
	    (packet[WIRE_AT_OP] != AUTHORISE && packet[WIRE_AT_OP] != PASSWORD))
		return size;
	return WIRE_PAYLOAD_AT + (slot->kind == RECORDER_RECEIVED);
}

void recorder_write(struct recorder *recorder, const struct recorder_slot *slot, const void *data,
		    size_t size)
{
	struct recorder_slot *to;
	uint64_t number;
	size_t kept;

	if (!recorder->head)
		return;
	kept = without_secret(slot, data, size < RECORDER_DATA ? size : RECORDER_DATA);
	number = atomic_load_explicit(&recorder->head->written, memory_order_relaxed);
	to = &recorder->slot[number & recorder->mask];
	/* readers see the counter of before this slot's last round, or a later one */
	atomic_thread_fence(memory_order_release);
	memcpy(to, slot, SLOT_HEAD);
	to->number = number;
	memcpy(to->data, data, kept);
	if (kept < size)
		memset(to->data + kept, 0, RECORDER_DATA - kept);
	atomic_store_explicit(&recorder->head->written, number + 1, memory_order_release);
	to = &recorder->slot[(number + 1) & recorder->mask];
	__builtin_prefetch(to, 1);
	__builtin_prefetch(to->data + RECORDER_DATA - 1, 1);
}

void recorder_tap(void *recorder, const struct event *event)
{
	const struct recorder_slot slot = {
		.t_ns = event->t_ns,
		.kind = RECORDER_EVENT,
		.device = event->device,
		.length = sizeof(*event),
	};

	recorder_write(recorder, &slot, event, sizeof(*event));
}
