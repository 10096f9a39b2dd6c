/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Each fault switches a heater off within its time and is latched: while it gets warm, while it
 * is warm, while it cools down to a lower target. Whatever happens, there is no power while
 * anything is wrong.
 */
#include "tests/loops/oven.h"

#include <math.h>
#include <pokeys/names.h>
#include <stdio.h>
#include <stdlib.h>

#define PERIOD 0.1

/* A heater in each state in which it has power, or may have. */
enum phase { HEATING, WARM, COOLING, PHASES };

static void in_phase(struct oven *oven, enum phase phase)
{
	oven_init(oven, &heater_usual, &sim_heat_hotend);
	if (phase == HEATING) {
		oven->target = 200;
		oven_run(oven, 30);
		return;
	}
	oven_warm(oven, phase == WARM ? 200 : 220);
	if (phase == COOLING) {
		oven->target = 150;
		oven_run(oven, 5);
	}
}

static void expect_within(struct oven *oven, double seconds, enum heater_fault fault)
{
	const double took = oven_until_fault(oven, seconds);

	oven_expect_fault(oven, fault);
	assert_true(took > 0 && took <= seconds);
}

/* The fault stays whatever is commanded, and after it is cleared, off has to be commanded. */
static void is_latched(struct oven *oven)
{
	const enum heater_fault fault = oven->heater.fault;

	/* nothing is wrong any more, but somebody still commands a target, or another one */
	for (int i = 0; i < 100; i++) {
		oven->target = i % 3 ? 180 + i % 7 : 200;
		oven_step(oven);
		oven_expect_fault(oven, fault);
		assert_int_equal(oven->heater.refusal, HEATER_AFTER_FAULT);
	}
	assert_true(heater_reset(&oven->heater));
	oven_run(oven, 10);
	assert_true(oven->power == 0 && oven->heater.target == 0);
	oven->target = 0;
	oven_step(oven);
	oven->target = 200;
	oven_run(oven, 1);
	oven_expect_fault(oven, HEATER_FINE);
	assert_true(oven->heater.target == 200);
}

static void sensor_faults(void **state)
{
	static const struct {
		enum sim_heat_fault broken;
		enum heater_fault fault;
	} rows[] = { { SIM_HEAT_OPEN, HEATER_OPEN }, { SIM_HEAT_SHORT, HEATER_SHORTED } };
	struct oven oven;

	(void)state;
	for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++)
		for (enum phase phase = 0; phase < PHASES; phase++) {
			in_phase(&oven, phase);
			sim_heat_break(&oven.heat, rows[i].broken);
			expect_within(&oven, PERIOD, rows[i].fault);
			oven_run(&oven, 60);
			assert_false(heater_reset(&oven.heater));
			oven_expect_fault(&oven, rows[i].fault);
			sim_heat_break(&oven.heat, SIM_HEAT_GOOD);
			oven_run(&oven, 1);
			is_latched(&oven);
		}
}

/* Readings of a period, beside ten good ones: so many at once, before or behind them. */
static void feed(struct oven *oven, double reading, int count)
{
	for (int k = 0; k < count; k++)
		heater_sample(&oven->heater, reading, oven->now_ns);
}

static void readings_that_are_none(void **state)
{
	static const double odd[] = { NAN, INFINITY, -INFINITY, -0.5, 1.5 };
	struct oven oven;

	(void)state;
	for (size_t i = 0; i < sizeof(odd) / sizeof(odd[0]); i++)
		for (enum phase phase = 0; phase < PHASES; phase++) {
			in_phase(&oven, phase);
			/* one is enough, however many good ones come behind it */
			feed(&oven, odd[i], 1);
			feed(&oven, 0.04, 2 * HEATER_SAMPLES);
			expect_within(&oven, PERIOD, HEATER_ODD);
			oven_run(&oven, 1);
			is_latched(&oven);
		}
}

