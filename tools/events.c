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
	struct pokeys_event event;
};

struct round {
	size_t count;
	struct row row[ROUND_MAX];
};

static const char *level_name(uint32_t level)
{
	static const char *const names[] = {
		[3] = "error", [4] = "warning", [5] = "notice", [6] = "info", [7] = "debug",
	};

	return level < sizeof(names) / sizeof(names[0]) && names[level] ? names[level] : "error";
}

/* What has come of one device since the last time. */
static void take(struct round *round, const struct view_device *device,
		 struct pokeys_events_cursor *cursor)
{
	static struct pokeys_event events[POKEYS_EVENTS_KEPT];
	int count = pokeys_client_read_events(device->client, cursor, events, sizeof(events[0]),
					      POKEYS_EVENTS_KEPT);

	for (int i = 0; i < count; i++) {
		struct row *row = &round->row[round->count++];

		*row = (struct row){ device->name, cursor->epoch, events[i] };
		usage_printable(row->event.kind);
		usage_printable(row->event.text);
	}
}

static int compare(uint64_t one, uint64_t other)
{
	return one < other ? -1 : one > other;
}

/* By time; those of one moment by device, and as they were logged. */
static int by_time(const void *a, const void *b)
{
	const struct row *one = a, *other = b;
	int r = compare(one->event.t_ns, other->event.t_ns);

	if (!r)
		r = strcmp(one->device, other->device);
	return r ? r : compare(one->event.number, other->event.number);
}

static void print_text(const struct row *row)
{
	const time_t seconds = (time_t)(row->event.wall_ns / UINT64_C(1000000000));
	const unsigned int ms = (unsigned int)(row->event.wall_ns / 1000000 % 1000);
	struct tm local = { 0 };
	char date[32];

	localtime_r(&seconds, &local);
	strftime(date, sizeof(date), "%Y-%m-%d %H:%M:%S", &local);
	printf("%s.%03u  %-7s  %s: %s", date, ms, level_name(row->event.level), row->device,
	       row->event.text);
	if (row->event.held)
		printf(" (%" PRIu32 " more of this kind were not logged)", row->event.held);
	putchar('\n');
}

static void print_json(const struct row *row)
{
	struct json json;

	json_init(&json, stdout);
	json_object(&json, NULL);
	json_unsigned(&json, "format", 1);
	json_text(&json, "device", row->device);
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

static void print_round(const struct options *options, const struct view *view,
			struct pokeys_events_cursor *cursors)
{
	static struct round round;

	round.count = 0;
	for (size_t i = 0; i < view->count; i++)
		take(&round, &view->device[i], &cursors[i]);
	qsort(round.row, round.count, sizeof(round.row[0]), by_time);
	for (size_t i = 0; i < round.count; i++)
		options->json ? print_json(&round.row[i]) : print_text(&round.row[i]);
	fflush(stdout);
}

/* Until the user ends it; over restarts of the daemon. */
static void follow(const struct options *options, struct view *view,
		   struct pokeys_events_cursor *cursors)
{
	const int signal_fd = screen_signals();
	struct screen screen = { .terminal = false };

	do {
		/* before looking for another daemon: the last words of this one are not lost */
		print_round(options, view, cursors);
		for (size_t i = 0; i < view->count; i++)
			pokeys_client_poll(view->device[i].client);
	} while (!ferror(stdout) && !screen_wait(&screen, LOOK_S, signal_fd));
	if (signal_fd >= 0)
		close(signal_fd);
}

/* Devices that are not there are told of, as by `status`. */
static int missing(const struct view *view)
{
	int status = STATUS_OK;

	for (size_t i = 0; i < view->count; i++)
		if (view->device[i].freshness == VIEW_NONE) {
			complain("%s: %s", view->device[i].name, view->device[i].why);
			status = STATUS_FAILED;
		}
	return status;
}

int command_events(const struct options *options)
{
	struct pokeys_events_cursor cursors[VIEW_DEVICES] = { 0 };
	struct view *view = view_only();
	int status = view_open(view, options->runtime_directory, options->names,
			       options->name_count);

	if (!status) {
		view_read(view);
		status = missing(view);
		if (options->follow)
			follow(options, view, cursors);
		else
			print_round(options, view, cursors);
	}
	view_close(view);
	return status;
}
