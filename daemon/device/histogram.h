/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Filling the histograms of the diagnostic image (state.h says how the
 * buckets lie). Realtime; one writer for each histogram.
 */
#ifndef DEVICE_HISTOGRAM_H
#define DEVICE_HISTOGRAM_H

#include <stdint.h>
#include <pokeys/state.h>

void histogram_add(struct pokeys_histogram *histogram, uint64_t ns);

#endif
