/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What the names of the older userspace component have of their own: values
 * and parameters whose type or meaning is not that of a canonical one. Where
 * both are the same, the legacy row stands on the canonical member.
 *
 * Parameters that configure the device lie in structs of their own, so that
 * legacy_settings.c sees with one comparison whether somebody has set any.
 */
#ifndef HALBRIDGE_VALUES_LEGACY_H
#define HALBRIDGE_VALUES_LEGACY_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/state.h>
#include "halbridge/values_settings.h"

enum {
	LEGACY_ENCODERS = 29, /* 26..28 never had a counter behind them */
	LEGACY_EXTERNAL = 4,  /* external relays, and as many outputs */
	LEGACY_WORDS = 16,    /* data bytes of a PoNET module, a pin each */
};

struct legacy_connection {
	uint32_t usb, fast_usb, udp;
	int32_t step;
	bool error, usb_open, fast_usb_open, tcp_open;
};

struct legacy_clock {
	uint32_t unnamed, loops, last_minute, last_second, rate, rate_demand, second_back;
	uint32_t latency;
};

struct legacy_encoder {
	double position, velocity;
	param_float scale;
};

struct legacy_encoder_unused {
	int32_t count;
	bool reset, index_enable;
};

struct legacy_encoder_settings {
	param_u32 options, pin_a, pin_b;
	param_bit enable, x4, x2;
};

struct legacy_fast_encoders {
	param_u32 options, configuration;
	param_s32 ultra_filter;
	param_bit enable, alternative, invert[3], no_x4;
	param_bit ultra_invert, ultra_signal_mode, ultra_x4;
};

struct legacy_poextbus {
	int32_t step;
	param_u32 count, in[POKEYS_POEXTBUS], out[POKEYS_POEXTBUS];
};

struct legacy_ponet {
	uint32_t in[POKEYS_PONET][LEGACY_WORDS], out[POKEYS_PONET][LEGACY_WORDS];
	param_u32 id[POKEYS_PONET], address[POKEYS_PONET], type[POKEYS_PONET];
	param_u32 size[POKEYS_PONET], options[POKEYS_PONET], found;
	uint32_t brightness_before;
	int32_t step;
	param_u32 keyboard;
	param_bit available;
};

struct legacy_adcout {
	double value;
	uint32_t step, duty;
	bool enable;
	param_float offset, scale, high, low, full;
	param_u32 pin;
};

struct legacy_adcin {
	double volts;
};

struct legacy_pin_settings {
	param_u32 function[POKEYS_PINS];
	param_bit in_invert[POKEYS_PINS], out_invert[POKEYS_PINS];
};

/* PEv2.N: pins. */
struct legacy_axis {
	double shown_speed, shown_position, shown_reference;
	double feedback_encoder, deadband, max_output, encoder_scale, final_velocity;
	uint32_t state, command, reference, reference_position, reference_speed, soft_limit;
	uint32_t probe_position, homing_status, probe_max;
	uint32_t backlash_width, backlash_register, backlash_acceleration;
	int32_t step, velocity_moves, position_moves, position, preset, type, ignore_limits;
	bool homing, in_position, position_mode, position_mode_active, moves;
	bool index_enable, out_home, homing_joint, at_position, keyboard_jog, wheel_jog;
	bool limit_minus, limit_minus_not, limit_plus, limit_plus_not, home, home_not;
	bool error, error_not, probe, probe_not;
	bool axis_enable, axis_enabled, override;
};

/* PEv2.N: what is set in the device, and what it is made of. */
struct legacy_axis_settings {
	param_float max_speed, max_acceleration, max_deceleration;
	param_float home, velocity, acceleration, minimum, maximum;
	param_float home_offset, search_velocity, latch_velocity;
	param_u32 options, switches, homing;
	param_u32 soft_maximum, soft_minimum, homing_speed, homing_return, home_offsets, back_off;
	param_u32 mpg_multiplier, mpg_encoder, mpg_divider;
	param_u32 home_offset_steps, shown_minimum, shown_maximum;
	param_u32 limit_minus_pin, limit_plus_pin, home_pin, enable_pin;
	param_u32 limit_minus_filter, limit_plus_filter, home_filter, probe_filter;
	param_s32 home_position, arm_position, zero_position, scale, offset, sequence;
	param_s32 enabled, inverted, planner, position_mode, home_inverted, soft_limits, masked;
	param_bit on_home[4], off_home[4]; /* reduced speed, reverse, arm encoder, stop */
	param_bit limit_minus, limit_plus, home_switch, home_on_minus, home_on_plus;
	param_bit limit_minus_invert, limit_plus_invert, home_invert, enable_invert;
};

struct legacy_engine {
	double probe_speed;
	int32_t step, emergency_step;
	uint32_t axes, khz, slots, slot_time, activated, wanted_state, misc;
	uint32_t override, override_wanted, enabled_mask, power_mask, relays, outputs;
	uint32_t home_mask, probe_mask, probe_status, backlash;
	bool apply, probed, emergency, emergency_not, emergency_out;
	bool relay[LEGACY_EXTERNAL], output[LEGACY_EXTERNAL];
};

struct legacy_engine_settings {
	param_u32 axes, generator, charge_pump;
	param_u32 emergency_pin, emergency_invert, emergency_out_pin, probe_pin, probe_invert;
	param_bit swap, extended;
};

/* Where a dead name that works now would change a running machine: legacy.* */
struct legacy_choices {
	param_bit axis_enable, emergency_unset, emergency_lost, emergency_out, adcout;
	param_bit limit_override, ponet_out, whole_scale, pressed_key, key_brightness;
	param_bit encoder_factor, old_switches, old_emergency;
};

struct value_legacy {
	struct legacy_connection connection;
	struct legacy_clock clock;
	struct legacy_encoder encoder[LEGACY_ENCODERS];
	struct legacy_encoder_unused encoder_unused[LEGACY_ENCODERS - POKEYS_ENCODERS];
	struct legacy_encoder_settings encoder_set[LEGACY_ENCODERS];
	struct legacy_fast_encoders fast_set;
	int32_t encoder_step;
	uint32_t digin_step, adcout_step;
	struct legacy_poextbus poextbus;
	struct legacy_adcout adcout[POKEYS_PWM];
	param_u32 pwm_period;
	struct legacy_adcin adcin[POKEYS_ANALOG];
	struct legacy_pin_settings pin_set;
	struct legacy_ponet ponet;
	struct legacy_axis axis[POKEYS_AXES];
	struct legacy_axis_settings axis_set[POKEYS_AXES];
	struct legacy_engine engine;
	struct legacy_engine_settings engine_set;
	struct legacy_choices choice;
};

#endif
