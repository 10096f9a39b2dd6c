// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What a heater needs: a device, a sensor, one output, limits, and a device that switches it off
 * by itself.
 *
 * The sensor's curve and the limits are judged by the heater itself (daemon/loops/heater.h), so
 * what is accepted here is what runs. Its terminals need not be in analog-inputs or
 * digital-outputs: the daemon configures them. A key that has no effect with this kind of sensor,
 * output or control is refused, because whoever wrote it may rely on it.
 */
#include <math.h>
#include <string.h>
#include "daemon/control/config_judge.h"
#include "wire/io.h"

#define COUNT(array)	(sizeof(array) / sizeof((array)[0]))
#define SUPPLY_PERIOD_MOST 125000	/* ticks; the capacitors of a supply bridge some ms */
#define PARTS	3		/* of watch-window-s, at most, in which a relay does nothing */

struct judged_part judge_heater_part(struct config_file *file, uint32_t heater)
{
	return (struct judged_part){ file, CONFIG_HEATER, "heater", file->heater[heater].name,
				     &file->heater_lines[heater] };
}

bool judge_has_heater(const struct judged *j, uint32_t heater)
{
	return j->file->heater[heater].of == (uint32_t)(j->raw - j->file->device);
}

static void judge_given(struct judged_part part, const struct config_raw_heater *raw)
{
	static const char *const needed[] = { "sensor-pin", "sensor", "max-temperature" };
	const bool pwm = raw->pwm >= 0, pin = raw->output_pin > 0;

	for (size_t i = 0; i < COUNT(needed); i++)
		if (!judge_part_has(part, needed[i]))
			judge_part_fault(part, needed[i], "%s is not given", needed[i]);
	if (!pwm && !pin && !judge_part_is_faulty(part, "pwm") &&
	    !judge_part_is_faulty(part, "output-pin"))
		judge_part_fault(part, "pwm",
				 "neither pwm nor output-pin is given; give one "
				 "of them");
	if (pwm && pin)
		judge_part_fault(part, "output-pin",
				 "output-pin and pwm are both "
				 "given; give only one");
}

/* Keys that only some kinds of sensor have. */
static void judge_sensor_keys(struct judged_part part, const struct config_raw_heater *raw)
{
	enum {
		RESISTOR = 1u << CONFIG_THERMISTOR | 1u << CONFIG_STEINHART | 1u << CONFIG_PT100 |
			   1u << CONFIG_PT1000 | 1u << CONFIG_SENSOR_TABLE
	};
	static const struct {
		const char *key;
		unsigned int sensors;
	} keys[] = {
		{ "thermistor-ohm", 1u << CONFIG_THERMISTOR },
		{ "thermistor-celsius", 1u << CONFIG_THERMISTOR },
		{ "thermistor-beta", 1u << CONFIG_THERMISTOR },
		{ "sensor-points", 1u << CONFIG_STEINHART | 1u << CONFIG_SENSOR_TABLE },
		{ "pull-up-ohm", RESISTOR },
		{ "reference-v", 1u << CONFIG_LINEAR | 1u << CONFIG_SENSOR_TABLE },
		{ "volts-at-0", 1u << CONFIG_LINEAR },
		{ "volts-per-kelvin", 1u << CONFIG_LINEAR },
	};
	const unsigned int sensor = 1u << raw->sensor;

	if (!judge_part_has(part, "sensor"))
		return;
	if (raw->sensor == CONFIG_SENSOR_TABLE && raw->pull_up > 0 &&
	    judge_part_has(part, "reference-v"))
		judge_part_fault(part, "reference-v",
				 "reference-v has no effect with "
				 "pull-up-ohm above 0");
	for (size_t i = 0; i < COUNT(keys); i++)
		if (judge_part_has(part, keys[i].key) && !(keys[i].sensors & sensor))
			judge_part_fault(part, keys[i].key,
					 "%s has no effect with this kind of sensor", keys[i].key);
}

