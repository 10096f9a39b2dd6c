// SPDX-License-Identifier: GPL-2.0-or-later
/* The pulse engine: states, moves, limits, the emergency button. */
#include "tests/sim/talk.h"

#include "sim/bench.h"

static struct talk t;

static void the_status_carries_its_check_byte(void **state)
{
	(void)state;
	talk_start(&t, 0);
	assert_int_equal(talk_ask(&t, 0x85, 0x00, 0x8B)[63], 0xE5);
	assert_int_equal(talk_ask(&t, 0x85, 0x00, 0xC0)[63], 0x1A);
	assert_int_equal(talk_ask(&t, 0x85, 0x08, 0x11)[63], 0x6B);
	assert_int_equal(t.rp[2], 0x08);
}

static void a_fresh_engine_reports_its_size(void **state)
{
	(void)state;
	talk_start(&t, WIRE_HW_57CNC);
	talk_status(&t);
	assert_int_equal(t.rp[9], 1);
	assert_int_equal(t.rp[10], SIM_PE_STOPPED);
	assert_int_equal(t.rp[56], 8);
	assert_int_equal(t.rp[57], 125);
	assert_int_equal(t.rp[58], 128);
	assert_int_equal(t.rp[59], 10);
	talk_start(&t, WIRE_HW_57E_V11);
	talk_status(&t);
	assert_int_equal(t.rp[15], 1);
	assert_int_equal(t.rp[56], 3);
	assert_int_equal(t.rp[57], 25);
}

/* 15 pulses/ms at 0.03/ms^2 reaches 9 in 300 ms, having made 1354.5 pulses. */
static void a_speed_is_ramped_to_and_held(void **state)
{
	int32_t before;

	(void)state;
	talk_start_running(&t, TALK_TURNING);
	talk_move(&t, 0, 9000);
	talk_wait(&t, 300);
	assert_in_range(talk_position(&t, 0), 1354, 1355);
	assert_int_equal(talk_axis_state(&t, 0), SIM_AX_RUNNING);
	before = talk_position(&t, 0);
	talk_wait(&t, 1000);
	assert_in_range(talk_position(&t, 0) - before, 8999, 9001);
	talk_move(&t, 0, 0);
	talk_wait(&t, 152);
	assert_int_equal(talk_axis_state(&t, 0), SIM_AX_READY);
	assert_int_equal(talk_position(&t, 1), 0);
}

static void a_speed_beyond_the_most_is_cut(void **state)
{
	int32_t before;

	(void)state;
	talk_start_running(&t, TALK_TURNING);
	talk_move(&t, 0, -1000000);
	talk_wait(&t, 1000);
	before = talk_position(&t, 0);
	talk_wait(&t, 100);
	assert_in_range(before - talk_position(&t, 0), 1499, 1501);
}

static void an_axis_goes_to_its_reference_and_stands(void **state)
{
	(void)state;
	talk_start_running(&t, TALK_MOVING);
	talk_move(&t, 0, 5000);
	talk_wait(&t, 100);
	assert_int_equal(talk_axis_state(&t, 0), SIM_AX_RUNNING);
	talk_wait(&t, 2000);
	assert_int_equal(talk_position(&t, 0), 5000);
	assert_int_equal(talk_axis_state(&t, 0), SIM_AX_READY);
	assert_int_equal(t.dev.bench.machine.axis[0].position, 5000);
	assert_int_equal(t.dev.bench.machine.axis[0].steps, 5000);
}

/* 0x20 has no mask: the other axes go to the zeros it carries. */
static void a_move_names_all_axes(void **state)
{
	(void)state;
	talk_start_running(&t, TALK_MOVING);
	talk_move(&t, 1, 400);
	talk_wait(&t, 1000);
	assert_int_equal(talk_position(&t, 1), 400);
	talk_move(&t, 0, 300);
	talk_wait(&t, 1000);
	assert_int_equal(talk_position(&t, 0), 300);
	assert_int_equal(talk_position(&t, 1), 0);
}

static void a_pv_move_keeps_to_its_share_of_the_speed(void **state)
{
	(void)state;
	talk_start_running(&t, TALK_MOVING);
	talk_begin(&t, 0x85, 0x25, 0x02, 0, 0);
	for (unsigned int i = 0; i < 3; i++) {
		wire_put_i32(t.rq + 8 + 4 * i, 100000);
		wire_put_u16(t.rq + 40 + 2 * i, 65535 / 5);
	}
	talk_send(&t);
	talk_wait(&t, 1000);
	assert_in_range(t.dev.engine.axis[1].planner.speed * 1000, 2999, 3001);
	assert_int_equal(talk_position(&t, 0), 0);
	assert_int_equal(talk_position(&t, 2), 0);
}

static void moves_while_stopped_are_forgotten(void **state)
{
	(void)state;
	talk_start_running(&t, TALK_MOVING);
	talk_set_state(&t, SIM_PE_STOPPED);
	talk_move(&t, 0, 5000);
	talk_wait(&t, 100);
	assert_int_equal(talk_position(&t, 0), 0);
	talk_set_state(&t, SIM_PE_RUNNING);
	talk_wait(&t, 1000);
	assert_int_equal(talk_position(&t, 0), 0);
}

