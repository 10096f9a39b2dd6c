// SPDX-License-Identifier: GPL-2.0-or-later
/* Buffered motion: what a fill takes, what the ring makes of it. */
#include "tests/sim/talk.h"

#include "sim/bench.h"

static struct talk t;
static uint8_t multi[512];

static void start(uint8_t options)
{
	talk_start(&t, 0);
	talk_axes(&t, 3);
	for (uint8_t i = 0; i < 3; i++)
		talk_axis(&t, i, options, 0, 15, 0.03f, 0.06f);
}

/* Eight-bit slots with `value` for axis 0; how many were taken. */
static uint8_t fill(uint8_t slots, uint8_t value)
{
	talk_begin(&t, 0x85, 0xFF, slots, 3, 0);
	for (unsigned int i = 0; i < slots && i < 18; i++)
		t.rq[8 + 3 * i] = value;
	return talk_send(&t)[2];
}

static void slots_become_pulses_one_a_millisecond(void **state)
{
	(void)state;
	start(SIM_AC_ENABLED);
	talk_set_state(&t, SIM_PE_RUNNING);
	assert_int_equal(talk_axis_state(&t, 0), SIM_AX_BUFFER);
	assert_int_equal(fill(18, 5), 18);
	talk_wait(&t, 10);
	assert_int_equal(talk_position(&t, 0), 50);
	talk_wait(&t, 20);
	assert_int_equal(talk_position(&t, 0), 90);
	assert_int_equal(fill(18, 0x85), 18);
	talk_wait(&t, 30);
	assert_int_equal(talk_position(&t, 0), 0);
	assert_int_equal(t.dev.bench.machine.axis[0].steps, 180);
}

static void a_fill_takes_what_fits_and_no_more(void **state)
{
	unsigned int taken = 0;

	(void)state;
	start(SIM_AC_ENABLED);
	for (int i = 0; i < 7; i++)
		taken += fill(18, 1);
	assert_int_equal(taken, 126);
	assert_int_equal(fill(18, 1), 2);
	assert_int_equal(fill(18, 1), 0);
	talk_set_state(&t, SIM_PE_RUNNING);
	talk_wait(&t, 5);
	assert_int_equal(fill(18, 1), 5);
	talk_wait(&t, 200);
	assert_int_equal(talk_position(&t, 0), 133);
}

static void a_fill_cannot_take_more_than_its_packet_holds(void **state)
{
	(void)state;
	start(SIM_AC_ENABLED);
	assert_int_equal(fill(200, 1), 18);
	talk_begin(&t, 0x85, 0xFF, 10, 0, 0);
	assert_int_equal(talk_send(&t)[2], 0);
	talk_begin(&t, 0x85, 0xFF, 10, 9, 0);
	assert_int_equal(talk_send(&t)[2], 0);
	talk_begin(&t, 0x85, 0xFE, 200, 8, 0);
	assert_int_equal(talk_send(&t)[2], 3);
}

static void a_fill_repeated_moves_twice(void **state)
{
	(void)state;
	start(SIM_AC_ENABLED);
	talk_set_state(&t, SIM_PE_RUNNING);
	fill(10, 3);
	wire_finish(t.rq, t.rq[6]);
	assert_int_equal(sim_device_request(&t.dev, t.now_ns, t.rq, 64, t.rp), 64);
	talk_wait(&t, 50);
	assert_int_equal(talk_position(&t, 0), 60);
}

static void a_fills_reply_is_the_status(void **state)
{
	(void)state;
	start(SIM_AC_ENABLED);
	talk_set_state(&t, SIM_PE_RUNNING);
	fill(18, 2);
	talk_wait(&t, 4);
	fill(0, 0);
	assert_int_equal(t.rp[10], SIM_PE_RUNNING);
	assert_int_equal(t.rp[8], 3);
	assert_int_equal(wire_get_i32(t.rp + 24), 8);
	assert_int_equal(t.rp[63], 0);
}

static void sixteen_bit_slots_carry_more(void **state)
{
	(void)state;
	start(SIM_AC_ENABLED);
	talk_set_state(&t, SIM_PE_RUNNING);
	talk_begin(&t, 0x85, 0xFE, 2, 3, 0);
	wire_put_u16(t.rq + 8 + 2, 100);
	wire_put_u16(t.rq + 8 + 6 + 2, 0x8000 | 30);
	assert_int_equal(talk_send(&t)[2], 2);
	talk_wait(&t, 1);
	assert_int_equal(talk_position(&t, 1), 100);
	talk_wait(&t, 1);
	assert_int_equal(talk_position(&t, 1), 70);
}

