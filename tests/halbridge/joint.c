/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Joints through the whole exchange: conversion, and that nothing that is not
 * a usable number ever gets into the command image.
 */
#include "tests/halbridge/rig.h"

static struct rig rig;
static struct value_joint *const joint = &rig.values.joint[2];
static const struct pokeys_axis_command *const axis = &rig.exchange.command.axis[2];

static int setup(void **state)
{
	(void)state;
	rig_init(&rig);
	joint->scale = 200;
	rig_period(&rig);
	return 0;
}

static void commands_become_pulses(void **state)
{
	(void)state;
	joint->enable = true;
	joint->pos_cmd = 12.5;
	joint->vel_cmd = -3;
	rig_period(&rig);
	assert_int_equal(axis->position, 2500);
	assert_true(axis->velocity == -600);
	assert_int_equal(axis->mode, POKEYS_AXIS_POSITION);
	assert_int_equal(axis->enable, 1);
	assert_false(joint->refused);
}

static void positions_are_rounded_to_the_nearest_pulse(void **state)
{
	static const struct {
		double units;
		int32_t pulses;
	} rows[] = {
		{ 0.00249, 0 },   { 0.00251, 1 },  { -0.00249, 0 },
		{ -0.00251, -1 }, { 1.0049, 201 }, { -1.0049, -201 },
	};

	(void)state;
	for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
		joint->pos_cmd = rows[i].units;
		rig_period(&rig);
		assert_int_equal(axis->position, rows[i].pulses);
	}
}

static void feedback_and_command_meet_for_every_pulse(void **state)
{
	(void)state;
	joint->scale = -1066.6666;
	for (int32_t pulses = -100000; pulses < 100000; pulses += 7) {
		rig.daemon.engine.axis[2].position = pulses;
		rig_period(&rig);
		joint->pos_cmd = joint->pos_fb;
		rig_write(&rig);
		assert_int_equal(axis->position, pulses);
	}
}

/*
 * A slow joint for 10^8 periods, with a scale and a speed that no period divides
 * evenly: each position is rounded by itself, so no error adds up. Every 37th period
 * is looked at, and what the pulses should be is worked out in whole numbers: after n
 * periods of a third of 1e-6 units at 1066.6 pulses a unit, n * 10666 / 3e7.
 */
static void a_hundred_million_periods_do_not_drift(void **state)
{
	const struct joint_device device = { &rig.daemon.engine.axis[2], true };
	const int64_t periods = 100000000;
	int64_t worst = 0;

	(void)state;
	joint->scale = 1066.6;
	rig_period(&rig);
	for (int64_t n = 0; n <= periods; n += n + 37 > periods && n < periods ? periods - n : 37) {
		const int64_t exact = (n * 10666 + 15000000) / 30000000;
		int64_t off;

		joint->pos_cmd = (double)n / 3e6;
		joint_write(&rig.exchange.joint[2], joint, 2, &rig.values.set.axis[2], &device,
			    &rig.exchange.command.axis[2], &rig.exchange.refusals);
		off = axis->position - exact;
		worst = llabs(off) > worst ? llabs(off) : worst;
	}
	assert_int_equal(axis->position, 35553); /* 35553.3 */
	assert_true(worst <= 1);                 /* a tie may be rounded either way */
	assert_false(joint->refused);
}

static void a_negative_scale_turns_both_ways(void **state)
{
	(void)state;
	joint->scale = -200;
	joint->pos_cmd = 1;
	joint->vel_cmd = 1;
	rig.daemon.engine.axis[2].position = -400;
	rig_periods(&rig, 2);
	assert_int_equal(axis->position, -200);
	assert_true(axis->velocity == -200);
	assert_true(joint->pos_fb == 2);
}

