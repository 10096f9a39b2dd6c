/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Pulse engine v2: protocol section 3.24.
 *
 * Offsets are written down from there, independently of the layouts in wire/;
 * see vectors.h for how a wrong one shows.
 */

#include "tests/wire/vectors.h"
#include "wire/pulse.h"

static void status_is(const struct wire_pulse_status_rep *s)
{
	AT(s->soft_limits, 3);
	AT(s->power_states, 4);
	AT(s->limit_override, 5);
	AT(s->axes_enabled, 8);
	AT(s->activated, 9);
	AT(s->engine_state, 10);
	AT(s->charge_pump, 11);
	AT(s->limit_pos, 12);
	AT(s->limit_neg, 13);
	AT(s->home, 14);
	AT(s->generator, 15);
	ATBYTES(s->axis_state, 16);
	AT32(s->position[0], 24);
	AT32(s->position[7], 52);
	AT(s->axes_supported, 56);
	AT(s->max_khz, 57);
	AT(s->buffer_slots, 58);
	AT(s->slot_time, 59);
	AT(s->emergency_invert, 60);
	AT(s->driver_error, 61);
	AT(s->misc_inputs, 62);
	AT(s->check, 63);
}

static void pulse_status_is_where_section_3_24_2_says(void **state)
{
	REQ(pulse_status, pulse_status_req, ask);
	REP(pulse_status, pulse_status_rep, status);
	REP(pulse_fill8, pulse_fill_rep, fill);
	REP(pulse_status2, pulse_status2_rep, raw);

	(void)state;
	AT(ask.check, 3);
	status_is(&status);
	AT(fill.accepted, 2);
	status_is(&fill.status);
	AT(raw.limit_neg, 8);
	AT(raw.limit_pos, 9);
	AT(raw.home, 10);
	AT(raw.check, 63);
}

static void pulse_commands_are_where_section_3_24_3_says(void **state)
{
	REQ(pulse_setup, pulse_setup_req, setup);
	REP(pulse_setup, pulse_result_rep, result);
	REQ(pulse_state, pulse_state_req, go);
	REQ(pulse_positions, pulse_positions_req, positions);
	REQ(pulse_outputs, pulse_outputs_req, out);
	REP(pulse_outputs, pulse_outputs_rep, out_is);
	REQ(pulse_emergency, pulse_emergency_req, pin);
	REP(pulse_emergency, pulse_emergency_rep, pin_is);
	REQ(pulse_move, pulse_move_req, move);
	REQ(pulse_move_pv, pulse_move_pv_req, pv);

	(void)state;
	AT(setup.axes, 8);
	AT(setup.charge_pump, 9);
	AT(setup.generator, 10);
	AT(setup.buffer_slots, 11);
	AT(setup.emergency_invert, 12);
	AT(setup.power_states, 13);
	AT(result.result, 3);
	AT(go.state, 3);
	AT(go.limit_override, 4);
	AT(go.enable_mask, 5);
	AT(positions.mask, 3);
	AT32(positions.position[7], 36);
	AT(out.relays, 3);
	AT(out.oc, 4);
	AT(out.read_only, 5);
	AT(out_is.relays, 3);
	AT(out_is.oc, 4);
	AT(pin.write, 3);
	AT(pin.read_mark, 5);
	AT(pin.pin, 8);
	AT(pin_is.pin, 8);
	AT32(move.reference[0], 8);
	AT32(move.reference[7], 36);
	AT(pv.mask, 3);
	AT32(pv.position[7], 36);
	AT16(pv.velocity[0], 40);
	AT16(pv.velocity[7], 54);
}

static void homing_and_probing_are_where_section_3_24_3_says(void **state)
{
	REQ(pulse_home_start, pulse_home_start_req, home);
	REQ(pulse_home_finish, pulse_home_finish_req, homed);
	REQ(pulse_probe_start, pulse_probe_start_req, probe);
	REQ(pulse_probe_finish, pulse_probe_finish_req, finish);
	REP(pulse_probe_finish, pulse_probe_finish_rep, probed);
	uint32_t speed;

	(void)state;
	AT(home.mask, 3);
	AT32(home.offset[7], 36);
	AT(homed.state, 3);
	AT(homed.keep_state, 4);
	AT(probe.mask, 3);
	AT(probe.hybrid, 4);
	AT32(probe.limit[7], 36);
	memcpy(&speed, &probe.speed, sizeof(speed));
	AT32(speed, 40);
	AT(probe.input, 44);
	AT(probe.polarity, 45);
	AT(finish.keep_state, 3);
	AT32(probed.position[7], 36);
	AT(probed.status, 40);
}

