/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The heaters of a device (daemon/loops/heater.h) between its analog inputs and its outputs.
 *
 * The output of a heater belongs to this heater only. No commander can switch it, and the safe
 * state does not change it. After a loss it is not held until machine-on rises, because the heater
 * detects the loss and switches itself off. The commander's emergency stop (unless on-emergency =
 * hold) and the daemon's end switch it off at once.
 *
 * If this daemon or its computer fails, only the device can switch a heater off. So a heater is
 * ready only while the device's failsafe is known to do that (the failsafe is on, includes this
 * output, and switches it off), or with without-failsafe = yes.
 */

#include <math.h>
#include <string.h>
#include "daemon/device/internal.h"

#define READING_MOST 4095.0	/* protocol section 3.5 */
#define LATE_NS HEATER_PERIOD_NS
#define UNHEARD_NS (500 * MS)
#define TENTHS_MOST 1e9

/* The image shows the numbers of the loops. */
#define SAME(a, b) _Static_assert((int)(a) == (int)(b), #a " is not " #b)
SAME(HEATER_DEVICE, POKEYS_HEATER_DEVICE);
SAME(HEATER_OPEN, POKEYS_HEATER_OPEN);
SAME(HEATER_UNHEEDED, POKEYS_HEATER_UNHEEDED);
SAME(HEATER_FAULTS, POKEYS_HEATER_UNHEEDED + 1);
SAME(HEATER_NOT_READY, POKEYS_HEATER_NOT_READY);
SAME(TUNE_FAILED, POKEYS_HEATER_TUNING_FAILED);

static const struct heating_config *config_of(const struct device *device, unsigned int i)
{
	return &device->config.heater[i];
}

void heating_init(struct device *device)
{
	struct heatings *heatings = &device->heatings;

	heatings->count = device->config.heaters < POKEYS_HEATERS ? device->config.heaters :
								    POKEYS_HEATERS;
	for (unsigned int i = 0; i < heatings->count; i++) {
		struct heating *heating = &heatings->heating[i];
		const struct heating_config *config = config_of(device, i);

		heating->good = !heater_init(&heating->heater, &config->heater);
		heating->switching.least_ns = config->least_ns;
	}
}

/* Is this heater's output off when nobody has talked to the device for long enough? */
static bool switches_off(const struct wire_failsafe_req *failsafe,
			 const struct heating_config *config)
{
	if (!failsafe || !failsafe->timeout)
		return false;
	if (config->kind == HEATING_PWM)
		return failsafe->peripherals & WIRE_FAILSAFE_PWM &&
		       !failsafe->pwm_percent[config->output];
	return failsafe->peripherals & WIRE_FAILSAFE_DIGITAL &&
	       !(failsafe->outputs >> config->output & 1);
}

/* ... soon: silence is worth it. */
static bool helps(const struct wire_failsafe_req *failsafe, const struct heating_config *config)
{
	return switches_off(failsafe, config) && failsafe->timeout <= HEATING_FAILSAFE_MOST;
}

static bool is_covered(const struct device *device, const struct heating_config *config)
{
	return config->without_failsafe || helps(failsafe_known(device), config);
}

/* Neither more nor less than pokeysd.conf wants: an inverted output would be on when it is off. */
bool heating_is_as_wanted(const struct device *device, unsigned int pin)
{
	return device->image.pin_function[pin] == device->config.settings.pin_function[pin];
}

static bool has_output(const struct device *device, const struct heating_config *config)
{
	if (config->kind == HEATING_PIN)
		return heating_is_as_wanted(device, config->output);
	return loops_have_pwm(device, config->output, HEATING_PERIOD_LEAST, HEATING_PERIOD_MOST);
}

static bool has_sensor(const struct device *device, const struct heating_config *config)
{
	return heating_is_as_wanted(device, WIRE_ANALOG_FIRST_PIN - 1u + config->sensor);
}

static enum pokeys_obstacle obstacle_of(const struct device *device, unsigned int index)
{
	const struct heating_config *config = config_of(device, index);
	const struct heating *heating = &device->heatings.heating[index];
	const struct setting *filter = &device->configure.setting[SETTING_FILTER];

