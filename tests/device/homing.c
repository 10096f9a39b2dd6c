/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Homing by the device: alone and in groups, finished by the commander or by
 * itself, cancelled, tripped, out of time. Afterwards no axis jumps. What
 * happens at any lost packet is in abort.c.
 */

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/packet.h"
#include "wire/pulse.h"

#define HOME_AT (-500)

static struct world world;

static void wire_limit(unsigned int axis, int32_t from, int32_t to)
{
	const struct sim_switch limit = {
		.wired = true, .pin = SIM_DEDICATED, .from = from, .to = to,
	};

	sim_bench_switch(&world.rig.device, &world.rig.device.bench.machine.axis[axis].minus,
			 &limit);
}

static void set_up(uint8_t options, uint8_t switches)
{
	const struct sim_switch home = {
		.wired = true, .pin = SIM_DEDICATED, .from = INT32_MIN, .to = HOME_AT,
	};

	world_init(&world, NULL);
	world_axes(&world);
	for (unsigned int i = 0; i < 3; i++) {
		struct pokeys_axis_settings *axis = &world.config.settings.axis[i];

		axis->options |= options;
		axis->options_mask |= options;
		axis->switches = axis->switches_mask = WIRE_SWITCH_HOME | switches;
		axis->set |= POKEYS_AXIS_SET_HOMING_SPEED | POKEYS_AXIS_SET_HOMING_RETURN;
		axis->homing_speed = axis->homing_return = 50;
		sim_bench_switch(&world.rig.device, &world.rig.device.bench.machine.axis[i].home,
				 &home);
		wire_limit(i, INT32_MIN, HOME_AT - 2000);
	}
	world_start(&world);
	world_commander(&world, 5);
	world_until(&world, world_is_running, 500 * MS);
	for (unsigned int i = 0; i < 3; i++)
		world_go(&world, i, 0, 0);
	world_machine_on(&world);
}

static int begin(void **state)
{
	(void)state;
	set_up(0, 0);
	return 0;
}

static struct pokeys_one_shot home(uint8_t mask, uint8_t flags)
{
	return (struct pokeys_one_shot){
		.operation = POKEYS_ONE_SHOT_HOME, .mask = mask, .flags = flags,
		.value = { 100, 200, 300 },
	};
}

static enum pokeys_outcome act(uint8_t operation)
{
	const struct pokeys_one_shot shot = { .operation = operation };

	return world_do(&world, &shot, 20 * SECOND);
}

static bool is_idle(struct world *w)
{
	return w->state.engine.task_phase == POKEYS_TASK_IDLE;
}

static bool is_working(struct world *w)
{
	return w->state.engine.task_phase == POKEYS_TASK_WORKING;
}

static void start(uint8_t mask)
{
	const struct pokeys_one_shot shot = home(mask, POKEYS_HOME_FINISH_ITSELF);

	world_one_shot(&world, &shot);
	world_until(&world, is_working, 200 * MS);
}

static void axis_is_homed_and_the_others_stay(void **state)
{
	const struct pokeys_one_shot shot = home(1, POKEYS_HOME_FINISH_ITSELF);

	(void)state;
	assert_int_equal(world_do(&world, &shot, 2 * SECOND), POKEYS_OUTCOME_DONE);
	world_until(&world, is_idle, 500 * MS);
	assert_int_equal(world.state.engine.task, POKEYS_TASK_HOMING);
	assert_int_equal(world.state.engine.task_result, POKEYS_TASK_DONE);
	assert_int_equal(world.state.engine.task_axes, 1);
	assert_int_equal(world.state.engine.task_count, 1);
	assert_int_equal(world.state.engine.axis[0].homed, 1);
	assert_int_equal(world.state.engine.axis[1].homed, 0);
	assert_in_range(world_pulses(&world, 0), 100, 160);
	assert_int_equal(world_pulses(&world, 1), 0);
	assert_int_equal(world.event_count[EVENT_TASK], 1);
}

static bool is_complete(struct world *w)
{
	return w->state.engine.task_phase == POKEYS_TASK_COMPLETE;
}

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

static void set_elsewhere(uint8_t mask, int32_t position)
{
	struct wire_pulse_positions_req set = { .mask = mask };
	uint8_t request[WIRE_PK], reply[WIRE_PK];

	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		set.position[i] = position;
	wire_encode_req(WIRE_OP_PULSE_POSITIONS, request, &set);
	wire_finish(request, 1);
	sim_rig_run(&world.rig, world.now);
	assert_int_equal(sim_device_request(&world.rig.device, world.now, request, sizeof(request),
					    reply), sizeof(reply));
}

