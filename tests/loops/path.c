/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Moves along a path: how long one takes, how corners and curves are passed, that no axis is ever
 * faster than it may be or speeds up more than it can, whatever is done to the queue meanwhile, and
 * that the axes stay on the path and end exactly where it ends.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "daemon/loops/path.h"
#include "sim/prng.h"

#define CYCLE_NS UINT64_C(1000000)
#define CYCLE_S 0.001
#define NEAR 1e-6

enum { X, Y, Z, AXES };

static const struct path_config usual = {
	.axes = AXES,
	.deviation = 0.01,
	.axis = { { .speed = 100, .acceleration = 1000 },
		  { .speed = 100, .acceleration = 1000 },
		  { .speed = 20, .acceleration = 200 } },
};

static struct path path;
static uint64_t now_ns;

static void begin(const struct path_config *config)
{
	const char *why = path_init(&path, config);

	if (why)
		fail_msg("%s", why);
	now_ns = CYCLE_NS;
	path_step(&path, now_ns);
}

static enum path_refusal go(double x, double y, double z, double speed)
{
	static const double at[PATH_AXES];
	const double end[PATH_AXES] = { x, y, z };

	return path_add(&path, 7, at, end, speed);
}

static void step(void)
{
	now_ns += CYCLE_NS;
	path_step(&path, now_ns);
}

/* Seconds until it stands at the end of all moves. */
static double finish(void)
{
	long cycles = 0;

	for (; !path_is_idle(&path); cycles++) {
		assert_in_range(cycles, 0, 10000000);
		step();
	}
	assert_true(path.speed == 0);
	return (double)cycles * CYCLE_S;
}

static void assert_at(double x, double y, double z)
{
	assert_true(path.position[X] == x && path.position[Y] == y && path.position[Z] == z);
	for (unsigned int i = 0; i < AXES; i++)
		assert_true(path.velocity[i] == 0);
}

static void takes(double seconds, double expected)
{
	if (fabs(seconds - expected) > 2 * CYCLE_S)
		fail_msg("%.4f s instead of %.4f s", seconds, expected);
}

/* As long as the formulas of even acceleration say. */
static void takes_the_time_of_a_trapezoid(void **state)
{
	(void)state;
	begin(&usual);
	assert_int_equal(go(100, 0, 0, 50), PATH_TAKEN);
	takes(finish(), 100.0 / 50 + 50.0 / 1000);
	assert_at(100, 0, 0);
	/* too short for its speed */
	assert_int_equal(go(101, 0, 0, 50), PATH_TAKEN);
	takes(finish(), 2 * sqrt(1.0 / 1000));
	assert_at(101, 0, 0);
	/* as fast as it can, and no faster */
	assert_int_equal(go(1, 0, 0, 0), PATH_TAKEN);
	takes(finish(), 100.0 / 100 + 100.0 / 1000);
	assert_int_equal(go(101, 0, 0, 1e6), PATH_TAKEN);
	takes(finish(), 100.0 / 100 + 100.0 / 1000);
	assert_int_equal(path.taken, 4);
}

/* Together, in the time of the slowest. */
static void axes_go_together(void **state)
{
	(void)state;
	begin(&usual);
	assert_int_equal(go(30, 0, 40, 0), PATH_TAKEN);
	/* Z, 20 units/s and 200 units/s^2, is 0.8 of the way */
	for (unsigned int i = 0; i < 500; i++) {
		step();
		assert_true(fabs(path.position[X] / 30 - path.position[Z] / 40) < NEAR);
	}
	takes(0.5 + finish(), 50.0 / 25 + 25.0 / 250);
	assert_at(30, 0, 40);
}

/* A straight line in many pieces is no slower than in one. */
static void straight_pieces_do_not_slow_it_down(void **state)
{
	double seconds = 0;
	double x = 0;

	(void)state;
	begin(&usual);
	while (x < 60) {
		while (x < 60 && path.count < PATH_MOVES) {
			x += 1;
			assert_int_equal(go(x, x, 0, 50), PATH_TAKEN);
		}
		step();
		seconds += CYCLE_S;
	}
	takes(seconds + finish(), 60 * sqrt(2) / 50 + 50 / (1000 * sqrt(2)));
	assert_at(60, 60, 0);
}

