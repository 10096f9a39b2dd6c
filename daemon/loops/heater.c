/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A heater's life: off, heating, switched off by a fault.
 *
 * A fault is latched, and only heater_reset() clears it: a heater that went on by itself after a
 * loose sensor has touched its plug again would heat what nobody watches any more. For the same
 * reason off has to be commanded before it heats again, and before it heats for the first time:
 * the target of before may still be commanded, by a program that knows nothing of the fault, or
 * of this daemon's start.
 *
 * While it is off, a lost device or an unplugged sensor is no fault: it only cannot be switched
 * on. Otherwise each start of the daemon would begin with a fault. Too hot is one even then: what
 * heats although it is off has to be seen.
 */

#include "daemon/loops/heater.h"

#include <math.h>
#include <stddef.h>

#include "daemon/loops/heater_part.h"

#define GAIN_MOST 1000
#define RATE_MOST 200
#define WINDOW_MOST_NS UINT64_C(600000000000)
#define STALE_MOST_NS UINT64_C(2000000000)

const struct heater_config heater_usual = {
	.sensor = { .kind = SENSOR_BETA,
		    .pull_up = 4700,
		    .ohm = 100e3,
		    .celsius = 25,
		    .beta = 3950 },
	.least = 5,
	.most = 280,
	.target_most = 265,
	.law = HEATER_PID,
	.gains = { .p = 0.087, .i = 0.0042, .d = 0.45, .smooth = 0.5 },
	.hysteresis = 1,
	.power_most = 1,
	.rate_most = 20,
	.slack = 4,
	.rise = 1,
	.window_ns = UINT64_C(40000000000),
	.stale_ns = UINT64_C(300000000),
	.lease_ns = UINT64_C(500000000),
};

static bool is_gain(double value)
{
	return value >= 0 && value <= GAIN_MOST;
}

static const char *judge_gains(const struct pid_gains *gains, enum heater_law law)
{
	if (!is_gain(gains->p) || !is_gain(gains->i) || !is_gain(gains->d) ||
	    !is_gain(gains->smooth))
		return "pid-p, pid-i, pid-d and pid-smooth-s have to be numbers from 0 to 1000";
	if (law == HEATER_PID && gains->p == 0 && gains->i == 0)
		return "pid-p and pid-i are both 0: the heater would never have power";
	return NULL;
}

static const char *judge_times(const struct heater_config *config)
{
	if (config->window_ns < HEATER_PERIOD_NS || config->window_ns > WINDOW_MOST_NS)
		return "watch-window-s has to be 0.1 to 600";
	if (config->stale_ns < HEATER_PERIOD_NS || config->stale_ns > STALE_MOST_NS)
		return "max-age-ms has to be 100 to 2000";
	if (config->lease_ns < HEATER_PERIOD_NS)
		return "hold-s has to be at least 0.1";
	return NULL;
}

static const char *judge(const struct heater_config *config)
{
	if (!isfinite(config->least) || !isfinite(config->most) || !(config->least < config->most))
		return "min-temperature has to be below max-temperature";
	if (!(config->slack >= 1 && config->slack <= 50) ||
	    !(config->rise >= 0.5 && config->rise <= 20))
		return "watch-slack has to be 1 to 50 K, watch-rise 0.5 to 20 K";
	if (!(config->target_most > 0) || !(config->target_most + config->slack <= config->most))
		return "max-target has to be above 0, and at least watch-slack below "
		       "max-temperature (auto: 15 K below)";
	if (config->law == HEATER_BANG_BANG &&
	    !(config->hysteresis > 0 && config->hysteresis < config->slack))
		return "hysteresis has to be above 0, and below watch-slack";
	if (!(config->power_most > 0 && config->power_most <= 1))
		return "max-power has to be above 0, and at most 1";
	if (!(config->rate_most > 0 && config->rate_most <= RATE_MOST))
		return "max-rate has to be above 0, and at most 200 K/s";
	return judge_times(config);
}

