// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Rules between keys, and the way from what was written to what the daemon
 * uses: milliseconds to nanoseconds, terminals to pin functions.
 *
 * A rule stands here if two values, each good, are wrong together: a pin that
 * is input and output, a stale limit shorter than the time between two
 * samples. Somebody would otherwise find out at the machine.
 */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include "daemon/control/config_key.h"

enum { PIN_INPUT = 0x02, PIN_OUTPUT = 0x04, PIN_ANALOG = 0x08, PIN_INVERT = 0x80 };
enum { ENCODER_COUNT = 1, ENCODER_4X = 2, ENCODER_2X = 4, FAST_ENCODERS_ON = 10 };
enum { AXIS_INVERTED = 0x02, AXIS_SOFT_LIMITS = 0x20 };
enum { AXIS_POSITION_MODE = 0x01 | 0x04 | 0x08 };	/* enabled, with the device's planner */
enum { EMERGENCY_PIN_BASE = 10 };

/* A device while it is judged. */
struct judged {
	struct config_file *file;
	const struct config_raw_device *raw;
	const struct config_lines *lines;
};

/* Line of a key if it is in the file, else that of the section. */
static uint32_t line_of(const struct config_lines *lines, const char *name, uint32_t index)
{
	for (size_t i = 0; i < config_key_count; i++)
		if (!strcmp(config_keys[i].name, name) && lines->key[i][index])
			return lines->key[i][index];
	return lines->section;
}

static bool is_set(const struct config_lines *lines, const char *name, uint32_t index)
{
	for (size_t i = 0; i < config_key_count; i++)
		if (!strcmp(config_keys[i].name, name) && lines->key[i][index])
			return true;
	return false;
}

/* A complaint about a key of a device, at the key's line. */
static void fault(const struct judged *j, const char *key, uint32_t index, const char *format, ...)
	__attribute__((format(printf, 4, 5)));
static void fault(const struct judged *j, const char *key, uint32_t index, const char *format, ...)
{
	char text[400];
	va_list arguments;

	va_start(arguments, format);
	vsnprintf(text, sizeof(text), format, arguments);
	va_end(arguments);
	config_fault(j->file, line_of(j->lines, key, index), "[device %s]: %s", j->raw->name, text);
}

static uint64_t ms(double value)
{
	return (uint64_t)llround(value * 1e6);
}

/* The first pin that is in both, 1-based; 0 = none. */
static int shared_pin(uint64_t a, uint64_t b)
{
	return a & b ? __builtin_ctzll(a & b) + 1 : 0;
}

/* No terminal may be told two things. */
static void judge_pins(const struct judged *j)
{
	const struct config_raw_device *raw = j->raw;
	const struct {
		uint64_t a, b;
		const char *key_a, *key_b;
	} never[] = {
		{ raw->digital_inputs, raw->digital_outputs, "digital-inputs", "digital-outputs" },
		{ raw->digital_inputs, raw->analog_inputs, "digital-inputs", "analog-inputs" },
		{ raw->digital_outputs, raw->analog_inputs, "digital-outputs", "analog-inputs" },
		{ raw->safe_on, raw->safe_hold, "safe-on", "safe-hold" },
		{ raw->safe_on, raw->digital_inputs, "safe-on", "digital-inputs" },
		{ raw->safe_on, raw->analog_inputs, "safe-on", "analog-inputs" },
		{ raw->safe_hold, raw->digital_inputs, "safe-hold", "digital-inputs" },
		{ raw->safe_hold, raw->analog_inputs, "safe-hold", "analog-inputs" },
	};
	int pin;

	for (size_t i = 0; i < sizeof(never) / sizeof(never[0]); i++) {
		pin = shared_pin(never[i].a, never[i].b);
		if (pin)
			fault(j, never[i].key_b, 0, "pin %d is in %s and in %s", pin,
			      never[i].key_a, never[i].key_b);
	}
	pin = shared_pin(raw->inverted_pins, ~(raw->digital_inputs | raw->digital_outputs));
	if (pin)
		fault(j, "inverted-pins", 0, "inverted-pins: pin %d is neither in digital-inputs "
		      "nor in digital-outputs", pin);
	if (raw->emergency_pin > 0 &&
	    (raw->digital_outputs | raw->analog_inputs) >> (raw->emergency_pin - 1) & 1)
		fault(j, "emergency-pin", 0, "emergency-pin: pin %d is an output or analog",
		      (int)raw->emergency_pin);
}

