/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Homing against a motor with a switch: where it ends, that it never commands more than its speed
 * and acceleration, and how each state ends if the switch, its readings or the motor fail.
 */
#include "tests/loops/axis.h"

#include <math.h>
#include <string.h>
#include "daemon/loops/servo_home.h"
#include "sim/prng.h"

#define MS UINT64_C(1000000)
enum { UNITS = 5 }; /* of the screw, in a turn */

/* The switch is pressed at and beyond this place of the screw. */
static struct {
	double at;
	double direction;      /* 1: pressed above it */
	bool stuck, cut, deaf; /* always pressed; never; no readings */
	bool limits;           /* it is the limit switch as well */
	unsigned int bounce;   /* readings for which it bounces after each change */
	bool pressed;
	unsigned int bouncing;
} contact;

static struct axis axis;
static struct servo_home home;
static struct servo_config motor;

static const struct servo_home_config usual = {
	.search = -50,
	.latch = 2,
	.acceleration = 1000,
	.offset = 10,
	.position = 20,
	.distance = 300,
};

static double place(void)
{
	return axis.motor.angle / (2 * M_PI) * UNITS;
}

static bool is_active(void)
{
	const bool pressed = contact.stuck ||
			     (!contact.cut && (place() - contact.at) * contact.direction >= 0);

	if (pressed != contact.pressed)
		contact.bouncing = contact.bounce;
	contact.pressed = pressed;
	if (!contact.bouncing)
		return pressed;
	contact.bouncing--;
	return contact.bouncing % 2 ? !pressed : pressed;
}

/* A cycle. The path is one that an axis can follow. */
static void step(void)
{
	static uint64_t read_ns;
	const struct servo_wish commanded = axis.wish;
	const double speed = home.speed, before = home.path;
	const enum servo_home_state state = home.state;
	const struct servo_home_input input = {
		.active = is_active(),
		.limit = contact.limits,
		.read_ns = contact.deaf ? read_ns : axis.count_ns,
	};
	double jump;

	read_ns = input.read_ns;
	axis.input.low = contact.limits && contact.direction < 0 && input.active;
	axis.input.seeks_low = contact.limits && servo_home_moves(&home);
	servo_home_step(&home, &axis.servo, &input, &axis.wish, axis.now_ns + AXIS_CYCLE_NS);
	axis.input.seeks_low = contact.limits && servo_home_moves(&home);
	if (state != SERVO_HOME_IDLE && home.state != SERVO_HOME_IDLE) {
		jump = home.path - before;
		if (state == SERVO_HOME_APPROACH && home.state == SERVO_HOME_GO)
			jump -= home.config.offset - home.edge;
		assert_true(fabs(home.speed - speed) <= home.config.acceleration * 0.001001 * 3);
		assert_true(fabs(home.speed) <= fabs(home.config.search) + 1e-9);
		assert_true(fabs(jump) <=
			    fabs(home.config.search) * 0.001001 + home.config.acceleration * 4e-6);
	}
	axis_step(&axis);
	axis.wish = commanded;
}

static void run(double seconds)
{
	for (long cycles = lround(seconds * 1000); cycles > 0; cycles--)
		step();
}

/* At this place of the screw, enabled, its switch below 0 or above. */
static void begin_at(const struct servo_home_config *config, double at)
{
	const char *why;

	axis_init(&axis, &motor, &sim_motor_small);
	why = servo_home_init(&home, config, &motor);
	if (why)
		fail_msg("%s", why);
	contact.stuck = contact.cut = contact.deaf = contact.pressed = contact.limits = false;
	contact.bounce = contact.bouncing = 0;
	contact.direction = copysign(1, config->search);
	contact.at = -at;
	axis_enable(&axis);
}

static void begin_homing(const struct servo_home_config *config, double at)
{
	begin_at(config, at);
	assert_true(servo_home_begin(&home, &axis.servo, axis.now_ns));
	assert_false(axis.servo.homed);
	/* what is commanded meanwhile does not matter */
	axis.wish.position = 1e6;
	axis.wish.velocity = NAN;
}

static int begin(void **state)
{
	(void)state;
	motor = axis_config;
	return 0;
}

static void until_state(enum servo_home_state state)
{
	for (int i = 0; home.state != state; i++) {
		assert_true(i < 60000);
		step();
	}
}

