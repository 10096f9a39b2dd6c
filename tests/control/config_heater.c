// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Heaters in the configuration: what they become, and what of them cannot be. The sensors' curves
 * are judged by tests/loops.
 */
#include <math.h>
#include "tests/control/faults.h"
#include "wire/io.h"

#undef GOOD
#define GOOD "[device a]\naddress = 10.0.0.1\npwm-period = 2500000\n"
#define B_KEYS "address = 10.0.0.2\npwm-period = 2500000\n"
#define BED "[heater bed]\nsensor-pin = 43\nsensor = thermistor\npwm = 0\nmax-temperature = 120\n"

static const struct heating_config *heater(unsigned int number)
{
	return &config.device[0].heater[number];
}

static void assert_near(double value, double expected)
{
	if (!(fabs(value - expected) < 1e-9 * fmax(1, fabs(expected))))
		fail_msg("%g is not %g", value, expected);
}

static void a_heater_with_what_it_needs_is_taken(void **state)
{
	const struct heater_config *loop = &heater(0)->heater;
	const uint8_t *function = config.device[0].settings.pin_function;

	(void)state;
	assert_int_equal(parse(GOOD "digital-inputs = 1\n" BED), 0);
	assert_int_equal(config.device[0].heaters, 1);
	assert_string_equal(heater(0)->name, "bed");
	assert_int_equal(heater(0)->sensor, 2);
	assert_int_equal(heater(0)->kind, HEATING_PWM);
	assert_int_equal(heater(0)->output, 0);
	assert_false(heater(0)->without_failsafe);
	assert_near(loop->most, 120);
	assert_near(loop->target_most, 105);
	assert_near(loop->least, 5);
	/* Marlin's units */
	assert_near(loop->gains.p, 22.2 / 255);
	assert_near(loop->gains.i, 1.08 / 255);
	assert_near(loop->gains.d, 114.0 / 255);
	assert_int_equal(loop->lease_ns, HEATER_PERIOD_NS);
	assert_int_equal(loop->stale_ns, UINT64_C(300000000));
	assert_int_equal(loop->window_ns, UINT64_C(40000000000));
	/* its terminal needs no line of its own */
	assert_int_equal(function[42], WIRE_PIN_ANALOG_IN);
	assert_int_equal(config.device[0].settings.pin_set[42 / 8] >> 42 % 8 & 1, 1);
	/* and may have one */
	assert_int_equal(parse(GOOD "analog-inputs = 43\n" BED), 0);
	assert_int_equal(function[42], WIRE_PIN_ANALOG_IN);
}

static void every_key_arrives(void **state)
{
	const struct heater_config *loop = &heater(1)->heater;

	(void)state;
	assert_int_equal(
		parse(GOOD
		      "digital-outputs = 12, 13\ninverted-pins = 12\n" BED
		      "[heater oven]\ndevice = a\nsensor-pin = 41\nsensor = table\n"
		      "sensor-points = 300:0.5, 100:2, 0:3, -10:3.1\npull-up-ohm = 0\n"
		      "reference-v = 5\n"
		      "output-pin = 12\nmin-switch-s = 10\ncontrol = bang-bang\nhysteresis = 2\n"
		      "min-temperature = 1\nmax-temperature = 250\nmax-target = 240\n"
		      "max-power = 0.5\n"
		      "max-rate = 3\nmax-age-ms = 500\nwatch-window-s = 120\nwatch-rise = 2\n"
		      "watch-slack = 9\n"
		      "at-temperature-k = 5\nhold-s = ever\non-fault = machine\n"
		      "without-failsafe = yes\n"),
		0);
	assert_int_equal(config.device[0].heaters, 2);
	assert_int_equal(heater(1)->sensor, 0);
	assert_int_equal(heater(1)->kind, HEATING_PIN);
	assert_int_equal(heater(1)->output, 11);
	assert_int_equal(heater(1)->least_ns, UINT64_C(10000000000));
	assert_true(heater(1)->without_failsafe);
	assert_near(heater(1)->within, 5);
	assert_int_equal(loop->sensor.kind, SENSOR_TABLE);
	assert_int_equal(loop->sensor.count, 4);
	assert_near(loop->sensor.points[0].at, 0.5);
	assert_near(loop->sensor.points[3].celsius, -10);
	assert_near(loop->sensor.reference, 5);
	assert_false(heater(0)->stops_machine);
	assert_true(heater(1)->stops_machine);
	assert_int_equal(loop->law, HEATER_BANG_BANG);
	assert_near(loop->hysteresis, 2);
	assert_near(loop->target_most, 240);
	assert_near(loop->power_most, 0.5);
	assert_near(loop->rate_most, 3);
	assert_int_equal(loop->window_ns, UINT64_C(120000000000));
	assert_int_equal(loop->stale_ns, UINT64_C(500000000));
	assert_near(loop->rise, 2);
	assert_near(loop->slack, 9);
	assert_true(loop->lease_ns == UINT64_MAX);
	assert_int_equal(config.device[0].settings.pin_function[11],
			 WIRE_PIN_OUTPUT | WIRE_PIN_INVERT);
}

