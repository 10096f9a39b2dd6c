// SPDX-License-Identifier: GPL-2.0-or-later
/* Encoders: sampling, wrapping, index, and the shafts of axes. */
#include "tests/sim/talk.h"

#include "sim/bench.h"

static struct talk t;

static void set_encoder(uint8_t k, uint8_t option, uint8_t a, uint8_t b)
{
	talk_begin(&t, 0x11, k, option, a, b);
	assert_int_equal(talk_send(&t)[2], 0);
}

static int32_t count(unsigned int k)
{
	talk_ask(&t, 0xCD, k >= 13, 0);
	return wire_get_i32(t.rp + 8 + 4 * (k % 13));
}

static void sampling_divides_the_steps(void **state)
{
	(void)state;
	talk_start(&t, 0);
	set_encoder(3, 0x01, 0, 0);
	set_encoder(4, 0x05, 0, 0);
	set_encoder(5, 0x03, 0, 0);
	for (unsigned int k = 3; k <= 6; k++)
		sim_encoder_turn(&t.dev, k, 4000);
	assert_int_equal(count(3), 1000);
	assert_int_equal(count(4), 2000);
	assert_int_equal(count(5), 4000);
	assert_int_equal(count(6), 0);
}

static void turning_to_and_fro_adds_up_to_nothing(void **state)
{
	(void)state;
	talk_start(&t, 0);
	set_encoder(3, 0x01, 0, 0);
	for (int i = 0; i < 1000; i++) {
		sim_encoder_turn(&t.dev, 3, -3);
		sim_encoder_turn(&t.dev, 3, 3);
	}
	assert_int_equal(count(3), 0);
}

/* A count every four steps, on the way through zero as well. */
static void divided_counts_are_evenly_spaced(void **state)
{
	static const int32_t want[] = { -2, -1, -1, -1, -1, 0, 0, 0, 0, 1, 1, 1, 1, 2 };

	(void)state;
	talk_start(&t, 0);
	set_encoder(3, 0x01, 0, 0);
	sim_encoder_turn(&t.dev, 3, -5);
	for (unsigned int i = 0; i < sizeof(want) / sizeof(want[0]); i++) {
		assert_int_equal(count(3), want[i]);
		sim_encoder_turn(&t.dev, 3, 1);
	}
}

static void counters_wrap_at_32_bits_and_show_8_of_them(void **state)
{
	(void)state;
	talk_start(&t, 0);
	set_encoder(7, 0x03, 0, 0);
	sim_bench_encoder(&t.dev, 7, 0x7FFFFFFF);
	sim_encoder_turn(&t.dev, 7, 3);
	assert_int_equal(count(7), INT32_MIN + 2);
	assert_int_equal(talk_ask(&t, 0xCC, 0, 0)[25 + 7], 2);
	assert_int_equal(talk_ask(&t, 0x19, 7, 0)[3], 2);
	sim_encoder_turn(&t.dev, 7, -5);
	assert_int_equal(talk_ask(&t, 0xCC, 0, 0)[25 + 7], 0xFD);
}

static void thirteen_counters_are_written_at_once(void **state)
{
	(void)state;
	talk_start(&t, 0);
	talk_begin(&t, 0xCD, 11, 0, 0, 0);
	for (unsigned int i = 0; i < 13; i++)
		wire_put_i32(t.rq + 8 + 4 * i, -1000 * (int)i);
	talk_send(&t);
	assert_int_equal(count(12), 0);
	assert_int_equal(count(14), -1000);
	assert_int_equal(count(25), -12000);
	talk_ask(&t, 0x1A, 14, 0);
	assert_int_equal(count(14), 0);
	assert_int_equal(count(15), -2000);
}

static void pins_with_quadrature_are_counted(void **state)
{
	static const uint8_t a[4] = { 0, 1, 1, 0 };
	static const uint8_t b[4] = { 0, 0, 1, 1 };

	(void)state;
	talk_start(&t, 0);
	sim_bench_pin(&t.dev, 10, 0);
	sim_bench_pin(&t.dev, 11, 0);
	set_encoder(9, 0x03, 10, 11);
	for (int i = 1; i <= 40; i++) {
		sim_bench_pin(&t.dev, 10, a[i % 4]);
		sim_bench_pin(&t.dev, 11, b[i % 4]);
	}
	assert_int_equal(count(9), 40);
	for (int i = 39; i >= 0; i--) {
		sim_bench_pin(&t.dev, 11, b[i % 4]);
		sim_bench_pin(&t.dev, 10, a[i % 4]);
	}
	assert_int_equal(count(9), 0);
}

static void a_shaft_turns_by_itself_at_its_rate(void **state)
{
	(void)state;
	talk_start(&t, 0);
	set_encoder(3, 0x03, 0, 0);
	t.dev.bench.shaft[3].rate = -12345;
	talk_wait(&t, 2000);
	assert_int_equal(count(3), -24690);
}

