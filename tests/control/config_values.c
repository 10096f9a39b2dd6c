// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What is written in a configuration arrives as its users need it, and what is
 * left out is completed.
 */
#include "tests/control/faults.h"

static void what_is_written_arrives_in_the_units_of_its_users(void **state)
{
	const struct device_config *d = &config.device[0];

	(void)state;
	assert_int_equal(parse("[daemon]\nperiod-us = 500\nmode = spin\ncpu = 3\nrealtime = "
			       "optional\n"
			       "discovery-address = 10.0.0.255, 127.1.2.3\ntransport = socket\n"
			       "metrics-file = /run/m\n[device mill]\nserial = 4294967295\n"
			       "stale-after-ms = 2.5\ndigital-inputs = 1,8-9\ndigital-outputs = "
			       "7,55\n"
			       "analog-inputs=41-47\ninverted-pins = 8,55\nsafe-on = 7\nsafe-hold "
			       "= 55\n"
			       "axes = 3\naxis.2.mode = position\naxis.2.max-speed = 12000.5\n"
			       "axis.2.soft-minimum = -5\nencoder.24.pins = "
			       "3,4\nencoder.24.sampling = 2\n"
			       "emergency-pin = 52\nfast-encoders = on\n"),
			 0);
	assert_int_equal(config.loop.period_ns, 500000);
	assert_int_equal(config.wait, CONFIG_WAIT_SPIN);
	assert_int_equal(config.cpu, 3);
	assert_false(config.realtime_required);
	assert_int_equal(config.discovery_addresses, 2);
	assert_int_equal(config.discovery_address[1], 0x7f010203);
	assert_string_equal(config_transport_name(config.transport), "socket");
	assert_string_equal(d->name, "mill");
	assert_true(d->serial == 4294967295u);
	assert_int_equal(d->stale_after_ns, 2500000);
	assert_int_equal(d->period_ns, 500000);
	assert_int_equal(d->settings.pin_set[0], 0xc1);
	assert_int_equal(d->settings.pin_set[1], 0x01);
	assert_int_equal(d->settings.pin_function[0], 0x02);
	assert_int_equal(d->settings.pin_function[6], 0x04);
	assert_int_equal(d->settings.pin_function[7], 0x82);
	assert_int_equal(d->settings.pin_function[54], 0x84);
	assert_int_equal(d->settings.pin_function[40], 0x08);
	assert_int_equal(d->safe_outputs[0], 0x40);
	assert_int_equal(d->safe_mask[0], 0xff);
	assert_int_equal(d->safe_mask[6], 0x3f);
	assert_int_equal(d->safe_hold[6], 0x40);
	assert_int_equal(d->settings.set, POKEYS_SET_AXES | POKEYS_SET_EMERGENCY_PIN |
						  POKEYS_SET_FAST_ENCODERS | POKEYS_SET_FAILSAFE);
	assert_int_equal(d->settings.axes, 3);
	assert_int_equal(d->settings.emergency_pin, 62);
	assert_int_equal(d->settings.fast_configuration, 10);
	assert_int_equal(d->settings.axis[2].options, 0x0D);
	assert_int_equal(d->settings.axis[2].options_mask, 0x0D);
	assert_int_equal(d->settings.axis[2].set,
			 POKEYS_AXIS_SET_MAX_SPEED | POKEYS_AXIS_SET_SOFT_MINIMUM);
	assert_true(d->settings.axis[2].max_speed > 12000.4f &&
		    d->settings.axis[2].max_speed < 12000.6f);
	assert_int_equal(d->settings.axis[1].set, 0);
	assert_int_equal(d->settings.axis[1].options_mask, 0);
	assert_int_equal(d->settings.encoder[24].options, 5);
	assert_int_equal(d->settings.encoder[24].options_mask, 7);
	assert_int_equal(d->settings.encoder[24].pins_set, 1);
	assert_int_equal(d->settings.encoder[24].pin_a, 2);
	assert_int_equal(d->settings.encoder[24].pin_b, 3);
	assert_int_equal(d->settings.encoder[23].options_mask, 0);
}

#define REFUSED(value)	"f:3: [device a]: resume-outputs: \"" value "\" "
#define ALLOWED								\
	"; allowed: auto | none | all | pwm | PoExtBus | external | PoNET | pins 1..55 as "	\
	"a list such as 1-3,5"

static uint64_t resumes(const char *value)
{
	const struct device_config *d = &config.device[0];
	char text[256];
	uint64_t pins;

	snprintf(text, sizeof(text), GOOD "resume-outputs = %s\n", value);
	assert_int_equal(parse(text), 0);
	memcpy(&pins, d->resume_outputs, sizeof(pins));
	return pins | (uint64_t)d->resume_parts << 56 | (uint64_t)d->resume_auto << 63;
}

