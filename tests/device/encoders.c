/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Encoders of a simulated device behind a bad network: never a turn off, and
 * exact at the end; index pulses and counts that are set.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/encoder.h"

enum { BASIC = 5, HIGH = 20, FAST = 1, ULTRA = 25 };

static struct world world;

static int begin(void **state)
{
	(void)state;
	world_init(&world, NULL);
	world_encoder(&world, BASIC, WIRE_ENC_ENABLE | WIRE_ENC_4X, 40, 41);
	world_encoder(&world, HIGH, WIRE_ENC_ENABLE | WIRE_ENC_4X, 42, 43);
	world_fast_encoders(&world, true, true);
	world_start(&world);
	world_commander(&world, 5);
	world_until(&world, world_is_running, 500 * MS);
	return 0;
}

static int32_t truth(unsigned int encoder)
{
	sim_rig_run(&world.rig, world.now);
	return (int32_t)world.rig.device.encoders.raw[encoder];
}

static void turn(unsigned int encoder, int64_t counts_per_s)
{
	world.rig.device.bench.shaft[encoder].rate = counts_per_s;
}

static void counts_are_followed_each_cycle(void **state)
{
	(void)state;
	turn(BASIC, 50000);
	turn(HIGH, -90000);
	turn(FAST, 100000);
	turn(ULTRA, 3000000);
	world_run(&world, 100 * MS);
	for (unsigned int i = 0; i < 2000; i++) {
		world_cycle(&world);
		assert_in_range(truth(BASIC) - world.state.encoder[BASIC], 0, 100);
		assert_in_range(world.state.encoder[HIGH] - truth(HIGH), 0, 180);
		assert_in_range(truth(FAST) - world.state.encoder[FAST], 0, 200);
		assert_in_range(truth(ULTRA) - world.state.encoder[ULTRA], 0, 6000);
		assert_true(world.state.t_publish_ns - world.state.encoder_t_ns[BASIC] < 1 * MS);
	}
	assert_int_equal(world.state.encoder_resync[BASIC], 0);
	assert_int_equal(world.state.encoder_resync[HIGH], 0);
}

static void encoder_that_is_off_stays_at_zero(void **state)
{
	(void)state;
	turn(7, 10000);
	world_run(&world, 100 * MS);
	assert_int_equal(world.state.encoder[7], 0);
	assert_int_equal(world.state.encoder_t_ns[7], 0);
}

static void count_from_before_the_start_is_taken_over(void **state)
{
	(void)state;
	sim_bench_encoder(&world.rig.device, BASIC, 0x12345678);
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	world_run(&world, 20 * MS);
	assert_int_equal(world.state.encoder[BASIC], 0x12345678);
	assert_int_equal(world.state.encoder_resync[BASIC], 0);
}

static void counts_wrap_without_a_jump(void **state)
{
	int32_t last;

	(void)state;
	sim_bench_encoder(&world.rig.device, BASIC, 0x7fffff00);
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	world_run(&world, 20 * MS);
	turn(BASIC, 60000);
	last = world.state.encoder[BASIC];
	for (unsigned int i = 0; i < 100; i++) {
		world_cycle(&world);
		assert_in_range((uint32_t)world.state.encoder[BASIC] - (uint32_t)last, 0, 200);
		last = world.state.encoder[BASIC];
	}
	assert_true(last < 0);
}

/* Speeds change, packets are lost: published counts are late, never a turn off. */
static void losses_cost_age_but_no_count(void **state)
{
	static const double losses[] = { 0.001, 0.01, 0.05, 0.1, 0.33 };
	struct sim_prng prng;
	const uint64_t seed = world_seed();

	sim_prng_init(&prng, seed);
	for (unsigned int round = 0; round < 5; round++) {
		int64_t speed = 0;

		begin(state);
		sim_prng_init(&world.rig.link.way[0].prng, seed + round);
		sim_prng_init(&world.rig.link.way[1].prng, seed * 3 + round);
		world_run(&world, 50 * MS);
		world_loss(&world, losses[round]);
		for (unsigned int i = 0; i < 20000; i++) {
			const struct pokeys_state *s = &world.state;

			if (i % 400 < 40)
				speed += (int64_t)sim_prng_below(&prng, 10000) - 5000;
			if (speed > 100000 || speed < -100000)
				speed = 0;
			turn(BASIC, speed);
			world_cycle(&world);
			if (s->encoder_t_ns[BASIC] + 1 * MS < s->t_publish_ns)
				continue;
			assert_in_range(llabs((int64_t)truth(BASIC) - s->encoder[BASIC]), 0, 250);
		}
		turn(BASIC, 0);
		world_loss(&world, 0);
		/* with so many losses twenty cycles in a row are silent now and then: lost */
		world_until(&world, world_is_running, 5 * SECOND);
		world_run(&world, 200 * MS);
		assert_int_equal(world.state.encoder[BASIC], truth(BASIC));
	}
}

