// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeysctl servo: move a servo motor, home it, change a gain, or clear its fault, without
 * LinuxCNC.
 *
 * The daemon controls and watches the motor. This program gives it a path, a thousand positions a
 * second with their velocities, and shows the following error. The path begins and ends at rest,
 * and without a jump of the acceleration (a polynomial of degree five). If this program is late,
 * the path waits for it: the motor gets slower, but has no jump to make up for.
 *
 * The motor is off when the program ends. If it is killed or hangs, the daemon switches the motor
 * off after the loss of its commander. All other motors of the device are off meanwhile.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <pokeys/names.h>
#include "tools/argument.h"
#include "tools/loop_run.h"
#include "tools/pokeysctl.h"
#include "tools/print.h"
#include "tools/servo_run.h"
#include "tools/view.h"

#define LATE_S 0.003		/* the path goes on by no more at once */
#define PEAK 1.875		/* of the speed over its mean, on such a path */
#define BEND 5.774		/* ... of the acceleration over way / time^2 */
#define RISE_S 0.2		/* from rest to the speed in no less */
#define REST_S 0.3		/* at each end of a swing, and of the whole */

#define NEAREST_PART 0.55	/* of the distance of tune, to a soft limit */

enum verb { MOVE, MOVE_TO, SWING, HOME, TUNE, GAIN, RESET, VERBS };

struct order {
	enum verb verb;
	double units, speed, seconds;
	struct loop_gain gain;
};

/* What was seen on the way. */
struct report {
	double worst;     /* following error while it moved, units */
	double rest;      /* ... at its end */
	double strongest; /* output, 0 to 1 */
};

static void note(struct report *report, const struct pokeys_servo *servo)
{
	report->worst = fmax(report->worst, fabs((double)servo->error));
	report->rest = fabs((double)servo->error);
	report->strongest = fmax(report->strongest, fabs((double)servo->output));
}

static double seconds_now(void)
{
	return (double)view_now() / 1e9;
}

/* One turn of whatever moves it; false if it is not enabled any more, after an error message. */
static bool turn(struct loop_run *run, struct report *report)
{
	char text[PRINT_SERVO_MAX];

	if (!loop_look(run))
		return false;
	if (!servo_run_is_enabled(run))
		return loop_explain(run);
	note(report, servo_run_of(run));
	loop_show(run, print_servo(servo_run_of(run), text), false);
	return true;
}

static bool rest(struct loop_run *run, double at, struct report *report)
{
	const double end = seconds_now() + REST_S;

	while (seconds_now() < end) {
		servo_run_want(run, true, at, 0);
		if (!turn(run, report))
			return false;
	}
	return true;
}

/* Parts of a way and of its mean velocity, at a part of the time. */
static double part_of_way(double t)
{
	return t * t * t * (10 + t * (6 * t - 15));
}

static double part_of_velocity(double t)
{
	return 30 * t * t * (1 - t) * (1 - t);
}

/*
 * *at goes on by `way`; where a signal ends it, the path's time slows down until it stands.
 * False after an error message.
 */
static bool travel(struct loop_run *run, double *at, double way, double speed,
		   struct report *report)
{
	const double from = *at, most = fabs(way);
	const double total = fmax(PEAK * most / speed, sqrt(BEND * most * RISE_S / speed));
	double t = 0, pace = 1, last = seconds_now();

	while (t < 1 && pace > 0) {
		const double now = seconds_now(), passed = fmin(now - last, LATE_S);

		last = now;
		if (commander_ended())
			pace = fmax(pace - passed / RISE_S, 0);
		t = fmin(t + pace * passed / total, 1);
		*at = from + way * part_of_way(t);
		servo_run_want(run, true, *at, way * part_of_velocity(t) * pace / total);
		if (!turn(run, report))
			return false;
	}
	return rest(run, *at, report);
}

static bool swing(struct loop_run *run, double *at, const struct order *order,
		  struct report *report)
{
	const double end = seconds_now() + (order->seconds > 0 ? order->seconds : INFINITY);
	double way = order->units;

	while (!commander_ended() && seconds_now() < end) {
		if (!travel(run, at, way, order->speed, report))
			return false;
		way = -way;
	}
	return true;
}

static bool is_within_limits(struct loop_run *run, double to)
{
	const struct pokeys_servo *servo = servo_run_of(run);

	if (!servo->homed || (to >= (double)servo->minimum && to <= (double)servo->maximum))
		return true;
	return loop_fails(run, "%g is beyond its soft limits, %g to %g", to, (double)servo->minimum,
			  (double)servo->maximum);
}

