// SPDX-License-Identifier: GPL-2.0-or-later
/* Servo motors in the configuration: what they become, and what of them cannot be. */
#include <math.h>
#include "tests/control/faults.h"
#include "wire/io.h"

#undef GOOD
#define GOOD "[device a]\naddress = 10.0.0.1\npwm-period = 1250\n"
#define X "[servo x]\nencoder = 4\ncounts-per-unit = 400\npwm = 0\ndirection-pin = 31\n" \
	  "max-speed = 100\npid-p = 0.5\n"

#define FAST "[servo x]\nencoder = 1\ncounts-per-unit = 400\npwm = 0\ndirection-pin = 31\n" \
	     "max-speed = 100\npid-p = 0.5\n"
#define ANTIPHASE "[servo x]\nencoder = 4\ncounts-per-unit = 400\npwm = 0\nenable-pin = 31\n" \
		  "drive = antiphase\nmax-speed = 100\npid-p = 0.5\n"

static const struct servoing_config *servo(unsigned int number)
{
	return &config.device[0].servo[number];
}

static void assert_near(double value, double expected)
{
	if (!(fabs(value - expected) < 1e-9 * fmax(1, fabs(expected))))
		fail_msg("%g is not %g", value, expected);
}

static void a_motor_with_what_it_needs_is_taken(void **state)
{
	const struct servo_config *loop = &servo(0)->servo;
	const uint8_t *function = config.device[0].settings.pin_function;

	(void)state;
	assert_int_equal(parse(GOOD X), 0);
	assert_int_equal(config.device[0].servos, 1);
	assert_string_equal(servo(0)->name, "x");
	assert_int_equal(servo(0)->encoder, 4);
	assert_int_equal(servo(0)->drive.kind, DRIVE_SIGN);
	assert_int_equal(servo(0)->pwm, 0);
	assert_int_equal(servo(0)->reverse_pwm, SERVOING_NONE);
	assert_int_equal(servo(0)->direction, 30);
	assert_int_equal(servo(0)->enable, SERVOING_NONE);
	assert_int_equal(servo(0)->low, SERVOING_NONE);
	assert_false(servo(0)->without_failsafe || servo(0)->inverted);
	assert_near(loop->scale, 400);
	assert_true(isinf(loop->least) && loop->least < 0 && isinf(loop->most) && loop->most > 0);
	assert_near(loop->speed_jump, 300);
	assert_near(loop->integral_most, 0.5);
	assert_near(loop->stall_output, 0.9);
	assert_int_equal(loop->stale_ns, 10000000);
	/* its terminal needs no line of its own, and may have one */
	assert_int_equal(function[30], WIRE_PIN_OUTPUT);
	assert_int_equal(parse(GOOD "digital-outputs = 31\n" X), 0);
	assert_int_equal(function[30], WIRE_PIN_OUTPUT);
}

static void every_key_arrives(void **state)
{
	const struct servo_config *loop = &servo(1)->servo;

	(void)state;
	assert_int_equal(
		parse(GOOD X "[servo spindle]\ndevice = a\nencoder = 25\ncounts-per-unit = -11.25\n"
			     "drive = two-pwm\npwm = 2\nreverse-pwm = 3\nenable-pin = 32\n"
			     "invert-output = yes\n"
			     "limit-minus-pin = 9\nlimit-minus-invert = on\nlimit-plus-pin = 10\n"
			     "min-position = -7\nmax-position = 8.5\nmax-speed = 4000\n"
			     "impossible-speed = 9000\n"
			     "pid-p = 0.1\npid-i = 2\npid-d = 0.003\nvelocity-gain = 0.0004\n"
			     "acceleration-gain = 0.00005\ndeadband = 0.2\nmax-integral = 0.25\n"
			     "max-output = 0.8\nsmooth-s = 0.01\nmin-following-error = 3\n"
			     "max-following-error = 30\nstall-output = 0.7\nstall-distance = 2\n"
			     "stall-s = 1\n"
			     "silent-output = 0.3\nsilent-s = 0.05\nrunaway-output = 0.15\n"
			     "runaway-distance = 5\nmax-age-ms = 20\nwithout-failsafe = yes\n"),
		0);
	assert_int_equal(config.device[0].servos, 2);
	assert_int_equal(servo(1)->encoder, 25);
	assert_int_equal(servo(1)->drive.kind, DRIVE_TWO_PWM);
	assert_int_equal(servo(1)->pwm, 2);
	assert_int_equal(servo(1)->reverse_pwm, 3);
	assert_int_equal(servo(1)->enable, 31);
	assert_int_equal(servo(1)->low, 8);
	assert_int_equal(servo(1)->high, 9);
	assert_true(servo(1)->low_inverted && !servo(1)->high_inverted);
	assert_true(servo(1)->inverted && servo(1)->without_failsafe);
	assert_near(loop->scale, -11.25);
	assert_near(loop->least, -7);
	assert_near(loop->most, 8.5);
	assert_near(loop->speed_most, 4000);
	assert_near(loop->speed_jump, 9000);
	assert_near(loop->gains.p, 0.1);
	assert_near(loop->gains.i, 2);
	assert_near(loop->gains.d, 0.003);
	assert_near(loop->gains.velocity, 0.0004);
	assert_near(loop->gains.acceleration, 0.00005);
	assert_near(loop->deadband, 0.2);
	assert_near(loop->integral_most, 0.25);
	assert_near(loop->output_most, 0.8);
	assert_near(loop->smooth, 0.01);
	assert_near(loop->follow_least, 3);
	assert_near(loop->follow_most, 30);
	assert_near(loop->stall_output, 0.7);
	assert_near(loop->stall_move, 2);
	assert_near(loop->stall_s, 1);
	assert_near(loop->silent_output, 0.3);
	assert_near(loop->silent_s, 0.05);
	assert_near(loop->runaway_output, 0.15);
	assert_near(loop->runaway_move, 5);
	assert_int_equal(loop->stale_ns, 20000000);
	assert_int_equal(config.device[0].settings.pin_function[8], WIRE_PIN_INPUT);
	assert_int_equal(parse(GOOD X "dwell-ms = 2.5\n"), 0);
	assert_int_equal(servo(0)->drive.dwell_ns, 2500000);
}

