/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The members of the images, as the C compiler lays them out, and the text
 * that state.h makes the hashes of.
 *
 * The lists are written out because C cannot list the members of a struct. A
 * member that is forgotten here leaves a hole, and layout_gapless() finds it.
 */
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include "tests/shm/layout_text.h"

struct member {
	const char *name;
	size_t offset, size;
	const struct member *nested;
};

#define M(member)		{ #member, offsetof(OF, member), sizeof(((OF *)0)->member), NULL }
#define NESTED(member, list)	{ #member, offsetof(OF, member), sizeof(((OF *)0)->member), list }
#define END			{ NULL, 0, 0, NULL }

/* clang-format off: lists in the order of their structs, several to a line */
#define OF struct pokeys_identity
static const struct member identity_members[] = { M(serial),         M(address),
						  M(hardware),       M(firmware_major),
						  M(firmware_minor), M(firmware_revision),
						  M(user_id),        M(locked),
						  M(load),           M(options),
						  M(name),           M(type),
						  M(build),          END };
#undef OF

#define OF struct pokeys_capability
static const struct member capability_members[] = { M(pins),
						    M(pwm),
						    M(basic_encoders),
						    M(encoders),
						    M(fast_encoders),
						    M(ultra_fast_encoders),
						    M(analog_inputs),
						    M(digital_counters),
						    M(matrix_keyboard),
						    M(lcd),
						    M(matrix_led),
						    M(poextbus),
						    M(ponet),
						    M(i2c),
						    M(one_wire),
						    M(easy_sensors),
						    M(pulse_engine),
						    M(failsafe),
						    M(axes),
						    M(axis_khz),
						    M(key_mapping),
						    M(triggered_key_mapping),
						    M(key_repeat_delay),
						    M(joystick),
						    M(macros),
						    M(analog_filtering),
						    M(init_outputs),
						    M(connection_signal),
						    M(web_interface),
						    M(additional_options),
						    M(load_status),
						    M(custom_name),
						    M(sensor_list),
						    M(potlog27),
						    M(reserved),
						    M(pwm_hz),
						    M(reserved2),
						    M(digital_in),
						    M(digital_out),
						    M(analog_in),
						    M(counter),
						    M(pwm_pins),
						    END };
#undef OF

#define OF struct pokeys_axis
static const struct member axis_members[] = { M(position),
					      M(reference),
					      M(state),
					      M(enabled),
					      M(mode),
					      M(position_epoch),
					      M(limit_minus),
					      M(limit_plus),
					      M(home),
					      M(error),
					      M(soft_limit),
					      M(in_position),
					      M(homed),
					      M(parked),
					      M(following_error),
					      M(delayed),
					      M(reserved),
					      M(t_reference_ns),
					      M(probe),
					      M(max_speed),
					      M(max_acceleration),
					      M(soft_minimum),
					      M(soft_maximum),
					      M(pulses_per_unit),
					      M(name),
					      END };
#undef OF

#define OF struct pokeys_engine
static const struct member engine_members[] = { M(state),
						M(axes_enabled),
						M(activated),
						M(limit_override),
						M(emergency),
						M(charge_pump),
						M(generator),
						M(misc_inputs),
						M(relays),
						M(outputs),
						M(buffer_slots),
						M(buffer_level),
						M(power_states),
						M(probe_status),
						M(slot_time),
						M(emergency_invert),
						M(emergency_pin),
						M(dedicated_limit_minus),
						M(dedicated_limit_plus),
						M(dedicated_home),
						M(limit_minus),
						M(limit_plus),
						M(home),
						M(stops),
						M(task),
						M(task_phase),
						M(task_result),
						M(task_axes),
						M(task_count),
						M(buffer_underruns),
						M(buffer_resyncs),
						NESTED(axis, axis_members),
						END };
#undef OF

#define OF struct pokeys_threading
static const struct member threading_members[] = {
	M(preparing), M(prepared), M(waiting),        M(active),      M(ignore_axes), M(refused),
	M(behind),    M(velocity), M(position_error), M(spindle_rpm), M(index_count), END
};
#undef OF

#define OF struct pokeys_heater
static const struct member heater_members[] = { M(t_ns),
						M(temperature),
						M(target),
						M(power),
						M(minimum),
						M(maximum),
						M(target_maximum),
						M(p),
						M(i),
						M(d),
						M(tuned_p),
						M(tuned_i),
						M(tuned_d),
						M(fault_count),
						M(tune_cycles),
						M(state),
						M(fault),
						M(condition),
						M(refused),
						M(tuning),
						M(at_temperature),
						M(limited),
						M(fan),
						M(stops_machine),
						M(obstacle),
						M(name),
						END };
#undef OF