static void expect_held(enum servo_home_end end)
{
	until_state(SERVO_HOME_HOLD);
	assert_int_equal(home.end, end);
	run(1);
	assert_int_equal(home.state, SERVO_HOME_HOLD);
	assert_true(home.speed == 0 && axis.servo.enabled);
	assert_true(fabs(axis.servo.position - home.path) < 0.02);
	assert_true(fabs(axis.servo.rate) < 1);
}

/* The switch closes at `offset`, as far as a cycle of the slow approach tells. */
static void expect_homed(void)
{
	expect_held(SERVO_HOME_DONE);
	assert_true(axis.servo.homed);
	assert_true(fabs(axis.servo.position - (place() - contact.at) - home.config.offset) <
		    home.config.latch * 0.0008 + 1.5 / motor.scale);
	assert_true(fabs(axis.servo.position - home.config.position) < 0.02);
	/* the commander is somewhere else; then it is here */
	axis.wish.position = home.config.position + 3;
	run(0.5);
	assert_int_equal(home.state, SERVO_HOME_HOLD);
	axis.wish.position = home.config.position;
	run(0.09);
	assert_int_equal(home.state, SERVO_HOME_HOLD);
	run(0.02);
	assert_int_equal(home.state, SERVO_HOME_IDLE);
	for (int i = 0; i < 500; i++) {
		axis.wish.position += 0.01;
		axis.wish.velocity = 10;
		step();
	}
	axis.wish.velocity = 0;
	run(0.1);
	assert_true(fabs(axis.servo.position - home.config.position - 5) < 0.02);
	axis_expect_fault(&axis, SERVO_FINE);
}

static void it_finds_its_switch_from_wherever_it_is(void **state)
{
	static const double places[] = { -40, -0.2, -0.001, 0, 0.001, 0.1, 3, 70, 280 };

	(void)state;
	for (int direction = -1; direction <= 1; direction += 2)
		for (size_t i = 0; i < sizeof(places) / sizeof(places[0]); i++) {
			struct servo_home_config config = usual;

			config.search *= -direction;
			config.position = config.offset + 10 * direction;
			/* 1 away from the switch in the direction that is free */
			begin_homing(&config, places[i] * direction);
			expect_homed();
		}
}

static void any_speeds_and_switches_will_do(void **state)
{
	struct sim_prng prng;

	(void)state;
	sim_prng_init(&prng, 32007);
	for (int i = 0; i < 60; i++) {
		const double search = 1 + sim_prng_unit(&prng) * 120;
		struct servo_home_config config = {
			.search = sim_prng_unit(&prng) < 0.5 ? search : -search,
			.latch = fmax(search / (2 + sim_prng_unit(&prng) * 20), 0.2),
			.acceleration = search / (0.02 + sim_prng_unit(&prng) * 0.4),
			.offset = sim_prng_unit(&prng) * 40 - 20,
			.distance = 400,
		};

		config.latch = fmin(config.latch, 10);
		config.position = config.offset -
				  copysign(3 + sim_prng_unit(&prng) * 20, config.search);
		begin_homing(&config, sim_prng_unit(&prng) * 60 - 30);
		contact.bounce = (unsigned int)(sim_prng_unit(&prng) * 6);
		/* where it closes is not better known than for as long as it bounces */
		config.latch *= 1 + contact.bounce;
		home.config.latch = config.latch / (1 + contact.bounce);
		expect_held(SERVO_HOME_DONE);
		assert_true(axis.servo.homed);
		assert_true(fabs(axis.servo.position - (place() - contact.at) - config.offset) <
			    config.latch * 0.0008 + 1.5 / motor.scale);
	}
}

/* Only who commands it to stay there means it, and it gets there without a jump. */
static void it_is_handed_over_without_a_jump(void **state)
{
	double before;

	(void)state;
	begin_homing(&usual, 30);
	expect_held(SERVO_HOME_DONE);
	/* somebody passes by */
	axis.wish.position = usual.position - 3;
	axis.wish.velocity = 50;
	for (int i = 0; i < 200; i++) {
		axis.wish.position += 0.05;
		before = home.path;
		step();
		assert_int_equal(home.state, SERVO_HOME_HOLD);
		assert_true(home.path >= before && home.path <= before);
	}
	/* further than half of what it may be off */
	axis.wish.position = usual.position + 0.3;
	axis.wish.velocity = NAN;
	run(1);
	assert_int_equal(home.state, SERVO_HOME_HOLD);
	assert_true(home.path >= before && home.path <= before);
	axis.wish.position = usual.position + 0.2;
	for (int i = 0; i < 1000 && home.state == SERVO_HOME_HOLD; i++) {
		before = home.path;
		step();
		assert_true(fabs(home.path - before) <= usual.latch * 0.001001);
	}
	assert_int_equal(home.state, SERVO_HOME_IDLE);
	run(0.1);
	assert_true(fabs(axis.servo.position - usual.position - 0.2) < 0.02);
}