static void what_does_not_fit_never_reaches_the_image(void **state)
{
	static const double bad[] = {
		NAN, INFINITY, -INFINITY, 1e300, -1e300, 83886.083, -83886.083
	};

	(void)state;
	joint->pos_cmd = 10;
	rig_period(&rig);
	for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
		joint->pos_cmd = bad[i];
		rig_periods(&rig, 2);
		assert_int_equal(axis->position, 2000);
		assert_true(joint->refused);
		assert_true(rig.values.input_refused);
		assert_int_equal(rig.values.input_refused_count, i + 1);
		joint->pos_cmd = 10;
		rig_period(&rig);
		assert_false(joint->refused);
		assert_false(rig.values.input_refused);
	}
	joint->pos_cmd = 83886.08;
	rig_period(&rig);
	assert_int_equal(axis->position, 16777216);
}

static void a_velocity_that_is_no_number_becomes_zero(void **state)
{
	static const double bad[] = { NAN, INFINITY, -INFINITY, 1e300, -50000.1 };

	(void)state;
	for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
		joint->vel_cmd = 5;
		rig_period(&rig);
		assert_true(axis->velocity == 1000);
		joint->vel_cmd = bad[i];
		rig_period(&rig);
		assert_true(axis->velocity == 0);
		assert_true(joint->refused);
	}
}

static void scale_does_not_change_under_an_enabled_joint(void **state)
{
	struct refusal_note note;

	(void)state;
	joint->enable = true;
	joint->pos_cmd = 10;
	rig_period(&rig);
	joint->scale = 400;
	rig_periods(&rig, 5);
	assert_int_equal(axis->position, 2000);
	assert_true(joint->refused);
	assert_true(refusal_take(&rig.exchange.refusals, &note));
	assert_int_equal(note.reason, REFUSAL_ENABLED);
	joint->enable = false;
	rig_period(&rig);
	assert_int_equal(axis->position, 4000);
	assert_false(joint->refused);
}

static void a_useless_scale_leaves_the_last_one(void **state)
{
	static const double useless[] = { 0, NAN, INFINITY };

	(void)state;
	joint->pos_cmd = 1;
	rig.daemon.engine.axis[2].position = 400;
	for (size_t i = 0; i < sizeof(useless) / sizeof(useless[0]); i++) {
		joint->scale = useless[i];
		rig_periods(&rig, 2);
		assert_int_equal(axis->position, 200);
		assert_true(joint->pos_fb == 2);
		assert_true(joint->refused);
	}
}

static void the_first_feedback_is_in_the_right_units(void **state)
{
	(void)state;
	rig_init(&rig);
	joint->scale = 200;
	rig.daemon.engine.axis[2].position = 400;
	rig.now_ns += RIG_MS;
	rig_daemon(&rig);
	rig_read(&rig);
	assert_true(joint->pos_fb == 2);
}

static void in_position_means_the_newest_command(void **state)
{
	(void)state;
	joint->pos_cmd = 1;
	rig_period(&rig);
	rig.daemon.engine.axis[2].in_position = 1;
	rig.daemon.engine.axis[2].reference = 200;
	rig_period(&rig);
	assert_true(joint->in_position);
	joint->pos_cmd = 2;
	rig_period(&rig);
	rig_read(&rig);
	assert_false(joint->in_position);
}

static void status_of_the_axis_reaches_its_pins(void **state)
{
	struct pokeys_axis *from = &rig.daemon.engine.axis[2];

	(void)state;
	from->state = 30;
	from->error = 1;
	rig_period(&rig);
	assert_int_equal(joint->state, 30);
	assert_true(joint->error && !joint->limit_neg && !joint->limit_pos && !joint->home_switch);
	from->error = 0;
	from->limit_minus = 1;
	from->homed = 1;
	rig_period(&rig);
	assert_true(!joint->error && joint->limit_neg && !joint->limit_pos && joint->homed);
	from->limit_minus = 0;
	from->limit_plus = 1;
	from->enabled = 1;
	rig_period(&rig);
	assert_true(!joint->limit_neg && joint->limit_pos && joint->enabled);
	from->home = 1;
	from->soft_limit = 1;
	rig_period(&rig);
	assert_true(joint->home_switch && joint->soft_limit);
	assert_int_equal(rig.values.joint[1].state, 0);
}