#define OF struct pokeys_moves
static const struct member moves_members[] = { M(taken),  M(feed),  M(speed),    M(waiting),
					       M(motors), M(state), M(end),      M(refused),
					       M(held),   M(axes),  M(reserved), END };
#undef OF

#define OF struct pokeys_servo
static const struct member servo_members[] = { M(t_ns),
					       M(position),
					       M(commanded),
					       M(counts_per_unit),
					       M(velocity),
					       M(commanded_velocity),
					       M(error),
					       M(output),
					       M(minimum),
					       M(maximum),
					       M(p),
					       M(i),
					       M(d),
					       M(velocity_gain),
					       M(acceleration_gain),
					       M(max_speed),
					       M(max_acceleration),
					       M(fault_count),
					       M(state),
					       M(fault),
					       M(condition),
					       M(refused),
					       M(homed),
					       M(low),
					       M(high),
					       M(encoder),
					       M(obstacle),
					       M(homing),
					       M(home_end),
					       M(home),
					       M(tuning),
					       M(tune_reason),
					       M(reserved),
					       M(tuned_p),
					       M(tuned_i),
					       M(tuned_d),
					       M(tuned_velocity_gain),
					       M(tuned_acceleration_gain),
					       M(tuned_acceleration),
					       M(name),
					       END };
#undef OF

#define OF struct pokeys_postep
static const struct member postep_members[] = { M(t_update_ns),
						M(update_count),
						M(supply),
						M(temperature),
						M(inputs),
						M(state),
						M(faults),
						M(updates),
						M(mode),
						M(step_mode),
						M(temperature_limit),
						M(hardware_major),
						M(hardware_minor),
						M(firmware_major),
						M(firmware_minor),
						M(reserved),
						M(full_scale),
						M(idle),
						M(overheat),
						END };
#undef OF

#define OF struct pokeys_rtc
static const struct member rtc_members[] = {
	M(year),        M(month),       M(day),     M(hour),     M(minute), M(second),
	M(day_of_week), M(day_of_year), M(unnamed), M(reserved), END
};
#undef OF

#define OF struct pokeys_ponet_module
static const struct member ponet_module_members[] = { M(type),    M(address),  M(size),
						      M(options), M(status),   M(light),
						      M(version), M(failures), M(data),
						      END };
#undef OF

#define OF struct pokeys_link_statistics
static const struct member link_statistics_members[] = { M(sent),
							 M(resent),
							 M(received),
							 M(accepted),
							 M(missed),
							 M(late),
							 M(lost),
							 M(timed_out),
							 M(stray),
							 M(duplicate),
							 M(stale),
							 M(corrupt),
							 M(wrong_source),
							 M(send_failed),
							 M(cycles_late),
							 M(reconnects),
							 M(rtt_last_ns),
							 M(rtt_smoothed_ns),
							 M(rtt_variation_ns),
							 M(rtt_min_ns),
							 M(rtt_max_ns),
							 M(deadline_ns),
							 M(in_flight),
							 M(packet_error_level),
							 M(refused_command),
							 M(one_shot_refused),
							 END };
#undef OF

#define OF struct pokeys_one_shot_result
static const struct member one_shot_result_members[] = { M(id), M(operation), M(outcome),
							 M(reserved), END };
#undef OF

#define OF struct pokeys_phase
static const struct member phase_members[] = { M(state),     M(master),    M(reserved),
					       M(losses),    M(error_ns),  M(lead_ns),
					       M(jitter_ns), M(period_ns), END };
#undef OF

#define OF struct pokeys_state
static const struct member state_members[] = { M(magic),
					       M(version),
					       M(size_units),
					       M(hash),
					       M(epoch),
					       M(cycle),
					       M(period_ns),
					       M(t_cycle_ns),
					       M(t_publish_ns),
					       M(t_digital_ns),
					       M(t_analog_ns),
					       M(t_encoder_ns),
					       M(t_motion_ns),
					       M(t_slow_ns),
					       M(t_analog_slow_ns),
					       M(stale_after_ns),
					       M(flags),
					       M(link),
					       M(fault),
					       M(access),
					       M(failsafe),
					       M(t_link_ns),
					       M(device_tick_ms),
					       M(fault_count),
					       NESTED(identity, identity_members),
					       NESTED(capability, capability_members),
					       M(digital_in),
					       M(digital_out),
					       M(digital_out_owned),
					       M(pin_function),
					       M(analog),
					       M(encoder),
					       M(encoder_enabled),
					       M(encoder_index),
					       M(encoder_t_ns),
					       M(encoder_resync),
					       M(counter),
					       M(pwm_period),
					       M(pwm_enabled),
					       M(pwm_duty),
					       NESTED(engine, engine_members),
					       M(matrix),
					       M(poextbus),
					       M(ponet_state),
					       M(ponet_count),
					       M(kbd48_module),
					       M(matrix_enabled),
					       M(reserved2),
					       M(kbd48_keys),
					       NESTED(ponet, ponet_module_members),
					       M(slow_millihertz),
					       NESTED(rtc, rtc_members),
					       M(one_shot_session),
					       M(one_shot_ack),
					       NESTED(one_shot, one_shot_result_members),
					       M(command_heartbeat),
					       M(command_t_ns),
					       M(config_generation),
					       M(config_state),
					       M(encoder_epoch),
					       M(reserved3),
					       M(report_count),
					       M(config_foreign),
					       NESTED(phase, phase_members),
					       M(t_postep_ns),
					       M(backlash),
					       NESTED(threading, threading_members),
					       NESTED(postep, postep_members),
					       NESTED(statistics, link_statistics_members),
					       NESTED(heater, heater_members),
					       NESTED(servo, servo_members),
					       NESTED(moves, moves_members),
					       END };
