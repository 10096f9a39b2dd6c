// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * From what was written to what the daemon uses: milliseconds to nanoseconds,
 * numbers to the types of their users, 0 retries to the engine's word for none.
 *
 * Everything has been judged; nothing here can go wrong, and so nothing of a
 * file with a fault ever gets here.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "daemon/control/config_key.h"
#include "wire/io.h"

static uint64_t ms(double value)
{
	return (uint64_t)llround(value * 1e6);
}

/* Of max-target = auto, K. */
#define TARGET_BELOW 15

/* What auto is for a servo motor. */
#define IMPOSSIBLE_TIMES	3	/* max-speed */
#define INTEGRAL_PART		0.5	/* of max-output */
#define STALL_PART		0.9
#define LATCH_PART		0.1	/* of home-search-speed */
#define HOME_REACHED_S		0.1
#define REACHED_S		0.2
#define HOME_TIMES		1.1	/* from one soft limit to the other */

static int by_place(const void *a, const void *b)
{
	const struct sensor_point *first = a, *second = b;

	return (first->at > second->at) - (first->at < second->at);
}

static void convert_safe(const struct config_raw_device *raw, struct device_config *out)
{
	for (unsigned int pin = 0; pin < POKEYS_PINS; pin++) {
		uint8_t bit = (uint8_t)(1u << pin % 8);

		if (raw->safe_hold >> pin & 1)
			out->safe_hold[pin / 8] |= bit;
		else
			out->safe_mask[pin / 8] |= bit;
		if (raw->safe_on >> pin & 1)
			out->safe_outputs[pin / 8] |= bit;
	}
}

static void convert_resume(const struct config_raw_device *raw, struct device_config *out)
{
	const uint64_t word = (uint64_t)CONFIG_RESUME_AUTO;

	out->resume_auto = (raw->resume & word) == word;
	if (out->resume_auto)
		return;
	out->resume_parts = (uint8_t)(raw->resume >> 56);
	for (unsigned int pin = 0; pin < POKEYS_PINS; pin++)
		if (raw->resume >> pin & 1)
			out->resume_outputs[pin / 8] |= (uint8_t)(1u << pin % 8);
}

void config_axis_name(const struct config_raw_device *raw, unsigned int axis,
		      char name[POKEYS_AXIS_NAME])
{
	if (*raw->axis[axis].name)
		memcpy(name, raw->axis[axis].name, POKEYS_AXIS_NAME);
	else
		snprintf(name, POKEYS_AXIS_NAME, "axis.%u", axis);
}

void config_convert_device(const struct config_raw_device *raw, uint64_t period_ns,
			   struct device_config *out)
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
	out->slow_together = raw->slow_together;
	out->encoder_hz = raw->encoder_hz;
	out->analog_hz = raw->analog_hz;
	out->mailbox.deadline_floor_ns = ms(raw->deadline_floor_us / 1000);
	out->mailbox.deadline_ceiling_ns = ms(raw->deadline_ceiling_ms);
	out->mailbox.deadline_initial_ns = ms(raw->deadline_initial_ms);
	out->mailbox.reply_lifetime_ns = ms(raw->reply_lifetime_ms);
	out->mailbox.retries = raw->retries ? (uint32_t)raw->retries : POKEYS_NO_RETRIES;
	out->mailbox.window = (uint32_t)raw->window;
	out->mailbox.retry_budget = (uint32_t)raw->retry_budget;
	out->mailbox.send_budget = (uint32_t)raw->send_budget;
	memset(out->safe_mask, 0, sizeof(out->safe_mask));
	memset(out->safe_outputs, 0, sizeof(out->safe_outputs));
	convert_safe(raw, out);
	convert_resume(raw, out);
	out->emergency_holds = raw->on_emergency;
	out->heater_watts = raw->heater_watts;
	out->corner_deviation = raw->corner_deviation;
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		out->axis[i].pulses_per_unit = raw->axis[i].per_unit;
		out->axis[i].lead = raw->axis[i].lead;
		config_axis_name(raw, i, out->axis[i].name);
	}
	out->settings = raw->settings;
	out->have_password = *raw->password_file;
	memcpy(out->password, raw->password, sizeof(out->password));
}