static void all_bits_are_read_at_once_after_a_gap(void **state)
{
	(void)state;
	world.config.encoder_hz = 1;
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	turn(BASIC, 60000);
	for (unsigned int i = 0; i < 50; i++) {
		world_run(&world, 40 * MS);
		sim_rig_silence(&world.rig, world.now, 7 * MS);
		world_run(&world, 7 * MS + 12 * MS);
		assert_true(world.state.t_publish_ns - world.state.encoder_t_ns[BASIC] < 3 * MS);
		assert_in_range(llabs((int64_t)truth(BASIC) - world.state.encoder[BASIC]), 0, 180);
	}
}

static void count_is_exact_after_any_chaos(void **state)
{
	const struct sim_link_faults faults = {
		.delay = { SIM_DELAY_HEAVY_TAIL, 30 * US, 8 * MS, 1.3 },
		.reorder = 0.1,
		.reorder_ns = 2 * MS,
		.loss = 0.1,
		.duplicate = 0.1,
		.burst_every_ns = 300 * MS,
		.burst_length_ns = 30 * MS,
		.burst_loss = 1,
	};
	const uint64_t seed = world_seed();

	for (unsigned int round = 0; round < 10; round++) {
		begin(state);
		sim_prng_init(&world.rig.link.way[0].prng, seed + round);
		sim_prng_init(&world.rig.link.way[1].prng, seed * 5 + round);
		world_faults(&world, &faults);
		for (unsigned int i = 0; i < 10; i++) {
			turn(BASIC, (int64_t)(seed >> i & 0xffff) * 4 - 131072);
			turn(HIGH, (int64_t)(seed >> i & 0xffff) * 2 - 65536);
			turn(FAST, 400000);
			turn(ULTRA, 4000000);
			world_run(&world, 300 * MS);
		}
		for (unsigned int i = 0; i < 26; i++)
			turn(i, 0);
		world_loss(&world, 0);
		world_run(&world, 1 * SECOND);
		assert_int_equal(world.state.encoder[BASIC], truth(BASIC));
		assert_int_equal(world.state.encoder[HIGH], truth(HIGH));
		assert_int_equal(world.state.encoder[FAST], truth(FAST));
		assert_int_equal(world.state.encoder[ULTRA], truth(ULTRA));
	}
}

static enum pokeys_outcome shot(uint8_t operation, uint8_t index, int32_t value)
{
	const struct pokeys_one_shot s = {
		.operation = operation,
		.index = index,
		.value = { value },
	};

	return world_do(&world, &s, 500 * MS);
}

static void refuses(uint8_t operation, uint8_t index, unsigned int reason)
{
	const struct pokeys_one_shot s = { .operation = operation, .index = index };

	world_refuses(&world, &s, reason, index);
}

static void count_can_be_set_while_others_stand_or_turn(void **state)
{
	int64_t before;
	uint64_t begun;

	(void)state;
	turn(FAST, 20000);
	world_run(&world, 100 * MS);
	before = truth(FAST);
	begun = world.tick;
	assert_int_equal(shot(POKEYS_ONE_SHOT_SET_ENCODER, BASIC, -777), POKEYS_OUTCOME_DONE);
	world_run(&world, 10 * MS);
	assert_int_equal(truth(BASIC), -777);
	assert_int_equal(world.state.encoder[BASIC], -777);
	assert_int_equal(world.state.encoder_resync[BASIC], 0);
	/* the turning one went on as if nothing had happened, within one slot of 1 ms */
	world_run(&world, 100 * MS);
	assert_in_range(llabs(truth(FAST) - before - (int64_t)((world.tick - begun) / MS * 20)), 0,
			25);
	assert_int_equal(shot(POKEYS_ONE_SHOT_SET_ENCODER, HIGH, 5), POKEYS_OUTCOME_DONE);
	assert_int_equal(truth(HIGH), 5);
	assert_int_equal(shot(POKEYS_ONE_SHOT_SET_ENCODER, ULTRA, 99), POKEYS_OUTCOME_DONE);
	assert_int_equal(truth(ULTRA), 99);
	refuses(POKEYS_ONE_SHOT_SET_ENCODER, 26, REFUSAL_NO_ENCODER);
}