static void judge_encoders(const struct judged *j)
{
	const struct config_raw_device *raw = j->raw;

	for (uint32_t i = 0; i < CONFIG_INDICES; i++) {
		for (int channel = 0; channel < 2; channel++) {
			uint8_t pin = raw->encoder[i].pins[channel];

			if (pin == 255 || !((raw->digital_outputs | raw->analog_inputs) >> pin & 1))
				continue;
			fault(j, "encoder.#.pins", i, "encoder.%u.pins: pin %d is an output or "
			      "analog", i, pin + 1);
		}
	}
}

static void judge_axes(const struct judged *j)
{
	for (uint32_t i = 0; i < POKEYS_AXES; i++) {
		const struct config_raw_axis *axis = &j->raw->axis[i];

		if (axis->soft_limits != 1)
			continue;
		if (!is_set(j->lines, "axis.#.soft-minimum", i) ||
		    !is_set(j->lines, "axis.#.soft-maximum", i))
			fault(j, "axis.#.soft-limits", i, "axis.%u.soft-limits = on wants "
			      "axis.%u.soft-minimum and axis.%u.soft-maximum", i, i, i);
		else if (axis->soft_minimum >= axis->soft_maximum)
			fault(j, "axis.#.soft-maximum", i, "axis.%u.soft-maximum has to be above "
			      "axis.%u.soft-minimum", i, i);
	}
}

static void judge_times(const struct judged *j)
{
	const struct config_raw_device *raw = j->raw;
	double sample_ms = (double)j->file->daemon.period_us * (double)raw->fast_divider / 1000;

	if (raw->stale_after_ms <= sample_ms)
		fault(j, "stale-after-ms", 0, "stale-after-ms = %g has to be longer than the time "
		      "between two samples, which is %g ms (period-us times fast-divider)",
		      raw->stale_after_ms, sample_ms);
	if (raw->lost_after_ms <= raw->stale_after_ms)
		fault(j, "lost-after-ms", 0, "lost-after-ms = %g has to be longer than "
		      "stale-after-ms, which is %g", raw->lost_after_ms, raw->stale_after_ms);
	if (raw->deadline_ceiling_ms < raw->deadline_floor_us / 1000)
		fault(j, "deadline-ceiling-ms", 0, "deadline-ceiling-ms = %g must not be shorter "
		      "than deadline-floor-us, which is %g us", raw->deadline_ceiling_ms,
		      raw->deadline_floor_us);
}

/* Two devices that are one. */
static void judge_identity(const struct judged *j, uint32_t index)
{
	const struct config_raw_device *raw = j->raw;

	if (!raw->address && !raw->serial && !is_set(j->lines, "address", 0))
		fault(j, "address", 0, "neither address nor serial is given; one of them says "
		      "where the device is");
	for (uint32_t i = 0; i < index; i++) {
		const struct config_raw_device *other = &j->file->device[i];

		if (raw->address && raw->address == other->address && raw->port == other->port)
			fault(j, "address", 0, "address: [device %s] has the same one, and the "
			      "same port", other->name);
		if (raw->serial && raw->serial == other->serial)
			fault(j, "serial", 0, "serial: [device %s] has the same one", other->name);
	}
}

/* Protocol section 3.2; 0 = leave. */
static uint8_t function_of(const struct config_raw_device *raw, unsigned int pin)
{
	unsigned int function = 0;

	function |= raw->digital_inputs >> pin & 1 ? PIN_INPUT : 0;
	function |= raw->digital_outputs >> pin & 1 ? PIN_OUTPUT : 0;
	function |= raw->analog_inputs >> pin & 1 ? PIN_ANALOG : 0;
	function |= raw->inverted_pins >> pin & 1 ? PIN_INVERT : 0;
	return (uint8_t)function;
}

static void convert_pins(const struct config_raw_device *raw, struct device_config *out)
{
	for (unsigned int pin = 0; pin < POKEYS_PINS; pin++) {
		uint8_t bit = (uint8_t)(1u << pin % 8);

		out->settings.pin_function[pin] = function_of(raw, pin);
		if (out->settings.pin_function[pin])
			out->settings.pin_set[pin / 8] |= bit;
		if (raw->safe_hold >> pin & 1)
			out->safe_hold[pin / 8] |= bit;
		else
			out->safe_mask[pin / 8] |= bit;
		if (raw->safe_on >> pin & 1)
			out->safe_outputs[pin / 8] |= bit;
	}
}

