/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A 32-bit count out of 8-bit samples: right at every speed, wrap and gap, or
 * held; never a turn too many or too few.
 */

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <cmocka.h>
#include "sim/prng.h"
#include "tests/device/world.h"
#include "daemon/device/encoder.h"

#define NOMINAL (1 * MS)

static struct encoder encoder;
static uint64_t now;

/* Certain count and speed, as after two 32-bit reads. */
static void begin_at(int32_t count, int32_t counts_per_ms)
{
	now = 10 * SECOND;
	encoder = (struct encoder){ 0 };
	encoder_mark(&encoder);
	encoder_exact(&encoder, (int32_t)((uint32_t)count - (uint32_t)counts_per_ms), now - NOMINAL,
		      now - NOMINAL, NOMINAL);
	encoder_mark(&encoder);
	encoder_exact(&encoder, count, now - 100, now, NOMINAL);
	assert_false(encoder.doubt);
	assert_int_equal(encoder.count, count);
}

static enum encoder_verdict low(int64_t truth, uint64_t after_ns)
{
	now += after_ns;
	return encoder_low_byte(&encoder, (uint8_t)truth, now, NOMINAL);
}

static void nothing_is_taken_before_all_bits_were_read(void **state)
{
	(void)state;
	encoder = (struct encoder){ 0 };
	assert_int_equal(encoder_low_byte(&encoder, 5, 1 * SECOND, NOMINAL), ENCODER_HELD);
	assert_int_equal(encoder.count, 0);
	assert_int_equal(encoder.t_ns, 0);
	assert_int_equal(encoder_exact(&encoder, 1000, SECOND, SECOND, NOMINAL), ENCODER_HELD);
	assert_int_equal(encoder.count, 1000);
	assert_int_equal(encoder.resync, 0);
}

static void every_steady_speed_is_followed(void **state)
{
	(void)state;
	for (int32_t speed = -900; speed <= 900; speed += 7) {
		int64_t truth = 0;

		begin_at(0, speed);
		for (unsigned int i = 0; i < 500; i++) {
			truth += speed;
			assert_int_equal(low(truth, NOMINAL), ENCODER_TAKEN);
			assert_int_equal(encoder.count, truth);
		}
		assert_int_equal(encoder.resync, 0);
	}
}

static void count_wraps_at_both_ends(void **state)
{
	(void)state;
	for (int32_t speed = -60; speed <= 60; speed += 120) {
		int64_t truth = speed > 0 ? INT32_MAX - 1000 : INT32_MIN + 1000;

		begin_at((int32_t)truth, speed);
		for (unsigned int i = 0; i < 100; i++) {
			truth += speed;
			assert_int_equal(low(truth, NOMINAL), ENCODER_TAKEN);
			assert_int_equal(encoder.count, (int32_t)(uint32_t)truth);
		}
	}
}

static void sudden_change_is_held_not_guessed(void **state)
{
	(void)state;
	begin_at(5000, 0);
	assert_int_equal(low(5000 + 100, NOMINAL), ENCODER_HELD);
	assert_int_equal(encoder.count, 5000);
	/* and nothing is published until all bits are there */
	assert_int_equal(low(5000, NOMINAL), ENCODER_HELD);
	encoder_mark(&encoder);
	assert_int_equal(encoder_exact(&encoder, 5300, now, now + 100 * US, NOMINAL),
			 ENCODER_CHECK);
	assert_int_equal(encoder.count, 5300);
	assert_int_equal(encoder.resync, 1);
	now += 100 * US;
	assert_int_equal(low(5300 + 94, NOMINAL), ENCODER_TAKEN);
	assert_int_equal(encoder.count, 5394);
}

static void long_gap_is_held(void **state)
{
	(void)state;
	begin_at(0, 10);
	assert_int_equal(low(30, 3 * NOMINAL), ENCODER_HELD);
	begin_at(0, 10);
	assert_int_equal(low(20, 2 * NOMINAL), ENCODER_CHECK);
	assert_int_equal(encoder.count, 20);
}

static void gap_of_a_fast_encoder_is_held(void **state)
{
	(void)state;
	begin_at(0, 100);
	assert_int_equal(low(200, 2 * NOMINAL), ENCODER_HELD);
	assert_int_equal(encoder.count, 0);
}

