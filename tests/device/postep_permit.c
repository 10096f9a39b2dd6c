/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * PoStep motor drivers and the permission to move: not with another step mode than the
 * one that is wanted, and nothing that is being set up holds the machine up for ever.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/pulse.h"

enum { ADDRESS = 33, TYPE = 1, STEP = 5, LIMIT = 70 }; /* of axis 0; the others follow */

static struct world world;

static int begin(void **state)
{
	struct pokeys_settings *wants = &world.config.settings;

	(void)state;
	world_init(&world, NULL);
	world_axes(&world);
	wants->set |= POKEYS_SET_POSTEP;
	wants->postep_enable = 1;
	for (unsigned int i = 0; i < 2; i++) {
		wants->axis[i].set |= POKEYS_AXIS_SET_POSTEP_TYPE | POKEYS_AXIS_SET_POSTEP_ADDRESS;
		wants->axis[i].postep_type = TYPE;
		wants->axis[i].postep_address = (uint8_t)(ADDRESS + i);
	}
	wants->axis[0].set |= POKEYS_AXIS_SET_POSTEP_STEP | POKEYS_AXIS_SET_POSTEP_TEMPERATURE;
	wants->axis[0].postep_step = STEP;
	wants->axis[0].postep_temperature = LIMIT;
	world_commander(&world, 5);
	world_start(&world);
	world_until(&world, world_is_running, 2 * SECOND);
	return 0;
}

static bool is_applied(struct world *w)
{
	return w->state.config_state == POKEYS_CONFIG_APPLIED &&
	       w->rig.device.bench.postep[1].step == 8;
}

static bool is_applied_again(struct world *w)
{
	return w->state.config_state == POKEYS_CONFIG_APPLIED;
}

static bool has_step_again(struct world *w)
{
	const struct sim_postep *driver = &w->rig.device.bench.postep[0];

	return driver->step == STEP && driver->limit == LIMIT;
}

static bool waits_for_the_machine(struct world *w)
{
	return w->state.config_state == POKEYS_CONFIG_WAITING;
}

/* In which step of being passed on axis 1 is to be, as the wire shows it. */
static uint8_t awaited_update;
static bool update_seen;

static void look_for_update(struct world *w, const uint8_t *p)
{
	(void)w;
	update_seen = update_seen || (p[1] == 0x85 && p[2] == 0x50 && p[3] == WIRE_POSTEP_WRITE &&
				      p[13] == awaited_update);
}

static bool is_passed_on(struct world *w)
{
	(void)w;
	return update_seen;
}

static void wish_modes(uint32_t generation, uint8_t step, uint8_t limit)
{
	struct pokeys_wish wish = { .session = 5, .generation = generation };

	wish.settings.axis[1].set = step ? POKEYS_AXIS_SET_POSTEP_STEP : 0;
	wish.settings.axis[1].set |= limit ? POKEYS_AXIS_SET_POSTEP_TEMPERATURE : 0;
	wish.settings.axis[1].postep_step = step;
	wish.settings.axis[1].postep_temperature = limit;
	device_wish(world.device, &wish);
}

static void await_update(uint8_t update)
{
	world.watch = look_for_update;
	awaited_update = update;
	update_seen = false;
	world.command.flags &= ~(uint32_t)POKEYS_COMMAND_MACHINE_ON;
	world_until(&world, is_passed_on, 5 * SECOND);
}

static bool is_permitted(struct world *w)
{
	return w->state.flags & POKEYS_STATE_MACHINE_ON;
}

static bool has_limit(struct world *w)
{
	return w->rig.device.bench.postep[1].limit == LIMIT &&
	       w->state.config_state == POKEYS_CONFIG_APPLIED;
}