static void convert_sensor(const struct config_raw_heater *raw, struct sensor_config *out)
{
	static const enum sensor_kind kinds[CONFIG_SENSORS] = {
		[CONFIG_THERMISTOR] = SENSOR_BETA, [CONFIG_STEINHART] = SENSOR_STEINHART,
		[CONFIG_PT100] = SENSOR_PLATINUM,  [CONFIG_PT1000] = SENSOR_PLATINUM,
		[CONFIG_LINEAR] = SENSOR_LINEAR,   [CONFIG_SENSOR_TABLE] = SENSOR_TABLE,
	};

	out->kind = kinds[raw->sensor];
	out->pull_up = raw->pull_up;
	out->reference = raw->reference;
	out->ohm = raw->sensor == CONFIG_PT100  ? 100 :
		   raw->sensor == CONFIG_PT1000 ? 1000 :
						  raw->ohm;
	out->celsius = raw->ohm_at;
	out->beta = raw->beta;
	out->volts_at_0 = raw->volts_at_0;
	out->volts_per_kelvin = raw->volts_per_kelvin;
	out->count = raw->points.count;
	memcpy(out->points, raw->points.point, sizeof(out->points));
	qsort(out->points, out->count, sizeof(out->points[0]), by_place);
}

/* For ever, or at least a period of the heater. */
static uint64_t lease(double seconds)
{
	const uint64_t ns = ms(fabs(seconds) * 1000);

	if (seconds < 0)
		return UINT64_MAX;
	return ns < HEATER_PERIOD_NS ? HEATER_PERIOD_NS : ns;
}

static void convert_control(const struct config_raw_heater *raw, struct heater_config *out)
{
	out->least = raw->least;
	out->most = raw->most;
	out->target_most = raw->target_most == CONFIG_TARGET_AUTO ? raw->most - TARGET_BELOW :
								    raw->target_most;
	out->law = (enum heater_law)raw->law;
	out->gains.p = raw->p / HEATING_GAIN_SCALE;
	out->gains.i = raw->i / HEATING_GAIN_SCALE;
	out->gains.d = raw->d / HEATING_GAIN_SCALE;
	out->gains.smooth = raw->smooth_s;
	out->hysteresis = raw->hysteresis;
	out->power_most = raw->power_most;
	out->rate_most = raw->rate_most;
	out->slack = raw->slack;
	out->rise = raw->rise;
	out->window_ns = ms(raw->window_s * 1000);
	out->stale_ns = ms(raw->stale_ms);
	out->lease_ns = lease(raw->hold_s);
}

static void convert_fan(const struct config_raw_heater *raw, struct heating_fan_config *out)
{
	const bool pwm = raw->fan_pwm >= 0;

	out->kind = pwm ? HEATING_PWM : raw->fan_pin ? HEATING_PIN : HEATING_NO_OUTPUT;
	out->output = (uint8_t)(pwm ? raw->fan_pwm : raw->fan_pin ? raw->fan_pin - 1 : 0);
	out->speed = raw->fan_speed;
	out->fan.above = raw->fan_above;
	out->fan.hysteresis = raw->fan_hysteresis;
}

/* Member by member: what lies between them stays 0, for whoever compares bytes. */
void config_convert_heater(const struct config_raw_heater *raw, struct heating_config *out)
{
	const bool pwm = raw->pwm >= 0;

	memset(out, 0, sizeof(*out));
	memcpy(out->name, raw->name, sizeof(out->name));
	convert_sensor(raw, &out->heater.sensor);
	convert_control(raw, &out->heater);
	out->sensor = (uint8_t)(raw->sensor_pin ? raw->sensor_pin - WIRE_ANALOG_FIRST_PIN : 0);
	out->kind = pwm ? HEATING_PWM : HEATING_PIN;
	out->output = (uint8_t)(pwm ? raw->pwm : raw->output_pin ? raw->output_pin - 1 : 0);
	out->least_ns = ms(raw->least_s * 1000);
	out->within = raw->within;
	out->watts = raw->watts;
	convert_fan(raw, &out->fan);
	out->stops_machine = raw->stops_machine;
	out->without_failsafe = raw->without_failsafe;
}

static double unlimited(double value, double limit)
{
	return value == limit ? copysign(INFINITY, limit) : value;
}

static double or_auto(double value, double instead)
{
	return value == CONFIG_SERVO_AUTO ? instead : value;
}

static void convert_servo(const struct config_raw_servo *raw, struct servo_config *out)
{
	out->scale = raw->scale;
	out->least = unlimited(raw->least, -(double)CONFIG_UNLIMITED);
	out->most = unlimited(raw->most, (double)CONFIG_UNLIMITED);
	out->speed_most = raw->speed_most;
	out->speed_jump = or_auto(raw->speed_jump, raw->speed_most * IMPOSSIBLE_TIMES);
	out->gains.p = raw->p;
	out->gains.i = raw->i;
	out->gains.d = raw->d;
	out->gains.velocity = raw->velocity;
	out->gains.acceleration = raw->acceleration;
	out->deadband = raw->deadband;
	out->output_most = raw->output_most;
	out->integral_most = or_auto(raw->integral_most, raw->output_most * INTEGRAL_PART);
	out->smooth = raw->smooth_s;
	out->follow_least = raw->follow_least;
	out->follow_most = raw->follow_most;
	out->stall_output = or_auto(raw->stall_output, raw->output_most * STALL_PART);
	out->stall_move = raw->stall_move;
	out->stall_s = raw->stall_s;
	out->silent_output = raw->silent_output;
	out->silent_s = raw->silent_s;
	out->runaway_output = raw->runaway_output;
	out->runaway_move = raw->runaway_move;
	out->stale_ns = ms(raw->stale_ms);
}

