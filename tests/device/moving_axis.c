/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Axes of the pulse engine go along a path, in position mode and in buffered mode, also over a bad
 * network; what is refused; what ends it, and that the commander's positions of before, or what it
 * commands meanwhile, move none of them.
 */

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/pulse.h"

enum { AXES = 3, ALL = 7, PER_UNIT = 200, SOFT = 3000 };

static struct world world;
static double off_line; /* how far axes 0 and 1 were off a line through 0, units */

static void set_up(enum pokeys_axis_mode mode)
{
	world_init(&world, NULL);
	world_axes(&world);
	world.config.corner_deviation = 0.02;
	for (unsigned int i = 0; i < AXES; i++) {
		struct pokeys_axis_settings *axis = &world.config.settings.axis[i];

		axis->switches = axis->switches_mask = WIRE_SWITCH_HOME;
		if (mode == POKEYS_AXIS_BUFFERED)
			axis->options = WIRE_AXIS_ENABLED;
		axis->options |= WIRE_AXIS_SOFT_LIMITS;
		axis->options_mask |= WIRE_AXIS_SOFT_LIMITS;
		axis->set |= POKEYS_AXIS_SET_SOFT_MINIMUM | POKEYS_AXIS_SET_SOFT_MAXIMUM;
		axis->soft_minimum = -SOFT;
		axis->soft_maximum = SOFT;
		world.config.axis[i].pulses_per_unit = i == 1 ? -PER_UNIT : PER_UNIT;
	}
}

static void start(enum pokeys_axis_mode mode, double loss)
{
	world_start(&world);
	world_commander(&world, 5);
	world_until(&world, world_is_running, 500 * MS);
	for (unsigned int i = 0; i < AXES; i++)
		world.command.axis[i] = (struct pokeys_axis_command){ .mode = mode, .enable = 1 };
	world_machine_on(&world);
	world_run(&world, 300 * MS);
	if (loss > 0)
		world_loss(&world, loss);
}

static void begin_in(enum pokeys_axis_mode mode, double loss)
{
	set_up(mode);
	start(mode, loss);
}

static int begin(void **state)
{
	(void)state;
	begin_in(POKEYS_AXIS_POSITION, 0);
	return 0;
}

/* Places in units. */
static struct pokeys_one_shot move_of(uint8_t axes, double one, double two, double three,
				      double speed)
{
	const double to[AXES] = { one * PER_UNIT, -two * PER_UNIT, three * PER_UNIT };
	struct pokeys_one_shot shot = {
		.operation = POKEYS_ONE_SHOT_MOVE,
		.index = axes,
		.flags = POKEYS_MOVE_BEGINS,
		.parameter = { (float)speed },
	};
	unsigned int values = 0;

	for (unsigned int i = 0; i < AXES; i++)
		if (axes >> i & 1)
			shot.value[values++] = (int32_t)lround(to[i]);
	return shot;
}

static enum pokeys_outcome move(uint8_t axes, double one, double two, double three, double speed)
{
	const struct pokeys_one_shot shot = move_of(axes, one, two, three, speed);

	return world_do(&world, &shot, 1 * SECOND);
}

static enum pokeys_outcome control(enum pokeys_moves_control which)
{
	const struct pokeys_one_shot shot = {
		.operation = POKEYS_ONE_SHOT_MOVES_CONTROL,
		.index = (uint8_t)which,
	};

	return world_do(&world, &shot, 1 * SECOND);
}

static const struct pokeys_moves *moves(void)
{
	return &world.state.moves;
}

static double place(unsigned int axis)
{
	return (double)world_pulses(&world, axis) / (axis == 1 ? -PER_UNIT : PER_UNIT);
}

static void assert_at(double one, double two, double three)
{
	assert_int_equal(lround(place(0) * PER_UNIT), lround(one * PER_UNIT));
	assert_int_equal(lround(place(1) * PER_UNIT), lround(two * PER_UNIT));
	assert_int_equal(lround(place(2) * PER_UNIT), lround(three * PER_UNIT));
}

static void run(uint64_t for_ns)
{
	const uint64_t end = world.tick + for_ns;

	while (world.tick < end) {
		world_cycle(&world);
		off_line = fmax(off_line, fabs(place(0) - 2 * place(1)));
	}
}

static void until_over(void)
{
	for (unsigned int k = 0; moves()->waiting; k++) {
		assert_true(k < 60000);
		run(1 * MS);
	}
	run(300 * MS);
}

