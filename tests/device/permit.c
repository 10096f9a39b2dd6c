/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The permission to move: only a fresh edge of machine-on, seen while all was well, gives
 * it (invariant I7), and whatever goes wrong takes it; a trip is left alone until it is
 * cleared.
 */

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/pulse.h"

enum { EMERGENCY = 52 }; /* terminal of the board's button */

static struct world world;

static int begin(void **state)
{
	(void)state;
	world_up(&world, NULL);
	return 0;
}

static int begin_moving(void **state)
{
	(void)state;
	world_moving(&world, NULL);
	return 0;
}

static void nothing_moves_before_the_edge(void **state)
{
	(void)state;
	world_go(&world, 0, 5000, 0);
	world_run(&world, 200 * MS);
	assert_int_equal(world_pulses(&world, 0), 0);
	assert_int_equal(world_engine_state(&world), SIM_PE_STOPPED);
	assert_int_equal(world.sent.pulse[0x25], 0);
}

static void machine_on_from_the_beginning_is_no_edge(void **state)
{
	begin(state);
	world_start(&world);
	world.command.flags = POKEYS_COMMAND_MACHINE_ON;
	world_go(&world, 0, 5000, 0);
	world_until(&world, world_is_running, 500 * MS);
	world_run(&world, 200 * MS);
	assert_false(world.state.flags & POKEYS_STATE_MACHINE_ON);
	assert_true(world.state.flags & POKEYS_STATE_NEEDS_EDGE);
	assert_int_equal(world_pulses(&world, 0), 0);
	world_machine_on(&world);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), 5000);
}

static void machine_off_stops_and_holds(void **state)
{
	int64_t stopped;

	(void)state;
	world_go(&world, 0, 100000, 0);
	world_run(&world, 500 * MS);
	world.command.flags = 0;
	world_run(&world, 300 * MS);
	assert_int_equal(world_engine_state(&world), SIM_PE_STOPPED);
	stopped = world_pulses(&world, 0);
	assert_in_range(stopped, 1000, 90000);
	/* on again: from here, not to where it was going before */
	world_go(&world, 0, (int32_t)stopped, 0);
	world_machine_on(&world);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), stopped);
}

static void no_motion_is_replayed_after_a_reconnect(void **state)
{
	int64_t stopped;

	(void)state;
	world_go(&world, 0, 100000, 0);
	world_run(&world, 200 * MS);
	sim_rig_silence(&world.rig, world.now, 400 * MS);
	world_until(&world, world_is_lost, 400 * MS);
	world_until(&world, world_is_running, 1 * SECOND);
	world_run(&world, 300 * MS);
	assert_int_equal(world_engine_state(&world), SIM_PE_STOPPED);
	stopped = world_pulses(&world, 0);
	assert_in_range(stopped, 1000, 99000);
	assert_true(world.state.flags & POKEYS_STATE_NEEDS_EDGE);
	world_run(&world, 2 * SECOND);
	assert_int_equal(world_pulses(&world, 0), stopped);
	world_machine_on(&world);
	world_run(&world, 8 * SECOND);
	assert_int_equal(world_pulses(&world, 0), 100000);
}

static void dead_commander_stops_the_axes(void **state)
{
	int64_t stopped;

	(void)state;
	world_go(&world, 0, 100000, 0);
	world_run(&world, 200 * MS);
	world.commanding = false;
	world_until(&world, world_is_safe, 400 * MS);
	assert_int_equal(world_engine_state(&world), SIM_PE_STOPPED);
	stopped = world_pulses(&world, 0);
	world.commanding = true;
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), stopped);
	assert_true(world.state.flags & POKEYS_STATE_NEEDS_EDGE);
}

static void new_commander_needs_an_edge_of_its_own(void **state)
{
	(void)state;
	world_go(&world, 0, 100000, 0);
	world_run(&world, 200 * MS);
	world.command.session = 6;
	world_run(&world, 500 * MS);
	assert_int_equal(world_engine_state(&world), SIM_PE_STOPPED);
	assert_false(world.state.flags & POKEYS_STATE_MACHINE_ON);
}

/* Its heartbeat is not so late as this machine runs long: there was none yet. */
static void new_commander_is_not_called_late(void **state)
{
	const struct event *said = &world.last_event[EVENT_COMMANDER];

	(void)state;
	world_run(&world, 100 * MS);
	assert_int_equal(said->a, 1);
	world.command.session = 6;
	world.commanding = false;
	world_run(&world, 10 * MS);
	assert_int_equal(said->a, 0);
	assert_int_equal(said->b, -1);
}

