/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Heaters and whoever else has to do with the device: the next commander, one that changes the
 * device under them or commands their outputs, and the device's own failsafe.
 */

#include <math.h>
#include <string.h>
#include "tests/device/heat_rig.h"
#include "wire/io.h"
#include "wire/system.h"

static void another_commander_has_to_switch_them_off_first(void **state)
{
	(void)state;
	/* the one before has commanded off, and is gone for long */
	world.commanding = false;
	heat_run(2 * SECOND);
	world_commander(&world, 6);
	heat_command(HOTEND, 100);
	heat_expect_off(0);
	assert_int_equal(heat_shown(HOTEND)->refused, POKEYS_HEATER_AFTER_FAULT);
	/* one that knows nothing of heaters has not commanded off */
	world_commander(&world, 7);
	heat_run(1 * SECOND);
	heat_command(HOTEND, 100);
	heat_expect_off(0);
	heat_command(HOTEND, 0);
	heat_run(200 * MS);
	heat_command(HOTEND, 100);
	heat_run(500 * MS);
	assert_true(heat_power(HOTEND) > 0);
	/* the next one comes at once, and commands the same */
	world_commander(&world, 8);
	heat_command(HOTEND, 100);
	heat_expect_off(5 * MS);
}

static void wish_of(void (*change)(struct pokeys_settings *settings))
{
	struct pokeys_wish wish = { .session = 5, .generation = 9 };

	heat_begin(NULL);
	heat_up();
	change(&wish.settings);
	device_wish(world.device, &wish);
}

static void invert_the_output(struct pokeys_settings *settings)
{
	settings->pin_set[BED_PIN / 8] = 1u << BED_PIN % 8;
	settings->pin_function[BED_PIN] = WIRE_PIN_OUTPUT | WIRE_PIN_INVERT;
}

static void give_it_to_an_axis(struct pokeys_settings *settings)
{
	settings->set = POKEYS_SET_SYNC_OUTPUTS;
	settings->sync_out_enable = 1;
	settings->sync_out_pin[0] = BED_PIN + 1;
}

static void freeze_the_sensors(struct pokeys_settings *settings)
{
	settings->set = POKEYS_SET_ANALOG_FILTER;
	settings->analog_filter = 100000;
}

static void keep_it_on(struct pokeys_settings *settings)
{
	settings->set = POKEYS_SET_FAILSAFE;
	settings->failsafe_timeout = 10;
	settings->failsafe_peripherals = 15;
	settings->failsafe_outputs[BED_PIN / 8] = 1u << BED_PIN % 8;
}

static void a_commander_that_changes_the_device_under_them_switches_them_off(void **state)
{
	void (*const changes[])(struct pokeys_settings *settings) = {
		invert_the_output,
		give_it_to_an_axis,
		freeze_the_sensors,
		keep_it_on,
	};
	static const enum pokeys_obstacle obstacles[] = {
		POKEYS_OBSTACLE_OUTPUT,
		POKEYS_OBSTACLE_SHARED,
		POKEYS_OBSTACLE_FILTER,
		POKEYS_OBSTACLE_FAILSAFE,
	};

	(void)state;
	for (size_t i = 0; i < sizeof(changes) / sizeof(changes[0]); i++) {
		wish_of(changes[i]);
		heat_run(3 * SECOND);
		heat_expect_fault(BED, POKEYS_HEATER_DEVICE);
		assert_int_equal(heat_shown(BED)->obstacle, obstacles[i]);
	}
}

static void shorten_the_period(struct pokeys_settings *settings)
{
	settings->set = POKEYS_SET_PWM_PERIOD;
	settings->pwm_period = PERIOD / 10;
}

static void another_period_is_no_other_power(void **state)
{
	(void)state;
	wish_of(shorten_the_period);
	for (unsigned int i = 0; i < 3000; i++) {
		heat_cycle();
		assert_true(heat_power(HOTEND) < 0.6);
	}
	assert_int_equal(world.rig.device.config.pwm.period, PERIOD / 10);
	assert_int_equal(heat_shown(HOTEND)->state, POKEYS_HEATER_HEATING);
	assert_true(fabs(heat[HOTEND].sensor - 150) < 3);
}

/* What the device would do with the output if nobody talked to it. */
static void try_failsafe(void (*change)(struct device_config *config), bool ready)
{
	heat_prepare(NULL);
	change(&world.config);
	heat_start();
	heat_command(HOTEND, 100);
	heat_command(BED, 60);
	heat_run(500 * MS);
	assert_int_equal(heat_power(HOTEND) > 0, ready);
	assert_int_equal(heat_power(BED) > 0, ready);
	if (ready)
		return;
	assert_int_equal(heat_shown(HOTEND)->refused, POKEYS_HEATER_NOT_READY);
	assert_int_equal(heat_shown(HOTEND)->condition, POKEYS_HEATER_DEVICE);
	assert_int_equal(heat_shown(HOTEND)->obstacle, POKEYS_OBSTACLE_FAILSAFE);
}