static void a_fan_and_a_supply_arrive(void **state)
{
	const struct heating_fan_config *fan = &heater(0)->fan;

	(void)state;
	assert_int_equal(parse(GOOD BED), 0);
	assert_int_equal(fan->kind, HEATING_NO_OUTPUT);
	assert_near(config.device[0].heater_watts, 0);
	assert_int_equal(parse(GOOD
			       "max-heater-power-w = 200\n" BED "rated-power-w = 150\n"
			       "fan-pwm = 5\nfan-above = 40\nfan-hysteresis = 2\nfan-speed = 0.5\n"
			       "[heater oven]\nsensor-pin = 44\nsensor = pt1000\noutput-pin = 12\n"
			       "max-temperature = 99\nrated-power-w = 199\nfan-pin = 13\n"),
			 0);
	assert_near(config.device[0].heater_watts, 200);
	assert_near(heater(0)->watts, 150);
	assert_int_equal(fan->kind, HEATING_PWM);
	assert_int_equal(fan->output, 5);
	assert_near(fan->speed, 0.5);
	assert_near(fan->fan.above, 40);
	assert_near(fan->fan.hysteresis, 2);
	fan = &heater(1)->fan;
	assert_int_equal(fan->kind, HEATING_PIN);
	assert_int_equal(fan->output, 12);
	assert_near(fan->fan.above, 50);
	assert_near(fan->fan.hysteresis, 5);
	assert_int_equal(config.device[0].settings.pin_function[12], WIRE_PIN_OUTPUT);
	assert_int_equal(parse(GOOD "inverted-pins = 13\n" BED "fan-pin = 13\n"), 0);
	assert_int_equal(config.device[0].settings.pin_function[12],
			 WIRE_PIN_OUTPUT | WIRE_PIN_INVERT);
}

