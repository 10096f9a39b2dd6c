// SPDX-License-Identifier: GPL-2.0-or-later
/* Threading: slots played by the spindle's angle, and the ways in and out of it. */
#include "tests/sim/talk.h"

#include <math.h>
#include <stdio.h>

#include "sim/bench.h"

enum { STEPS = 4096, RPM = 600, SLOTS_A_TURN = 100 };

static struct talk t;

static void set(uint8_t mode, uint16_t rpm, uint16_t speed_gain, uint16_t position_gain,
		uint8_t ignore)
{
	talk_begin(&t, 0x85, 0x36, 0, 0, 0);
	t.rq[8] = mode;
	wire_put_u16(t.rq + 12, STEPS / 4);
	wire_put_u16(t.rq + 14, rpm);
	wire_put_u16(t.rq + 16, speed_gain);
	wire_put_u16(t.rq + 18, position_gain);
	t.rq[20] = ignore;
	talk_send(&t);
}

static void start(uint8_t mode)
{
	talk_start(&t, 0);
	talk_axes(&t, 3);
	for (uint8_t i = 0; i < 3; i++)
		talk_axis(&t, i, SIM_AC_ENABLED, 0, 125, 0.03f, 0.06f);
	t.dev.config.encoders.ultra_on = 1;
	set(mode, RPM, 200, 100, 0);
	talk_set_state(&t, SIM_PE_RUNNING);
}

/* Slots in which axis 0 makes `value` pulses and axis 1 one; all that fit. */
static void feed(unsigned int slots, uint8_t value)
{
	while (slots) {
		uint8_t now = slots < 18 ? (uint8_t)slots : 18;

		talk_begin(&t, 0x85, 0xFF, now, 3, 0);
		for (unsigned int i = 0; i < now; i++) {
			t.rq[8 + 3 * i] = value;
			t.rq[9 + 3 * i] = 1;
		}
		now = talk_send(&t)[2];
		slots -= now;
		if (!now)
			return;
	}
}

static void spin(double rpm)
{
	t.dev.bench.shaft[SIM_ULTRA_FAST].index_every = STEPS;
	t.dev.bench.shaft[SIM_ULTRA_FAST].rate = (int64_t)(rpm * STEPS / 60);
}

/* The bits of 0x35: 1 preparing, 2 prepared, 4 waiting, 8 active. */
static unsigned int bits(void)
{
	talk_ask(&t, 0x85, 0x35, 0);
	return t.rp[8] | t.rp[9] * 2u | t.rp[10] * 4u | t.rp[11] * 8u;
}

static void ask(uint8_t sub)
{
	talk_ask(&t, 0x85, sub, 0);
}

static void wait_for_index(void)
{
	uint32_t before = t.dev.encoders.index_count;

	for (unsigned int i = 0; i < 10000 && t.dev.encoders.index_count == before; i++)
		talk_wait(&t, 1);
	assert_true(t.dev.encoders.index_count != before);
}

/* Armed, with a spindle that has turned for a while, at the index. */
static void begin(double rpm, uint8_t value)
{
	ask(0x30);
	spin(rpm);
	talk_wait(&t, 1000);
	ask(0x32);
	feed(100, value);
	wait_for_index();
	assert_int_equal(bits(), 8);
}

static void it_waits_for_the_index_with_the_ring_as_it_is(void **state)
{
	(void)state;
	start(1);
	feed(5, 1);
	ask(0x30);
	assert_int_equal(bits(), 1);
	talk_wait(&t, 10);
	assert_int_equal(bits(), 2);
	feed(18, 1);
	talk_wait(&t, 30);
	ask(0x32);
	talk_wait(&t, 30);
	assert_int_equal(bits(), 4);
	assert_int_equal(t.dev.engine.ring.used, 18);
	assert_int_equal(talk_position(&t, 0), 5);
	sim_encoder_index(&t.dev, SIM_ULTRA_FAST);
	assert_int_equal(bits(), 8);
}

static void slots_are_parts_of_a_turn(void **state)
{
	(void)state;
	start(1);
	begin(RPM / 2, 10);
	talk_wait(&t, 100);
	/* half a turn of the target's hundred slots to a turn, ten pulses each */
	assert_in_range(talk_position(&t, 0), 480, 520);
	spin(0);
	talk_wait(&t, 500);
	assert_int_equal(bits(), 8);
	assert_in_range(talk_position(&t, 0), 490, 520);
	talk_ask(&t, 0x85, 0x35, 0);
	assert_in_range(wire_get_i32(t.rp + 16) + 20, 0, 40);
}

/* Z after so many turns since the index. */
static double due(double pulses_a_turn)
{
	const struct sim_thread *th = &t.dev.engine.thread;
	int64_t steps = t.dev.bench.shaft[SIM_ULTRA_FAST].position - th->base;

	return (double)steps / STEPS * pulses_a_turn;
}

/*
 * Twelve turns while the spindle slows down by `drop` and comes back, a second each.
 * The target is above all of these speeds, as it has to be.
 */