/* It is homed, and waits for whoever asked for it. */
static void a_count_set_elsewhere_after_it_is_a_loss(void **state)
{
	const struct pokeys_one_shot shot = home(1, 0);

	(void)state;
	world_one_shot(&world, &shot);
	world_until(&world, is_complete, 2 * SECOND);
	assert_false(is_even(0));
	set_elsewhere(1, 70000);
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
	set_elsewhere(7, 70000);
	world_run(&world, 500 * MS);
	for (unsigned int i = 0; i < 3; i++) {
		assert_int_equal(world.state.engine.axis[i].position_epoch, 2);
		assert_int_equal(world.state.engine.axis[i].homed, 0);
	}
}

/* Whatever of it was done by then: the count is that of the restart. */
static void a_restart_after_homing_is_no_homing(void **state)
{
	static const unsigned int boot_ms[] = { 0, 15, 100 };

	for (size_t i = 0; i < sizeof(boot_ms) / sizeof(boot_ms[0]); i++) {
		const struct pokeys_one_shot shot = home(1, 0);
		uint8_t before;

		begin(state);
		before = world.state.engine.axis[0].position_epoch;
		world_one_shot(&world, &shot);
		world_until(&world, is_complete, 2 * SECOND);
		world.rig.device.options.boot_ms = boot_ms[i];
		sim_rig_reboot(&world.rig, world.now, false);
		for (unsigned int ms = 0; ms < 3000; ms++) {
			const bool even = is_even(0);

			world_cycle(&world);
			assert_true(is_even(0) || !even);
		}
		assert_true(is_even(0));
		assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
		assert_int_not_equal(world.state.engine.axis[0].position_epoch, before);
		assert_int_equal(world.state.engine.axis[0].homed, 0);
	}
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

/* "config apply" while the machine is on, and nothing is different. */
static void settings_that_are_read_again_leave_it_homed(void **state)
{
	const struct pokeys_one_shot shot = home(1, POKEYS_HOME_FINISH_ITSELF);
	struct sim_device *sim = &world.rig.device;

	(void)state;
	assert_int_equal(world_do(&world, &shot, 2 * SECOND), POKEYS_OUTCOME_DONE);
	world_until(&world, is_idle, 500 * MS);
	world_go(&world, 0, 500, 0);
	world_machine_on(&world);
	world_run(&world, 500 * MS);
	assert_int_equal(device_order(world.device, DEVICE_ORDER_APPLY), 0);
	for (unsigned int i = 0; i < 1000; i++) {
		world_cycle(&world);
		assert_int_equal(world.state.engine.axis[0].homed, 1);
	}
	/* somebody else has turned its direction */
	sim->config.engine.axis[0][0] ^= WIRE_AXIS_INVERTED;
	assert_int_equal(device_order(world.device, DEVICE_ORDER_APPLY), 0);
	world_run(&world, 1 * SECOND);
	assert_int_equal(world.state.engine.axis[0].homed, 0);
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

/* Its place among the results is another's for a while, and a phase says that it goes on. */
static void how_it_ended_is_told_though_many_others_ended_before(void **state)
{
	const uint32_t id = world.command.one_shot_head;

	(void)state;
	start(1);
	for (unsigned int i = 0; i < POKEYS_ONE_SHOT_RESULTS; i++)
		assert_int_equal(act(POKEYS_ONE_SHOT_NOP), POKEYS_OUTCOME_DONE);
	assert_int_equal(world.state.one_shot[id % POKEYS_ONE_SHOT_RESULTS].id,
			 id + POKEYS_ONE_SHOT_RESULTS);
	while (world_outcome(&world, id) == POKEYS_OUTCOME_NONE) {
		assert_int_not_equal(world.state.engine.task_phase, POKEYS_TASK_IDLE);
		world_cycle(&world);
	}
	assert_int_equal(world_outcome(&world, id), POKEYS_OUTCOME_DONE);
}

/* The commander still points to where the axis was in the old coordinates. */
static void homed_axis_does_not_jump_back(void **state)
{
	int64_t homed;

	(void)state;
	start(1);
	world_until(&world, is_idle, 2 * SECOND);
	homed = world_pulses(&world, 0);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), homed);
	assert_int_equal(world.state.engine.axis[0].parked, 1);
	assert_int_equal(world.state.engine.axis[1].enabled, 1);
	world_go(&world, 0, (int32_t)homed, 0);
	world_run(&world, 20 * MS);
	assert_int_equal(world.state.engine.axis[0].parked, 0);
	world_go(&world, 0, 2000, 0);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), 2000);
}