/* The speed at the only corner of a path. */
static double speed_at_corner(double x, double y)
{
	double slowest = INFINITY;

	assert_int_equal(go(50, 0, 0, 50), PATH_TAKEN);
	assert_int_equal(go(50 + x, y, 0, 50), PATH_TAKEN);
	while (path.count > 1 || path.done < 5) {
		step();
		if (path.count == 1 || path.move[path.first].length - path.done < 5)
			slowest = fmin(slowest, path.speed);
	}
	finish();
	return slowest;
}

static void corners_are_passed_by_their_angle(void **state)
{
	struct path_config stops = usual;
	double speed;

	(void)state;
	begin(&usual);
	/* a round corner of 90 degrees 0.01 off has a radius of 0.0241; two axes turn it */
	speed = speed_at_corner(0, 50);
	assert_true(speed > 5.5 && speed < sqrt(1000 * sqrt(2) * 0.0242) + 1);
	begin(&usual);
	assert_true(speed_at_corner(50, 0) > 49);
	begin(&usual);
	assert_true(speed_at_corner(50, 5) > speed);
	begin(&usual);
	assert_true(speed_at_corner(-50, 10) < speed);
	begin(&usual);
	assert_true(speed_at_corner(-50, 0) < 1.1);
	stops.deviation = 0;
	begin(&stops);
	assert_true(speed_at_corner(0, 50) < 1.1);
}

/* A circle in short pieces is turned as fast as its axes can, and no faster. */
static void curves_keep_to_the_acceleration(void **state)
{
	const double radius = 1, pieces = 200;
	double fastest = 0;
	unsigned int i = 0;

	(void)state;
	begin(&usual);
	while (i <= pieces * 3) {
		while (i <= pieces * 3 && path.count < PATH_MOVES) {
			const double angle = 2 * M_PI * i++ / pieces;

			assert_int_equal(go(radius * cos(angle) - radius, radius * sin(angle), 0,
					    100),
					 PATH_TAKEN);
		}
		step();
		fastest = fmax(fastest, path.speed);
	}
	finish();
	/* v^2 / r; where both axes turn it, up to sqrt(2) more */
	assert_true(fastest > 25 && fastest < sqrt(1000 * sqrt(2) * radius) + 1);
}

static void a_full_queue_refuses_and_loses_nothing(void **state)
{
	(void)state;
	begin(&usual);
	for (unsigned int i = 1; i <= PATH_MOVES; i++)
		assert_int_equal(go(i, 0, 0, 0), PATH_TAKEN);
	assert_int_equal(go(1000, 0, 0, 0), PATH_FULL);
	finish();
	assert_at(PATH_MOVES, 0, 0);
	assert_int_equal(path.taken, PATH_MOVES);
	assert_int_equal(go(0, 0, 0, 0), PATH_TAKEN);
}

static void what_is_no_number_is_refused(void **state)
{
	static const double at[PATH_AXES], none[PATH_AXES] = { [X] = NAN };

	(void)state;
	begin(&usual);
	assert_int_equal(go(NAN, 0, 0, 0), PATH_ODD);
	assert_int_equal(go(INFINITY, 0, 0, 0), PATH_ODD);
	assert_int_equal(go(0, -2e9, 0, 0), PATH_ODD);
	assert_int_equal(go(1, 0, 0, NAN), PATH_ODD);
	assert_int_equal(go(1, 0, 0, -1), PATH_ODD);
	assert_int_equal(go(1, 0, 0, INFINITY), PATH_ODD);
	assert_int_equal(path_add(&path, 1, none, at, 0), PATH_ODD);
	assert_false(path_feed(&path, NAN));
	assert_false(path_feed(&path, -0.1));
	assert_false(path_feed(&path, 2.1));
	assert_true(path_is_idle(&path));
	assert_int_equal(path.axes, 0);
	/* nowhere is no way */
	assert_int_equal(go(0, 0, 0, 0), PATH_TAKEN);
	assert_true(path_is_idle(&path));
}

static void bad_configurations_are_refused(void **state)
{
	struct path_config config = usual;

	(void)state;
	config.deviation = NAN;
	assert_non_null(strstr(path_init(&path, &config), "corner-deviation"));
	config.deviation = -1;
	assert_non_null(strstr(path_init(&path, &config), "corner-deviation"));
	config = usual;
	config.axis[Z].acceleration = 0;
	assert_non_null(strstr(path_init(&path, &config), "max-acceleration"));
	config = usual;
	config.axis[Y].speed = INFINITY;
	assert_non_null(strstr(path_init(&path, &config), "max-speed"));
}