static void the_mode_is_the_parameters_else_the_devices(void **state)
{
	(void)state;
	rig.daemon.engine.axis[2].mode = POKEYS_AXIS_OFF;
	rig_period(&rig);
	assert_int_equal(axis->mode, POKEYS_AXIS_POSITION); /* nothing is known */
	rig.daemon.engine.axis[2].mode = POKEYS_AXIS_BUFFERED;
	rig_period(&rig);
	assert_int_equal(axis->mode, POKEYS_AXIS_BUFFERED);
	rig.values.set.axis[2].mode = POKEYS_AXIS_VELOCITY; /* wished, and not there yet */
	rig_period(&rig);
	assert_int_equal(axis->mode, POKEYS_AXIS_VELOCITY);
	rig.values.set.axis[2].mode = 4;
	rig_period(&rig);
	assert_int_equal(axis->mode, POKEYS_AXIS_BUFFERED);
}

static void buffered_mode_reaches_beyond_the_planner(void **state)
{
	(void)state;
	rig.daemon.engine.axis[2].mode = POKEYS_AXIS_BUFFERED;
	joint->pos_cmd = 10500000;
	rig_period(&rig);
	assert_int_equal(axis->position, 2100000000);
	joint->pos_cmd = 10500000.01;
	rig_period(&rig);
	assert_true(joint->refused);
	assert_int_equal(axis->position, 2100000000);
}

/* The note behind a refusal, as a line for a person under these names. */
static void expect_line(unsigned int schemes, const char *text)
{
	struct refusal_note note = { .offset = 0 };
	char line[256];

	assert_true(joint->refused && rig.values.input_refused);
	while (refusal_take(&rig.exchange.refusals, &note))
		;
	refusal_line(&note, "pokeys.0", schemes, line, sizeof(line));
	assert_string_equal(line, text);
}

static void an_axis_that_the_device_has_not_is_named(void **state)
{
	(void)state;
	rig.daemon.engine.axis[2].mode = POKEYS_AXIS_OFF;
	joint->enable = true;
	rig_period(&rig);
	expect_line(TABLE_CANONICAL, "pokeys.0.joint.02.pos-cmd = 0: the device has no such axis, "
				     "or it is not set up (axes, axis.N.mode)");
	rig.daemon.engine.axis[2].mode = POKEYS_AXIS_POSITION;
	rig_period(&rig);
	assert_false(joint->refused);
	rig.daemon.engine.axis[2].mode = POKEYS_AXIS_OFF;
	rig_period(&rig);
	assert_true(joint->refused);
	joint->enable = false;
	rig_period(&rig);
	assert_false(joint->refused);
}

static void the_older_name_is_told_where_there_is_no_other(void **state)
{
	(void)state;
	rig.daemon.engine.axis[2].mode = POKEYS_AXIS_OFF;
	joint->enable = true;
	rig_period(&rig);
	expect_line(TABLE_LEGACY, "pokeys.0.PEv2.2.joint-pos-cmd = 0: the device has no such axis, "
				  "or it is not set up (axes, axis.N.mode)");
}

static void a_speed_beyond_the_axis_is_refused_and_it_stands(void **state)
{
	(void)state;
	rig.daemon.engine.axis[2].mode = POKEYS_AXIS_VELOCITY;
	rig.daemon.engine.axis[2].max_speed = 2000;
	joint->enable = true;
	joint->vel_cmd = -10;
	rig_period(&rig);
	assert_true(axis->velocity == -2000 && !joint->refused);
	joint->vel_cmd = -10.1;
	rig_period(&rig);
	assert_true(axis->velocity == 0);
	expect_line(TABLE_CANONICAL, "pokeys.0.joint.02.vel-cmd = -10.1: above the maximum speed "
				     "configured for this axis; the axis stops");
}

