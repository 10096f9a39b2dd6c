/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Homing by the device, and the count that it begins: told in one image with the position,
 * never that of a restart or of another client, and not known if homing did not end well.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <cmocka.h>
#include "tests/device/home_rig.h"
#include "wire/pulse.h"

static bool is_even(unsigned int axis)
{
	return !(world.state.engine.axis[axis].position_epoch & 1);
}

static void the_count_is_told_by_homing(void **state)
{
	const struct pokeys_one_shot shot = home(1, POKEYS_HOME_FINISH_ITSELF);

	(void)state;
	assert_int_equal(world_do(&world, &shot, 2 * SECOND), POKEYS_OUTCOME_DONE);
	world_until(&world, is_idle, 500 * MS);
	world_run(&world, 10 * MS);
	assert_false(is_even(0));
	assert_true(is_even(1));
	assert_int_equal(world.event_count[EVENT_POSITION_LOST], 0);
}

/* Who reads `homed` reads the new count and that it is one, in the same image. */
static void homed_comes_with_its_count(void **state)
{
	const struct pokeys_one_shot shot = home(5, POKEYS_HOME_FINISH_ITSELF);
	struct pokeys_engine before = world.state.engine;

	(void)state;
	world_one_shot(&world, &shot);
	do {
		world_cycle(&world);
		for (unsigned int i = 0; i < 3; i++) {
			const struct pokeys_axis *was = &before.axis[i];
			const struct pokeys_axis *is = &world.state.engine.axis[i];

			/* the device counts from the switch's edge already, before it is homed */
			if (was->homed || i == 1)
				assert_in_range(abs(is->position - was->position), 0, 150);
			if (is->homed)
				assert_false(is_even(i));
			if (is->homed && !was->homed)
				assert_int_not_equal(was->position_epoch, is->position_epoch);
		}
		before = world.state.engine;
	} while (!before.task_count);
	world_run(&world, 100 * MS);
	for (unsigned int i = 0; i < 3; i++) {
		assert_int_equal(world.state.engine.axis[i].homed, i != 1);
		assert_int_equal(world.state.engine.axis[i].position_epoch,
				 before.axis[i].position_epoch);
	}
}

/* It is homed, and waits for whoever asked for it. */
static void a_count_set_elsewhere_after_it_is_a_loss(void **state)
{
	const struct pokeys_one_shot shot = home(1, 0);

	(void)state;
	world_one_shot(&world, &shot);
	world_until(&world, is_complete, 2 * SECOND);
	assert_false(is_even(0));
	world_set_elsewhere(&world, 1, 70000);
	world_run(&world, 500 * MS);
	assert_true(is_even(0));
	assert_int_equal(world.state.engine.axis[0].homed, 0);
	assert_int_equal(world.event_count[EVENT_POSITION_LOST], 1);
}

/* All counts at once, while one of the axes is being homed: none is as it was. */
static void counts_set_elsewhere_while_one_is_homed_are_lost_all(void **state)
{
	(void)state;
	start(1);
	world_set_elsewhere(&world, 7, 70000);
	world_run(&world, 500 * MS);
	for (unsigned int i = 0; i < 3; i++) {
		assert_int_equal(world.state.engine.axis[i].position_epoch, 2);
		assert_int_equal(world.state.engine.axis[i].homed, 0);
	}
}

/* The device is homing another axis when the cable breaks. */
static void a_count_set_elsewhere_in_the_outage_is_a_loss(void **state)
{
	(void)state;
	start(1);
	sim_rig_silence(&world.rig, world.now, 2 * SECOND);
	world_until(&world, world_is_lost, 1 * SECOND);
	world_set_elsewhere(&world, 2, 700000);
	world_until(&world, world_is_running, 5 * SECOND);
	world_run(&world, 100 * MS);
	assert_int_equal(world.state.engine.axis[0].position_epoch, 2);
	assert_int_equal(world.state.engine.axis[1].position_epoch, 2);
	assert_int_equal(world.state.engine.axis[1].position, 700000);
	assert_int_equal(world.state.engine.axis[2].position_epoch, 0);
}

/* Whatever of it was done by then: the count is that of the restart. */
static void restart_when(uint8_t flags, enum pokeys_task_phase phase, unsigned int boot_ms)
{
	struct pokeys_one_shot shot = home(1, flags);
	struct pokeys_axis before;
	uint8_t epoch;

	shot.value[0] = 5000; /* further from 0 than it can go in a moment */
	begin(NULL);
	world_one_shot(&world, &shot);
	while (world.state.engine.task_phase != phase)
		world_cycle(&world);
	before = world.state.engine.axis[0];
	epoch = before.position_epoch;
	world.rig.device.options.boot_ms = boot_ms;
	sim_rig_reboot(&world.rig, world.now, false);
	for (unsigned int ms = 0; ms < 3000; ms++) {
		const struct pokeys_axis *now = &world.state.engine.axis[0];

		world_cycle(&world);
		assert_true(!(now->position_epoch & 1) || (before.position_epoch & 1));
		/* it brakes behind its switch, and no more */
		if (now->position_epoch == before.position_epoch)
			assert_in_range(abs(now->position - before.position), 0, 60);
		before = *now;
	}
	assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
	assert_int_not_equal(before.position_epoch, epoch);
	assert_true(is_even(0));
	assert_int_equal(before.position, 0);
	assert_int_equal(world.state.engine.axis[0].homed, 0);
}

