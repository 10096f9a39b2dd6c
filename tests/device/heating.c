/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Heaters reach their targets, and are off whenever something is lost. */

#include <math.h>
#include "tests/device/heat_rig.h"

static void they_reach_their_targets_and_say_so(void **state)
{
	(void)state;
	assert_string_equal(heat_shown(HOTEND)->name, "hotend");
	assert_int_equal(heat_shown(HOTEND)->state, POKEYS_HEATER_OFF);
	assert_in_range(heat_shown(BED)->temperature, 21, 23);
	heat_up();
	for (unsigned int i = 0; i < 5000; i++) {
		heat_cycle();
		assert_true(fabs(heat[HOTEND].sensor - 150) < 3);
		assert_true(fabs(heat[BED].sensor - 60) < 8);
	}
	assert_true(fabs((double)heat_shown(HOTEND)->power - heat_power(HOTEND)) < 0.05);
	assert_true(fabs((double)heat_shown(HOTEND)->temperature - heat[HOTEND].sensor) < 1);
	assert_true(world.state.t_publish_ns - heat_shown(HOTEND)->t_ns < 150 * MS);
	assert_int_equal(heat_shown(HOTEND)->refused, POKEYS_HEATER_TAKEN);
	assert_int_equal(heat_shown(2)->state, POKEYS_HEATER_NONE);
	heat_command(HOTEND, 0);
	heat_command(BED, 0);
	world_cycle(&world);
	assert_true(heat_power(HOTEND) <= 0 && heat_power(BED) <= 0);
	assert_int_equal(world.event_count[EVENT_HEATER], 0);
}

static void a_target_out_of_range_is_refused_and_the_old_one_stays(void **state)
{
	(void)state;
	heat_command(HOTEND, 100);
	heat_run(200 * MS);
	heat_command(HOTEND, 266);
	heat_run(200 * MS);
	assert_true(heat_shown(HOTEND)->target == 100);
	assert_int_equal(heat_shown(HOTEND)->refused, POKEYS_HEATER_OUT_OF_RANGE);
	assert_int_equal(world.event_count[EVENT_HEATER_REFUSED], 1);
	heat_command(HOTEND, NAN);
	heat_run(200 * MS);
	assert_true(heat_shown(HOTEND)->target == 0 && heat_power(HOTEND) <= 0);
	assert_true(world.state.flags & POKEYS_STATE_BAD_COMMAND);
	assert_int_equal(world.last_event[EVENT_BAD_COMMAND].a, COMMAND_FAULT_HEATER_TARGET);
	/* off, but nobody has commanded off */
	heat_command(HOTEND, 90);
	heat_run(200 * MS);
	assert_true(heat_shown(HOTEND)->target == 0 && heat_power(HOTEND) <= 0);
	assert_int_equal(heat_shown(HOTEND)->refused, POKEYS_HEATER_AFTER_FAULT);
	heat_command(HOTEND, 0);
	heat_run(200 * MS);
	heat_command(HOTEND, 90);
	world.command.heater_mask |= 1u << HEATERS;
	heat_run(200 * MS);
	assert_true(heat_shown(HOTEND)->target == 90);
	assert_int_equal(world.last_event[EVENT_BAD_COMMAND].a, COMMAND_FAULT_HEATER);
	/* what is not commanded is off */
	world.command.heater_mask = 1u << BED;
	heat_run(5 * MS);
	assert_true(heat_power(HOTEND) <= 0 && heat_shown(HOTEND)->target == 0);
}

/* Nothing has to be sent for it. */
static void a_reset_does_not_wait_for_the_device(void **state)
{
	uint64_t begun;

	(void)state;
	heat_up();
	sim_heat_break(&heat[HOTEND], SIM_HEAT_OPEN);
	heat_run(120 * MS);
	sim_heat_break(&heat[HOTEND], SIM_HEAT_GOOD);
	heat_command(HOTEND, 0);
	heat_run(300 * MS);
	heat_expect_fault(HOTEND, POKEYS_HEATER_OPEN);
	sim_rig_silence(&world.rig, world.now, 200 * MS);
	heat_run(100 * MS);
	begun = world.now;
	assert_int_equal(heat_reset(HOTEND), POKEYS_OUTCOME_DONE);
	assert_true(world.now - begun < 20 * MS);
	heat_run(20 * MS);
	assert_int_equal(heat_shown(HOTEND)->state, POKEYS_HEATER_OFF);
}