static bool move(struct loop_run *run, const struct order *order)
{
	struct report report = { .worst = 0 };
	double at, to;
	bool well;

	if (!servo_run_begin(run))
		return false;
	at = run->command.servo[run->index].position;
	to = order->verb == MOVE_TO ? order->units : at + order->units;
	well = is_within_limits(run, to);
	if (well && order->verb == SWING)
		well = swing(run, &at, order, &report);
	else if (well)
		well = travel(run, &at, to - at, order->speed, &report);
	well = servo_run_finish(run) && well;
	if (!well)
		return false;
	printf("%s: servo %s: at %.4f; following error at most %.4f, %.4f at rest; output at most "
	       "%.0f %%\n",
	       run->device, run->name, print_rounded(servo_run_of(run)->position, 4), report.worst,
	       report.rest, report.strongest * 100);
	return true;
}

static enum pokeys_outcome ask_home(struct loop_run *run, uint8_t flags)
{
	return loop_order(run, (struct pokeys_one_shot){
				       .operation = POKEYS_ONE_SHOT_SERVO_HOME,
				       .flags = flags,
			       });
}

/* Command the position that the daemon commands, so that the daemon can end its hold. */
static bool follow(struct loop_run *run, struct report *report)
{
	servo_run_want(run, true, servo_run_of(run)->commanded, 0);
	return turn(run, report);
}

/* Until it is homed, or not; where a signal ends it, until it stands. */
static bool seek(struct loop_run *run)
{
	struct report report = { .worst = 0 };
	bool ending = false;

	while (servo_run_of(run)->home_end == POKEYS_SERVO_HOME_NONE) {
		if (commander_ended() && !ending) {
			ending = true;
			if (ask_home(run, POKEYS_SERVO_END_HOMING) == POKEYS_OUTCOME_NONE)
				return false;
		}
		if (!follow(run, &report))
			return false;
	}
	while (servo_run_of(run)->homing != POKEYS_SERVO_HOMING_NONE)
		if (!follow(run, &report))
			return false;
	return rest(run, servo_run_of(run)->commanded, &report);
}

static bool home(struct loop_run *run)
{
	bool well;

	if (!servo_run_begin(run))
		return false;
	if (ask_home(run, 0) != POKEYS_OUTCOME_DONE)
		well = loop_fails(run, "not homed: pokeysd.conf has no home-search-speed for "
				       "this motor, or the motor is off");
	else
		well = seek(run);
	well = servo_run_finish(run) && well;
	if (!well)
		return false;
	if (servo_run_of(run)->home_end != POKEYS_SERVO_HOME_DONE)
		return loop_fails(run, "not homed: %s",
				  pokeys_servo_home_end_name(servo_run_of(run)->home_end));
	printf("%s: servo %s: homed, at %.4f\n", run->device, run->name,
	       print_rounded(servo_run_of(run)->position, 4));
	return true;
}

static enum pokeys_outcome ask_tune(struct loop_run *run, double distance)
{
	return loop_order(run, (struct pokeys_one_shot){
				       .operation = POKEYS_ONE_SHOT_SERVO_TUNE,
				       .parameter = { (float)distance },
			       });
}

/* Until gains are found, or not; a signal ends it. False after an error message. */
static bool search(struct loop_run *run)
{
	char text[PRINT_SERVO_MAX];
	bool ending = false;

	while (servo_run_of(run)->tuning == POKEYS_SERVO_TUNING_RUNS) {
		if (commander_ended() && !ending) {
			ending = true;
			if (ask_tune(run, 0) == POKEYS_OUTCOME_NONE)
				return false;
		}
		if (!loop_look(run))
			return false;
		loop_show(run, print_servo(servo_run_of(run), text), false);
	}
	return true;
}

/* What to write into pokeysd.conf; three digits are what is known. */
static void print_gains(const struct loop_run *run)
{
	const struct pokeys_servo *servo = servo_run_of(run);

	printf("%s: servo %s: gains found; with its full output, the motor reaches %.3g units/s^2\n"
	       "\n[servo %s]\npid-p = %.3g\npid-i = %.3g\npid-d = %.3g\nvelocity-gain = %.3g\n"
	       "acceleration-gain = %.3g\n",
	       run->device, run->name, (double)servo->tuned_acceleration, run->name,
	       (double)servo->tuned_p, (double)servo->tuned_i, (double)servo->tuned_d,
	       (double)servo->tuned_velocity_gain, (double)servo->tuned_acceleration_gain);
}