static void refuses(enum pokeys_outcome outcome, enum pokeys_moves_refusal why)
{
	assert_int_equal(outcome, POKEYS_OUTCOME_REFUSED);
	assert_int_equal(moves()->refused, why);
}

/* A tour whose first way is a line. The device is on no way faster than its axes can. */
static void make_a_tour(enum pokeys_axis_mode mode, double loss, double off_most)
{
	begin_in(mode, loss);
	assert_int_equal(moves()->state, POKEYS_MOVES_IDLE);
	assert_int_equal(move(ALL, 8, 4, -2, 40), POKEYS_OUTCOME_DONE);
	off_line = 0;
	while (moves()->waiting)
		run(1 * MS);
	assert_true(off_line < off_most);
	assert_int_equal(move(3, 8, -6, 0, 40), POKEYS_OUTCOME_DONE);
	assert_int_equal(move(1, -3, 0, 0, 40), POKEYS_OUTCOME_DONE);
	assert_int_equal(move(2, 0, 1.5, 0, 0), POKEYS_OUTCOME_DONE);
	assert_int_equal(moves()->axes, ALL);
	assert_int_equal(moves()->motors, 0);
	until_over();
	assert_at(-3, 1.5, -2);
	assert_int_equal(moves()->end, POKEYS_MOVES_DONE);
	assert_int_equal(moves()->taken, 4);
	assert_int_equal(moves()->state, POKEYS_MOVES_HANDOVER);
	assert_int_equal(world.event_count[EVENT_MOVES], 0);
}

static void axes_keep_to_their_path(void **state)
{
	(void)state;
	make_a_tour(POKEYS_AXIS_POSITION, 0, 0.2);
	make_a_tour(POKEYS_AXIS_BUFFERED, 0, 0.02);
}

/* In buffered mode each axis catches up by itself, so it may be off the line meanwhile. */
static void a_bad_network_costs_no_pulse(void **state)
{
	(void)state;
	make_a_tour(POKEYS_AXIS_POSITION, 0.1, INFINITY);
	make_a_tour(POKEYS_AXIS_BUFFERED, 0.1, INFINITY);
}

/*
 * Whoever waits for the end of a path goes by what is published: no move waits, and the axes are
 * where they are commanded to be. Then they are at its end, also after the shortest ways, and if
 * the device is silent while they move.
 */
static void until_published(void)
{
	for (unsigned int k = 0; moves()->waiting || !world.state.engine.axis[0].in_position; k++) {
		assert_true(k < 20000);
		world_cycle(&world);
	}
}

static void end_as_published(enum pokeys_axis_mode mode, double loss)
{
	set_up(mode);
	world.config.stale_after_ns = SECOND;
	start(mode, loss);
	for (int n = 0; n < 200; n++) {
		const int way = n % 7 < 4 ? n % 4 + 1 : n % 90 * 5;
		const int32_t to = n & 1 ? 0 : way;

		assert_int_equal(move(1, (double)to / PER_UNIT, 0, 0, n % 3 ? 40 : 2),
				 POKEYS_OUTCOME_DONE);
		sim_rig_silence(&world.rig, world.now, (uint64_t)(n % 8) * 20 * MS);
		until_published();
		assert_int_equal(world.state.engine.axis[0].position, to);
	}
	/* a way and back, which is shorter than the lead of the motion buffer */
	world_run(&world, 300 * MS);
	for (int n = 1; n < 50; n++) {
		sim_rig_silence(&world.rig, world.now, (uint64_t)(n % 8) * 20 * MS);
		world_run(&world, 200 * MS);
		assert_int_equal(move(1, (double)n / PER_UNIT, 0, 0, 40), POKEYS_OUTCOME_DONE);
		assert_int_equal(move(1, 0, 0, 0, 40), POKEYS_OUTCOME_DONE);
		until_published();
		for (unsigned int k = 0; k < 100; k++) {
			assert_int_equal(world_pulses(&world, 0), 0);
			world_cycle(&world);
		}
	}
}

static void the_end_is_where_it_is_published(void **state)
{
	(void)state;
	end_as_published(POKEYS_AXIS_POSITION, 0);
	end_as_published(POKEYS_AXIS_BUFFERED, 0);
	end_as_published(POKEYS_AXIS_POSITION, 0.1);
	end_as_published(POKEYS_AXIS_BUFFERED, 0.1);
}