/* Nothing waits until its heartbeat is late, and nobody is alarmed. */
static void commander_that_ends_is_safe_at_once(void **state)
{
	const struct event *said = &world.last_event[EVENT_COMMANDER];

	(void)state;
	world_go(&world, 0, 100000, 0);
	world_run(&world, 200 * MS);
	assert_true(world.state.flags & POKEYS_STATE_MACHINE_ON);
	world.command.flags |= POKEYS_COMMAND_ENDS;
	world.commanding = false;
	world_run(&world, 3 * MS);
	assert_false(world.state.flags & POKEYS_STATE_MACHINE_ON);
	assert_int_equal(said->a, 0);
	assert_int_equal(said->c, 1);
	assert_int_equal(said->level, EVENT_NOTICE);
	world_run(&world, 200 * MS);
	assert_true(world.state.flags & POKEYS_STATE_SAFE);
	assert_int_equal(world.event_count[EVENT_COMMANDER], 2);
	/* whoever comes next begins as after a loss */
	world.command.flags = POKEYS_COMMAND_MACHINE_ON;
	world.commanding = true;
	for (unsigned int i = 0; i < 2; i++) {
		world_run(&world, 200 * MS);
		assert_int_equal(said->a, 1);
		assert_false(world.state.flags & POKEYS_STATE_MACHINE_ON);
		world.command.session++;
	}
}

static void reboot_within_a_short_silence_does_not_restart_motion(void **state)
{
	(void)state;
	world_run(&world, 1 * SECOND);
	world.rig.device.options.boot_ms = 50;
	sim_device_save(&world.rig.device);
	world_go(&world, 0, 100000, 0);
	world_run(&world, 200 * MS);
	sim_rig_reboot(&world.rig, world.now, false);
	world_run(&world, 3 * SECOND);
	assert_int_equal(world_pulses(&world, 0), 0);
	assert_int_equal(world_engine_state(&world), SIM_PE_STOPPED);
	assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
	assert_false(world.state.flags & POKEYS_STATE_MACHINE_ON);
}

/* Where the references have gone meanwhile nobody followed. */
static void stall_of_the_daemon_takes_the_permission(void **state)
{
	int64_t stopped;

	(void)state;
	world_go(&world, 0, 100, 0);
	world_run(&world, 300 * MS);
	stopped = world_pulses(&world, 0);
	world_stall(&world, 1 * SECOND);
	world_go(&world, 0, 50000, 0);
	world_run(&world, 2 * SECOND);
	assert_int_equal(world_pulses(&world, 0), stopped);
	assert_true(world.state.flags & POKEYS_STATE_NEEDS_EDGE);
}

static enum pokeys_outcome clear_fault(void)
{
	const struct pokeys_one_shot clear = { .operation = POKEYS_ONE_SHOT_CLEAR_FAULT };

	return world_do(&world, &clear, 500 * MS);
}

static void emergency_is_left_alone_until_it_is_cleared(void **state)
{
	(void)state;
	world_go(&world, 0, 100000, 0);
	world_run(&world, 100 * MS);
	sim_bench_emergency(&world.rig.device, true);
	world_run(&world, 20 * MS);
	assert_int_equal(world.state.engine.state, 101);
	assert_int_equal(world.state.engine.emergency, 1);
	assert_int_equal(world.event_count[EVENT_ENGINE], 1);
	assert_false(world.state.flags & POKEYS_STATE_MACHINE_ON);
	sim_bench_emergency(&world.rig.device, false);
	world.sent.pulse[0x02] = 0;
	world_run(&world, 500 * MS);
	world.command.flags = 0;
	world_run(&world, 50 * MS);
	world.command.flags = POKEYS_COMMAND_MACHINE_ON;
	world_run(&world, 500 * MS);
	assert_int_equal(world_engine_state(&world), SIM_PE_STOP_EMERGENCY);
	assert_int_equal(world.sent.pulse[0x02], 0);
	assert_int_equal(clear_fault(), POKEYS_OUTCOME_DONE);
	world_run(&world, 100 * MS);
	assert_int_equal(world_engine_state(&world), SIM_PE_STOPPED);
	world_machine_on(&world);
	world_run(&world, 8 * SECOND);
	assert_int_equal(world_pulses(&world, 0), 100000);
}