static void a_wire_that_is_loose(void **state)
{
	static const struct {
		double reading;
		enum heater_fault fault;
	} rows[] = { { 1, HEATER_OPEN }, { 0, HEATER_SHORTED } };
	struct oven oven;

	(void)state;
	for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++)
		for (enum phase phase = 0; phase < PHASES; phase++) {
			in_phase(&oven, phase);
			/* one may be a disturbance; two of a period are not voted away */
			feed(&oven, rows[i].reading, 1);
			oven_step(&oven);
			oven_expect_fault(&oven, HEATER_FINE);
			feed(&oven, rows[i].reading, 2);
			expect_within(&oven, PERIOD, rows[i].fault);
			oven_run(&oven, 1);
			is_latched(&oven);
			/* all that there are */
			in_phase(&oven, phase);
			oven.silent = true;
			feed(&oven, rows[i].reading, 1);
			expect_within(&oven, PERIOD, rows[i].fault);
		}
}

static void data_that_are_old(void **state)
{
	struct oven oven;
	double took;

	(void)state;
	for (enum phase phase = 0; phase < PHASES; phase++) {
		in_phase(&oven, phase);
		oven.silent = true;
		took = oven_until_fault(&oven, 10);
		oven_expect_fault(&oven, HEATER_STALE);
		/* older than 0.3 s, and within a period after that */
		assert_true(took > 0.3 && took <= 0.3 + PERIOD + 1e-9);
		oven_run(&oven, 30);
		assert_false(heater_reset(&oven.heater));
		oven.silent = false;
		oven_run(&oven, 1);
		is_latched(&oven);
		/* a short pause is none */
		oven.silent = true;
		oven_run(&oven, 0.2);
		oven.silent = false;
		oven_run(&oven, 10);
		oven_expect_fault(&oven, HEATER_FINE);
	}
}

static void readings_from_the_future(void **state)
{
	struct oven oven;

	(void)state;
	in_phase(&oven, WARM);
	heater_sample(&oven.heater, 0.04, oven.now_ns + UINT64_C(3600000000000));
	oven.silent = true;
	expect_within(&oven, PERIOD, HEATER_STALE);
}

static void a_device_that_is_lost(void **state)
{
	struct oven oven;

	(void)state;
	for (enum phase phase = 0; phase < PHASES; phase++) {
		in_phase(&oven, phase);
		oven.device = false;
		expect_within(&oven, PERIOD, HEATER_DEVICE);
		assert_false(heater_reset(&oven.heater));
		oven.device = true;
		oven_run(&oven, 1);
		is_latched(&oven);
		/* for less than a period: it was restarted */
		in_phase(&oven, phase);
		heater_device(&oven.heater, false);
		heater_device(&oven.heater, true);
		assert_false(heater_reset(&oven.heater));
		expect_within(&oven, PERIOD, HEATER_DEVICE);
	}
}

static void too_hot_and_too_cold(void **state)
{
	struct oven oven;

	(void)state;
	for (enum phase phase = 0; phase < PHASES; phase++) {
		in_phase(&oven, phase);
		/* it is hotter and hotter, as fast as can be believed */
		sim_heat_break(&oven.heat, SIM_HEAT_DRIFT);
		oven.heat.drift = 15;
		expect_within(&oven, 20, HEATER_OVER);
		assert_true(oven.heater.temperature < heater_usual.most + 2);
		oven_run(&oven, 1);
		assert_false(heater_reset(&oven.heater));
	}
	/* colder and colder, from not very warm: otherwise it would fall before */
	oven_init(&oven, &heater_usual, &sim_heat_hotend);
	oven_warm(&oven, 30);
	sim_heat_break(&oven.heat, SIM_HEAT_DRIFT);
	oven.heat.drift = -10;
	expect_within(&oven, 5, HEATER_UNDER);
	assert_false(heater_reset(&oven.heater));
	/* too hot although it is off: that, too, is to be seen */
	oven_init(&oven, &heater_usual, &sim_heat_hotend);
	oven_run(&oven, 1);
	for (int i = 0; i < 3000 && !oven.heater.fault; i++) {
		oven.heat.block += 1;
		oven_step(&oven);
	}
	oven_expect_fault(&oven, HEATER_OVER);
}