/* With or without a driver that answers: the limit waits, the axis moves. */
static void motion_begins_in_each_step_of_a_temperature_limit(void **state)
{
	static const uint8_t updates[] = { 0x80 | 7, 0x3F };
	static const uint64_t after[] = { 0, 5 * MS, 50 * MS };

	(void)state;
	for (unsigned int i = 0; i < 12; i++) {
		begin(NULL);
		world_go(&world, 0, 1000, 0);
		world_run(&world, 100 * MS);
		wish_modes(1, 0, LIMIT);
		await_update(updates[i % 2]);
		world.rig.device.bench.postep[1].powered = i < 6;
		world_run(&world, after[i / 2 % 3]);
		world.command.flags |= POKEYS_COMMAND_MACHINE_ON;
		world_until(&world, world_is_machine_on, 200 * MS);
		world_run(&world, SECOND);
		assert_int_equal(world_pulses(&world, 0), 1000);
		assert_int_equal(world.event_count[EVENT_STEP_MODE], 0);
		world.rig.device.bench.postep[1].powered = 1;
		world.command.flags &= ~(uint32_t)POKEYS_COMMAND_MACHINE_ON;
		world_until(&world, has_limit, 20 * SECOND);
	}
}

/* A driver that is in between two step modes is not moved, and the log says why. */
static void motion_is_refused_in_each_step_of_a_step_mode(void **state)
{
	static const uint8_t updates[] = { 0x80 | 6, 0x80 | 7, 0x3F };
	static const uint64_t after[] = { 0, 5 * MS, 50 * MS };
	char line[256];

	(void)state;
	for (unsigned int i = 0; i < 9; i++) {
		begin(NULL);
		world_go(&world, 0, 1000, 0);
		world_run(&world, 100 * MS);
		wish_modes(1, 8, LIMIT);
		await_update(updates[i % 3]);
		world_run(&world, after[i / 3]);
		world.command.flags |= POKEYS_COMMAND_MACHINE_ON;
		world_run(&world, 100 * MS);
		assert_false(is_permitted(&world));
		assert_int_equal(world.event_count[EVENT_STEP_MODE], 1);
		event_format(&world.last_event[EVENT_STEP_MODE], "mill", line, sizeof(line));
		assert_string_equal(line,
				    "mill: motion is not permitted: the PoStep driver of "
				    "axis 1 has step mode 1/16, but 1/256 is configured; wait "
				    "until it is set up (check its power and that setting), then "
				    "switch the machine on again");
		world_until(&world, is_applied, 10 * SECOND);
		assert_int_equal(world_pulses(&world, 0), 0);
		world_machine_on(&world);
		world_run(&world, SECOND);
		assert_int_equal(world_pulses(&world, 0), 1000);
		assert_int_equal(world.event_count[EVENT_STEP_MODE], 1);
	}
}

/* It is on its way to the driver, and nobody wants it any more: no mode is called wanted. */
static void a_step_mode_whose_wish_was_withdrawn_is_not_called_wanted(void **state)
{
	char line[256];

	(void)state;
	world_go(&world, 0, 1000, 0);
	world_run(&world, 100 * MS);
	wish_modes(1, 8, 0);
	await_update(0x80 | 6);
	wish_modes(2, 0, 0);
	world.command.flags |= POKEYS_COMMAND_MACHINE_ON;
	world_run(&world, 20 * MS);
	assert_false(is_permitted(&world));
	assert_int_equal(world.event_count[EVENT_STEP_MODE], 1);
	event_format(&world.last_event[EVENT_STEP_MODE], "mill", line, sizeof(line));
	assert_string_equal(line,
			    "mill: motion is not permitted: the PoStep driver of axis 1 is "
			    "still switching to a step mode that is no longer configured; wait "
			    "until it has switched, then switch the machine on again");
	world_run(&world, 5 * SECOND);
	assert_int_equal(world.state.config_state, POKEYS_CONFIG_APPLIED);
	world_machine_on(&world);
	world_run(&world, SECOND);
	assert_int_equal(world_pulses(&world, 0), 1000);
	assert_int_equal(world.event_count[EVENT_STEP_MODE], 1);
}

static bool is_not_permitted(struct world *w)
{
	return !is_permitted(w);
}