static void an_axis_joins_where_it_stands(void **state)
{
	const double at[PATH_AXES] = { 7, 8, 9 }, end[PATH_AXES] = { 17, 0, 19 };

	(void)state;
	begin(&usual);
	assert_int_equal(path_add(&path, 1, at, end, 10), PATH_TAKEN);
	step();
	assert_int_equal(path.axes, 1);
	assert_int_equal(path_add(&path, 4, at, end, 10), PATH_TAKEN);
	for (unsigned int i = 0; i < 200; i++)
		step();
	assert_true(path.position[Z] == 9);
	assert_true(path.position[X] > 8);
	finish();
	assert_true(path.position[X] == 17 && path.position[Z] == 19);
	/* it is where the path has left it, whatever anybody says */
	assert_int_equal(path_add(&path, 1, end, at, 10), PATH_TAKEN);
	step();
	assert_true(fabs(path.position[X] - 17) < 0.1);
	finish();
	path_leave(&path, 5);
	assert_int_equal(path.axes, 0);
}

/* How far it goes, after what was called, until it stands. */
static double way_to_stand(void)
{
	const double from = path.position[X];

	for (unsigned int i = 0; path.speed > 0; i++) {
		assert_in_range(i, 0, 10000);
		step();
	}
	return path.position[X] - from;
}

static void cruise(void)
{
	begin(&usual);
	assert_int_equal(go(100, 0, 0, 50), PATH_TAKEN);
	assert_int_equal(go(100, 100, 0, 50), PATH_TAKEN);
	for (unsigned int i = 0; i < 500; i++)
		step();
	assert_true(fabs(path.speed - 50) < NEAR);
}

static void hold_waits_on_the_path(void **state)
{
	double at;

	(void)state;
	cruise();
	path_hold(&path, true);
	/* v^2 / 2a */
	assert_true(fabs(way_to_stand() - 50.0 * 50 / 2000) < 0.06);
	at = path.position[X];
	for (unsigned int i = 0; i < 1000; i++)
		step();
	assert_true(path.position[X] == at && path.count == 2);
	path_hold(&path, false);
	finish();
	assert_at(100, 100, 0);
}

static void abort_slows_down_and_forgets(void **state)
{
	double at;

	(void)state;
	cruise();
	assert_true(path_abort(&path));
	assert_int_equal(go(0, 0, 0, 50), PATH_ENDS);
	assert_true(fabs(way_to_stand() - 50.0 * 50 / 2000) < 0.06);
	at = path.position[X];
	step();
	assert_true(path_is_idle(&path));
	assert_false(path_abort(&path));
	assert_at(at, 0, 0);
	assert_int_equal(go(0, 0, 0, 50), PATH_TAKEN);
	finish();
	assert_at(0, 0, 0);
	/* while it is held */
	cruise();
	path_hold(&path, true);
	way_to_stand();
	assert_true(path_abort(&path));
	step();
	assert_true(path_is_idle(&path));
	/* it still is */
	assert_int_equal(go(0, 0, 0, 50), PATH_TAKEN);
	step();
	assert_true(path.speed == 0 && path.count == 1);
	path_hold(&path, false);
	finish();
	assert_at(0, 0, 0);
}

/* However little is left of a move: roots and differences lose it. */
static void it_ends_however_little_is_left(void **state)
{
	(void)state;
	for (double left = 1; left > 1e-13; left /= 7) {
		begin(&usual);
		assert_int_equal(go(10, 0, 0, 50), PATH_TAKEN);
		step();
		path_hold(&path, true);
		way_to_stand();
		path.done = 10 - left;
		path_hold(&path, false);
		assert_true(finish() < 1);
		assert_at(10, 0, 0);
	}
}

static void stop_is_at_once(void **state)
{
	double at;

	(void)state;
	cruise();
	at = path.position[X];
	path_stop(&path);
	assert_true(path_is_idle(&path));
	assert_at(at, 0, 0);
	step();
	assert_at(at, 0, 0);
}

