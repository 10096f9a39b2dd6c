/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * info.*: the capabilities of the device's type under the names of the older
 * userspace component.
 *
 * Several of those names are one flag of the type: the joystick mappings come
 * and go together, and the triggered mapping of the matrix keyboard with that
 * of the keys (protocol section 2.4). The two pulse engine pins are the two
 * versions of one capability.
 */
#include "halbridge/info.h"
#include <stdbool.h>
#include <string.h>

static void read_counts(struct value_info *info, const struct pokeys_capability *has)
{
	info->pins = has->pins;
	info->pwm = has->pwm;
	info->pwm_hz = has->pwm_hz;
	info->basic_encoders = has->basic_encoders;
	info->encoders = has->encoders;
	info->fast_encoders = has->fast_encoders;
	info->ultra_fast_encoders = has->ultra_fast_encoders;
	info->analog_inputs = has->analog_inputs;
	info->digital_counters = has->digital_counters;
	info->poextbus = has->poextbus;
	info->easy_sensors = has->easy_sensors;
	info->pulse_engine = has->pulse_engine == 1;
	info->pulse_engine_v2 = has->pulse_engine == 2;
	info->axes = has->axes;
	info->axis_khz = has->axis_khz;
}

static void read_keys(struct value_info *info, const struct pokeys_capability *has)
{
	info->key_mapping = has->key_mapping;
	info->triggered_key_mapping = has->triggered_key_mapping;
	info->key_repeat_delay = has->key_repeat_delay;
	info->joystick_button_axis = has->joystick;
	info->joystick_analog_digital = has->joystick;
	info->joystick_hat = has->joystick;
	info->macros = has->macros;
	info->matrix_keyboard = has->matrix_keyboard;
	info->matrix_triggered_mapping = has->triggered_key_mapping;
	info->lcd = has->lcd;
	info->matrix_led = has->matrix_led;
}

static void read_features(struct value_info *info, const struct pokeys_capability *has)
{
	info->connection_signal = has->connection_signal;
	info->ponet = has->ponet;
	info->analog_filtering = has->analog_filtering;
	info->init_outputs = has->init_outputs;
	info->i2c = has->i2c;
	info->one_wire = has->one_wire;
	info->additional_options = has->additional_options;
	info->load_status = has->load_status;
	info->custom_name = has->custom_name;
	info->potlog27 = has->potlog27;
	info->sensor_list = has->sensor_list;
	info->web_interface = has->web_interface;
	info->failsafe = has->failsafe;
}

static void read_identity(struct value_info *info, const struct pokeys_identity *identity)
{
	info->firmware_major = identity->firmware_major;
	info->firmware_minor = identity->firmware_minor;
	info->firmware_revision = identity->firmware_revision;
	info->user_id = identity->user_id;
	info->options = identity->options;
}

static bool is_known(const struct info_known *known, const struct pokeys_state *state)
{
	return known->serial == state->identity.serial &&
	       known->hardware == state->identity.hardware &&
	       known->version[0] == state->identity.firmware_major &&
	       known->version[1] == state->identity.firmware_minor &&
	       known->version[2] == state->identity.firmware_revision &&
	       known->user_id == state->identity.user_id &&
	       known->options == state->identity.options &&
	       !memcmp(&known->capability, &state->capability, sizeof(known->capability));
}

void info_read(struct info_known *known, struct values *values, const struct pokeys_state *state)
{
	if ((!state->identity.serial && !state->identity.hardware) || is_known(known, state))
		return;
	known->serial = state->identity.serial;
	known->hardware = state->identity.hardware;
	known->version[0] = state->identity.firmware_major;
	known->version[1] = state->identity.firmware_minor;
	known->version[2] = state->identity.firmware_revision;
	known->user_id = state->identity.user_id;
	known->options = state->identity.options;
	known->capability = state->capability;
	read_identity(&values->info, &state->identity);
	values->device_serial = known->serial;
	values->info.serial = known->serial;
	values->info.type_id = known->hardware;
	read_counts(&values->info, &known->capability);
	read_keys(&values->info, &known->capability);
	read_features(&values->info, &known->capability);
	values_changed(values, BLOCK_INFO);
}
