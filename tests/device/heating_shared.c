/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What heaters have beside them: a supply that does not suffice for all, and their fans. */

#include <math.h>
#include "tests/device/heat_rig.h"
#include "wire/io.h"

enum { FAN_PIN = 14, BED_PWM = 4, COOLER_PWM = 5, SETTLE = 5 };
#define BUDGET 50.0
#define HOTEND_WATTS 40.0
#define BED_WATTS 60.0

/* Two heaters at a supply for half of them; the bed by PWM, or by a digital output. */
static void at_one_supply(enum heating_output bed)
{
	heat_prepare(NULL);
	world.config.heater_watts = BUDGET;
	world.config.heater[HOTEND].watts = HOTEND_WATTS;
	world.config.heater[BED].watts = bed == HEATING_PIN ? 30 : BED_WATTS;
	world.config.heater[BED].kind = (uint8_t)bed;
	if (bed == HEATING_PWM)
		world.config.heater[BED].output = BED_PWM;
	heat_start();
}

static double watts(void)
{
	return heat_power(HOTEND) * world.config.heater[HOTEND].watts +
	       heat_power(BED) * world.config.heater[BED].watts;
}

/* For so long the supply suffices; outputs that change together may do so some cycles apart. */
static void run_within_the_supply(uint64_t for_ns)
{
	const uint64_t end = world.tick + for_ns;
	unsigned int above = 0;

	while (world.tick < end) {
		heat_cycle();
		above = watts() > BUDGET * 1.001 ? above + 1 : 0;
		assert_true(above < SETTLE);
	}
}

static void each_gets_the_same_part_of_what_it_asks_for(void **state)
{
	(void)state;
	at_one_supply(HEATING_PWM);
	heat_command(HOTEND, 150);
	heat_command(BED, 60);
	run_within_the_supply(500 * MS);
	assert_true(fabs(heat_power(HOTEND) - 0.5) < 0.001);
	assert_true(fabs(heat_power(BED) - 0.5) < 0.001);
	assert_true(fabs((double)heat_shown(BED)->power - 0.5) < 0.001);
	assert_true(heat_shown(HOTEND)->limited && heat_shown(BED)->limited);
	run_within_the_supply(60 * SECOND);
	assert_true(heat_shown(HOTEND)->at_temperature && heat_shown(BED)->at_temperature);
	assert_false(heat_shown(HOTEND)->limited || heat_shown(BED)->limited);
	/* a heater that is off leaves all of the supply to the other one */
	heat_command(HOTEND, 0);
	heat_command(BED, 0);
	run_within_the_supply(200 * MS);
	heat_command(HOTEND, 200);
	run_within_the_supply(200 * MS);
	assert_true(fabs(heat_power(HOTEND) - 1) < 0.001);
	assert_false(heat_shown(HOTEND)->limited);
	assert_int_equal(world.event_count[EVENT_HEATER], 0);
}

static void without_a_limit_nothing_is_limited(void **state)
{
	(void)state;
	heat_prepare(NULL);
	world.config.heater[BED].kind = HEATING_PWM;
	world.config.heater[BED].output = BED_PWM;
	heat_start();
	heat_command(HOTEND, 150);
	heat_command(BED, 60);
	heat_run(500 * MS);
	assert_true(fabs(heat_power(HOTEND) + heat_power(BED) - 2) < 0.001);
	assert_false(heat_shown(HOTEND)->limited || heat_shown(BED)->limited);
}

static void what_a_relay_takes_is_left_for_nobody(void **state)
{
	bool whole = false, rest = false;

	(void)state;
	at_one_supply(HEATING_PIN);
	heat_command(HOTEND, 150);
	heat_command(BED, 60);
	for (unsigned int i = 0; i < 600; i++) {
		run_within_the_supply(50 * MS);
		whole = whole || heat_power(HOTEND) > 0.99;
		rest = rest || (heat_power(BED) > 0 && heat_power(HOTEND) > 0.49 &&
				heat_power(HOTEND) < 0.51 && heat_shown(HOTEND)->limited);
		assert_false(heat_shown(BED)->limited);
	}
	assert_true(rest && whole);
	assert_true(heat_shown(HOTEND)->at_temperature);
	assert_int_equal(world.event_count[EVENT_HEATER], 0);
}