static void change_nothing(struct device_config *config)
{
	(void)config;
}

static void switch_it_off(struct device_config *config)
{
	config->settings.failsafe_timeout = 0;
}

static void leave_outputs_out(struct device_config *config)
{
	config->settings.failsafe_peripherals = WIRE_FAILSAFE_POEXTBUS | WIRE_FAILSAFE_PULSE;
}

static void have_them_on(struct device_config *config)
{
	config->settings.failsafe_pwm[HOTEND_PWM] = 1;
	config->settings.failsafe_outputs[BED_PIN / 8] = 1u << BED_PIN % 8;
}

static void have_another_one_on(struct device_config *config)
{
	config->settings.failsafe_pwm[FAN_PWM] = 100;
	config->settings.failsafe_outputs[LAMP / 8] = 1u << LAMP % 8;
}

static void do_without(struct device_config *config)
{
	switch_it_off(config);
	config->heater[HOTEND].without_failsafe = config->heater[BED].without_failsafe = true;
}

static void no_output_is_used_that_the_device_would_leave_on(void **state)
{
	(void)state;
	try_failsafe(change_nothing, true);
	try_failsafe(switch_it_off, false);
	try_failsafe(leave_outputs_out, false);
	try_failsafe(have_them_on, false);
	try_failsafe(have_another_one_on, true);
	try_failsafe(do_without, true);
}

static unsigned int duties;

/* One duty arrives and its answer does not; nothing arrives after it. */
static void swallow_after_one(struct world *w, const uint8_t *packet)
{
	if (packet[1] == 0xCB)
		w->swallow = duties++ > 0;
}

static bool lose_duty(struct world *w, const uint8_t *packet)
{
	(void)w;
	return packet[1] == 0xCB;
}

static void an_off_is_followed_while_a_power_is_under_way(void **state)
{
	(void)state;
	heat_run(1 * SECOND);
	duties = 0;
	world.watch = swallow_after_one;
	world.lose_reply = lose_duty;
	heat_command(HOTEND, 150);
	while (!duties)
		heat_cycle();
	heat_run(2 * MS); /* with the next period */
	assert_true(heat_power(HOTEND) > 0);
	heat_command(HOTEND, 0);
	heat_run(100 * MS);
	assert_int_equal(heat_shown(HOTEND)->state, POKEYS_HEATER_STOPPING);
	heat_run(2 * SECOND);
	assert_int_equal(world.event_count[EVENT_HEATER_UNHEARD], 1);
	assert_true(heat_power(HOTEND) <= 0);
}

static void swallow_outputs(struct world *w, const uint8_t *packet)
{
	w->swallow = packet[1] == 0xCC;
}

/* What it acknowledged may have been another device. */
static void an_answer_from_before_a_gap_is_no_acknowledgement(void **state)
{
	const struct sim_link_faults slow = { .delay = { .low_ns = 9 * MS } }, none = { 0 };

	(void)state;
	heat_command(BED, 60);
	heat_run(1 * SECOND);
	while (heat_power(BED) <= 0)
		heat_cycle();
	sim_link_set_faults(&world.rig.link, 1, &slow);
	heat_command(BED, 0);
	heat_run(8 * MS);
	assert_true(heat_power(BED) <= 0);
	world.watch = swallow_outputs;
	for (unsigned int i = 0; i < 40; i++) {
		heat_cycle();
		assert_int_equal(heat_shown(BED)->state, POKEYS_HEATER_STOPPING);
	}
	world.watch = NULL;
	sim_link_set_faults(&world.rig.link, 1, &none);
	heat_run(200 * MS);
	assert_int_equal(heat_shown(BED)->state, POKEYS_HEATER_OFF);
	assert_int_equal(world.event_count[EVENT_HEATER_UNHEARD], 0);
}

/* Off for a cycle, and then a target that it does not heat for. */
static void one_that_waits_to_cool_is_no_loss(void **state)
{
	(void)state;
	heat_up();
	heat_command(HOTEND, 0);
	heat_cycle();
	heat_command(HOTEND, 100);
	heat_run(2 * SECOND);
	assert_int_equal(heat_shown(HOTEND)->state, POKEYS_HEATER_HEATING);
	assert_int_equal(world.event_count[EVENT_HEATER_UNHEARD], 0);
	assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
}

static bool lose_all(struct world *w, const uint8_t *packet)
{
	(void)w;
	(void)packet;
	return true;
}

