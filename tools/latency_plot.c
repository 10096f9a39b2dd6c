// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The histograms as one SVG that needs nothing else: steps, both axes
 * logarithmic, no script, no font of its own, so that it can be put into a
 * report or a thread as it is.
 *
 * The picture shows 64 ns to about 4 s if something was so late, else up to
 * the octave behind the latest, and never less than 1 ms: pictures of two
 * machines shall be comparable at a glance.
 */
#include <math.h>
#include <string.h>
#include <pokeys/shm.h>
#include "tools/latency.h"
#include "tools/print.h"

enum { WIDTH = 860, HEIGHT = 440, LEFT = 60, RIGHT = 20, TOP = 110, BOTTOM = 45, LEAST_US = 1000 };

static const char *const colours[LATENCY_SERIES] = { "#1f77b4", "#2ca02c", "#d62728" };

struct scale {
	unsigned int buckets; /* shown */
	double decades;       /* of counts */
};

static double x_of(const struct scale *scale, double bucket)
{
	return LEFT + bucket / scale->buckets * (WIDTH - LEFT - RIGHT);
}

/* A count of 1 stands visibly above the axis, 0 on it. */
static double y_of(const struct scale *scale, uint64_t count)
{
	double part = count ? (0.3 + log10((double)count)) / (0.3 + scale->decades) : 0;

	return HEIGHT - BOTTOM - part * (HEIGHT - TOP - BOTTOM);
}

static struct scale scale_of(const struct latency_run *run)
{
	struct scale scale = { .buckets = pokeys_histogram_bucket(LEAST_US * 1000), .decades = 1 };

	for (size_t i = 0; i < run->count; i++)
		for (unsigned int at = 0; at < POKEYS_HISTOGRAM_BUCKETS; at++) {
			uint64_t count = run->series[i].histogram.bucket[at];

			if (count && at + 4 > scale.buckets)
				scale.buckets = at + 4;
			if (count)
				scale.decades = fmax(scale.decades, ceil(log10((double)count)));
		}
	if (scale.buckets > POKEYS_HISTOGRAM_BUCKETS)
		scale.buckets = POKEYS_HISTOGRAM_BUCKETS;
	return scale;
}

static void put_text(const char *text, FILE *to)
{
	for (; *text; text++)
		if (*text == '<' || *text == '&' || (unsigned char)*text < 0x20 ||
		    (unsigned char)*text > 0x7e)
			fprintf(to, "&#%d;", *text == '<' || *text == '&' ? *text : '?');
		else
			fputc(*text, to);
}

static void label(double x, double y, const char *anchor, const char *text, FILE *to)
{
	fprintf(to, "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">", x, y, anchor);
	put_text(text, to);
	fputs("</text>\n", to);
}

static void line(double x1, double y1, double x2, double y2, FILE *to)
{
	fprintf(to, "<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"#ccc\"/>\n", x1,
		y1, x2, y2);
}

static void put_axes(const struct scale *scale, FILE *to)
{
	char text[32];
	double x, y;

	for (double ns = 100;; ns *= 10) {
		/* buckets are quarters of octaves from 64 ns, the last one has no end */
		x = x_of(scale, 1 + 4 * log2(ns / 64));
		if (x > WIDTH - RIGHT)
			break;
		line(x, TOP, x, HEIGHT - BOTTOM, to);
		label(x, HEIGHT - BOTTOM + 16, "middle", print_duration(ns, text), to);
	}
	for (int decade = 0; decade <= (int)scale->decades; decade++) {
		y = y_of(scale, (uint64_t)pow(10, decade));
		line(LEFT, y, WIDTH - RIGHT, y, to);
		snprintf(text, sizeof(text), "%.0f", pow(10, decade));
		label(LEFT - 6, y + 4, "end", text, to);
	}
	line(LEFT, HEIGHT - BOTTOM, WIDTH - RIGHT, HEIGHT - BOTTOM, to);
	label((LEFT + WIDTH - RIGHT) / 2.0, HEIGHT - 8, "middle", "woken up too late by", to);
}

static void put_steps(const struct latency_series *series, const struct scale *scale,
		      const char *colour, FILE *to)
{
	fprintf(to, "<path fill=\"none\" stroke=\"%s\" stroke-width=\"1.5\" d=\"M%d %d", colour,
		LEFT, HEIGHT - BOTTOM);
	for (unsigned int i = 0; i < scale->buckets; i++)
		fprintf(to, " V%.1f H%.1f", y_of(scale, series->histogram.bucket[i]),
			x_of(scale, i + 1));
	fprintf(to, " V%d\"/>\n", HEIGHT - BOTTOM);
}

static void put_legend(const struct latency_series *series, size_t index, FILE *to)
{
	const struct pokeys_histogram *histogram = &series->histogram;
	char text[160], half[16], most[16], all[16];
	double y = 48 + 18 * (double)index;

	fprintf(to, "<rect x=\"%d\" y=\"%.1f\" width=\"14\" height=\"4\" fill=\"%s\"/>\n", LEFT,
		y - 6, colours[index]);
	snprintf(text, sizeof(text), "%s: %llu samples, median %s, p99 %s, most %s", series->title,
		 (unsigned long long)histogram->count,
		 print_duration((double)pokeys_histogram_percentile(histogram, 0.5), half),
		 print_duration((double)pokeys_histogram_percentile(histogram, 0.99), most),
		 print_duration((double)histogram->max_ns, all));
	label(LEFT + 22, y, "start", text, to);
}

void latency_plot(const struct latency_run *run, FILE *to)
{
	struct scale scale = scale_of(run);
	char text[256], priority[32] = "not realtime";

	if (run->priority)
		snprintf(priority, sizeof(priority), "SCHED_FIFO %d", run->priority);
	fprintf(to,
		"<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %d %d\" width=\"%d\" "
		"height=\"%d\" font-family=\"sans-serif\" font-size=\"12\">\n"
		"<rect width=\"100%%\" height=\"100%%\" fill=\"white\"/>\n",
		WIDTH, HEIGHT, WIDTH, HEIGHT);
	snprintf(text, sizeof(text), "Linux %s%s, %.1f s, every %g us, %s", run->kernel,
		 run->is_virtual > 0 ? " (virtual machine)" : "", run->seconds,
		 (double)run->period_ns / 1e3, priority);
	label(LEFT, 24, "start", text, to);
	put_axes(&scale, to);
	for (size_t i = 0; i < run->count; i++) {
		put_steps(&run->series[i], &scale, colours[i], to);
		put_legend(&run->series[i], i, to);
	}
	fputs("</svg>\n", to);
}