#undef OF

#define OF struct pokeys_histogram
static const struct member histogram_members[] = { M(count),  M(sum_ns), M(min_ns),
						   M(max_ns), M(bucket), END };
#undef OF

#define OF struct pokeys_diag
static const struct member diag_members[] = { M(magic),
					      M(version),
					      M(size_units),
					      M(hash),
					      M(epoch),
					      M(cycle),
					      M(t_publish_ns),
					      M(cycles_skipped),
					      M(events_dropped),
					      M(event_high_water),
					      M(transport_system_calls),
					      M(transport_waits_avoided),
					      M(transport_rearmed),
					      M(transport_no_buffers),
					      M(transport_overflow),
					      M(transport_truncated),
					      M(minor_faults),
					      M(major_faults),
					      M(guard_passed),
					      M(guard_dropped),
					      M(transport),
					      NESTED(wakeup, histogram_members),
					      NESTED(round_trip, histogram_members),
					      NESTED(fast_round_trip, histogram_members),
					      NESTED(read_round_trip, histogram_members),
					      NESTED(write_round_trip, histogram_members),
					      NESTED(one_shot_round_trip, histogram_members),
					      NESTED(receive, histogram_members),
					      NESTED(fresh, histogram_members),
					      NESTED(publish, histogram_members),
					      NESTED(cycle_work, histogram_members),
					      NESTED(age_at_read, histogram_members),
					      END };
#undef OF

#define OF struct pokeys_axis_command
static const struct member axis_command_members[] = { M(position), M(velocity), M(mode),
						      M(enable),   M(reserved), END };
#undef OF

#define OF struct pokeys_servo_command
static const struct member servo_command_members[] = { M(position), M(velocity), M(enable),
						       M(reserved), END };
#undef OF

#define OF struct pokeys_one_shot
static const struct member one_shot_members[] = { M(id),        M(operation), M(index),
						  M(mask),      M(flags),     M(value),
						  M(parameter), M(fraction),  END };
#undef OF

#define OF struct pokeys_command
static const struct member command_members[] = { M(magic),
						 M(version),
						 M(size_units),
						 M(hash),
						 M(heartbeat),
						 M(t_ns),
						 M(t_thread_ns),
						 M(period_ns),
						 M(session),
						 M(flags),
						 M(read_age_ns),
						 M(digital_out),
						 M(digital_out_mask),
						 M(pwm_duty),
						 M(pwm_period),
						 M(pwm_enable),
						 M(poextbus),
						 M(poextbus_mask),
						 M(external_outputs),
						 M(external_outputs_mask),
						 M(relays),
						 M(relays_mask),
						 M(reserved),
						 M(ponet_data),
						 M(ponet_brightness),
						 M(ponet_mask),
						 M(kbd48_flags),
						 M(kbd48_brightness),
						 M(reserved3),
						 M(kbd48_leds),
						 NESTED(axis, axis_command_members),
						 M(heater_target),
						 M(heater_mask),
						 NESTED(servo, servo_command_members),
						 M(one_shot_head),
						 M(reserved2),
						 NESTED(one_shot, one_shot_members),
						 END };
#undef OF

#define OF struct pokeys_axis_settings
static const struct member axis_settings_members[] = { M(set),
						       M(options),
						       M(options_mask),
						       M(switches),
						       M(switches_mask),
						       M(pin_limit_minus),
						       M(pin_limit_plus),
						       M(pin_home),
						       M(pin_enable),
						       M(invert_enable),
						       M(filter_limit_minus),
						       M(filter_limit_plus),
						       M(filter_home),
						       M(filter_probe),
						       M(homing_algorithm),
						       M(homing_speed),
						       M(homing_return),
						       M(mpg_encoder),
						       M(signals),
						       M(mpg_multiplier),
						       M(mpg_divider),
						       M(backlash_half),
						       M(soft_minimum),
						       M(soft_maximum),
						       M(back_off),
						       M(max_speed),
						       M(max_acceleration),
						       M(max_deceleration),
						       M(backlash_acceleration),
						       M(postep_type),
						       M(postep_address),
						       M(postep_step),
						       M(postep_temperature),
						       M(reserved),
						       END };