/* The power of the other heater may be meant for another device. */
static void an_off_of_a_pin_takes_no_pwm_along_in_a_doubt(void **state)
{
	uint64_t before;

	(void)state;
	heat_up();
	before = world.sent.operation[0xCB];
	while (world.sent.operation[0xCB] == before)
		heat_cycle();
	before = world.sent.operation[0xCB];
	world.lose_reply = lose_all;
	heat_run(20 * MS);
	heat_command(BED, 0);
	heat_run(60 * MS);
	assert_int_equal(heat_shown(HOTEND)->state, POKEYS_HEATER_HEATING);
	assert_int_equal(heat_shown(BED)->state, POKEYS_HEATER_STOPPING);
	assert_true(heat_power(BED) <= 0);
	assert_int_equal(world.sent.operation[0xCB], before);
}

/* The last off may be lost: until it is acknowledged, nothing is safe. */
static void the_daemon_does_not_end_while_a_power_is_under_way(void **state)
{
	const struct sim_link_faults slow = { .delay = { .low_ns = 20 * MS } };

	(void)state;
	sim_link_set_faults(&world.rig.link, 1, &slow);
	heat_command(BED, 60);
	while (heat_power(BED) <= 0)
		heat_cycle();
	world.watch = swallow_outputs;
	device_stop(world.device, world.now);
	heat_run(10 * MS);
	assert_true(heat_power(BED) > 0);
	assert_false(device_stopped(world.device));
	world.watch = NULL;
	heat_run(390 * MS);
	assert_true(device_stopped(world.device));
	assert_true(heat_power(BED) <= 0);
}

static void nobody_else_commands_their_outputs(void **state)
{
	(void)state;
	world_output(&world, BED_PIN, true);
	world_output(&world, LAMP, true);
	world.command.pwm_enable = 1u << HOTEND_PWM | 1u << FAN_PWM;
	world.command.pwm_duty[HOTEND_PWM] = PERIOD;
	world.command.pwm_duty[FAN_PWM] = PERIOD / 2;
	heat_expect_off(0);
	assert_true(world_latch(&world, LAMP));
	assert_int_equal(world.rig.device.config.pwm.duty[FAN_PWM], PERIOD / 2);
	assert_int_equal(world.last_event[EVENT_BAD_COMMAND].a, COMMAND_FAULT_PWM_LOOP);
	assert_int_equal(world.last_event[EVENT_BAD_COMMAND].b, HOTEND_PWM);
	assert_int_equal(world.state.digital_out_owned[BED_PIN / 8] >> BED_PIN % 8 & 1, 0);
	assert_int_equal(world.state.digital_out_owned[LAMP / 8] >> LAMP % 8 & 1, 1);
	/* nor does the loss of machine-on hold them off */
	world.command.pwm_enable = 1u << FAN_PWM;
	heat_command(HOTEND, 100);
	heat_run(500 * MS);
	assert_true(heat_power(HOTEND) > 0);
	assert_int_equal(world.rig.device.config.pwm.duty[FAN_PWM], PERIOD / 2);
}

/* PWM at its terminal would switch a heater on that its loop has switched off. */
static void nobody_commands_pwm_at_a_heaters_terminal(void **state)
{
	enum { CHANNEL = 3, TERMINAL = 21 - CHANNEL };

	(void)state;
	heat_prepare(state);
	world.config.heater[BED].output = TERMINAL;
	world_pin(&world, TERMINAL, WIRE_PIN_OUTPUT);
	heat_start();
	world.command.pwm_enable = 1u << CHANNEL | 1u << FAN_PWM;
	world.command.pwm_duty[CHANNEL] = PERIOD;
	world.command.pwm_duty[FAN_PWM] = PERIOD / 2;
	heat_run(200 * MS);
	assert_int_equal(world.rig.device.config.pwm.enabled >> CHANNEL & 1, 0);
	assert_int_equal(world.rig.device.config.pwm.duty[FAN_PWM], PERIOD / 2);
	assert_int_equal(world.last_event[EVENT_BAD_COMMAND].a, COMMAND_FAULT_PWM_LOOP);
	assert_int_equal(world.last_event[EVENT_BAD_COMMAND].b, CHANNEL);
}