/* Its bed is cold for long, and takes all that is left. */
static void one_that_stays_warm_is_not_starved_by_one_that_gets_warm(void **state)
{
	(void)state;
	at_one_supply(HEATING_PWM);
	heat_command(HOTEND, 100);
	run_within_the_supply(60 * SECOND);
	assert_true(heat_shown(HOTEND)->at_temperature);
	heat[BED].config.capacity = 1000;
	heat_command(BED, 60);
	for (unsigned int i = 0; i < 60; i++) {
		run_within_the_supply(1 * SECOND);
		assert_true(heat_shown(HOTEND)->at_temperature);
		assert_true(heat_shown(BED)->limited);
	}
	/* and it gets warm beside it */
	heat_command(HOTEND, 130);
	run_within_the_supply(60 * SECOND);
	assert_true(heat_shown(HOTEND)->at_temperature);
	assert_true(heat_shown(BED)->limited);
	assert_int_equal(world.event_count[EVENT_HEATER], 0);
}

/* A sensor that is stuck just below the target, and never all of the power. */
static void less_than_full_power_without_an_effect_is_a_fault_as_well(void **state)
{
	(void)state;
	at_one_supply(HEATING_PWM);
	heat_command(BED, 60);
	run_within_the_supply(60 * SECOND);
	assert_true(heat_shown(BED)->at_temperature);
	sim_heat_break(&heat[BED], SIM_HEAT_STUCK);
	heat[BED].stuck = 58.5;
	run_within_the_supply(120 * SECOND);
	heat_expect_fault(BED, POKEYS_HEATER_UNHEEDED);
	heat_expect_off(5 * MS);
}

/*
 * All PWM outputs begin a period with their pulse. One that begins again and again is that pulse
 * and nothing else.
 */
static void a_period_goes_on_while_powers_change(void **state)
{
	const uint32_t *begun = &world.rig.device.run.pwm_begun;
	uint32_t before;
	double least = 1;

	(void)state;
	at_one_supply(HEATING_PWM);
	heat_command(HOTEND, 150);
	heat_command(BED, 60);
	run_within_the_supply(30 * SECOND);
	before = *begun;
	heat_command(HOTEND, 130);
	for (unsigned int i = 0; i < 20000; i++) {
		heat_cycle();
		least = fmin(least, heat_power(HOTEND));
	}
	assert_true(least <= 0 && heat_power(HOTEND) > 0);
	assert_int_equal(*begun, before);
	/* what is switched off is off at once */
	heat_command(HOTEND, 0);
	heat_run(5 * MS);
	assert_true(heat_power(HOTEND) <= 0 && *begun == before + 1);
}

/* Its controller has just reduced its power to 0, and the pulse of before has not ended yet. */
static void a_long_pulse_ends_with_the_heater(void **state)
{
	unsigned int late = 0;

	(void)state;
	heat_prepare(NULL);
	world.config.settings.pwm_period = 12500000; /* half a second */
	heat_start();
	for (unsigned int i = 0; i < 60; i++) {
		heat_command(HOTEND, 0);
		heat_run(300 * MS);
		heat_command(HOTEND, 150);
		heat_run(3 * SECOND + i * 7 * MS);
		/* below what it is: no power, but no stop either */
		heat_command(HOTEND, 30);
		heat_run(100 * MS + i % 5 * 3 * MS);
		late += world.rig.device.config.pwm.duty[HOTEND_PWM] == 0 && heat_power(HOTEND) > 0;
		heat_command(HOTEND, 0);
		heat_run(5 * MS);
		assert_true(heat_power(HOTEND) <= 0);
		assert_int_equal(heat_shown(HOTEND)->state, POKEYS_HEATER_OFF);
	}
	assert_true(late > 5);
}

static void fan_of(unsigned int heater, enum heating_output kind, uint8_t output)
{
	world.config.heater[heater].fan = (struct heating_fan_config){
		.kind = (uint8_t)kind,
		.output = output,
		.speed = 0.5,
		.fan = { .above = 50, .hysteresis = 5 },
	};
}

static void prepare_fans(void)
{
	heat_prepare(NULL);
	world_pin(&world, FAN_PIN, WIRE_PIN_OUTPUT);
	fan_of(HOTEND, HEATING_PIN, FAN_PIN);
	fan_of(BED, HEATING_PWM, COOLER_PWM);
}

static void with_fans(void)
{
	prepare_fans();
	heat_start();
}