static void synced_outputs_and_fills_are_where_section_3_24_3_says(void **state)
{
	REQ(pulse_sync_pwm, pulse_sync_pwm_req, pwm);
	REQ(pulse_sync_outputs, pulse_sync_outputs_req, out);
	REQ(pulse_fill8, pulse_fill_req, fill8);
	REQ(pulse_fill16, pulse_fill_req, fill16);
	REQ(pulse_fill_part, pulse_fill_part_req, part);
	REP(pulse_drivers_get, pulse_drivers, drivers);

	(void)state;
	AT(pwm.option, 3);
	AT(pwm.axis, 4);
	AT(pwm.channel, 5);
	AT(out.option, 3);
	AT(out.axis, 4);
	ATBYTES(out.pin, 8);
	AT(fill8.slots, 3);
	AT(fill8.axes, 4);
	ATBYTES(fill8.data, 8);
	ATBYTES(fill16.data, 8);
	AT(part.part, 2);
	AT(part.width, 3);
	AT(part.slots, 4);
	AT(part.axes, 5);
	ATBYTES(part.data, 8);
	AT(drivers.driver[0].step, 8);
	AT(drivers.driver[3].step, 14);
	AT(drivers.driver[3].current, 15);
}

static void axis_is(const struct wire_axis_config *c)
{
	uint32_t speed[3];

	memcpy(speed, &c->max_speed, sizeof(speed));
	AT(c->options, 8);
	AT(c->switches, 9);
	AT(c->pin_home, 10);
	AT(c->pin_limit_n, 11);
	AT(c->pin_limit_p, 12);
	AT(c->homing_speed, 13);
	AT(c->homing_return, 14);
	AT(c->mpg_encoder, 15);
	AT32(speed[0], 16);
	AT32(speed[1], 20);
	AT32(speed[2], 24);
	AT32(c->soft_min, 28);
	AT32(c->soft_max, 32);
	AT16(c->mpg_multiplier, 36);
	AT(c->pin_enable, 38);
	AT(c->invert_enable, 39);
	AT(c->filter_limit_n, 40);
	AT(c->filter_limit_p, 41);
	AT(c->filter_home, 42);
	AT(c->homing_algorithm, 43);
	AT(c->mpg_1x, 44);
	AT32(c->back_off, 45);
	AT16(c->mpg_divider, 49);
	AT(c->signals, 51);
	AT(c->filter_probe, 52);
	ATBYTES(c->reserved, 53);
}

static void axis_configuration_is_where_section_3_24_4_says(void **state)
{
	REQ(pulse_axis_get, pulse_axis_get_req, ask);
	REP(pulse_axis_get, pulse_axis_get_rep, got);
	REQ(pulse_axis_set, pulse_axis_set_req, set);

	(void)state;
	AT(ask.axis, 3);
	axis_is(&got.config);
	AT(set.axis, 3);
	axis_is(&set.config);
}

static void threading_and_backlash_are_where_section_3_24_3_says(void **state)
{
	REP(thread_status, thread_status_rep, s);
	REQ(thread_params, thread_params_req, p);
	REQ(pulse_backlash_set, pulse_backlash_set_req, set);
	REP(pulse_backlash_get, pulse_backlash_rep, got);

	(void)state;
	AT(s.preparing, 8);
	AT(s.prepared, 9);
	AT(s.waiting, 10);
	AT(s.active, 11);
	AT32(s.velocity, 12);
	AT32(s.position_error, 16);
	AT32(s.rpm, 20);
	AT(s.ignore_axes, 24);
	AT32(s.index_count, 25);
	ATBYTES(s.debug, 29);
	AT(p.mode, 8);
	AT16(p.ticks, 12);
	AT16(p.target_rpm, 14);
	AT16(p.speed_gain, 16);
	AT16(p.position_gain, 18);
	AT(p.ignore_axes, 20);
	AT(set.enable, 3);
	AT(set.max_speed, 4);
	AT16(set.axis[0].half_width, 8);
	AT16(set.axis[7].half_width, 36);
	AT(set.axis[7].accel, 38);
	AT(set.axis[7].reserved, 39);
	AT(got.enable, 3);
	AT(got.max_speed, 4);
	AT16(got.axis[7].half_width, 36);
	AT(got.axis[7].accel, 38);
	AT(got.axis[7].reserved, 39);
	AT16(got.compensation[0], 40);
	AT16(got.compensation[7], 54);
}