static void an_old_reference_never_starts_a_move(void **state)
{
	int32_t stood;

	(void)state;
	talk_start_running(&t, TALK_MOVING);
	talk_move(&t, 0, 5000);
	talk_wait(&t, 200);
	talk_set_state(&t, SIM_PE_STOPPED);
	talk_wait(&t, 500);
	stood = talk_position(&t, 0);
	assert_in_range(stood, 1, 4999);
	talk_set_state(&t, SIM_PE_RUNNING);
	talk_wait(&t, 1000);
	assert_int_equal(talk_position(&t, 0), stood);
}

static void a_change_of_mode_forgets_the_reference(void **state)
{
	(void)state;
	talk_start_running(&t, TALK_TURNING);
	talk_move(&t, 0, 5000);
	talk_axis(&t, 0, TALK_MOVING, 0, 15, 0.03f, 0.06f);
	talk_wait(&t, 2000);
	assert_in_range(talk_position(&t, 0) + 5, 0, 10);
}

static void stopping_ramps_down_first(void **state)
{
	(void)state;
	talk_start_running(&t, TALK_TURNING);
	talk_move(&t, 0, 6000);
	talk_wait(&t, 500);
	talk_set_state(&t, SIM_PE_STOPPED);
	assert_int_equal(talk_engine_state(&t), SIM_PE_STOPPING);
	assert_int_equal(talk_axis_state(&t, 0), SIM_AX_STOPPED);
	talk_wait(&t, 98);
	assert_int_equal(talk_engine_state(&t), SIM_PE_STOPPING);
	talk_wait(&t, 5);
	assert_int_equal(talk_engine_state(&t), SIM_PE_STOPPED);
}

static void an_axis_which_is_not_enabled_never_moves(void **state)
{
	(void)state;
	talk_start_running(&t, TALK_MOVING);
	talk_axis(&t, 1, TALK_MOVING & ~SIM_AC_ENABLED, 0, 15, 1, 1);
	talk_axis(&t, 2, TALK_MOVING | SIM_AC_FAST_OUTPUT, 0, 15, 1, 1);
	talk_axis(&t, 3, TALK_MOVING, 0, 15, 1, 1);
	for (unsigned int i = 1; i <= 3; i++)
		talk_move(&t, i, 100);
	talk_wait(&t, 500);
	for (unsigned int i = 1; i <= 3; i++) {
		assert_int_equal(talk_position(&t, i), 0);
		assert_int_equal(talk_axis_state(&t, i), SIM_AX_STOPPED);
	}
}

static void positions_are_set_by_mask_and_the_machine_stays(void **state)
{
	(void)state;
	talk_start_running(&t, TALK_MOVING);
	talk_begin(&t, 0x85, 0x03, 0x05, 0, 0);
	for (unsigned int i = 0; i < 8; i++)
		wire_put_i32(t.rq + 8 + 4 * i, -100 * (int)(i + 1));
	talk_send(&t);
	assert_int_equal(talk_position(&t, 0), -100);
	assert_int_equal(talk_position(&t, 1), 0);
	assert_int_equal(talk_position(&t, 2), -300);
	talk_wait(&t, 200);
	assert_int_equal(talk_position(&t, 2), -300);
	assert_int_equal(t.dev.bench.machine.axis[0].position, 0);
}

static void an_inverted_axis_turns_the_machine_the_other_way(void **state)
{
	(void)state;
	talk_start_running(&t, TALK_MOVING);
	talk_axis(&t, 0, TALK_MOVING | SIM_AC_INVERTED, 0, 15, 1, 1);
	talk_move(&t, 0, 500);
	talk_wait(&t, 500);
	assert_int_equal(talk_position(&t, 0), 500);
	assert_int_equal(t.dev.bench.machine.axis[0].position, -500);
}

static void the_generator_changes_with_a_reboot_of_the_engine(void **state)
{
	(void)state;
	talk_start(&t, 0);
	talk_begin(&t, 0x85, 0x01, 0, 0, 0);
	t.rq[8] = 3;
	t.rq[10] = 0x01;
	t.rq[13] = 0x05;
	talk_send(&t);
	talk_status(&t);
	assert_int_equal(t.rp[8], 3);
	assert_int_equal(t.rp[15], 0x80);
	assert_int_equal(t.rp[4], 0);
	talk_ask(&t, 0x85, 0x05, 0);
	assert_int_equal(talk_status(&t)[9], 0);
	talk_set_state(&t, SIM_PE_RUNNING);
	assert_int_equal(talk_engine_state(&t), SIM_PE_STOPPED);
	talk_wait(&t, 998);
	assert_int_equal(talk_status(&t)[9], 0);
	talk_wait(&t, 3);
	talk_status(&t);
	assert_int_equal(t.rp[9], 1);
	assert_int_equal(t.rp[15], 0x01);
	assert_int_equal(t.rp[4], 0x05);
	assert_int_equal(t.rp[56], 3);
	assert_int_equal(t.rp[57], 25);
}

