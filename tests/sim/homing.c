// SPDX-License-Identifier: GPL-2.0-or-later
/* Homing against a machine with switches (protocol section 5.3). */
#include "tests/sim/talk.h"

#include "sim/bench.h"

#define MOST_MS 60000

static struct talk t;

static struct sim_mechanics *machine(unsigned int axis)
{
	return &t.dev.bench.machine.axis[axis];
}

/* The vendor's third example: 15 kHz, 0.06, 10 % and 50 %, home below -2000. */
static void start(uint8_t options, uint8_t switches)
{
	struct sim_switch home = {
		.wired = true, .pin = SIM_DEDICATED, .from = INT32_MIN, .to = -2000
	};

	talk_start(&t, 0);
	talk_axes(&t, 3);
	for (uint8_t i = 0; i < 3; i++) {
		sim_bench_switch(&t.dev, &machine(i)->home, &home);
		talk_axis(&t, i, options, switches, 15, 0.03f, 0.06f);
	}
}

static void home(uint8_t mask, int32_t offset)
{
	talk_begin(&t, 0x85, 0x21, mask, 0, 0);
	for (unsigned int i = 0; i < 8; i++)
		wire_put_i32(t.rq + 8 + 4 * i, offset);
	talk_send(&t);
}

static void set_byte(uint8_t axis, unsigned int at, uint8_t value)
{
	talk_begin(&t, 0x85, 0x10, axis, 0, 0);
	talk_send(&t);
	memmove(t.rq, t.rp, 64);
	t.rq[0] = 0xBB;
	t.rq[2] = 0x11;
	t.rq[3] = axis;
	t.rq[at] = value;
	talk_send(&t);
}

/* Records the lowest position of the machine while homing. */
static int64_t home_and_watch(void)
{
	int64_t lowest = 0;

	while (t.dev.engine.state == SIM_PE_HOMING) {
		talk_wait(&t, 1);
		if (machine(0)->position < lowest)
			lowest = machine(0)->position;
	}
	return lowest;
}

static void the_acceptance_values_of_the_sheet_are_met(void **state)
{
	int64_t lowest;

	(void)state;
	start(TALK_MOVING, SIM_SW_HOME);
	home(0x01, 0);
	assert_int_equal(talk_engine_state(&t), SIM_PE_HOMING);
	lowest = home_and_watch();
	assert_in_range(-2000 - lowest, 18, 20);
	assert_int_equal(talk_engine_state(&t), SIM_PE_HOME);
	assert_int_equal(talk_axis_state(&t, 0), SIM_AX_HOME);
	assert_in_range(talk_position(&t, 0), 4, 5);
	assert_true(machine(0)->position > -2000);
	assert_in_range(machine(0)->position - talk_position(&t, 0) + 2000, 0, 2);
}

static void the_states_follow_each_other(void **state)
{
	static const uint8_t want[] = { SIM_AX_HOMING_START, SIM_AX_HOMING_SEARCH,
					SIM_AX_HOMING_BACK, SIM_AX_HOMING_RESETTING, SIM_AX_HOME };
	unsigned int seen = 0;

	(void)state;
	start(TALK_MOVING, SIM_SW_HOME);
	home(0x01, 0);
	while (seen < sizeof(want)) {
		assert_int_equal(t.dev.engine.axis[0].state, want[seen]);
		for (int ms = 0; t.dev.engine.axis[0].state == want[seen] && ms < MOST_MS; ms++) {
			if (want[seen] == SIM_AX_HOME)
				return;
			talk_wait(&t, 1);
		}
		seen++;
	}
	fail();
}

static void the_offset_is_the_position_of_the_edge(void **state)
{
	(void)state;
	start(TALK_MOVING, SIM_SW_HOME);
	home(0x01, -777);
	assert_int_equal(talk_wait_while(&t, SIM_PE_HOMING), SIM_PE_HOME);
	assert_in_range(talk_position(&t, 0) + 777, 4, 5);
}

static void homing_twice_finds_the_same_place(void **state)
{
	int64_t place;

	(void)state;
	start(TALK_MOVING, SIM_SW_HOME);
	home(0x01, 0);
	talk_wait_while(&t, SIM_PE_HOMING);
	place = machine(0)->position - talk_position(&t, 0);
	talk_set_state(&t, SIM_PE_RUNNING);
	talk_move(&t, 0, 3210);
	talk_wait(&t, 3000);
	home(0x01, 0);
	assert_int_equal(talk_wait_while(&t, SIM_PE_HOMING), SIM_PE_HOME);
	assert_in_range(machine(0)->position - talk_position(&t, 0) - place + 2, 0, 4);
}

