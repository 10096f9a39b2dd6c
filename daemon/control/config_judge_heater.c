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
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include "daemon/control/config_judge.h"
#include "wire/io.h"
#include "wire/system.h"

#define COUNT(array)	(sizeof(array) / sizeof((array)[0]))
#define NOBODY	UINT32_MAX
#define PARTS	3		/* of watch-window-s, at most, in which a relay does nothing */

void judge_heater_fault(struct config_file *file, uint32_t heater, const char *key,
			const char *format, ...)
{
	char text[400];
	va_list arguments;

	va_start(arguments, format);
	vsnprintf(text, sizeof(text), format, arguments);
	va_end(arguments);
	config_fault(file, config_line_of(&file->heater_lines[heater], key, 0),
		     "[heater %s]: %s", file->heater[heater].name, text);
}

bool judge_has_heater(const struct judged *j, uint32_t heater)
{
	return j->file->heater[heater].of == (uint32_t)(j->raw - j->file->device);
}

static uint32_t find_device(struct config_file *file, uint32_t heater)
{
	const char *name = file->heater[heater].device;

	for (uint32_t i = 0; i < file->devices; i++)
		if (!strcmp(file->device[i].name, name))
			return i;
	if (!*name && file->devices == 1)
		return 0;
	if (*name)
		judge_heater_fault(file, heater, "device", "device: there is no [device %s]", name);
	else if (file->devices)
		judge_heater_fault(file, heater, "device", "device is not given; it is needed if "
				   "there are several devices");
	return NOBODY;
}

static bool is_given(const struct config_file *file, uint32_t heater, const char *key)
{
	return config_is_set(&file->heater_lines[heater], key, 0);
}

/* It stands there with a value that was complained about already. */
static bool is_faulty_key(const struct config_file *file, uint32_t heater, const char *name)
{
	const struct config_key *key;

	for (size_t i = 0; (key = config_key_at(i)); i++)
		if (key->section == CONFIG_HEATER && !strcmp(key->name, name))
			return file->heater_lines[heater].faulty[i];
	return false;
}

static void judge_given(struct config_file *file, uint32_t heater)
{
	static const char *const needed[] = { "sensor-pin", "sensor", "max-temperature" };
	const bool pwm = file->heater[heater].pwm >= 0, pin = file->heater[heater].output_pin > 0;

	for (size_t i = 0; i < COUNT(needed); i++)
		if (!is_given(file, heater, needed[i]))
			judge_heater_fault(file, heater, needed[i], "%s is not given", needed[i]);
	if (!pwm && !pin && !is_faulty_key(file, heater, "pwm") &&
	    !is_faulty_key(file, heater, "output-pin"))
		judge_heater_fault(file, heater, "pwm", "neither pwm nor output-pin is given; give "
				   "one of them");
	if (pwm && pin)
		judge_heater_fault(file, heater, "output-pin", "output-pin and pwm are both "
				   "given; give only one");
}

/* Keys that only some kinds of sensor have. */
static void judge_sensor_keys(struct config_file *file, uint32_t heater)
{
	enum { RESISTOR = 1u << CONFIG_THERMISTOR | 1u << CONFIG_STEINHART | 1u << CONFIG_PT100 |
			  1u << CONFIG_PT1000 | 1u << CONFIG_SENSOR_TABLE };
	static const struct { const char *key; unsigned int sensors; } keys[] = {
		{ "thermistor-ohm", 1u << CONFIG_THERMISTOR },
		{ "thermistor-celsius", 1u << CONFIG_THERMISTOR },
		{ "thermistor-beta", 1u << CONFIG_THERMISTOR },
		{ "sensor-points", 1u << CONFIG_STEINHART | 1u << CONFIG_SENSOR_TABLE },
		{ "pull-up-ohm", RESISTOR },
		{ "reference-v", 1u << CONFIG_LINEAR | 1u << CONFIG_SENSOR_TABLE },
		{ "volts-at-0", 1u << CONFIG_LINEAR },
		{ "volts-per-kelvin", 1u << CONFIG_LINEAR },
	};
	const struct config_raw_heater *raw = &file->heater[heater];
	const unsigned int sensor = 1u << raw->sensor;

	if (!is_given(file, heater, "sensor"))
		return;
	if (raw->sensor == CONFIG_SENSOR_TABLE && raw->pull_up > 0 &&
	    is_given(file, heater, "reference-v"))
		judge_heater_fault(file, heater, "reference-v", "reference-v has no effect with "
				   "pull-up-ohm above 0");
	for (size_t i = 0; i < COUNT(keys); i++)
		if (is_given(file, heater, keys[i].key) && !(keys[i].sensors & sensor))
			judge_heater_fault(file, heater, keys[i].key,
					   "%s has no effect with this kind of sensor",
					   keys[i].key);
}