static void jogging_follows_the_handwheel(void **state)
{
	(void)state;
	talk_start_running(&t, TALK_MOVING);
	talk_set_state(&t, SIM_PE_STOPPED);
	talk_begin(&t, 0x11, 4, 0x03, 0, 0);
	talk_send(&t);
	talk_begin(&t, 0x11, 3, 0x03, 0, 0);
	t.rq[1] = 0x11;
	talk_send(&t);
	talk_begin(&t, 0x85, 0x10, 1, 0, 0);
	talk_send(&t);
	memmove(t.rq, t.rp, 64);
	t.rq[0] = 0xBB;
	t.rq[2] = 0x11;
	t.rq[3] = 1;
	t.rq[15] = 5;
	wire_put_u16(t.rq + 36, (uint16_t)-10);
	wire_put_u16(t.rq + 49, 4);
	talk_send(&t);
	talk_set_state(&t, SIM_PE_JOGGING);
	assert_int_equal(talk_engine_state(&t), SIM_PE_JOGGING);
	sim_encoder_turn(&t.dev, 4, 100);
	talk_wait(&t, 1000);
	assert_int_equal(talk_position(&t, 1), -250);
	assert_int_equal(talk_position(&t, 0), 0);
}

static void backlash_is_taken_up_beyond_the_position(void **state)
{
	(void)state;
	talk_start_running(&t, TALK_MOVING);
	talk_begin(&t, 0x85, 0x41, 1, 0, 0);
	wire_put_u16(t.rq + 8, 20);
	t.rq[10] = 2;
	talk_send(&t);
	talk_move(&t, 0, 1000);
	talk_wait(&t, 2000);
	assert_int_equal(talk_position(&t, 0), 1000);
	assert_int_equal(t.dev.bench.machine.axis[0].position, 1020);
	talk_move(&t, 0, 0);
	talk_wait(&t, 2000);
	assert_int_equal(t.dev.bench.machine.axis[0].position, -20);
	assert_int_equal((int16_t)wire_get_u16(talk_ask(&t, 0x85, 0x40, 0) + 40), -20);
}

static void external_outputs_keep_their_state(void **state)
{
	(void)state;
	talk_start_running(&t, TALK_MOVING);
	talk_begin(&t, 0x85, 0x04, 1, 0x88, 0);
	talk_send(&t);
	sim_bench_emergency(&t.dev, true);
	talk_wait(&t, 5);
	talk_begin(&t, 0x85, 0x04, 0, 0, 1);
	talk_send(&t);
	assert_int_equal(t.rp[3], 1);
	assert_int_equal(t.rp[4], 0x88);
}

static void senseless_speeds_are_taken_as_none(void **state)
{
	static const uint32_t odd[] = { 0x7FC00000, 0x7F800000, 0xFF800000, 0xC1700000, 0 };

	(void)state;
	for (unsigned int i = 0; i < 5; i++) {
		talk_start_running(&t, TALK_MOVING);
		talk_begin(&t, 0x85, 0x10, 0, 0, 0);
		talk_send(&t);
		memmove(t.rq, t.rp, 64);
		t.rq[0] = 0xBB;
		t.rq[2] = 0x11;
		wire_put_u32(t.rq + 16 + 4 * (i % 3), odd[i]);
		talk_send(&t);
		talk_move(&t, 0, 1000);
		talk_wait(&t, 100);
		assert_in_range(talk_position(&t, 0), 0, 1000);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(the_status_carries_its_check_byte),
		cmocka_unit_test(a_fresh_engine_reports_its_size),
		cmocka_unit_test(a_speed_is_ramped_to_and_held),
		cmocka_unit_test(a_speed_beyond_the_most_is_cut),
		cmocka_unit_test(an_axis_goes_to_its_reference_and_stands),
		cmocka_unit_test(a_move_names_all_axes),
		cmocka_unit_test(a_pv_move_keeps_to_its_share_of_the_speed),
		cmocka_unit_test(moves_while_stopped_are_forgotten),
		cmocka_unit_test(an_old_reference_never_starts_a_move),
		cmocka_unit_test(a_change_of_mode_forgets_the_reference),
		cmocka_unit_test(stopping_ramps_down_first),
		cmocka_unit_test(an_axis_which_is_not_enabled_never_moves),
		cmocka_unit_test(positions_are_set_by_mask_and_the_machine_stays),
		cmocka_unit_test(an_inverted_axis_turns_the_machine_the_other_way),
		cmocka_unit_test(the_generator_changes_with_a_reboot_of_the_engine),
		cmocka_unit_test(jogging_follows_the_handwheel),
		cmocka_unit_test(backlash_is_taken_up_beyond_the_position),
		cmocka_unit_test(external_outputs_keep_their_state),
		cmocka_unit_test(senseless_speeds_are_taken_as_none),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