static void a_fan_or_a_supply_that_cannot_be_is_refused(void **state)
{
	static const char relay[] = "[heater two]\nsensor-pin = 44\nsensor = pt1000\n"
				    "output-pin = 12\nmax-temperature = 99\nrated-power-w = 300\n";
	char text[1024];

	(void)state;
	assert_fault(GOOD BED "fan-above = 40\n",
		     "f:9: [heater bed]: fan-above has no effect without fan-pwm or fan-pin");
	assert_fault(GOOD BED "fan-pin = 13\nfan-above = 105\n",
		     "f:10: [heater bed]: fan-above has to be below max-target, which is 105");
	assert_fault(GOOD BED "fan-pin = 13\nfan-speed = 0.5\n",
		     "f:10: [heater bed]: fan-speed has no effect with fan-pin");
	assert_fault(GOOD BED "fan-pin = 13\nfan-pwm = 1\n",
		     "f:9: [heater bed]: fan-pin and fan-pwm are both given; give only one");
	assert_fault(GOOD BED "fan-speed = 0.5\nfan-pwm = 6\n",
		     "f:10: [heater bed]: fan-pwm: \"6\" is out of range; allowed: none | 0..5 "
		     "(terminals 22 to 17)");
	assert_fault(GOOD BED "fan-pwm = 0\n",
		     "f:9: [heater bed]: fan-pwm: terminal 22 is used by pwm (line 7) as well, and "
		     "can only be used by one of them; remove the other");
	assert_fault(GOOD "safe-on = 13\ndigital-outputs = 13\n" BED "fan-pin = 13\n",
		     "f:11: [heater bed]: fan-pin: terminal 13 is used by [device a] safe-on (line "
		     "4) as well, and can only be used by one of them; remove the other");
	snprintf(text, sizeof(text), "[device a]\naddress = 10.0.0.1\n%sfan-pwm = 1\n", relay);
	assert_int_equal(parse(text), 2);
	assert_non_null(strstr(heard.line[1], "fan-pwm needs pwm-period in [device a]"));
	assert_non_null(strstr(heard.line[0], "rated-power-w has no effect without "
					      "max-heater-power-w in [device a]"));
	assert_fault(GOOD "max-heater-power-w = 200\n" BED,
		     "f:5: [heater bed]: rated-power-w is not given; max-heater-power-w of its "
		     "device needs it");
	/* one complaint about what is out of range, and none that follows from it */
	assert_fault(GOOD "max-heater-power-w = 0\n" BED "rated-power-w = 40\n",
		     "f:4: [device a]: max-heater-power-w: \"0\" is out of range; allowed: "
		     "unlimited | 1..1000000 W");
	assert_fault(GOOD "max-heater-power-w = 200\n" BED "rated-power-w = 0\n",
		     "f:10: [heater bed]: rated-power-w: \"0\" is out of range; allowed: unknown | "
		     "0.1..100000 W");
	assert_fault(GOOD "max-heater-power-w = 200\n[heater x]\nsensor-pin = 43\n"
			  "sensor = pt1000\npwm = 9\nmax-temperature = 99\nrated-power-w = 300\n",
		     "f:8: [heater x]: pwm: \"9\" is out of range; allowed: none | 0..5 "
		     "(terminals 22 to 17)");
	assert_fault(GOOD "max-heater-power-w = 200\n",
		     "f:4: [device a]: max-heater-power-w has no effect without a [heater NAME]");
	snprintf(text, sizeof(text), GOOD "max-heater-power-w = 299\n%s", relay);
	assert_fault(text,
		     "f:4: [device a]: max-heater-power-w = 299 is too low: it has to "
		     "be at least 300, the power of the heaters with output-pin, which cannot "
		     "be limited");
	snprintf(text, sizeof(text), GOOD "max-heater-power-w = 300\n%s", relay);
	assert_int_equal(parse(text), 0);
	snprintf(text, sizeof(text), GOOD "max-heater-power-w = 300\n%s" BED "rated-power-w = 40\n",
		 relay);
	assert_fault(text, "f:4: [device a]: max-heater-power-w = 300 is too low: it has to "
			   "be above 300, the power of the heaters with output-pin, which cannot "
			   "be limited");
}

/* pokeysctl config apply compares them as bytes, to tell what needs a restart. */
static void the_same_file_is_the_same_configuration(void **state)
{
	static struct config first;

	(void)state;
	assert_int_equal(parse(GOOD BED), 0);
	first = config;
	memset(&config, 0xa5, sizeof(config));
	assert_fault(GOOD "port = 1x\n", "f:4: [device a]: port: \"1x\" is not allowed; allowed: "
					 "1..65535");
	assert_int_equal(parse(GOOD BED), 0);
	assert_memory_equal(&first.device[0], &config.device[0], sizeof(first.device[0]));
	assert_int_equal(parse(GOOD BED "max-rate = 2\n"), 0);
	assert_memory_not_equal(&first.device[0], &config.device[0], sizeof(first.device[0]));
}