static void judge_other_keys(struct config_file *file, uint32_t heater)
{
	static const char *const pid[] = { "pid-p", "pid-i", "pid-d", "pid-smooth-s" };
	const struct config_raw_heater *raw = &file->heater[heater];

	for (size_t i = 0; i < COUNT(pid); i++)
		if (raw->law == HEATER_BANG_BANG && is_given(file, heater, pid[i]))
			judge_heater_fault(file, heater, pid[i],
					   "%s has no effect with control = bang-bang", pid[i]);
	if (raw->law == HEATER_PID && is_given(file, heater, "hysteresis"))
		judge_heater_fault(file, heater, "hysteresis",
				   "hysteresis has no effect with control = pid");
	if (raw->pwm >= 0 && is_given(file, heater, "min-switch-s"))
		judge_heater_fault(file, heater, "min-switch-s",
				   "min-switch-s has no effect with pwm");
	if (raw->pwm < 0 && raw->least_s * PARTS > raw->window_s)
		judge_heater_fault(file, heater, "min-switch-s", "min-switch-s = %g must not be "
				   "longer than a third of watch-window-s, which is %g",
				   raw->least_s, raw->window_s);
}

/* Of the keys that a complaint names, the first one that the section has. */
static const char *given_key(const struct config_file *file, uint32_t heater, const char *text)
{
	static const char letters[] = "abcdefghijklmnopqrstuvwxyz0123456789-";
	char word[40], why[200];
	const struct config_key *key;
	uint32_t index;

	for (; *text; text += strcspn(text, " ") + (text[strcspn(text, " ")] == ' ')) {
		const size_t length = strspn(text, letters);

		if (length >= sizeof(word))
			continue;
		memcpy(word, text, length);
		word[length] = '\0';
		key = config_find(CONFIG_HEATER, word, &index, why, sizeof(why));
		if (key && is_given(file, heater, key->name))
			return key->name;
	}
	return "max-temperature";
}

/* heater_init() is called only if the section has no other faults: its message would mislead. */
static void judge_heater(struct config_file *file, uint32_t heater)
{
	struct config_raw_heater *raw = &file->heater[heater];
	const int faults = file->faults;
	struct heater trial;
	const char *wrong, *key;

	judge_given(file, heater);
	judge_sensor_keys(file, heater);
	judge_other_keys(file, heater);
	config_convert_heater(raw, &raw->out);
	if (file->faults != faults)
		return;
	for (size_t i = 0; i < CONFIG_KEYS_MAX; i++)
		if (file->heater_lines[heater].faulty[i])
			return;
	wrong = sensor_init(&trial.sensor, &raw->out.heater.sensor);
	if (wrong) {
		key = is_given(file, heater, "sensor-points") ? "sensor-points" : "sensor";
	} else {
		wrong = heater_init(&trial, &raw->out.heater);
		key = wrong ? given_key(file, heater, wrong) : NULL;
	}
	if (wrong)
		judge_heater_fault(file, heater, key, "%s", wrong);
}

void judge_heaters(struct config_file *file)
{
	uint32_t heaters[TRANSPORT_CHANNELS] = { 0 };

	for (uint32_t i = 0; i < file->heaters; i++) {
		struct config_raw_heater *raw = &file->heater[i];

		raw->of = find_device(file, i);
		judge_heater(file, i);
		if (raw->of == NOBODY)
			continue;
		raw->number = heaters[raw->of]++;
		if (raw->number == POKEYS_HEATERS)
			judge_heater_fault(file, i, "device",
					   "[device %s] has more than %d heaters",
					   file->device[raw->of].name, POKEYS_HEATERS);
	}
}

