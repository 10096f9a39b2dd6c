/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The ring in the order of time.
 *
 * Slots are in the order in which they were written, and a reply is written when
 * the daemon looks at it, which may be long after the kernel took it in. So slots
 * go through a small store that gives out the oldest one whenever it is full.
 *
 * What the daemon knows of a packet beyond its bytes is its comment: the cycle,
 * which try of a request it is, what became of a reply and when it was looked at.
 * Cycles themselves are not written, there are too many; one that began late is
 * an event.
 */
#include <errno.h>
#include <inttypes.h>
#include <string.h>
#include <time.h>
#include "daemon/recorder/export.h"
#include "daemon/recorder/pcapng.h"
#include "daemon/recorder/words.h"
#include "daemon/transport/frame.h"

enum { CHUNK = 512, STORE = 128, DATAGRAM_MAX = 65507 };

struct exporter {
	const struct recorder_file *file;
	const struct export_options *options;
	struct export_summary *summary;
	FILE *to;
	size_t stored;
	struct recorder_slot store[STORE]; /* oldest first */
};

static uint64_t clock_ns(clockid_t clock)
{
	struct timespec t;

	clock_gettime(clock, &t);
	return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

int64_t export_wall(void)
{
	return (int64_t)clock_ns(CLOCK_REALTIME) - (int64_t)clock_ns(CLOCK_MONOTONIC);
}

static const char *name_of(const struct exporter *e, uint8_t device)
{
	return device < e->file->head.devices ? e->file->head.name[device] : "";
}

/* With one device in the file it is interface 0. */
static uint32_t interface_of(const struct exporter *e, uint8_t device)
{
	return e->options->device == EXPORT_ALL ? device : 0;
}

/* From us to the device, or from it to us. */
static struct frame_path path_of(const struct exporter *e, const struct recorder_slot *slot)
{
	const bool sent = slot->kind == RECORDER_SENT;
	struct frame_path path = {
		.from = sent ? slot->local : slot->peer,
		.to = sent ? slot->peer : slot->local,
		.from_port = sent ? slot->local_port : slot->peer_port,
		.to_port = sent ? slot->peer_port : slot->local_port,
	};

	memcpy(path.from_mac, stations_mac(e->options->stations, path.from), FRAME_MAC);
	memcpy(path.to_mac, stations_mac(e->options->stations, path.to), FRAME_MAC);
	return path;
}

static void describe(const struct recorder_slot *slot, char *text, size_t size)
{
	if (slot->kind == RECORDER_SENT)
		snprintf(text, size, WORDS_SENT "%s", slot->cycle, slot->tries,
			 slot->once ? WORDS_ONCE : "");
	else if (slot->stamped)
		snprintf(text, size, WORDS_RECEIVED WORDS_TAKEN, slot->cycle,
			 words_verdict(slot->verdict), slot->taken_ns - slot->t_ns);
	else
		snprintf(text, size, WORDS_RECEIVED, slot->cycle, words_verdict(slot->verdict));
}

static void put_packet(struct exporter *e, const struct recorder_slot *slot)
{
	const struct frame_path path = path_of(e, slot);
	const bool sent = slot->kind == RECORDER_SENT;
	const size_t length = slot->length < DATAGRAM_MAX ? slot->length : DATAGRAM_MAX;
	const size_t kept = length < RECORDER_DATA ? length : RECORDER_DATA;
	uint8_t frame[FRAME_HEAD + RECORDER_DATA];
	char comment[128];
	const struct pcapng_packet packet = {
		.interface = interface_of(e, slot->device),
		.inbound = !sent,
		.outbound = sent,
		.t_ns = slot->t_ns + (uint64_t)e->options->wall_ns,
		.kept = (uint32_t)frame_make_cut(frame, &path, slot->data, kept, length),
		.length = (uint32_t)(FRAME_HEAD + length),
		.data = frame,
		.comment = comment,
	};

	if (slot->device >= e->file->head.devices)
		return;
	describe(slot, comment, sizeof(comment));
	pcapng_packet(e->to, &packet);
	e->summary->packets++;
}

static void put_entry(struct exporter *e, const struct recorder_slot *slot, int level,
		      const char *text)
{
	const struct pcapng_entry entry = {
		.t_ns = slot->t_ns + (uint64_t)e->options->wall_ns,
		.level = level,
		.device = name_of(e, slot->device),
		.text = text,
	};

	pcapng_entry(e->to, &entry);
	e->summary->events++;
}

static void put_event(struct exporter *e, const struct recorder_slot *slot)
{
	char text[256];
	struct event event;

	memcpy(&event, slot->data, sizeof(event));
	event_format(&event, slot->device < e->file->head.devices ? name_of(e, slot->device) : NULL,
		     text, sizeof(text));
	put_entry(e, slot, event.level, text);
}

/* A quarter of a period, or a whole one missed. */
static void put_late_cycle(struct exporter *e, const struct recorder_slot *slot)
{
	struct recorder_cycle cycle;
	char text[256];
	uint64_t late;

	memcpy(&cycle, slot->data, sizeof(cycle));
	late = cycle.woke_ns - cycle.tick_ns;
	if (!cycle.skipped && late < e->file->head.period_ns / 4)
		return;
	snprintf(text, sizeof(text),
		 "cycle %" PRIu64 " began %" PRIu64 " us late, its data was "
		 "out after %" PRIu64 " us; %u missed",
		 cycle.cycle, late / 1000, (cycle.published_ns - cycle.tick_ns) / 1000,
		 cycle.skipped);
	put_entry(e, slot, EVENT_INFO, text);
}

static void put(struct exporter *e, const struct recorder_slot *slot)
{
	const int wanted = e->options->device;

	if (wanted != EXPORT_ALL && slot->device != wanted && slot->device != 255)
		return;
	switch (slot->kind) {
	case RECORDER_SENT:
	case RECORDER_RECEIVED:
		put_packet(e, slot);
		break;
	case RECORDER_EVENT:
		put_event(e, slot);
		break;
	case RECORDER_CYCLE:
		put_late_cycle(e, slot);
		return;
	default:
		return;
	}
	if (!e->summary->first_ns)
		e->summary->first_ns = slot->t_ns;
	e->summary->last_ns = slot->t_ns;
}

static void put_oldest(struct exporter *e)
{
	put(e, &e->store[0]);
	memmove(&e->store[0], &e->store[1], --e->stored * sizeof(e->store[0]));
}

/* A slot into its place; nearly always the last one. */
static void store(struct exporter *e, const struct recorder_slot *slot)
{
	size_t at;

	if (e->stored == STORE)
		put_oldest(e);
	at = e->stored++;
	while (at > 0 && e->store[at - 1].t_ns > slot->t_ns)
		at--;
	memmove(&e->store[at + 1], &e->store[at], (e->stored - 1 - at) * sizeof(*slot));
	e->store[at] = *slot;
}

static void put_head(const struct exporter *e)
{
	const struct recorder_head *head = &e->file->head;

	pcapng_begin(e->to, e->options->application, e->options->comment);
	for (uint32_t i = 0; i < head->devices; i++)
		if (e->options->device == EXPORT_ALL || e->options->device == (int)i)
			pcapng_interface(e->to, head->name[i], "headers made by pokeysd");
}

int export_record(const struct recorder_file *file, const struct export_options *options, FILE *to,
		  struct export_summary *summary)
{
	static struct recorder_slot chunk[CHUNK];
	static struct exporter e;
	const uint64_t end = recorder_written(file);
	uint64_t next = 0;

	*summary = (struct export_summary){ 0 };
	e = (struct exporter){ .file = file, .options = options, .summary = summary, .to = to };
	errno = 0;
	put_head(&e);
	/* a file that can be read no further, or was cut short meanwhile, has no more */
	for (uint64_t before = UINT64_MAX; next < end && next != before && !ferror(to);) {
		size_t n;

		before = next;
		n = recorder_read(file, &next, chunk, CHUNK);
		for (size_t i = 0; i < n; i++)
			store(&e, &chunk[i]);
	}
	while (e.stored)
		put_oldest(&e);
	if (fflush(to) || ferror(to))
		return -(errno ? errno : EIO);
	return 0;
}
