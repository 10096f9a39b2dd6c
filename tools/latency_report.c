// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Histograms side by side, for a person and for a script. What was measured
 * where stands above them: a maximum without its duration, its number of
 * samples and its kernel says nothing.
 *
 * Bars are logarithmic. What matters is the single late one among a million,
 * and on a linear scale it is not there.
 */
#include <math.h>
#include <string.h>
#include <pokeys/shm.h>
#include "tools/json.h"
#include "tools/latency.h"
#include "tools/print.h"

enum { OCTAVE = 4, BAR = 12 };

/* Nothing that is counted ever becomes less: then it is another daemon's, from zero. */
static bool is_another(const struct pokeys_histogram *before, const struct pokeys_histogram *after)
{
	bool another = after->count < before->count;

	for (int i = 0; i < POKEYS_HISTOGRAM_BUCKETS; i++)
		another |= after->bucket[i] < before->bucket[i];
	return another;
}

void latency_since(const struct pokeys_histogram *before, const struct pokeys_histogram *after,
		   struct pokeys_histogram *out)
{
	int first = -1, last = -1;

	*out = *after;
	if (is_another(before, after))
		return;
	out->count -= before->count;
	out->sum_ns -= before->sum_ns;
	for (int i = 0; i < POKEYS_HISTOGRAM_BUCKETS; i++) {
		out->bucket[i] -= before->bucket[i];
		if (!out->bucket[i])
			continue;
		first = first < 0 ? i : first;
		last = i;
	}
	/*
	 * The extremes of this part alone are known as far as the buckets are wide, and never
	 * beyond those of the whole.
	 */
	if (first < 0)
		out->min_ns = 0;
	else if (out->min_ns == before->min_ns &&
		 out->min_ns < pokeys_histogram_lower((unsigned int)first))
		out->min_ns = pokeys_histogram_lower((unsigned int)first);
	if (last < 0)
		out->max_ns = 0;
	else if (out->max_ns == before->max_ns && last + 1 < POKEYS_HISTOGRAM_BUCKETS &&
		 out->max_ns > pokeys_histogram_lower((unsigned int)last + 1))
		out->max_ns = pokeys_histogram_lower((unsigned int)last + 1);
}

static double mean(const struct pokeys_histogram *histogram)
{
	return histogram->count ? (double)histogram->sum_ns / (double)histogram->count : NAN;
}

/* Rows of the table: a part of all, or one of the extremes. */
static const struct {
	const char *title, *key;
	double part;
} rows[] = {
	{ "least", "min_us", -1 },     { "median", "p50_us", 0.5 }, { "p99", "p99_us", 0.99 },
	{ "p99.9", "p999_us", 0.999 }, { "most", "max_us", 2 },
};

enum { ROWS = sizeof(rows) / sizeof(rows[0]) };

static double value_of(const struct pokeys_histogram *histogram, double part)
{
	if (!histogram->count)
		return NAN;
	if (part < 0)
		return (double)histogram->min_ns;
	if (part > 1)
		return (double)histogram->max_ns;
	return (double)pokeys_histogram_percentile(histogram, part);
}

static void print_head(const struct latency_run *run, FILE *to)
{
	char period[16];

	fprintf(to, "Linux %s%s, %.1f s, every %s, ", run->kernel,
		run->is_virtual > 0 ? ", a virtual machine" :
		run->is_virtual < 0 ? ", perhaps a virtual machine" :
				      "",
		run->seconds, print_duration((double)run->period_ns, period));
	if (run->priority)
		fprintf(to, "SCHED_FIFO %d, locked memory\n", run->priority);
	else
		fprintf(to, "NOT REALTIME\n");
	if (*run->note)
		fprintf(to, "%s\n", run->note);
	fprintf(to, "\n%-10s", "");
	for (size_t i = 0; i < run->count; i++)
		fprintf(to, "  %-22s", run->series[i].title);
	fprintf(to, "\n%-10s", "samples");
	for (size_t i = 0; i < run->count; i++)
		fprintf(to, "  %-22llu", (unsigned long long)run->series[i].histogram.count);
	fputc('\n', to);
}

static uint64_t octave(const struct pokeys_histogram *histogram, size_t first)
{
	uint64_t count = 0;

	for (size_t i = first; i < first + OCTAVE; i++)
		count += histogram->bucket[i];
	return count;
}