/* Only the device's failsafe switches the output off when this computer fails. */
static void judge_covered(const struct judged *j, uint32_t heater)
{
	const struct pokeys_settings *settings = &j->raw->settings;
	const struct heating_config *config = &j->file->heater[heater].out;
	const bool pwm = config->kind == HEATING_PWM;
	const uint8_t part = pwm ? WIRE_FAILSAFE_PWM : WIRE_FAILSAFE_DIGITAL;
	const char *wrong = NULL;

	if (config->without_failsafe)
		return;
	if (!j->raw->failsafe || !settings->failsafe_timeout)
		wrong = "the failsafe of its device is off";
	else if (settings->failsafe_timeout > HEATING_FAILSAFE_MOST)
		wrong = "failsafe-timeout-ms of its device is longer than 5000";
	else if (!(settings->failsafe_peripherals & part))
		wrong = pwm ? "failsafe-parts of its device does not include PWM outputs (4)" :
			      "failsafe-parts of its device does not include digital outputs (1)";
	else if (pwm ? settings->failsafe_pwm[config->output] > 0 :
		       settings->failsafe_outputs[config->output / 8] >> config->output % 8 & 1)
		wrong = pwm ? "failsafe-pwm of its device keeps this output on" :
			config_is_set(j->lines, "failsafe-on", 0) ?
			      "failsafe-on of its device keeps this output on" :
			      "safe-on of its device keeps this output on";
	if (wrong)
		judge_heater_fault(j->file, heater, "without-failsafe", "%s: the heater would stay "
				   "on if this computer fails; without-failsafe = yes accepts that",
				   wrong);
}

/* How old a reading is at most, in good order, ms; twice, for one may be lost. */
static double reading_ms(const struct judged *j, uint32_t heater)
{
	const struct config_raw_device *raw = j->raw;

	if (j->file->heater[heater].sensor_pin < WIRE_IO_ANALOG_FIRST_PIN)
		return 2000 / (raw->slow_together ? raw->slow_hz : raw->analog_hz);
	return 2 * (double)j->file->daemon.period_us * (double)raw->fast_divider / 1000;
}

/* Refuse settings of the device with which the heater could not heat, or not be watched. */
static void judge_device_of(const struct judged *j, uint32_t heater)
{
	const struct config_raw_heater *raw = &j->file->heater[heater];
	const struct pokeys_settings *settings = &j->raw->settings;

	if (raw->sensor_pin && reading_ms(j, heater) > raw->stale_ms)
		judge_heater_fault(j->file, heater, "max-age-ms", "max-age-ms = %g has to be at "
				   "least two readings of its device, which are %g ms (%s)",
				   raw->stale_ms, reading_ms(j, heater),
				   raw->sensor_pin < WIRE_IO_ANALOG_FIRST_PIN ? "analog-hz" :
				   "period-us, fast-divider");
	if (settings->set & POKEYS_SET_ANALOG_FILTER &&
	    settings->analog_filter > HEATING_FILTER_MOST)
		judge_heater_fault(j->file, heater, "sensor-pin", "analog-filter of its device is "
				   "above %d: it would hide what the sensor reads",
				   HEATING_FILTER_MOST);
	if (raw->pwm < 0)
		return;
	if (!(settings->set & POKEYS_SET_PWM_PERIOD))
		judge_heater_fault(j->file, heater, "pwm", "pwm needs pwm-period in [device %s], "
				   "in ticks of 25 MHz (2500000 is 10 Hz)", j->raw->name);
	else if (settings->pwm_period < HEATING_PERIOD_LEAST ||
		 settings->pwm_period > HEATING_PERIOD_MOST)
		judge_heater_fault(j->file, heater, "pwm", "pwm-period of its device has to be %d "
				   "to %d", HEATING_PERIOD_LEAST, HEATING_PERIOD_MOST);
	if (settings->set & POKEYS_SET_SYNC_PWM && settings->sync_pwm_enable)
		judge_heater_fault(j->file, heater, "pwm", "pwm and synced-pwm of its device "
				   "exclude each other; use output-pin");
}

/* A terminal of a heater is what it needs; another function was complained about already. */
static void make(struct pokeys_settings *settings, unsigned int pin, uint8_t function)
{
	settings->pin_function[pin] |= function;
	settings->pin_set[pin / 8] |= (uint8_t)(1u << pin % 8);
}

void judge_heaters_of(const struct judged *j)
{
	for (uint32_t i = 0; i < j->file->heaters; i++) {
		const struct config_raw_heater *raw = &j->file->heater[i];

		if (!judge_has_heater(j, i))
			continue;
		judge_covered(j, i);
		judge_device_of(j, i);
		if (raw->sensor_pin)
			make(&j->raw->settings, (unsigned int)raw->sensor_pin - 1,
			     WIRE_PIN_ANALOG_IN);
		if (raw->output_pin)
			make(&j->raw->settings, (unsigned int)raw->output_pin - 1, WIRE_PIN_OUTPUT);
	}
}