static void postep_drivers_are_where_section_3_24_3_says(void **state)
{
	REQ(postep_comm, postep_comm_req, comm);
	REP(postep_status, postep_status_rep, status);
	REQ(postep_currents, postep_currents_req, currents);
	REQ(postep_modes, postep_modes_req, modes);
	REP(postep_versions, postep_versions_rep, versions);

	(void)state;
	AT(comm.option, 3);
	AT(comm.enable, 4);
	AT(comm.axis[7].type, 29);
	AT(comm.axis[7].address, 30);
	AT(comm.axis[7].update, 31);
	AT(status.axis[7].supply, 50);
	AT(status.axis[7].temperature, 51);
	AT(status.axis[7].inputs, 52);
	AT(status.axis[7].state, 53);
	AT(status.axis[7].faults, 54);
	AT(status.axis[7].updates, 55);
	AT(currents.option, 3);
	AT16(currents.axis[7].full_scale, 50);
	AT16(currents.axis[7].idle, 52);
	AT16(currents.axis[7].overheat, 54);
	AT(modes.option, 3);
	AT(modes.axis[7].mode, 50);
	AT(modes.axis[7].step, 51);
	AT(modes.axis[7].temperature, 52);
	ATBYTES(modes.axis[7].reserved, 53);
	AT(versions.axis[7].hw_major, 50);
	AT(versions.axis[7].hw_minor, 51);
	AT(versions.axis[7].fw_major, 52);
	AT(versions.axis[7].fw_minor, 53);
}

static void smart_generator_is_where_section_3_24_3_says(void **state)
{
	REP(smart_get, smart_config, c);
	REQ(smart_reset, smart_reset_req, reset);
	REP(smart_status, smart_status_rep, s);
	REP(smart_encoders, smart_encoders_rep, e);

	(void)state;
	ATBYTES(c.pulse_width, 8);
	AT32(c.spindle_period, 16);
	AT(c.encoder_config, 20);
	AT(c.count_mode, 21);
	AT16(c.step_period, 22);
	AT(c.axes, 24);
	AT(c.probe_config, 25);
	ATBYTES(c.filter, 26);
	AT(c.step_gpio, 28);
	AT(c.dir_gpio, 29);
	AT(c.step_pwm, 30);
	ATBYTES(c.step_multiplier, 31);
	ATBYTES(c.encoder_multiplier, 39);
	AT16(c.max_mismatch[0], 47);
	AT16(c.max_mismatch[7], 61);
	AT(reset.axes, 3);
	AT(s.mismatch_axes, 8);
	AT16(s.spindle_period, 9);
	AT(s.inputs, 11);
	AT16(s.mismatch[7], 26);
	AT32(s.position[7], 56);
	AT32(e.value[7], 36);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(pulse_status_is_where_section_3_24_2_says),
		cmocka_unit_test(pulse_commands_are_where_section_3_24_3_says),
		cmocka_unit_test(homing_and_probing_are_where_section_3_24_3_says),
		cmocka_unit_test(synced_outputs_and_fills_are_where_section_3_24_3_says),
		cmocka_unit_test(axis_configuration_is_where_section_3_24_4_says),
		cmocka_unit_test(threading_and_backlash_are_where_section_3_24_3_says),
		cmocka_unit_test(postep_drivers_are_where_section_3_24_3_says),
		cmocka_unit_test(smart_generator_is_where_section_3_24_3_says),
	};

	return cmocka_run_group_tests(tests, vectors_count, NULL);
}
