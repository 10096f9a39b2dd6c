// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The control language: good commands work, bad ones are refused with what was
 * wrong and what is allowed, and nothing is changed by them.
 */
#include "tests/sim/talk.h"

#include <stdio.h>

#include "sim/control.h"
#include "sim/fault.h"
#include "sim/preset.h"

static struct sim_rig rig;
static struct sim_rig untouched;
static struct sim_control control;
static char reply[SIM_CONTROL_REPLY];
static uint64_t now_ns;

static void begin(void)
{
	sim_rig_init(&rig, NULL);
	memset(&control, 0, sizeof(control));
	control.rig = &rig;
	now_ns = 1000 * MS;
	sim_rig_run(&rig, now_ns);
}

static bool run(const char *text)
{
	char line[2048];
	struct sim_text out;

	snprintf(line, sizeof(line), "%s", text);
	sim_text_init(&out, reply, sizeof(reply));
	return sim_control_run(&control, now_ns, line, &out);
}

static void must(const char *text)
{
	if (!run(text))
		fail_msg("%s: %s", text, reply);
	assert_string_equal(reply + strlen(reply) - 3, "ok\n");
}

static void must_say(const char *text, const char *part)
{
	must(text);
	if (!strstr(reply, part))
		fail_msg("%s: no %s in %s", text, part, reply);
}

static void fields_are_shown_and_changed(void **state)
{
	(void)state;
	begin();
	must_say("field pwm.period", "pwm.period=");
	must("field pin.function 8 2");
	assert_int_equal(rig.device.config.pins.function[8], 2);
	must_say("field pin.function", "pin.function=0x");
	must("field axis.pulses 3 -5000000000");
	assert_int_equal(rig.device.engine.axis[3].pulses, -INT64_C(5000000000));
	must("field axis.block 56 255");
	assert_int_equal(rig.device.config.engine.axis[1][1], 255);
	must_say("field", "axis.block.7=0x");
	assert_false(run("field axis.block 440 1"));
	assert_false(run("field pin.function 0 256"));
	assert_false(run("field pin.function 0"));
	assert_false(run("field nothing"));
}

static void commands_move_the_bench(void **state)
{
	(void)state;
	begin();
	must("pin 9 0");
	assert_int_equal(sim_pin_level(&rig.device, 8), 0);
	must_say("pin 9", "level=0\n");
	must("wire 9 20");
	must_say("pin 20", "level=0\n");
	must("unwire 20");
	must_say("pin 20", "level=1\n");
	must("function 20 4");
	must_say("pin 20", "function=0x04\n");
	must("encoder 3 count -5");
	must_say("encoder 3", "count=-5\n");
	must("function 41 8");
	must_say("analog 41 1234", "value=1234\n");
	must("key 127 1");
	assert_int_equal(rig.device.bench.keys[15], 0x80);
	must("emergency pressed");
	must_say("emergency", "active=1\n");
	must("emergency released");
	must("input 5 1");
	assert_int_equal(rig.device.bench.machine.misc, 0x10);
	must("driver-error 2 1");
	assert_int_equal(rig.device.bench.machine.driver_error, 0x04);
	must("raw 1 home 0");
	assert_int_equal(rig.device.bench.machine.raw_home, 0xFD);
	must("kbd 0 5 2 1");
	must_say("lamp 0 0 0", "lit=0\n");
	must("sensor 7 -300 ok");
	assert_int_equal(rig.device.bench.bus.sensor[7], -300);
	must("temperature -10.5");
	assert_int_equal(rig.device.bench.bus.temperature, -168);
	must("load 99");
	must("counter 1 12");
	must_say("counter 1", "counter=12\n");
	must("mismatch 0 -9");
	must("module 3 on 200");
	assert_true(rig.device.bench.bus.module[3].present);
}

