/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A heater that heats without an effect: a sensor that fell out of its block, a heater that is
 * broken, or one that heats something else than what its sensor measures.
 *
 * While it is colder than its target by more than the slack, it has to rise by so much in each
 * window, from the lowest that it has come to. Near its target it need not; but if it takes nearly
 * all the power there is, it has to rise as well, however near the sensor says that it is: one
 * that is stuck just below looks like this. What there is may be less than its highest power, if
 * its supply does not suffice for all heaters. A new target begins neither window: a commander
 * that changes its mind every few seconds is watched like another one. Nor does a pause that is
 * shorter than a window, in which the sensor has not cooled: a thermostat that switches a heater
 * on and off around a sensor that fell out would never be found otherwise. One whose sensor is in
 * its place swings a little each time, also after it was switched off; that adds up.
 *
 * A window is as long as is configured, but at full power not much longer than the last rises
 * took: a hot end that rises by a kelvin in a third of a second needs no 40 s to be missed. All
 * this is about a temperature without noise and a load over some seconds, for one disturbed
 * period is neither a rise nor a pause.
 */

#include <math.h>

#include "daemon/loops/heater_part.h"

#define CALM_S 2.0			/* time constants */
#define LOAD_S 3.0
#define TIMES 8				/* as long as a rise usually took at full power */
#define LEAST_NS UINT64_C(12000000000)	/* of a window that was learnt */
#define FULL 0.92			/* of the highest power: it is nearly all there is */
#define NOT_FULL 0.85			/* ... and not any more */
#define SLOWEST 0.25			/* ... for each second that passes */
#define SWING 0.25			/* of rise: less is noise */
#define LITTLE 0.1			/* of the highest power: it need not have an effect */

/* Less than a part of it may be noise. */
static void add_swing(struct heater *heater)
{
	const double swing = heater->peak - heater->begun;

	if (swing >= SWING * heater->config.rise)
		heater->risen += swing;
}

/* In all the times together, since base_ns began. */
static bool has_swung(const struct heater *heater)
{
	return heater->risen >= heater->config.rise ||
	       heater->peak >= heater->base + heater->config.rise ||
	       heater->calm <= heater->peak - heater->config.rise;
}

static bool goes_on(const struct heater *heater)
{
	return heater->paused_ns && heater->watched &&
	       since(heater->paused_ns, heater->step_ns) < heater->config.window_ns &&
	       !has_swung(heater);
}

static void begin_load(struct heater *heater)
{
	heater->begun = heater->peak = heater->calm;
	heater->load = heater->press = 0;
	heater->room = heater->config.power_most;
	heater->full_ns = heater->whole_ns = 0;
}

void watch_begin(struct heater *heater)
{
	heater->warm = heater->full = false;
	add_swing(heater);
	if (goes_on(heater)) {
		begin_load(heater);
		return;
	}
	heater->watched = heater->cold = false;
	heater->base_ns = 0;
	heater->risen = 0;
	for (unsigned int i = 0; i < HEATER_RISES; i++)
		heater->rise_ns[i] = 0;
}

void watch_pause(struct heater *heater)
{
	heater->paused_ns = heater->step_ns;
}

void watch_forget(struct heater *heater)
{
	heater->paused_ns = 0;
}

static void calm_down(struct heater *heater, double seconds)
{
	heater->calm += (heater->temperature - heater->calm) * seconds / (CALM_S + seconds);
	heater->peak = fmax(heater->peak, heater->calm);
}

void watch_rest(struct heater *heater, uint64_t now_ns)
{
	if (heater->watched)
		calm_down(heater, (double)since(heater->step_ns, now_ns) / SECOND);
}

static void follow(struct heater *heater, uint64_t passed_ns)
{
	const double seconds = (double)passed_ns / SECOND;
	const bool presses = heater->limited || heater->power >= FULL * heater->config.power_most;

	if (!heater->watched) {
		heater->watched = true;
		heater->calm = heater->temperature;
		begin_load(heater);
		return;
	}
	calm_down(heater, seconds);
	heater->load += (heater->power - heater->load) * seconds / (LOAD_S + seconds);
	heater->room += (heater->available - heater->room) * seconds / (LOAD_S + seconds);
	heater->press += (presses - heater->press) * seconds / (LOAD_S + seconds);
}