static void a_slot_beyond_the_generator_is_cut_and_counted(void **state)
{
	(void)state;
	start(SIM_AC_ENABLED);
	talk_set_state(&t, SIM_PE_RUNNING);
	talk_begin(&t, 0x85, 0xFE, 1, 3, 0);
	wire_put_u16(t.rq + 8, 30000);
	talk_send(&t);
	talk_wait(&t, 2);
	assert_int_equal(talk_position(&t, 0), 125);
	assert_int_equal(t.dev.engine.axis[0].clamped, 1);
}

static void prepare_multi(uint8_t mode, uint8_t slots, uint8_t axes)
{
	memset(multi, 0, sizeof(multi));
	for (unsigned int part = 0; part < 8; part++) {
		uint8_t *p = multi + 64 * part;

		p[0] = 0xBB;
		p[1] = 0xB0;
		p[2] = (uint8_t)(part | (part == 0 ? 0x08 : 0) | (part == 7 ? 0x10 : 0));
		p[3] = mode;
		p[4] = slots;
		p[5] = axes;
		wire_finish(p, (uint8_t)(250 + part));
	}
}

static void put_multi(unsigned int at, uint8_t value)
{
	multi[64 * (at / 56) + 8 + at % 56] = value;
}

static void eight_parts_have_one_reply_with_the_last_id(void **state)
{
	(void)state;
	start(SIM_AC_ENABLED);
	talk_set_state(&t, SIM_PE_RUNNING);
	prepare_multi(0xFF, 149, 3);
	for (unsigned int i = 0; i < 149; i++)
		put_multi(3 * i, 2);
	assert_int_equal(sim_device_request(&t.dev, t.now_ns, multi, 512, t.rp), 64);
	assert_int_equal(t.rp[1], 0xB0);
	assert_int_equal(t.rp[2], 128);
	assert_int_equal(t.rp[6], 1);
	assert_int_equal(t.rp[10], SIM_PE_RUNNING);
	assert_int_equal(t.dev.stats.executed[0xB0], 1);
	talk_wait(&t, 200);
	assert_int_equal(talk_position(&t, 0), 256);
}

static void parts_which_come_singly_have_one_reply_too(void **state)
{
	(void)state;
	start(SIM_AC_ENABLED);
	prepare_multi(0xFF, 40, 3);
	for (unsigned int part = 0; part < 8; part++)
		assert_int_equal(sim_device_request(&t.dev, t.now_ns, multi + 64 * part, 64, t.rp),
				 part == 7 ? 64 : 0);
	assert_int_equal(t.rp[2], 40);
	assert_int_equal(t.rp[6], 1);
	for (unsigned int part = 3; part < 8; part++)
		assert_int_equal(sim_device_request(&t.dev, t.now_ns, multi + 64 * part, 64, t.rp),
				 0);
	assert_int_equal(t.dev.engine.ring.used, 40);
}

static void one_bad_part_spoils_them_all(void **state)
{
	(void)state;
	start(SIM_AC_ENABLED);
	prepare_multi(0xFF, 10, 3);
	multi[64 * 5 + 7]++;
	assert_int_equal(sim_device_request(&t.dev, t.now_ns, multi, 512, t.rp), 0);
	assert_int_equal(t.dev.stats.dropped[SIM_DROP_CHECKSUM], 1);
	assert_int_equal(t.dev.engine.ring.used, 0);
}

static void a_large_fill_of_16_bits(void **state)
{
	(void)state;
	start(SIM_AC_ENABLED);
	talk_set_state(&t, SIM_PE_RUNNING);
	prepare_multi(0xFE, 60, 3);
	for (unsigned int i = 0; i < 60; i++)
		put_multi(6 * i + 4, 7);
	assert_int_equal(sim_device_request(&t.dev, t.now_ns, multi, 512, t.rp), 64);
	assert_int_equal(t.rp[2], 60);
	talk_wait(&t, 100);
	assert_int_equal(talk_position(&t, 2), 420);
}