static void every_kind_of_sensor_is_one(void **state)
{
	static const struct {
		const char *lines;
		enum sensor_kind kind;
		double ohm;
	} sensors[] = {
		{ "sensor = thermistor\nthermistor-ohm = 10000\nthermistor-celsius = 20\n"
		  "thermistor-beta = 3435\n",
		  SENSOR_BETA, 10000 },
		{ "sensor = pt100\npull-up-ohm = 470\n", SENSOR_PLATINUM, 100 },
		{ "sensor = pt1000\n", SENSOR_PLATINUM, 1000 },
		{ "sensor = linear\nvolts-at-0 = 0.5\nvolts-per-kelvin = 0.01\n", SENSOR_LINEAR,
		  100000 },
		{ "sensor = steinhart-hart\nsensor-points = 250:226, 150:1641, 25:100000\n",
		  SENSOR_STEINHART, 100000 },
	};

	(void)state;
	for (size_t i = 0; i < sizeof(sensors) / sizeof(sensors[0]); i++) {
		char text[512];

		snprintf(text, sizeof(text),
			 GOOD "[heater x]\nsensor-pin = 47\npwm = 5\n"
			      "max-temperature = 150\n%s",
			 sensors[i].lines);
		if (parse(text))
			fail_msg("%s: %s", sensors[i].lines, heard.line[0]);
		assert_int_equal(heater(0)->heater.sensor.kind, sensors[i].kind);
		assert_near(heater(0)->heater.sensor.ohm, sensors[i].ohm);
	}
}

static void heaters_are_those_of_their_device(void **state)
{
	(void)state;
	assert_int_equal(
		parse(GOOD "[device b]\n" B_KEYS
			   "[heater one]\ndevice = b\nsensor-pin = 43\nsensor = pt1000\npwm = 1\n"
			   "max-temperature = 99\n"
			   "[heater two]\ndevice = a\nsensor-pin = 43\nsensor = pt1000\npwm = 1\n"
			   "max-temperature = 99\n"
			   "[heater three]\ndevice = b\nsensor-pin = 44\nsensor = pt1000\npwm = 2\n"
			   "max-temperature = 99\n"),
		0);
	assert_int_equal(config.device[0].heaters, 1);
	assert_int_equal(config.device[1].heaters, 2);
	assert_string_equal(config.device[0].heater[0].name, "two");
	assert_string_equal(config.device[1].heater[1].name, "three");
	assert_fault(GOOD "[device b]\n" B_KEYS BED,
		     "f:7: [heater bed]: device is not given; it is needed if there are several "
		     "devices");
	assert_fault(GOOD BED "device = mill\n",
		     "f:9: [heater bed]: device: there is no [device mill]");
}

