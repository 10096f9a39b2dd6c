/* SPDX-License-Identifier: MIT */
/*
 * Where the fields of wire/pulse.h stand in the packet: protocol section
 * 3.24.
 *
 * The status has limit + before limit -, the raw inputs of 0x08 have limit -
 * first: both orders are right as they stand (section 6, D8). The end of the
 * axis block is unaligned, and the answer to a fill is the status with the
 * number of taken slots where the sub-command would be.
 */

#include "wire/pulse.h"
#include "wire/layout.h"

WIRE_LAYOUT(pulse_status_req,
	WIRE_F(pulse_status_req, check, 3));

#define STATUS(tag, m) \
	WIRE_F(tag, m soft_limits, 3), \
	WIRE_F(tag, m power_states, 4), \
	WIRE_F(tag, m limit_override, 5), \
	WIRE_F(tag, m axes_enabled, 8), \
	WIRE_F(tag, m activated, 9), \
	WIRE_F(tag, m engine_state, 10), \
	WIRE_F(tag, m charge_pump, 11), \
	WIRE_F(tag, m limit_pos, 12), \
	WIRE_F(tag, m limit_neg, 13), \
	WIRE_F(tag, m home, 14), \
	WIRE_F(tag, m generator, 15), \
	WIRE_F(tag, m axis_state, 16), \
	WIRE_F(tag, m position, 24), \
	WIRE_F(tag, m axes_supported, 56), \
	WIRE_F(tag, m max_khz, 57), \
	WIRE_F(tag, m buffer_slots, 58), \
	WIRE_F(tag, m slot_time, 59), \
	WIRE_F(tag, m emergency_invert, 60), \
	WIRE_F(tag, m driver_error, 61), \
	WIRE_F(tag, m misc_inputs, 62), \
	WIRE_F(tag, m check, 63)

WIRE_LAYOUT(pulse_status_rep,
	STATUS(pulse_status_rep,));

WIRE_LAYOUT(pulse_result_rep,
	WIRE_F(pulse_result_rep, result, 3));

WIRE_LAYOUT(pulse_setup_req,
	WIRE_F(pulse_setup_req, axes, 8),
	WIRE_F(pulse_setup_req, charge_pump, 9),
	WIRE_F(pulse_setup_req, generator, 10),
	WIRE_F(pulse_setup_req, buffer_slots, 11),
	WIRE_F(pulse_setup_req, emergency_invert, 12),
	WIRE_F(pulse_setup_req, power_states, 13));

WIRE_LAYOUT(pulse_state_req,
	WIRE_F(pulse_state_req, state, 3),
	WIRE_F(pulse_state_req, limit_override, 4),
	WIRE_F(pulse_state_req, enable_mask, 5));

WIRE_LAYOUT(pulse_positions_req,
	WIRE_F(pulse_positions_req, mask, 3),
	WIRE_F(pulse_positions_req, position, 8));

WIRE_LAYOUT(pulse_outputs_req,
	WIRE_F(pulse_outputs_req, relays, 3),
	WIRE_F(pulse_outputs_req, oc, 4),
	WIRE_F(pulse_outputs_req, read_only, 5));
WIRE_LAYOUT(pulse_outputs_rep,
	WIRE_F(pulse_outputs_rep, relays, 3),
	WIRE_F(pulse_outputs_rep, oc, 4));

WIRE_LAYOUT(pulse_emergency_req,
	WIRE_F(pulse_emergency_req, write, 3),
	WIRE_F(pulse_emergency_req, read_mark, 5),
	WIRE_F(pulse_emergency_req, pin, 8));
WIRE_LAYOUT(pulse_emergency_rep,
	WIRE_F(pulse_emergency_rep, pin, 8));

WIRE_LAYOUT(pulse_status2_rep,
	WIRE_F(pulse_status2_rep, limit_neg, 8),
	WIRE_F(pulse_status2_rep, limit_pos, 9),
	WIRE_F(pulse_status2_rep, home, 10),
	WIRE_F(pulse_status2_rep, check, 63));

WIRE_LAYOUT(pulse_sync_pwm_req,
	WIRE_F(pulse_sync_pwm_req, option, 3),
	WIRE_F(pulse_sync_pwm_req, axis, 4),
	WIRE_F(pulse_sync_pwm_req, channel, 5));
WIRE_LAYOUT(pulse_sync_outputs_req,
	WIRE_F(pulse_sync_outputs_req, option, 3),
	WIRE_F(pulse_sync_outputs_req, axis, 4),
	WIRE_F(pulse_sync_outputs_req, pin, 8));