static void machines_are_built_by_command(void **state)
{
	const struct sim_mechanics *m = &rig.device.bench.machine.axis[1];

	(void)state;
	begin();
	must("switch 1 home -100000 -2000 no 9");
	assert_true(m->home.wired && m->home.normally_open);
	assert_int_equal(m->home.pin, 8);
	assert_int_equal(m->home.to, -2000);
	must_say("pin 9", "level=1\n");
	must("axis 1 machine -3000");
	must_say("pin 9", "level=0\n");
	must("switch 1 home off");
	must_say("pin 9", "level=1\n");
	must("axis 1 couple 4 3 2 100");
	assert_int_equal(m->encoder, 4);
	assert_int_equal(m->index_every, 100);
	must("axis 1 decouple");
	assert_int_equal(m->encoder, -1);
	must("probe 0 100 200 no input 5");
	assert_int_equal(rig.device.bench.machine.probe.pin, SIM_PROBE_INPUT + 5);
	must("probe off");
	must_say("engine", "state=0\n");
}

static void pass(uint64_t seconds)
{
	now_ns += seconds * 1000 * MS;
	sim_rig_run(&rig, now_ns);
}

static uint16_t reading(unsigned int input)
{
	return sim_analog_value(&rig.device, input);
}

static void heat_goes_from_an_output_to_an_input(void **state)
{
	uint16_t cold;

	(void)state;
	begin();
	must("preset printer");
	pass(1);
	cold = reading(2);
	must_say("heat 43", "block=22.0\nsensor=22.0\npower=0.000\n");
	must("field pwm.enabled 0 3");
	must("field pwm.duty 0 1250000");
	must("field pwm.duty 1 2500000");
	pass(20);
	must_say("heat 43", "power=0.500\n");
	must_say("heat 44", "power=1.000\n");
	assert_true(rig.device.bench.oven[2].heat.sensor > 40);
	assert_true(rig.device.bench.oven[3].heat.sensor > 26);
	assert_true(reading(2) < cold - 200); /* the hotter, the less */
	must("heat 43 open");
	pass(1);
	assert_int_equal(reading(2), SIM_ANALOG_MAX);
	must("heat 43 short");
	pass(1);
	assert_in_range(reading(2), 0, 5);
	must("heat 43 good");
	must("heat 43 fan 1");
	must("field pwm.enabled 0 0");
	pass(600);
	must_say("heat 43", "power=0.000\n");
	assert_true(rig.device.bench.oven[2].heat.sensor < 23);
	/* another one, by a digital output, and off again */
	must("heat 44 none");
	must("function 44 8");
	must("function 12 4");
	must("heat 41 bed pin 12");
	sim_pins_write(&rig.device, 1u << 11, 1u << 11);
	must_say("heat 41", "power=1.000\n");
	must_say("heat 44", "fitted=0\n");
	must("heat 41 drift -500");
}

static void a_motor_moves_its_switches(void **state)
{
	const struct sim_servo *servo = &rig.device.bench.servo[1];

	(void)state;
	begin();
	must("preset servo-mill");
	must("motor 1 minus -1000000 -300 12");
	must("motor 1 home -1000000 -100 no 13");
	must("motor 1 plus 400 1000000 14");
	must_say("pin 12", "level=0\n");
	must_say("pin 13", "level=1\n");
	must_say("pin 14", "level=0\n");
	/* forward */
	must("field pwm.enabled 0 2");
	must("field pwm.duty 1 200");
	sim_pins_write(&rig.device, UINT64_C(1) << 35, UINT64_C(1) << 35);
	pass(1);
	assert_true(servo->count > 400);
	must_say("pin 14", "level=1\n");
	must_say("pin 12", "level=0\n");
	/* and back */
	sim_pins_write(&rig.device, UINT64_C(1) << 31, UINT64_C(1) << 31);
	while (servo->count >= -300)
		pass(1);
	must_say("pin 12", "level=1\n");
	must_say("pin 13", "level=0\n");
	must_say("pin 14", "level=0\n");
	must("motor 1 minus off");
	must("motor 1 home -5 -4 12");
	must_say("pin 12", "level=0\n");
	must("motor 1 none");
	must_say("pin 12", "level=1\n");
	must_say("pin 14", "level=1\n");
}

static void the_link_is_spoilt_by_command(void **state)
{
	(void)state;
	begin();
	must("fault both loss 0.25");
	must("fault reply delay-us heavy:100:5000:1.2");
	must("fault request delay-us 50-80");
	must_say("fault", "request.loss=0.25\n");
	must_say("fault", "request.delay-us=50-80\n");
	must_say("fault", "reply.delay-us=heavy:100:5000:1.2\n");
	must("fault off");
	must_say("fault", "reply.loss=0\n");
	must("service 380 100");
	assert_int_equal(rig.service_ns, 380000);
	must("silence 100 reply");
	assert_true(sim_link_is_silent(&rig.link, SIM_LINK_REPLY, now_ns));
	assert_false(sim_link_is_silent(&rig.link, SIM_LINK_REQUEST, now_ns));
}