	if (!heating->good)
		return POKEYS_OBSTACLE_CONFIG;
	if (!running(device))
		return POKEYS_OBSTACLE_LINK;
	if (heating->shared)
		return POKEYS_OBSTACLE_SHARED;
	if (!has_sensor(device, config))
		return POKEYS_OBSTACLE_SENSOR;
	if (filter->known && filter->value.filter.rc > HEATING_FILTER_MOST)
		return POKEYS_OBSTACLE_FILTER;
	if (!has_output(device, config))
		return config->kind == HEATING_PIN ? POKEYS_OBSTACLE_OUTPUT : POKEYS_OBSTACLE_PWM;
	if (!heating_fan_usable(device, index))
		return POKEYS_OBSTACLE_FAN;
	return is_covered(device, config) ? POKEYS_OBSTACLE_NONE : POKEYS_OBSTACLE_FAILSAFE;
}

bool heating_covered(const struct device *device)
{
	for (unsigned int i = 0; i < device->heatings.count; i++)
		if (!config_of(device, i)->without_failsafe)
			return true;
	return false;
}

void heating_unshare(struct device *device)
{
	for (unsigned int i = 0; i < device->heatings.count; i++)
		device->heatings.heating[i].shared = device->heatings.heating[i].fan_shared = false;
}

void heating_share(struct device *device, const char *key, unsigned int index)
{
	static const char prefix[] = "heater.", fan[] = "heater.#.fan-";
	struct heating *heating = &device->heatings.heating[index];

	if (index >= device->heatings.count || strncmp(key, prefix, sizeof(prefix) - 1))
		return;
	if (strncmp(key, fan, sizeof(fan) - 1))
		heating->shared = true;
	else
		heating->fan_shared = true;
}

/* Inputs 0 and 1 come by another request than the others (protocol section 3.5). */
static void take_sample(struct device *device, unsigned int i)
{
	struct heating *heating = &device->heatings.heating[i];
	const unsigned int input = config_of(device, i)->sensor;
	const uint64_t read_ns = input < POKEYS_ANALOG - WIRE_IO_ANALOGS ?
					 device->image.t_analog_slow_ns :
					 device->image.t_analog_ns;

	if (!running(device) || read_ns == heating->sampled_ns ||
	    !has_sensor(device, config_of(device, i)))
		return;
	heating->sampled_ns = read_ns;
	heater_sample(&heating->heater, device->image.analog[input] / READING_MOST, read_ns);
}

/* Whatever is commanded. */
static bool must_be_off(const struct device *device)
{
	const bool emergency = device->intake.emergency && !device->config.emergency_holds;

	return device->safe.stopping || device->life.blocked || emergency;
}

/* Only who commands it at all, with 0, has switched it off for whoever comes next. */
static void command(struct device *device, unsigned int i)
{
	struct heater *heater = &device->heatings.heating[i].heater;
	const struct heating_wish *wish = &device->intake.heating;

	if (wish->mask >> i & 1)
		heater_command(heater, wish->target[i]);
	else if (!heater_is_off(heater))
		heater_off(heater);
}

/* Off at once, and not on again before the next step has said so. */
static void rest(struct device *device, unsigned int i)
{
	struct heating *heating = &device->heatings.heating[i];

	if (config_of(device, i)->kind == HEATING_PIN && heater_is_off(&heating->heater))
		heating->on = switching_step(&heating->switching, 0, true, device->now_ns);
}

static void look(struct device *device, unsigned int i)
{
	struct heater *heater = &device->heatings.heating[i].heater;
	const bool fresh = device->intake.fresh;

	heater_device(heater, obstacle_of(device, i) == POKEYS_OBSTACLE_NONE);
	take_sample(device, i);
	heater_commander(heater, fresh, device->now_ns);
	if (fresh)
		command(device, i);
	if (must_be_off(device))
		heater_off(heater);
	rest(device, i);
}

void heating_session(struct device *device)
{
	for (unsigned int i = 0; i < device->heatings.count; i++) {
		struct heater *heater = &device->heatings.heating[i].heater;

		if (heater->config.lease_ns <= HEATER_PERIOD_NS)
			heater_off(heater);
		heater_another(heater);
	}
}

static int64_t tenths(double celsius)
{
	return fabs(celsius) < TENTHS_MOST ? (int64_t)llround(celsius * 10) : EVENT_NO_TEMPERATURE;
}