static void a_broken_sensor_is_a_fault_until_it_is_reset(void **state)
{
	(void)state;
	heat_up();
	sim_heat_break(&heat[HOTEND], SIM_HEAT_OPEN);
	sim_heat_break(&heat[BED], SIM_HEAT_SHORT);
	/* a period, and two readings of the slow one */
	heat_expect_off(120 * MS + 2 * 20 * MS);
	heat_expect_fault(HOTEND, POKEYS_HEATER_OPEN);
	heat_expect_fault(BED, POKEYS_HEATER_SHORTED);
	assert_int_equal(world.event_count[EVENT_HEATER], 2);
	assert_int_equal(heat_reset(HOTEND), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(heat_reset(HEATERS), POKEYS_OUTCOME_REFUSED);
	sim_heat_break(&heat[HOTEND], SIM_HEAT_GOOD);
	heat_expect_off(0);
	heat_expect_fault(HOTEND, POKEYS_HEATER_OPEN);
	assert_int_equal(heat_reset(HOTEND), POKEYS_OUTCOME_DONE);
	heat_expect_off(0);
	assert_int_equal(heat_shown(HOTEND)->state, POKEYS_HEATER_OFF);
	assert_int_equal(heat_shown(HOTEND)->fault_count, 1);
	/* the target that was commanded all the time does not count */
	heat_command(HOTEND, 151);
	heat_run(300 * MS);
	assert_int_equal(heat_shown(HOTEND)->refused, POKEYS_HEATER_AFTER_FAULT);
	heat_command(HOTEND, 0);
	heat_run(300 * MS);
	heat_command(HOTEND, 151);
	heat_run(300 * MS);
	assert_int_equal(heat_shown(HOTEND)->state, POKEYS_HEATER_HEATING);
	assert_true(heat_power(HOTEND) > 0);
}

static void a_lost_device_switches_them_off_itself_and_they_stay_off(void **state)
{
	(void)state;
	heat_up();
	heat_silence(1500 * MS); /* its failsafe waits for 1 s */
	assert_int_equal(world.state.link, POKEYS_LINK_LOST);
	heat_run(20 * MS);
	world_until(&world, world_is_running, 3 * SECOND);
	heat_expect_off(5 * MS);
	heat_expect_fault(HOTEND, POKEYS_HEATER_DEVICE);
	heat_expect_fault(BED, POKEYS_HEATER_DEVICE);
}

/* Found again before its failsafe has acted: the questions must not keep that quiet. */
static void a_short_loss_does_not_leave_them_on(void **state)
{
	const uint64_t losses_ms[] = { 250, 400, 700, 950 };

	for (unsigned int i = 0; i < 4; i++) {
		heat_begin(state);
		heat_up();
		heat_silence(losses_ms[i] * MS);
		heat_expect_off(1300 * MS);
		world_until(&world, world_is_running, 3 * SECOND);
		heat_expect_off(0);
		heat_expect_fault(HOTEND, POKEYS_HEATER_DEVICE);
	}
}

static void a_device_that_was_restarted_keeps_them_off(void **state)
{
	(void)state;
	heat_up();
	sim_device_reboot(&world.rig.device, world_device_time(&world), false);
	heat_run(1 * SECOND);
	world_until(&world, world_is_running, 3 * SECOND);
	heat_expect_off(5 * MS);
	assert_int_equal(heat_shown(HOTEND)->state, POKEYS_HEATER_FAULT);
	assert_int_equal(heat_shown(BED)->state, POKEYS_HEATER_FAULT);
}

static void without_a_commander_they_are_off_at_once(void **state)
{
	(void)state;
	heat_up();
	world.commanding = false;
	heat_expect_off(100 * MS + 220 * MS); /* heartbeat-timeout-ms, and the shortest hold-s */
	assert_int_equal(heat_shown(HOTEND)->state, POKEYS_HEATER_OFF);
	assert_int_equal(world.event_count[EVENT_HEATER_LEFT], 2);
	world_until(&world, world_is_safe, 1 * SECOND);
	world.commanding = true;
	heat_expect_off(0);
	heat_command(HOTEND, 0);
	heat_run(200 * MS);
	heat_command(HOTEND, 160);
	heat_run(300 * MS);
	assert_true(heat_power(HOTEND) > 0);
}

static void one_that_holds_goes_on_while_all_else_is_safe(void **state)
{
	heat_prepare(state);
	world.config.heater[HOTEND].heater.lease_ns = UINT64_MAX;
	heat_start();
	heat_up();
	world_output(&world, LAMP, true);
	world.command.pwm_enable = 1u << FAN_PWM;
	world.command.pwm_duty[FAN_PWM] = PERIOD;
	heat_run(100 * MS);
	assert_true(world_latch(&world, LAMP));
	assert_int_equal(world.rig.device.config.pwm.duty[FAN_PWM], PERIOD);
	world.commanding = false;
	heat_run(1 * SECOND);
	assert_false(world_latch(&world, LAMP));
	assert_int_equal(world.rig.device.config.pwm.duty[FAN_PWM], 0);
	for (unsigned int i = 0; i < 20000; i++) {
		heat_cycle();
		assert_true(fabs(heat[HOTEND].sensor - 150) < 3);
		assert_false(world.state.flags & POKEYS_STATE_SAFE); /* for it heats */
	}
	assert_true(heat_power(BED) <= 0);
	sim_heat_break(&heat[HOTEND], SIM_HEAT_OPEN);
	heat_expect_off(120 * MS);
	world_until(&world, world_is_safe, 100 * MS);
}

static void an_emergency_stop_switches_them_off(void **state)
{
	(void)state;
	heat_up();
	while (heat_power(HOTEND) <= 0 || heat_power(BED) <= 0)
		heat_cycle();
	world.command.flags |= POKEYS_COMMAND_EMERGENCY;
	world_cycle(&world);
	assert_true(heat_power(BED) <= 0);
	heat_expect_off(1 * MS); /* PWM may wait for its turn */
	world.command.flags = 0;
	heat_expect_off(0);
	assert_int_equal(heat_shown(HOTEND)->state, POKEYS_HEATER_OFF);
}

static void the_end_of_the_daemon_switches_them_off(void **state)
{
	(void)state;
	heat_up();
	device_stop(world.device, world.now);
	world_until(&world, world_is_stopped, 100 * MS);
	assert_true(heat_power(HOTEND) <= 0 && heat_power(BED) <= 0);
	assert_true(world_is_safe(&world));
}

/* By a daemon that is killed and begins again at once. */
static void a_daemon_that_begins_again_at_once_switches_them_off(void **state)
{
	(void)state;
	heat_up();
	while (heat_power(HOTEND) <= 0 || heat_power(BED) <= 0)
		heat_cycle();
	world.now += 300 * MS;
	world.tick = world.now;
	world_start(&world);
	heat_expect_off(1300 * MS);
	world_until(&world, world_is_running, 3 * SECOND);
	heat_expect_off(0);
}

static void a_killed_daemon_leaves_them_to_the_device(void **state)
{
	(void)state;
	heat_up();
	while (heat_power(HOTEND) <= 0 || heat_power(BED) <= 0)
		heat_cycle();
	world.now += 900 * MS;
	assert_true(heat_power(HOTEND) > 0 && heat_power(BED) > 0);
	world.now += 200 * MS;
	assert_true(heat_power(HOTEND) <= 0 && heat_power(BED) <= 0);
	/* and the next daemon does not go on heating, whatever is commanded still */
	world.tick = world.now;
	world_start(&world);
	world_until(&world, world_is_running, 3 * SECOND);
	heat_expect_off(0);
}

static bool is_about_pwm(const uint8_t *packet)
{
	return packet[1] == 0xCB;
}

static void swallow_pwm(struct world *w, const uint8_t *packet)
{
	w->swallow = is_about_pwm(packet);
}

/* Everything else is answered, which keeps the device's failsafe quiet. */
static void an_off_that_never_arrives_is_left_to_the_device(void **state)
{
	(void)state;
	heat_up();
	while (heat_power(HOTEND) <= 0)
		heat_cycle();
	world.watch = swallow_pwm;
	heat_command(HOTEND, 0);
	heat_command(BED, 0);
	heat_run(400 * MS);
	assert_true(heat_power(HOTEND) > 0);
	heat_expect_off(1500 * MS);
	assert_int_equal(world.event_count[EVENT_HEATER_UNHEARD], 1);
	assert_int_equal(world.last_event[EVENT_HEATER_UNHEARD].a, 1000);
	world.watch = NULL;
	world_until(&world, world_is_running, 5 * SECOND);
	heat_expect_off(0);
}

static void gains_are_found_on_request(void **state)
{
	(void)state;
	assert_int_equal(heat_tune(HOTEND, 300), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(heat_tune(HOTEND, NAN), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(heat_tune(HEATERS, 100), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(heat_tune(HOTEND, 100), POKEYS_OUTCOME_DONE);
	heat_run(200 * MS);
	assert_int_equal(heat_shown(HOTEND)->state, POKEYS_HEATER_TUNING);
	assert_int_equal(heat_tune(HOTEND, 0), POKEYS_OUTCOME_DONE);
	heat_run(200 * MS);
	assert_int_equal(heat_shown(HOTEND)->tuning, POKEYS_HEATER_TUNING_FAILED);
	assert_true(heat_power(HOTEND) <= 0);
	assert_int_equal(heat_tune(HOTEND, 100), POKEYS_OUTCOME_DONE);
	heat_run(100 * SECOND);
	assert_int_equal(heat_shown(HOTEND)->tuning, POKEYS_HEATER_TUNING_DONE);
	assert_true(heat_power(HOTEND) <= 0);
	assert_true(heat_shown(HOTEND)->tuned_p > 0 && heat_shown(HOTEND)->tuned_i > 0);
	assert_int_equal(world.last_event[EVENT_HEATER_TUNED].b, POKEYS_HEATER_TUNING_DONE);
}

/* What a broken sensor, a lost device or a dead commander leaves on, for how long at most? */
static void nothing_stays_on_whatever_the_network_loses(void **state)
{
	struct sim_prng prng;
	uint64_t off_ns;

	(void)state;
	sim_prng_init(&prng, world_seed());
	for (unsigned int round = 0; round < 20; round++) {
		heat_begin(NULL);
		heat_up();
		world_loss(&world, 0.05 * (double)(round % 5));
		heat_run(sim_prng_below(&prng, 500) * MS);
		if (round % 3 == 0)
			sim_heat_break(&heat[HOTEND], SIM_HEAT_OPEN);
		else if (round % 3 == 1)
			world.commanding = false;
		else
			world.command.flags |= POKEYS_COMMAND_EMERGENCY;
		off_ns = world.tick;
		while (heat_power(HOTEND) > 0)
			heat_cycle();
		/* The daemon decides in 220 ms, and retries until the write arrives. If that is
		 * not acknowledged in 500 ms, the device's failsafe has its turn. */
		assert_in_range((world.tick - off_ns) / MS, 0, 2000);
		heat_run(100 * MS);
		for (unsigned int i = 0; i < 3000; i++) {
			heat_cycle();
			assert_true(heat_power(HOTEND) <= 0);
		}
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(they_reach_their_targets_and_say_so, heat_begin),
		cmocka_unit_test_setup(a_target_out_of_range_is_refused_and_the_old_one_stays,
				       heat_begin),
		cmocka_unit_test_setup(a_reset_does_not_wait_for_the_device, heat_begin),
		cmocka_unit_test_setup(a_broken_sensor_is_a_fault_until_it_is_reset, heat_begin),
		cmocka_unit_test_setup(a_lost_device_switches_them_off_itself_and_they_stay_off,
				       heat_begin),
		cmocka_unit_test(a_short_loss_does_not_leave_them_on),
		cmocka_unit_test_setup(a_device_that_was_restarted_keeps_them_off, heat_begin),
		cmocka_unit_test_setup(without_a_commander_they_are_off_at_once, heat_begin),
		cmocka_unit_test(one_that_holds_goes_on_while_all_else_is_safe),
		cmocka_unit_test_setup(an_emergency_stop_switches_them_off, heat_begin),
		cmocka_unit_test_setup(the_end_of_the_daemon_switches_them_off, heat_begin),
		cmocka_unit_test_setup(a_killed_daemon_leaves_them_to_the_device, heat_begin),
		cmocka_unit_test_setup(a_daemon_that_begins_again_at_once_switches_them_off,
				       heat_begin),
		cmocka_unit_test_setup(an_off_that_never_arrives_is_left_to_the_device, heat_begin),
		cmocka_unit_test_setup(gains_are_found_on_request, heat_begin),
		cmocka_unit_test(nothing_stays_on_whatever_the_network_loses),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