static void what_is_missing_or_has_no_effect_is_a_fault(void **state)
{
	(void)state;
	assert_fault(GOOD "[heater x]\nsensor = pt100\npwm = 0\nmax-temperature = 99\n",
		     "f:4: [heater x]: sensor-pin is not given");
	assert_fault(GOOD "[heater x]\nsensor-pin = 43\npwm = 0\nmax-temperature = 99\n",
		     "f:4: [heater x]: sensor is not given");
	assert_fault(GOOD "[heater x]\nsensor-pin = 43\nsensor = pt1000\npwm = 0\n",
		     "f:4: [heater x]: max-temperature is not given");
	assert_fault(GOOD "[heater x]\nsensor-pin = 43\nsensor = pt1000\nmax-temperature = 99\n",
		     "f:4: [heater x]: neither pwm nor output-pin is given; give one of them");
	assert_fault(GOOD "[heater x]\nsensor-pin = 43\nsensor = pt1000\nmax-temperature = 99\n"
			  "pwm = none\n",
		     "f:8: [heater x]: neither pwm nor output-pin is given; give one of them");
	assert_fault(GOOD "[heater x]\nsensor-pin = 43\nsensor = pt1000\nmax-temperature = 99\n"
			  "output-pin = 56\n",
		     "f:8: [heater x]: output-pin: \"56\" is out of range; allowed: none | 1..55");
	assert_fault(GOOD "[heater x]\nsensor-pin = 43\nsensor = table\nmax-temperature = 99\n"
			  "pwm = 1\nsensor-points = 0:1000, 200:100\nreference-v = 5\n",
		     "f:10: [heater x]: reference-v has no effect with pull-up-ohm above 0");
	assert_fault(GOOD BED "output-pin = 3\n",
		     "f:9: [heater bed]: output-pin and pwm are both given; give only one");
	assert_fault(GOOD BED "volts-at-0 = 1\n",
		     "f:9: [heater bed]: volts-at-0 has no effect with this kind of sensor");
	assert_fault(GOOD BED "hysteresis = 1\n",
		     "f:9: [heater bed]: hysteresis has no effect with control = pid");
	assert_fault(GOOD BED "control = bang-bang\npid-p = 3\n",
		     "f:10: [heater bed]: pid-p has no effect with control = bang-bang");
	assert_fault(GOOD BED "min-switch-s = 3\n",
		     "f:9: [heater bed]: min-switch-s has no effect with pwm");
	assert_fault(GOOD BED "pid-d = nan\n",
		     "f:9: [heater bed]: pid-d: \"nan\" is not a number; allowed: 0..100000");
	assert_fault(GOOD BED "pid-q = 1\n",
		     "f:9: [heater bed]: there is no key pid-q; did you mean pid-p?");
	assert_fault(GOOD "pid-p = 1\n",
		     "f:4: [device a]: pid-p belongs in a [heater NAME] section");
}

static void limits_that_cross_and_curves_that_turn_are_faults(void **state)
{
	(void)state;
	assert_fault(GOOD BED "min-temperature = 120\n",
		     "f:9: [heater bed]: min-temperature has to be below max-temperature");
	assert_fault(GOOD BED "max-target = 118\n",
		     "f:9: [heater bed]: max-target has to be above 0, and at least watch-slack "
		     "below max-temperature (auto: 15 K below)");
	assert_fault(GOOD BED "pid-p = 0\npid-i = 0\n",
		     "f:9: [heater bed]: pid-p and pid-i are both 0: the heater would never have "
		     "power");
	/* the line of a key that the file has */
	assert_fault(GOOD BED "pid-d = 0\nmin-temperature = -200\n",
		     "f:10: [heater bed]: min-temperature is below what the sensor can measure");
	assert_fault(GOOD "[heater x]\nsensor-pin = 43\nsensor = table\npwm = 0\n"
			  "max-temperature = 99\nsensor-points = 0:100, 50:200, 40:300\n",
		     "f:9: [heater x]: the temperatures of the table have to rise, or to fall");
	assert_fault(GOOD "[heater x]\nsensor-pin = 43\nsensor = steinhart-hart\npwm = 0\n"
			  "max-temperature = 99\nsensor-points = 0:100, 50:\n",
		     "f:9: [heater x]: sensor-points: \"0:100, 50:\" is not a number; allowed: at "
		     "most 32 points with commas between, such as 25:100000, 150:1641");
}