static void what_was_printed_can_be_read_again(void **state)
{
	struct sim_link_faults read, first;
	char printed[1024];
	struct sim_text text;
	char *line, *rest;

	(void)state;
	memset(&first, 0, sizeof(first));
	first.loss = 0.125;
	first.copies = 3;
	first.reorder_ns = 1500;
	first.delay = (struct sim_delay){ SIM_DELAY_UNIFORM, 1000, 2000, 0 };
	sim_text_init(&text, printed, sizeof(printed));
	sim_fault_print(&first, "", &text);
	memset(&read, 0, sizeof(read));
	rest = printed;
	while ((line = strsep(&rest, "\n")) && *line) {
		char *value = strchr(line, '=');
		char why[200];
		struct sim_text reason;

		*value++ = '\0';
		sim_text_init(&reason, why, sizeof(why));
		assert_true(sim_fault_set(&read, line, value, &reason));
	}
	assert_memory_equal(&read, &first, sizeof(first));
}

/* Every one is refused, says why, and leaves device and link as they were. */
static void bad_commands_change_nothing(void **state)
{
	static const char *const bad[] = {
		"pin",
		"pin 0",
		"pin 56",
		"pin x",
		"pin 1 2",
		"pin 1 1 1",
		"pin 9999999999999999",
		"motor 0 minus 1 2 3",
		"motor 26",
		"motor 0 home",
		"wire 1",
		"wire 1 2 3",
		"blink 1 -1",
		"function 1 256",
		"encoder 26",
		"encoder 1 count",
		"encoder 1 spin 4",
		"encoder 1 count 1.5",
		"analog 40 1",
		"analog 41 4096",
		"analog 41 wave 1 2",
		"heat 40",
		"heat 41 open",
		"heat 41 hotend",
		"heat 41 hotend pwm 6",
		"heat 41 bed pin 0",
		"heat 41 oven",
		"heat 41 bed pwm 1 2",
		"heat 41 none 1",
		"key 128 1",
		"axis 8",
		"axis 0 fly",
		"axis 0 couple 26 1 1",
		"axis 0 couple 1 1 0",
		"axis 0 machine",
		"switch 0",
		"switch 0 left 1 2",
		"switch 0 home 5 4",
		"switch 0 home 1 2 no 56",
		"switch 0 home 1 2 3 4",
		"probe 0 1 2",
		"probe 0 1 2 pin 56",
		"probe off now",
		"emergency broken",
		"fault",
		"fault sideways loss 1",
		"fault both loss 1.01",
		"fault both loss nan",
		"fault both loss",
		"fault both luck 1",
		"fault both delay-us 5-3",
		"fault both delay-us heavy:0:5",
		"fault both copies -1",
		"fault both delay-us 1e300",
		"fault off now",
		"service",
		"service -1",
		"silence -1",
		"silence 5 sideways",
		"reboot gently",
		"reboot keep-config -1",
		"reboot keep-config 1 2",
		"preset",
		"preset lathe",
		"serial 0",
		"load 101",
		"stray 0",
		"stray 5",
		"nonsense",
		"help me and me",
		"sensor 100 1",
		"temperature 500",
		"kbd 0 12 0 1",
		"kbd 0 0 4 1",
		"module 16 on",
		"input 9 1",
		"raw 0 up 1",
		"a b c d e f g h i j k l m n o p",
		"exit now",
	};

	(void)state;
	begin();
	untouched = rig;
	for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
		bool good = run(bad[i]);

		if (!strcmp(bad[i], "fault") || !strncmp(bad[i], "help", 4))
			continue;
		if (good)
			fail_msg("'%s' was taken", bad[i]);
		assert_int_equal(strncmp(reply, "error: ", 7), 0);
		assert_true(strlen(reply) > 12);
		assert_memory_equal(&rig, &untouched, sizeof(rig));
		assert_false(control.exit);
	}
}

