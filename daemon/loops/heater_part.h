/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What the files of a heater share.
 */
#ifndef LOOPS_HEATER_PART_H
#define LOOPS_HEATER_PART_H

#include "daemon/loops/duration.h"
#include "daemon/loops/heater.h"

/* Take the samples of this period: the temperature, and what is wrong with it now. */
enum heater_fault measure(struct heater *heater, uint64_t now_ns);

/*
 * From off to a target: it has to get warm from here on; after a short pause, in what is left of
 * the window of before.
 */
void watch_begin(struct heater *heater);

/* Off, for some time, and a step of it; and by somebody who has seen to what was wrong. */
void watch_pause(struct heater *heater);
void watch_rest(struct heater *heater, uint64_t now_ns);
void watch_forget(struct heater *heater);

/* Find the gains: begin, and the power of a step while it runs. */
void tune_begin(struct heater *heater);
double tune_step(struct heater *heater, uint64_t now_ns);

/* Does it get warm, does it stay warm? */
enum heater_fault watch(struct heater *heater, uint64_t now_ns);

#endif
