// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Two streams with one clock, each nearly in order, and each late by some while of
 * its own. So cycles wait until everything of their time must have come; then marks
 * are sorted, cycles judged, and marks thrown away that no later cycle needs.
 *
 * All memory is bounded: what does not fit is counted as lost, and said.
 */
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <pokeys/async.h>
#include "tools/trace_collect.h"
#include "wire/packet.h"

#define BEFORE_NS UINT64_C(20000000)	/* marks that a cycle wants from before its tick */

int collect_begin(struct collect *collect)
{
	collect->mark = malloc(COLLECT_MARKS * sizeof(*collect->mark));
	collect->waiting = malloc(COLLECT_CYCLES * sizeof(*collect->waiting));
	return collect->mark && collect->waiting ? 0 : -ENOMEM;
}

void collect_end(struct collect *collect)
{
	free(collect->mark);
	free(collect->waiting);
	free(collect->length);
}

static struct trace_mark *add_mark(struct collect *collect, enum trace_mark_kind kind,
				   uint64_t t_ns)
{
	struct trace_mark *mark = &collect->mark[collect->marks];

	if (collect->marks == COLLECT_MARKS) {
		collect->lost++;
		return NULL;
	}
	collect->marks++;
	*mark = (struct trace_mark){ .t_ns = t_ns, .kind = kind, .order = collect->order++ };
	return mark;
}

void collect_event(void *context, const struct trace_event *event)
{
	struct trace_mark *mark = add_mark(context, MARK_KERNEL, event->t_ns);

	if (mark)
		mark->event = *event;
}

static void add_cycle(struct collect *collect, const struct recorder_slot *slot)
{
	struct trace_cycle *cycle = &collect->waiting[collect->waitings];
	struct recorder_cycle recorded;

	memcpy(&recorded, slot->data, sizeof(recorded));
	if (recorded.tick_ns < collect->begin_ns || recorded.published_ns <= recorded.tick_ns)
		return;
	if (collect->waitings == COLLECT_CYCLES) {
		collect->lost++;
		return;
	}
	collect->waitings++;
	*cycle = (struct trace_cycle){
		.cycle = recorded.cycle,
		.tick_ns = recorded.tick_ns,
		.woke_ns = recorded.woke_ns,
		.asked_ns = recorded.asked_ns,
		.published_ns = recorded.published_ns,
		.skipped = recorded.skipped,
		.spins = collect->spins,
	};
}

static void add_packet(struct collect *collect, enum trace_mark_kind kind,
		       const struct recorder_slot *slot)
{
	struct trace_mark *mark = add_mark(collect, kind, slot->t_ns);

	if (mark)
		mark->request = slot->device * 256u + slot->data[WIRE_AT_ID];
}

void collect_slot(struct collect *collect, const struct recorder_slot *slot)
{
	if (slot->kind == RECORDER_CYCLE)
		add_cycle(collect, slot);
	else if (slot->kind == RECORDER_SENT)
		add_packet(collect, MARK_SENT, slot);
	else if (slot->kind == RECORDER_RECEIVED && slot->verdict == POKEYS_VERDICT_ACCEPTED)
		add_packet(collect, MARK_GOT, slot);
}

static int by_time(const void *a, const void *b)
{
	const struct trace_mark *one = a, *other = b;

	if (one->t_ns != other->t_ns)
		return one->t_ns < other->t_ns ? -1 : 1;
	return one->order < other->order ? -1 : one->order > other->order;
}

/* The first mark that is not before t_ns. */
static size_t first_mark(const struct collect *collect, uint64_t t_ns)
{
	size_t low = 0, high = collect->marks;

	while (low < high) {
		size_t middle = (low + high) / 2;

		if (collect->mark[middle].t_ns < t_ns)
			low = middle + 1;
		else
			high = middle;
	}
	return low;
}

static void add_length(struct collect *collect, uint64_t length_ns)
{
	if (collect->lengths == collect->room) {
		size_t room = collect->room ? 2 * collect->room : 4096;
		uint64_t *length = realloc(collect->length, room * sizeof(*length));

		if (!length) {
			collect->lost++;
			return;
		}
		collect->length = length;
		collect->room = room;
	}
	collect->length[collect->lengths++] = length_ns;
}

/* Into its place among the slowest. */
static void keep(struct collect *collect, const struct trace_cycle *cycle)
{
	size_t at = collect->count;

	while (at > 0 && trace_length(&collect->slowest[at - 1]) < trace_length(cycle))
		at--;
	if (at >= collect->wanted)
		return;
	if (collect->count < collect->wanted)
		collect->count++;
	memmove(&collect->slowest[at + 1], &collect->slowest[at],
		(collect->count - 1 - at) * sizeof(*cycle));
	collect->slowest[at] = *cycle;
}

static void judge(struct collect *collect, struct trace_cycle *cycle)
{
	size_t first = first_mark(collect, cycle->tick_ns - BEFORE_NS);

	add_length(collect, trace_length(cycle));
	if (trace_length(cycle) < collect->threshold_ns)
		return;
	if (collect->count == collect->wanted && collect->wanted &&
	    trace_length(cycle) <= trace_length(&collect->slowest[collect->count - 1]))
		return;
	trace_attribute(cycle, &collect->mark[first], collect->marks - first);
	keep(collect, cycle);
}

void collect_judge(struct collect *collect, uint64_t until_ns)
{
	size_t left = 0, first;
	uint64_t oldest_ns = until_ns;

	qsort(collect->mark, collect->marks, sizeof(*collect->mark), by_time);
	for (size_t i = 0; i < collect->waitings; i++) {
		if (collect->waiting[i].published_ns < until_ns) {
			judge(collect, &collect->waiting[i]);
			continue;
		}
		if (collect->waiting[i].tick_ns < oldest_ns)
			oldest_ns = collect->waiting[i].tick_ns;
		collect->waiting[left++] = collect->waiting[i];
	}
	collect->waitings = left;
	/* a cycle that has not ended yet may have begun before */
	first = first_mark(collect, oldest_ns - 2 * BEFORE_NS);
	collect->marks -= first;
	memmove(collect->mark, &collect->mark[first], collect->marks * sizeof(*collect->mark));
}

static int by_length(const void *a, const void *b)
{
	const uint64_t one = *(const uint64_t *)a, other = *(const uint64_t *)b;

	return one < other ? -1 : one > other;
}

void collect_report(struct collect *collect, struct trace_report *report)
{
	const size_t n = collect->lengths;

	report->cycles = n;
	report->dropped += collect->lost;
	report->cycle = collect->slowest;
	report->count = collect->count;
	if (!n)
		return;
	qsort(collect->length, n, sizeof(*collect->length), by_length);
	report->median_ns = collect->length[n / 2];
	report->p99_ns = collect->length[n - 1 - n / 100];
	report->max_ns = collect->length[n - 1];
}
