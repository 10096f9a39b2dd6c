/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Probing by pins: what is asked of the daemon, what becomes of it, and the
 * contact that LinuxCNC's own probing wants.
 */
#include "tests/halbridge/rig.h"

static struct rig rig;
static struct values *const values = &rig.values;
static struct value_probe *const probe = &rig.values.probe;
static struct pokeys_command *const command = &rig.exchange.command;

static int setup(void **state)
{
	(void)state;
	rig_init(&rig);
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		values->joint[i].scale = 200;
	probe->terminal = 3;
	rig_periods(&rig, 2);
	return 0;
}

static void press(bool *pin)
{
	*pin = true;
	rig_period(&rig);
	*pin = false;
	rig_period(&rig);
}

static void the_device_moves_and_latches(void **state)
{
	const struct pokeys_one_shot *shot = &command->one_shot[0];

	(void)state;
	probe->axes = 0x06;
	probe->speed = 0.25;
	probe->time_limit = 20;
	probe->active_high = true;
	values->joint[1].probe_target = 7.5;
	values->joint[2].probe_target = -40;
	values->joint[3].probe_target = 11;
	rig_period(&rig);
	press(&probe->start);
	assert_int_equal(command->one_shot_head, 1);
	assert_int_equal(shot->operation, POKEYS_ONE_SHOT_PROBE);
	assert_int_equal(shot->mask, 0x06);
	assert_int_equal(shot->index, 3 + 8);
	assert_int_equal(shot->flags, POKEYS_PROBE_ACTIVE_HIGH);
	assert_int_equal(shot->value[1], 1500);
	assert_int_equal(shot->value[2], -8000);
	assert_int_equal(shot->value[3], 0);
	assert_true(shot->parameter[0] == 20 && shot->parameter[1] == 0.25f);
	assert_true(probe->active && !probe->done);
	rig.daemon.engine.axis[2].probe = -3000;
	rig_end(&rig, 0, POKEYS_OUTCOME_DONE, POKEYS_TASK_DONE);
	assert_true(probe->done && !probe->active);
	assert_int_equal(probe->error, 0);
	assert_true(values->joint[2].probe_pos == -15);
}

static void hybrid_names_no_axes(void **state)
{
	(void)state;
	probe->hybrid = true;
	probe->terminal = 0;
	probe->engine_input = 5;
	probe->axes = 0x06;
	values->joint[1].probe_target = NAN;
	press(&probe->start);
	assert_int_equal(command->one_shot_head, 1);
	assert_int_equal(command->one_shot[0].flags, POKEYS_PROBE_HYBRID);
	assert_int_equal(command->one_shot[0].mask, 0);
	assert_int_equal(command->one_shot[0].index, 5);
	press(&probe->cancel);
	assert_int_equal(command->one_shot[1].operation, POKEYS_ONE_SHOT_PROBE_FINISH);
}

static void it_is_cancelled_while_data_are_stale(void **state)
{
	(void)state;
	probe->axes = 1;
	press(&probe->start);
	rig.device_silent = true;
	rig_periods(&rig, 20);
	assert_false(values->connected);
	press(&probe->cancel);
	assert_int_equal(command->one_shot_head, 2);
	assert_int_equal(command->one_shot[1].operation, POKEYS_ONE_SHOT_PROBE_FINISH);
	assert_int_equal(values->one_shot_failed_count, 0);
}

static void touching_nothing_is_an_error_of_its_own(void **state)
{
	(void)state;
	probe->axes = 1;
	press(&probe->start);
	rig_end(&rig, 0, POKEYS_OUTCOME_FAILED, POKEYS_TASK_NOT_FOUND);
	assert_int_equal(probe->error, POKEYS_TASK_NOT_FOUND);
	assert_false(probe->done);
	press(&probe->start);
	assert_int_equal(probe->error, 0);
	rig_end(&rig, 1, POKEYS_OUTCOME_REFUSED, POKEYS_TASK_RESULT_NONE);
	assert_int_equal(probe->error, 8);
}