static void what_it_needs_has_to_be_there(void **state)
{
	(void)state;
	assert_int_equal(parse(GOOD "[servo x]\n"), 6);
	assert_string_equal(heard.line[0], "f:4: [servo x]: encoder is not given");
	assert_string_equal(heard.line[5],
			    "f:4: [servo x]: direction-pin is not given; drive = sign-magnitude "
			    "needs it");
	assert_fault("[device a]\naddress = 10.0.0.1\n" X,
		     "f:6: [servo x]: pwm needs pwm-period in [device a], in ticks of 25 MHz (1250 "
		     "is 20 kHz)");
	assert_fault("[device a]\naddress = 10.0.0.1\npwm-period = 25001\n" X,
		     "f:7: [servo x]: pwm-period of its device has to be 250 to 25000");
	assert_fault(GOOD X "device = b\n", "f:11: [servo x]: device: there is no [device b]");
	assert_fault(GOOD X "pid-i = none\n", "f:11: [servo x]: pid-i: \"none\" is not a number; "
					      "allowed: 0..1000000");
	assert_fault(GOOD X "pid-i = nan\n", "f:11: [servo x]: pid-i: \"nan\" is not a number; "
					     "allowed: 0..1000000");
}

static void wires_that_its_amplifier_does_not_have_are_refused(void **state)
{
	(void)state;
	assert_fault(GOOD X "reverse-pwm = 1\n", "f:11: [servo x]: reverse-pwm has no effect with "
						 "drive = sign-magnitude");
	assert_int_equal(parse(GOOD X "drive = antiphase\n"), 2);
	assert_string_equal(heard.line[0], "f:8: [servo x]: direction-pin has no effect with drive "
					   "= antiphase");
	assert_string_equal(heard.line[1], "f:4: [servo x]: enable-pin is not given; drive = "
					   "antiphase needs it");
	assert_fault(GOOD "[servo x]\nencoder = 4\ncounts-per-unit = 400\npwm = 0\n"
			  "reverse-pwm = 0\ndrive = two-pwm\nmax-speed = 100\npid-p = 0.5\n",
		     "f:8: [servo x]: reverse-pwm: terminal 22 is used by pwm (line 7) as well, "
		     "and can only be used by one of them; remove the other");
	assert_fault(GOOD X "limit-plus-invert = on\n", "f:11: [servo x]: limit-plus-invert has no "
							"effect without limit-plus-pin");
}

#define LIMITS "limit-minus-pin = 9\nlimit-plus-pin = 10\nmin-position = -1\n" \
	       "max-position = 99\n"
#define HOME "home-search-speed = -20\n"