/* Log what has changed since the last call. */
static void say(struct device *device, unsigned int i)
{
	struct heating *heating = &device->heatings.heating[i];
	const struct heater *heater = &heating->heater;

	if (heater->fault != heating->fault) {
		heating->faults += heater->fault != HEATER_FINE;
		device_say(device, EVENT_HEATER, heater->fault ? EVENT_ERROR : EVENT_NOTICE, i,
			   heater->fault, tenths(heater->temperature));
	}
	if (heater->refusal != heating->refusal && heater->refusal)
		device_say(device, EVENT_HEATER_REFUSED, EVENT_WARNING, i, heater->refusal,
			   heater->refusal == HEATER_NOT_READY ? (int64_t)heater->condition :
								 tenths(heater->wanted));
	if (heater->tune.state != heating->tuning && heater->tune.state != TUNE_NONE)
		device_say(device, EVENT_HEATER_TUNED,
			   heater->tune.state == TUNE_FAILED ? EVENT_WARNING : EVENT_NOTICE, i,
			   heater->tune.state, tenths(heater->target));
	heating->fault = (uint8_t)heater->fault;
	heating->refusal = (uint8_t)heater->refusal;
	heating->tuning = (uint8_t)heater->tune.state;
}

static void step(struct device *device, unsigned int i)
{
	struct heating *heating = &device->heatings.heating[i];
	struct heater *heater = &heating->heater;
	const bool heated = !heater_is_off(heater);
	const bool tuned = heater->tune.state == TUNE_RUNS;
	const double power = heater_step(heater, device->now_ns);

	if (heated && heater_is_off(heater) && !heater->fault && !tuned)
		device_say(device, EVENT_HEATER_LEFT, EVENT_WARNING, i, 0,
			   tenths(heater->temperature));
	if (config_of(device, i)->kind == HEATING_PIN)
		heating->on = switching_step(&heating->switching, power, heater_is_off(heater),
					     device->now_ns);
}

static bool is_stopping(const struct heating *heating)
{
	return heating->hot.on && heater_is_off(&heating->heater);
}

static enum pokeys_heater_state state_of(const struct heating *heating)
{
	const struct heater *heater = &heating->heater;

	if (is_stopping(heating))
		return POKEYS_HEATER_STOPPING;
	if (heater->fault)
		return POKEYS_HEATER_FAULT;
	if (heater_is_off(heater))
		return POKEYS_HEATER_OFF;
	return heater->tune.state == TUNE_RUNS ? POKEYS_HEATER_TUNING : POKEYS_HEATER_HEATING;
}

static float gain(double value)
{
	return (float)(value * HEATING_GAIN_SCALE);
}

static void show_gains(struct pokeys_heater *image, const struct heater *heater)
{
	const struct pid_gains *now = &heater->config.gains, *tuned = &heater->tune.gains;

	image->p = gain(now->p);
	image->i = gain(now->i);
	image->d = gain(now->d);
	image->tuned_p = gain(tuned->p);
	image->tuned_i = gain(tuned->i);
	image->tuned_d = gain(tuned->d);
	image->tune_cycles = (uint16_t)heater->tune.cycles;
	image->tuning = (uint8_t)heater->tune.state;
}

static void show(struct device *device, unsigned int i)
{
	const struct heating *heating = &device->heatings.heating[i];
	const struct heating_config *config = config_of(device, i);
	const struct heater *heater = &heating->heater;
	struct pokeys_heater *image = &device->image.heater[i];

	image->t_ns = heater->good_ns;
	image->temperature = (float)heater->temperature;
	image->target = (float)heater->target;
	image->power = (float)heater->power;
	image->minimum = (float)config->heater.least;
	image->maximum = (float)config->heater.most;
	image->target_maximum = (float)config->heater.target_most;
	image->state = (uint8_t)state_of(heating);
	image->fault = (uint8_t)heater->fault;
	image->condition = (uint8_t)heater->condition;
	image->refused = (uint8_t)heater->refusal;
	image->at_temperature = heater_is_at(heater, config->within);
	image->limited = heater->limited && !heater_is_off(heater);
	image->fan = (uint8_t)heating_fan_state(device, i);
	image->stops_machine = config->stops_machine;
	image->obstacle = (uint8_t)(heater->condition == HEATER_DEVICE ? obstacle_of(device, i) :
									 POKEYS_OBSTACLE_NONE);
	image->fault_count = heating->faults;
	memcpy(image->name, config->name, sizeof(image->name));
	show_gains(image, heater);
}