static void ultra_fast_index_zeroes_and_is_seen_once(void **state)
{
	(void)state;
	turn(ULTRA, 100000);
	world_run(&world, 100 * MS);
	assert_int_equal(shot(POKEYS_ONE_SHOT_ARM_INDEX, ULTRA, 0), POKEYS_OUTCOME_DONE);
	world_run(&world, 20 * MS);
	assert_false(world.state.encoder_index >> ULTRA & 1);
	sim_encoder_index(&world.rig.device, ULTRA);
	world_run(&world, 2 * MS);
	assert_true(world.state.encoder_index >> ULTRA & 1);
	assert_in_range(world.state.encoder[ULTRA], 0, 400);
	sim_encoder_index(&world.rig.device, ULTRA);
	world_run(&world, 20 * MS);
	assert_in_range(world.state.encoder[ULTRA], 450, 650); /* 20 ms of 25 counts/ms */
	/* armed again, the mark is taken down first */
	assert_int_equal(shot(POKEYS_ONE_SHOT_ARM_INDEX, ULTRA, 0), POKEYS_OUTCOME_DONE);
	assert_false(world.state.encoder_index >> ULTRA & 1);
}

static void fast_index_zeroes_and_is_disarmed(void **state)
{
	(void)state;
	turn(FAST, 50000);
	world_run(&world, 100 * MS);
	sim_encoder_index(&world.rig.device, FAST);
	world_run(&world, 5 * MS);
	assert_true(truth(FAST) > 4000); /* not armed: the pulse does nothing */
	assert_int_equal(shot(POKEYS_ONE_SHOT_ARM_INDEX, FAST, 0), POKEYS_OUTCOME_DONE);
	assert_int_equal(world.rig.device.config.encoders.fast_index & 1, 1);
	world_run(&world, 5 * MS);
	sim_encoder_index(&world.rig.device, FAST);
	world_run(&world, 6 * MS);
	assert_true(world.state.encoder_index >> FAST & 1);
	assert_int_equal(world.rig.device.config.encoders.fast_index & 1, 0);
	assert_in_range(llabs((int64_t)truth(FAST) - world.state.encoder[FAST]), 0, 150);
	assert_int_equal(world.state.encoder_resync[FAST], 0);
	sim_encoder_index(&world.rig.device, FAST);
	world_run(&world, 50 * MS);
	assert_true(world.state.encoder[FAST] > 2000);
}

/* Settings are read anew while an index is awaited: neither may undo the other. */
static void index_and_settings_do_not_disturb_each_other(void **state)
{
	(void)state;
	assert_int_equal(shot(POKEYS_ONE_SHOT_ARM_INDEX, FAST, 0), POKEYS_OUTCOME_DONE);
	assert_int_equal(device_order(world.device, DEVICE_ORDER_APPLY), 0);
	world_run(&world, 300 * MS);
	assert_int_equal(world.rig.device.config.encoders.fast_index & 1, 1);
	turn(FAST, 5000);
	world_run(&world, 200 * MS);
	sim_encoder_index(&world.rig.device, FAST);
	world_run(&world, 200 * MS);
	assert_true(world.state.encoder_index >> FAST & 1);
	assert_int_equal(world.rig.device.config.encoders.fast_index & 1, 0);
	world_run(&world, 200 * MS);
	assert_int_equal(world.state.config_state, POKEYS_CONFIG_APPLIED);
	assert_int_equal(shot(POKEYS_ONE_SHOT_ARM_INDEX, FAST, 0), POKEYS_OUTCOME_DONE);
	assert_int_equal(world.rig.device.config.encoders.fast_index & 1, 1);
}

static void index_that_is_not_to_be_had_is_refused(void **state)
{
	(void)state;
	refuses(POKEYS_ONE_SHOT_ARM_INDEX, BASIC, REFUSAL_NO_INDEX);
	world_fast_encoders(&world, false, false);
	world_start(&world);
	world_commander(&world, 6);
	world_until(&world, world_is_running, 500 * MS);
	refuses(POKEYS_ONE_SHOT_ARM_INDEX, ULTRA, REFUSAL_NO_INDEX);
	refuses(POKEYS_ONE_SHOT_ARM_INDEX, FAST, REFUSAL_NO_INDEX);
}

