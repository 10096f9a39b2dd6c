/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_CLOCK_H
#define SIM_CLOCK_H

#include <stdint.h>

struct sim_device;

/* Calendar time of the device's clock, seconds since 1970 UTC (protocol section 3.22). */
int64_t sim_clock_seconds(const struct sim_device *dev);

#endif
