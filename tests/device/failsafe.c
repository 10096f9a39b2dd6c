/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The device's own failsafe: set up before the link runs, read back, and there
 * when this daemon is killed without a last word.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/io.h"
#include "wire/system.h"

enum { RELAY = 12, HEATER = 13 };

static struct world world;

static int begin(void **state)
{
	struct pokeys_settings *wants = &world.config.settings;

	(void)state;
	world_init(&world, NULL);
	world_axes(&world);
	world_pin(&world, RELAY, WIRE_PIN_OUTPUT);
	world_pin(&world, HEATER, WIRE_PIN_OUTPUT);
	memset(world.config.safe_mask, 0xff, sizeof(world.config.safe_mask));
	wants->set |= POKEYS_SET_FAILSAFE;
	wants->failsafe_timeout = 5;
	wants->failsafe_peripherals = WIRE_FAILSAFE_DIGITAL | WIRE_FAILSAFE_PWM |
				      WIRE_FAILSAFE_POEXTBUS | WIRE_FAILSAFE_PULSE;
	wants->failsafe_outputs[HEATER / 8] = 1 << HEATER % 8;
	wants->failsafe_pwm[1] = 10;
	world_commander(&world, 5);
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	return 0;
}

static void it_is_armed_before_the_link_runs_and_read_back(void **state)
{
	const struct sim_failsafe_config *failsafe = &world.rig.device.config.failsafe;

	(void)state;
	assert_int_equal(world.state.failsafe, POKEYS_FAILSAFE_ARMED);
	assert_int_equal(failsafe->timeout, 5);
	assert_int_equal(failsafe->peripherals, 0x0F);
	assert_int_equal(failsafe->outputs[HEATER / 8], 1 << HEATER % 8);
	assert_int_equal(failsafe->pwm[1], 10);
	assert_int_equal(world.rig.device.stats.saves, 0);
}

/* kill -9: nothing leaves any more. */
static void outputs_and_axes_are_safe_when_the_daemon_is_killed(void **state)
{
	(void)state;
	world_output(&world, RELAY, true);
	world_go(&world, 0, 1000000, 0);
	world_machine_on(&world);
	world_run(&world, 100 * MS);
	assert_true(world_latch(&world, RELAY));
	world.now += 450 * MS;
	assert_true(world_latch(&world, RELAY));
	world.now += 100 * MS;
	assert_false(world_latch(&world, RELAY));
	assert_true(world_latch(&world, HEATER));
	world.now += 500 * MS;
	sim_rig_run(&world.rig, world.now);
	assert_int_equal(world.rig.device.engine.state, SIM_PE_STOPPED);
	/* and the next daemon finds it, and takes over */
	world.tick = world.now;
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	world_run(&world, 50 * MS);
	assert_true(world.state.flags & POKEYS_STATE_COMMANDER);
	assert_false(world_latch(&world, RELAY));
	assert_int_equal(world.state.failsafe, POKEYS_FAILSAFE_ARMED);
}

static void it_never_acts_while_the_daemon_talks_however_bad_the_cable(void **state)
{
	(void)state;
	world_output(&world, RELAY, true);
	world_loss(&world, 0.33);
	world_run(&world, 10 * SECOND);
	assert_int_equal(world.rig.device.stats.failsafes, 0);
}

/* Nothing comes back, while all that we send arrives. */
static void lose_answers(uint64_t for_ns)
{
	sim_link_silence(&world.rig.link, SIM_LINK_REPLY, world.now, world.now + for_ns);
}