/* From (0, 0) to (12, 0), then to (12, 12): how far axes 0 and 1 are off that. */
static double off_corner(void)
{
	return fmin(fabs(place(1)), fabs(place(0) - 12));
}

/*
 * The path waits for a device that is silent for a moment. Otherwise the axes would be far behind
 * when it is back, and each of them would take the shortest way.
 */
static void a_silence_cuts_no_corner(void **state)
{
	double worst = 0;

	(void)state;
	for (int n = 0; n < 10; n++) {
		begin_in(POKEYS_AXIS_POSITION, 0);
		assert_int_equal(move(3, 12, 0, 0, 40), POKEYS_OUTCOME_DONE);
		assert_int_equal(move(3, 12, 12, 0, 40), POKEYS_OUTCOME_DONE);
		while (place(0) < 9 + 0.3 * n)
			world_cycle(&world);
		sim_rig_silence(&world.rig, world.now, 120 * MS);
		for (unsigned int k = 0; moves()->waiting; k++) {
			assert_true(k < 60000);
			world_cycle(&world);
			worst = fmax(worst, off_corner());
		}
		run(300 * MS);
		assert_at(12, 12, 0);
		assert_int_equal(moves()->end, POKEYS_MOVES_DONE);
	}
	if (worst > 0.3)
		fail_msg("%.3f off", worst);
}

/* A spindle turns all the time: it is not what has to stand until positions are known again. */
static void one_by_speed_does_not_hold_the_others(void **state)
{
	(void)state;
	world_init(&world, NULL);
	world_axes(&world);
	for (unsigned int i = 0; i < AXES; i++) {
		world.config.settings.axis[i].options =
			i == 2 ? WIRE_AXIS_ENABLED | WIRE_AXIS_INTERNAL_PLANNER : WIRE_AXIS_ENABLED;
		world.config.axis[i].pulses_per_unit = i == 2 ? 0 : i == 1 ? -PER_UNIT : PER_UNIT;
	}
	world_start(&world);
	world_commander(&world, 5);
	world_until(&world, world_is_running, 500 * MS);
	for (unsigned int i = 0; i < AXES; i++)
		world.command.axis[i] = (struct pokeys_axis_command){
			.mode = i == 2 ? POKEYS_AXIS_VELOCITY : POKEYS_AXIS_BUFFERED,
			.enable = 1,
			.velocity = i == 2 ? 1000 : 0,
		};
	world_machine_on(&world);
	run(500 * MS);
	world_loss(&world, 0.1);
	for (unsigned int i = 0; i < 4; i++)
		assert_int_equal(move(3, i % 2 ? 0 : 20, i % 2 ? 0 : 10, 0, 40),
				 POKEYS_OUTCOME_DONE);
	until_over();
	assert_at(0, 0, place(2));
	assert_true(world.state.engine.buffer_resyncs > 0);
	assert_true(world_pulses(&world, 2) > 1000);
}

/* Neither while they move, nor where they are held. */
static void what_the_commander_says_moves_none_of_them(void **state)
{
	(void)state;
	assert_int_equal(move(ALL, 5, 5, 5, 40), POKEYS_OUTCOME_DONE);
	world.command.axis[0].position = 900;
	until_over();
	assert_at(5, 5, 5);
	world.command.axis[1].position = 700;
	run(1 * SECOND);
	assert_at(5, 5, 5);
	assert_int_equal(moves()->axes, ALL);
	/* one that is there has its axis back, and moves it */
	world.command.axis[0].position = 5 * PER_UNIT;
	run(300 * MS);
	assert_int_equal(moves()->axes, ALL & ~1);
	world.command.axis[0].position = 6 * PER_UNIT;
	run(300 * MS);
	assert_at(6, 5, 5);
	/* one that passes by has not */
	for (int32_t at = 900; at <= 1100; at++) {
		world.command.axis[2].position = at;
		run(1 * MS);
	}
	run(300 * MS);
	assert_at(6, 5, 5);
	/* and again from there */
	assert_int_equal(move(5, 0, 0, 1, 40), POKEYS_OUTCOME_DONE);
	until_over();
	assert_at(0, 5, 1);
}