static void print_bars(const struct latency_run *run, size_t first, FILE *to)
{
	static const char bar[BAR + 1] = "############";
	char from[16];

	fprintf(to, "%-10s",
		print_duration((double)pokeys_histogram_lower((unsigned int)first), from));
	for (size_t i = 0; i < run->count; i++) {
		const struct pokeys_histogram *histogram = &run->series[i].histogram;
		uint64_t count = octave(histogram, first);
		double part = count ? (1 + log((double)count)) /
					      (1 + log((double)histogram->count)) :
				      0;

		fprintf(to, "  %8llu %-13.*s", (unsigned long long)count,
			(int)fmin(ceil(part * BAR), BAR), bar);
	}
	fputc('\n', to);
}

static void print_parts(const struct latency_run *run, FILE *to)
{
	fprintf(to, "\n%-16s", "pokeysd");
	for (size_t r = 0; r < ROWS; r++)
		fprintf(to, " %9s", rows[r].title);
	fputc('\n', to);
	for (size_t i = 0; i < run->parts; i++) {
		if (!run->part[i].histogram.count)
			continue;
		fprintf(to, "%-16s", run->part[i].title);
		for (size_t r = 0; r < ROWS; r++) {
			char text[16];

			fprintf(to, " %9s",
				print_duration(value_of(&run->part[i].histogram, rows[r].part),
					       text));
		}
		fputc('\n', to);
	}
}

void latency_print(const struct latency_run *run, FILE *to)
{
	size_t first = POKEYS_HISTOGRAM_BUCKETS, last = 0;

	print_head(run, to);
	for (size_t r = 0; r < ROWS; r++) {
		fprintf(to, "%-10s", rows[r].title);
		for (size_t i = 0; i < run->count; i++) {
			char text[16];

			print_duration(value_of(&run->series[i].histogram, rows[r].part), text);
			fprintf(to, "  %-22s", text);
		}
		fputc('\n', to);
	}
	for (size_t at = 0; at < POKEYS_HISTOGRAM_BUCKETS; at += OCTAVE)
		for (size_t i = 0; i < run->count; i++)
			if (octave(&run->series[i].histogram, at)) {
				first = at < first ? at : first;
				last = at;
			}
	fprintf(to, "\nfrom\n");
	for (size_t at = first; at <= last; at += OCTAVE)
		print_bars(run, at, to);
	if (run->parts)
		print_parts(run, to);
}

/* Numbers of a histogram, null where it has no samples. */
static void put_values(struct json *json, const struct pokeys_histogram *histogram)
{
	json_unsigned(json, "samples", histogram->count);
	json_real(json, "mean_us", mean(histogram) / 1e3);
	for (size_t r = 0; r < ROWS; r++)
		json_real(json, rows[r].key, value_of(histogram, rows[r].part) / 1e3);
}

static void put_series(struct json *json, const struct latency_series *series)
{
	const struct pokeys_histogram *histogram = &series->histogram;

	json_object(json, NULL);
	json_text(json, "name", series->title);
	series->cpu < 0 ? json_null(json, "cpu") : json_integer(json, "cpu", series->cpu);
	put_values(json, histogram);
	json_array(json, "buckets");
	for (unsigned int i = 0; i < POKEYS_HISTOGRAM_BUCKETS; i++) {
		if (!histogram->bucket[i])
			continue;
		json_array(json, NULL);
		json_real(json, NULL, (double)pokeys_histogram_lower(i) / 1e3);
		json_unsigned(json, NULL, histogram->bucket[i]);
		json_end(json);
	}
	json_end(json);
	json_end(json);
}

void latency_print_json(const struct latency_run *run, FILE *to)
{
	struct json json;

	json_init(&json, to);
	json_object(&json, NULL);
	json_unsigned(&json, "format", 1);
	json_text(&json, "kernel", run->kernel);
	run->is_virtual < 0 ? json_null(&json, "virtual_machine") :
			      json_bool(&json, "virtual_machine", run->is_virtual);
	run->priority ? json_integer(&json, "priority", run->priority) :
			json_null(&json, "priority");
	json_real(&json, "seconds", run->seconds);
	json_real(&json, "period_us", (double)run->period_ns / 1e3);
	json_text(&json, "note", run->note);
	json_array(&json, "series");
	for (size_t i = 0; i < run->count; i++)
		put_series(&json, &run->series[i]);
	json_end(&json);
	json_object(&json, "daemon");
	for (size_t i = 0; i < run->parts; i++) {
		json_object(&json, run->part[i].key);
		put_values(&json, &run->part[i].histogram);
		json_end(&json);
	}
	json_end(&json);
	json_end(&json);
}
