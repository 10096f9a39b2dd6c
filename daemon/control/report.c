// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Both texts are made from images read back from the shared memory, not from
 * the loop's own variables: the realtime thread has nothing to hand over, and
 * what is reported is what a reader gets.
 *
 * A metric is a row of a table: name, help, and where it stands in an image.
 */
#include <errno.h>
#include <string.h>
#include <pokeys/names.h>
#include <pokeys/shm.h>
#include "daemon/control/report.h"

enum image { STATE, DIAG };

/* The order of devices in the status if not all fit. */
enum rank { RANK_ON, RANK_MISSING, RANK_RUNNING, RANKS };

enum { DEVICE_SIZE = 120, MORE_SIZE = 20 };

struct metric {
	const char *name, *type, *help;
	enum image image;
	size_t offset;
	size_t width;
};

#define IN_STATE(field) STATE, offsetof(struct pokeys_state, field), \
	sizeof(((struct pokeys_state *)0)->field)
#define IN_DIAG(field) DIAG, offsetof(struct pokeys_diag, field), \
	sizeof(((struct pokeys_diag *)0)->field)

static const struct metric metrics[] = {
	{ "cycles_total", "counter", "Cycles of the realtime loop", IN_STATE(cycle) },
	{ "cycles_skipped_total", "counter", "Ticks missed and not caught up",
	  IN_DIAG(cycles_skipped) },
	{ "events_dropped_total", "counter", "Events lost before they were logged",
	  IN_DIAG(events_dropped) },
	{ "system_calls_total", "counter", "System calls of the realtime thread's transport",
	  IN_DIAG(transport_system_calls) },
	{ "minor_faults_total", "counter", "Minor page faults of the realtime thread",
	  IN_DIAG(minor_faults) },
	{ "major_faults_total", "counter", "Major page faults of the realtime thread",
	  IN_DIAG(major_faults) },
	{ "device_link", "gauge", "0 searching, 1 identifying, 2 configuring, 3 running, 4 lost",
	  IN_STATE(link) },
	{ "device_fault", "gauge", "Reason of the last fault (enum pokeys_fault)",
	  IN_STATE(fault) },
	{ "device_flags", "gauge", "Bits of POKEYS_STATE_", IN_STATE(flags) },
	{ "packets_sent_total", "counter", "Requests sent", IN_STATE(statistics.sent) },
	{ "packets_resent_total", "counter", "Of them, repeated", IN_STATE(statistics.resent) },
	{ "packets_received_total", "counter", "Datagrams received",
	  IN_STATE(statistics.received) },
	{ "packets_accepted_total", "counter", "Replies that fit a request",
	  IN_STATE(statistics.accepted) },
	{ "packets_missed_total", "counter", "Requests without reply by their deadline",
	  IN_STATE(statistics.missed) },
	{ "packets_late_total", "counter", "Of them, answered later", IN_STATE(statistics.late) },
	{ "packets_lost_total", "counter", "Of them, never answered", IN_STATE(statistics.lost) },
	{ "requests_timed_out_total", "counter", "Requests given up",
	  IN_STATE(statistics.timed_out) },
	{ "packets_stray_total", "counter", "Replies nobody asked for",
	  IN_STATE(statistics.stray) },
	{ "packets_duplicate_total", "counter", "Replies that came again",
	  IN_STATE(statistics.duplicate) },
	{ "packets_stale_total", "counter", "Replies that came too late",
	  IN_STATE(statistics.stale) },
	{ "packets_corrupt_total", "counter", "Datagrams that are not replies",
	  IN_STATE(statistics.corrupt) },
	{ "packets_wrong_source_total", "counter", "Datagrams from somewhere else",
	  IN_STATE(statistics.wrong_source) },
	{ "packets_unsent_total", "counter", "Requests the kernel did not take",
	  IN_STATE(statistics.send_failed) },
	{ "cycles_late_total", "counter", "Cycles whose fast data came later",
	  IN_STATE(statistics.cycles_late) },
	{ "reconnects_total", "counter", "Times the device was found again",
	  IN_STATE(statistics.reconnects) },
	{ "commands_refused_total", "counter", "Command images with values that were refused",
	  IN_STATE(statistics.refused_command) },
	{ "packets_in_flight", "gauge", "Requests on their way", IN_STATE(statistics.in_flight) },
};

