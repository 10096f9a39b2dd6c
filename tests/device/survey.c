/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A device's settings, read without driving it: the same ones that the daemon reads, over a
 * bad network as well, and nothing but reads is sent.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "daemon/device/survey.h"
#include "settings/key.h"
#include "sim/preset.h"
#include "tests/device/world.h"
#include "wire/op.h"
#include "wire/pulse.h"

#define LOSS 0.1	/* each way */

static struct world world;
static struct sim_rig_options options;
static struct survey *survey;
static uint64_t now, sent, writes, silent_from;
static uint32_t from;
static int deaf_to; /* an operation that is not answered, -1 = none */

/* A read is one by wire's table, which the daemon's mailbox goes by. */
static int send_packet(void *context, const uint8_t *packet, size_t length)
{
	const struct wire_op_row *row = wire_op_find(packet[1], packet[2]);

	(void)context;
	assert_non_null(row);
	writes += wire_request_class(row, packet) != WIRE_READ;
	if ((++sent < silent_from || !silent_from) && packet[1] != deaf_to)
		sim_rig_send(&world.rig, now, packet, length);
	return 0;
}

static enum survey_state read_all(void)
{
	const struct pokeys_io io = { .send = send_packet };
	const uint64_t begin = now;
	enum survey_state state;

	survey = aligned_alloc(64, survey_size());
	assert_non_null(survey);
	sent = writes = 0;
	survey_begin(survey, &io, 0x7F000001, 65432, now);
	while ((state = survey_turn(survey, now)) == SURVEY_READING) {
		uint8_t reply[WIRE_PK];
		size_t length;

		assert_true(now - begin < 60 * SECOND);
		now += 2 * MS;
		while ((length = sim_rig_receive(&world.rig, now, reply, sizeof(reply))) > 0)
			survey_deliver(survey, reply, length,
				       &(struct pokeys_rx){ .address = from, .port = 20055 }, now);
	}
	assert_int_equal(writes, 0);
	return state;
}

static int begin(void **state)
{
	(void)state;
	memset(&options, 0, sizeof(options));
	silent_from = 0;
	deaf_to = -1;
	from = 0x7F000001;
	return 0;
}

static int end(void **state)
{
	(void)state;
	free(survey);
	survey = NULL;
	return 0;
}

static void set_up(const char *preset)
{
	struct sim_text why;

	world_init(&world, &options);
	assert_true(sim_preset_apply(&world.rig.device, preset, &why));
	now = world.now;
}

/* Each key in words, from both. */
static void compare(const struct pokeys_settings *daemons)
{
	unsigned int said = 0;

	for (size_t i = 0; i < settings_key_count; i++) {
		const struct settings_key *key = &settings_keys[i];

		/* these are asked of the motor drivers, through the device */
		if (!strcmp(key->name, "axis.#.postep-microsteps") ||
		    !strcmp(key->name, "axis.#.postep-temperature-limit"))
			continue;
		for (uint32_t n = 0; n < (key->count ? key->count : 1); n++) {
			char ours[SETTINGS_VALUE_MAX], theirs[SETTINGS_VALUE_MAX];

			settings_print(key, n, survey_settings(survey), ours);
			settings_print(key, n, daemons, theirs);
			if (strcmp(ours, theirs) != 0)
				fail_msg("%s (%u): \"%s\", and the daemon reads \"%s\"", key->name,
					 n, ours, theirs);
			said += *ours != '\0';
		}
	}
	assert_true(said > 100);
}

static void the_same_as_the_daemon_reads(void **state)
{
	static const char *const presets[] = { "factory", "demo", "printer", "servo-mill" };
	static struct pokeys_report report;

	(void)state;
	for (size_t i = 0; i < sizeof(presets) / sizeof(presets[0]); i++) {
		set_up(presets[i]);
		world_until(&world, world_is_running, 5 * SECOND);
		assert_true(device_report(world.device, &report));
		now = world.now + 1 * SECOND;
		assert_int_equal(read_all(), SURVEY_DONE);
		assert_int_equal(survey_identity(survey)->serial, 65432);
		assert_string_equal(survey_identity(survey)->type, "PoKeys57CNC");
		assert_string_equal(survey_identity(survey)->name, "SimPoKeys57CNC");
		assert_int_equal(survey_capability(survey)->pulse_engine, 2);
		compare(&report.device);
		end(NULL);
	}
}