static void feed_changes_the_speed(void **state)
{
	(void)state;
	cruise();
	assert_true(path_feed(&path, 0.5));
	for (unsigned int i = 0; i < 200; i++)
		step();
	assert_true(fabs(path.speed - 25) < NEAR);
	assert_true(path_feed(&path, 2));
	for (unsigned int i = 0; i < 200; i++)
		step();
	assert_true(fabs(path.speed - 100) < NEAR);
	assert_true(path_feed(&path, 0));
	assert_true(fabs(way_to_stand() - 100.0 * 100 / 2000) < 0.11);
	step();
	assert_true(path.speed == 0 && path.count == 2);
	assert_true(path_feed(&path, 1));
	finish();
	assert_at(100, 100, 0);
}

/* The computer stood still for a second: the path has waited. */
static void a_pause_is_no_part_of_the_path(void **state)
{
	double at;

	(void)state;
	cruise();
	at = path.position[X];
	now_ns += 1000 * CYCLE_NS;
	path_step(&path, now_ns);
	assert_true(path.position[X] - at < 0.51);
	path_step(&path, now_ns - 5 * CYCLE_NS);
	finish();
	assert_at(100, 100, 0);
}

/* Random programs. */

static struct sim_prng prng;
static double corner[2 * PATH_MOVES][AXES]; /* the last ones that were commanded */
static unsigned int corners;

static double random_place(void)
{
	return sim_prng_unit(&prng) < 0.3 ?
		       0 :
		       (sim_prng_unit(&prng) - 0.5) * (sim_prng_unit(&prng) < 0.5 ? 100 : 1);
}

/* Off the line between two points. */
static double off_line(const double *one, const double *two, const double *at)
{
	double length = 0, along = 0, off = 0;

	for (unsigned int i = 0; i < AXES; i++) {
		length += (two[i] - one[i]) * (two[i] - one[i]);
		along += (two[i] - one[i]) * (at[i] - one[i]);
	}
	along = length > 0 ? fmin(fmax(along / length, 0), 1) : 0;
	for (unsigned int i = 0; i < AXES; i++) {
		const double nearest = one[i] + along * (two[i] - one[i]);

		off += (at[i] - nearest) * (at[i] - nearest);
	}
	return sqrt(off);
}

static const double *corner_at(unsigned int index)
{
	return corner[index % (sizeof(corner) / sizeof(corner[0]))];
}

/* On the line that its first move has, or where the last one has ended. */
static void assert_on_path(void)
{
	const unsigned int to = corners - path.count;

	if (!corners)
		return;
	assert_true(off_line(corner_at(to - 1), corner_at(path.count ? to : to - 1),
			     path.position) < NEAR);
}

/* The square of the speed at which a corner may be passed, by its geometry. */
static double corner_limit(const double *one, const double *at, const double *two)
{
	double in[AXES], out[AXES], long_in = 0, long_out = 0, turn = 0, cosine = 0;
	double rate = INFINITY, half;

	for (unsigned int i = 0; i < AXES; i++) {
		in[i] = at[i] - one[i];
		out[i] = two[i] - at[i];
		long_in += in[i] * in[i];
		long_out += out[i] * out[i];
	}
	long_in = sqrt(long_in);
	long_out = sqrt(long_out);
	for (unsigned int i = 0; i < AXES; i++) {
		const double change = out[i] / long_out - in[i] / long_in;

		turn += change * change;
		cosine += in[i] / long_in * out[i] / long_out;
		if (fabs(change) > 0)
			rate = fmin(rate, path.config.axis[i].acceleration / fabs(change));
	}
	turn = sqrt(turn);
	if (turn < 1e-5)
		return INFINITY;
	rate *= turn;
	half = sqrt(fmax(1 + cosine, 0) / 2);
	return fmin(rate * path.config.deviation * half / (1 - half),
		    rate * fmin(long_in, long_out) / turn);
}

static double last_corner_limit(void)
{
	const unsigned int at = corners - path.count - 1;

	return corner_limit(corner_at(at - 1), corner_at(at), corner_at(at + 1));
}