/* It saw the axis a pulse before its end, and was busy then: it is waited for. */
static void a_commander_that_is_late_moves_none_of_them(void **state)
{
	(void)state;
	assert_int_equal(move(1, 1, 0, 0, 40), POKEYS_OUTCOME_DONE);
	while (moves()->waiting)
		run(1 * MS);
	world.command.axis[0].position = PER_UNIT - 1;
	run(500 * MS);
	assert_at(1, 0, 0);
	assert_int_equal(moves()->axes, 1);
	world.command.axis[0].position = PER_UNIT;
	run(300 * MS);
	assert_at(1, 0, 0);
	assert_int_equal(moves()->axes, 0);
	/* one that does not find the pulse is its commander all the same */
	assert_int_equal(move(1, 2, 0, 0, 40), POKEYS_OUTCOME_DONE);
	while (moves()->waiting)
		run(1 * MS);
	world.command.axis[0].position = 2 * PER_UNIT - 1;
	run(1500 * MS);
	assert_int_equal(moves()->axes, 0);
}

static void what_cannot_be_moved_is_refused(void **state)
{
	(void)state;
	refuses(move(0, 1, 1, 1, 10), POKEYS_MOVES_ODD);
	refuses(move(8, 1, 1, 1, 10), POKEYS_MOVES_ODD);
	refuses(move(ALL, 1, 1, 1, NAN), POKEYS_MOVES_ODD);
	refuses(move(1, 15.01, 0, 0, 10), POKEYS_MOVES_LIMIT);
	refuses(move(2, 0, 15.01, 0, 10), POKEYS_MOVES_LIMIT);
	world.command.axis[1].enable = 0;
	run(20 * MS);
	refuses(move(ALL, 1, 1, 1, 10), POKEYS_MOVES_OFF);
	assert_int_equal(move(5, 15, 0, -15, 0), POKEYS_OUTCOME_DONE);
	until_over();
	assert_at(15, 0, -15);
	/* a commander that moves an axis keeps it */
	world.command.axis[1].enable = 1;
	run(20 * MS);
	for (int32_t at = 0; at < 500; at += 5) {
		world.command.axis[1].position = at;
		run(1 * MS);
	}
	refuses(move(2, 0, 0, 0, 10), POKEYS_MOVES_COMMANDED);
	run(300 * MS);
	assert_int_equal(move(2, 0, 0, 0, 10), POKEYS_OUTCOME_DONE);
	until_over();
	assert_at(15, 0, -15);
}