/* It hears our questions all the time; that must not keep outputs on and an axis running. */
static void it_acts_as_well_when_only_its_answers_are_lost(void **state)
{
	int64_t stands;

	(void)state;
	world_output(&world, RELAY, true);
	world_go(&world, 0, 10000000, 0);
	world_machine_on(&world);
	world_run(&world, 100 * MS);
	lose_answers(10 * SECOND);
	/* lost after 200 ms, 1500 ms of questions, of which the last takes its time, 500 ms */
	world_run(&world, 2700 * MS);
	assert_int_equal(world.state.link, POKEYS_LINK_LOST);
	assert_int_equal(world.rig.device.stats.failsafes, 1);
	assert_false(world_latch(&world, RELAY));
	assert_true(world_latch(&world, HEATER));
	assert_int_equal(world_engine_state(&world), SIM_PE_STOPPED);
	stands = world_pulses(&world, 0);
	/* it was left alone once, and is asked ten times a second again */
	world_run(&world, 8 * SECOND);
	assert_true(world_until(&world, world_is_running, 500 * MS) <= 300 * MS);
	world_run(&world, 100 * MS);
	assert_false(world_latch(&world, RELAY));
	assert_int_equal(world_pulses(&world, 0), stands);
}

static bool is_configuring(struct world *w)
{
	return w->state.link == POKEYS_LINK_CONFIGURING;
}

/* They come back for as long as it takes to see who it is, and its settings are read anew. */
static void it_acts_as_well_when_the_answers_were_back_for_a_moment(void **state)
{
	(void)state;
	world_output(&world, RELAY, true);
	world_run(&world, 100 * MS);
	lose_answers(700 * MS);
	world_until(&world, world_is_lost, 500 * MS);
	world_until(&world, is_configuring, SECOND);
	lose_answers(10 * SECOND);
	world_run(&world, 3 * SECOND);
	assert_int_equal(world.state.link, POKEYS_LINK_LOST);
	assert_int_equal(world.rig.device.stats.failsafes, 1);
	assert_false(world_latch(&world, RELAY));
}

/* The daemon before was killed a moment ago; this one knows of the device what is configured. */
static void start_anew_without_answers(void)
{
	world_output(&world, RELAY, true);
	world_go(&world, 0, 10000000, 0);
	world_machine_on(&world);
	world_run(&world, 100 * MS);
	world.tick = world.now;
	lose_answers(20 * SECOND);
	world_start(&world);
}

static void it_acts_as_well_before_a_new_daemon_has_heard_it(void **state)
{
	(void)state;
	start_anew_without_answers();
	world_run(&world, 2700 * MS);
	assert_int_equal(world.state.link, POKEYS_LINK_SEARCHING);
	assert_int_equal(world.rig.device.stats.failsafes, 1);
	assert_false(world_latch(&world, RELAY));
	assert_true(world_latch(&world, HEATER));
	assert_int_equal(world_engine_state(&world), SIM_PE_STOPPED);
	/* once, as long as nothing is heard of it */
	world_run(&world, 17 * SECOND);
	assert_int_equal(world.rig.device.stats.failsafes, 1);
	world_until(&world, world_is_running, 1 * SECOND);
	world_run(&world, 100 * MS);
	assert_true(world.state.flags & POKEYS_STATE_COMMANDER);
	assert_false(world_latch(&world, RELAY));
}

/* Nobody knows how long it waits, or whether it does. */
static void one_that_is_not_configured_has_no_turn_before_it_was_heard(void **state)
{
	(void)state;
	world.config.settings.set &= ~(uint32_t)POKEYS_SET_FAILSAFE;
	start_anew_without_answers();
	world_run(&world, 19 * SECOND);
	assert_int_equal(world.rig.device.stats.failsafes, 0);
	assert_true(world_until(&world, world_is_running, 3 * SECOND) <= 1300 * MS);
}

/* A search is a question as well. */
static void where_it_is_searched_for_no_search_goes_out_for_so_long(void **state)
{
	uint64_t begin = 0, end = 0;

	(void)state;
	world.config.address = 0;
	world.config.serial = 65432;
	world_start(&world);
	for (unsigned int ms = 0; ms < 5000; ms++) {
		world_cycle(&world);
		if (device_wants_address(world.device))
			continue;
		begin = begin ? begin : world.now;
		end = world.now;
	}
	assert_in_range(end - begin, 690 * MS, 710 * MS);
	assert_true(device_wants_address(world.device));
}