static void contact_follows_the_terminal(void **state)
{
	(void)state;
	assert_true(probe->contact); /* active low, and the input is low */
	rig.daemon.digital_in[0] |= 1u << 2;
	rig_period(&rig);
	assert_false(probe->contact);
	probe->active_high = true;
	rig_period(&rig);
	assert_true(probe->contact);
	rig.daemon.digital_in[0] = 0xfb;
	rig_period(&rig);
	assert_false(probe->contact);
}

static void contact_follows_the_engines_input(void **state)
{
	(void)state;
	probe->terminal = 0;
	probe->engine_input = 6;
	probe->active_high = true;
	rig_period(&rig);
	assert_false(probe->contact);
	rig.daemon.engine.misc_inputs = 1u << 5;
	rig_period(&rig);
	assert_true(probe->contact);
	probe->engine_input = 0;
	probe->active_high = false;
	rig_period(&rig);
	assert_false(probe->contact); /* there is none: never a contact, whatever it is called */
}

/* The touch was shorter than a period: what the device has latched is one. */
static void a_latched_contact_is_one(void **state)
{
	static const uint8_t states[] = { 30, 40, 41 };

	(void)state;
	probe->active_high = true;
	for (size_t i = 0; i < sizeof(states); i++) {
		rig.daemon.engine.state = states[i];
		rig_period(&rig);
		assert_true(probe->contact);
		rig.daemon.engine.state = 0;
		rig_period(&rig);
		assert_false(probe->contact);
	}
}

static void expect_refused(size_t offset)
{
	const uint32_t head = command->one_shot_head;
	struct refusal_note note = { .offset = 0 };

	rig_period(&rig);
	press(&probe->start);
	assert_int_equal(command->one_shot_head, head);
	assert_int_equal(probe->error, 8);
	assert_true(values->input_refused);
	while (refusal_take(&rig.exchange.refusals, &note))
		;
	assert_int_equal(note.offset, offset);
}

static void bad_values_are_refused_and_named(void **state)
{
	(void)state;
	probe->axes = 1;
	probe->speed = 0;
	expect_refused(offsetof(struct values, probe.speed));
	probe->speed = NAN;
	expect_refused(offsetof(struct values, probe.speed));
	probe->speed = 1;
	rig_period(&rig);
	probe->time_limit = -1;
	expect_refused(offsetof(struct values, probe.time_limit));
	probe->time_limit = 0;
	probe->terminal = 56;
	expect_refused(offsetof(struct values, probe.terminal));
	probe->terminal = 55;
	probe->engine_input = 9;
	expect_refused(offsetof(struct values, probe.engine_input));
	probe->engine_input = 0;
	values->joint[0].probe_target = INFINITY;
	expect_refused(offsetof(struct values, joint[0].probe_target));
	assert_true(values->joint[0].refused);
	values->joint[0].probe_target = 0;
	rig_period(&rig);
	press(&probe->start);
	assert_int_equal(command->one_shot_head, 1);
	assert_false(values->input_refused);
}

static void nobody_there_is_a_refusal(void **state)
{
	(void)state;
	rig.device_silent = true;
	rig_periods(&rig, 10);
	press(&probe->start);
	rig.device_silent = false;
	rig_periods(&rig, 10);
	assert_int_equal(command->one_shot_head, 0);
	assert_int_equal(probe->error, 8);
}

static void another_daemon_knows_nothing_of_it(void **state)
{
	(void)state;
	press(&probe->start);
	rig.daemon.epoch++;
	rig_periods(&rig, 3);
	assert_int_equal(probe->error, 9);
	assert_false(probe->active);
	assert_int_equal(values->one_shot_failed_count, 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(the_device_moves_and_latches, setup),
		cmocka_unit_test_setup(hybrid_names_no_axes, setup),
		cmocka_unit_test_setup(it_is_cancelled_while_data_are_stale, setup),
		cmocka_unit_test_setup(touching_nothing_is_an_error_of_its_own, setup),
		cmocka_unit_test_setup(contact_follows_the_terminal, setup),
		cmocka_unit_test_setup(contact_follows_the_engines_input, setup),
		cmocka_unit_test_setup(a_latched_contact_is_one, setup),
		cmocka_unit_test_setup(bad_values_are_refused_and_named, setup),
		cmocka_unit_test_setup(nobody_there_is_a_refusal, setup),
		cmocka_unit_test_setup(another_daemon_knows_nothing_of_it, setup),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