static void its_home_switch_arrives(void **state)
{
	const struct servo_home_config *home = &servo(0)->home;

	(void)state;
	assert_int_equal(parse(GOOD X LIMITS), 0);
	assert_true(home->search == 0);
	assert_int_equal(parse(GOOD X LIMITS "limit-minus-invert = on\n" HOME
					     "home-position = 5\n"),
			 0);
	assert_int_equal(servo(0)->home_pin, 8);
	assert_true(servo(0)->home_inverted);
	assert_near(home->search, -20);
	assert_near(home->latch, 2);
	assert_near(home->acceleration, 200);
	assert_near(home->offset, 0);
	assert_near(home->position, 5);
	assert_near(home->distance, 110);
	assert_int_equal(parse(GOOD X
			       "home-search-speed = 8\nhome-pin = 14\nhome-invert = on\n"
			       "home-latch-speed = 0.5\nhome-acceleration = 70\nhome-offset = 3\n"
			       "home-position = 3\nhome-distance = 12\n"),
			 0);
	assert_int_equal(servo(0)->home_pin, 13);
	assert_true(servo(0)->home_inverted);
	assert_near(home->search, 8);
	assert_near(home->latch, 0.5);
	assert_near(home->acceleration, 70);
	assert_near(home->offset, 3);
	assert_near(home->position, 3);
	assert_near(home->distance, 12);
	assert_int_equal(config.device[0].settings.pin_function[13], WIRE_PIN_INPUT);
	assert_int_equal(parse(GOOD "inverted-pins = 14\n" X "home-search-speed = 8\n"
				    "home-pin = 14\nhome-distance = 12\n"),
			 0);
	assert_int_equal(config.device[0].settings.pin_function[13],
			 WIRE_PIN_INPUT | WIRE_PIN_INVERT);
}

static void a_homing_that_cannot_be_is_refused(void **state)
{
	(void)state;
	assert_fault(GOOD X "home-offset = 2\n", "f:11: [servo x]: home-offset has no effect "
						 "without home-search-speed");
	assert_fault(GOOD X HOME "home-distance = 9\n",
		     "f:11: [servo x]: home-search-speed needs "
		     "a home switch: home-pin, or limit-minus-pin in the direction of the search");
	assert_fault(GOOD X "home-search-speed = 2\nhome-distance = 9\n",
		     "f:11: [servo x]: home-search-speed needs a home switch: home-pin, or "
		     "limit-plus-pin in the direction of the search");
	assert_fault(GOOD X HOME LIMITS,
		     "f:4: [servo x]: home-position = 0 is on the limit "
		     "switch, which closes at 0 (home-offset) and stops the motor; it has to be "
		     "0.5 or more off it (min-following-error)");
	assert_fault(GOOD X HOME LIMITS "home-position = 5\nhome-invert = on\n",
		     "f:17: [servo x]: home-invert has no effect without home-pin");
	assert_fault(GOOD X HOME "home-pin = 14\n", "f:5: [servo x]: home-distance has to be given "
						    "if min-position or max-position is none");
	assert_fault(GOOD X "home-search-speed = 101\nhome-pin = 14\nhome-distance = 9\n",
		     "f:11: [servo x]: home-search-speed has to be at most max-speed, in either "
		     "direction");
	assert_fault(GOOD X HOME LIMITS "home-position = 100\n",
		     "f:16: [servo x]: home-position has to be from min-position to max-position");
	assert_fault(GOOD X HOME LIMITS "home-pin = 10\n",
		     "f:11: [servo x]: home-search-speed: the home switch has the terminal of the "
		     "limit switch at the other end (10), so the axis would not stop there; give "
		     "the home switch a terminal of its own");
	assert_fault(GOOD X HOME "limit-minus-pin = 9\nlimit-plus-pin = 9\nhome-distance = 9\n"
				 "home-position = 5\n",
		     "f:11: [servo x]: home-search-speed: the home switch has the terminal of the "
		     "limit switch at the other end (9), so the axis would not stop there; give "
		     "the home switch a terminal of its own");
	assert_fault(GOOD X HOME LIMITS "home-pin = 9\n",
		     "f:16: [servo x]: home-pin: terminal "
		     "9 is that of limit-minus-pin; leave home-pin out");
	assert_fault(GOOD X HOME "home-distance = 9\nhome-pin = 31\n",
		     "f:13: [servo x]: home-pin: terminal 31 is used by direction-pin (line 8) as "
		     "well, and can only be used by one of them; remove the other");
}

