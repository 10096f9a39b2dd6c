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
 * Each member is made a pin or a parameter by a row of a table_*.c; the
 * member's C type is the HAL type (bool = bit, double = float, int32_t = s32,
 * uint32_t = u32). Where every bit of an image has a pin, the members are
 * arrays of bool, padded to 8 bytes, so that eight move at once (bits.h).
 *
 * The struct is a row of blocks (enum values_block, blocks.c): OUT pins are
 * written when their block was marked with values_changed().
 */
#ifndef HALBRIDGE_VALUES_H
#define HALBRIDGE_VALUES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <pokeys/state.h>
#include "halbridge/values_legacy.h"
#include "halbridge/values_settings.h"

enum {
	VALUES_PINS = 56,    /* 55, padded */
	VALUES_EXTERNAL = 8, /* external outputs, relays */
	VALUES_BUS_BITS = 8 * POKEYS_POEXTBUS,
	VALUES_KEYS = 48, /* of a kbd48CNC */
	VALUES_MATRIX = 8 * POKEYS_MATRIX_BYTES,
	VALUES_PONET_WORDS = 4, /* of a module's 16 bytes, 32 bits each */
	/* bytes of struct values that are marked or compared at once */
	VALUES_CHUNK = 32,
	VALUES_TOUCHED = 9, /* words with a bit for each chunk */
};

struct value_info {
	uint32_t pins, pwm, basic_encoders, encoders, fast_encoders, ultra_fast_encoders;
	uint32_t pwm_hz, analog_inputs, key_mapping, triggered_key_mapping, key_repeat_delay;
	uint32_t digital_counters, joystick_button_axis, joystick_analog_digital, macros;
	uint32_t matrix_keyboard, matrix_triggered_mapping, lcd, matrix_led, connection_signal;
	uint32_t poextbus, ponet, analog_filtering, init_outputs, i2c, one_wire;
	uint32_t additional_options, load_status, custom_name, potlog27, sensor_list;
	uint32_t web_interface, failsafe, joystick_hat, pulse_engine, pulse_engine_v2;
	uint32_t easy_sensors, axes, axis_khz;
	uint32_t firmware_major, firmware_minor, firmware_revision, user_id, options;
	param_u32 serial, type_id;
};

struct value_rtc {
	uint32_t second, minute, hour, day_of_week, day, month, year, day_of_year;
	uint32_t set_second, set_minute, set_hour, set_day, set_month, set_year;
	uint32_t set_outcome;
	bool set;
};

struct value_pins {
	bool in[VALUES_PINS], in_not[VALUES_PINS], out_fb[VALUES_PINS], out[VALUES_PINS];
	param_bit out_invert[VALUES_PINS];
};

struct value_analog {
	double value;
	uint32_t raw;
	param_float scale, offset;
};

struct value_counters {
	uint32_t value[POKEYS_PINS];
	bool reset;
};

struct value_pwm {
	double value, duty;
	bool enable, enabled;
	param_float scale, offset, min_dc, max_dc;
};

struct value_encoder {
	double position, velocity;
	int32_t count, set_value;
	bool reset, index_enable, enabled, set, count_lost;
	param_float scale;
};

struct value_joint {
	double pos_cmd, vel_cmd, pos_fb, following_error, probe_pos, probe_target;
	uint32_t state;
	bool enable, enabled, in_position, homed, error;
	bool limit_neg, limit_pos, soft_limit, home_switch, refused;
	bool limit_neg_dedicated, limit_pos_dedicated, home_dedicated, probed;
	bool home, homing, motion_homed, position_lost;
	param_u32 home_group;
	param_float scale, home_offset;
};

/* The pulse engine as a whole. */
struct value_engine {
	uint32_t state, axes_enabled, charge_pump, generator, power_states, probe_status;
	uint32_t buffer_slots, buffer_level, buffer_underruns, buffer_resyncs, slot_us;
	bool emergency, emergency_not, activated, limit_override_active;
	bool limit_override, clear_fault, mpg_jog;
	param_bit dry_loses;
	bool misc_in[8], misc_in_not[8];
};