static void judge_fan_keys(struct judged_part part, const struct config_raw_heater *raw)
{
	static const char *const keys[] = { "fan-above", "fan-hysteresis", "fan-speed" };
	const bool pwm = raw->fan_pwm >= 0, pin = raw->fan_pin > 0;

	if (pwm && pin)
		judge_part_fault(part, "fan-pin",
				 "fan-pin and fan-pwm are both given; give only "
				 "one");
	if (judge_part_is_faulty(part, "fan-pwm") || judge_part_is_faulty(part, "fan-pin"))
		return;
	for (size_t i = 0; i < COUNT(keys); i++)
		if (!pwm && !pin && judge_part_has(part, keys[i]))
			judge_part_fault(part, keys[i],
					 "%s has no effect without fan-pwm or "
					 "fan-pin",
					 keys[i]);
	if ((pwm || pin) && judge_part_has(part, "max-temperature") && judge_part_is_whole(part) &&
	    raw->fan_above >= raw->out.heater.target_most)
		judge_part_fault(part, "fan-above",
				 "fan-above%s has to be below max-target, "
				 "which is %g",
				 judge_part_has(part, "fan-above") ? "" : " (default: 50)",
				 raw->out.heater.target_most);
	if (pin && !pwm && judge_part_has(part, "fan-speed"))
		judge_part_fault(part, "fan-speed", "fan-speed has no effect with fan-pin");
}

static void judge_other_keys(struct judged_part part, const struct config_raw_heater *raw)
{
	static const char *const pid[] = { "pid-p", "pid-i", "pid-d", "pid-smooth-s" };

	for (size_t i = 0; i < COUNT(pid); i++)
		if (raw->law == HEATER_BANG_BANG && judge_part_has(part, pid[i]))
			judge_part_fault(part, pid[i], "%s has no effect with control = bang-bang",
					 pid[i]);
	if (raw->law == HEATER_PID && judge_part_has(part, "hysteresis"))
		judge_part_fault(part, "hysteresis", "hysteresis has no effect with control = pid");
	if (raw->pwm >= 0 && judge_part_has(part, "min-switch-s"))
		judge_part_fault(part, "min-switch-s", "min-switch-s has no effect with pwm");
	if (raw->pwm < 0 && raw->least_s * PARTS > raw->window_s)
		judge_part_fault(part, "min-switch-s",
				 "min-switch-s = %g must not be "
				 "longer than a third of watch-window-s, which is %g",
				 raw->least_s, raw->window_s);
}

/* heater_init() is called only if the section has no other faults: its message would mislead. */
static void judge_heater(struct judged_part part, struct config_raw_heater *raw)
{
	const int faults = part.file->faults;
	struct heater trial;
	const char *wrong, *key;

	judge_given(part, raw);
	judge_sensor_keys(part, raw);
	judge_other_keys(part, raw);
	config_convert_heater(raw, &raw->out);
	judge_fan_keys(part, raw);
	if (part.file->faults != faults || !judge_part_is_whole(part))
		return;
	wrong = sensor_init(&trial.sensor, &raw->out.heater.sensor);
	if (wrong) {
		key = judge_part_has(part, "sensor-points") ? "sensor-points" : "sensor";
	} else {
		wrong = heater_init(&trial, &raw->out.heater);
		key = wrong ? judge_part_named(part, wrong, "max-temperature") : NULL;
	}
	if (wrong)
		judge_part_fault(part, key, "%s", wrong);
}

void judge_heaters(struct config_file *file)
{
	uint32_t heaters[TRANSPORT_CHANNELS] = { 0 };

	for (uint32_t i = 0; i < file->heaters; i++) {
		struct config_raw_heater *raw = &file->heater[i];
		const struct judged_part part = judge_heater_part(file, i);

		raw->of = judge_part_device(part, raw->device);
		judge_heater(part, raw);
		if (raw->of == JUDGE_NOBODY)
			continue;
		raw->number = heaters[raw->of]++;
		if (raw->number == POKEYS_HEATERS)
			judge_part_fault(part, "device", "[device %s] has more than %d heaters",
					 file->device[raw->of].name, POKEYS_HEATERS);
	}
}