/* Heaters step every HEATER_PERIOD_NS, and at once if the device is lost while one heats. */
static bool is_due(const struct device *device)
{
	for (unsigned int i = 0; i < device->heatings.count; i++) {
		const struct heater *heater = &device->heatings.heating[i].heater;

		if (heater->lost && !heater_is_off(heater))
			return true;
	}
	return device->now_ns >= device->heatings.step_ns;
}

static void step_all(struct device *device)
{
	struct heatings *heatings = &device->heatings;
	const bool in_time = device->now_ns >= heatings->step_ns &&
			     device->now_ns - heatings->step_ns <= LATE_NS;

	for (unsigned int i = 0; i < heatings->count; i++)
		step(device, i);
	heating_supply(device);
	heating_fans(device);
	heatings->step_ns = (in_time ? heatings->step_ns : device->now_ns) + HEATER_PERIOD_NS;
}

/* Has the device acknowledged that, and is nothing else under way to it? */
static bool is_settled_off(const struct device *device, const struct heating_config *config)
{
	if (config->kind == HEATING_PIN)
		return safe_pins_settled(device, UINT64_C(1) << config->output, 0);
	return loops_duty_settled(device, config->output, 0);
}

/* Has the device taken it that a heater is off? Until then it may heat. */
static void follow(struct device *device, unsigned int i)
{
	struct heating *heating = &device->heatings.heating[i];
	const struct heating_config *config = config_of(device, i);

	if (!heater_is_off(&heating->heater)) {
		if (heating->hot.on || heating->heater.power > 0)
			left_on(&heating->hot);
	} else if (heating->hot.on) {
		left_off(device, &heating->hot, is_settled_off(device, config));
	}
}

/* Not even silence helps: the same is sent again and again, and somebody has to know. */
static void say_unheard(struct device *device, unsigned int i)
{
	struct left_on *hot = &device->heatings.heating[i].hot;

	if (hot->said || !left_on_long(device, hot, UNHEARD_NS) ||
	    helps(life_failsafe(device), config_of(device, i)))
		return;
	hot->said = true;
	device_say(device, EVENT_HEATER_UNHEARD, EVENT_ERROR, 0, i, 0);
}

bool heating_unheard(const struct device *device)
{
	for (unsigned int i = 0; i < device->heatings.count; i++) {
		const struct left_on *hot = &device->heatings.heating[i].hot;

		if (left_on_late(device, hot, UNHEARD_NS) &&
		    helps(life_failsafe(device), config_of(device, i)))
			return true;
	}
	return false;
}

void heating_cycle(struct device *device)
{
	struct heatings *heatings = &device->heatings;

	if (!heatings->count)
		return;
	for (unsigned int i = 0; i < heatings->count; i++)
		look(device, i);
	if (is_due(device))
		step_all(device);
	for (unsigned int i = 0; i < heatings->count; i++) {
		follow(device, i);
		say_unheard(device, i);
		say(device, i);
		show(device, i);
	}
}

void heating_stopped_itself(struct device *device)
{
	for (unsigned int i = 0; i < device->heatings.count; i++)
		if (switches_off(life_failsafe(device), config_of(device, i)))
			device->heatings.heating[i].hot.on = false;
}

void heating_began_again(struct device *device)
{
	for (unsigned int i = 0; i < device->heatings.count; i++)
		device->heatings.heating[i].hot.on = false;
}

bool heating_may_heat(const struct device *device)
{
	for (unsigned int i = 0; i < device->heatings.count; i++)
		if (device->heatings.heating[i].hot.on &&
		    helps(life_failsafe(device), config_of(device, i)))
			return true;
	return false;
}

uint64_t heating_pins_stopping(const struct device *device)
{
	uint64_t pins = 0;

	for (unsigned int i = 0; i < device->heatings.count; i++)
		if (config_of(device, i)->kind == HEATING_PIN &&
		    is_stopping(&device->heatings.heating[i]))
			pins |= UINT64_C(1) << config_of(device, i)->output;
	return pins;
}