static double fan_speed(unsigned int heater)
{
	const struct sim_pwm_config *pwm = &world.rig.device.config.pwm;

	sim_rig_run(&world.rig, world_device_time(&world));
	if (heater == HOTEND)
		return world.rig.device.pins.latch >> FAN_PIN & 1 ? 1 : 0;
	return pwm->enabled >> COOLER_PWM & 1 ? (double)pwm->duty[COOLER_PWM] / pwm->period : 0;
}

static void expect_fans(double hotend, double bed)
{
	assert_true(fabs(fan_speed(HOTEND) - hotend) < 0.001);
	assert_true(fabs(fan_speed(BED) - bed) < 0.001);
	assert_int_equal(heat_shown(HOTEND)->fan,
			 hotend > 0 ? POKEYS_HEATER_FAN_ON : POKEYS_HEATER_FAN_OFF);
	assert_int_equal(heat_shown(BED)->fan,
			 bed > 0 ? POKEYS_HEATER_FAN_ON : POKEYS_HEATER_FAN_OFF);
}

static void a_fan_runs_while_its_heater_is_hot(void **state)
{
	(void)state;
	with_fans();
	expect_fans(0, 0);
	heat_command(HOTEND, 40);
	heat_command(BED, 60);
	heat_run(60 * SECOND);
	expect_fans(0, 0.5);
	heat_command(HOTEND, 60);
	heat_run(20 * SECOND);
	expect_fans(1, 0.5);
	/* within the hysteresis it goes on */
	heat_command(HOTEND, 48);
	heat_run(60 * SECOND);
	expect_fans(1, 0.5);
	heat_command(HOTEND, 0);
	heat_command(BED, 0);
	heat_run(100 * MS);
	expect_fans(1, 0.5);
	while (heat[HOTEND].sensor > 44 || heat[BED].sensor > 44)
		heat_cycle();
	heat_run(500 * MS);
	expect_fans(0, 0);
}

static void a_fan_runs_whatever_becomes_of_its_heater(void **state)
{
	(void)state;
	with_fans();
	/* its commander can neither start nor stop it */
	world_output(&world, FAN_PIN, true);
	world.command.pwm_enable = 1u << COOLER_PWM;
	world.command.pwm_duty[COOLER_PWM] = PERIOD;
	heat_run(100 * MS);
	expect_fans(0, 0);
	heat_up();
	world_output(&world, FAN_PIN, false);
	world.command.pwm_duty[COOLER_PWM] = 0;
	heat_run(100 * MS);
	expect_fans(1, 0.5);
	sim_heat_break(&heat[HOTEND], SIM_HEAT_OPEN);
	heat_run(300 * MS);
	heat_expect_fault(HOTEND, POKEYS_HEATER_OPEN);
	expect_fans(1, 0.5);
	/* the commander is gone */
	world.commanding = false;
	heat_run(2 * SECOND);
	expect_fans(1, 0.5);
	/* cold by now, but nobody can tell */
	while (heat[HOTEND].sensor > 25)
		heat_cycle();
	expect_fans(1, 0);
	sim_heat_break(&heat[HOTEND], SIM_HEAT_GOOD);
	heat_run(1 * SECOND);
	expect_fans(0, 0);
	sim_heat_break(&heat[BED], SIM_HEAT_OPEN);
	heat_run(1 * SECOND);
	expect_fans(0, 0.5);
}

static void a_fan_goes_on_after_the_device_was_lost(void **state)
{
	(void)state;
	with_fans();
	heat_up();
	heat_silence(1500 * MS);
	/* the failsafe has stopped them */
	assert_true(fan_speed(HOTEND) == 0 && fan_speed(BED) == 0);
	world_until(&world, world_is_running, 3 * SECOND);
	heat_run(500 * MS);
	expect_fans(1, 0.5);
	heat_expect_fault(HOTEND, POKEYS_HEATER_DEVICE);
}

/* Somebody gives the fan's terminal to something else. */
static void without_its_fan_a_heater_does_not_heat(void **state)
{
	struct pokeys_wish wish = { .session = 5, .generation = 9 };

	(void)state;
	with_fans();
	heat_command(HOTEND, 150);
	heat_run(10 * SECOND);
	wish.settings.pin_set[FAN_PIN / 8] = 1u << FAN_PIN % 8;
	wish.settings.pin_function[FAN_PIN] = WIRE_PIN_OUTPUT | WIRE_PIN_INVERT;
	device_wish(world.device, &wish);
	heat_run(500 * MS);
	assert_int_equal(heat_shown(HOTEND)->fault, POKEYS_HEATER_DEVICE);
	assert_int_equal(heat_shown(HOTEND)->obstacle, POKEYS_OBSTACLE_FAN);
	assert_int_equal(heat_shown(HOTEND)->fan, POKEYS_HEATER_FAN_OFF);
	heat_expect_off(5 * MS);
}

