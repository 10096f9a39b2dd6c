/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What a device's configuration says when nobody says anything, and which terminals its loops
 * have.
 *
 * A setting of the device itself has no default here: "leave it as the device
 * has it" is the only answer that cannot turn a motor the wrong way. The
 * daemon's own times are chosen for a loop of 1 kHz: an answer takes under a
 * millisecond, a cable that was touched is out for some tens of them, and a
 * servo thread that has been silent for a tenth of a second is dead.
 */

#include <string.h>
#include "daemon/device/device.h"
#include "settings/terminal.h"
#include "wire/io.h"

#define MS UINT64_C(1000000)

void device_config_defaults(struct device_config *config)
{
	memset(config, 0, sizeof(*config));
	config->port = 20055;
	config->period_ns = 1 * MS;
	config->heartbeat_timeout_ns = 100 * MS;
	config->stale_after_ns = 8 * MS;
	config->lost_after_ns = 200 * MS;
	config->fast_divider = 1;
	config->slow_hz = 5;
	config->encoder_hz = 50;
	config->analog_hz = 50;
	config->mailbox.window = 32;
	config->resume_auto = true;
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		config->axis[i].lead = true;
}

static uint64_t terminal_of(uint8_t pin)
{
	return pin < POKEYS_PINS ? UINT64_C(1) << pin : 0;
}

static uint8_t channel_of(uint8_t channel)
{
	return channel < POKEYS_PWM ? (uint8_t)(channel + 1) : 0;
}

void servoing_terminals(const struct servoing_config *config, unsigned int count,
			struct terminal_daemon *out)
{
	out->servos = (uint8_t)(count < POKEYS_SERVOS ? count : POKEYS_SERVOS);
	for (unsigned int i = 0; i < out->servos; i++) {
		out->servo[i].direction = terminal_of(config[i].direction);
		out->servo[i].enable = terminal_of(config[i].enable);
		out->servo[i].low = terminal_of(config[i].low);
		out->servo[i].high = terminal_of(config[i].high);
		if (config[i].home.search != 0 && config[i].home_pin != config[i].low &&
		    config[i].home_pin != config[i].high)
			out->servo[i].home = terminal_of(config[i].home_pin);
		out->servo[i].pwm = channel_of(config[i].pwm);
		out->servo[i].reverse_pwm = channel_of(config[i].reverse_pwm);
	}
}

void heating_terminals(const struct heating_config *config, unsigned int count,
		       struct terminal_daemon *out)
{
	out->heaters = (uint8_t)(count < POKEYS_HEATERS ? count : POKEYS_HEATERS);
	for (unsigned int i = 0; i < out->heaters; i++) {
		out->heater[i].sensor = UINT64_C(1)
					<< (WIRE_ANALOG_FIRST_PIN - 1 + config[i].sensor);
		if (config[i].kind == HEATING_PIN)
			out->heater[i].output = UINT64_C(1) << config[i].output;
		else
			out->heater[i].pwm = (uint8_t)(config[i].output + 1);
		if (config[i].fan.kind == HEATING_PIN)
			out->heater[i].fan = UINT64_C(1) << config[i].fan.output;
		else if (config[i].fan.kind == HEATING_PWM)
			out->heater[i].fan_pwm = (uint8_t)(config[i].fan.output + 1);
	}
}
