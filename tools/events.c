// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeysctl events: what the daemon has logged of its devices, without the right to read its
 * log. It is in the shared memory, so it is there as soon as the log has it, and stays readable
 * after the daemon has died.
 */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>
#include "tools/json.h"
#include "tools/pokeysctl.h"
#include "tools/screen.h"
#include "tools/view.h"
#include "usage/printable.h"

#define LOOK_S 0.1

enum { ROUND_MAX = VIEW_DEVICES * POKEYS_EVENTS_KEPT };

struct row {
	const char *device;
	uint64_t epoch;
	bool restarted;    /* the first of another daemon */
	uint64_t lost;     /* overwritten before they were read */
	uint64_t order_ns; /* its time, or that of one before it, of the same device */
	struct pokeys_event event;
};

/* How far a device was read. */
struct place {
	struct pokeys_events_cursor cursor;
	uint64_t epoch, number, order_ns; /* of the last event; 0 = none yet */
	bool restarted;                   /* not printed yet */
	uint64_t lost;
	enum pokeys_client_state attached;
};

struct events {
	const struct options *options;
	struct view *view;
	struct place place[VIEW_DEVICES];
	struct pokeys_event taken[POKEYS_EVENTS_KEPT];
	size_t rows;
	struct row row[ROUND_MAX];
};

static const char *level_name(uint32_t level)
{
	static const char *const names[] = {
		[3] = "error",
		[4] = "warning",
		[5] = "notice",
		[6] = "info",
	};

	return level < sizeof(names) / sizeof(names[0]) && names[level] ? names[level] : "error";
}

static void count(struct place *place, const struct pokeys_event *event)
{
	const bool same = place->epoch == place->cursor.epoch;

	if (place->epoch) {
		place->restarted |= !same;
		place->lost += event->number - (same ? place->number : 0) - 1;
	}
	place->epoch = place->cursor.epoch;
	place->number = event->number;
	if (event->t_ns > place->order_ns)
		place->order_ns = event->t_ns;
}

static void add(struct events *events, const char *device, struct place *place,
		const struct pokeys_event *event)
{
	struct row *row = &events->row[events->rows++];

	*row = (struct row){
		.device = device,
		.epoch = place->epoch,
		.restarted = place->restarted,
		.lost = place->lost,
		.order_ns = place->order_ns,
		.event = *event,
	};
	usage_printable(row->event.kind);
	usage_printable(row->event.text);
	place->restarted = false;
	place->lost = 0;
}

/* What has come of one device since the last time; what concerns all of them only of the first. */
static void take(struct events *events, size_t which)
{
	const struct view_device *device = &events->view->device[which];
	struct place *place = &events->place[which];
	int taken = pokeys_client_read_events(device->client, &place->cursor, events->taken,
					      sizeof(events->taken[0]), POKEYS_EVENTS_KEPT);

	for (int i = 0; i < taken; i++) {
		const struct pokeys_event *event = &events->taken[i];

		count(place, event);
		if (!which || !(event->flags & POKEYS_EVENT_ALL_DEVICES))
			add(events, device->name, place, event);
	}
}

static int compare(uint64_t one, uint64_t other)
{
	return one < other ? -1 : one > other;
}

/* By time; those of one device as they were logged. */
static int by_time(const void *a, const void *b)
{
	const struct row *one = a, *other = b;
	int r = compare(one->order_ns, other->order_ns);

	if (!r)
		r = strcmp(one->device, other->device);
	return r ? r : compare(one->event.number, other->event.number);
}

static const char *device_of(const struct row *row)
{
	return row->event.flags & POKEYS_EVENT_ALL_DEVICES ? NULL : row->device;
}