static void homed_axis_follows_after_its_enable_was_low(void **state)
{
	(void)state;
	start(1);
	world_until(&world, is_idle, 2 * SECOND);
	world_go(&world, 0, 1000, 0);
	world_run(&world, 100 * MS);
	assert_true(world_pulses(&world, 0) < 200);
	world.command.axis[0].enable = 0;
	world_run(&world, 3 * MS);
	world.command.axis[0].enable = 1;
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), 1000);
}

static void group_is_homed_when_all_of_it_is(void **state)
{
	const struct pokeys_one_shot shot = home(5, POKEYS_HOME_FINISH_ITSELF);

	(void)state;
	world_go(&world, 2, 3000, 0);
	world_run(&world, 500 * MS);
	assert_int_equal(world_do(&world, &shot, 3 * SECOND), POKEYS_OUTCOME_DONE);
	assert_int_equal(world.state.engine.axis[0].homed, 1);
	assert_int_equal(world.state.engine.axis[2].homed, 1);
	assert_int_equal(world.state.engine.axis[1].homed, 0);
	assert_int_equal(world.sent.pulse[0x21], 1);
}

static void half_a_group_is_not_homed(void **state)
{
	(void)state;
	world_go(&world, 2, 5000, 0);
	world_run(&world, 800 * MS);
	start(5);
	while (world.state.engine.axis[0].state != WIRE_AXIS_HOME)
		world_cycle(&world);
	assert_int_equal(act(POKEYS_ONE_SHOT_HOME_CANCEL), POKEYS_OUTCOME_DONE);
	assert_int_equal(world.state.engine.task_result, POKEYS_TASK_CANCELLED);
	assert_int_equal(world.state.engine.axis[0].homed, 0);
	assert_int_equal(world.state.engine.axis[2].homed, 0);
	assert_int_equal(world_outcome(&world, 0), POKEYS_OUTCOME_FAILED);
	/* that one counts from its home, which is none of the group's */
	world_run(&world, 100 * MS);
	assert_int_equal(world.state.engine.axis[0].position_epoch, 2);
}

static int begin_with_limits(void **state)
{
	(void)state;
	set_up(0, WIRE_SWITCH_LIMIT_N);
	return 0;
}

static void limit_of_one_stops_the_group(void **state)
{
	int64_t stopped[2];

	(void)state;
	wire_limit(2, INT32_MIN, -100);
	start(5);
	world_until(&world, is_idle, 2 * SECOND);
	assert_int_equal(world.state.engine.task_result, POKEYS_TASK_TRIPPED);
	assert_int_equal(world_outcome(&world, 0), POKEYS_OUTCOME_FAILED);
	assert_int_equal(world.state.engine.axis[0].homed | world.state.engine.axis[2].homed, 0);
	stopped[0] = world_pulses(&world, 0);
	stopped[1] = world_pulses(&world, 2);
	assert_true(llabs(stopped[0] - stopped[1]) <= 1);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), stopped[0]);
	assert_int_equal(world_pulses(&world, 2), stopped[1]);
}

/* It stands on its limit switch, beyond home: the override lets it home off there. */
static void group_is_homed_off_a_limit_switch(void **state)
{
	const struct pokeys_one_shot shot = home(5, POKEYS_HOME_FINISH_ITSELF);

	(void)state;
	world.command.flags |= POKEYS_COMMAND_LIMIT_OVERRIDE;
	world_run(&world, 50 * MS);
	wire_limit(2, -300, 300);
	assert_int_equal(world_do(&world, &shot, 3 * SECOND), POKEYS_OUTCOME_DONE);
	assert_int_equal(world.state.engine.axis[0].homed & world.state.engine.axis[2].homed, 1);
	world.command.flags &= ~(uint32_t)POKEYS_COMMAND_LIMIT_OVERRIDE;
	world_run(&world, 500 * MS);
	assert_int_equal(world.rig.device.engine.override, 0);
}