/* No carrier yet, while a machine starts. */
static void what_could_not_be_sent_was_no_question(void **state)
{
	(void)state;
	for (unsigned int i = 0; i < 10; i++) {
		world.unplugged = true;
		world_start(&world);
		world_run(&world, (1500 + 100 * i) * MS);
		world.unplugged = false;
		assert_true(world_until(&world, world_is_running, 1 * SECOND) <= 400 * MS);
	}
}

static void at_another_address_it_has_another_turn(void **state)
{
	(void)state;
	start_anew_without_answers();
	world_run(&world, 2700 * MS);
	assert_int_equal(world.rig.device.stats.failsafes, 1);
	device_set_address(world.device, 0x7f000102, 20055, world.now);
	world_run(&world, 2700 * MS);
	assert_int_equal(world.rig.device.stats.failsafes, 2);
}

static void a_shorter_loss_costs_no_time(void **state)
{
	(void)state;
	for (unsigned int i = 0; i < 5; i++) {
		sim_rig_silence(&world.rig, world.now, 1600 * MS);
		world_run(&world, 1600 * MS);
		assert_int_equal(world.state.link, POKEYS_LINK_LOST);
		assert_true(world_until(&world, world_is_running, 500 * MS) <= 300 * MS);
		world_run(&world, 100 * MS);
	}
}

static void another_one_or_none_is_shown(void **state)
{
	(void)state;
	world.config.settings.set &= ~(uint32_t)POKEYS_SET_FAILSAFE;
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	assert_int_equal(world.state.failsafe, POKEYS_FAILSAFE_OTHER);
	world.rig.device.config.failsafe.timeout = 0;
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	assert_int_equal(world.state.failsafe, POKEYS_FAILSAFE_OFF);
}

static void deaf(struct world *w, const uint8_t *p)
{
	w->swallow = p[1] == 0x81;
}

static void firmware_without_it_runs_and_says_so(void **state)
{
	(void)state;
	world.watch = deaf;
	world_start(&world);
	world_until(&world, world_is_running, 3 * SECOND);
	assert_int_equal(world.state.failsafe, POKEYS_FAILSAFE_UNKNOWN);
	assert_int_equal(world.state.config_state, POKEYS_CONFIG_REFUSED);
	assert_int_equal(world.last_event[EVENT_CONFIG_REFUSED].a, WIRE_OP_FAILSAFE);
}

/* The loop makes no more cycle. What it has to say of that; NULL = nothing. */
static const struct event *last_word(void)
{
	static struct event event;

	device_ended(world.device, world.now);
	while (event_pop(&world.events, &event))
		if (event.code == EVENT_NOT_SAFE)
			return &event;
	return NULL;
}

/* The daemon ends, and nothing arrives any more. */
static const struct event *end_in_silence(void)
{
	world_output(&world, RELAY, true);
	world_run(&world, 20 * MS);
	assert_true(world_latch(&world, RELAY));
	sim_rig_silence(&world.rig, world.now, 10 * SECOND);
	device_stop(world.device, world.now);
	world_until(&world, world_is_stopped, 1 * SECOND);
	return last_word();
}

static void what_has_the_outputs_is_told_when_the_end_is_not_acknowledged(void **state)
{
	const struct event *said = end_in_silence();

	(void)state;
	assert_non_null(said);
	assert_int_equal(said->level, EVENT_WARNING);
	assert_int_equal(said->a, 500);
	assert_int_equal(said->b, WIRE_FAILSAFE_ALL);
}

static void so_it_is_when_nothing_has_them(void **state)
{
	const struct event *said;

	(void)state;
	world.config.settings.failsafe_peripherals = 0;
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	said = end_in_silence();
	assert_non_null(said);
	assert_int_equal(said->a, 0);
}