/* Reads do not change it, and neither stop it. */
static void the_device_is_as_before(void **state)
{
	static struct sim_config before;

	(void)state;
	set_up("demo");
	sim_rig_run(&world.rig, now);
	before = world.rig.device.config;
	world.rig.device.engine.state = WIRE_ENGINE_RUNNING;
	assert_int_equal(read_all(), SURVEY_DONE);
	assert_memory_equal(&before, &world.rig.device.config, sizeof(before));
	assert_int_equal(world.rig.device.engine.state, WIRE_ENGINE_RUNNING);
}

static void lost_packets_cost_time_only(void **state)
{
	const uint64_t seed = world_seed();

	(void)state;
	for (uint64_t i = 0; i < 10; i++) {
		static struct pokeys_settings clean;

		set_up("demo");
		assert_int_equal(read_all(), SURVEY_DONE);
		clean = *survey_settings(survey);
		end(NULL);
		options.seed = seed + i;
		options.link.faults[SIM_LINK_REQUEST].loss = LOSS;
		options.link.faults[SIM_LINK_REPLY].loss = LOSS;
		set_up("demo");
		assert_int_equal(read_all(), SURVEY_DONE);
		compare(&clean);
		end(NULL);
		begin(NULL);
	}
}

static void who_does_not_answer_is_silent(void **state)
{
	uint64_t start;

	(void)state;
	set_up("demo");
	sim_rig_silence(&world.rig, now, 3600 * SECOND);
	start = now;
	assert_int_equal(read_all(), SURVEY_SILENT);
	assert_in_range(now - start, 100 * MS, 10 * SECOND);
}

/* A firmware that does not know a question does not answer it. */
static void what_is_not_answered_is_not_known(void **state)
{
	(void)state;
	set_up("demo");
	deaf_to = wire_op(WIRE_OP_PWM)->id;
	assert_int_equal(read_all(), SURVEY_DONE);
	assert_int_equal(survey_unanswered(survey), 1);
	assert_false(survey_settings(survey)->set & POKEYS_SET_PWM_PERIOD);
	assert_true(survey_settings(survey)->set & POKEYS_SET_AXES);
}

/* Unplugged in the middle: what was read so far is no whole device. */
static void who_falls_silent_is_told(void **state)
{
	(void)state;
	set_up("demo");
	silent_from = 12;
	assert_int_equal(read_all(), SURVEY_SILENT);
	assert_true(survey_unanswered(survey) >= 5);
}

static void another_serial_number_is_told(void **state)
{
	(void)state;
	options.device.serial = 7;
	set_up("demo");
	assert_int_equal(read_all(), SURVEY_OTHER);
}

/* A late answer of somebody else, who was asked the same. */
static void other_addresses_do_not_count(void **state)
{
	(void)state;
	set_up("demo");
	from = 0x7F000002;
	assert_int_equal(read_all(), SURVEY_SILENT);
}

static void a_password_is_said(void **state)
{
	(void)state;
	set_up("demo");
	world.rig.device.options.choices.enforce_security = true;
	memcpy(world.rig.device.config.security.password, "open sesame", 11);
	world.rig.device.config.security.level = 255;
	world.rig.device.run.security_level = 255;
	assert_int_equal(read_all(), SURVEY_LOCKED);
	assert_int_equal(survey_identity(survey)->serial, 65432);
	assert_int_equal(survey_settings(survey)->set, 0);
}

static void an_unknown_type_is_said(void **state)
{
	(void)state;
	options.device.hardware = 10;
	set_up("factory");
	assert_int_equal(read_all(), SURVEY_UNSUPPORTED);
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, begin, end)

int main(void)
{
	const struct CMUnitTest tests[] = {
		TEST(the_same_as_the_daemon_reads),
		TEST(the_device_is_as_before),
		TEST(lost_packets_cost_time_only),
		TEST(who_does_not_answer_is_silent),
		TEST(what_is_not_answered_is_not_known),
		TEST(who_falls_silent_is_told),
		TEST(another_serial_number_is_told),
		TEST(other_addresses_do_not_count),
		TEST(a_password_is_said),
		TEST(an_unknown_type_is_said),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