static void limits_that_contradict_each_other_stand_at_their_line(void **state)
{
	(void)state;
	assert_fault(GOOD X "min-position = 5\nmax-position = -5\n",
		     "f:11: [servo x]: min-position has to be below max-position");
	assert_fault(GOOD X "impossible-speed = 50\n",
		     "f:9: [servo x]: max-speed has to be above 0, and impossible-speed above "
		     "max-speed");
	assert_fault(GOOD X "max-output = 0.5\nstall-output = 0.6\n",
		     "f:12: [servo x]: stall-output is above max-output: it would never be "
		     "reached");
	assert_int_equal(parse(GOOD X "max-output = 0.5\n"), 0);
	assert_fault(GOOD X "max-following-error = 0.1\n",
		     "f:11: [servo x]: min-following-error has to be 4 counts or more, and "
		     "max-following-error at least that");
	assert_fault(GOOD "[servo x]\nencoder = 4\ncounts-per-unit = 0\npwm = 0\n"
			  "direction-pin = 31\nmax-speed = 100\npid-p = 0.5\n",
		     "f:6: [servo x]: counts-per-unit has to be a number other than 0");
}

static void nothing_is_used_twice(void **state)
{
	(void)state;
	assert_fault(GOOD X "[servo y]\nencoder = 4\ncounts-per-unit = 400\npwm = 1\n"
			    "direction-pin = 32\nmax-speed = 100\npid-p = 0.5\n",
		     "f:12: [servo y]: encoder 4 is already that of [servo x] (line 5)");
	assert_fault(GOOD X "[servo y]\nencoder = 5\ncounts-per-unit = 400\npwm = 1\n"
			    "direction-pin = 31\nmax-speed = 100\npid-p = 0.5\n",
		     "f:15: [servo y]: direction-pin: terminal 31 is used by [servo x] "
		     "direction-pin (line 8) as well, and can only be used by one of them; remove "
		     "the other");
	assert_fault(GOOD X "[heater bed]\nsensor-pin = 43\nsensor = thermistor\npwm = 0\n"
			    "max-temperature = 120\n",
		     "f:14: [heater bed]: pwm: terminal 22 is used by [servo x] pwm (line 7) as "
		     "well, and can only be used by one of them; remove the other");
	assert_fault(GOOD "digital-inputs = 31\n" X,
		     "f:9: [servo x]: direction-pin: terminal 31 is used by [device a] "
		     "digital-inputs (line 4) as well, and can only be used by one of them; remove "
		     "the other");
	assert_int_equal(parse(GOOD "digital-inputs = 9\n" X "limit-minus-pin = 9\n"), 0);
	assert_int_equal(parse(GOOD X "[servo x]\n"), 1);
}

static void the_device_has_to_stop_it(void **state)
{
	(void)state;
	assert_fault(GOOD "failsafe = off\n" X,
		     "f:5: [servo x]: the failsafe of its device is off: the motor would keep "
		     "running if this computer fails; without-failsafe = yes accepts that");
	assert_int_equal(parse(GOOD "failsafe = off\n" X "without-failsafe = yes\n"), 0);
	assert_fault(GOOD "failsafe-timeout-ms = 1100\n" X,
		     "f:5: [servo x]: failsafe-timeout-ms of its device is longer than 1000: the "
		     "motor would keep running if this computer fails; without-failsafe = yes "
		     "accepts that");
	/* the enable wire is enough, and so is the PWM, but with antiphase */
	assert_int_equal(parse(GOOD "failsafe-parts = 1\n" X "enable-pin = 32\n"), 0);
	assert_int_equal(parse(GOOD "failsafe-parts = 1\n" X), 1);
	assert_int_equal(parse(GOOD "failsafe-parts = 4\n" X), 0);
	assert_int_equal(parse(GOOD "failsafe-parts = 4\n" X "enable-pin = 32\n"), 0);
	assert_int_equal(parse(GOOD "failsafe-parts = 1\n" ANTIPHASE), 0);
	assert_fault(GOOD "failsafe-parts = 4\n" ANTIPHASE,
		     "f:5: [servo x]: failsafe-parts of its device does not include digital "
		     "outputs (1): the motor would keep running if this computer fails; "
		     "without-failsafe = yes accepts that");
	assert_fault(GOOD "fast-divider = 6\n" X,
		     "f:5: [servo x]: max-age-ms = 10 has to be at least two readings of its "
		     "device, which are 12 ms (period-us, fast-divider)");
	assert_fault(GOOD "encoder.4.enable = off\n" X,
		     "f:6: [servo x]: encoder 4 is switched off in [device a]");
}

static void its_counter_is_not_reset_by_an_index(void **state)
{
	(void)state;
	assert_int_equal(parse(GOOD "fast-encoders = on\n" FAST), 0);
	assert_fault(GOOD "fast-encoders = on\nfast-encoder-index = on\n" FAST,
		     "f:7: [servo x]: encoder 1 is set to 0 by its index input "
		     "(fast-encoder-index of [device a]): the axis would lose its position");
	assert_int_equal(parse(GOOD "fast-encoders = on\nfast-encoder-index = on\n" X), 0);
}