static void commander_may_finish_it(void **state)
{
	const struct pokeys_one_shot shot = home(1, 0);

	(void)state;
	assert_int_equal(act(POKEYS_ONE_SHOT_HOME_FINISH), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(world_do(&world, &shot, 2 * SECOND), POKEYS_OUTCOME_DONE);
	world_run(&world, 1 * SECOND);
	assert_int_equal(world.state.engine.task_phase, POKEYS_TASK_COMPLETE);
	assert_int_equal(world.state.engine.axis[0].state, WIRE_AXIS_HOME);
	assert_int_equal(act(POKEYS_ONE_SHOT_HOME_FINISH), POKEYS_OUTCOME_DONE);
	assert_true(is_idle(&world));
	assert_int_equal(world.sent.pulse[0x22], 1);
	assert_int_equal(act(POKEYS_ONE_SHOT_HOME_FINISH), POKEYS_OUTCOME_DONE);
}

static void homing_that_nobody_finishes_finishes_itself(void **state)
{
	const struct pokeys_one_shot shot = home(1, 0);

	(void)state;
	assert_int_equal(world_do(&world, &shot, 2 * SECOND), POKEYS_OUTCOME_DONE);
	world_until(&world, is_idle, 12 * SECOND);
	assert_int_equal(world.state.engine.task_result, POKEYS_TASK_DONE);
}

/* What homing configurations of LinuxCNC do after it. */
static void position_may_be_set_after_it(void **state)
{
	const struct pokeys_one_shot set = {
		.operation = POKEYS_ONE_SHOT_SET_POSITION, .mask = 1, .value = { 4000 },
	};

	(void)state;
	start(1);
	world_until(&world, is_idle, 2 * SECOND);
	assert_int_equal(world_do(&world, &set, 500 * MS), POKEYS_OUTCOME_DONE);
	assert_int_equal(world_pulses(&world, 0), 4000);
}

static void cancelled_homing_stands(void **state)
{
	int64_t stopped;

	(void)state;
	start(1);
	world_run(&world, 20 * MS);
	assert_int_equal(act(POKEYS_ONE_SHOT_HOME_CANCEL), POKEYS_OUTCOME_DONE);
	assert_true(world.state.flags & POKEYS_STATE_MACHINE_ON);
	stopped = world_pulses(&world, 0);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), stopped);
	assert_int_equal(world.state.engine.task_result, POKEYS_TASK_CANCELLED);
}

static void trip_ends_it_and_is_left_alone(void **state)
{
	(void)state;
	start(1);
	sim_bench_emergency(&world.rig.device, true);
	world_until(&world, is_idle, 100 * MS);
	assert_int_equal(world.state.engine.task_result, POKEYS_TASK_TRIPPED);
	assert_int_equal(world_outcome(&world, 0), POKEYS_OUTCOME_FAILED);
	world_run(&world, 500 * MS);
	assert_int_equal(world_engine_state(&world), SIM_PE_STOP_EMERGENCY);
	assert_false(world.state.flags & POKEYS_STATE_MACHINE_ON);
}

/* The switch is broken. */
static void time_limit_ends_it(void **state)
{
	struct pokeys_one_shot shot = home(1, 0);

	(void)state;
	shot.parameter[0] = 0.5f;
	world.rig.device.bench.machine.axis[0].home.wired = false;
	sim_machine_rewired(&world.rig.device.bench.machine);
	world.rig.device.bench.machine.raw_home = 0;
	assert_int_equal(world_do(&world, &shot, 2 * SECOND), POKEYS_OUTCOME_FAILED);
	assert_int_equal(world.state.engine.task_result, POKEYS_TASK_TIMED_OUT);
	assert_int_equal(world_engine_state(&world), SIM_PE_STOPPED);
}

static void link_that_is_lost_ends_it_and_nothing_is_replayed(void **state)
{
	int64_t stopped;

	(void)state;
	world.rig.device.bench.machine.axis[0].home.wired = false;
	start(1);
	sim_rig_silence(&world.rig, world.now, 400 * MS);
	world_until(&world, world_is_lost, 400 * MS);
	assert_int_equal(world.state.engine.task_result, POKEYS_TASK_LOST);
	assert_int_equal(world_outcome(&world, 0), POKEYS_OUTCOME_UNKNOWN);
	world_until(&world, world_is_running, 1 * SECOND);
	world_run(&world, 300 * MS);
	assert_int_equal(world_engine_state(&world), SIM_PE_STOPPED);
	stopped = world_pulses(&world, 0);
	world_run(&world, 1 * SECOND);
	assert_int_equal(world_pulses(&world, 0), stopped);
}