static void it_begins_from_standstill(void **state)
{
	(void)state;
	begin_at(&usual, 30);
	for (int i = 0; i < 200; i++) {
		axis.wish.velocity = fmin(i, 30);
		axis.wish.position += axis.wish.velocity / 1000;
		step();
	}
	assert_false(servo_home_begin(&home, &axis.servo, axis.now_ns));
	assert_int_equal(home.state, SERVO_HOME_IDLE);
}

/* It closes once more after it had opened for long, while the axis still moves away. */
static void a_switch_that_is_left_is_no_place(void **state)
{
	(void)state;
	for (int first = 1; first <= 40; first++) {
		begin_homing(&usual, 5);
		until_state(SERVO_HOME_APPROACH);
		run(first / 1000.0);
		contact.stuck = true;
		run(0.008);
		contact.stuck = false;
		/* for 50 ms */
		assert_int_not_equal(home.state, SERVO_HOME_GO);
		expect_homed();
	}
}

/* Where it opens for some moments while it is pressed, it is not left. */
static void a_contact_that_opens_is_not_left(void **state)
{
	(void)state;
	for (int first = 1; first <= 60; first += 2)
		for (int deep = 0; deep < 2; deep++) {
			begin_homing(&usual, deep ? -10 : 5);
			until_state(deep ? SERVO_HOME_LEAVE : SERVO_HOME_BACK);
			run(first / 1000.0);
			contact.cut = true;
			run(0.015);
			contact.cut = false;
			expect_homed();
		}
}

static void one_reading_at_the_beginning_is_no_switch(void **state)
{
	(void)state;
	begin_homing(&usual, 60);
	step();
	contact.stuck = true;
	step();
	contact.stuck = false;
	expect_homed();
}

/* What was not read where the switch closes would be a place that nobody knows. */
static void readings_that_are_lost_are_no_place(void **state)
{
	(void)state;
	motor.stale_ns = 100 * MS;
	for (int before = 1; before < 80; before += 3) {
		begin_homing(&usual, 5);
		until_state(SERVO_HOME_APPROACH);
		while ((place() - contact.at) * contact.direction < 0 &&
		       fabs(place() - contact.at) * 1000 / usual.latch > before)
			step();
		contact.deaf = true;
		run(0.08);
		contact.deaf = false;
		expect_homed();
	}
}

/* Its load is held by an output that does not change, while the encoder does not count. */
static void an_axis_that_carries_a_load_homes(void **state)
{
	struct servo_home_config config = usual;

	(void)state;
	config.latch = 0.02;
	begin_at(&config, 5);
	axis.motor.torque = -0.5;
	run(0.5);
	assert_true(fabs(axis.output) > 0.3);
	assert_true(servo_home_begin(&home, &axis.servo, axis.now_ns));
	axis.wish.position = 1e6;
	for (int i = 0; home.state != SERVO_HOME_HOLD; i++) {
		assert_true(i < 400000);
		step();
		axis_expect_fault(&axis, SERVO_FINE);
	}
	assert_int_equal(home.end, SERVO_HOME_DONE);
	run(1);
	/* another number for where it is held is no change of what holds it */
	servo_renumber(&axis.servo, 5, true);
	home.path += 5;
	run(1);
	axis_expect_fault(&axis, SERVO_FINE);
}