static void empty_lines_and_comments_do_nothing(void **state)
{
	(void)state;
	begin();
	untouched = rig;
	must("");
	must("   \t ");
	must("# pin 1 0");
	assert_memory_equal(&rig, &untouched, sizeof(rig));
}

static void help_names_every_command_of_the_manual(void **state)
{
	(void)state;
	begin();
	must("help");
	assert_non_null(strstr(reply, "\nstray COUNT - "));
	assert_non_null(strstr(reply, "pin N [0|1] - "));
	assert_non_null(strstr(reply, "\nexit - "));
}

static void statistics_are_keys_and_values(void **state)
{
	uint8_t rq[WIRE_PK] = { WIRE_REQUEST, 0x85, 0x21 };
	char *line, *rest = reply;

	(void)state;
	begin();
	wire_finish(rq, 1);
	sim_rig_send(&rig, now_ns, rq, sizeof(rq));
	must_say("stat", "\npe.21=1\n");
	must_say("stat", "requests=1\n");
	while ((line = strsep(&rest, "\n")) && strcmp(line, "ok") != 0)
		assert_non_null(strchr(line, '='));
}

static void presets_come_back_after_a_reboot(void **state)
{
	(void)state;
	begin();
	must("preset demo");
	assert_int_equal(rig.device.config.engine.axes, 3);
	must("reboot");
	assert_int_equal(rig.device.config.engine.axes, 3);
	assert_true(sim_axis_usable(&rig.device, 2));
	must("reboot lose-config");
	assert_int_equal(rig.device.config.engine.axes, 0);
}

static void a_reboot_lasts_as_long_as_it_is_told(void **state)
{
	const struct sim_device *device = &rig.device;

	(void)state;
	begin();
	must("reboot keep-config 250");
	assert_int_equal(device->run.dead_until_ns - device->run.boot_ns, 250000000);
	must("reboot keep-config");
	assert_int_equal(device->run.dead_until_ns, device->run.boot_ns);
}

static void the_demo_machine_homes(void **state)
{
	uint8_t rq[WIRE_PK] = { WIRE_REQUEST, 0x85, 0x21, 0x07 };

	(void)state;
	begin();
	must("preset demo");
	wire_finish(rq, 1);
	sim_rig_send(&rig, now_ns, rq, sizeof(rq));
	now_ns += 5000 * MS;
	must_say("engine", "state=20\n");
	for (unsigned int i = 0; i < 3; i++)
		assert_int_equal((int32_t)rig.device.encoders.raw[i],
				 rig.device.bench.machine.axis[i].position);
}

static void strays_repeat_the_last_reply(void **state)
{
	uint8_t rq[WIRE_PK] = { WIRE_REQUEST, 0x05 };
	uint8_t rp[WIRE_PK];

	(void)state;
	begin();
	wire_finish(rq, 77);
	sim_rig_send(&rig, now_ns, rq, sizeof(rq));
	assert_int_equal(sim_rig_receive(&rig, now_ns, rp, sizeof(rp)), 64);
	must("stray 3");
	for (int i = 0; i < 3; i++) {
		assert_int_equal(sim_rig_receive(&rig, now_ns, rp, sizeof(rp)), 64);
		assert_int_equal(rp[6], 77);
	}
	assert_int_equal(sim_rig_receive(&rig, now_ns, rp, sizeof(rp)), 0);
	assert_int_equal(rig.device.stats.requests, 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(fields_are_shown_and_changed),
		cmocka_unit_test(commands_move_the_bench),
		cmocka_unit_test(machines_are_built_by_command),
		cmocka_unit_test(heat_goes_from_an_output_to_an_input),
		cmocka_unit_test(a_motor_moves_its_switches),
		cmocka_unit_test(the_link_is_spoilt_by_command),
		cmocka_unit_test(what_was_printed_can_be_read_again),
		cmocka_unit_test(bad_commands_change_nothing),
		cmocka_unit_test(empty_lines_and_comments_do_nothing),
		cmocka_unit_test(help_names_every_command_of_the_manual),
		cmocka_unit_test(statistics_are_keys_and_values),
		cmocka_unit_test(presets_come_back_after_a_reboot),
		cmocka_unit_test(a_reboot_lasts_as_long_as_it_is_told),
		cmocka_unit_test(the_demo_machine_homes),
		cmocka_unit_test(strays_repeat_the_last_reply),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