static void axes_on_the_planner_ignore_their_bytes(void **state)
{
	(void)state;
	start(SIM_AC_ENABLED);
	talk_axis(&t, 1, SIM_AC_ENABLED | SIM_AC_PLANNER | SIM_AC_POSITION, 0, 15, 1, 1);
	talk_set_state(&t, SIM_PE_RUNNING);
	talk_begin(&t, 0x85, 0xFF, 18, 3, 0);
	memset(t.rq + 8, 4, 54);
	talk_send(&t);
	talk_move(&t, 1, 33);
	talk_wait(&t, 100);
	assert_int_equal(talk_position(&t, 0), 72);
	assert_int_equal(talk_position(&t, 1), 33);
	assert_int_equal(talk_position(&t, 2), 72);
}

static void running_dry_stands_still_and_is_counted(void **state)
{
	(void)state;
	start(SIM_AC_ENABLED);
	talk_set_state(&t, SIM_PE_RUNNING);
	fill(3, 9);
	talk_wait(&t, 20);
	assert_int_equal(t.dev.engine.ring.underruns, 1);
	fill(3, 0);
	talk_wait(&t, 20);
	assert_int_equal(t.dev.engine.ring.underruns, 1);
	assert_int_equal(talk_engine_state(&t), SIM_PE_RUNNING);
	assert_int_equal(talk_position(&t, 0), 27);
}

static void clearing_and_stopping_empty_the_ring(void **state)
{
	(void)state;
	start(SIM_AC_ENABLED);
	talk_set_state(&t, SIM_PE_RUNNING);
	fill(18, 9);
	talk_wait(&t, 2);
	talk_ask(&t, 0x85, 0xF0, 0);
	talk_wait(&t, 20);
	assert_int_equal(talk_position(&t, 0), 18);
	fill(18, 9);
	talk_set_state(&t, SIM_PE_STOPPED);
	assert_int_equal(talk_engine_state(&t), SIM_PE_STOPPED);
	talk_set_state(&t, SIM_PE_RUNNING);
	talk_wait(&t, 20);
	assert_int_equal(talk_position(&t, 0), 18);
	fill(18, 9);
	sim_bench_emergency(&t.dev, true);
	talk_wait(&t, 1);
	assert_int_equal(t.dev.engine.ring.used, 0);
}

static void pwm_and_outputs_follow_a_slot(void **state)
{
	(void)state;
	start(SIM_AC_ENABLED);
	talk_begin(&t, 0x10, 20, 0x04, 0, 0);
	talk_send(&t);
	talk_begin(&t, 0xCB, 1, 0, 0, 0);
	wire_put_u32(t.rq + 33, 2000);
	talk_send(&t);
	talk_begin(&t, 0x85, 0x0A, 1, 1, 4);
	talk_send(&t);
	talk_begin(&t, 0x85, 0x0B, 1, 2, 0);
	t.rq[8] = 21;
	t.rq[9] = 92 + 3;
	talk_send(&t);
	talk_set_state(&t, SIM_PE_RUNNING);
	talk_begin(&t, 0x85, 0xFF, 1, 3, 0);
	t.rq[9] = 40;
	t.rq[10] = 0x03;
	talk_send(&t);
	talk_wait(&t, 2);
	assert_int_equal(t.dev.config.pwm.duty[4], 800);
	assert_int_equal(t.dev.pins.latch >> 20 & 1, 1);
	assert_int_equal(t.dev.engine.outputs, 0x08);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(slots_become_pulses_one_a_millisecond),
		cmocka_unit_test(a_fill_takes_what_fits_and_no_more),
		cmocka_unit_test(a_fill_cannot_take_more_than_its_packet_holds),
		cmocka_unit_test(a_fill_repeated_moves_twice),
		cmocka_unit_test(a_fills_reply_is_the_status),
		cmocka_unit_test(sixteen_bit_slots_carry_more),
		cmocka_unit_test(a_slot_beyond_the_generator_is_cut_and_counted),
		cmocka_unit_test(eight_parts_have_one_reply_with_the_last_id),
		cmocka_unit_test(parts_which_come_singly_have_one_reply_too),
		cmocka_unit_test(one_bad_part_spoils_them_all),
		cmocka_unit_test(a_large_fill_of_16_bits),
		cmocka_unit_test(axes_on_the_planner_ignore_their_bytes),
		cmocka_unit_test(running_dry_stands_still_and_is_counted),
		cmocka_unit_test(clearing_and_stopping_empty_the_ring),
		cmocka_unit_test(pwm_and_outputs_follow_a_slot),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