static const struct {
	const char *name, *help;
	size_t offset;
} histograms[] = {
	{ "wakeup_seconds", "Tick to running", offsetof(struct pokeys_diag, wakeup) },
	{ "round_trip_seconds", "Request to reply", offsetof(struct pokeys_diag, round_trip) },
	{ "read_round_trip_seconds", "Request to reply, reads",
	  offsetof(struct pokeys_diag, read_round_trip) },
	{ "write_round_trip_seconds", "Request to reply, idempotent writes",
	  offsetof(struct pokeys_diag, write_round_trip) },
	{ "one_shot_round_trip_seconds", "Request to reply, one-shots",
	  offsetof(struct pokeys_diag, one_shot_round_trip) },
	{ "receive_seconds", "Kernel's receive stamp to the daemon",
	  offsetof(struct pokeys_diag, receive) },
	{ "publish_seconds", "Cost of publishing", offsetof(struct pokeys_diag, publish) },
	{ "age_at_read_seconds", "Age of the fast data when the commander reads them",
	  offsetof(struct pokeys_diag, age_at_read) },
	{ "fresh_seconds", "Tick to fast data complete", offsetof(struct pokeys_diag, fresh) },
	{ "cycle_work_seconds", "Tick to end of work", offsetof(struct pokeys_diag, cycle_work) },
};

static unsigned long long value_of(const struct report_device *device, const struct metric *metric)
{
	const char *image = metric->image == STATE ? (const char *)&device->state :
						     (const char *)&device->diag;
	uint64_t wide = 0;

	/* little-endian hosts only, as the whole of pokeysd: wire layouts are memcpy'd too */
	memcpy(&wide, image + metric->offset, metric->width);
	return wide;
}

static void print_metric(const struct report *report, const struct metric *metric, FILE *to)
{
	fprintf(to, "# HELP pokeysd_%s %s\n# TYPE pokeysd_%s %s\n", metric->name, metric->help,
		metric->name, metric->type);
	for (uint32_t i = 0; i < report->devices; i++)
		if (report->device[i].known)
			fprintf(to, "pokeysd_%s{device=\"%s\"} %llu\n", metric->name,
				report->device[i].name, value_of(&report->device[i], metric));
}

static void print_histogram(const struct report *report, size_t row, FILE *to)
{
	static const double quantiles[] = { 0.5, 0.9, 0.99, 0.999 };
	const char *name = histograms[row].name;

	fprintf(to, "# HELP pokeysd_%s %s\n# TYPE pokeysd_%s summary\n", name, histograms[row].help,
		name);
	for (uint32_t i = 0; i < report->devices; i++) {
		const struct report_device *device = &report->device[i];
		const struct pokeys_histogram *h = (const void *)((const char *)&device->diag +
								  histograms[row].offset);

		if (!device->known)
			continue;
		for (size_t q = 0; q < sizeof(quantiles) / sizeof(quantiles[0]); q++)
			fprintf(to, "pokeysd_%s{device=\"%s\",quantile=\"%g\"} %.9f\n", name,
				device->name, quantiles[q],
				(double)pokeys_histogram_percentile(h, quantiles[q]) / 1e9);
		fprintf(to, "pokeysd_%s_sum{device=\"%s\"} %.9f\n", name, device->name,
			(double)h->sum_ns / 1e9);
		fprintf(to, "pokeysd_%s_count{device=\"%s\"} %llu\n", name, device->name,
			(unsigned long long)h->count);
	}
}

static void print_age(const struct report *report, FILE *to)
{
	fputs("# HELP pokeysd_data_age_seconds Age of the fast data when this was written\n"
	      "# TYPE pokeysd_data_age_seconds gauge\n",
	      to);
	for (uint32_t i = 0; i < report->devices; i++) {
		const struct report_device *device = &report->device[i];
		const uint64_t age_ns = pokeys_state_age_ns(&device->state, report->now_ns);

		if (device->known && age_ns != POKEYS_NEVER)
			fprintf(to, "pokeysd_data_age_seconds{device=\"%s\"} %.9f\n", device->name,
				(double)age_ns / 1e9);
	}
}