/* A fault of before is no reason to wait for the device; but a fault of the device is. */
static void a_reset_does_not_wait_for_the_device(void **state)
{
	struct oven oven;

	(void)state;
	oven_init(&oven, &heater_usual, &sim_heat_hotend);
	oven.device = false;
	for (int i = 0; i < 3000 && !oven.heater.fault; i++) {
		oven.heat.block += 1;
		oven_step(&oven);
	}
	oven_expect_fault(&oven, HEATER_OVER);
	assert_false(heater_reset(&oven.heater));
	oven.heat.block = oven.heat.sensor = 200;
	oven_run(&oven, 20);
	assert_int_equal(oven.heater.condition, HEATER_DEVICE);
	assert_true(heater_reset(&oven.heater));
	oven_run(&oven, 1);
	assert_int_equal(oven.heater.fault, HEATER_FINE);
	/* a sensor that is not good still is one */
	oven.silent = true;
	oven_run(&oven, 1);
	assert_false(heater_reset(&oven.heater));
}

static void a_temperature_that_jumps(void **state)
{
	struct oven oven;

	(void)state;
	for (int sign = -1; sign <= 1; sign += 2)
		for (enum phase phase = 0; phase < PHASES; phase++) {
			in_phase(&oven, phase);
			oven.heat.drifted = 12 * sign;
			expect_within(&oven, PERIOD, HEATER_JUMP);
			oven.heat.drifted = 0;
			oven_run(&oven, 2);
			is_latched(&oven);
			/* a little less than that in each period is a jump within a second */
			in_phase(&oven, phase);
			sim_heat_break(&oven.heat, SIM_HEAT_DRIFT);
			oven.heat.drift = 35 * sign;
			oven.heat.config.noise = 0;
			expect_within(&oven, 1, HEATER_JUMP);
		}
}

static void a_heater_that_is_broken(void **state)
{
	struct oven oven;

	(void)state;
	/* from cold: 40 s are the most that is waited */
	oven_init(&oven, &heater_usual, &sim_heat_hotend);
	oven.heat.config.watts = 0;
	oven.target = 200;
	expect_within(&oven, 42, HEATER_NO_RISE);
	/* while it gets warm: how fast it can be is known then */
	in_phase(&oven, HEATING);
	oven.heat.config.watts = 0;
	expect_within(&oven, 22, HEATER_NO_RISE);
	/* when it was warm */
	in_phase(&oven, WARM);
	oven.heat.config.watts = 0;
	expect_within(&oven, 30, HEATER_FELL);
	oven_run(&oven, 1);
	is_latched(&oven);
	/* While it cools down to a lower target, no power is needed. At the target, it is. */
	in_phase(&oven, COOLING);
	oven.heat.config.watts = 0;
	oven_run(&oven, 20);
	oven_expect_fault(&oven, HEATER_FINE);
	expect_within(&oven, 200, HEATER_FELL);
}

/* A commander that goes on commanding is no reason to wait for ever. */
static void a_target_that_changes_hides_nothing(void **state)
{
	struct oven oven;

	(void)state;
	/* The sensor is stuck far below. Two targets alternate; every fifth one is refused. */
	in_phase(&oven, HEATING);
	sim_heat_break(&oven.heat, SIM_HEAT_STUCK);
	for (int i = 0; i < 200 && !oven.heater.fault; i++) {
		oven.target = i % 5 == 4 ? 300 : i % 2 ? 200 : 200.5;
		oven_run(&oven, 1);
	}
	oven_expect_fault(&oven, HEATER_NO_RISE);
	assert_true(oven.heat.block < heater_usual.most);
	/* nothing is heated at all, and the target goes up and up */
	oven_init(&oven, &heater_usual, &sim_heat_hotend);
	oven.heat.config.watts = 0;
	oven.target = 60;
	for (int i = 0; i < 60 && !oven.heater.fault; i++) {
		oven_run(&oven, 1);
		oven.target += 0.5;
	}
	oven_expect_fault(&oven, HEATER_NO_RISE);
}

