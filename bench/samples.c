// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Exact percentiles: every sample is kept and sorted at the end, for a
 * histogram's bucket width would hide the difference of ten per cent that a
 * comparison is about.
 */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "bench/samples.h"

int samples_init(struct samples *s, size_t size)
{
	*s = (struct samples){ .ns = malloc(size * sizeof(*s->ns)), .size = size };
	if (!s->ns)
		return -ENOMEM;
	memset(s->ns, 0xff, size * sizeof(*s->ns));
	return 0;
}

void samples_release(struct samples *s)
{
	free(s->ns);
	*s = (struct samples){ 0 };
}

void samples_add(struct samples *s, uint64_t ns)
{
	if (s->count < s->size)
		s->ns[s->count++] = ns;
}

static int compare(const void *a, const void *b)
{
	uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;

	return (x > y) - (x < y);
}

uint64_t samples_percentile(struct samples *s, double p)
{
	if (!s->count)
		return 0;
	qsort(s->ns, s->count, sizeof(*s->ns), compare);
	return s->ns[(size_t)((double)(s->count - 1) * p)];
}

void samples_print(struct samples *s, const char *name)
{
	printf("\"%s\": {\"samples\": %zu, \"p50_ns\": %llu, \"p99_ns\": %llu, \"p999_ns\": %llu}",
	       name, s->count, (unsigned long long)samples_percentile(s, 0.5),
	       (unsigned long long)samples_percentile(s, 0.99),
	       (unsigned long long)samples_percentile(s, 0.999));
}
