/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * All values of one device's HAL interface, as plain C.
 *
 * The exchange (exchange.h) works on this struct alone and knows nothing of
 * HAL; binding.h copies between it and the pins. It stands in HAL's shared
 * memory, because a HAL parameter *is* its storage: the members marked
 * `param_` are the parameters themselves and may change at any moment by
 * somebody else's hand, so they are volatile and read once per use.
 *
 * Each member is made a pin or a parameter by a row of table.c; the member's
 * C type is the HAL type (bool = bit, double = float, int32_t = s32,
 * uint32_t = u32).
 */
#ifndef HALBRIDGE_VALUES_H
#define HALBRIDGE_VALUES_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/state.h>

typedef volatile double param_float;
typedef volatile int32_t param_s32;
typedef volatile uint32_t param_u32;

struct value_info {
	uint32_t pins, pwm, basic_encoders, encoders, fast_encoders, ultra_fast_encoders;
	uint32_t pwm_hz, analog_inputs, key_mapping, triggered_key_mapping, key_repeat_delay;
	uint32_t digital_counters, joystick_button_axis, joystick_analog_digital, macros;
	uint32_t matrix_keyboard, matrix_triggered_mapping, lcd, matrix_led, connection_signal;
	uint32_t poextbus, ponet, analog_filtering, init_outputs, i2c, one_wire;
	uint32_t additional_options, load_status, custom_name, potlog27, sensor_list;
	uint32_t web_interface, failsafe, joystick_hat, pulse_engine, pulse_engine_v2;
	uint32_t easy_sensors;
	param_u32 serial, type_id;
};

struct value_pin {
	bool in, in_not, out;
};

struct value_analog {
	double value;
	uint32_t raw;
	param_float scale, offset;
};

struct value_encoder {
	double position, velocity;
	int32_t count;
	bool reset, index_enable;
	param_float scale;
};

struct value_joint {
	double pos_cmd, vel_cmd, pos_fb;
	uint32_t state;
	bool enable, enabled, in_position, homed, error;
	bool limit_neg, limit_pos, soft_limit, home_switch, refused;
	param_float scale;
};

struct values {
	/* connection */
	double age_us, rtt_us, rtt_avg_us, rtt_max_us, rtt_jitter_us;
	uint32_t attach_state, link_state, fault, fault_count, cycle, reconnects;
	int32_t packet_error_level;
	uint32_t packet_error_total;
	bool connected, stale, daemon_alive;
	bool packet_error, packet_error_exceeded;
	param_s32 packet_error_limit, packet_error_increment, packet_error_decrement;

	/* commands */
	uint32_t command_refused_count, input_refused_count, one_shot_failed_count;
	bool commander, command_refused, input_refused, one_shot_full;
	bool machine_is_on, machine_on_permitted, needs_edge, safe_state;

	/* pulse engine as a whole */
	uint32_t engine_state;
	bool emergency;

	param_u32 device_serial;
	struct value_info info;
	struct value_pin pin[POKEYS_PINS];
	struct value_analog analog[POKEYS_ANALOG];
	struct value_encoder encoder[POKEYS_ENCODERS];
	struct value_joint joint[POKEYS_AXES];
};

#endif