static void outputs_that_resume_are_words_and_pins(void **state)
{
	const uint64_t pwm = UINT64_C(1) << 56, bus = pwm << 1, external = pwm << 2;
	const uint64_t pins = (UINT64_C(1) << 55) - 1, by_engine = UINT64_C(1) << 63;

	(void)state;
	assert_int_equal(parse(GOOD), 0);
	assert_true(config.device[0].resume_auto);
	assert_true(resumes("auto") == by_engine);
	assert_true(resumes("none") == 0);
	assert_true(resumes("all") == (pins | UINT64_C(0xf) << 56));
	assert_true(resumes("pwm") == pwm);
	assert_true(resumes("31") == UINT64_C(1) << 30);
	assert_true(resumes("PoExtBus, 1-2, external") == (bus | external | 3));
	assert_fault(GOOD "resume-outputs = auto, 31\n",
		     REFUSED("auto, 31") "has a word in it that has to stand alone" ALLOWED);
	assert_fault(GOOD "resume-outputs = 31, all\n",
		     REFUSED("31, all") "has a word in it that has to stand alone" ALLOWED);
	assert_fault(GOOD "resume-outputs = pwm, pwm\n",
		     REFUSED("pwm, pwm") "names something twice" ALLOWED);
	assert_fault(GOOD "resume-outputs = relays\n",
		     REFUSED("relays") "is not a list of pins" ALLOWED);
	/* all needs no list of outputs */
	assert_int_equal(parse(GOOD "digital-inputs = 1-8\nresume-outputs = all\n"), 0);
}

static void no_retries_are_none(void **state)
{
	(void)state;
	assert_int_equal(parse(GOOD "retries = 0\n"), 0);
	assert_true(config.device[0].mailbox.retries == POKEYS_NO_RETRIES);
	assert_int_equal(parse(GOOD "retries = 20\n"), 0);
	assert_int_equal(config.device[0].mailbox.retries, 20);
	assert_int_equal(parse(GOOD "retries = 21\n"), 1);
}

static void failsafe_is_the_safe_state_unless_told_otherwise(void **state)
{
	const struct pokeys_settings *settings = &config.device[0].settings;

	(void)state;
	assert_int_equal(parse(GOOD "safe-on = 3\n"), 0);
	assert_true(settings->set & POKEYS_SET_FAILSAFE);
	assert_int_equal(settings->failsafe_timeout, 10);
	assert_int_equal(settings->failsafe_outputs[0], 4);
	assert_int_equal(parse(GOOD "safe-on = 3\nfailsafe-on = 4\nfailsafe-timeout-ms = 500\n"),
			 0);
	assert_int_equal(settings->failsafe_timeout, 5);
	assert_int_equal(settings->failsafe_outputs[0], 8);
	assert_int_equal(parse(GOOD "failsafe-timeout-ms = off\n"), 0);
	assert_true(settings->set & POKEYS_SET_FAILSAFE);
	assert_int_equal(settings->failsafe_timeout, 0);
	assert_int_equal(parse(GOOD "failsafe = off\n"), 0);
	assert_false(settings->set & POKEYS_SET_FAILSAFE);
	assert_int_equal(parse(GOOD "failsafe = off\nfailsafe-pwm = 5\n"), 1);
	assert_non_null(strstr(heard.line[0], "f:3: [device a]: failsafe = off leaves"));
}

static void settings_that_say_a_part_are_completed(void **state)
{
	const struct pokeys_settings *settings = &config.device[0].settings;

	(void)state;
	assert_int_equal(parse(GOOD "encoder.3.pins = 1,2\nencoder.4.sampling = 1\n"
				    "encoder.5.enable = off\nultra-fast-encoder = on\n"
				    "axis.0.max-acceleration = 500\nmatrix-keyboard = off\n"),
			 0);
	assert_int_equal(settings->encoder[3].options, 3);
	assert_int_equal(settings->encoder[4].options, 1);
	assert_int_equal(settings->encoder[5].options & 1, 0);
	assert_int_equal(settings->encoder[5].options_mask & 1, 1);
	assert_int_equal(settings->ultra_options, 4);
	assert_true(settings->axis[0].set & POKEYS_AXIS_SET_MAX_DECELERATION);
	assert_true(settings->axis[0].max_deceleration > 499);
	assert_int_equal(settings->matrix_rows, 1);
	assert_fault(GOOD "matrix-keyboard = on\nmatrix-rows = 1-4\n",
		     "f:3: [device a]: matrix-keyboard = on, matrix-rows and matrix-columns need "
		     "each other");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(what_is_written_arrives_in_the_units_of_its_users),
		cmocka_unit_test(outputs_that_resume_are_words_and_pins),
		cmocka_unit_test(no_retries_are_none),
		cmocka_unit_test(failsafe_is_the_safe_state_unless_told_otherwise),
		cmocka_unit_test(settings_that_say_a_part_are_completed),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
