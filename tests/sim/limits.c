// SPDX-License-Identifier: GPL-2.0-or-later
/* What stops the axes: soft limits, limit switches, a cut cable, the emergency button. */
#include "tests/sim/talk.h"

#include "sim/bench.h"

static struct talk t;

static struct sim_switch limit_at(int64_t from, int64_t to)
{
	struct sim_switch sw = { .wired = true, .pin = SIM_DEDICATED, .from = from, .to = to };

	return sw;
}

static void soft_limits_are_reached_and_not_passed(void **state)
{
	(void)state;
	talk_start_running(&t, TALK_MOVING | SIM_AC_SOFT_LIMIT);
	talk_move(&t, 0, 150000);
	talk_wait(&t, 9000);
	assert_int_equal(talk_position(&t, 0), 100000);
	assert_int_equal(talk_status(&t)[3], 1);
	assert_int_equal(talk_engine_state(&t), SIM_PE_RUNNING);
	talk_move(&t, 0, 99000);
	talk_wait(&t, 1000);
	assert_int_equal(talk_position(&t, 0), 99000);
	assert_int_equal(talk_status(&t)[3], 0);
}

static void soft_limits_stop_a_turning_axis_too(void **state)
{
	(void)state;
	talk_start_running(&t, TALK_TURNING | SIM_AC_SOFT_LIMIT);
	talk_move(&t, 0, -15000);
	talk_wait(&t, 9000);
	assert_int_equal(talk_position(&t, 0), -100000);
	talk_move(&t, 0, 1000);
	talk_wait(&t, 1000);
	assert_true(talk_position(&t, 0) > -99500);
}

static void a_limit_switch_stops_everything_hard(void **state)
{
	struct sim_switch plus = limit_at(1000, INT32_MAX);
	int32_t stood[2];

	(void)state;
	talk_start_running(&t, TALK_TURNING);
	sim_bench_switch(&t.dev, &t.dev.bench.machine.axis[0].plus, &plus);
	talk_axis(&t, 0, TALK_TURNING, SIM_SW_LIMIT_PLUS, 15, 0.03f, 0.06f);
	talk_begin(&t, 0x85, 0x20, 0, 0, 0);
	wire_put_i32(t.rq + 8, 9000);
	wire_put_i32(t.rq + 12, -5000);
	talk_send(&t);
	talk_wait(&t, 400);
	assert_int_equal(talk_engine_state(&t), SIM_PE_STOP_LIMIT);
	assert_int_equal(talk_axis_state(&t, 0), SIM_AX_LIMIT);
	assert_int_equal(talk_axis_state(&t, 1), SIM_AX_STOPPED);
	assert_int_equal(talk_status(&t)[12], 1);
	assert_int_equal(talk_status(&t)[13], 0);
	stood[0] = talk_position(&t, 0);
	stood[1] = talk_position(&t, 1);
	assert_in_range(stood[0], 1000, 1010);
	talk_wait(&t, 100);
	assert_int_equal(talk_position(&t, 0), stood[0]);
	assert_int_equal(talk_position(&t, 1), stood[1]);
}

static void a_tripped_engine_is_left_only_by_stop_and_override(void **state)
{
	struct sim_switch plus = limit_at(0, INT32_MAX);

	(void)state;
	talk_start_running(&t, TALK_TURNING);
	sim_bench_switch(&t.dev, &t.dev.bench.machine.axis[0].plus, &plus);
	talk_axis(&t, 0, TALK_TURNING, SIM_SW_LIMIT_PLUS, 15, 0.03f, 0.06f);
	talk_wait(&t, 2);
	assert_int_equal(talk_engine_state(&t), SIM_PE_STOP_LIMIT);
	talk_set_state(&t, SIM_PE_RUNNING);
	assert_int_equal(talk_engine_state(&t), SIM_PE_STOP_LIMIT);
	talk_set_state(&t, SIM_PE_STOPPED);
	assert_int_equal(talk_engine_state(&t), SIM_PE_STOPPED);
	talk_wait(&t, 10);
	assert_int_equal(talk_engine_state(&t), SIM_PE_STOPPED);
	talk_set_state(&t, SIM_PE_RUNNING);
	assert_int_equal(talk_engine_state(&t), SIM_PE_STOP_LIMIT);
	talk_set_state(&t, SIM_PE_STOPPED);
	talk_begin(&t, 0x85, 0x02, SIM_PE_RUNNING, 1, 0xFF);
	talk_send(&t);
	assert_int_equal(talk_engine_state(&t), SIM_PE_RUNNING);
	assert_int_equal(talk_status(&t)[5], 1);
	talk_move(&t, 0, -5000);
	talk_wait(&t, 200);
	assert_true(talk_position(&t, 0) < -10);
	assert_int_equal(talk_engine_state(&t), SIM_PE_RUNNING);
}