static void fast_motion_towards_zero_is_no_index(void **state)
{
	(void)state;
	sim_bench_encoder(&world.rig.device, ULTRA, 3000000);
	turn(ULTRA, -2000000);
	world_run(&world, 100 * MS);
	assert_int_equal(shot(POKEYS_ONE_SHOT_ARM_INDEX, ULTRA, 0), POKEYS_OUTCOME_DONE);
	for (unsigned int i = 0; i < 2500; i++) {
		world_cycle(&world);
		assert_false(world.state.encoder_index >> ULTRA & 1);
	}
}

/*
 * A count that began again is in no image in which the epoch is the one of before: whoever
 * jogs by it would take it for turns. No device begins to answer within 15 ms.
 */
static void a_new_count_is_told_in_the_image_that_has_it(void **state)
{
	static const unsigned int boot_ms[] = { 15, 100, 1000 };

	for (size_t i = 0; i < 3 * sizeof(boot_ms) / sizeof(boot_ms[0]); i++) {
		int32_t before[POKEYS_ENCODERS];
		uint8_t epoch;

		begin(state);
		sim_bench_encoder(&world.rig.device, BASIC, 5000);
		sim_bench_encoder(&world.rig.device, HIGH, 77);
		sim_bench_encoder(&world.rig.device, ULTRA, 90000);
		world_run(&world, 500 * MS + i * 37 * MS);
		assert_int_equal(world.state.encoder[BASIC], 5000);
		epoch = world.state.encoder_epoch;
		memcpy(before, world.state.encoder, sizeof(before));
		world.rig.device.options.boot_ms = boot_ms[i / 3];
		sim_rig_reboot(&world.rig, world.now, false);
		for (int n = 0; n < 4000; n++) {
			world_cycle(&world);
			if (world.state.encoder_epoch == epoch)
				assert_memory_equal(world.state.encoder, before, sizeof(before));
			else /* no sample of before, which a reader may not have seen yet */
				assert_true(!world.state.encoder_t_ns[BASIC] ||
					    world.state.encoder[BASIC] == 0);
		}
		assert_int_not_equal(world.state.encoder_epoch, epoch);
		assert_int_equal(world.state.encoder[BASIC], 0);
		assert_int_equal(world.state.encoder[ULTRA], 0);
	}
}

/* ... and a cable that was out tells nothing. */
static void a_silence_is_no_new_count(void **state)
{
	const uint8_t epoch = (begin(state), world.state.encoder_epoch);

	turn(BASIC, 20000);
	for (int n = 0; n < 20; n++) {
		sim_rig_silence(&world.rig, world.now, (uint64_t)(1 + n * 40) * MS);
		world_run(&world, (uint64_t)(1 + n * 40) * MS);
		world_until(&world, world_is_running, 3 * SECOND);
		world_run(&world, 200 * MS);
		assert_int_equal(world.state.encoder_epoch, epoch);
		assert_in_range(truth(BASIC) - world.state.encoder[BASIC], 0, 100);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(counts_are_followed_each_cycle, begin),
		cmocka_unit_test_setup(encoder_that_is_off_stays_at_zero, begin),
		cmocka_unit_test_setup(count_from_before_the_start_is_taken_over, begin),
		cmocka_unit_test_setup(a_new_count_is_told_in_the_image_that_has_it, begin),
		cmocka_unit_test_setup(a_silence_is_no_new_count, begin),
		cmocka_unit_test_setup(counts_wrap_without_a_jump, begin),
		cmocka_unit_test(losses_cost_age_but_no_count),
		cmocka_unit_test_setup(all_bits_are_read_at_once_after_a_gap, begin),
		cmocka_unit_test(count_is_exact_after_any_chaos),
		cmocka_unit_test_setup(count_can_be_set_while_others_stand_or_turn, begin),
		cmocka_unit_test_setup(ultra_fast_index_zeroes_and_is_seen_once, begin),
		cmocka_unit_test_setup(fast_index_zeroes_and_is_disarmed, begin),
		cmocka_unit_test_setup(index_and_settings_do_not_disturb_each_other, begin),
		cmocka_unit_test_setup(index_that_is_not_to_be_had_is_refused, begin),
		cmocka_unit_test_setup(fast_motion_towards_zero_is_no_index, begin),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