static void convert_limits(const struct config_raw_axis *raw, struct pokeys_axis_settings *out)
{
	if (raw->soft_limits >= 0)
		out->options_mask |= AXIS_SOFT_LIMITS;
	if (raw->soft_limits <= 0)
		return;
	out->options |= AXIS_SOFT_LIMITS;
	out->set |= POKEYS_AXIS_SET_SOFT_MINIMUM | POKEYS_AXIS_SET_SOFT_MAXIMUM;
	out->soft_minimum = (int32_t)raw->soft_minimum;
	out->soft_maximum = (int32_t)raw->soft_maximum;
}

/* 0 and less = leave. */
static void convert_number(double value, uint32_t bit, uint32_t *set, float *out)
{
	if (!(value > 0))
		return;
	*set |= bit;
	*out = (float)value;
}

static void convert_axis(const struct config_raw_axis *raw, struct pokeys_axis_settings *out)
{
	const double deceleration = raw->max_deceleration > 0 ? raw->max_deceleration :
								raw->max_acceleration;

	if (raw->mode == POKEYS_AXIS_POSITION) {
		out->options |= AXIS_POSITION_MODE;
		out->options_mask |= AXIS_POSITION_MODE;
	}
	if (raw->invert >= 0)
		out->options_mask |= AXIS_INVERTED;
	if (raw->invert > 0)
		out->options |= AXIS_INVERTED;
	convert_limits(raw, out);
	convert_number(raw->max_speed, POKEYS_AXIS_SET_MAX_SPEED, &out->set, &out->max_speed);
	convert_number(raw->max_acceleration, POKEYS_AXIS_SET_MAX_ACCELERATION, &out->set,
		       &out->max_acceleration);
	convert_number(deceleration, POKEYS_AXIS_SET_MAX_DECELERATION, &out->set,
		       &out->max_deceleration);
}

static void convert_encoder(const struct config_raw_encoder *raw, const struct config_lines *lines,
			    uint32_t index, struct pokeys_encoder_settings *out)
{
	for (size_t i = 0; i < config_key_count; i++)
		if (!strncmp(config_keys[i].name, "encoder.#.", 10) && lines->key[i][index])
			out->options_mask = ENCODER_COUNT | ENCODER_4X | ENCODER_2X;
	if (!out->options_mask)
		return;
	if (raw->enable)
		out->options |= ENCODER_COUNT;
	if (raw->sampling == 4)
		out->options |= ENCODER_4X;
	if (raw->sampling == 2)
		out->options |= ENCODER_2X;
	out->pins_set = raw->pins[0] < POKEYS_PINS && raw->pins[1] < POKEYS_PINS;
	out->pin_a = out->pins_set ? raw->pins[0] : 0;
	out->pin_b = out->pins_set ? raw->pins[1] : 0;
}

static void convert_engine(const struct config_raw_device *raw, struct pokeys_settings *out)
{
	if (raw->axes > 0) {
		out->set |= POKEYS_SET_AXES;
		out->axes = (uint8_t)raw->axes;
	}
	if (raw->emergency_pin >= 0) {
		out->set |= POKEYS_SET_EMERGENCY_PIN;
		out->emergency_pin = (uint8_t)(raw->emergency_pin ? raw->emergency_pin +
						EMERGENCY_PIN_BASE : 0);
	}
	if (raw->fast_encoders >= 0) {
		out->set |= POKEYS_SET_FAST_ENCODERS;
		out->fast_configuration = raw->fast_encoders ? FAST_ENCODERS_ON : 0;
	}
	if (raw->ultra_fast_encoder >= 0) {
		out->set |= POKEYS_SET_ULTRA_FAST;
		out->ultra_enable = raw->ultra_fast_encoder > 0;
	}
}