/* Wherever it ends on its limit switch, it is held there, and may only leave. */
static void ended_on_its_limit_switch_it_is_held(void **state)
{
	unsigned int on = 0;

	(void)state;
	for (unsigned int i = 0; i < 120; i++) {
		begin_at(&usual, i < 60 ? 5 : -3);
		contact.limits = true;
		axis.wish.enable = false;
		run(0.01);
		axis.wish.enable = true;
		run(0.01);
		assert_true(axis.servo.enabled);
		assert_true(servo_home_begin(&home, &axis.servo, axis.now_ns));
		axis.wish.position = 1e6;
		run(0.01 + i % 60 * 0.006);
		if (!servo_home_abort(&home, &axis.servo))
			break;
		expect_held(SERVO_HOME_ABORTED);
		axis_expect_fault(&axis, SERVO_FINE);
		if (!is_active())
			continue;
		on++;
		/* taken over there, it goes no further */
		axis.wish.position = home.path;
		axis.wish.velocity = 0;
		run(0.11);
		assert_int_equal(home.state, SERVO_HOME_IDLE);
		axis_expect_fault(&axis, SERVO_FINE);
		for (int k = 0; k < 100 && !axis.servo.fault; k++) {
			axis.wish.position += i % 2 ? 0.02 : -0.02;
			step();
		}
		axis_expect_fault(&axis, i % 2 ? SERVO_FINE : SERVO_SWITCH);
	}
	assert_true(on > 20);
}

/* Nor may it creep there, in whatever small steps it is commanded to. */
static void held_on_its_limit_switch_it_goes_no_further(void **state)
{
	double from;

	(void)state;
	begin_homing(&usual, 5);
	contact.limits = true;
	until_state(SERVO_HOME_BACK);
	assert_true(servo_home_abort(&home, &axis.servo));
	expect_held(SERVO_HOME_ABORTED);
	assert_true(is_active());
	from = place();
	axis.wish.velocity = NAN;
	axis.wish.position = home.path - 0.1;
	for (int i = 0; i < 1000; i++) {
		if (i % 4 == 0)
			axis.wish.position -= 0.006;
		step();
	}
	assert_int_equal(home.state, SERVO_HOME_HOLD);
	assert_true(fabs(place() - from) < 0.01);
	axis.wish.position = home.path - 0.2;
	run(1);
	axis_expect_fault(&axis, SERVO_SWITCH);
	assert_true(fabs(place() - from) < 0.1);
}

/* One that sticks where it was found is not fled from. */
static void a_switch_that_stays_closed_is_not_run_away_from(void **state)
{
	double from;

	(void)state;
	begin_homing(&usual, 30);
	until_state(SERVO_HOME_BACK);
	from = place();
	contact.stuck = true;
	expect_held(SERVO_HOME_NOT_LEFT);
	assert_true(fabs(place() - from) < 15);
}

/* It is read as pressed for a moment, where it is not. */
static void a_disturbance_is_no_switch(void **state)
{
	(void)state;
	begin_homing(&usual, 100);
	until_state(SERVO_HOME_SEARCH);
	for (int i = 0; i < 100; i++) {
		contact.stuck = i % 10 < 2;
		step();
		assert_int_equal(home.state, SERVO_HOME_SEARCH);
	}
	contact.stuck = false;
	expect_homed();
}

static void without_a_switch_it_ends(void **state)
{
	double gone;

	(void)state;
	begin_homing(&usual, 100);
	contact.cut = true;
	gone = place();
	expect_held(SERVO_HOME_NOT_FOUND);
	gone = fabs(place() - gone);
	assert_true(gone >= usual.distance &&
		    gone < usual.distance + usual.search * usual.search / usual.acceleration);
	assert_false(axis.servo.homed);
	/* a switch that is always pressed */
	begin_homing(&usual, 100);
	contact.stuck = true;
	expect_held(SERVO_HOME_NOT_LEFT);
	assert_false(axis.servo.homed);
	/* and one that sticks when it is pressed, or breaks then */
	begin_homing(&usual, 100);
	until_state(SERVO_HOME_BACK);
	contact.stuck = true;
	expect_held(SERVO_HOME_NOT_LEFT);
	begin_homing(&usual, 100);
	until_state(SERVO_HOME_APPROACH);
	contact.cut = true;
	gone = place();
	expect_held(SERVO_HOME_NOT_FOUND);
	assert_true(fabs(place() - gone) < 15);
	assert_false(axis.servo.homed);
}

static const enum servo_home_state states[] = {
	SERVO_HOME_LEAVE, SERVO_HOME_SEARCH, SERVO_HOME_BACK, SERVO_HOME_APPROACH, SERVO_HOME_GO,
};

enum { STATES = sizeof(states) / sizeof(states[0]) };

static void in_state(unsigned int i)
{
	begin_homing(&usual, states[i] == SERVO_HOME_LEAVE ? -5 : 5);
	until_state(states[i]);
	run(0.03);
	assert_int_equal(home.state, states[i]);
}