/* A sensor that cannot say that it is too hot would never be too hot. */
static const char *judge_range(const struct heater *heater)
{
	double coldest, hottest;

	sensor_range(&heater->sensor, &coldest, &hottest);
	if (!(hottest > heater->config.most))
		return "max-temperature is above what the sensor can measure";
	if (!(coldest < heater->config.least))
		return "min-temperature is below what the sensor can measure";
	return NULL;
}

const char *heater_init(struct heater *heater, const struct heater_config *config)
{
	const char *why = judge(config);

	*heater = (struct heater){ .config = *config,
				   .temperature = NAN,
				   .wanted = NAN,
				   .condition = HEATER_STALE,
				   .sensed = HEATER_STALE };
	why = why ? why : judge_gains(&config->gains, config->law);
	why = why ? why : sensor_init(&heater->sensor, &config->sensor);
	return why ? why : judge_range(heater);
}

void heater_sample(struct heater *heater, double reading, uint64_t read_ns)
{
	const enum sensor_state state = sensor_judge(&heater->sensor, reading);

	heater->sampled_ns = read_ns;
	heater->count[state]++;
	if (state != SENSOR_GOOD)
		return;
	if (heater->samples == HEATER_SAMPLES) {
		for (unsigned int i = 1; i < HEATER_SAMPLES; i++)
			heater->sample[i - 1] = heater->sample[i];
		heater->samples--;
	}
	heater->sample[heater->samples++] = reading;
}

void heater_device(struct heater *heater, bool usable)
{
	heater->device = usable;
	heater->lost = heater->lost || !usable;
}

void heater_commander(struct heater *heater, bool alive, uint64_t now_ns)
{
	/* What another one has switched on is its to answer for, until this one has commanded. */
	if (alive && (heater->armed || heater_is_off(heater)))
		heater->commander_ns = now_ns;
}

void heater_another(struct heater *heater)
{
	heater->armed = false;
	heater->wanted = NAN;
	heater->refusal = HEATER_TAKEN;
}

static void set_target(struct heater *heater, double target)
{
	const bool tuned = heater->tune.state == TUNE_RUNS;

	if (tuned)
		heater->tune.state = TUNE_FAILED;
	/* A new target while it heats restarts no window: the watch begins only from off. */
	if (heater->target == 0 && target > 0)
		watch_begin(heater);
	else if (heater->target > 0 && target == 0)
		watch_pause(heater);
	if (target == 0 || tuned)
		pid_reset(&heater->pid);
	if (target == 0) {
		heater->power = 0;
		heater->on = false;
	}
	heater->target = target;
}

/* Off, and until off was commanded; if it is that already, a target will be taken. */
static void end(struct heater *heater)
{
	set_target(heater, 0);
	heater->armed = !heater->fault && heater->wanted == 0;
	heater->refusal = heater->wanted > 0 ? HEATER_AFTER_FAULT : HEATER_TAKEN;
}

static enum heater_refusal judge_target(const struct heater *heater, double target)
{
	if (!isfinite(target) || target < 0 || target > heater->config.target_most)
		return HEATER_OUT_OF_RANGE;
	if (target == 0)
		return HEATER_TAKEN;
	if (heater->fault || !heater->armed)
		return HEATER_AFTER_FAULT;
	return heater->condition ? HEATER_NOT_READY : HEATER_TAKEN;
}

enum heater_refusal heater_command(struct heater *heater, double target)
{
	/* What was refused is not taken later by itself: nobody may be there any more. */
	if (target == heater->wanted)
		return heater->refusal;
	heater->wanted = target;
	heater->refusal = judge_target(heater, target);
	if (heater->refusal != HEATER_TAKEN)
		return heater->refusal;
	if (target == 0 && !heater->fault)
		heater->armed = true;
	set_target(heater, target);
	return HEATER_TAKEN;
}

enum heater_refusal heater_tune(struct heater *heater, double target)
{
	const enum heater_refusal refusal = target > 0 ? judge_target(heater, target) :
							 HEATER_OUT_OF_RANGE;