/* What the device does by itself: all joints' homing, and probing. */
struct value_homing {
	uint32_t phase, error;
	bool active, cancel;
	param_float time_limit;
};

struct value_probe {
	uint32_t error;
	bool start, cancel, active, done, contact;
	param_bit hybrid, active_high;
	param_u32 terminal, engine_input, axes;
	param_float speed, time_limit;
};

/* What the device's threading says. */
struct value_threading_out {
	int32_t velocity, position_error;
	uint32_t spindle_rpm, index_count, behind, reason, error;
	bool preparing, prepared, waiting, active, refused;
};

struct value_threading {
	struct value_threading_out out;
	bool prepare, force, arm, release, cancel;
	param_float time_limit;
};

/* Bits of the external outputs and relays of the pulse engine's connector. */
struct value_external {
	bool output_fb[VALUES_EXTERNAL], relay_fb[VALUES_EXTERNAL];
	bool output[VALUES_EXTERNAL], relay[VALUES_EXTERNAL];
};

struct value_poextbus {
	bool in[VALUES_BUS_BITS], in_not[VALUES_BUS_BITS], out[VALUES_BUS_BITS];
	param_bit out_invert[VALUES_BUS_BITS];
};

struct value_matrix {
	bool key[VALUES_MATRIX];
	bool enabled;
};

struct value_kbd48 {
	bool button[VALUES_KEYS], led[VALUES_KEYS];
	uint32_t module, light, brightness_sent;
	bool present;
	param_bit auto_brightness;
	param_s32 brightness;
};

struct value_ponet_module {
	uint32_t type, address, size, options, status, light, version, failures;
	uint32_t in[VALUES_PONET_WORDS], out[VALUES_PONET_WORDS];
	bool present;
	param_s32 brightness;
};

struct value_ponet {
	uint32_t state, count;
	struct value_ponet_module module[POKEYS_PONET];
};

/* A PoStep motor driver. */
struct value_postep {
	double supply, age_ms;
	uint32_t temperature, state, faults, inputs, updates;
	uint32_t full_scale, idle, overheat, hardware, firmware;
	bool fault;
};

struct value_drive {
	struct value_postep postep[POKEYS_AXES];
	int32_t backlash[POKEYS_AXES];
};

enum { VALUES_HEATER_GAINS = POKEYS_GAIN_D + 1 };

/* A heater that the daemon controls. */
struct value_heater {
	double temperature, target_in_effect, power, target;
	uint32_t fault_code, condition, refused;
	bool at_temperature, fault, reset;
	double gain[VALUES_HEATER_GAINS]; /* enum pokeys_gain; parameters */
};

/* A servo motor that the daemon controls. */
struct value_servo {
	double pos_cmd, vel_cmd, pos_fb, vel_fb, error, output;
	uint32_t fault_code, condition, refused, home_end;
	bool enable, reset, home, enabled, fault, homed, homing, limit_minus, limit_plus;
	double gain[POKEYS_GAINS]; /* parameters */
};

struct value_latency {
	double p99_us, max_us;
};

/* How the driver itself does. */
struct value_diagnostics {
	double rate_hz[POKEYS_SLOW_GROUPS];
	double deadline_us, device_tick_s;
	struct value_latency wakeup, round_trip, data, age;
	uint32_t sent, resent, received, late, lost, timed_out, stray, duplicate, stale_reply,
		corrupt;
	uint32_t wrong_source, send_failed, cycles_late, in_flight, encoder_resyncs;
	uint32_t load, access, failsafe_state;
	uint32_t config_state, config_refused, config_refused_index;
	uint32_t config_generation, config_generation_applied, config_input_refused;
	uint32_t config_foreign;
	uint32_t cycles_skipped;
	bool locked, realtime, fallback, guard, config_save;
};

