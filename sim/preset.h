/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_PRESET_H
#define SIM_PRESET_H

#include <stdbool.h>

#include "sim/device.h"
#include "sim/text.h"

/*
 * Ready-made machines: a configuration saved in flash and the bench to it.
 *
 *	factory		nothing configured, nothing wired (the default)
 *	loopback	eight outputs wired to eight inputs, analog inputs, two encoders
 *	demo		inputs, outputs, encoders, and three axes with switches
 *	printer		a hot end and a bed with thermistors, and home switches of three axes
 *
 * What exactly they set is in the manual page pokeys-sim(1).
 */
#define SIM_PRESETS "factory|loopback|demo|printer|servo-mill"

/* Puts one onto the device; false with a line in `why` when there is none of that name. */
bool sim_preset_apply(struct sim_device *dev, const char *name, struct sim_text *why);

#endif