/* It was switched off and on and has what its own memory has: full steps. */
static void a_driver_that_forgot_its_step_mode_takes_the_permission_away(void **state)
{
	char line[256];

	(void)state;
	world_go(&world, 0, 0, 0);
	world_machine_on(&world);
	world.rig.device.bench.postep[0].step = 0;
	world.rig.device.bench.postep[0].limit = 85;
	world_until(&world, is_not_permitted, 10 * SECOND);
	assert_int_equal(world.event_count[EVENT_STEP_MODE], 1);
	event_format(&world.last_event[EVENT_STEP_MODE], "mill", line, sizeof(line));
	assert_string_equal(line,
			    "mill: motion is not permitted: the PoStep driver of axis 0 has "
			    "step mode 1/1, but 1/32 is configured; wait until it is set up (check "
			    "its power and that setting), then switch the machine on again");
	world_until(&world, has_step_again, 5 * SECOND);
	world_until(&world, is_applied_again, 5 * SECOND);
	assert_int_equal(world.event_count[EVENT_CONFIG_REFUSED], 0);
	world_machine_on(&world);
}

static void a_driver_that_forgot_its_limit_is_set_up_again_when_nothing_moves(void **state)
{
	(void)state;
	world_go(&world, 0, 0, 0);
	world_machine_on(&world);
	world.rig.device.bench.postep[0].limit = 85;
	world_until(&world, waits_for_the_machine, 10 * SECOND);
	world_run(&world, SECOND);
	assert_true(is_permitted(&world));
	assert_int_equal(world.rig.device.bench.postep[0].limit, 85);
	world.command.flags &= ~(uint32_t)POKEYS_COMMAND_MACHINE_ON;
	world_until(&world, has_step_again, 5 * SECOND);
	world_until(&world, is_applied_again, 5 * SECOND);
}

static bool is_being_applied(struct world *w)
{
	return w->state.config_state == POKEYS_CONFIG_APPLYING;
}

static bool is_refused_while_running(struct world *w)
{
	return w->state.config_state == POKEYS_CONFIG_REFUSED;
}

/* It forgot, and then its power went: set up when that is there again, and not before. */
static void a_driver_that_is_silent_is_tried_again_when_it_talks(void **state)
{
	struct sim_postep *driver = &world.rig.device.bench.postep[0];
	char line[256];

	(void)state;
	world_go(&world, 0, 1000, 0);
	world_run(&world, 100 * MS);
	driver->step = 0;
	world_until(&world, is_being_applied, 10 * SECOND);
	driver->powered = 0;
	world_until(&world, is_refused_while_running, 10 * SECOND);
	world_run(&world, 10 * SECOND);
	assert_int_equal(world.event_count[EVENT_CONFIG_REFUSED], 1);
	world.command.flags |= POKEYS_COMMAND_MACHINE_ON;
	world_run(&world, 500 * MS);
	assert_false(is_permitted(&world));
	event_format(&world.last_event[EVENT_STEP_MODE], "mill", line, sizeof(line));
	assert_string_equal(line,
			    "mill: motion is not permitted: the PoStep driver of axis 0 does "
			    "not report its step mode, but 1/32 is configured; wait until it is "
			    "set up (check its power and that setting), then switch the machine on "
			    "again");
	driver->step = 0;
	driver->powered = 1;
	world_until(&world, has_step_again, 20 * SECOND);
	world_until(&world, is_applied_again, 10 * SECOND);
	world_machine_on(&world);
	world_run(&world, SECOND);
	assert_int_equal(world_pulses(&world, 0), 1000);
}

/* Nothing is to be written, but nobody has heard it of the driver yet. */
static void a_wish_for_what_the_driver_has_permits_motion(void **state)
{
	(void)state;
	world_go(&world, 1, 1000, 0);
	wish_modes(1, 4, 0);
	world_run(&world, SECOND);
	assert_int_equal(world.state.config_state, POKEYS_CONFIG_APPLIED);
	world_machine_on(&world);
	world_run(&world, SECOND);
	assert_int_equal(world_pulses(&world, 1), 1000);
	assert_int_equal(world.event_count[EVENT_STEP_MODE], 0);
}