/* Blocks of struct values, in its order. */
enum values_block {
	BLOCK_LINK,
	BLOCK_MACHINE,
	BLOCK_ENGINE,
	BLOCK_INFO,
	BLOCK_RTC,
	BLOCK_PIN,
	BLOCK_ANALOG,
	BLOCK_COUNTER,
	BLOCK_PWM,
	BLOCK_ENCODER,
	BLOCK_JOINT,
	BLOCK_EXTERNAL,
	BLOCK_POEXTBUS,
	BLOCK_MATRIX,
	BLOCK_KBD48,
	BLOCK_PONET,
	BLOCK_DRIVE,
	BLOCK_HEATER,
	BLOCK_SERVO,
	BLOCK_DIAGNOSTICS,
	BLOCK_SETTINGS,
	BLOCK_LEGACY_LINK,
	BLOCK_LEGACY_ENCODER,
	BLOCK_LEGACY_IO,
	BLOCK_LEGACY_PONET,
	BLOCK_LEGACY_AXIS,
	BLOCK_LEGACY_ENGINE,
	VALUES_BLOCKS,
};

#define VALUES_ALL	((UINT32_C(1) << VALUES_BLOCKS) - 1)	/* every block */

struct values {
	/* connection */
	double age_us, rtt_us, rtt_avg_us, rtt_max_us, rtt_jitter_us, phase_error_us;
	uint32_t attach_state, link_state, fault, fault_count, cycle, reconnects;
	int32_t packet_error_level;
	uint32_t packet_error_total;
	bool connected, stale, daemon_alive, phase_locked;
	bool packet_error, packet_error_exceeded;
	param_s32 packet_error_limit, packet_error_increment, packet_error_decrement;
	param_float read_time_max, write_time_max, time_threshold; /* us */
	uint32_t time_exceeded_count;

	/* commands */
	uint32_t command_refused_count, input_refused_count, one_shot_failed_count;
	bool commander, command_refused, input_refused, one_shot_full, read_missing;
	uint32_t error_code, error_count;
	bool error_active, emergency_stop;
	int32_t motion_type;
	bool machine_is_on, machine_on_permitted, needs_edge, outputs_held, safe_state;
	bool position_lost, unhome, encoder_count_lost;
	param_bit encoder_keep_count;

	struct value_engine engine;
	struct value_homing homing;
	struct value_probe probe;
	struct value_threading threading;
	param_u32 device_serial;
	struct value_info info;
	struct value_rtc rtc;
	struct value_pins pin;
	struct value_analog analog[POKEYS_ANALOG];
	struct value_counters counter;
	struct value_pwm pwm[POKEYS_PWM];
	struct value_encoder encoder[POKEYS_ENCODERS];
	struct value_joint joint[POKEYS_AXES];
	struct value_external external;
	struct value_poextbus poextbus;
	struct value_matrix matrix;
	struct value_kbd48 kbd48;
	struct value_ponet ponet;
	struct value_drive drive;
	struct value_heater heater[POKEYS_HEATERS];
	struct value_servo servo[POKEYS_SERVOS];
	struct value_diagnostics diagnostics;
	struct value_settings set;
	struct value_legacy legacy;
	uint32_t changed;                 /* bit = enum values_block; no pin */
	uint64_t touched[VALUES_TOUCHED]; /* bit = chunk; no pin */
	uint64_t beyond[4];               /* the binding compares a chunk at once */
};

/* The OUT pins of this block have to be written. Realtime. */
static inline void values_changed(struct values *values, enum values_block block)
{
	values->changed |= UINT32_C(1) << block;
}

/*
 * The OUT pins of these bytes have to be written: for one of many of a kind, where the
 * others stand still. Realtime.
 */
static inline void values_touched(struct values *values, size_t offset, size_t size)
{
	for (size_t at = offset / VALUES_CHUNK; at <= (offset + size - 1) / VALUES_CHUNK; at++)
		values->touched[at / 64] |= UINT64_C(1) << at % 64;
}

/* The block a member belongs to, by its offset in struct values. */
enum values_block values_block_of(size_t offset);

/* Where a block begins and ends, bytes. */
size_t values_block_begin(enum values_block block);
size_t values_block_end(enum values_block block);

#endif