static void only_the_masked_axes_home(void **state)
{
	(void)state;
	start(TALK_MOVING, SIM_SW_HOME);
	home(0x05, 0);
	assert_int_equal(talk_wait_while(&t, SIM_PE_HOMING), SIM_PE_HOME);
	assert_int_equal(talk_axis_state(&t, 0), SIM_AX_HOME);
	assert_int_equal(talk_axis_state(&t, 1), SIM_AX_STOPPED);
	assert_int_equal(talk_axis_state(&t, 2), SIM_AX_HOME);
	assert_int_equal(machine(1)->position, 0);
}

static void homing_one_axis_ends_the_moves_of_the_others(void **state)
{
	int32_t stood;

	(void)state;
	start(TALK_MOVING, SIM_SW_HOME);
	talk_set_state(&t, SIM_PE_RUNNING);
	talk_move(&t, 1, 100000);
	talk_wait(&t, 500);
	home(0x01, 0);
	assert_int_equal(talk_wait_while(&t, SIM_PE_HOMING), SIM_PE_HOME);
	stood = talk_position(&t, 1);
	talk_wait(&t, 500);
	assert_int_equal(talk_position(&t, 1), stood);
}

static void an_axis_already_on_its_switch_only_backs_off(void **state)
{
	(void)state;
	start(TALK_MOVING, SIM_SW_HOME);
	machine(0)->position = -2500;
	home(0x01, 0);
	assert_int_equal(talk_wait_while(&t, SIM_PE_HOMING), SIM_PE_HOME);
	assert_in_range(machine(0)->position + 2000, 1, 6);
	assert_in_range(talk_position(&t, 0), 4, 5);
}

static void inverted_homing_searches_the_other_way(void **state)
{
	struct sim_switch far = {
		.wired = true, .pin = SIM_DEDICATED, .from = 1500, .to = INT32_MAX
	};

	(void)state;
	start(TALK_MOVING | SIM_AC_INVERTED_HOME, SIM_SW_HOME);
	sim_bench_switch(&t.dev, &machine(0)->home, &far);
	home(0x01, 0);
	assert_int_equal(talk_wait_while(&t, SIM_PE_HOMING), SIM_PE_HOME);
	assert_in_range(1500 - machine(0)->position, 1, 7);
	assert_in_range(-talk_position(&t, 0), 4, 5);
}

static void the_back_off_goes_on_into_the_free(void **state)
{
	(void)state;
	start(TALK_MOVING, SIM_SW_HOME);
	set_byte(0, 45, 200);
	home(0x01, 0);
	assert_int_equal(talk_wait_while(&t, SIM_PE_HOMING), SIM_PE_HOME);
	assert_in_range(talk_position(&t, 0), 204, 205);
}

static void a_limit_shared_with_home_does_not_trip_while_homing(void **state)
{
	struct sim_switch minus = {
		.wired = true, .pin = SIM_DEDICATED, .from = INT32_MIN, .to = -1000
	};

	(void)state;
	start(TALK_MOVING, SIM_SW_LIMIT_MINUS | SIM_SW_HOME_ON_MINUS);
	for (unsigned int i = 0; i < 3; i++)
		sim_bench_switch(&t.dev, &machine(i)->minus, &minus);
	home(0x01, 0);
	assert_int_equal(talk_wait_while(&t, SIM_PE_HOMING), SIM_PE_HOME);
	assert_in_range(machine(0)->position + 1000, 1, 7);
	talk_set_state(&t, SIM_PE_RUNNING);
	talk_move(&t, 0, -500);
	assert_int_equal(talk_wait_while(&t, SIM_PE_RUNNING), SIM_PE_STOP_LIMIT);
}

static void another_limit_ends_homing(void **state)
{
	struct sim_switch minus = {
		.wired = true, .pin = SIM_DEDICATED, .from = INT32_MIN, .to = -500
	};

	(void)state;
	start(TALK_MOVING, SIM_SW_LIMIT_MINUS | SIM_SW_HOME);
	for (unsigned int i = 0; i < 3; i++)
		sim_bench_switch(&t.dev, &machine(i)->minus, &minus);
	home(0x01, 0);
	assert_int_equal(talk_wait_while(&t, SIM_PE_HOMING), SIM_PE_STOP_LIMIT);
	assert_int_equal(talk_axis_state(&t, 0), SIM_AX_LIMIT);
}