#define AXIS_CONFIG(tag) \
	WIRE_F(tag, config.options, 8), \
	WIRE_F(tag, config.switches, 9), \
	WIRE_F(tag, config.pin_home, 10), \
	WIRE_F(tag, config.pin_limit_n, 11), \
	WIRE_F(tag, config.pin_limit_p, 12), \
	WIRE_F(tag, config.homing_speed, 13), \
	WIRE_F(tag, config.homing_return, 14), \
	WIRE_F(tag, config.mpg_encoder, 15), \
	WIRE_F(tag, config.max_speed, 16), \
	WIRE_F(tag, config.max_accel, 20), \
	WIRE_F(tag, config.max_decel, 24), \
	WIRE_F(tag, config.soft_min, 28), \
	WIRE_F(tag, config.soft_max, 32), \
	WIRE_F(tag, config.mpg_multiplier, 36), \
	WIRE_F(tag, config.pin_enable, 38), \
	WIRE_F(tag, config.invert_enable, 39), \
	WIRE_F(tag, config.filter_limit_n, 40), \
	WIRE_F(tag, config.filter_limit_p, 41), \
	WIRE_F(tag, config.filter_home, 42), \
	WIRE_F(tag, config.homing_algorithm, 43), \
	WIRE_F(tag, config.mpg_1x, 44), \
	WIRE_F(tag, config.back_off, 45), \
	WIRE_F(tag, config.mpg_divider, 49), \
	WIRE_F(tag, config.signals, 51), \
	WIRE_F(tag, config.filter_probe, 52), \
	WIRE_F(tag, config.reserved, 53)

WIRE_LAYOUT(pulse_axis_get_req,
	WIRE_F(pulse_axis_get_req, axis, 3));
WIRE_LAYOUT(pulse_axis_get_rep,
	AXIS_CONFIG(pulse_axis_get_rep));
WIRE_LAYOUT(pulse_axis_set_req,
	WIRE_F(pulse_axis_set_req, axis, 3),
	AXIS_CONFIG(pulse_axis_set_req));

WIRE_LAYOUT(pulse_drivers,
	WIRE_EACH(pulse_drivers, driver, step, 8, 2),
	WIRE_EACH(pulse_drivers, driver, current, 9, 2));

WIRE_LAYOUT(pulse_move_req,
	WIRE_F(pulse_move_req, reference, 8));
WIRE_LAYOUT(pulse_move_pv_req,
	WIRE_F(pulse_move_pv_req, mask, 3),
	WIRE_F(pulse_move_pv_req, position, 8),
	WIRE_F(pulse_move_pv_req, velocity, 40));

WIRE_LAYOUT(pulse_home_start_req,
	WIRE_F(pulse_home_start_req, mask, 3),
	WIRE_F(pulse_home_start_req, offset, 8));
WIRE_LAYOUT(pulse_home_finish_req,
	WIRE_F(pulse_home_finish_req, state, 3),
	WIRE_F(pulse_home_finish_req, keep_state, 4));

WIRE_LAYOUT(pulse_probe_start_req,
	WIRE_F(pulse_probe_start_req, mask, 3),
	WIRE_F(pulse_probe_start_req, hybrid, 4),
	WIRE_F(pulse_probe_start_req, limit, 8),
	WIRE_F(pulse_probe_start_req, speed, 40),
	WIRE_F(pulse_probe_start_req, input, 44),
	WIRE_F(pulse_probe_start_req, polarity, 45));
WIRE_LAYOUT(pulse_probe_finish_req,
	WIRE_F(pulse_probe_finish_req, keep_state, 3));
WIRE_LAYOUT(pulse_probe_finish_rep,
	WIRE_F(pulse_probe_finish_rep, position, 8),
	WIRE_F(pulse_probe_finish_rep, status, 40));

WIRE_LAYOUT(thread_status_rep,
	WIRE_F(thread_status_rep, preparing, 8),
	WIRE_F(thread_status_rep, prepared, 9),
	WIRE_F(thread_status_rep, waiting, 10),
	WIRE_F(thread_status_rep, active, 11),
	WIRE_F(thread_status_rep, velocity, 12),
	WIRE_F(thread_status_rep, position_error, 16),
	WIRE_F(thread_status_rep, rpm, 20),
	WIRE_F(thread_status_rep, ignore_axes, 24),
	WIRE_F(thread_status_rep, index_count, 25),
	WIRE_F(thread_status_rep, debug, 29));
WIRE_LAYOUT(thread_params_req,
	WIRE_F(thread_params_req, mode, 8),
	WIRE_F(thread_params_req, ticks, 12),
	WIRE_F(thread_params_req, target_rpm, 14),
	WIRE_F(thread_params_req, speed_gain, 16),
	WIRE_F(thread_params_req, position_gain, 18),
	WIRE_F(thread_params_req, ignore_axes, 20));

WIRE_LAYOUT(pulse_backlash_set_req,
	WIRE_F(pulse_backlash_set_req, enable, 3),
	WIRE_F(pulse_backlash_set_req, max_speed, 4),
	WIRE_EACH(pulse_backlash_set_req, axis, half_width, 8, 4),
	WIRE_EACH(pulse_backlash_set_req, axis, accel, 10, 4),
	WIRE_EACH(pulse_backlash_set_req, axis, reserved, 11, 4));
