// SPDX-License-Identifier: GPL-2.0-or-later
/* Failsafe, clock, log, and time itself. */
#include "tests/sim/talk.h"

static struct talk t;

static void set_failsafe(uint8_t tenths, uint8_t peripherals)
{
	talk_begin(&t, 0x81, 1, tenths, peripherals, 0);
	t.rq[8 + 2] = 0x10; /* pin 20, counted from 0 */
	t.rq[15] = 0x77;
	t.rq[25] = 50;
	talk_send(&t);
}

static void prepare(void)
{
	talk_start(&t, 0);
	talk_begin(&t, 0x10, 20, 0x04, 0, 0);
	talk_send(&t);
	talk_begin(&t, 0xCB, 1, 0, 0, 0);
	wire_put_u32(t.rq + 33, 2000);
	talk_send(&t);
}

static void failsafe_comes_after_its_time_of_silence(void **state)
{
	(void)state;
	prepare();
	set_failsafe(5, 0x07);
	talk_wait(&t, 499);
	assert_int_equal(t.dev.stats.failsafes, 0);
	assert_int_equal(t.dev.pins.latch, 0);
	talk_wait(&t, 2);
	assert_int_equal(t.dev.stats.failsafes, 1);
	assert_int_equal(t.dev.pins.latch, UINT64_C(1) << 20);
	assert_int_equal(t.dev.bus.poext[0], 0x77);
	assert_int_equal(t.dev.config.pwm.duty[0], 1000);
	talk_wait(&t, 5000);
	assert_int_equal(t.dev.stats.failsafes, 1);
}

static void talking_keeps_failsafe_away(void **state)
{
	(void)state;
	prepare();
	set_failsafe(2, 0x01);
	for (int i = 0; i < 50; i++) {
		talk_wait(&t, 150);
		talk_ask(&t, 0x05, 0, 0);
	}
	assert_int_equal(t.dev.stats.failsafes, 0);
	talk_wait(&t, 250);
	assert_int_equal(t.dev.stats.failsafes, 1);
	talk_ask(&t, 0x05, 0, 0);
	talk_wait(&t, 250);
	assert_int_equal(t.dev.stats.failsafes, 2);
}

static void garbage_does_not_count_as_talking(void **state)
{
	(void)state;
	prepare();
	set_failsafe(2, 0x01);
	for (int i = 0; i < 3; i++) {
		talk_wait(&t, 100);
		talk_begin(&t, 0x05, 0, 0, 0, 0);
		t.rq[7] = 1;
		assert_int_equal(sim_device_request(&t.dev, t.now_ns, t.rq, 64, t.rp), 0);
	}
	assert_int_equal(t.dev.stats.failsafes, 1);
}

static void failsafe_takes_only_what_it_is_told_to(void **state)
{
	(void)state;
	prepare();
	set_failsafe(1, 0x02);
	talk_wait(&t, 200);
	assert_int_equal(t.dev.pins.latch, 0);
	assert_int_equal(t.dev.config.pwm.duty[0], 0);
	assert_int_equal(t.dev.bus.poext[0], 0x77);
}

static void failsafe_stops_the_engine(void **state)
{
	(void)state;
	prepare();
	talk_axes(&t, 1);
	talk_axis(&t, 0, SIM_AC_ENABLED | SIM_AC_PLANNER, 0, 20, 1, 0.01f);
	talk_set_state(&t, SIM_PE_RUNNING);
	talk_move(&t, 0, 10000);
	set_failsafe(1, 0x08);
	talk_wait(&t, 101);
	assert_int_equal(t.dev.engine.state, SIM_PE_STOPPING);
	talk_wait(&t, 1100);
	assert_int_equal(t.dev.engine.state, SIM_PE_STOPPED);
	assert_int_equal(t.dev.engine.axis[0].planner.speed, 0);
}