static void it_can_be_aborted_in_each_state(void **state)
{
	double from;

	(void)state;
	for (unsigned int i = 0; i < STATES; i++) {
		in_state(i);
		from = place();
		assert_true(servo_home_abort(&home, &axis.servo));
		assert_false(servo_home_abort(&home, &axis.servo));
		expect_held(SERVO_HOME_ABORTED);
		assert_true(fabs(place() - from) <
			    usual.search * usual.search / usual.acceleration);
		assert_false(axis.servo.homed);
		/* and begun again */
		assert_true(servo_home_begin(&home, &axis.servo, axis.now_ns));
		expect_homed();
	}
}

static void it_ends_with_the_motor_in_each_state(void **state)
{
	(void)state;
	for (unsigned int i = 0; i < STATES; i++)
		for (int way = 0; way < 3; way++) {
			in_state(i);
			if (way == 0)
				axis.wish.enable = false;
			else if (way == 1)
				axis.wish.alive = false;
			else
				axis.input.emergency = true;
			step();
			assert_true(axis.output == 0 && !axis.servo.enabled);
			step();
			assert_int_equal(home.state, SERVO_HOME_IDLE);
			assert_int_equal(home.end, SERVO_HOME_STOPPED);
			assert_false(servo_home_begin(&home, &axis.servo, axis.now_ns));
		}
}

static void it_needs_readings_of_its_switch(void **state)
{
	(void)state;
	for (unsigned int i = 0; i < STATES; i++) {
		in_state(i);
		contact.deaf = true;
		run((double)motor.stale_ns / 1e9 + 0.002);
		if (states[i] == SERVO_HOME_GO)
			expect_held(SERVO_HOME_DONE);
		else
			expect_held(SERVO_HOME_UNREAD);
	}
}

/* Its path stands still while its time goes on, for a thread that is hardly ever run. */
static void it_has_a_time(void **state)
{
	(void)state;
	in_state(1);
	for (unsigned int i = 0; i < 100 && servo_home_moves(&home); i++) {
		const struct servo_home_input input = { .read_ns = axis.now_ns + i * 1000 * MS };
		struct servo_wish wish = axis.wish;

		servo_home_step(&home, &axis.servo, &input, &wish, input.read_ns);
	}
	assert_int_equal(home.end, SERVO_HOME_LATE);
}

static void soft_limits_hold_once_it_is_homed(void **state)
{
	(void)state;
	motor.least = 15;
	motor.most = 60;
	begin_homing(&usual, 40);
	expect_held(SERVO_HOME_DONE);
	axis.wish.position = usual.position;
	run(0.11);
	for (int i = 0; i < 1000 && !axis.servo.fault; i++) {
		axis.wish.position -= 0.02;
		axis.wish.velocity = -20;
		step();
	}
	axis_expect_fault(&axis, SERVO_SOFT_LIMIT);
	assert_true(fabs(axis.servo.position - 15) < 0.2);
}

static void one_without_a_switch_has_no_homing(void **state)
{
	const struct servo_home_config none = { 0 };

	(void)state;
	begin_at(&none, 0);
	assert_false(servo_home_begin(&home, &axis.servo, axis.now_ns));
	assert_false(servo_home_abort(&home, &axis.servo));
	run(0.1);
	assert_int_equal(home.state, SERVO_HOME_IDLE);
	/* nor has a motor that is off */
	begin_at(&usual, 0);
	axis.wish.enable = false;
	run(0.01);
	assert_false(servo_home_begin(&home, &axis.servo, axis.now_ns));
}

#define REFUSES(field, value, words) do {						\
	struct servo_home_config config = usual;					\
	const char *why;								\
											\
	config.field = value;								\
	why = servo_home_init(&home, &config, &motor);					\
	assert_non_null(why);								\
	assert_non_null(strstr(why, words));						\
} while (0)

static void what_cannot_be_is_refused(void **state)
{
	(void)state;
	REFUSES(search, -301, "home-search-speed");
	REFUSES(search, NAN, "home-search-speed");
	REFUSES(latch, 0, "home-latch-speed");
	REFUSES(latch, 51, "home-latch-speed");
	REFUSES(latch, NAN, "home-latch-speed");
	REFUSES(acceleration, 0, "home-acceleration");
	REFUSES(acceleration, INFINITY, "home-acceleration");
	REFUSES(acceleration, 8, "home-distance");
	REFUSES(position, 311, "home-position");
	REFUSES(distance, INFINITY, "home-distance");
	REFUSES(distance, 0, "home-distance");
	REFUSES(offset, NAN, "home-offset");
	motor.most = 19;
	REFUSES(position, 20, "home-position");
}