/* pokeysctl config apply compares them as bytes, to tell what needs a restart. */
/* Axes of the pulse engine on a path stand beside motors. */
static void names_and_scales_of_axes_arrive(void **state)
{
	const struct device_axis_config *axis = config.device[0].axis;

	(void)state;
	assert_int_equal(parse(GOOD X "device = a\n[device b]\naddress = 10.0.0.2\naxes = 3\n"
				      "axis.2.name = x\naxis.2.pulses-per-unit = -12.5\n"
				      "axis.1.pulses-per-unit = 200\naxis.1.lead = off\n"),
			 0);
	assert_true(axis[0].pulses_per_unit == 0);
	axis = config.device[1].axis;
	assert_string_equal(axis[2].name, "x");
	assert_near(axis[2].pulses_per_unit, -12.5);
	assert_string_equal(axis[1].name, "axis.1");
	assert_near(axis[1].pulses_per_unit, 200);
	assert_true(axis[0].lead && !axis[1].lead && axis[2].lead);
	assert_true(axis[0].pulses_per_unit == 0);
}

static void names_of_axes_mean_nothing_else(void **state)
{
	static const struct {
		const char *name, *why;
	} bad[] = {
		{ "x", "\"x\": a servo motor of this device has this name" },
		{ "y", "\"y\": another axis has this name" },
		{ "12", "\"12\": a number is that of a servo motor" },
		{ "speed", "\"speed\": a file of moves has that word for the speed" },
		{ "a.b", "\"a.b\": a name has the characters A-Z a-z 0-9 _ - only" },
	};

	(void)state;
	for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
		char text[512], fault[200];

		snprintf(text, sizeof(text),
			 GOOD "axis.0.name = y\naxis.0.pulses-per-unit = 1\n"
			      "axis.1.pulses-per-unit = 9\naxis.1.name = %s\n" X,
			 bad[i].name);
		snprintf(fault, sizeof(fault), "f:7: [device a]: axis.1.name: %s", bad[i].why);
		assert_fault(text, fault);
	}
	assert_fault(GOOD "axis.1.name = y\n", "f:4: [device a]: axis.1.name is for moves, which "
					       "need axis.1.pulses-per-unit");
	assert_fault(GOOD "axis.1.pulses-per-unit = 5\naxis.1.mode = velocity\n",
		     "f:4: [device a]: axis.1.pulses-per-unit is for moves, and an axis with "
		     "axis.1.mode = velocity has no positions; use position or buffered");
	assert_fault(GOOD "axes = 1\naxis.1.pulses-per-unit = 5\n",
		     "f:5: [device a]: axis.1.pulses-per-unit: there is no axis 1 with axes = 1 "
		     "(they are numbered from 0)");
	assert_fault(GOOD "axis.1.pulses-per-unit = many\n",
		     "f:4: [device a]: axis.1.pulses-per-unit: \"many\" is not a number; allowed: "
		     "none | -1000000..1000000");
}

static void the_same_file_is_the_same_configuration(void **state)
{
	static struct config first;

	(void)state;
	assert_int_equal(parse(GOOD X), 0);
	first = config;
	memset(&config, 0xa5, sizeof(config));
	assert_int_equal(parse(GOOD X), 0);
	assert_memory_equal(&first.device[0], &config.device[0], sizeof(first.device[0]));
	assert_int_equal(parse(GOOD X "pid-d = 0.1\n"), 0);
	assert_memory_not_equal(&first.device[0], &config.device[0], sizeof(first.device[0]));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_motor_with_what_it_needs_is_taken),
		cmocka_unit_test(every_key_arrives),
		cmocka_unit_test(what_it_needs_has_to_be_there),
		cmocka_unit_test(wires_that_its_amplifier_does_not_have_are_refused),
		cmocka_unit_test(its_home_switch_arrives),
		cmocka_unit_test(a_homing_that_cannot_be_is_refused),
		cmocka_unit_test(limits_that_contradict_each_other_stand_at_their_line),
		cmocka_unit_test(nothing_is_used_twice),
		cmocka_unit_test(the_device_has_to_stop_it),
		cmocka_unit_test(its_counter_is_not_reset_by_an_index),
		cmocka_unit_test(names_and_scales_of_axes_arrive),
		cmocka_unit_test(names_of_axes_mean_nothing_else),
		cmocka_unit_test(the_same_file_is_the_same_configuration),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