static void print_text(const struct row *row)
{
	const time_t seconds = (time_t)(row->event.wall_ns / UINT64_C(1000000000));
	const unsigned int ms = (unsigned int)(row->event.wall_ns / 1000000 % 1000);
	const char *device = device_of(row);
	struct tm local = { 0 };
	char date[32];

	if (row->restarted)
		printf("(%s: pokeysd was started again)\n", row->device);
	if (row->lost)
		printf("(%s: %" PRIu64 " events came faster than they could be printed)\n",
		       row->device, row->lost);
	localtime_r(&seconds, &local);
	strftime(date, sizeof(date), "%Y-%m-%d %H:%M:%S", &local);
	printf("%s.%03u  %-7s  %s%s%s", date, ms, level_name(row->event.level),
	       device ? device : "", device ? ": " : "", row->event.text);
	if (row->event.held)
		printf(" (%" PRIu32 " more of this kind were not written)", row->event.held);
	putchar('\n');
}

static void print_json(const struct row *row)
{
	struct json json;

	json_init(&json, stdout);
	json_object(&json, NULL);
	json_unsigned(&json, "format", 1);
	if (device_of(row))
		json_text(&json, "device", row->device);
	else
		json_null(&json, "device");
	json_unsigned(&json, "epoch", row->epoch);
	json_unsigned(&json, "number", row->event.number);
	json_unsigned(&json, "time_ns", row->event.wall_ns);
	json_unsigned(&json, "monotonic_ns", row->event.t_ns);
	json_unsigned(&json, "level", row->event.level);
	json_text(&json, "kind", row->event.kind);
	json_text(&json, "text", row->event.text);
	json_unsigned(&json, "held", row->event.held);
	json_end(&json);
}

/* Print what there is. Returns how many events that was. */
static size_t print_round(struct events *events)
{
	events->rows = 0;
	for (size_t i = 0; i < events->view->count; i++)
		take(events, i);
	qsort(events->row, events->rows, sizeof(events->row[0]), by_time);
	for (size_t i = 0; i < events->rows; i++)
		if (events->options->json)
			print_json(&events->row[i]);
		else
			print_text(&events->row[i]);
	fflush(stdout);
	return events->rows;
}

/* Look for another daemon. If there is none, or it refuses us, say so once. */
static void look(const struct view_device *device, struct place *place)
{
	const enum pokeys_client_state attached = pokeys_client_poll(device->client);
	char why[256];

	if (attached != place->attached && attached != POKEYS_CLIENT_ATTACHED) {
		pokeys_client_status(device->client, why, sizeof(why));
		complain("%s: %s", device->name, why);
	}
	place->attached = attached;
}

/* Until the user ends it; over restarts of the daemon. False: nobody reads it any more. */
static bool follow(struct events *events)
{
	const int signal_fd = screen_signals();
	struct screen screen = { .terminal = false };

	do {
		/* the last events of a daemon are lost when another one is attached to */
		while (print_round(events) && !ferror(stdout))
			;
		for (size_t i = 0; i < events->view->count; i++)
			look(&events->view->device[i], &events->place[i]);
	} while (!ferror(stdout) && !screen_wait(&screen, LOOK_S, signal_fd));
	if (signal_fd >= 0)
		close(signal_fd);
	return !screen.left;
}

/* What is printed may be old, or may not be all. */
static int judge(const struct view *view)
{
	int status = STATUS_OK;

	for (size_t i = 0; i < view->count; i++) {
		const struct view_device *device = &view->device[i];

		if (device->freshness == VIEW_NONE || device->freshness == VIEW_DEAD)
			complain("%s: %s", device->name, device->why);
		if (device->freshness == VIEW_NONE)
			status = STATUS_FAILED;
	}
	return status;
}

/* False: not all of it was read. */
static bool print(struct events *events)
{
	for (size_t i = 0; i < events->view->count; i++)
		events->place[i].attached = POKEYS_CLIENT_ATTACHED;
	if (events->options->follow)
		return follow(events);
	print_round(events);
	return true;
}

int command_events(const struct options *options)
{
	struct view *view = view_only();
	struct events *events;
	int status = view_open(view, options->runtime_directory, options->names,
			       options->name_count);

	if (!status) {
		view_read(view);
		status = judge(view);
		events = calloc(1, sizeof(*events));
		if (!events) {
			complain("not enough memory");
			status = STATUS_FAILED;
		} else {
			events->options = options;
			events->view = view;
			if (!print(events))
				status = STATUS_FAILED;
			free(events);
		}
	}
	view_close(view);
	return status;
}