static void convert_device(const struct config_raw_device *raw, const struct config_lines *lines,
			   uint64_t period_ns, struct device_config *out)
{
	device_config_defaults(out);
	snprintf(out->name, sizeof(out->name), "%s", raw->name);
	out->serial = (uint32_t)raw->serial;
	out->address = raw->address;
	out->port = (uint16_t)raw->port;
	out->period_ns = period_ns;
	out->heartbeat_timeout_ns = ms(raw->heartbeat_timeout_ms);
	out->stale_after_ns = ms(raw->stale_after_ms);
	out->lost_after_ns = ms(raw->lost_after_ms);
	out->fast_divider = (uint32_t)raw->fast_divider;
	out->slow_hz = raw->slow_hz;
	out->encoder_hz = raw->encoder_hz;
	out->analog_hz = raw->analog_hz;
	out->mailbox.deadline_floor_ns = ms(raw->deadline_floor_us / 1000);
	out->mailbox.deadline_ceiling_ns = ms(raw->deadline_ceiling_ms);
	out->mailbox.deadline_initial_ns = ms(raw->deadline_initial_ms);
	out->mailbox.reply_lifetime_ns = ms(raw->reply_lifetime_ms);
	out->mailbox.retries = (uint32_t)raw->retries;
	out->mailbox.window = (uint32_t)raw->window;
	out->mailbox.retry_budget = (uint32_t)raw->retry_budget;
	out->mailbox.send_budget = (uint32_t)raw->send_budget;
	memset(out->safe_mask, 0, sizeof(out->safe_mask));
	memset(out->safe_outputs, 0, sizeof(out->safe_outputs));
	convert_pins(raw, out);
	convert_engine(raw, &out->settings);
	for (uint32_t i = 0; i < POKEYS_AXES; i++)
		convert_axis(&raw->axis[i], &out->settings.axis[i]);
	for (uint32_t i = 0; i < CONFIG_INDICES; i++)
		convert_encoder(&raw->encoder[i], lines, i, &out->settings.encoder[i]);
}

static void convert_daemon(const struct config_raw_daemon *raw, struct config *out)
{
	memcpy(out->runtime_directory, raw->runtime_directory, sizeof(out->runtime_directory));
	memcpy(out->group, raw->group, sizeof(out->group));
	memcpy(out->interface, raw->interface, sizeof(out->interface));
	memcpy(out->metrics_file, raw->metrics_file, sizeof(out->metrics_file));
	out->transport = (enum config_transport)raw->transport;
	out->busy_poll_us = (uint32_t)raw->busy_poll_us;
	out->loop.period_ns = (uint64_t)raw->period_us * 1000;
	out->loop.mode = (enum loop_mode)raw->mode;
	out->loop.collect = raw->collect;
	out->loop.duty = raw->duty;
	out->cpu = (int)raw->cpu;
	out->priority = (int)raw->priority;
	out->realtime_required = raw->realtime;
	out->discovery_interval_ns = (uint64_t)raw->discovery_interval_ms * 1000000;
	out->discovery_addresses = raw->discovery_address.count;
	memcpy(out->discovery_address, raw->discovery_address.address,
	       sizeof(out->discovery_address));
	out->metrics_interval_ns = (uint64_t)raw->metrics_interval_ms * 1000000;
	out->log_level = (int)raw->log_level;
}

void config_judge(struct config_file *file, struct config *out)
{
	if (file->daemon.duty > 0.9 && file->daemon.duty < 1)
		config_fault(file, line_of(&file->daemon_lines, "duty", 0),
			     "[daemon]: duty: \"%g\" is out of range; allowed: 0.1..0.9, or 1",
			     file->daemon.duty);
	if (!file->devices && !file->faults)
		config_fault(file, 0, "there is no [device NAME] section");
	for (uint32_t i = 0; i < file->devices; i++) {
		struct judged j = { file, &file->device[i], &file->device_lines[i] };

		judge_identity(&j, i);
		judge_pins(&j);
		judge_encoders(&j);
		judge_axes(&j);
		judge_times(&j);
	}
	if (file->faults)
		return;
	memset(out, 0, sizeof(*out));
	convert_daemon(&file->daemon, out);
	out->devices = file->devices;
	for (uint32_t i = 0; i < file->devices; i++) {
		convert_device(&file->device[i], &file->device_lines[i], out->loop.period_ns,
			       &out->device[i]);
		out->device[i].index = (uint8_t)i;
	}
}

const char *config_transport_name(enum config_transport transport)
{
	static const char *const names[] = { "auto", "io_uring", "socket" };

	return names[transport];
}