static void disturb(int milliseconds)
{
	contact.stuck = true;
	for (int k = 0; k < milliseconds; k++)
		step();
	contact.stuck = false;
}

/* What closes on the slow way before the switch has to be there is a disturbance, or two. */
static void a_disturbance_on_the_approach_is_no_place(void **state)
{
	(void)state;
	for (int first = 20; first < 900; first += 20) {
		for (int length = 3; length < 10; length += 2) {
			begin_homing(&usual, 30);
			until_state(SERVO_HOME_APPROACH);
			for (int k = 0; k < first && home.state == SERVO_HOME_APPROACH; k++)
				step();
			if (home.state == SERVO_HOME_APPROACH)
				disturb(length);
			/* on its second way back as well */
			for (int k = 0; k < 400 && home.state != SERVO_HOME_APPROACH; k++)
				step();
			for (int k = 0; k < 2 * first && home.state == SERVO_HOME_APPROACH; k++)
				step();
			if (home.state == SERVO_HOME_APPROACH)
				disturb(length);
			expect_held(SERVO_HOME_DONE);
			assert_int_equal(home.rounds, 0);
			assert_true(fabs(axis.servo.position - (place() - contact.at) -
					 usual.offset) < 0.02);
		}
	}
}

/* Where it ends it does not go beyond. */
/* It goes on while it makes sure of its switch: that is way as well. */
static void an_approach_as_fast_as_the_search_homes(void **state)
{
	struct servo_home_config config = usual;

	(void)state;
	config.search = -20;
	config.latch = 20;
	config.acceleration = 2000;
	motor.follow_least = motor.follow_most = 0.5;
	begin_homing(&config, 15);
	for (long k = 0; home.state != SERVO_HOME_HOLD; k++) {
		assert_in_range(k, 0, 60000);
		axis.silent = k % 4 > 0;
		step();
	}
	assert_int_equal(home.end, SERVO_HOME_DONE);
}

static void it_does_not_pass_its_home_position(void **state)
{
	(void)state;
	begin_homing(&usual, 30);
	until_state(SERVO_HOME_GO);
	while (home.state == SERVO_HOME_GO) {
		assert_true(home.path <= usual.position + 2e-3);
		step();
	}
	assert_int_equal(home.end, SERVO_HOME_DONE);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(a_disturbance_on_the_approach_is_no_place, begin),
		cmocka_unit_test_setup(an_approach_as_fast_as_the_search_homes, begin),
		cmocka_unit_test_setup(it_does_not_pass_its_home_position, begin),
		cmocka_unit_test_setup(it_finds_its_switch_from_wherever_it_is, begin),
		cmocka_unit_test_setup(any_speeds_and_switches_will_do, begin),
		cmocka_unit_test_setup(it_is_handed_over_without_a_jump, begin),
		cmocka_unit_test_setup(it_begins_from_standstill, begin),
		cmocka_unit_test_setup(a_switch_that_is_left_is_no_place, begin),
		cmocka_unit_test_setup(a_contact_that_opens_is_not_left, begin),
		cmocka_unit_test_setup(one_reading_at_the_beginning_is_no_switch, begin),
		cmocka_unit_test_setup(readings_that_are_lost_are_no_place, begin),
		cmocka_unit_test_setup(an_axis_that_carries_a_load_homes, begin),
		cmocka_unit_test_setup(ended_on_its_limit_switch_it_is_held, begin),
		cmocka_unit_test_setup(held_on_its_limit_switch_it_goes_no_further, begin),
		cmocka_unit_test_setup(a_switch_that_stays_closed_is_not_run_away_from, begin),
		cmocka_unit_test_setup(a_disturbance_is_no_switch, begin),
		cmocka_unit_test_setup(without_a_switch_it_ends, begin),
		cmocka_unit_test_setup(it_can_be_aborted_in_each_state, begin),
		cmocka_unit_test_setup(it_ends_with_the_motor_in_each_state, begin),
		cmocka_unit_test_setup(it_needs_readings_of_its_switch, begin),
		cmocka_unit_test_setup(it_has_a_time, begin),
		cmocka_unit_test_setup(soft_limits_hold_once_it_is_homed, begin),
		cmocka_unit_test_setup(one_without_a_switch_has_no_homing, begin),
		cmocka_unit_test_setup(what_cannot_be_is_refused, begin),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