/* Pressed while the engine stood: it trips only when it is to run. */
static void start_refused_by_the_emergency_needs_another_edge(void **state)
{
	(void)state;
	world_go(&world, 0, 0, 0);
	sim_bench_emergency(&world.rig.device, true);
	world_run(&world, 50 * MS);
	world.command.flags = POKEYS_COMMAND_MACHINE_ON;
	world_run(&world, 200 * MS);
	assert_int_equal(world_engine_state(&world), SIM_PE_STOP_EMERGENCY);
	assert_true(world.state.flags & POKEYS_STATE_NEEDS_EDGE);
	sim_bench_emergency(&world.rig.device, false);
	assert_int_equal(clear_fault(), POKEYS_OUTCOME_DONE);
	world_run(&world, 500 * MS);
	assert_int_equal(world_engine_state(&world), SIM_PE_STOPPED);
	world_machine_on(&world);
}

/* Another program told the device to stop: it is not started behind its back. */
static void engine_stopped_by_somebody_else_needs_an_edge(void **state)
{
	const struct wire_pulse_state_req stop = { .state = WIRE_ENGINE_STOPPED };
	uint8_t packet[64];

	(void)state;
	world_go(&world, 0, 50000, 0);
	world_run(&world, 100 * MS);
	wire_pulse_state_encode_req(packet, &stop);
	wire_finish(packet, 200);
	sim_rig_send_from(&world.rig, world.now, 77, packet, sizeof(packet));
	world_run(&world, 1 * SECOND);
	assert_int_equal(world_engine_state(&world), SIM_PE_STOPPED);
	assert_true(world.state.flags & POKEYS_STATE_NEEDS_EDGE);
}

static void dead_commander_does_not_clear_a_trip(void **state)
{
	(void)state;
	sim_bench_emergency(&world.rig.device, true);
	world_run(&world, 20 * MS);
	world.commanding = false;
	world_until(&world, world_is_safe, 400 * MS);
	assert_int_equal(world_engine_state(&world), SIM_PE_STOP_EMERGENCY);
}

/* Bad at the edge: the value of before the edge must not be the first reference. */
static void bad_value_at_the_edge_moves_nothing(void **state)
{
	(void)state;
	world_go(&world, 0, 8000, 0);
	world_run(&world, 50 * MS);
	world_go(&world, 0, 8000, INFINITY);
	world.command.flags = POKEYS_COMMAND_MACHINE_ON;
	world_run(&world, 500 * MS);
	assert_true(world.state.flags & POKEYS_STATE_MACHINE_ON);
	assert_int_equal(world_pulses(&world, 0), 0);
	world_go(&world, 0, 20, 0);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), 20);
}

static void first_reference_is_that_of_the_edge(void **state)
{
	(void)state;
	world_go(&world, 0, 8000, 0);
	world_run(&world, 50 * MS);
	world_go(&world, 0, 0, 0);
	world.command.flags = POKEYS_COMMAND_MACHINE_ON;
	world_run(&world, 500 * MS);
	assert_int_equal(world.rig.device.bench.machine.axis[0].steps, 0);
}

static void refused_as_unread(int64_t age_ms)
{
	memset(&world.last_event[EVENT_BAD_COMMAND], 0, sizeof(struct event));
	world_run(&world, 50 * MS); /* low is seen, and acknowledged */
	world_go(&world, 0, 5000, 0);
	world.command.flags = POKEYS_COMMAND_MACHINE_ON;
	world_run(&world, 500 * MS);
	assert_false(world.state.flags & POKEYS_STATE_MACHINE_ON);
	assert_true(world.state.flags & POKEYS_STATE_NEEDS_EDGE);
	assert_int_equal(world.last_event[EVENT_BAD_COMMAND].a, COMMAND_FAULT_UNREAD);
	assert_int_equal(world.last_event[EVENT_BAD_COMMAND].b, age_ms);
	assert_true(world.state.flags & POKEYS_STATE_EDGE_UNREAD);
	assert_int_equal(world_pulses(&world, 0), 0);
}

