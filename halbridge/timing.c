/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * HAL keeps a tmax of each funct itself, but nobody hears of it. A machine on which one
 * period in a million takes too long is one whose cut has a mark now and then, so such
 * periods are counted, and the monitor's thread says a line.
 *
 * The time is the wall clock's: what interrupts the servo thread in our functs is in it,
 * for the machine does not care whose time it was. A read that no write follows is a
 * period by itself.
 */
#include "halbridge/timing.h"

static void judge(struct timing *timing, struct values *values, uint64_t took_ns)
{
	const double limit_us = values->time_threshold, took_us = (double)took_ns / 1e3;

	if (!(limit_us > 0) || took_us <= limit_us)
		return;
	values->time_exceeded_count++;
	atomic_store_explicit(&timing->last_us,
			      took_us < UINT32_MAX ? (uint32_t)took_us : UINT32_MAX,
			      memory_order_relaxed);
}

static void keep_longest(param_float *longest_us, uint64_t took_ns)
{
	const double took_us = (double)took_ns / 1e3;

	/* written so that what somebody set to NaN is overwritten */
	if (!(took_us <= *longest_us))
		*longest_us = took_us;
}

void timing_read(struct timing *timing, struct values *values, uint64_t took_ns)
{
	keep_longest(&values->read_time_max, took_ns);
	if (timing->read_ns)
		judge(timing, values, timing->read_ns);
	timing->read_ns = took_ns ? took_ns : 1;
}

void timing_write(struct timing *timing, struct values *values, uint64_t took_ns)
{
	keep_longest(&values->write_time_max, took_ns);
	judge(timing, values, timing->read_ns + took_ns);
	timing->read_ns = 0;
}