static void a_terminal_of_a_heater_is_its_own(void **state)
{
	static const char other[] = "[heater two]\nsensor-pin = 44\nsensor = pt1000\npwm = 1\n"
				    "max-temperature = 99\n";
	static const char relay[] = "[heater two]\nsensor-pin = 44\nsensor = pt1000\n"
				    "output-pin = 12\nmax-temperature = 99\n";
	static const struct {
		const char *device, *heater, *expected;
	} pairs[] = {
		{ BED,
		  "[heater x]\nsensor-pin = 43\nsensor = pt1000\npwm = 1\n"
		  "max-temperature = 99\n",
		  "[heater x]: sensor-pin: terminal 43 is used by [heater bed] sensor-pin (line "
		  "5)" },
		{ BED,
		  "[heater x]\nsensor-pin = 44\nsensor = pt1000\npwm = 0\n"
		  "max-temperature = 99\n",
		  "[heater x]: pwm: terminal 22 is used by [heater bed] pwm" },
		{ "digital-inputs = 44\n", other,
		  "[heater two]: sensor-pin: terminal 44 is used by [device a] digital-inputs" },
		{ "digital-inputs = 12\n", relay,
		  "[heater two]: output-pin: terminal 12 is used by [device a] digital-inputs" },
		{ "axis.1.limit-minus-pin = 12\n", relay,
		  "terminal 12 is used by [device a] axis.1.limit-minus-pin" },
		{ "safe-on = 12\nfailsafe-on = 13\ndigital-outputs = 12, 13\n", relay,
		  "terminal 12 is used by [device a] safe-on" },
		{ "digital-outputs = 21\n", other,
		  "[heater two]: pwm: terminal 21 is used by [device a] digital-outputs" },
	};

	(void)state;
	for (size_t i = 0; i < sizeof(pairs) / sizeof(pairs[0]); i++) {
		char text[1024];
		int faults;

		snprintf(text, sizeof(text), GOOD "%s%s", pairs[i].device, pairs[i].heater);
		faults = parse(text);
		if (faults != 1 || !strstr(heard.line[0], pairs[i].expected))
			fail_msg("%s: %d faults, the first: %s", text, faults, heard.line[0]);
	}
	assert_int_equal(parse(GOOD "digital-outputs = 12\n" BED), 0);
}

static void a_heater_that_the_device_would_leave_on_is_refused(void **state)
{
	static const struct {
		const char *device, *expected;
	} devices[] = {
		{ "failsafe = off\n", "the failsafe of its device is off" },
		{ "failsafe-timeout-ms = off\n", "the failsafe of its device is off" },
		{ "failsafe-parts = 11\n",
		  "failsafe-parts of its device does not include PWM outputs" },
		{ "failsafe-pwm = 1,0,0,0,0,0\n",
		  "failsafe-pwm of its device keeps this output on" },
	};
	char text[512];

	(void)state;
	for (size_t i = 0; i < sizeof(devices) / sizeof(devices[0]); i++) {
		snprintf(text, sizeof(text), GOOD "%s" BED, devices[i].device);
		if (parse(text) != 1 || !strstr(heard.line[0], devices[i].expected) ||
		    !strstr(heard.line[0], "without-failsafe = yes accepts that"))
			fail_msg("%s: the first: %s", text, heard.line[0]);
		snprintf(text, sizeof(text), GOOD "%s" BED "without-failsafe = yes\n",
			 devices[i].device);
		assert_int_equal(parse(text), 0);
	}
	/* another one may stay on */
	assert_int_equal(parse(GOOD "failsafe-pwm = 0,1,0,0,0,0\n" BED), 0);
	snprintf(text, sizeof(text), GOOD "failsafe-on = 12\ndigital-outputs = 12\n%s",
		 "[heater x]\nsensor-pin = 43\nsensor = pt1000\noutput-pin = 12\n"
		 "max-temperature = 99\n");
	assert_int_equal(parse(text), 1);
	assert_non_null(strstr(heard.line[0], "failsafe-on of its device keeps this output on"));
}

static void a_device_that_cannot_send_enough_is_refused(void **state)
{
	(void)state;
	assert_fault(GOOD "window = 3\n" BED,
		     "f:4: [device a]: window = 3 is too small for heaters and servo motors, which "
		     "need 4 or more");
	assert_int_equal(parse(GOOD "window = 4\n" BED), 0);
	assert_fault(GOOD "slow = together\nwindow = 20\n" BED,
		     "f:5: [device a]: window = 20 is too small for slow = together, which needs "
		     "21 or more beside heaters and servo motors");
	assert_int_equal(parse(GOOD "window = 2\n"), 0);
}