static void a_position_beyond_the_soft_limits_is_told(void **state)
{
	(void)state;
	rig.daemon.engine.axis[2].mode = POKEYS_AXIS_POSITION;
	rig.values.set.axis[2].soft_limits = 1;
	rig.values.set.axis[2].soft_min = -5;
	rig.values.set.axis[2].soft_max = 5;
	joint->enable = true;
	joint->pos_cmd = 5;
	rig_period(&rig);
	assert_false(joint->refused);
	joint->pos_cmd = 5.01;
	rig_period(&rig);
	expect_line(TABLE_CANONICAL, "pokeys.0.joint.02.pos-cmd = 5.01: beyond the soft limits; "
				     "the last good value stays in use");
	/* outside already: the way back is free */
	rig.daemon.engine.axis[2].position = 1200;
	rig_period(&rig);
	assert_false(joint->refused);
	joint->pos_cmd = -5.01;
	rig_period(&rig);
	assert_true(joint->refused);
	rig.values.set.axis[2].soft_limits = 0;
	rig_period(&rig);
	assert_false(joint->refused);
}

static void following_error_is_in_units(void **state)
{
	(void)state;
	rig.daemon.engine.axis[2].following_error = -30;
	rig_period(&rig);
	assert_true(joint->following_error == -0.15);
}

static double shown_in(enum pokeys_axis_mode mode, int32_t motion_type)
{
	rig.daemon.engine.axis[2].mode = (uint8_t)mode;
	rig.values.motion_type = motion_type;
	rig_periods(&rig, 2);
	return joint->pos_fb;
}

enum { JOGS = 0, LINE = 2, PROBES = 5 };

/* The joint is enabled, and commanded to 10 units. */
static struct pokeys_axis *begin_buffered(int32_t position, int32_t delayed)
{
	struct pokeys_axis *there = &rig.daemon.engine.axis[2];

	joint->enable = true;
	joint->pos_cmd = 10;
	there->enabled = 1;
	there->mode = POKEYS_AXIS_BUFFERED;
	there->position = position;
	there->delayed = delayed;
	return there;
}

/* A constant delay is not a following error along a path. A probe needs the real position. */
static void delay_of_the_buffer_is_left_out_of_a_path(void **state)
{
	struct pokeys_axis *there = begin_buffered(1900, 80);

	(void)state;
	assert_true(shown_in(POKEYS_AXIS_BUFFERED, JOGS) == 9.5);
	assert_true(shown_in(POKEYS_AXIS_POSITION, LINE) == 9.5);
	assert_true(shown_in(POKEYS_AXIS_BUFFERED, LINE) == 9.9);
	/* a command that the daemon has not accepted changes nothing */
	joint->pos_cmd = 110;
	assert_true(shown_in(POKEYS_AXIS_BUFFERED, LINE) == 9.9);
	assert_true(shown_in(POKEYS_AXIS_BUFFERED, PROBES) == 9.5);
	assert_true(shown_in(POKEYS_AXIS_BUFFERED, LINE) == 9.9);
	there->enabled = 0;
	assert_true(shown_in(POKEYS_AXIS_BUFFERED, LINE) == 9.5);
	there->enabled = 1;
	assert_true(shown_in(POKEYS_AXIS_BUFFERED, LINE) == 9.9);
	/* when disabled, LinuxCNC copies the feedback into its command; the two must not drift */
	joint->enable = false;
	there->position = 1910;
	assert_true(shown_in(POKEYS_AXIS_BUFFERED, LINE) == 9.55);
}

static void delay_is_left_out_until_the_end_of_the_path(void **state)
{
	struct pokeys_axis *there = begin_buffered(1900, 100);

	(void)state;
	assert_true(shown_in(POKEYS_AXIS_BUFFERED, LINE) == 10);
	/* the last command of the path comes in the period that ends it */
	joint->pos_cmd = 10.01;
	rig.values.motion_type = JOGS;
	rig_write(&rig);
	assert_true(shown_in(POKEYS_AXIS_BUFFERED, JOGS) == 10);
	there->position = 1950;
	there->delayed = 52;
	assert_true(shown_in(POKEYS_AXIS_BUFFERED, JOGS) == 10.01);
	/* homing or a jog begins before the joint has arrived: the reported position from now on */
	joint->pos_cmd = 10.02;
	assert_true(shown_in(POKEYS_AXIS_BUFFERED, JOGS) == 9.75);
	assert_true(shown_in(POKEYS_AXIS_BUFFERED, JOGS) == 9.75);
	/* and no delay is left out again when it has arrived */
	assert_true(shown_in(POKEYS_AXIS_BUFFERED, LINE) == 10.01);
	there->delayed = 0;
	assert_true(shown_in(POKEYS_AXIS_BUFFERED, JOGS) == 9.75);
	there->delayed = 20;
	assert_true(shown_in(POKEYS_AXIS_BUFFERED, JOGS) == 9.75);
}