/* ... nor does one stay on that the device had on before. */
static void pwm_at_a_heaters_terminal_is_switched_off(void **state)
{
	enum { CHANNEL = 3, TERMINAL = 21 - CHANNEL, OTHER_PIN = 13 };

	for (int with_pwm = 0; with_pwm < 2; with_pwm++) {
		struct sim_pwm_config *pwm = &world.rig.device.config.pwm;

		heat_prepare(state);
		world.config.heater[BED].output = TERMINAL;
		world_pin(&world, TERMINAL, WIRE_PIN_OUTPUT);
		if (!with_pwm) {
			world.config.heater[HOTEND].kind = HEATING_PIN;
			world.config.heater[HOTEND].output = OTHER_PIN;
			world_pin(&world, OTHER_PIN, WIRE_PIN_OUTPUT);
		}
		pwm->period = PERIOD;
		pwm->enabled = 1u << CHANNEL | 1u << FAN_PWM;
		pwm->duty[CHANNEL] = PERIOD;
		world.config.resume_parts = DEVICE_RESUME_PWM; /* no safe state switches it off */
		heat_start();
		heat_run(200 * MS);
		assert_int_equal(pwm->enabled, 1u << FAN_PWM | (with_pwm ? 1u << HOTEND_PWM : 0));
	}
}

static void channels_that_nobody_commands_stay_as_they_are(void **state)
{
	(void)state;
	heat_prepare(state);
	world.rig.device.config.pwm.enabled = 1u << FAN_PWM;
	world.rig.device.config.pwm.period = PERIOD;
	world.rig.device.config.pwm.duty[FAN_PWM] = 777;
	world.config.resume_auto = false;
	world.config.resume_parts = DEVICE_RESUME_PWM;
	heat_start();
	heat_command(HOTEND, 100);
	heat_run(2 * SECOND);
	assert_true(heat_power(HOTEND) > 0);
	assert_int_equal(world.rig.device.config.pwm.duty[FAN_PWM], 777);
	assert_true(world.rig.device.config.pwm.enabled >> FAN_PWM & 1);
}

static enum pokeys_outcome set_gain(unsigned int heater, unsigned int which, float value)
{
	const struct pokeys_one_shot shot = {
		.operation = POKEYS_ONE_SHOT_HEATER_GAIN,
		.index = (uint8_t)heater,
		.mask = (uint8_t)which,
		.parameter = { value },
	};

	return world_do(&world, &shot, 1 * SECOND);
}

static void gains_change_while_it_heats(void **state)
{
	const float bad[] = { NAN, INFINITY, -1, 1e6f };
	float power;

	(void)state;
	heat_up();
	power = heat_shown(HOTEND)->power;
	assert_int_equal(set_gain(HOTEND, POKEYS_GAIN_P, 30), POKEYS_OUTCOME_DONE);
	assert_true(heat_shown(HOTEND)->p == 30);
	heat_run(200 * MS);
	assert_true(fabs((double)(heat_shown(HOTEND)->power - power)) < 0.05);
	for (unsigned int i = 0; i < sizeof(bad) / sizeof(bad[0]); i++)
		assert_int_equal(set_gain(HOTEND, POKEYS_GAIN_I, bad[i]), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(set_gain(HOTEND, POKEYS_GAIN_VELOCITY, 1), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(set_gain(HEATERS, POKEYS_GAIN_P, 1), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(world.event_count[EVENT_HEATER_GAIN], 1);
	assert_int_equal(heat_shown(HOTEND)->state, POKEYS_HEATER_HEATING);
	/* a search has gains of its own */
	heat_command(HOTEND, 0);
	heat_run(200 * MS);
	assert_int_equal(heat_tune(HOTEND, 150), POKEYS_OUTCOME_DONE);
	assert_int_equal(set_gain(HOTEND, POKEYS_GAIN_P, 20), POKEYS_OUTCOME_REFUSED);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(another_commander_has_to_switch_them_off_first, heat_begin),
		cmocka_unit_test(a_commander_that_changes_the_device_under_them_switches_them_off),
		cmocka_unit_test(another_period_is_no_other_power),
		cmocka_unit_test(no_output_is_used_that_the_device_would_leave_on),
		cmocka_unit_test_setup(an_off_is_followed_while_a_power_is_under_way, heat_begin),
		cmocka_unit_test_setup(an_answer_from_before_a_gap_is_no_acknowledgement,
				       heat_begin),
		cmocka_unit_test_setup(one_that_waits_to_cool_is_no_loss, heat_begin),
		cmocka_unit_test_setup(an_off_of_a_pin_takes_no_pwm_along_in_a_doubt, heat_begin),
		cmocka_unit_test_setup(the_daemon_does_not_end_while_a_power_is_under_way,
				       heat_begin),
		cmocka_unit_test_setup(gains_change_while_it_heats, heat_begin),
		cmocka_unit_test_setup(nobody_else_commands_their_outputs, heat_begin),
		cmocka_unit_test(nobody_commands_pwm_at_a_heaters_terminal),
		cmocka_unit_test(pwm_at_a_heaters_terminal_is_switched_off),
		cmocka_unit_test(channels_that_nobody_commands_stay_as_they_are),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
