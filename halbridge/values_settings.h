/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The parameters that are the device's own settings.
 *
 * All of them begin at "as the device has it": -1 (s32; but for mpg-multiplier),
 * or not a number (float). Once the device's settings are known the parameter shows them, and
 * as soon as somebody sets one, the device is to be changed (wish.h). Merely
 * loading the component changes nothing.
 */
#ifndef HALBRIDGE_VALUES_SETTINGS_H
#define HALBRIDGE_VALUES_SETTINGS_H

#include <stdbool.h>
#include <stdint.h>

/* Of mpg-multiplier, which may be -1: a hand wheel that turns the axis the other way. */
#define SETTING_MULTIPLIER_LEFT	(INT16_MIN - 1)
#include <pokeys/state.h>

typedef volatile bool param_bit;
typedef volatile double param_float;
typedef volatile int32_t param_s32;
typedef volatile uint32_t param_u32;

enum {
	SETTINGS_ENCODERS = 25, /* the ultra-fast one has settings of its own */
	SETTINGS_FAST = 3,
	SETTINGS_ROWS = 16,
	SETTINGS_COLUMNS = 8, /* of a matrix keyboard */
};

struct value_encoder_settings {
	param_s32 sampling, pin_a, pin_b;
};

struct value_axis_settings {
	param_float max_velocity, max_acceleration, max_deceleration;
	param_float soft_min, soft_max, back_off;
	param_float backlash_width, backlash_acceleration;
	/* options */
	param_s32 enable, invert, mode, home_invert, soft_limits, masked;
	/* switches */
	param_s32 limit_neg, limit_pos, home, home_on_limit_neg, home_on_limit_pos;
	param_s32 limit_neg_invert, limit_pos_invert, home_switch_invert;
	param_s32 limit_neg_pin, limit_pos_pin, home_pin, enable_pin, enable_invert;
	param_s32 limit_neg_filter, limit_pos_filter, home_filter, probe_filter;
	param_s32 homing_on_switch, homing_off_switch, homing_speed, homing_return_speed;
	param_s32 mpg_encoder, mpg_multiplier, mpg_divider;
	param_s32 step_invert, direction_invert, index_falling;
	param_s32 postep_type, postep_address, postep_step, postep_temperature;
};

struct value_engine_settings {
	param_s32 axes, charge_pump, generator, swap_step_dir, extended_io;
	param_s32 emergency_invert, emergency_pin, power_states;
};

/* What follows the slots of an axis. */
struct value_sync_settings {
	param_s32 pwm_enable, pwm_axis, pwm_channel, out_enable, out_axis, out_pin[8];
};

struct value_failsafe_settings {
	param_s32 timeout_ms, digital, poextbus, pwm, engine;
	param_s32 pin[POKEYS_PINS], bus_byte[POKEYS_POEXTBUS], duty[POKEYS_PWM];
};

struct value_threading_settings {
	param_s32 mode, ticks, target_rpm, speed_gain, position_gain, ignore_axes;
};

struct value_matrix_settings {
	param_s32 enable, rows, columns, row_pin[SETTINGS_ROWS], column_pin[SETTINGS_COLUMNS];
};

struct value_settings {
	param_float pwm_frequency;
	param_s32 pin_function[POKEYS_PINS];
	struct value_encoder_settings encoder[SETTINGS_ENCODERS];
	param_s32 fast_configuration, fast_4x, fast_invert[SETTINGS_FAST], fast_index;
	param_s32 ultra_enable, ultra_invert, ultra_signal_mode, ultra_4x, ultra_filter;
	param_s32 analog_filter;
	param_s32 poextbus_connector, poextbus_crc;
	struct value_engine_settings engine;
	struct value_axis_settings axis[POKEYS_AXES];
	struct value_failsafe_settings failsafe;
	struct value_matrix_settings matrix;
	struct value_sync_settings sync;
	param_s32 backlash, backlash_speed, postep;
	struct value_threading_settings threading;
};

#endif