/* The device can do one thing at a time. */
static void the_device_begins_nothing_meanwhile(void **state)
{
	const struct pokeys_one_shot home = { .operation = POKEYS_ONE_SHOT_HOME, .mask = 4 };
	const struct pokeys_one_shot probe = {
		.operation = POKEYS_ONE_SHOT_PROBE,
		.mask = 1,
		.value = { 100 },
		.parameter = { 10, 0.1f },
		.index = 1,
	};

	(void)state;
	assert_int_equal(move(3, 10, 10, 0, 5), POKEYS_OUTCOME_DONE);
	run(100 * MS);
	assert_int_equal(world_do(&world, &home, 1 * SECOND), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(world_do(&world, &probe, 1 * SECOND), POKEYS_OUTCOME_REFUSED);
	until_over();
	assert_at(10, 10, 0);
	/* where the path has ended, it may; then the axes are no more of the path */
	world_one_shot(&world, &home);
	run(100 * MS);
	assert_int_equal(moves()->axes, 0);
	refuses(move(1, 0, 0, 0, 5), POKEYS_MOVES_HOMING);
}

/* Back in is allowed from beyond a soft limit, and then it is one. */
static void soft_limits_are_those_of_the_whole_path(void **state)
{
	const struct pokeys_one_shot set = {
		.operation = POKEYS_ONE_SHOT_SET_POSITION,
		.mask = 1,
		.value = { SOFT + 400 },
	};

	(void)state;
	world_machine_off(&world);
	run(100 * MS);
	assert_int_equal(world_do(&world, &set, 1 * SECOND), POKEYS_OUTCOME_DONE);
	world.command.axis[0].position = SOFT + 400;
	world_machine_on(&world);
	run(100 * MS);
	refuses(move(1, 17.1, 0, 0, 10), POKEYS_MOVES_LIMIT);
	assert_int_equal(move(1, 16, 0, 0, 10), POKEYS_OUTCOME_DONE);
	assert_int_equal(move(1, 2, 0, 0, 50), POKEYS_OUTCOME_DONE);
	refuses(move(1, 16, 0, 0, 50), POKEYS_MOVES_LIMIT);
	until_over();
	assert_at(2, 0, 0);
}

/* Where it stays it may stay, whatever rounding makes of it. */
static void beyond_a_soft_limit_it_may_stay(void **state)
{
	const struct pokeys_one_shot set = {
		.operation = POKEYS_ONE_SHOT_SET_POSITION,
		.mask = 1,
		.value = { SOFT + 400 },
	};
	struct pokeys_one_shot shot;

	(void)state;
	world_machine_off(&world);
	run(100 * MS);
	assert_int_equal(world_do(&world, &set, 1 * SECOND), POKEYS_OUTCOME_DONE);
	world.command.axis[0].position = SOFT + 400;
	world_machine_on(&world);
	run(100 * MS);
	for (unsigned int i = 0; i < 3; i++) {
		shot = move_of(3, 16.5, i, 0, 10);
		shot.fraction[0] = 160; /* 0.6 pulses */
		assert_int_equal(world_do(&world, &shot, 1 * SECOND), POKEYS_OUTCOME_DONE);
	}
	until_over();
	/* held there, it is not the place of before that counts */
	refuses(move(1, 16.6, 0, 0, 10), POKEYS_MOVES_LIMIT);
}

/* With almost no way to go it would stay behind by what it is behind, for all of the move. */
static void what_it_is_behind_is_caught_up_with(void **state)
{
	(void)state;
	assert_int_equal(move(3, 10, 0, 0, 80), POKEYS_OUTCOME_DONE);
	assert_int_equal(move(3, 10.02, 14, 0, 5), POKEYS_OUTCOME_DONE);
	while (moves()->waiting == 2)
		run(1 * MS);
	run(300 * MS);
	assert_int_equal(moves()->waiting, 1);
	assert_true(fabs(place(0) - 10) < 0.02);
	until_over();
	assert_at(10.02, 14, 0);
}

/* What is held is not the commander's, which would have to move it. */
static void what_is_held_takes_part_in_nothing(void **state)
{
	const struct pokeys_one_shot probe = {
		.operation = POKEYS_ONE_SHOT_PROBE,
		.flags = POKEYS_PROBE_HYBRID,
		.index = 1,
		.parameter = { 10 },
	};

	(void)state;
	assert_int_equal(move(1, 5, 0, 0, 40), POKEYS_OUTCOME_DONE);
	until_over();
	assert_int_equal(moves()->state, POKEYS_MOVES_HANDOVER);
	assert_int_equal(world.state.engine.axis[0].following_error, -5 * PER_UNIT);
	assert_int_equal(world_do(&world, &probe, 1 * SECOND), POKEYS_OUTCOME_REFUSED);
	world.command.axis[0].position = 5 * PER_UNIT;
	run(200 * MS);
	assert_int_equal(world.state.engine.axis[0].following_error, 0);
	world_one_shot(&world, &probe);
	run(100 * MS);
	assert_int_equal(world.state.engine.task, POKEYS_TASK_HYBRID_PROBING);
}

static bool stands(void)
{
	const uint8_t engine = world_engine_state(&world);

	return !moves()->waiting &&
	       (engine == WIRE_ENGINE_STOPPED || engine >= WIRE_ENGINE_STOP_LIMIT);
}

/* Whatever ends it: no axis moves any more, and none goes on when the machine is on again. */
static void it_ends_with_the_permission_to_move(void **state)
{
	static void (*const ends[])(struct world *) = {
		world_machine_off, world_commander_dies, world_emergency,
		world_link_breaks, world_daemon_ends,
	};

	(void)state;
	for (size_t way = 0; way < sizeof(ends) / sizeof(ends[0]); way++) {
		double at[AXES];

		begin_in(POKEYS_AXIS_POSITION, 0);
		assert_int_equal(move(ALL, 14, 14, 14, 10), POKEYS_OUTCOME_DONE);
		run(300 * MS);
		assert_true(place(0) > 1);
		ends[way](&world);
		for (unsigned int k = 0; !stands() && ends[way] != world_link_breaks; k++) {
			assert_true(k < 3000);
			run(1 * MS);
		}
		run(3 * SECOND);
		assert_int_equal(moves()->waiting, 0);
		assert_int_equal(moves()->axes, 0);
		for (unsigned int i = 0; i < AXES; i++)
			at[i] = place(i);
		assert_true(at[0] < 12);
		run(1 * SECOND);
		assert_at(at[0], at[1], at[2]);
	}
}

/* One of them is switched off: the others stand on the path. */
static void the_others_slow_down(void **state)
{
	(void)state;
	assert_int_equal(move(ALL, 14, 14, 14, 20), POKEYS_OUTCOME_DONE);
	run(300 * MS);
	world.command.axis[2].enable = 0;
	run(5 * MS);
	assert_int_equal(moves()->end, POKEYS_MOVES_STOPPED);
	assert_int_equal(world.last_event[EVENT_MOVES].b, POKEYS_SERVOS + 2);
	until_over();
	assert_int_equal(moves()->axes, 3);
	assert_true(place(0) > 1 && place(0) < 13);
	assert_true(fabs(place(0) - place(1)) < 1e-9);
	assert_true(world.state.engine.axis[0].enabled);
}

static void it_can_be_held_and_ended(void **state)
{
	double at;

	(void)state;
	assert_int_equal(move(ALL, 14, 14, 14, 20), POKEYS_OUTCOME_DONE);
	run(200 * MS);
	assert_int_equal(control(POKEYS_MOVES_HOLD), POKEYS_OUTCOME_DONE);
	run(200 * MS);
	at = place(0);
	run(500 * MS);
	assert_at(at, at, at);
	assert_int_equal(control(POKEYS_MOVES_RESUME), POKEYS_OUTCOME_DONE);
	run(200 * MS);
	assert_true(place(0) > at + 1);
	assert_int_equal(control(POKEYS_MOVES_ABORT), POKEYS_OUTCOME_DONE);
	until_over();
	at = place(0);
	assert_int_equal(moves()->end, POKEYS_MOVES_ABORTED);
	run(500 * MS);
	assert_at(at, at, at);
	/* at once is as fast as the device brakes, and not back from there */
	assert_int_equal(move(ALL, -14, -14, -14, 20), POKEYS_OUTCOME_DONE);
	run(200 * MS);
	assert_int_equal(control(POKEYS_MOVES_STOP), POKEYS_OUTCOME_DONE);
	at = (double)world.state.engine.axis[0].reference / PER_UNIT;
	for (unsigned int ms = 0; ms < 500; ms++) {
		const double before = place(0);

		run(1 * MS);
		assert_true(place(0) <= before);
	}
	assert_true(fabs(place(0) - at) < 0.5);
	assert_true(fabs(place(0) - place(1)) < 1e-9);
}

/* Without a scale it is on no path, and the device's own settings are the limits. */
static void limits_are_those_of_the_device(void **state)
{
	uint64_t begun;

	(void)state;
	world_init(&world, NULL);
	world_axes(&world);
	world.config.axis[0].pulses_per_unit = PER_UNIT;
	world_all_moving(&world);
	refuses(move(2, 0, 1, 0, 0), POKEYS_MOVES_ODD);
	/* 20,000 pulses/s are 100 units/s */
	begun = world.tick;
	assert_int_equal(move(1, 190, 0, 0, 0), POKEYS_OUTCOME_DONE);
	while (moves()->waiting) {
		run(1 * MS);
		assert_true((double)moves()->speed <= 95.01);
	}
	assert_in_range((world.tick - begun) / MS, 2000, 2150);
	run(100 * MS);
	assert_int_equal(world_pulses(&world, 0), 190 * PER_UNIT);
	assert_true(world.state.engine.axis[0].in_position);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(axes_keep_to_their_path),
		cmocka_unit_test(a_bad_network_costs_no_pulse),
		cmocka_unit_test(the_end_is_where_it_is_published),
		cmocka_unit_test(a_silence_cuts_no_corner),
		cmocka_unit_test(one_by_speed_does_not_hold_the_others),
		cmocka_unit_test_setup(what_the_commander_says_moves_none_of_them, begin),
		cmocka_unit_test_setup(a_commander_that_is_late_moves_none_of_them, begin),
		cmocka_unit_test_setup(what_cannot_be_moved_is_refused, begin),
		cmocka_unit_test_setup(the_device_begins_nothing_meanwhile, begin),
		cmocka_unit_test_setup(soft_limits_are_those_of_the_whole_path, begin),
		cmocka_unit_test_setup(beyond_a_soft_limit_it_may_stay, begin),
		cmocka_unit_test_setup(what_it_is_behind_is_caught_up_with, begin),
		cmocka_unit_test_setup(what_is_held_takes_part_in_nothing, begin),
		cmocka_unit_test(it_ends_with_the_permission_to_move),
		cmocka_unit_test_setup(the_others_slow_down, begin),
		cmocka_unit_test_setup(it_can_be_held_and_ended, begin),
		cmocka_unit_test(limits_are_those_of_the_device),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