static void a_device_that_spoils_a_heater_is_refused(void **state)
{
	static const char device[] = "[device a]\naddress = 10.0.0.1\n";
	static const char slow[] = "[heater x]\nsensor-pin = 41\nsensor = pt1000\noutput-pin = 12\n"
				   "max-temperature = 99\n";
	static const struct {
		const char *keys, *heater, *expected;
	} bad[] = {
		{ "", BED, "pwm needs pwm-period in [device a]" },
		{ "pwm-period = 100\n", BED, "pwm-period of its device has to be 250 to 25000000" },
		{ "pwm-period = 2500\nsynced-pwm = on\nsynced-pwm-channel = 3\n", BED,
		  "pwm and synced-pwm of its device exclude each other" },
		{ "pwm-period = 2500\nanalog-filter = 500\n", BED,
		  "analog-filter of its device is above 100" },
		{ "pwm-period = 2500\nfailsafe-timeout-ms = 5100\n", BED,
		  "failsafe-timeout-ms of its device is longer than 5000" },
		{ "analog-hz = 5\n", slow,
		  "max-age-ms = 300 has to be at least two readings of "
		  "its device, which are 400 ms (analog-hz)" },
		{ "pwm-period = 2500\nfast-divider = 200\n", BED, "fast-divider" },
		{ "",
		  "[heater x]\nsensor-pin = 43\nsensor = pt1000\noutput-pin = 12\n"
		  "max-temperature = 99\nmin-switch-s = 20\n",
		  "min-switch-s = 20 must not be longer than a third of watch-window-s" },
	};
	char text[512];

	(void)state;
	for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
		snprintf(text, sizeof(text), "%s%s%s", device, bad[i].keys, bad[i].heater);
		if (!parse(text) || !strstr(heard.line[0], bad[i].expected))
			fail_msg("%s: %d faults, the first: %s", text, heard.count, heard.line[0]);
	}
	snprintf(text, sizeof(text), "%sanalog-hz = 10\n%s", device, slow);
	assert_int_equal(parse(text), 0);
}

static void sections_are_counted_and_named(void **state)
{
	char text[4096] = GOOD;
	size_t at = strlen(text);

	(void)state;
	assert_fault(GOOD BED BED, "f:9: [heater bed] was there before, at line 4");
	assert_fault(GOOD "[heater b/c]\n", "f:4: [heater b/c]: a heater's name has 1 to 31 of the "
					    "characters A-Z a-z 0-9 _ -");
	for (unsigned int i = 0; i < 8; i++)
		at += (size_t)snprintf(text + at, sizeof(text) - at,
				       "[heater h%u]\nsensor-pin = %u\nsensor = pt1000\n"
				       "output-pin = %u\nmax-temperature = 99\n",
				       i, i < 7 ? 41 + i : 47, 1 + i);
	parse(text);
	assert_non_null(strstr(heard.line[0], "f:39: [heater h7]: [device a] has more than 7 "
					      "heaters"));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_heater_with_what_it_needs_is_taken),
		cmocka_unit_test(every_key_arrives),
		cmocka_unit_test(a_fan_and_a_supply_arrive),
		cmocka_unit_test(a_fan_or_a_supply_that_cannot_be_is_refused),
		cmocka_unit_test(the_same_file_is_the_same_configuration),
		cmocka_unit_test(every_kind_of_sensor_is_one),
		cmocka_unit_test(heaters_are_those_of_their_device),
		cmocka_unit_test(what_is_missing_or_has_no_effect_is_a_fault),
		cmocka_unit_test(limits_that_cross_and_curves_that_turn_are_faults),
		cmocka_unit_test(a_terminal_of_a_heater_is_its_own),
		cmocka_unit_test(a_heater_that_the_device_would_leave_on_is_refused),
		cmocka_unit_test(a_device_that_cannot_send_enough_is_refused),
		cmocka_unit_test(a_device_that_spoils_a_heater_is_refused),
		cmocka_unit_test(sections_are_counted_and_named),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