static void homing_is_refused_while_the_emergency_button_is_pressed(void **state)
{
	(void)state;
	start(TALK_MOVING, SIM_SW_HOME);
	sim_bench_emergency(&t.dev, true);
	home(0x01, 0);
	assert_int_equal(talk_engine_state(&t), SIM_PE_STOP_EMERGENCY);
	assert_int_equal(talk_axis_state(&t, 0), SIM_AX_STOPPED);
}

static void homing_can_be_broken_off(void **state)
{
	int32_t stood;

	(void)state;
	start(TALK_MOVING, SIM_SW_HOME);
	home(0x01, 0);
	talk_wait(&t, 500);
	talk_set_state(&t, SIM_PE_STOPPED);
	assert_int_equal(talk_engine_state(&t), SIM_PE_STOPPING);
	talk_wait(&t, 100);
	assert_int_equal(talk_engine_state(&t), SIM_PE_STOPPED);
	assert_int_equal(talk_axis_state(&t, 0), SIM_AX_STOPPED);
	stood = talk_position(&t, 0);
	assert_true(stood < -100);
	talk_wait(&t, 100);
	assert_int_equal(talk_position(&t, 0), stood);
}

static void a_finished_axis_is_ready_at_once_and_takes_moves(void **state)
{
	(void)state;
	start(TALK_MOVING, SIM_SW_HOME);
	home(0x01, 0);
	talk_wait_while(&t, SIM_PE_HOMING);
	talk_move(&t, 0, 100);
	talk_wait(&t, 500);
	assert_in_range(talk_position(&t, 0), 4, 5);
	talk_begin(&t, 0x85, 0x22, 0, 1, 0);
	talk_send(&t);
	for (int i = 0; i < 5; i++) {
		assert_int_equal(talk_axis_state(&t, 0), SIM_AX_READY);
		talk_wait(&t, 1);
	}
	assert_int_equal(talk_engine_state(&t), SIM_PE_HOME);
	talk_move(&t, 0, 100);
	talk_wait(&t, 1000);
	assert_int_equal(talk_position(&t, 0), 100);
}

static void finishing_may_change_the_state(void **state)
{
	(void)state;
	start(TALK_MOVING, SIM_SW_HOME);
	home(0x01, 0);
	talk_wait_while(&t, SIM_PE_HOMING);
	talk_begin(&t, 0x85, 0x22, SIM_PE_RUNNING, 0, 0);
	talk_send(&t);
	assert_int_equal(talk_engine_state(&t), SIM_PE_RUNNING);
}

/* Algorithm 0x47: slow down and reverse on the switch, look for the index behind it. */
static void homing_can_look_for_the_encoders_index(void **state)
{
	(void)state;
	start(TALK_MOVING, SIM_SW_HOME);
	sim_bench_couple(&t.dev, 0, 5, 1, 1, 250);
	set_byte(0, 43, 0x43);
	home(0x01, 0);
	assert_int_equal(talk_wait_while(&t, SIM_PE_HOMING), SIM_PE_HOME);
	assert_in_range(machine(0)->position, -1750, -1740);
	assert_in_range(talk_position(&t, 0), 4, 6);
}

static void stopping_on_the_switch_is_a_choice(void **state)
{
	(void)state;
	start(TALK_MOVING, SIM_SW_HOME);
	set_byte(0, 43, 0x88);
	home(0x01, 10);
	assert_int_equal(talk_wait_while(&t, SIM_PE_HOMING), SIM_PE_HOME);
	assert_in_range(10 - talk_position(&t, 0), 17, 20);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_acceptance_values_of_the_sheet_are_met),
		cmocka_unit_test(the_states_follow_each_other),
		cmocka_unit_test(the_offset_is_the_position_of_the_edge),
		cmocka_unit_test(homing_twice_finds_the_same_place),
		cmocka_unit_test(only_the_masked_axes_home),
		cmocka_unit_test(homing_one_axis_ends_the_moves_of_the_others),
		cmocka_unit_test(an_axis_already_on_its_switch_only_backs_off),
		cmocka_unit_test(inverted_homing_searches_the_other_way),
		cmocka_unit_test(the_back_off_goes_on_into_the_free),
		cmocka_unit_test(a_limit_shared_with_home_does_not_trip_while_homing),
		cmocka_unit_test(another_limit_ends_homing),
		cmocka_unit_test(homing_is_refused_while_the_emergency_button_is_pressed),
		cmocka_unit_test(homing_can_be_broken_off),
		cmocka_unit_test(a_finished_axis_is_ready_at_once_and_takes_moves),
		cmocka_unit_test(finishing_may_change_the_state),
		cmocka_unit_test(homing_can_look_for_the_encoders_index),
		cmocka_unit_test(stopping_on_the_switch_is_a_choice),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