static bool tune(struct loop_run *run, double distance)
{
	bool well;

	if (!servo_run_begin(run))
		return false;
	if (ask_tune(run, distance) == POKEYS_OUTCOME_DONE)
		well = search(run);
	else
		well = loop_fails(run,
				  "refused: %g is less than 96 counts of the encoder, a "
				  "soft limit is nearer than %g, a limit switch is pressed, "
				  "or the motor moves",
				  distance, distance * NEAREST_PART);
	well = servo_run_finish(run) && well;
	if (!well)
		return false;
	if (servo_run_of(run)->tuning != POKEYS_SERVO_TUNING_DONE)
		return servo_run_of(run)->fault ?
			       loop_explain(run) :
			       loop_fails(run, "no gains found: %s",
					  pokeys_servo_tune_reason_name(servo_run_of(run)
										->tune_reason));
	print_gains(run);
	return true;
}

static bool reset(struct loop_run *run)
{
	servo_run_want(run, false, servo_run_of(run)->position, 0);
	return loop_reset(run, POKEYS_ONE_SHOT_SERVO_RESET, "it can be enabled again");
}

static bool regain(struct loop_run *run, const struct order *order)
{
	servo_run_want(run, false, servo_run_of(run)->position, 0);
	return loop_regain(run, POKEYS_ONE_SHOT_SERVO_GAIN, &order->gain);
}

static bool carry_out(struct loop_run *run, const struct order *order)
{
	if (order->verb == RESET)
		return reset(run);
	if (order->verb == HOME)
		return home(run);
	if (order->verb == TUNE)
		return tune(run, order->units);
	return order->verb == GAIN ? regain(run, order) : move(run, order);
}

static bool take_units(const char *text, double *units)
{
	char *after;

	*units = strtod(text, &after);
	return after != text && !*after && isfinite(*units) && fabs(*units) <= 1e6;
}

/* What a move needs. */
static bool take_move(const struct options *options, struct order *order)
{
	char *const *names = options->names;

	if (!take_units(names[3], &order->units)) {
		complain("\"%s\": positions are numbers from -1000000 to 1000000, in units of "
			 "counts-per-unit",
			 argument_written(names[3]));
		return false;
	}
	if (order->verb == TUNE) {
		if (order->units > 0 && order->speed <= 0)
			return true;
		complain(order->units > 0 ?
				 "--speed is for move, move-to and swing" :
				 "tune needs the distance that the motor may move, above 0");
		return false;
	}
	if (order->speed <= 0) {
		complain("%s needs --speed, in units/s", names[2]);
		return false;
	}
	return true;
}

static bool take(const struct options *options, struct order *order)
{
	static const struct loop_verb verbs[VERBS] = {
		[MOVE] = { "move", 4 },   [MOVE_TO] = { "move-to", 4 }, [SWING] = { "swing", 4 },
		[HOME] = { "home", 3 },   [TUNE] = { "tune", 4 },       [GAIN] = { "gain", 5 },
		[RESET] = { "reset", 3 },
	};
	char *const *names = options->names;
	const size_t verb = loop_take_verb(
		options, verbs, VERBS,
		"servo needs a device, a motor, and what to do: pokeysctl servo mill x move 10 "
		"--speed 5 (or move-to 0, swing 10, home, tune 20, gain pid-p 0.3, reset)");

	if (verb == VERBS)
		return false;
	*order = (struct order){ .verb = (enum verb)verb,
				 .speed = options->speed,
				 .seconds = options->duration_s };
	if (verb != SWING && options->duration_s > 0) {
		complain("--for is for swing");
		return false;
	}
	if ((verb == HOME || verb == GAIN || verb == RESET) && options->speed > 0) {
		complain("--speed is for move, move-to and swing");
		return false;
	}
	if (verb == GAIN)
		return loop_take_gain(&servo_run_kind, &names[3], &order->gain);
	return verb == RESET || verb == HOME || take_move(options, order);
}

int command_servo(const struct options *options)
{
	static struct loop_run run;
	struct order order;
	bool well = false;
	int status = STATUS_FAILED;

	if (!take(options, &order))
		return STATUS_USAGE;
	if (loop_open(&run, &servo_run_kind, options, &status))
		well = carry_out(&run, &order);
	loop_close(&run);
	return well ? STATUS_OK : status;
}