static void fast_encoders_replace_the_first_three(void **state)
{
	(void)state;
	talk_start(&t, 0);
	sim_encoder_turn(&t.dev, 1, 100);
	assert_int_equal(count(1), 0);
	talk_ask(&t, 0xCE, 10, 0);
	sim_encoder_turn(&t.dev, 1, 100);
	assert_int_equal(count(1), 100);
	talk_ask(&t, 0xCE, 0x40 | 0x10 | 10, 0);
	sim_encoder_turn(&t.dev, 1, 100);
	assert_int_equal(count(1), 75);
}

static void a_fast_encoders_index_zeroes_it_when_enabled(void **state)
{
	(void)state;
	talk_start(&t, 0);
	talk_ask(&t, 0xCE, 10, 0);
	sim_encoder_turn(&t.dev, 2, 55);
	sim_encoder_index(&t.dev, 2);
	assert_int_equal(count(2), 55);
	talk_ask(&t, 0xCE, 10, 1);
	sim_encoder_index(&t.dev, 2);
	assert_int_equal(count(2), 0);
	sim_encoder_turn(&t.dev, 2, 5);
	sim_encoder_index(&t.dev, 2);
	assert_int_equal(count(2), 0);
}

static void the_ultra_fast_encoder_is_reset_by_one_index_only(void **state)
{
	(void)state;
	talk_start(&t, 0);
	talk_begin(&t, 0x1C, 1, 4, 1, 0);
	talk_send(&t);
	sim_encoder_turn(&t.dev, SIM_ULTRA_FAST, 1000);
	assert_int_equal(wire_get_u32(talk_ask(&t, 0xCC, 0, 0) + 58), 1000);
	sim_encoder_index(&t.dev, SIM_ULTRA_FAST);
	assert_int_equal(count(25), 0);
	sim_encoder_turn(&t.dev, SIM_ULTRA_FAST, 10);
	sim_encoder_index(&t.dev, SIM_ULTRA_FAST);
	assert_int_equal(count(25), 10);
	assert_int_equal(wire_get_u32(talk_ask(&t, 0x85, 0x37, 0) + 12), 2);
}

static void a_rotation_is_timed(void **state)
{
	(void)state;
	talk_start(&t, 0);
	talk_ask(&t, 0x1C, 1, 4);
	t.dev.bench.shaft[SIM_ULTRA_FAST].rate = 40000;
	t.dev.bench.shaft[SIM_ULTRA_FAST].index_every = 4000;
	talk_wait(&t, 1000);
	talk_ask(&t, 0x85, 0x37, 0);
	assert_in_range(wire_get_u32(t.rp + 12), 9, 11);
	assert_int_equal(wire_get_u32(t.rp + 16), 2500000);
	assert_int_equal(wire_get_u32(t.rp + 20), 4000);
	assert_int_equal(wire_get_u32(talk_ask(&t, 0x85, 0x35, 0) + 20), 600);
}

static void an_axis_turns_the_encoder_fastened_to_it(void **state)
{
	(void)state;
	talk_start(&t, 0);
	set_encoder(6, 0x03, 0, 0);
	sim_bench_couple(&t.dev, 0, 6, 3, 2, 0);
	talk_axes(&t, 1);
	talk_axis(&t, 0, SIM_AC_ENABLED | SIM_AC_PLANNER | SIM_AC_POSITION, 0, 20, 1, 1);
	talk_set_state(&t, SIM_PE_RUNNING);
	talk_move(&t, 0, 1000);
	talk_wait(&t, 500);
	assert_int_equal(talk_position(&t, 0), 1000);
	assert_int_equal(count(6), 1500);
	talk_move(&t, 0, -333);
	talk_wait(&t, 500);
	assert_in_range(count(6) + 1000, 1000 - 500, 1000 - 499);
}

static void encoders_are_zero_after_a_reboot(void **state)
{
	(void)state;
	talk_start(&t, 0);
	set_encoder(3, 0x03, 0, 0);
	sim_encoder_turn(&t.dev, 3, 100);
	talk_ask(&t, 0x50, 0xAA, 0x55);
	talk_ask(&t, 0xF3, 0, 0);
	assert_int_equal(count(3), 0);
	sim_encoder_turn(&t.dev, 3, 1);
	assert_int_equal(count(3), 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(sampling_divides_the_steps),
		cmocka_unit_test(turning_to_and_fro_adds_up_to_nothing),
		cmocka_unit_test(divided_counts_are_evenly_spaced),
		cmocka_unit_test(counters_wrap_at_32_bits_and_show_8_of_them),
		cmocka_unit_test(thirteen_counters_are_written_at_once),
		cmocka_unit_test(pins_with_quadrature_are_counted),
		cmocka_unit_test(a_shaft_turns_by_itself_at_its_rate),
		cmocka_unit_test(fast_encoders_replace_the_first_three),
		cmocka_unit_test(a_fast_encoders_index_zeroes_it_when_enabled),
		cmocka_unit_test(the_ultra_fast_encoder_is_reset_by_one_index_only),
		cmocka_unit_test(a_rotation_is_timed),
		cmocka_unit_test(an_axis_turns_the_encoder_fastened_to_it),
		cmocka_unit_test(encoders_are_zero_after_a_reboot),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