static void older_sample_is_ignored(void **state)
{
	(void)state;
	begin_at(100, 0);
	assert_int_equal(encoder_low_byte(&encoder, 90, now - 10, NOMINAL), ENCODER_TAKEN);
	assert_int_equal(encoder.count, 100);
}

static void late_exact_answer_does_not_move_a_certain_count_back(void **state)
{
	(void)state;
	begin_at(0, 50);
	encoder_mark(&encoder);
	for (int64_t truth = 50; truth <= 1000; truth += 50)
		assert_int_equal(low(truth, NOMINAL), ENCODER_TAKEN);
	/* sampled at 50, answered 19 ms later */
	assert_int_equal(encoder_exact(&encoder, 50, now - 20 * MS, now, NOMINAL), ENCODER_TAKEN);
	assert_int_equal(encoder.count, 1000);
	assert_int_equal(encoder.resync, 0);
}

static void slip_is_found_and_mended(void **state)
{
	(void)state;
	begin_at(1000, 0);
	encoder_mark(&encoder);
	assert_int_equal(encoder_exact(&encoder, 1256, now, now + 1, NOMINAL), ENCODER_HELD);
	assert_int_equal(encoder.count, 1256);
	assert_int_equal(encoder.resync, 1);
	encoder_mark(&encoder);
	assert_int_equal(encoder_exact(&encoder, 1257, now, now + MS + 1, NOMINAL), ENCODER_CHECK);
	assert_int_equal(encoder.resync, 1);
}

static void count_set_from_outside_is_no_slip(void **state)
{
	(void)state;
	begin_at(1000, 0);
	encoder_forget(&encoder);
	assert_int_equal(low(0, NOMINAL), ENCODER_HELD);
	assert_int_equal(encoder.count, 1000);
	encoder_mark(&encoder);
	encoder_exact(&encoder, -70000, now, now + 1, NOMINAL);
	assert_int_equal(encoder.count, -70000);
	assert_int_equal(encoder.resync, 0);
}

/*
 * A shaft with inertia under samples that are lost, late and jittering, with
 * the 32-bit reads that the verdicts ask for. The count is never off by a
 * turn when it is published, and exact at the end.
 */
static void random_motion_under_losses_is_never_a_turn_off(void **state)
{
	struct sim_prng prng;
	uint64_t asked = 0, seed = world_seed();
	double position = 0, speed = 0, wanted = 0;
	bool open = false, wants = true;

	(void)state;
	sim_prng_init(&prng, seed);
	encoder = (struct encoder){ 0 };
	now = SECOND;
	for (unsigned int i = 0; i < 400000; i++) {
		const uint64_t jitter = sim_prng_below(&prng, 60 * US);

		if (sim_prng_below(&prng, 300) == 0)
			wanted = (double)sim_prng_below(&prng, 1200) - 600;
		speed += (wanted - speed) * 0.02;
		position += speed;
		now += NOMINAL;
		if (sim_prng_below(&prng, 100) < 10)
			continue; /* lost */
		if (encoder_low_byte(&encoder, (uint8_t)(int64_t)floor(position), now + jitter,
				     NOMINAL) != ENCODER_TAKEN)
			wants = true;
		if (open && sim_prng_below(&prng, 100) < 90) {
			if (encoder_exact(&encoder, (int32_t)floor(position), asked,
					  now + jitter + 1, NOMINAL) != ENCODER_TAKEN)
				wants = true;
			open = false;
		}
		if (encoder.known && !encoder.doubt && encoder.t_ns >= now &&
		    fabs(position - encoder.count) > 100)
			fail_msg("off by %f at %u", position - encoder.count, i);
		if (!open && (wants || i % 20 == 0)) {
			encoder_mark(&encoder);
			asked = now + jitter;
			open = true;
			wants = false;
		}
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(nothing_is_taken_before_all_bits_were_read),
		cmocka_unit_test(every_steady_speed_is_followed),
		cmocka_unit_test(count_wraps_at_both_ends),
		cmocka_unit_test(sudden_change_is_held_not_guessed),
		cmocka_unit_test(long_gap_is_held),
		cmocka_unit_test(gap_of_a_fast_encoder_is_held),
		cmocka_unit_test(older_sample_is_ignored),
		cmocka_unit_test(late_exact_answer_does_not_move_a_certain_count_back),
		cmocka_unit_test(slip_is_found_and_mended),
		cmocka_unit_test(count_set_from_outside_is_no_slip),
		cmocka_unit_test(random_motion_under_losses_is_never_a_turn_off),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