	if (refusal != HEATER_TAKEN)
		return refusal;
	set_target(heater, target);
	tune_begin(heater);
	return HEATER_TAKEN;
}

static double controlled(struct heater *heater, double seconds, uint64_t now_ns)
{
	const struct heater_config *config = &heater->config;

	if (heater->tune.state == TUNE_RUNS)
		return tune_step(heater, now_ns);
	if (config->law == HEATER_PID)
		return pid_step(&heater->pid, &config->gains, heater->target, heater->temperature,
				seconds, 0, config->power_most);
	if (heater->temperature < heater->target - config->hysteresis)
		heater->on = true;
	else if (heater->temperature > heater->target + config->hysteresis)
		heater->on = false;
	return heater->on ? config->power_most : 0;
}

void heater_off(struct heater *heater)
{
	end(heater);
}

static bool abandoned(const struct heater *heater, uint64_t now_ns)
{
	return heater->config.lease_ns != UINT64_MAX &&
	       (!heater->commander_ns ||
		since(heater->commander_ns, now_ns) > heater->config.lease_ns);
}

/* What is wrong now, and what follows from it. */
static void judge_now(struct heater *heater, uint64_t now_ns)
{
	enum heater_fault found = measure(heater, now_ns);

	heater->condition = found;
	if (!found && heater->target > 0)
		found = watch(heater, now_ns);
	else if (!found)
		watch_rest(heater, now_ns);
	if (!heater->fault && found && (heater->target > 0 || found == HEATER_OVER)) {
		heater->fault = found;
		end(heater);
	}
	if (heater->target > 0 && abandoned(heater, now_ns))
		end(heater);
}

double heater_step(struct heater *heater, uint64_t now_ns)
{
	const uint64_t passed_ns = since(heater->step_ns, now_ns);
	const bool tuning = heater->tune.state == TUNE_RUNS;
	double power = 0;

	/* Sooner, it would be neither a period's readings nor a period's change. */
	if (heater->step_ns && passed_ns < HEATER_PERIOD_NS / 2 && !heater->lost)
		return heater->power;
	judge_now(heater, now_ns);
	if (heater->target > 0)
		power = controlled(heater, heater->step_ns ? (double)passed_ns / SECOND : 0,
				   now_ns);
	if (!isfinite(power)) {
		power = 0;
		pid_reset(&heater->pid);
	}
	heater->power = power;
	heater->available = heater->config.power_most;
	heater->limited = false;
	heater->step_ns = now_ns;
	if (tuning && heater->tune.state != TUNE_RUNS)
		end(heater);
	return heater->power;
}

void heater_available(struct heater *heater, double power)
{
	if (!(power >= 0 && power < heater->config.power_most))
		return;
	heater->available = power;
	if (power >= heater->power)
		return;
	heater->power = power;
	heater->limited = true;
	pid_cut(&heater->pid);
}

bool heater_is_off(const struct heater *heater)
{
	return !(heater->target > 0);
}

/*
 * A reset is refused while the cause of the fault is still there. If the device is not ready, that
 * is the cause of two faults: "device not ready", and the same fault before a step has found it.
 */
static bool is_over(const struct heater *heater)
{
	if (heater->sensed)
		return false;
	return (!heater->condition && !heater->lost) ||
	       (heater->fault && heater->fault != HEATER_DEVICE);
}

bool heater_reset(struct heater *heater)
{
	if (!is_over(heater))
		return false;
	if (heater->fault && heater->wanted == 0)
		heater->armed = true;
	heater->fault = HEATER_FINE;
	watch_forget(heater);
	return true;
}

bool heater_regain(struct heater *heater, const struct pid_gains *gains)
{
	if (judge_gains(gains, heater->config.law))
		return false;
	pid_regain(&heater->pid, &heater->config.gains, gains, heater->target, 0,
		   heater->config.power_most);
	heater->config.gains = *gains;
	return true;
}

bool heater_is_at(const struct heater *heater, double within)
{
	return heater->target > 0 && fabs(heater->temperature - heater->target) <= within;
}
