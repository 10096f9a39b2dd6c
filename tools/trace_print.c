// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * One slow cycle, a line for each place where time went, the largest part of whom
 * beside it. Places without time are left out for a person; a script gets all.
 */
#include <inttypes.h>
#include <string.h>
#include "tools/json.h"
#include "tools/print.h"
#include "tools/trace.h"

static const char *const meaning[TRACE_WHERES] = {
	[TRACE_TIMER] = "the tick was due, its timer had not come",
	[TRACE_INTERRUPT] = "interrupts on its core",
	[TRACE_SOFTIRQ] = "the kernel's deferred work on its core",
	[TRACE_WAKE_UP] = "runnable, on its way onto the core",
	[TRACE_BEHIND] = "runnable, behind somebody else",
	[TRACE_PLAN] = "commands read, requests planned",
	[TRACE_SEND] = "requests into the kernel",
	[TRACE_DEVICE] = "network and device",
	[TRACE_RECEIVE] = "from the kernel's receipt until it is woken",
	[TRACE_RUN] = "replies taken, images published",
};

static double us(uint64_t ns)
{
	return (double)ns / 1e3;
}

/* "timer 12.0, enp1s0 3.1" */
static void print_parts(const struct trace_cycle *cycle, enum trace_where where, FILE *to)
{
	const char *before = "";
	char who[32]; /* a thread may call itself whatever it likes */

	for (size_t i = 0; i < cycle->parts; i++) {
		if (cycle->part[i].where != where)
			continue;
		fprintf(to, "%s%s %.1f", before, print_clean(cycle->part[i].who, 16, who),
			us(cycle->part[i].ns));
		before = ", ";
	}
	if (!*before)
		fputs(meaning[where], to);
}

static void print_cycle(const struct trace_cycle *cycle, FILE *to)
{
	fprintf(to,
		"\ncycle %" PRIu64 ": %.1f us from the start of the cycle to the data, "
		"awake after %.1f us",
		cycle->cycle, us(trace_length(cycle)), us(cycle->woke_ns - cycle->tick_ns));
	if (cycle->skipped)
		fprintf(to, ", %u %s missed", cycle->skipped,
			cycle->skipped == 1 ? "tick" : "ticks");
	fputs(cycle->whole ? "\n" : " (not all of it was seen)\n", to);
	for (enum trace_where where = 0; where < TRACE_WHERES; where++) {
		if (!cycle->ns[where])
			continue;
		fprintf(to, "  %-10s %9.1f  ", trace_where_name(where), us(cycle->ns[where]));
		print_parts(cycle, where, to);
		fputc('\n', to);
	}
}

void trace_print(const struct trace_report *report, FILE *to)
{
	fprintf(to,
		"%" PRIu64 " cycles of %.0f us in %.1f s; from the start of the cycle to the "
		"data: median %.1f us, p99 %.1f us, longest %.1f us\n",
		report->cycles, us(report->period_ns), report->seconds, us(report->median_ns),
		us(report->p99_ns), us(report->max_ns));
	if (report->dropped)
		fprintf(to, "%" PRIu64 " events of the kernel came too fast and are missing\n",
			report->dropped);
	for (size_t i = 0; i < report->count; i++)
		print_cycle(&report->cycle[i], to);
}

static void json_parts(struct json *json, const struct trace_cycle *cycle)
{
	json_array(json, "parts");
	for (size_t i = 0; i < cycle->parts; i++) {
		char who[17] = "";

		memcpy(who, cycle->part[i].who, 16);
		json_object(json, NULL);
		json_text(json, "where", trace_where_name(cycle->part[i].where));
		json_text(json, "who", who);
		json_real(json, "us", us(cycle->part[i].ns));
		json_end(json);
	}
	json_end(json);
}

static void json_cycle(struct json *json, const struct trace_cycle *cycle)
{
	json_object(json, NULL);
	json_unsigned(json, "cycle", cycle->cycle);
	json_unsigned(json, "tick_ns", cycle->tick_ns);
	json_real(json, "length_us", us(trace_length(cycle)));
	json_real(json, "awake_us", us(cycle->woke_ns - cycle->tick_ns));
	json_unsigned(json, "skipped", cycle->skipped);
	json_bool(json, "whole", cycle->whole);
	json_object(json, "where_us");
	for (enum trace_where where = 0; where < TRACE_WHERES; where++)
		json_real(json, trace_where_name(where), us(cycle->ns[where]));
	json_end(json);
	json_parts(json, cycle);
	json_end(json);
}

void trace_print_json(const struct trace_report *report, FILE *to)
{
	struct json json;

	json_init(&json, to);
	json_object(&json, NULL);
	json_integer(&json, "format", 1);
	json_real(&json, "seconds", report->seconds);
	json_real(&json, "period_us", us(report->period_ns));
	json_unsigned(&json, "cycles", report->cycles);
	json_unsigned(&json, "dropped", report->dropped);
	json_real(&json, "median_us", us(report->median_ns));
	json_real(&json, "p99_us", us(report->p99_ns));
	json_real(&json, "longest_us", us(report->max_ns));
	json_array(&json, "slowest");
	for (size_t i = 0; i < report->count; i++)
		json_cycle(&json, &report->cycle[i]);
	json_end(&json);
	json_end(&json);
}