static uint64_t lesser(uint64_t a, uint64_t b)
{
	return a < b ? a : b;
}

static uint64_t greater(uint64_t a, uint64_t b)
{
	return a > b ? a : b;
}

/* The median of the last three: one may be a disturbance, or a heater that just failed. */
static uint64_t usual_rise(const uint64_t rise_ns[HEATER_RISES])
{
	return greater(lesser(rise_ns[0], rise_ns[1]),
		       lesser(greater(rise_ns[0], rise_ns[1]), rise_ns[2]));
}

static bool has_all_power(const struct heater *heater)
{
	return heater->room >= FULL * heater->config.power_most;
}

/* Only with its highest power for as long, a rise tells how long the next one takes. */
static uint64_t window(const struct heater *heater)
{
	const uint64_t rise_ns = usual_rise(heater->rise_ns);
	const uint64_t learnt_ns = lesser(greater(rise_ns * TIMES, LEAST_NS),
					  heater->config.window_ns);

	return heater->full && rise_ns && heater->whole_ns >= learnt_ns ? learnt_ns :
									  heater->config.window_ns;
}

/* With less power it has more time, but not for ever. */
static void count_time(struct heater *heater, uint64_t passed_ns)
{
	const double part = fmax(heater->available / heater->config.power_most, SLOWEST);
	const uint64_t counted_ns = (uint64_t)((double)passed_ns * fmin(part, 1));

	heater->base_ns += counted_ns;
	heater->full_ns += counted_ns;
	heater->whole_ns = has_all_power(heater) ? heater->whole_ns + passed_ns : 0;
}

static bool has_risen(const struct heater *heater)
{
	return heater->calm >= heater->base + heater->config.rise ||
	       heater->risen + heater->calm - heater->begun >= heater->config.rise;
}

static enum heater_fault rises_while_cold(struct heater *heater)
{
	const bool cold = heater->calm < heater->target - heater->config.slack;

	heater->warm = heater->warm || !cold;
	if (!cold || !heater->cold || has_risen(heater)) {
		heater->base = heater->calm;
		heater->base_ns = 0;
		heater->risen = heater->begun - heater->calm;
	}
	heater->cold = cold;
	heater->base = fmin(heater->base, heater->calm);
	if (heater->base_ns <= window(heater))
		return HEATER_FINE;
	return heater->warm ? HEATER_FELL : HEATER_NO_RISE;
}

static void learn(struct heater *heater, uint64_t took_ns)
{
	for (unsigned int i = HEATER_RISES - 1; i; i--)
		heater->rise_ns[i] = heater->rise_ns[i - 1];
	heater->rise_ns[0] = took_ns;
}

/*
 * It takes all the power that it can get. Below its highest power this needs a look at what it
 * asks for: a heater that holds its target with nearly all that it can get asks for no more.
 */
static bool takes_all(const struct heater *heater)
{
	const double part = heater->full ? NOT_FULL : FULL;

	return heater->load >= part * heater->config.power_most ||
	       (!has_all_power(heater) && heater->press >= part &&
		heater->room > LITTLE * heater->config.power_most);
}

static enum heater_fault rises_at_full_power(struct heater *heater)
{
	const bool was = heater->full;
	bool risen;

	heater->full = takes_all(heater);
	if (!heater->full)
		return HEATER_FINE;
	risen = heater->calm >= heater->full_base + heater->config.rise;
	if (was && risen && heater->whole_ns >= heater->full_ns)
		learn(heater, heater->full_ns);
	if (!was || risen) {
		heater->full_base = heater->calm;
		heater->full_ns = 0;
	}
	heater->full_base = fmin(heater->full_base, heater->calm);
	return heater->full_ns > window(heater) ? HEATER_UNHEEDED : HEATER_FINE;
}

enum heater_fault watch(struct heater *heater, uint64_t now_ns)
{
	const uint64_t passed_ns = heater->watched ? since(heater->step_ns, now_ns) : 0;
	enum heater_fault full, cold;

	follow(heater, passed_ns);
	count_time(heater, passed_ns);
	full = rises_at_full_power(heater);
	cold = rises_while_cold(heater);
	if (cold || !full)
		return cold;
	return heater->cold && !heater->warm ? HEATER_NO_RISE : full;
}