/* Only the device's failsafe switches the output off when this computer fails. */
static void judge_covered(const struct judged *j, uint32_t heater)
{
	const struct heating_config *config = &j->file->heater[heater].out;
	char why[JUDGE_WHY_MAX];

	if (config->without_failsafe ||
	    judge_part_covered(j, config->kind == HEATING_PWM, config->output,
			       HEATING_FAILSAFE_MOST, why))
		return;
	judge_part_fault(judge_heater_part(j->file, heater), "without-failsafe",
			 "%s: the heater would stay on if this computer fails; without-failsafe = "
			 "yes accepts that",
			 why);
}

/* How old a reading is at most, in good order, ms; twice, for one may be lost. */
static double reading_ms(const struct judged *j, uint32_t heater)
{
	const struct config_raw_device *raw = j->raw;

	if (j->file->heater[heater].sensor_pin < WIRE_IO_ANALOG_FIRST_PIN)
		return 2000 / (raw->slow_together ? raw->slow_hz : raw->analog_hz);
	return 2 * (double)j->file->daemon.period_us * (double)raw->fast_divider / 1000;
}

static void judge_pwm(struct judged_part part, const char *key, const char *instead,
		      const struct judged *j)
{
	const struct pokeys_settings *settings = &j->raw->settings;

	judge_part_pwm(part, key, j, HEATING_PERIOD_LEAST, HEATING_PERIOD_MOST, "2500000 is 10 Hz");
	if (settings->set & POKEYS_SET_SYNC_PWM && settings->sync_pwm_enable)
		judge_part_fault(part, key,
				 "%s and synced-pwm of its device exclude each other; "
				 "use %s",
				 key, instead);
}

/* Refuse settings of the device with which the heater could not heat, or not be watched. */
static void judge_device_of(const struct judged *j, uint32_t heater)
{
	const struct judged_part part = judge_heater_part(j->file, heater);
	const struct config_raw_heater *raw = &j->file->heater[heater];
	const struct pokeys_settings *settings = &j->raw->settings;

	if (raw->sensor_pin && reading_ms(j, heater) > raw->stale_ms)
		judge_part_fault(part, "max-age-ms",
				 "max-age-ms = %g has to be at "
				 "least two readings of its device, which are %g ms (%s)",
				 raw->stale_ms, reading_ms(j, heater),
				 raw->sensor_pin < WIRE_IO_ANALOG_FIRST_PIN ?
					 "analog-hz" :
					 "period-us, fast-divider");
	if (settings->set & POKEYS_SET_ANALOG_FILTER &&
	    settings->analog_filter > HEATING_FILTER_MOST)
		judge_part_fault(part, "sensor-pin",
				 "analog-filter of its device is "
				 "above %d: it would hide what the sensor reads",
				 HEATING_FILTER_MOST);
	if (raw->pwm >= 0)
		judge_pwm(part, "pwm", "output-pin", j);
	if (raw->fan_pwm >= 0)
		judge_pwm(part, "fan-pwm", "fan-pin", j);
}

/* Nothing burns without it, but a cold end may be clogged. */
static void note_fan(const struct judged *j, uint32_t heater)
{
	const struct judged_part part = judge_heater_part(j->file, heater);
	const struct heating_fan_config *fan = &j->file->heater[heater].out.fan;
	const bool pwm = fan->kind == HEATING_PWM;
	const char *key = pwm ? "fan-pwm" : "fan-pin";
	char why[JUDGE_WHY_MAX];

	if (!j->file->here || fan->kind == HEATING_NO_OUTPUT ||
	    !judge_part_covered(j, pwm, fan->output, UINT8_MAX, why))
		return;
	config_note(j->file, config_line_of(part.lines, key, 0),
		    "[heater %s]: %s: the fan stops when the device receives nothing, for example "
		    "after the daemon ends; to keep it on, set %s",
		    part.name, key, pwm ? "failsafe-pwm" : "failsafe-on");
}