/* pokeys.N.write without pokeys.N.read: the command is not from where the axes stand. */
static void who_has_not_read_gets_no_permission(void **state)
{
	(void)state;
	world.unread = true;
	world.command.t_thread_ns = 0;
	refused_as_unread(-1);
	/* reading alone is no edge */
	world.unread = false;
	world_run(&world, 500 * MS);
	assert_false(world.state.flags & POKEYS_STATE_MACHINE_ON);
	assert_true(world.state.flags & POKEYS_STATE_EDGE_UNREAD);
	assert_int_equal(world_pulses(&world, 0), 0);
	world_machine_on(&world);
	world_run(&world, 500 * MS);
	assert_false(world.state.flags & POKEYS_STATE_EDGE_UNREAD);
	assert_int_equal(world_pulses(&world, 0), 5000);
}

static void off(void)
{
	world.command.flags = 0;
}

static void emergency_stop(void)
{
	world.command.flags |= POKEYS_COMMAND_EMERGENCY;
}

static void cable_out(void)
{
	world.unplugged = true;
}

static void emergency_switch(void)
{
	world_emergency(&world);
}

/* A commander gives an edge again that was refused as unread: a stop has to end the reason. */
static void a_stop_ends_the_reason_to_repeat_an_edge(void **state)
{
	void (*const stops[])(void) = { off, emergency_stop, cable_out, emergency_switch };

	(void)state;
	for (size_t i = 0; i < sizeof(stops) / sizeof(stops[0]); i++) {
		world_init(&world, NULL);
		world_axes(&world);
		world.rig.device.config.pins.function[EMERGENCY - 1] = WIRE_PIN_INPUT;
		world_start(&world);
		world_commander(&world, 5);
		world_until(&world, world_is_running, 500 * MS);
		world.unread = true;
		world.command.t_thread_ns = 0;
		refused_as_unread(-1);
		stops[i]();
		world_run(&world, 500 * MS);
		assert_false(world.state.flags & POKEYS_STATE_EDGE_UNREAD);
	}
}

static void what_ends_the_permission_is_no_reason_to_repeat_an_edge(void **state)
{
	void (*const stops[])(void) = { off, emergency_stop, cable_out, emergency_switch };

	for (size_t i = 0; i < sizeof(stops) / sizeof(stops[0]); i++) {
		begin(state);
		world_go(&world, 0, 0, 0);
		world_machine_on(&world);
		assert_true(world.state.flags & POKEYS_STATE_MACHINE_ON);
		/* its commander does not look any more */
		world.unread = true;
		world_run(&world, 300 * MS);
		stops[i]();
		for (int k = 0; k < 500; k++) {
			world_cycle(&world);
			assert_false(world.state.flags & POKEYS_STATE_EDGE_UNREAD);
		}
		assert_false(world.state.flags & POKEYS_STATE_MACHINE_ON);
	}
}

static void who_read_long_ago_gets_no_permission(void **state)
{
	(void)state;
	world.command.period_ns = MS;
	world.unread = true;
	world_run(&world, 54 * MS);
	assert_int_equal(world.command.t_ns - world.command.t_thread_ns, 54 * MS);
	refused_as_unread(105);
}

static void who_reads_slowly_is_one_that_reads(void **state)
{
	(void)state;
	world_run(&world, 50 * MS);
	world.command.period_ns = 50 * MS;
	world.unread = true;
	world_run(&world, 200 * MS);
	world.command.flags = POKEYS_COMMAND_MACHINE_ON;
	world_run(&world, 50 * MS);
	assert_true(world.state.flags & POKEYS_STATE_MACHINE_ON);
}

static void a_time_of_reading_ahead_of_the_writing_counts_as_none(void **state)
{
	(void)state;
	world.unread = true;
	world.command.t_thread_ns = UINT64_MAX;
	refused_as_unread(-1);
}

static void an_axis_is_enabled_only_by_one_who_reads(void **state)
{
	(void)state;
	world_go(&world, 0, 0, 0);
	world_machine_on(&world);
	world_run(&world, 100 * MS);
	world.unread = true;
	world_run(&world, 200 * MS);
	world_go(&world, 1, 5000, 0);
	world_run(&world, 500 * MS);
	assert_int_equal(world.last_event[EVENT_BAD_COMMAND].a, COMMAND_FAULT_AXIS_UNREAD);
	assert_int_equal(world.last_event[EVENT_BAD_COMMAND].b, 1);
	assert_int_equal(world_pulses(&world, 1), 0);
	/* an axis that was already enabled continues: its reader may only be late */
	world_go(&world, 0, 500, 0);
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 0), 500);
	world.unread = false;
	world_run(&world, 500 * MS);
	assert_int_equal(world_pulses(&world, 1), 5000);
}