static void outputs_that_are_enabled_one_by_one_are_on_while_homing(void **state)
{
	(void)state;
	set_up(WIRE_AXIS_ENABLED_MASKED, 0);
	world.command.axis[0].enable = 0;
	world_run(&world, 50 * MS);
	assert_false(sim_axis_powered(&world.rig.device, 0));
	start(1);
	assert_true(sim_axis_powered(&world.rig.device, 0));
	world_until(&world, is_idle, 2 * SECOND);
	assert_int_equal(world.state.engine.task_result, POKEYS_TASK_DONE);
	world_run(&world, 50 * MS);
	assert_false(sim_axis_powered(&world.rig.device, 0));
}

static void what_is_not_valid_is_refused(void **state)
{
	const float bad[] = { NAN, INFINITY, -1, 4000 };
	struct pokeys_one_shot shot = home(0, 0);

	(void)state;
	assert_int_equal(world_do(&world, &shot, 100 * MS), POKEYS_OUTCOME_REFUSED);
	shot.mask = 0x11;	/* axis 4 is not set up */
	assert_int_equal(world_do(&world, &shot, 100 * MS), POKEYS_OUTCOME_REFUSED);
	shot = home(1, 0);
	for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
		shot.parameter[0] = bad[i];
		assert_int_equal(world_do(&world, &shot, 100 * MS), POKEYS_OUTCOME_REFUSED);
	}
	shot = home(1, 0);
	shot.value[0] = 1 << 25;
	assert_int_equal(world_do(&world, &shot, 100 * MS), POKEYS_OUTCOME_REFUSED);
	start(2);
	shot = home(1, 0);	/* one at a time */
	assert_int_equal(world_do(&world, &shot, 100 * MS), POKEYS_OUTCOME_REFUSED);
	world.command.flags = 0;
	world_run(&world, 200 * MS);
	assert_int_equal(world_do(&world, &shot, 100 * MS), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(world.sent.pulse[0x21], 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(axis_is_homed_and_the_others_stay, begin),
		cmocka_unit_test_setup(the_count_is_told_by_homing, begin),
		cmocka_unit_test_setup(homed_comes_with_its_count, begin),
		cmocka_unit_test_setup(a_count_set_elsewhere_after_it_is_a_loss, begin),
		cmocka_unit_test_setup(counts_set_elsewhere_while_one_is_homed_are_lost_all, begin),
		cmocka_unit_test(a_restart_after_homing_is_no_homing),
		cmocka_unit_test_setup(a_homing_that_ends_after_the_edge_has_lost_the_count, begin),
		cmocka_unit_test_setup(how_it_ended_is_told_though_many_others_ended_before, begin),
		cmocka_unit_test_setup(settings_that_are_read_again_leave_it_homed, begin),
		cmocka_unit_test_setup(a_restart_of_the_device_ends_it, begin),
		cmocka_unit_test_setup(homed_axis_does_not_jump_back, begin),
		cmocka_unit_test_setup(homed_axis_follows_after_its_enable_was_low, begin),
		cmocka_unit_test_setup(group_is_homed_when_all_of_it_is, begin),
		cmocka_unit_test_setup(half_a_group_is_not_homed, begin),
		cmocka_unit_test_setup(limit_of_one_stops_the_group, begin_with_limits),
		cmocka_unit_test_setup(group_is_homed_off_a_limit_switch, begin_with_limits),
		cmocka_unit_test_setup(commander_may_finish_it, begin),
		cmocka_unit_test_setup(homing_that_nobody_finishes_finishes_itself, begin),
		cmocka_unit_test_setup(position_may_be_set_after_it, begin),
		cmocka_unit_test_setup(cancelled_homing_stands, begin),
		cmocka_unit_test_setup(trip_ends_it_and_is_left_alone, begin),
		cmocka_unit_test_setup(time_limit_ends_it, begin),
		cmocka_unit_test_setup(link_that_is_lost_ends_it_and_nothing_is_replayed, begin),
		cmocka_unit_test(outputs_that_are_enabled_one_by_one_are_on_while_homing),
		cmocka_unit_test_setup(what_is_not_valid_is_refused, begin),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