static void a_limit_which_is_not_configured_does_nothing(void **state)
{
	struct sim_switch plus = limit_at(100, INT32_MAX);

	(void)state;
	talk_start_running(&t, TALK_MOVING);
	sim_bench_switch(&t.dev, &t.dev.bench.machine.axis[0].plus, &plus);
	talk_move(&t, 0, 500);
	talk_wait(&t, 1000);
	assert_int_equal(talk_position(&t, 0), 500);
	assert_int_equal(talk_ask(&t, 0x85, 0x08, 0)[9] & 1, 1);
}

/* An unwired input is open, as a cut cable is: tripped for a closed-circuit switch. */
static void a_cut_cable_trips(void **state)
{
	(void)state;
	talk_start_running(&t, TALK_MOVING);
	talk_axis(&t, 0, TALK_MOVING, SIM_SW_LIMIT_MINUS, 15, 1, 1);
	talk_wait(&t, 2);
	assert_int_equal(talk_engine_state(&t), SIM_PE_STOP_LIMIT);
	talk_set_state(&t, SIM_PE_STOPPED);
	talk_axis(&t, 0, TALK_MOVING, SIM_SW_LIMIT_MINUS | SIM_SW_INVERT_MINUS, 15, 1, 1);
	talk_set_state(&t, SIM_PE_RUNNING);
	assert_int_equal(talk_engine_state(&t), SIM_PE_RUNNING);
}

static void a_switch_may_stand_on_a_pin(void **state)
{
	struct sim_switch minus = limit_at(INT32_MIN, -200);

	(void)state;
	talk_start_running(&t, TALK_MOVING);
	minus.pin = 9;
	minus.normally_open = true;
	sim_bench_switch(&t.dev, &t.dev.bench.machine.axis[0].minus, &minus);
	talk_begin(&t, 0x85, 0x10, 0, 0, 0);
	talk_send(&t);
	memmove(t.rq, t.rp, 64);
	t.rq[0] = 0xBB;
	t.rq[2] = 0x11;
	t.rq[9] = SIM_SW_LIMIT_MINUS | SIM_SW_INVERT_MINUS;
	t.rq[11] = 10;
	talk_send(&t);
	assert_int_equal(talk_engine_state(&t), SIM_PE_RUNNING);
	talk_move(&t, 0, -1000);
	talk_wait(&t, 1000);
	assert_int_equal(talk_engine_state(&t), SIM_PE_STOP_LIMIT);
	assert_in_range(-talk_position(&t, 0), 200, 210);
}

static void the_emergency_button_stops_without_a_ramp(void **state)
{
	int32_t stood;

	(void)state;
	talk_start_running(&t, TALK_TURNING);
	talk_move(&t, 0, 9000);
	talk_wait(&t, 500);
	sim_bench_emergency(&t.dev, true);
	talk_wait(&t, 1);
	stood = talk_position(&t, 0);
	assert_int_equal(talk_engine_state(&t), SIM_PE_STOP_EMERGENCY);
	talk_wait(&t, 100);
	assert_int_equal(talk_position(&t, 0), stood);
	talk_set_state(&t, SIM_PE_STOPPED);
	talk_set_state(&t, SIM_PE_RUNNING);
	assert_int_equal(talk_engine_state(&t), SIM_PE_STOP_EMERGENCY);
	sim_bench_emergency(&t.dev, false);
	talk_wait(&t, 10);
	assert_int_equal(talk_engine_state(&t), SIM_PE_STOP_EMERGENCY);
	talk_set_state(&t, SIM_PE_STOPPED);
	talk_set_state(&t, SIM_PE_RUNNING);
	assert_int_equal(talk_engine_state(&t), SIM_PE_RUNNING);
	talk_wait(&t, 500);
	assert_int_equal(talk_position(&t, 0), stood);
}