static void run_is_never_sent_without_permission(struct world *w, const uint8_t *p)
{
	if (p[1] == 0x85 && p[2] == 0x02 && p[3] == WIRE_ENGINE_RUNNING)
		assert_true(w->command.flags & POKEYS_COMMAND_MACHINE_ON);
	if (p[1] == 0x85 && (p[2] == 0x25 || p[2] == 0x20) && !w->commanding)
		fail_msg("a reference without a commander");
}

/* Edges, deaths, losses and trips in any order; the world checks I7 in every tick. */
static void permission_survives_no_chaos(void **state)
{
	struct sim_prng prng;
	unsigned int on = 0;

	(void)state;
	sim_prng_init(&prng, world_seed());
	world.watch = run_is_never_sent_without_permission;
	for (unsigned int i = 0; i < 3000; i++) {
		switch (sim_prng_below(&prng, 10)) {
		case 0:
			world.command.flags ^= POKEYS_COMMAND_MACHINE_ON;
			break;
		case 1:
			sim_rig_silence(&world.rig, world.now, sim_prng_below(&prng, 400) * MS);
			break;
		case 2:
			world_loss(&world, (double)sim_prng_below(&prng, 40) / 100);
			break;
		case 3:
			world.command.session++;
			world.command.one_shot_head = 0;
			break;
		case 4:
			sim_bench_emergency(&world.rig.device, sim_prng_below(&prng, 3) == 0);
			break;
		case 5:
			clear_fault();
			break;
		case 6:
			world_stall(&world, sim_prng_below(&prng, 300) * MS);
			break;
		default:
			world_go(&world, (unsigned int)sim_prng_below(&prng, 3),
				 (int32_t)sim_prng_below(&prng, 5000), 0);
		}
		world_run(&world, sim_prng_below(&prng, 60) * MS);
		on += !!(world.state.flags & POKEYS_STATE_MACHINE_ON);
	}
	assert_true(on > 100);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(nothing_moves_before_the_edge, begin),
		cmocka_unit_test(machine_on_from_the_beginning_is_no_edge),
		cmocka_unit_test_setup(machine_off_stops_and_holds, begin_moving),
		cmocka_unit_test_setup(no_motion_is_replayed_after_a_reconnect, begin_moving),
		cmocka_unit_test_setup(dead_commander_stops_the_axes, begin_moving),
		cmocka_unit_test_setup(new_commander_needs_an_edge_of_its_own, begin_moving),
		cmocka_unit_test_setup(new_commander_is_not_called_late, begin_moving),
		cmocka_unit_test_setup(commander_that_ends_is_safe_at_once, begin_moving),
		cmocka_unit_test_setup(reboot_within_a_short_silence_does_not_restart_motion,
				       begin_moving),
		cmocka_unit_test_setup(stall_of_the_daemon_takes_the_permission, begin_moving),
		cmocka_unit_test_setup(emergency_is_left_alone_until_it_is_cleared, begin_moving),
		cmocka_unit_test_setup(start_refused_by_the_emergency_needs_another_edge, begin),
		cmocka_unit_test_setup(engine_stopped_by_somebody_else_needs_an_edge, begin_moving),
		cmocka_unit_test_setup(dead_commander_does_not_clear_a_trip, begin_moving),
		cmocka_unit_test_setup(bad_value_at_the_edge_moves_nothing, begin),
		cmocka_unit_test_setup(first_reference_is_that_of_the_edge, begin),
		cmocka_unit_test_setup(who_has_not_read_gets_no_permission, begin),
		cmocka_unit_test(a_stop_ends_the_reason_to_repeat_an_edge),
		cmocka_unit_test(what_ends_the_permission_is_no_reason_to_repeat_an_edge),
		cmocka_unit_test_setup(who_read_long_ago_gets_no_permission, begin),
		cmocka_unit_test_setup(who_reads_slowly_is_one_that_reads, begin),
		cmocka_unit_test_setup(a_time_of_reading_ahead_of_the_writing_counts_as_none,
				       begin),
		cmocka_unit_test_setup(an_axis_is_enabled_only_by_one_who_reads, begin),
		cmocka_unit_test_setup(permission_survives_no_chaos, begin_moving),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