static uint8_t channel_or_none(int64_t channel)
{
	return channel < 0 ? SERVOING_NONE : (uint8_t)channel;
}

static uint8_t pin_or_none(int64_t terminal)
{
	return terminal ? (uint8_t)(terminal - 1) : SERVOING_NONE;
}

/* Without a switch of its own, the limit switch there. */
static void convert_home(const struct config_raw_servo *raw, struct servoing_config *out)
{
	const double speed = fabs(raw->home_search);
	const bool low = raw->home_search < 0;

	out->home = (struct servo_home_config){
		.search = raw->home_search,
		.latch = or_auto(raw->home_latch, speed * LATCH_PART),
		.acceleration = or_auto(raw->home_acceleration, speed / HOME_REACHED_S),
		.offset = raw->home_offset,
		.position = raw->home_position,
		.distance = or_auto(raw->home_distance,
				    (out->servo.most - out->servo.least) * HOME_TIMES),
	};
	out->home_pin = pin_or_none(raw->home_pin);
	out->home_inverted = raw->home_invert;
	if (out->home_pin != SERVOING_NONE)
		return;
	out->home_pin = low ? out->low : out->high;
	out->home_inverted = low ? out->low_inverted : out->high_inverted;
}

void config_convert_servo(const struct config_raw_servo *raw, struct servoing_config *out)
{
	memset(out, 0, sizeof(*out));
	memcpy(out->name, raw->name, sizeof(out->name));
	convert_servo(raw, &out->servo);
	out->drive.kind = (enum drive_kind)raw->drive;
	out->drive.dwell_ns = ms(raw->dwell_ms);
	out->encoder = (uint8_t)raw->encoder;
	out->pwm = channel_or_none(raw->pwm);
	out->reverse_pwm = channel_or_none(raw->reverse_pwm);
	out->direction = pin_or_none(raw->direction_pin);
	out->enable = pin_or_none(raw->enable_pin);
	out->low = pin_or_none(raw->limit_minus_pin);
	out->high = pin_or_none(raw->limit_plus_pin);
	out->low_inverted = raw->limit_minus_invert;
	out->high_inverted = raw->limit_plus_invert;
	convert_home(raw, out);
	out->acceleration = or_auto(raw->acceleration_most, raw->speed_most / REACHED_S);
	out->inverted = raw->invert_output;
	out->without_failsafe = raw->without_failsafe;
}

void config_convert_daemon(const struct config_raw_daemon *raw, struct config *out)
{
	memcpy(out->runtime_directory, raw->runtime_directory, sizeof(out->runtime_directory));
	memcpy(out->group, raw->group, sizeof(out->group));
	memcpy(out->monitor_group, raw->monitor_group, sizeof(out->monitor_group));
	memcpy(out->interface, raw->interface, sizeof(out->interface));
	memcpy(out->metrics_file, raw->metrics_file, sizeof(out->metrics_file));
	out->interface_dedicated = raw->guard;
	out->transport = (enum config_transport)raw->transport;
	out->busy_poll_us = (uint32_t)raw->busy_poll_us;
	out->loop.period_ns = (uint64_t)raw->period_us * 1000;
	out->wait = (enum config_wait)raw->mode;
	out->loop.collect = raw->collect;
	out->loop.phase_lock = (enum loop_phase_lock)raw->phase_lock;
	out->loop.duty = raw->duty;
	out->cpu = (int)raw->cpu;
	out->priority = (int)raw->priority;
	out->realtime_required = raw->realtime;
	out->discovery_interval_ns = (uint64_t)raw->discovery_interval_ms * 1000000;
	out->discovery_addresses = raw->discovery_address.count;
	memcpy(out->discovery_address, raw->discovery_address.address,
	       sizeof(out->discovery_address));
	out->recorder_seconds = (uint32_t)raw->recorder_seconds;
	memcpy(out->record_folder, raw->record_folder, sizeof(out->record_folder));
	out->record_files = (uint32_t)raw->record_files;
	out->record_interval_ns = (uint64_t)raw->record_interval_s * 1000000000;
	out->metrics_interval_ns = (uint64_t)raw->metrics_interval_ms * 1000000;
	out->log_level = (int)raw->log_level;
}

const char *config_transport_name(enum config_transport transport)
{
	static const char *const names[] = { "auto", "io_uring", "socket", "xdp" };

	return names[transport];
}