static void thread_at_changing_speed(uint8_t mode, double drop, double tolerance)
{
	unsigned int fed = 100, ms = 0;
	double worst = 0;

	start(mode);
	begin(500, 10);
	for (; t.dev.engine.ring.used || fed < 1200; ms++) {
		const unsigned int more = fed + 18 <= 1200 ? 18 : 1200 - fed;
		double apart;

		spin(ms < 2000 ? 500 - drop * (1 - fabs(ms / 1000.0 - 1)) : 500);
		if (t.dev.engine.ring.used < 100 && more) {
			feed(more, 10);
			fed += more;
		}
		talk_wait(&t, 1);
		apart = due(10 * SLOTS_A_TURN) - talk_position(&t, 0);
		if (t.dev.engine.ring.used && fabs(apart) > worst)
			worst = fabs(apart);
		assert_true(ms < 10000);
	}
	talk_wait(&t, 100);
	printf("mode %u: within %.0f of %d pulses a turn\n", mode, worst, 10 * SLOTS_A_TURN);
	assert_true(worst <= tolerance);
	assert_int_equal(talk_position(&t, 0), 12000);
	assert_int_equal(talk_position(&t, 1), 1200);
	assert_int_equal(t.dev.bench.machine.axis[0].steps, 12000);
}

static void z_follows_the_encoder(void **state)
{
	(void)state;
	thread_at_changing_speed(1, 330, 12); /* an eightieth of a turn */
	thread_at_changing_speed(3, 330, 12);
}

static void z_follows_the_index(void **state)
{
	(void)state;
	thread_at_changing_speed(0, 100, 80); /* it knows the turn before only */
	thread_at_changing_speed(2, 100, 80);
}

static void force_pauses_at_once(void **state)
{
	(void)state;
	start(1);
	feed(100, 10);
	talk_wait(&t, 10);
	ask(0x31);
	assert_int_equal(bits(), 2);
	talk_wait(&t, 50);
	assert_int_equal(talk_position(&t, 0), 100);
	ask(0x33);
	assert_int_equal(bits(), 0);
	talk_wait(&t, 100);
	assert_int_equal(talk_position(&t, 0), 1000);
}

static void release_ramps_back_and_loses_nothing(void **state)
{
	(void)state;
	start(1);
	begin(RPM / 4, 10);
	talk_wait(&t, 20);
	ask(0x33);
	assert_int_equal(bits(), 8);
	spin(0);
	talk_wait(&t, 300);
	assert_int_equal(bits(), 0);
	assert_int_equal(talk_position(&t, 0), 1000);
	feed(5, 3);
	talk_wait(&t, 5);
	assert_int_equal(talk_position(&t, 0), 1015);
}

static void cancel_stops(void **state)
{
	int32_t here;

	(void)state;
	start(1);
	begin(RPM / 2, 10);
	talk_wait(&t, 33);
	ask(0x34);
	here = talk_position(&t, 0);
	assert_int_equal(bits(), 0);
	assert_int_equal(t.dev.engine.ring.used, 0);
	talk_wait(&t, 200);
	assert_int_equal(talk_position(&t, 0), here);
	assert_int_equal(talk_engine_state(&t), SIM_PE_RUNNING);
}

static void the_engines_stop_and_a_trip_end_it(void **state)
{
	(void)state;
	start(1);
	begin(RPM / 2, 10);
	talk_set_state(&t, SIM_PE_STOPPED);
	assert_int_equal(bits(), 0);
	start(1);
	begin(RPM / 2, 10);
	sim_bench_emergency(&t.dev, true);
	talk_wait(&t, 1);
	assert_int_equal(bits(), 0);
	assert_int_equal(t.dev.engine.ring.used, 0);
}

static void ignored_axis_stands(void **state)
{
	(void)state;
	start(1);
	set(1, RPM, 200, 100, 2);
	assert_int_equal(talk_ask(&t, 0x85, 0x35, 0)[24], 2);
	begin(RPM, 10);
	talk_wait(&t, 200);
	assert_int_equal(talk_position(&t, 0), 1000);
	assert_int_equal(talk_position(&t, 1), 0);
	assert_int_equal(t.dev.engine.thread.ignored, 100);
}

static void the_generator_limits_and_loses_nothing(void **state)
{
	(void)state;
	start(1);
	begin(3 * RPM, 120);
	talk_wait(&t, 50);
	assert_true(talk_position(&t, 0) <= 51 * 125);
	talk_wait(&t, 100);
	assert_int_equal(talk_position(&t, 0), 12000);
	assert_true(t.dev.engine.thread.dry > 0);
	assert_int_equal(t.dev.engine.ring.underruns, 1);
}

static void without_a_target_nothing_is_played(void **state)
{
	(void)state;
	start(1);
	set(1, 0, 200, 100, 0);
	begin(RPM, 10);
	talk_wait(&t, 200);
	assert_int_equal(talk_position(&t, 0), 0);
}

static void it_tells_the_spindle(void **state)
{
	(void)state;
	start(1);
	begin(RPM, 1);
	talk_ask(&t, 0x85, 0x35, 0);
	assert_in_range(wire_get_u32(t.rp + 20), RPM - 7, RPM + 7);
	assert_int_equal(wire_get_u32(t.rp + 25), t.dev.encoders.index_count);
	spin(0);
	talk_wait(&t, 5000);
	talk_ask(&t, 0x85, 0x35, 0);
	assert_true(wire_get_u32(t.rp + 20) <= 12);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(it_waits_for_the_index_with_the_ring_as_it_is),
		cmocka_unit_test(slots_are_parts_of_a_turn),
		cmocka_unit_test(z_follows_the_encoder),
		cmocka_unit_test(z_follows_the_index),
		cmocka_unit_test(force_pauses_at_once),
		cmocka_unit_test(release_ramps_back_and_loses_nothing),
		cmocka_unit_test(cancel_stops),
		cmocka_unit_test(the_engines_stop_and_a_trip_end_it),
		cmocka_unit_test(ignored_axis_stands),
		cmocka_unit_test(the_generator_limits_and_loses_nothing),
		cmocka_unit_test(without_a_target_nothing_is_played),
		cmocka_unit_test(it_tells_the_spindle),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
