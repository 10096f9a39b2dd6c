// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The two halves of the house agree: every operation of wire's table is known
 * to the device, and its reply is one wire takes for the answer - operation,
 * id, and whatever must be echoed - whatever the request holds. Fields are
 * compared where both sides interpret them.
 */
#include "tests/sim/talk.h"

#include "wire/bus.h"
#include "wire/encoder.h"
#include "wire/io.h"
#include "wire/layout.h"
#include "wire/panel.h"
#include "wire/pulse.h"

static struct talk t;

static void check_row(const struct wire_op_row *row, uint8_t byte)
{
	static uint8_t value[1024];

	if ((row->flags & WIRE_NO_REPLY) || row->id == 0xB0)
		return;
	assert_true(row->req->size <= sizeof(value));
	memset(value, byte, sizeof(value));
	wire_encode_req(row->op, t.rq, row->req->size ? value : NULL);
	talk_send(&t);
	if (wire_match_reply(row, t.rq, t.rp) != WIRE_OK)
		fail_msg("%s: %s", row->name, wire_reason_name(wire_match_reply(row, t.rq, t.rp)));
}

static void every_operation_is_answered_so_that_it_matches(void **state)
{
	static const uint8_t bytes[] = { 0, 1, 2, 0x55, 0xFF };

	(void)state;
	for (unsigned int i = 0; i < sizeof(bytes); i++) {
		for (unsigned int op = 0; op < WIRE_OP_COUNT; op++) {
			talk_start(&t, 0);
			check_row(wire_op((enum wire_op)op), bytes[i]);
		}
	}
}

static void every_operation_is_known_to_the_device(void **state)
{
	(void)state;
	talk_start(&t, 0);
	for (unsigned int op = 0; op < WIRE_OP_COUNT; op++) {
		const struct wire_op_row *row = wire_op((enum wire_op)op);
		uint64_t unknown = t.dev.stats.unknown;

		check_row(row, 0);
		if (t.dev.stats.unknown == unknown)
			continue;
		talk_begin(&t, row->id, row->sub.where ? row->sub.first : 1, 0, 0, 0);
		unknown = t.dev.stats.unknown;
		talk_send(&t);
		if (t.dev.stats.unknown != unknown)
			fail_msg("%s", row->name);
	}
}

static void status_fields_mean_the_same_to_both(void **state)
{
	struct wire_pulse_status_rep status;

	(void)state;
	talk_start(&t, 0);
	talk_axes(&t, 3);
	talk_axis(&t, 1, SIM_AC_ENABLED | SIM_AC_PLANNER | SIM_AC_POSITION, SIM_SW_LIMIT_PLUS, 10,
		  1, 1);
	t.dev.bench.machine.raw_plus = 0xFD;
	talk_set_state(&t, SIM_PE_RUNNING);
	talk_move(&t, 1, -1234);
	talk_wait(&t, 1000);
	talk_status(&t);
	wire_pulse_status_decode_rep(t.rp, &status);
	assert_int_equal(status.engine_state, SIM_PE_RUNNING);
	assert_int_equal(status.position[1], -1234);
	assert_int_equal(status.axis_state[1], SIM_AX_READY);
	assert_int_equal(status.axes_enabled, 3);
	t.dev.bench.machine.raw_plus = 0xFF;
	talk_status(&t);
	wire_pulse_status_decode_rep(t.rp, &status);
	assert_int_equal(status.limit_pos, 0x02);
	assert_int_equal(status.limit_neg, 0);
}

static void axis_settings_mean_the_same_to_both(void **state)
{
	struct wire_pulse_axis_set_req set;
	const struct sim_axis_setup *setup = &t.dev.engine.axis[2].setup;

	(void)state;
	talk_start(&t, 0);
	memset(&set, 0, sizeof(set));
	set.axis = 2;
	set.config.options = SIM_AC_ENABLED;
	set.config.pin_home = 11;
	set.config.pin_limit_n = 12;
	set.config.pin_limit_p = 13;
	set.config.max_speed = 12.5f;
	set.config.max_accel = 0.25f;
	set.config.max_decel = 0.5f;
	set.config.soft_min = -70000;
	set.config.soft_max = 80000;
	set.config.back_off = 321;
	set.config.mpg_multiplier = -6;
	set.config.mpg_divider = 3;
	set.config.homing_algorithm = 0x42;
	wire_pulse_axis_set_encode_req(t.rq, &set);
	talk_send(&t);
	assert_int_equal(setup->home_pin, 11);
	assert_int_equal(setup->minus_pin, 12);
	assert_int_equal(setup->plus_pin, 13);
	assert_true(setup->limits.speed == 12.5);
	assert_true(setup->limits.accel == 0.25);
	assert_true(setup->limits.decel == 0.5);
	assert_int_equal(setup->soft_min, -70000);
	assert_int_equal(setup->soft_max, 80000);
	assert_int_equal(setup->back_off, 321);
	assert_true(setup->mpg_ratio == -2);
	assert_int_equal(setup->home_on_active, 2);
	assert_int_equal(setup->home_on_release, 4);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_operation_is_answered_so_that_it_matches),
		cmocka_unit_test(every_operation_is_known_to_the_device),
		cmocka_unit_test(status_fields_mean_the_same_to_both),
		cmocka_unit_test(axis_settings_mean_the_same_to_both),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