/* A thermostat, or a timer, around a sensor that fell out: it is in the room, and so never warm. */
static void a_target_that_comes_and_goes_hides_nothing(void **state)
{
	struct oven oven;

	(void)state;
	for (int pause = 1; pause < 32; pause += 6) {
		oven_init(&oven, &heater_usual, &sim_heat_hotend);
		sim_heat_break(&oven.heat, SIM_HEAT_OUT);
		for (int i = 0; i < 20 && !oven.heater.fault; i++) {
			oven.target = 100;
			oven_run(&oven, 5);
			oven.target = 0;
			oven_run(&oven, pause);
		}
		oven_expect_fault(&oven, HEATER_NO_RISE);
		/* who has seen to it has a whole window again */
		sim_heat_break(&oven.heat, SIM_HEAT_GOOD);
		oven_run(&oven, 10);
		assert_true(heater_reset(&oven.heater));
		oven.target = 0;
		oven_run(&oven, 1);
		oven_warm(&oven, 150);
	}
	/* one that keeps a temperature far from its target by itself is in order */
	oven_init(&oven, &heater_usual, &sim_heat_bed);
	oven.target = 60;
	while (oven.heater.temperature < 50)
		oven_step(&oven);
	for (int i = 0; i < 36000; i++) {
		if (oven.heater.temperature < 49.8)
			oven.target = 100;
		else if (oven.heater.temperature > 50.2)
			oven.target = 0;
		oven_step(&oven);
		oven_expect_fault(&oven, HEATER_FINE);
	}
	/* one that is switched on and off all day, at random, is in order */
	struct sim_prng prng;

	sim_prng_init(&prng, 20055);
	oven_init(&oven, &heater_usual, &sim_heat_hotend);
	for (int i = 0; i < 3000; i++) {
		oven.target = i % 2 ? 0 : 60 + (double)sim_prng_below(&prng, 180);
		oven_run(&oven, 0.1 * (double)(1 + sim_prng_below(&prng, i % 5 ? 300 : 3000)));
		oven_expect_fault(&oven, HEATER_FINE);
	}
}

static void a_sensor_that_fell_out(void **state)
{
	struct sim_heat_config heat = sim_heat_hotend;
	struct oven oven;

	(void)state;
	/* it cools down slowly, as in still air; a stronger heater has less time */
	for (heat.watts = 40; heat.watts <= 60; heat.watts += 20)
		for (enum phase phase = 0; phase < COOLING; phase++) {
			in_phase(&oven, phase);
			oven.heat.config.watts = heat.watts;
			oven_run(&oven, 30);
			sim_heat_break(&oven.heat, SIM_HEAT_OUT);
			oven.heat.config.lag_s = 12;
			assert_true(oven_until_fault(&oven, 60) > 0);
			assert_true(oven.heater.fault == HEATER_FELL ||
				    oven.heater.fault == HEATER_NO_RISE);
			oven_run(&oven, 60);
			if (oven.heat.block >= heater_usual.most)
				fail_msg("%g W: %g degrees", heat.watts, oven.heat.block);
		}
}

static void a_sensor_that_is_stuck_or_drifts(void **state)
{
	struct oven oven;
	double noise;

	(void)state;
	/* near the target: the power goes up and up, whatever the noise */
	for (int below = 1; below <= 3; below++)
		for (noise = 0; noise <= 0.8; noise += 0.4) {
			in_phase(&oven, WARM);
			oven.heat.config.noise = noise;
			sim_heat_break(&oven.heat, SIM_HEAT_STUCK);
			oven.heat.stuck = 200 - below;
			expect_within(&oven, 50 + 200 / below, HEATER_UNHEEDED);
		}
	/* on the way */
	in_phase(&oven, HEATING);
	sim_heat_break(&oven.heat, SIM_HEAT_STUCK);
	expect_within(&oven, 22, HEATER_NO_RISE);
	/* it says less and less: that cannot be seen before the power is full */
	in_phase(&oven, WARM);
	sim_heat_break(&oven.heat, SIM_HEAT_DRIFT);
	oven.heat.drift = -1;
	assert_true(oven_until_fault(&oven, 400) > 0);
	assert_true(oven.heater.fault == HEATER_FELL || oven.heater.fault == HEATER_UNHEEDED);
}

/* What must not be: judged by what was done to it, and not by what it says of itself. */
struct truth {
	int broken, silent, unmanned; /* periods in a row */
	bool lost, fed;               /* in this period */
};

static void no_power_while_something_is_wrong(const struct oven *oven, struct truth *truth)
{
	const bool ends = oven->heat.fault == SIM_HEAT_OPEN || oven->heat.fault == SIM_HEAT_SHORT;

	truth->broken = ends && !oven->silent ? truth->broken + 1 : 0;
	truth->silent = oven->silent ? truth->silent + 1 : 0;
	truth->unmanned = oven->commander ? 0 : truth->unmanned + 1;
	if (truth->broken || truth->silent > 3 || truth->unmanned > 5 || truth->lost ||
	    truth->fed || !oven->device || !(oven->heater.wanted > 0 || oven->heater.target > 0))
		assert_true(oven->power == 0);
	if (oven->heat.fault == SIM_HEAT_GOOD && !oven->silent && oven->heat.sensor > 281)
		assert_true(oven->power == 0);
	assert_true(oven->power >= 0 && oven->power <= 1);
	if (oven->heater.condition || oven->heater.fault)
		assert_true(oven->power == 0);
}

