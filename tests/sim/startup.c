// SPDX-License-Identifier: GPL-2.0-or-later
/* Scripts and the command line: what they say happens, and a mistake is named. */
#include "tests/sim/talk.h"

#include <stdio.h>

#include "sim/options.h"
#include "sim/parse.h"
#include "sim/script.h"

static struct sim_rig rig;
static struct sim_control control;
static uint64_t now_ns;

static void begin(void)
{
	sim_rig_init(&rig, NULL);
	memset(&control, 0, sizeof(control));
	control.rig = &rig;
	now_ns = 1000 * MS;
	sim_rig_run(&rig, now_ns);
}

static struct sim_script script;
static char why[512];

static bool parse_script(char *text)
{
	struct sim_text reason;

	sim_text_init(&reason, why, sizeof(why));
	return sim_script_parse(&script, text, &reason);
}

static bool run_script(uint64_t ms)
{
	struct sim_text reason;

	sim_text_init(&reason, why, sizeof(why));
	now_ns = (1000 + ms) * MS;
	return sim_script_run(&script, &control, ms * MS, now_ns, &reason);
}

static void a_script_runs_in_its_time(void **state)
{
	char text[] = "pin 1 0\nwait 500\npin 2 0 # half a second\n"
		      "wait 500 pin 3 0\n\n# nothing\nat 3000 exit\n";

	(void)state;
	begin();
	assert_true(parse_script(text));
	assert_int_equal(script.count, 4);
	assert_true(run_script(0));
	assert_int_equal(rig.device.bench.pins.level & 7, 6);
	assert_int_equal(sim_script_next(&script), 500 * MS);
	assert_true(run_script(999));
	assert_int_equal(rig.device.bench.pins.level & 7, 4);
	assert_true(run_script(2999));
	assert_int_equal(rig.device.bench.pins.level & 7, 0);
	assert_false(control.exit);
	assert_true(run_script(3000));
	assert_true(control.exit);
	assert_true(sim_script_next(&script) == UINT64_MAX);
}

static void a_bad_script_names_its_line(void **state)
{
	char early[] = "at 500 pin 1 0\nat 400 pin 2 0\n";
	char time[] = "\n\nwait soon\n";
	char command[] = "pin 1 0\n\npin 99 0\n";

	(void)state;
	begin();
	assert_false(parse_script(early));
	assert_string_equal(why, "line 2: at: 400 is earlier than the line before");
	assert_false(parse_script(time));
	assert_string_equal(why, "line 3: wait: 'soon' is not 0..86400000");
	assert_true(parse_script(command));
	assert_false(run_script(0));
	assert_int_equal(strncmp(why, "line 3: error: pin: '99' is not 1..55", 37), 0);
}

static struct sim_options options;

/* A command line in one string; the options keep pointers into it. */
static bool parse_options(const char *command_line)
{
	static char text[512];
	char *argv[40];
	struct sim_text reason;
	int argc;

	snprintf(text, sizeof(text), "%s", command_line);
	argc = sim_parse_words(text, argv, 39);
	argv[argc] = NULL;
	sim_text_init(&reason, why, sizeof(why));
	return sim_options_parse(&options, argc, argv, &reason);
}

static void options_are_taken_in_both_forms(void **state)
{
	(void)state;
	assert_true(parse_options("pokeys-sim --model 57E --serial=77 --loss 0.5 "
				  "--loss-reply=0.25 --delay-us-request 10-20 --service-us 380 "
				  "--address 127.3.2.1 --no-tcp --spin --preset=demo"));
	assert_int_equal(options.rig.device.hardware, WIRE_HW_57E_V11);
	assert_int_equal(options.rig.device.serial, 77);
	assert_true(options.rig.link.faults[SIM_LINK_REQUEST].loss == 0.5);
	assert_true(options.rig.link.faults[SIM_LINK_REPLY].loss == 0.25);
	assert_int_equal(options.rig.link.faults[SIM_LINK_REQUEST].delay.high_ns, 20000);
	assert_int_equal(options.rig.link.faults[SIM_LINK_REPLY].delay.high_ns, 0);
	assert_int_equal(options.rig.service_ns, 380000);
	assert_int_equal(options.rig.device.ip[1], 3);
	assert_false(options.tcp);
	assert_true(options.spin && options.discovery);
}

static void bad_options_are_refused_in_one_line(void **state)
{
	static const struct {
		const char *given;
		const char *want;
	} bad[] = {
		{ "--modle 57E", "there is no option --modle; pokeys-sim --help lists them" },
		{ "x", "there is no option x; pokeys-sim --help lists them" },
		{ "--serial", "--serial: needs a value; pokeys-sim --help lists the options" },
		{ "--serial 0", "--serial: '0' is not 1..4294967295" },
		{ "--port=70000", "--port: '70000' is not 0..65535" },
		{ "--model 58", "--model: '58' is not one of " SIM_HARDWARE_NAMES },
		{ "--address 127.0.0.256",
		  "--address: '127.0.0.256' is not an address as 127.0.0.1" },
		{ "--address 0.0.0.0", "--address: 0.0.0.0 is not one a device can have" },
		{ "--loss 1.5", "--loss: '1.5' is not 0..1" },
		{ "--copies-reply=-1", "--copies-reply: '-1' is not 0..1000" },
		{ "--spin=1", "--spin: takes no value" },
		{ "--preset mill",
		  "--preset: 'mill' is not factory|loopback|demo|printer|servo-mill" },
		{ "--delay-us a", "--delay-us: 'a' is not US, LOW-HIGH or heavy:LOW:HIGH[:ALPHA]" },
		{ "--hiccup -1", "--hiccup: '-1' is not 0..1" },
	};

	(void)state;
	for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
		char text[100];

		snprintf(text, sizeof(text), "pokeys-sim %s", bad[i].given);
		assert_false(parse_options(text));
		assert_string_equal(why, bad[i].want);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_script_runs_in_its_time),
		cmocka_unit_test(a_bad_script_names_its_line),
		cmocka_unit_test(options_are_taken_in_both_forms),
		cmocka_unit_test(bad_options_are_refused_in_one_line),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