#undef OF

#define OF struct pokeys_encoder_settings
static const struct member encoder_settings_members[] = { M(options), M(options_mask), M(pins_set),
							  M(pin_a),   M(pin_b),        M(reserved),
							  END };
#undef OF

#define OF struct pokeys_settings
static const struct member settings_members[] = { M(set),
						  M(pwm_period),
						  M(pin_set),
						  M(pin_function),
						  NESTED(encoder, encoder_settings_members),
						  M(fast_configuration),
						  M(fast_options),
						  M(ultra_enable),
						  M(ultra_options),
						  M(ultra_filter),
						  M(axes),
						  M(charge_pump),
						  M(generator),
						  M(emergency_invert),
						  M(emergency_pin),
						  M(power_states),
						  M(poextbus_connector),
						  M(poextbus_no_crc),
						  M(failsafe_timeout),
						  M(failsafe_peripherals),
						  M(failsafe_outputs),
						  M(failsafe_poextbus),
						  M(failsafe_pwm),
						  M(matrix_enable),
						  M(matrix_rows),
						  M(matrix_columns),
						  M(matrix_row_pin),
						  M(matrix_column_pin),
						  M(reserved),
						  M(analog_filter),
						  M(name),
						  M(backlash_enable),
						  M(backlash_speed),
						  M(postep_enable),
						  M(sync_pwm_enable),
						  M(sync_pwm_axis),
						  M(sync_pwm_channel),
						  M(sync_out_enable),
						  M(sync_out_axis),
						  M(sync_out_pin),
						  M(threading_mode),
						  M(threading_ignore),
						  M(threading_ticks),
						  M(threading_rpm),
						  M(threading_speed_gain),
						  M(threading_position_gain),
						  M(reserved2),
						  NESTED(axis, axis_settings_members),
						  END };
#undef OF

#define OF struct pokeys_report
static const struct member report_members[] = { M(magic),
						M(version),
						M(size_units),
						M(hash),
						M(epoch),
						M(t_publish_ns),
						M(count),
						M(generation),
						M(state),
						M(refused),
						M(refused_index),
						M(reserved),
						NESTED(device, settings_members),
						NESTED(wanted, settings_members),
						END };
#undef OF

#define OF struct pokeys_wish
static const struct member wish_members[] = { M(magic),
					      M(version),
					      M(size_units),
					      M(hash),
					      M(session),
					      M(generation),
					      NESTED(settings, settings_members),
					      END };
#undef OF
/* clang-format on */

static const struct {
	const char *name;
	const struct member *members;
	size_t size;
} images[LAYOUT_IMAGES] = {
	{ "state", state_members, sizeof(struct pokeys_state) },
	{ "diag", diag_members, sizeof(struct pokeys_diag) },
	{ "command", command_members, sizeof(struct pokeys_command) },
	{ "report", report_members, sizeof(struct pokeys_report) },
	{ "wish", wish_members, sizeof(struct pokeys_wish) },
};

static size_t put_members(char *text, size_t size, const struct member *member)
{
	size_t used = 0;

	for (; member->name; member++) {
		used += (size_t)snprintf(text + used, size - used, "%s:%zu:%zu;", member->name,
					 member->offset, member->size);
		if (!member->nested)
			continue;
		used += (size_t)snprintf(text + used, size - used, "{");
		used += put_members(text + used, size - used, member->nested);
		used += (size_t)snprintf(text + used, size - used, "}");
	}
	return used;
}

const char *layout_name(enum layout_image image)
{
	return images[image].name;
}

size_t layout_size(enum layout_image image)
{
	return images[image].size;
}

void layout_text(enum layout_image image, char text[LAYOUT_TEXT_MAX])
{
	put_members(text, LAYOUT_TEXT_MAX, images[image].members);
}

bool layout_gapless(enum layout_image image)
{
	size_t at = 0;

	for (const struct member *member = images[image].members; member->name; member++) {
		if (member->offset != at)
			return false;
		at += member->size;
	}
	return at == images[image].size;
}

uint64_t layout_hash(const char *text)
{
	uint64_t hash = UINT64_C(0xcbf29ce484222325);

	for (; *text; text++)
		hash = (hash ^ (unsigned char)*text) * UINT64_C(0x100000001b3);
	return hash;
}