/* Each heater says what it needs, or none does. */
static void judge_watts(const struct judged *j, uint32_t heater)
{
	const struct judged_part part = judge_heater_part(j->file, heater);
	const double watts = j->file->heater[heater].watts;

	if (judge_part_is_faulty(part, "rated-power-w"))
		return;
	if (j->raw->heater_watts > 0 && watts <= 0)
		judge_part_fault(part, "rated-power-w",
				 "rated-power-w is not given; "
				 "max-heater-power-w of its device needs it");
	if (j->raw->heater_watts <= 0 && watts > 0)
		judge_part_fault(part, "rated-power-w",
				 "rated-power-w has no effect without "
				 "max-heater-power-w in [device %s]",
				 j->raw->name);
}

/* What cannot be limited has to be less than there is, and something has to be left. */
static void judge_supply(const struct judged *j)
{
	const double watts = j->raw->heater_watts;
	unsigned int heaters = 0, shared = 0, switches = 0;
	double switched = 0, all = 0;

	if (config_is_faulty(j->lines, "max-heater-power-w"))
		return;
	for (uint32_t i = 0; i < j->file->heaters; i++) {
		const struct config_raw_heater *raw = &j->file->heater[i];

		if (!judge_has_heater(j, i))
			continue;
		judge_watts(j, i);
		heaters++;
		shared += raw->pwm >= 0;
		all += raw->watts;
		switches += raw->output_pin > 0;
		switched += raw->output_pin > 0 ? raw->watts : 0;
	}
	if (watts <= 0)
		return;
	if (!heaters)
		judge_fault(j, "max-heater-power-w", 0,
			    "max-heater-power-w has no effect without "
			    "a [heater NAME]");
	if (switches && (watts < switched || (shared && watts <= switched)))
		judge_fault(j, "max-heater-power-w", 0,
			    "max-heater-power-w = %g is too low: it "
			    "has to be %s %g, the power of the heaters with output-pin, which "
			    "cannot be limited",
			    watts, shared ? "above" : "at least", switched);
	if (j->file->here && shared && all > watts &&
	    j->raw->settings.pwm_period > SUPPLY_PERIOD_MOST)
		config_note(j->file, config_line_of(j->lines, "max-heater-power-w", 0),
			    "[device %s]: max-heater-power-w limits the mean power; all "
			    "heaters switch on together at the start of each PWM period, and "
			    "with pwm-period above %d ticks (5 ms) this may overload the "
			    "supply",
			    j->raw->name, SUPPLY_PERIOD_MOST);
}

/* Another function of a terminal was complained about already. */
void judge_heaters_of(const struct judged *j)
{
	judge_supply(j);
	for (uint32_t i = 0; i < j->file->heaters; i++) {
		const struct config_raw_heater *raw = &j->file->heater[i];

		if (!judge_has_heater(j, i))
			continue;
		judge_covered(j, i);
		judge_device_of(j, i);
		note_fan(j, i);
		if (raw->sensor_pin)
			judge_make_pin(&j->raw->settings, (unsigned int)raw->sensor_pin - 1,
				       WIRE_PIN_ANALOG_IN);
		if (raw->output_pin)
			judge_make_pin(&j->raw->settings, (unsigned int)raw->output_pin - 1,
				       WIRE_PIN_OUTPUT);
		if (raw->fan_pin)
			judge_make_pin(&j->raw->settings, (unsigned int)raw->fan_pin - 1,
				       WIRE_PIN_OUTPUT);
	}
}
