/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Durations in ns, kept whole, so that percentiles are exact. */
#ifndef BENCH_SAMPLES_H
#define BENCH_SAMPLES_H

#include <stddef.h>
#include <stdint.h>

struct samples {
	uint64_t *ns;
	size_t count, size;
};

/* Room for `size` samples, touched so that adding one never faults. 0 or -ENOMEM. */
int samples_init(struct samples *s, size_t size);
void samples_release(struct samples *s);

/* A sample more; dropped when full. */
void samples_add(struct samples *s, uint64_t ns);

/* `"name": {"samples": n, "p50_ns": …, "p99_ns": …, "p999_ns": …}`; sorts. */
void samples_print(struct samples *s, const char *name);

/* The value below which the part p (0..1) lies; sorts. 0 if empty. */
uint64_t samples_percentile(struct samples *s, double p);

#endif