static void set_clock(uint16_t year, uint8_t month, uint8_t day, uint8_t h, uint8_t m, uint8_t s)
{
	talk_begin(&t, 0x83, 0x10, 0, 0, 0);
	t.rq[8] = s;
	t.rq[9] = m;
	t.rq[10] = h;
	t.rq[12] = day;
	t.rq[13] = month;
	wire_put_u16(t.rq + 16, year);
	talk_send(&t);
}

static void the_clock_runs_through_a_leap_day(void **state)
{
	(void)state;
	talk_start(&t, 0);
	set_clock(2028, 2, 28, 23, 59, 58);
	talk_wait(&t, 3000);
	talk_ask(&t, 0x83, 0, 0);
	assert_int_equal(t.rp[8], 1);
	assert_int_equal(t.rp[9], 0);
	assert_int_equal(t.rp[10], 0);
	assert_int_equal(t.rp[11], 2); /* a Tuesday */
	assert_int_equal(t.rp[12], 29);
	assert_int_equal(t.rp[13], 2);
	assert_int_equal(wire_get_u16(t.rp + 14), 60);
	assert_int_equal(wire_get_u16(t.rp + 16), 2028);
}

static void the_clock_agrees_with_the_sheets_example(void **state)
{
	static const uint8_t want[12] = {
		0x1e, 0x2d, 0x0c, 0x02, 0x12, 0x0b, 0x42, 0x01, 0xe9, 0x07
	};

	(void)state;
	talk_start(&t, 0);
	set_clock(2025, 11, 18, 12, 45, 30);
	assert_memory_equal(t.rp + 8, want, 10);
}

static void a_time_which_is_none_is_not_taken(void **state)
{
	(void)state;
	talk_start(&t, 0);
	set_clock(2025, 11, 18, 12, 45, 30);
	set_clock(2025, 13, 18, 12, 45, 30);
	set_clock(2025, 11, 18, 25, 45, 30);
	talk_ask(&t, 0x83, 0, 0);
	assert_int_equal(t.rp[10], 12);
	assert_int_equal(t.rp[13], 11);
}

static void the_clock_outlives_a_reboot(void **state)
{
	(void)state;
	talk_start(&t, 0);
	set_clock(2025, 11, 18, 12, 45, 30);
	talk_wait(&t, 5000);
	talk_ask(&t, 0xF3, 0, 0);
	talk_wait(&t, 5000);
	assert_int_equal(talk_ask(&t, 0x83, 0, 0)[8], 40);
}

static void the_log_is_read_and_cleared(void **state)
{
	(void)state;
	talk_start(&t, 0);
	for (uint16_t i = 1; i <= 30; i++)
		sim_device_log(&t.dev, i);
	talk_ask(&t, 0x84, 0, 0);
	assert_int_equal(t.rp[2], 27);
	assert_int_equal(wire_get_u16(t.rp + 8), 4);
	assert_int_equal(wire_get_u16(t.rp + 8 + 2 * 26), 30);
	talk_ask(&t, 0x84, 0x10, 0);
	assert_int_equal(talk_ask(&t, 0x84, 0, 0)[2], 0);
}

static void a_gap_of_days_is_lived_through_in_an_instant(void **state)
{
	(void)state;
	talk_start(&t, 0);
	t.now_ns += 86400000 * MS * 50;
	assert_int_equal(wire_get_u32(talk_ask(&t, 0xCF, 0, 0) + 2), (uint32_t)(86400000ull * 50));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(failsafe_comes_after_its_time_of_silence),
		cmocka_unit_test(talking_keeps_failsafe_away),
		cmocka_unit_test(garbage_does_not_count_as_talking),
		cmocka_unit_test(failsafe_takes_only_what_it_is_told_to),
		cmocka_unit_test(failsafe_stops_the_engine),
		cmocka_unit_test(the_clock_runs_through_a_leap_day),
		cmocka_unit_test(the_clock_agrees_with_the_sheets_example),
		cmocka_unit_test(a_time_which_is_none_is_not_taken),
		cmocka_unit_test(the_clock_outlives_a_reboot),
		cmocka_unit_test(the_log_is_read_and_cleared),
		cmocka_unit_test(a_gap_of_days_is_lived_through_in_an_instant),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