static void print_guard(const struct guarded *guard, FILE *to)
{
	fprintf(to,
		"# HELP pokeysd_guard Whether the XDP guard is on the interface\n"
		"# TYPE pokeysd_guard gauge\npokeysd_guard %d\n",
		guard->on);
	if (guard->counters)
		fputs("# HELP pokeysd_guard_packets_total Packets by what the XDP guard did\n"
		      "# TYPE pokeysd_guard_packets_total counter\n",
		      to);
	for (uint32_t i = 0; i < guard->counters; i++)
		fprintf(to, "pokeysd_guard_packets_total{verdict=\"%s\"} %llu\n",
			guard->counter[i].name, (unsigned long long)guard->counter[i].value);
}

int report_metrics(const struct report *report, FILE *to)
{
	for (size_t i = 0; i < sizeof(metrics) / sizeof(metrics[0]); i++)
		print_metric(report, &metrics[i], to);
	for (size_t i = 0; i < sizeof(histograms) / sizeof(histograms[0]); i++)
		print_histogram(report, i, to);
	print_age(report, to);
	print_guard(&report->guard, to);
	fprintf(to,
		"# HELP pokeysd_log_dropped_total Messages nobody took\n"
		"# TYPE pokeysd_log_dropped_total counter\npokeysd_log_dropped_total %llu\n",
		(unsigned long long)report->log_dropped);
	fprintf(to,
		"# HELP pokeysd_metrics_failed_total Times this file could not be written\n"
		"# TYPE pokeysd_metrics_failed_total counter\npokeysd_metrics_failed_total %llu\n",
		(unsigned long long)report->metrics_failed);
	fprintf(to,
		"# HELP pokeysd_requests_refused_total Orders of pokeysctl that were refused\n"
		"# TYPE pokeysd_requests_refused_total counter\n"
		"pokeysd_requests_refused_total %llu\n",
		(unsigned long long)report->requests_refused);
	return fflush(to) || ferror(to) ? -EIO : 0;
}

static size_t append_device(const struct report_device *device, char *text, size_t size)
{
	const struct pokeys_state *state = &device->state;
	const char *on = pokeys_what_is_on(state); /* a restart would stop it */
	int length;

	if (!device->known)
		length = snprintf(text, size, "%s not published yet", device->name);
	else if (state->link == POKEYS_LINK_RUNNING)
		length = snprintf(text, size, "%s running%s%s%s%s, %u us", device->name,
				  state->flags & POKEYS_STATE_SAFE ? " (safe state)" : "",
				  on ? ", " : "", on ? on : "", on ? " on" : "",
				  state->statistics.rtt_smoothed_ns / 1000);
	else if (state->fault)
		length = snprintf(text, size, "%s %s: %s", device->name,
				  pokeys_link_name(state->link), pokeys_fault_name(state->fault));
	else
		length = snprintf(text, size, "%s %s", device->name, pokeys_link_name(state->link));
	return length < 0 ? 0 : (size_t)length < size ? (size_t)length : size - 1;
}

/* Devices that are on, or whose state is unknown, must be seen even if not all fit. */
static enum rank rank_of(const struct report_device *device)
{
	if (!device->known || pokeys_what_is_on(&device->state))
		return RANK_ON;
	return device->state.link == POKEYS_LINK_RUNNING ? RANK_RUNNING : RANK_MISSING;
}

/* Append the devices of a rank, RANKS = all, at *at. Returns how many did not fit. */
static uint32_t append_rank(const struct report *report, enum rank rank, char *text, size_t size,
			    size_t *at)
{
	uint32_t left = 0;

	for (uint32_t i = 0; i < report->devices; i++) {
		const struct report_device *device = &report->device[i];
		char one[DEVICE_SIZE];
		size_t length;

		if (rank != RANKS && rank_of(device) != rank)
			continue;
		length = append_device(device, one, sizeof(one));
		if (*at + 2 + length >= size) {
			left++;
			continue;
		}
		*at += (size_t)snprintf(text + *at, size - *at, "%s%s", *at ? "; " : "", one);
	}
	return left;
}

size_t report_status(const struct report *report, char *text, size_t size)
{
	uint32_t left = 0;
	size_t at = 0;

	text[0] = '\0';
	if (!append_rank(report, RANKS, text, size, &at))
		return at;
	at = 0;
	for (enum rank rank = 0; rank < RANKS; rank++)
		left += append_rank(report, rank, text, left ? 0 : size - MORE_SIZE, &at);
	return at + (size_t)snprintf(text + at, size - at, "; and %u more", left);
}