/* In a cycle without a corner, by no more than it can. At a corner, by no more than its speed. */
static void assert_within_limits(const struct path *before, double seconds)
{
	const bool same = before->count && path.count && before->first == path.first;
	double rate = 0;

	for (unsigned int i = 0; i < AXES; i++) {
		const struct path_axis_config *axis = &path.config.axis[i];
		const double jump = fabs(path.velocity[i] - before->velocity[i]);

		assert_true(fabs(path.velocity[i]) <= axis->speed * (1 + NEAR));
		if (same)
			assert_true(jump <= axis->acceleration * seconds * (1 + NEAR) + 1e-9);
		assert_true(fabs(path.position[i] - before->position[i]) <=
			    axis->speed * seconds * (1 + NEAR) + 1e-9);
	}
	/* the speed along the path changes as the moves allow that it goes through */
	for (unsigned int i = 0; i + path.count <= before->count; i++)
		rate = fmax(rate, before->move[(before->first + i) % PATH_MOVES].acceleration);
	assert_true(fabs(path.speed - before->speed) <= rate * seconds * (1 + NEAR) + 1e-9);
	/* one corner in this cycle */
	if (before->count == path.count + 1 && path.count)
		assert_true(path.speed <= sqrt(last_corner_limit()) +
						  path.move[path.first].acceleration * seconds +
						  1e-6);
}

static void add_randomly(void)
{
	const unsigned int had = sizeof(corner) / sizeof(corner[0]), count = path.count;
	double *end;

	if (!corners)
		memcpy(corner[corners++ % had], path.position, sizeof(corner[0]));
	end = corner[corners % had];
	for (unsigned int i = 0; i < AXES; i++)
		end[i] = random_place();
	assert_int_equal(go(end[X], end[Y], end[Z], 100 * sim_prng_unit(&prng)), PATH_TAKEN);
	/* one without a length is none */
	corners += path.count - count;
}

/* True: the path is another one from now on. */
static bool random_wish(void)
{
	const double which = sim_prng_unit(&prng);

	if (which < 0.05 && path.count < PATH_MOVES && !path.ends)
		add_randomly();
	else if (which < 0.051)
		path_feed(&path, PATH_FEED_MOST * sim_prng_unit(&prng));
	else if (which < 0.0512)
		path_feed(&path, 0);
	else if (which < 0.052)
		path_hold(&path, !path.held);
	else if (which < 0.0522)
		path_abort(&path);
	else if (which < 0.0523)
		path_stop(&path);
	else if (which < 0.053)
		path_feed(&path, 1);
	return path.ends || (which >= 0.0522 && which < 0.0523);
}

static void whatever_happens_it_stays_within_its_limits(void **state)
{
	struct path_config config = usual;

	(void)state;
	sim_prng_init(&prng, 1);
	for (unsigned int program = 0; program < 40; program++) {
		config.deviation = program % 4 ? 0.01 * program : 0;
		begin(&config);
		corners = 0;
		for (unsigned int i = 0; i < 20000; i++) {
			const uint64_t passed_ns = sim_prng_below(&prng, 2 * CYCLE_NS);
			const bool another = random_wish();
			const struct path before = path;

			now_ns += passed_ns;
			path_step(&path, now_ns);
			if (another && path_is_idle(&path))
				corners = 0;
			assert_on_path();
			if (!another)
				assert_within_limits(&before, (double)passed_ns / 1e9);
		}
		path_hold(&path, false);
		path_feed(&path, 1);
		finish();
		assert_on_path();
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(takes_the_time_of_a_trapezoid),
		cmocka_unit_test(axes_go_together),
		cmocka_unit_test(straight_pieces_do_not_slow_it_down),
		cmocka_unit_test(corners_are_passed_by_their_angle),
		cmocka_unit_test(curves_keep_to_the_acceleration),
		cmocka_unit_test(a_full_queue_refuses_and_loses_nothing),
		cmocka_unit_test(what_is_no_number_is_refused),
		cmocka_unit_test(bad_configurations_are_refused),
		cmocka_unit_test(an_axis_joins_where_it_stands),
		cmocka_unit_test(hold_waits_on_the_path),
		cmocka_unit_test(abort_slows_down_and_forgets),
		cmocka_unit_test(it_ends_however_little_is_left),
		cmocka_unit_test(stop_is_at_once),
		cmocka_unit_test(feed_changes_the_speed),
		cmocka_unit_test(a_pause_is_no_part_of_the_path),
		cmocka_unit_test(whatever_happens_it_stays_within_its_limits),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