static void disturb(struct oven *oven, struct truth *truth, struct sim_prng *prng)
{
	if (sim_prng_chance(prng, 0.001)) {
		sim_heat_break(&oven->heat,
			       sim_prng_chance(prng, 0.7) ?
				       SIM_HEAT_GOOD :
				       (enum sim_heat_fault)sim_prng_below(prng, SIM_HEAT_OUT + 1));
		oven->heat.drift = 20 * sim_prng_unit(prng) - 10;
		oven->heat.config.watts = sim_prng_chance(prng, 0.8) ? 40 : 0;
	}
	if (sim_prng_chance(prng, 0.002))
		oven->target = 300 * sim_prng_unit(prng) - 5;
	if (sim_prng_chance(prng, 0.002))
		oven->target = sim_prng_chance(prng, 0.1) ? NAN : 0;
	if (sim_prng_chance(prng, 0.005))
		heater_reset(&oven->heater);
	truth->fed = sim_prng_chance(prng, 0.0001);
	if (truth->fed)
		heater_sample(&oven->heater, NAN, oven->now_ns);
	truth->lost = sim_prng_chance(prng, 0.0001);
	if (truth->lost)
		heater_device(&oven->heater, false);
	oven->device = sim_prng_chance(prng, oven->device ? 0.9999 : 0.1);
	oven->silent = !sim_prng_chance(prng, oven->silent ? 0.3 : 0.9995);
	oven->commander = sim_prng_chance(prng, oven->commander ? 0.9998 : 0.1);
	oven->fan = sim_prng_chance(prng, 0.001) ? !oven->fan : oven->fan;
}

static void whatever_happens_at_random(void **state)
{
	const char *given = getenv("POKEYS_SEED");
	struct sim_prng prng;
	unsigned int faults[HEATER_FAULTS] = { 0 }, powered = 0;

	(void)state;
	sim_prng_init(&prng, given ? strtoull(given, NULL, 0) : 20055);
	for (int run = 0; run < 60; run++) {
		struct truth truth = { 0 };
		struct oven oven;

		oven_init(&oven, &heater_usual, &sim_heat_hotend);
		for (int i = 0; i < 20000; i++) {
			disturb(&oven, &truth, &prng);
			oven_step(&oven);
			no_power_while_something_is_wrong(&oven, &truth);
			faults[oven.heater.fault]++;
			powered += oven.power > 0;
		}
	}
	assert_true(powered > 10000);
	for (int i = HEATER_DEVICE; i < HEATER_FAULTS; i++)
		printf("%7u steps: %s\n", faults[i], pokeys_heater_fault_name((uint8_t)i));
	/* the others take a longer time than nothing else goes wrong here */
	for (int i = HEATER_DEVICE; i <= HEATER_NO_RISE; i++)
		if (i != HEATER_UNDER)
			assert_true(faults[i] > 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(sensor_faults),
		cmocka_unit_test(readings_that_are_none),
		cmocka_unit_test(a_wire_that_is_loose),
		cmocka_unit_test(data_that_are_old),
		cmocka_unit_test(readings_from_the_future),
		cmocka_unit_test(a_device_that_is_lost),
		cmocka_unit_test(too_hot_and_too_cold),
		cmocka_unit_test(a_reset_does_not_wait_for_the_device),
		cmocka_unit_test(a_temperature_that_jumps),
		cmocka_unit_test(a_heater_that_is_broken),
		cmocka_unit_test(a_target_that_changes_hides_nothing),
		cmocka_unit_test(a_target_that_comes_and_goes_hides_nothing),
		cmocka_unit_test(a_sensor_that_fell_out),
		cmocka_unit_test(a_sensor_that_is_stuck_or_drifts),
		cmocka_unit_test(whatever_happens_at_random),
	};

	return cmocka_run_group_tests_name("faults", tests, NULL, NULL);
}