static void look_at_the_drivers(struct world *w, const uint8_t *p)
{
	static uint8_t steps[2];
	static bool ran;
	const bool runs = world_engine_state(w) == SIM_PE_RUNNING;

	(void)p;
	for (unsigned int i = 0; i < 2; i++) {
		const uint8_t step = w->rig.device.bench.postep[i].step;

		if (ran && runs)
			assert_int_equal(step, steps[i]);
		steps[i] = step;
	}
	ran = runs;
}

/* Wishes and machine-on at any time, packets are lost: no step mode changes under way. */
static void no_step_mode_changes_while_the_engine_runs(void **state)
{
	static const struct sim_link_faults faults = {
		.delay = { SIM_DELAY_UNIFORM, 25 * US, 500 * US, 0 },
		.loss = 0.1,
	};
	unsigned int permitted = 0;

	(void)state;
	srand((unsigned int)world_seed());
	for (unsigned int round = 0; round < 200 / WORLD_STRIDE; round++) {
		if (round % 20 == 0) {
			begin(NULL);
			world_faults(&world, &faults);
			world.watch = look_at_the_drivers;
			world_go(&world, 0, 1000, 0);
			world_go(&world, 1, 1000, 0);
		}
		wish_modes(round + 1, (uint8_t)(rand() % 9), (uint8_t)(rand() % 3 ? LIMIT : 80));
		world_run(&world, (uint64_t)(rand() % 800) * MS);
		world.command.flags |= POKEYS_COMMAND_MACHINE_ON;
		world_run(&world, (uint64_t)(rand() % 400) * MS);
		permitted += is_permitted(&world);
		if (rand() % 4)
			world.command.flags &= ~(uint32_t)POKEYS_COMMAND_MACHINE_ON;
		world_run(&world, (uint64_t)(rand() % 50) * MS);
	}
	assert_in_range(permitted, 200 / WORLD_STRIDE / 20, 200 / WORLD_STRIDE);
}

/* The lock is named, and not the driver's power. */
static void a_locked_device_is_called_locked(void **state)
{
	struct pokeys_wish wish = { .session = 5, .generation = 1 };
	char line[256];

	(void)state;
	world.rig.device.config.identity.locked = 1;
	world_run(&world, 20 * SECOND);
	assert_true(world.state.identity.locked);
	wish.settings.axis[1].set = POKEYS_AXIS_SET_POSTEP_TEMPERATURE;
	wish.settings.axis[1].postep_temperature = LIMIT;
	device_wish(world.device, &wish);
	world_run(&world, 5 * SECOND);
	event_format(&world.last_event[EVENT_CONFIG_REFUSED], "mill", line, sizeof(line));
	assert_string_equal(line, "mill: PoStep driver of axis 1 was refused by the device: its "
				  "configuration is locked; unlock it or remove that setting");
	assert_int_equal(world.event_count[EVENT_CONFIG_REFUSED], 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(motion_begins_in_each_step_of_a_temperature_limit),
		cmocka_unit_test(motion_is_refused_in_each_step_of_a_step_mode),
		cmocka_unit_test_setup(a_step_mode_whose_wish_was_withdrawn_is_not_called_wanted,
				       begin),
		cmocka_unit_test_setup(a_driver_that_forgot_its_step_mode_takes_the_permission_away,
				       begin),
		cmocka_unit_test_setup(
			a_driver_that_forgot_its_limit_is_set_up_again_when_nothing_moves, begin),
		cmocka_unit_test_setup(a_driver_that_is_silent_is_tried_again_when_it_talks, begin),
		cmocka_unit_test_setup(a_wish_for_what_the_driver_has_permits_motion, begin),
		cmocka_unit_test(no_step_mode_changes_while_the_engine_runs),
		cmocka_unit_test_setup(a_locked_device_is_called_locked, begin),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