uint8_t heating_channels_stopping(const struct device *device)
{
	unsigned int channels = 0;

	for (unsigned int i = 0; i < device->heatings.count; i++)
		if (config_of(device, i)->kind == HEATING_PWM &&
		    is_stopping(&device->heatings.heating[i]))
			channels |= 1u << config_of(device, i)->output;
	return (uint8_t)channels;
}

uint64_t heating_pins(const struct device *device)
{
	uint64_t pins = heating_fan_pins(device);

	for (unsigned int i = 0; i < device->heatings.count; i++)
		if (config_of(device, i)->kind == HEATING_PIN)
			pins |= UINT64_C(1) << config_of(device, i)->output;
	return pins;
}

uint64_t heating_pins_on(const struct device *device)
{
	uint64_t pins = heating_fan_pins_on(device);

	for (unsigned int i = 0; i < device->heatings.count; i++) {
		const struct heating *heating = &device->heatings.heating[i];

		if (config_of(device, i)->kind == HEATING_PIN && heating->on &&
		    !heater_is_off(&heating->heater))
			pins |= UINT64_C(1) << config_of(device, i)->output;
	}
	return pins;
}

uint8_t heating_channels(const struct device *device)
{
	unsigned int channels = heating_fan_channels(device);

	for (unsigned int i = 0; i < device->heatings.count; i++)
		if (config_of(device, i)->kind == HEATING_PWM)
			channels |= 1u << config_of(device, i)->output;
	return (uint8_t)channels;
}

void heating_pwm(const struct device *device, struct wire_pwm_req *pwm)
{
	heating_fan_pwm(device, pwm);
	for (unsigned int i = 0; i < device->heatings.count; i++) {
		const struct heating_config *config = config_of(device, i);
		const struct heater *heater = &device->heatings.heating[i].heater;
		const double power = heater_is_off(heater) ? 0 : heater->power;

		if (config->kind != HEATING_PWM)
			continue;
		pwm->enabled |= (uint8_t)(1u << config->output);
		pwm->duty[config->output] = (uint32_t)llround(power * pwm->period);
	}
}

bool heating_stops_machine(const struct device *device)
{
	for (unsigned int i = 0; i < device->heatings.count; i++)
		if (config_of(device, i)->stops_machine && device->heatings.heating[i].heater.fault)
			return true;
	return false;
}

bool heating_off(const struct device *device)
{
	for (unsigned int i = 0; i < device->heatings.count; i++)
		if (!heater_is_off(&device->heatings.heating[i].heater))
			return false;
	return true;
}

/* While the device may have it on, no cause is gone. */
bool heating_reset(struct device *device, unsigned int index)
{
	return index < device->heatings.count && !is_stopping(&device->heatings.heating[index]) &&
	       heater_reset(&device->heatings.heating[index].heater);
}

bool heating_tune(struct device *device, unsigned int index, double target)
{
	struct heater *heater;

	if (index >= device->heatings.count || must_be_off(device))
		return false;
	heater = &device->heatings.heating[index].heater;
	if (target != 0)
		return heater_tune(heater, target) == HEATER_TAKEN;
	if (heater->tune.state == TUNE_RUNS)
		heater_off(heater);
	return true;
}

bool heating_regain(struct device *device, unsigned int index, unsigned int which, double value)
{
	struct pid_gains gains;
	double *const gain[] = {
		[POKEYS_GAIN_P] = &gains.p,
		[POKEYS_GAIN_I] = &gains.i,
		[POKEYS_GAIN_D] = &gains.d,
	};
	struct heater *heater;

	if (index >= device->heatings.count || which >= sizeof(gain) / sizeof(gain[0]) ||
	    value > HEATING_GAIN_MOST)
		return false;
	heater = &device->heatings.heating[index].heater;
	if (heater->tune.state == TUNE_RUNS)
		return false;
	gains = heater->config.gains;
	*gain[which] = value / HEATING_GAIN_SCALE;
	if (!heater_regain(heater, &gains))
		return false;
	show_gains(&device->image.heater[index], heater);
	device_say(device, EVENT_HEATER_GAIN, EVENT_NOTICE, index, which,
		   (int64_t)llround(value * EVENT_GAIN_SCALE));
	return true;
}