static void so_it_is_when_it_is_not_known(void **state)
{
	const struct event *said;

	(void)state;
	world.watch = deaf;
	world_start(&world);
	world_until(&world, world_is_running, 3 * SECOND);
	said = end_in_silence();
	assert_non_null(said);
	assert_int_equal(said->a, -1);
}

/* The link was lost before: that was told then, and nothing was driven any more. */
static void of_a_device_that_was_away_before_nothing_is_told(void **state)
{
	(void)state;
	world_output(&world, RELAY, true);
	world_run(&world, 20 * MS);
	sim_rig_silence(&world.rig, world.now, 10 * SECOND);
	world_until(&world, world_is_lost, 1 * SECOND);
	device_stop(world.device, world.now);
	world_run(&world, 2 * MS);
	assert_null(last_word());
}

static void nothing_is_told_when_all_is_safe(void **state)
{
	(void)state;
	world_output(&world, RELAY, true);
	world_run(&world, 20 * MS);
	device_stop(world.device, world.now);
	world_until(&world, world_is_stopped, 1 * SECOND);
	assert_null(last_word());
}

/* What it acknowledges in the last cycle counts, though no other one looks at it. */
static void the_last_answer_counts(void **state)
{
	(void)state;
	world_output(&world, RELAY, true);
	world_run(&world, 20 * MS);
	device_stop(world.device, world.now);
	world_cycle(&world);
	assert_false(world_is_stopped(&world));
	assert_false(world_latch(&world, RELAY));
	assert_null(last_word());
	assert_true(world_is_stopped(&world));
}

/* The transport has failed for good: nobody was asked for anything. */
static void a_loop_that_breaks_off_leaves_outputs_on_and_says_so(void **state)
{
	(void)state;
	world_output(&world, RELAY, true);
	world_run(&world, 20 * MS);
	assert_non_null(last_word());
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(it_is_armed_before_the_link_runs_and_read_back, begin),
		cmocka_unit_test_setup(outputs_and_axes_are_safe_when_the_daemon_is_killed, begin),
		cmocka_unit_test_setup(it_never_acts_while_the_daemon_talks_however_bad_the_cable,
				       begin),
		cmocka_unit_test_setup(it_acts_as_well_when_only_its_answers_are_lost, begin),
		cmocka_unit_test_setup(it_acts_as_well_when_the_answers_were_back_for_a_moment,
				       begin),
		cmocka_unit_test_setup(it_acts_as_well_before_a_new_daemon_has_heard_it, begin),
		cmocka_unit_test_setup(one_that_is_not_configured_has_no_turn_before_it_was_heard,
				       begin),
		cmocka_unit_test_setup(where_it_is_searched_for_no_search_goes_out_for_so_long,
				       begin),
		cmocka_unit_test_setup(what_could_not_be_sent_was_no_question, begin),
		cmocka_unit_test_setup(at_another_address_it_has_another_turn, begin),
		cmocka_unit_test_setup(a_shorter_loss_costs_no_time, begin),
		cmocka_unit_test_setup(another_one_or_none_is_shown, begin),
		cmocka_unit_test_setup(firmware_without_it_runs_and_says_so, begin),
		cmocka_unit_test_setup(
			what_has_the_outputs_is_told_when_the_end_is_not_acknowledged, begin),
		cmocka_unit_test_setup(so_it_is_when_nothing_has_them, begin),
		cmocka_unit_test_setup(so_it_is_when_it_is_not_known, begin),
		cmocka_unit_test_setup(of_a_device_that_was_away_before_nothing_is_told, begin),
		cmocka_unit_test_setup(nothing_is_told_when_all_is_safe, begin),
		cmocka_unit_test_setup(the_last_answer_counts, begin),
		cmocka_unit_test_setup(a_loop_that_breaks_off_leaves_outputs_on_and_says_so, begin),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