static void a_restart_after_homing_is_no_homing(void **state)
{
	static const unsigned int boot_ms[] = { 0, 15, 100 };

	(void)state;
	for (size_t i = 0; i < sizeof(boot_ms) / sizeof(boot_ms[0]); i++) {
		restart_when(0, POKEYS_TASK_COMPLETE, boot_ms[i]);
		restart_when(POKEYS_HOME_FINISH_ITSELF, POKEYS_TASK_FINISHING, boot_ms[i]);
		restart_when(POKEYS_HOME_FINISH_ITSELF, POKEYS_TASK_STOPPING, boot_ms[i]);
	}
}

static bool counts_from_the_edge(struct world *w)
{
	return w->state.engine.axis[0].state == WIRE_AXIS_HOMING_RESETTING ||
	       w->state.engine.axis[0].state == WIRE_AXIS_HOMING_BACKING_OFF;
}

/* The new count is as good as the old one, and so no jump tells of it. */
static void a_homing_cancelled_after_the_edge_has_lost_the_count(void **state)
{
	struct pokeys_one_shot shot = home(1, 0);

	(void)state;
	shot.value[0] = HOME_AT;
	world_one_shot(&world, &shot);
	world_until(&world, counts_from_the_edge, 2 * SECOND);
	assert_int_equal(act(POKEYS_ONE_SHOT_HOME_CANCEL), POKEYS_OUTCOME_DONE);
	world_run(&world, 100 * MS);
	assert_int_equal(world.state.engine.axis[0].position_epoch, 2);
}

/* The device takes over its new count at the switch's edge, before the task has ended. */
static void a_homing_that_ends_after_the_edge_has_lost_the_count(void **state)
{
	const struct pokeys_one_shot shot = home(1, 0);
	const uint8_t before = world.state.engine.axis[0].position_epoch;

	(void)state;
	world_one_shot(&world, &shot);
	world_until(&world, is_working, 200 * MS);
	assert_int_equal(world.state.engine.task_phase, POKEYS_TASK_WORKING);
	sim_rig_silence(&world.rig, world.now, 2 * SECOND);
	world_until(&world, world_is_lost, 1 * SECOND);
	world_until(&world, world_is_running, 5 * SECOND);
	world_run(&world, 100 * MS);
	assert_true(is_even(0));
	assert_int_not_equal(world.state.engine.axis[0].position_epoch, before);
	assert_true(is_even(1));
	assert_int_equal(world.state.engine.axis[1].position_epoch, 0);
}

/* "config apply" or a reload while the machine is on, and nothing is different. */
static void settings_that_are_read_again_leave_it_homed(void **state)
{
	const struct pokeys_one_shot shot = home(3, POKEYS_HOME_FINISH_ITSELF);
	struct sim_device *sim = &world.rig.device;

	(void)state;
	assert_int_equal(world_do(&world, &shot, 2 * SECOND), POKEYS_OUTCOME_DONE);
	world_until(&world, is_idle, 500 * MS);
	world_go(&world, 0, 500, 0);
	world_machine_on(&world);
	world_run(&world, 500 * MS);
	for (unsigned int i = 0; i < 2000; i++) {
		if (i == 0)
			assert_int_equal(device_order(world.device, DEVICE_ORDER_APPLY), 0);
		if (i == 1000) /* the file was read again */
			device_wanted(world.device, &world.config.settings);
		world_cycle(&world);
		assert_int_equal(world.state.engine.axis[0].homed, 1);
		assert_int_equal(world.state.engine.axis[1].homed, 1);
	}
	/* somebody else has turned its direction */
	sim->config.engine.axis[0][0] ^= WIRE_AXIS_INVERTED;
	assert_int_equal(device_order(world.device, DEVICE_ORDER_APPLY), 0);
	world_run(&world, 1 * SECOND);
	assert_int_equal(world.state.engine.axis[0].homed, 0);
	assert_int_equal(world.state.engine.axis[1].homed, 1);
}

static void a_restart_of_the_device_ends_it(void **state)
{
	const struct pokeys_one_shot shot = home(1, POKEYS_HOME_FINISH_ITSELF);

	(void)state;
	assert_int_equal(world_do(&world, &shot, 2 * SECOND), POKEYS_OUTCOME_DONE);
	sim_rig_reboot(&world.rig, world.now, false);
	world_run(&world, 2 * SECOND);
	assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
	assert_int_equal(world.state.engine.axis[0].homed, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(the_count_is_told_by_homing, begin),
		cmocka_unit_test_setup(homed_comes_with_its_count, begin),
		cmocka_unit_test_setup(a_count_set_elsewhere_after_it_is_a_loss, begin),
		cmocka_unit_test_setup(counts_set_elsewhere_while_one_is_homed_are_lost_all, begin),
		cmocka_unit_test_setup(a_count_set_elsewhere_in_the_outage_is_a_loss, begin),
		cmocka_unit_test(a_restart_after_homing_is_no_homing),
		cmocka_unit_test_setup(a_homing_cancelled_after_the_edge_has_lost_the_count, begin),
		cmocka_unit_test_setup(a_homing_that_ends_after_the_edge_has_lost_the_count, begin),
		cmocka_unit_test_setup(settings_that_are_read_again_leave_it_homed, begin),
		cmocka_unit_test_setup(a_restart_of_the_device_ends_it, begin),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