/* The check of the soft limit uses the reported position. */
static void soft_limit_is_told_by_where_the_joint_is(void **state)
{
	(void)state;
	begin_buffered(990, 100);
	rig.values.set.axis[2].soft_limits = 1;
	rig.values.set.axis[2].soft_max = 5;
	rig.values.motion_type = LINE;
	joint->pos_cmd = 5.2;
	rig_periods(&rig, 4);
	assert_true(joint->refused);
}

static void machine_on_is_a_flag_of_the_command(void **state)
{
	(void)state;
	assert_int_equal(rig.exchange.command.flags, 0);
	rig.values.machine_is_on = true;
	rig_period(&rig);
	assert_int_equal(rig.exchange.command.flags, POKEYS_COMMAND_MACHINE_ON);
	rig.daemon.flags |= POKEYS_STATE_NEEDS_EDGE;
	rig_period(&rig);
	assert_true(rig.values.needs_edge && !rig.values.machine_on_permitted);
	rig.daemon.flags ^= POKEYS_STATE_NEEDS_EDGE | POKEYS_STATE_MACHINE_ON;
	rig_period(&rig);
	assert_true(!rig.values.needs_edge && rig.values.machine_on_permitted);
	rig.device_silent = true;
	rig_periods(&rig, 7);
	assert_false(rig.values.machine_on_permitted);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(commands_become_pulses, setup),
		cmocka_unit_test_setup(positions_are_rounded_to_the_nearest_pulse, setup),
		cmocka_unit_test_setup(feedback_and_command_meet_for_every_pulse, setup),
		cmocka_unit_test_setup(a_hundred_million_periods_do_not_drift, setup),
		cmocka_unit_test_setup(a_negative_scale_turns_both_ways, setup),
		cmocka_unit_test_setup(what_does_not_fit_never_reaches_the_image, setup),
		cmocka_unit_test_setup(a_velocity_that_is_no_number_becomes_zero, setup),
		cmocka_unit_test_setup(scale_does_not_change_under_an_enabled_joint, setup),
		cmocka_unit_test_setup(a_useless_scale_leaves_the_last_one, setup),
		cmocka_unit_test_setup(the_first_feedback_is_in_the_right_units, setup),
		cmocka_unit_test_setup(in_position_means_the_newest_command, setup),
		cmocka_unit_test_setup(status_of_the_axis_reaches_its_pins, setup),
		cmocka_unit_test_setup(the_mode_is_the_parameters_else_the_devices, setup),
		cmocka_unit_test_setup(buffered_mode_reaches_beyond_the_planner, setup),
		cmocka_unit_test_setup(an_axis_that_the_device_has_not_is_named, setup),
		cmocka_unit_test_setup(the_older_name_is_told_where_there_is_no_other, setup),
		cmocka_unit_test_setup(a_speed_beyond_the_axis_is_refused_and_it_stands, setup),
		cmocka_unit_test_setup(a_position_beyond_the_soft_limits_is_told, setup),
		cmocka_unit_test_setup(following_error_is_in_units, setup),
		cmocka_unit_test_setup(delay_of_the_buffer_is_left_out_of_a_path, setup),
		cmocka_unit_test_setup(delay_is_left_out_until_the_end_of_the_path, setup),
		cmocka_unit_test_setup(soft_limit_is_told_by_where_the_joint_is, setup),
		cmocka_unit_test_setup(machine_on_is_a_flag_of_the_command, setup),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