WIRE_LAYOUT(pulse_backlash_rep,
	WIRE_F(pulse_backlash_rep, enable, 3),
	WIRE_F(pulse_backlash_rep, max_speed, 4),
	WIRE_EACH(pulse_backlash_rep, axis, half_width, 8, 4),
	WIRE_EACH(pulse_backlash_rep, axis, accel, 10, 4),
	WIRE_EACH(pulse_backlash_rep, axis, reserved, 11, 4),
	WIRE_F(pulse_backlash_rep, compensation, 40));

WIRE_LAYOUT(postep_comm_req,
	WIRE_F(postep_comm_req, option, 3),
	WIRE_F(postep_comm_req, enable, 4),
	WIRE_EACH(postep_comm_req, axis, type, 8, 3),
	WIRE_EACH(postep_comm_req, axis, address, 9, 3),
	WIRE_EACH(postep_comm_req, axis, update, 10, 3));
WIRE_LAYOUT(postep_status_rep,
	WIRE_EACH(postep_status_rep, axis, supply, 8, 6),
	WIRE_EACH(postep_status_rep, axis, temperature, 9, 6),
	WIRE_EACH(postep_status_rep, axis, inputs, 10, 6),
	WIRE_EACH(postep_status_rep, axis, state, 11, 6),
	WIRE_EACH(postep_status_rep, axis, faults, 12, 6),
	WIRE_EACH(postep_status_rep, axis, updates, 13, 6));
WIRE_LAYOUT(postep_currents_req,
	WIRE_F(postep_currents_req, option, 3),
	WIRE_EACH(postep_currents_req, axis, full_scale, 8, 6),
	WIRE_EACH(postep_currents_req, axis, idle, 10, 6),
	WIRE_EACH(postep_currents_req, axis, overheat, 12, 6));
WIRE_LAYOUT(postep_modes_req,
	WIRE_F(postep_modes_req, option, 3),
	WIRE_EACH(postep_modes_req, axis, mode, 8, 6),
	WIRE_EACH(postep_modes_req, axis, step, 9, 6),
	WIRE_EACH(postep_modes_req, axis, temperature, 10, 6),
	WIRE_EACH(postep_modes_req, axis, reserved, 11, 6));
WIRE_LAYOUT(postep_versions_rep,
	WIRE_EACH(postep_versions_rep, axis, hw_major, 8, 6),
	WIRE_EACH(postep_versions_rep, axis, hw_minor, 9, 6),
	WIRE_EACH(postep_versions_rep, axis, fw_major, 10, 6),
	WIRE_EACH(postep_versions_rep, axis, fw_minor, 11, 6));

WIRE_LAYOUT(smart_config,
	WIRE_F(smart_config, pulse_width, 8),
	WIRE_F(smart_config, spindle_period, 16),
	WIRE_F(smart_config, encoder_config, 20),
	WIRE_F(smart_config, count_mode, 21),
	WIRE_F(smart_config, step_period, 22),
	WIRE_F(smart_config, axes, 24),
	WIRE_F(smart_config, probe_config, 25),
	WIRE_F(smart_config, filter, 26),
	WIRE_F(smart_config, step_gpio, 28),
	WIRE_F(smart_config, dir_gpio, 29),
	WIRE_F(smart_config, step_pwm, 30),
	WIRE_F(smart_config, step_multiplier, 31),
	WIRE_F(smart_config, encoder_multiplier, 39),
	WIRE_F(smart_config, max_mismatch, 47));
WIRE_LAYOUT(smart_reset_req,
	WIRE_F(smart_reset_req, axes, 3));
WIRE_LAYOUT(smart_status_rep,
	WIRE_F(smart_status_rep, mismatch_axes, 8),
	WIRE_F(smart_status_rep, spindle_period, 9),
	WIRE_F(smart_status_rep, inputs, 11),
	WIRE_F(smart_status_rep, mismatch, 12),
	WIRE_F(smart_status_rep, position, 28));
WIRE_LAYOUT(smart_encoders_rep,
	WIRE_F(smart_encoders_rep, value, 8));

WIRE_LAYOUT(pulse_fill_req,
	WIRE_F(pulse_fill_req, slots, 3),
	WIRE_F(pulse_fill_req, axes, 4),
	WIRE_F(pulse_fill_req, data, 8));
WIRE_LAYOUT(pulse_fill_rep,
	WIRE_F(pulse_fill_rep, accepted, 2),
	STATUS(pulse_fill_rep, status.));
WIRE_LAYOUT(pulse_fill_part_req,
	WIRE_F(pulse_fill_part_req, part, 2),
	WIRE_F(pulse_fill_part_req, width, 3),
	WIRE_F(pulse_fill_part_req, slots, 4),
	WIRE_F(pulse_fill_part_req, axes, 5),
	WIRE_F(pulse_fill_part_req, data, 8));