/* This board has no terminal for the channel. */
static void a_fan_that_the_board_lacks_is_no_fan(void **state)
{
	(void)state;
	heat_prepare(NULL);
	fan_of(HOTEND, HEATING_PWM, 3);
	heat_start();
	heat_command(HOTEND, 150);
	heat_expect_off(500 * MS);
	assert_int_equal(heat_shown(HOTEND)->condition, POKEYS_HEATER_DEVICE);
	assert_int_equal(heat_shown(HOTEND)->obstacle, POKEYS_OBSTACLE_FAN);
	assert_int_equal(heat_shown(HOTEND)->fan, POKEYS_HEATER_FAN_OFF);
}

/* Its heater cannot be used, but its temperature is known. */
static void a_fan_of_a_heater_that_is_not_ready_knows_the_temperature(void **state)
{
	(void)state;
	heat_prepare(NULL);
	fan_of(HOTEND, HEATING_PWM, COOLER_PWM);
	world.config.heater[HOTEND].output = 3;
	heat_start();
	assert_int_equal(heat_shown(HOTEND)->condition, POKEYS_HEATER_DEVICE);
	assert_int_equal(heat_shown(HOTEND)->obstacle, POKEYS_OBSTACLE_PWM);
	assert_true(fan_speed(BED) == 0);
	assert_int_equal(heat_shown(HOTEND)->fan, POKEYS_HEATER_FAN_OFF);
	heat[HOTEND].block = heat[HOTEND].sensor = 80;
	heat_run(1 * SECOND);
	assert_int_equal(heat_shown(HOTEND)->fan, POKEYS_HEATER_FAN_ON);
}

/* An output that has failed shorted heats, whatever else is not ready. */
static void one_that_is_not_ready_can_be_too_hot(void **state)
{
	(void)state;
	heat_prepare(NULL);
	fan_of(HOTEND, HEATING_PWM, 3);
	heat_start();
	assert_int_equal(heat_shown(HOTEND)->condition, POKEYS_HEATER_DEVICE);
	heat[HOTEND].block = heat[HOTEND].sensor = 320;
	heat_run(2 * SECOND);
	heat_expect_fault(HOTEND, POKEYS_HEATER_OVER);
}

/* A reading that is as old as it may be just before the next one. */
static void a_fan_does_not_chatter(void **state)
{
	(void)state;
	prepare_fans();
	world.config.heater[BED].heater.stale_ns = 100 * MS;
	heat_start();
	for (unsigned int i = 0; i < 2000; i++) {
		heat_cycle();
		expect_fans(0, 0);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(each_gets_the_same_part_of_what_it_asks_for),
		cmocka_unit_test(without_a_limit_nothing_is_limited),
		cmocka_unit_test(what_a_relay_takes_is_left_for_nobody),
		cmocka_unit_test(one_that_stays_warm_is_not_starved_by_one_that_gets_warm),
		cmocka_unit_test(less_than_full_power_without_an_effect_is_a_fault_as_well),
		cmocka_unit_test(a_period_goes_on_while_powers_change),
		cmocka_unit_test(a_long_pulse_ends_with_the_heater),
		cmocka_unit_test(a_fan_runs_while_its_heater_is_hot),
		cmocka_unit_test(a_fan_runs_whatever_becomes_of_its_heater),
		cmocka_unit_test(a_fan_goes_on_after_the_device_was_lost),
		cmocka_unit_test(without_its_fan_a_heater_does_not_heat),
		cmocka_unit_test(a_fan_that_the_board_lacks_is_no_fan),
		cmocka_unit_test(a_fan_of_a_heater_that_is_not_ready_knows_the_temperature),
		cmocka_unit_test(one_that_is_not_ready_can_be_too_hot),
		cmocka_unit_test(a_fan_does_not_chatter),
	};

	return cmocka_run_group_tests_name("heaters together", tests, NULL, NULL);
}