static void drivers_are_powered_as_configured(void **state)
{
	(void)state;
	talk_start(&t, 0);
	talk_begin(&t, 0x85, 0x01, 0, 0, 0);
	t.rq[8] = 2;
	t.rq[10] = 0x80;
	t.rq[13] = 0x02;
	talk_send(&t);
	talk_ask(&t, 0x85, 0x05, 0);
	talk_wait(&t, 1001);
	talk_axis(&t, 0, TALK_MOVING, 0, 15, 1, 1);
	talk_axis(&t, 1, TALK_MOVING | SIM_AC_MASKED, 0, 15, 1, 1);
	talk_begin(&t, 0x85, 0x10, 0, 0, 0);
	talk_send(&t);
	memmove(t.rq, t.rp, 64);
	t.rq[0] = 0xBB;
	t.rq[2] = 0x11;
	t.rq[38] = 33;
	t.rq[39] = 1;
	talk_send(&t);
	assert_false(sim_axis_powered(&t.dev, 0));
	assert_int_equal(sim_pin_level(&t.dev, 32), 1);
	talk_begin(&t, 0x85, 0x02, SIM_PE_RUNNING, 0, 0x01);
	talk_send(&t);
	assert_true(sim_axis_powered(&t.dev, 0));
	assert_false(sim_axis_powered(&t.dev, 1));
	assert_int_equal(t.dev.pins.level >> 32 & 1, 0);
	talk_set_state(&t, SIM_PE_RUNNING);
	assert_true(sim_axis_powered(&t.dev, 1));
	sim_bench_emergency(&t.dev, true);
	talk_wait(&t, 1);
	assert_false(sim_axis_powered(&t.dev, 0));
	assert_int_equal(t.dev.pins.level >> 32 & 1, 1);
}

static void the_emergency_pin_can_be_another_or_none(void **state)
{
	(void)state;
	talk_start_running(&t, TALK_MOVING);
	talk_begin(&t, 0x85, 0x06, 1, 0, 0);
	t.rq[8] = 10 + 5;
	talk_send(&t);
	talk_wait(&t, 2);
	assert_int_equal(talk_engine_state(&t), SIM_PE_RUNNING);
	sim_bench_emergency(&t.dev, true);
	talk_wait(&t, 2);
	assert_int_equal(talk_engine_state(&t), SIM_PE_STOP_EMERGENCY);
	talk_set_state(&t, SIM_PE_STOPPED);
	talk_begin(&t, 0x85, 0x06, 1, 0, 0);
	t.rq[8] = 0;
	talk_send(&t);
	talk_set_state(&t, SIM_PE_RUNNING);
	assert_int_equal(talk_engine_state(&t), SIM_PE_RUNNING);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(soft_limits_are_reached_and_not_passed),
		cmocka_unit_test(soft_limits_stop_a_turning_axis_too),
		cmocka_unit_test(a_limit_switch_stops_everything_hard),
		cmocka_unit_test(a_tripped_engine_is_left_only_by_stop_and_override),
		cmocka_unit_test(a_limit_which_is_not_configured_does_nothing),
		cmocka_unit_test(a_cut_cable_trips),
		cmocka_unit_test(a_switch_may_stand_on_a_pin),
		cmocka_unit_test(the_emergency_button_stops_without_a_ramp),
		cmocka_unit_test(drivers_are_powered_as_configured),
		cmocka_unit_test(the_emergency_pin_can_be_another_or_none),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
