/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A motor with a constant output gets faster by what drives it, less what its speed takes away (its
 * own voltage, and viscous friction), less dry friction. Pushed back and forth, it tells all three:
 * dry friction drives with its output while it brakes and against it while it speeds up.
 *
 * Speeds of single readings are noise of the counts. So each equation is one of a window of
 * readings with the same output and direction: the change of speed over it, the way, and the time.
 * All windows together are solved by least squares.
 *
 * How far it goes on when its output is turned is not known before. It speeds up against friction
 * and brakes with it, so it needs no more way than it took, but for a load that hangs on it. Later
 * it is what it was the last time.
 *
 * The gains: velocity and acceleration by the model; p and d for a loop without overshoot that is
 * as fast as the delay of readings and outputs lets it be, and not so fast that single counts are
 * heard.
 */

#include "daemon/loops/servo_tune.h"

#include <math.h>
#include <string.h>

#include "daemon/loops/duration.h"

#define REST_NS UINT64_C(100000000)	/* it stands for so long without output */
#define REST_MOST_NS UINT64_C(1000000000)
#define RAMP 0.4		/* output a second, until it moves */
#define REST_COUNTS 2
#define MOVED_COUNTS 12
#define BEGIN_TIMES 1.5		/* ... of the output with which it has moved, */
#define BEGIN_MORE 0.03
#define LEAST_TIMES 1.1		/* ... with less it may not come loose where it turns */
#define GROW 1.3		/* from turn to turn */
#define LONG_S 0.5
#define GROW_SOON 2.0
#define SHORTEST 100		/* readings from turn to turn: some windows are in it */
#define FASTEST 0.5		/* of max-speed */
#define TOO_FAST 1.1		/* times that */
#define NEARLY 0.9		/* ... it is expected to reach that */
#define FASTEST_SOON 0.75	/* ... until there are some readings */
#define PART 0.4		/* of the distance, to each side */
#define FAR 0.55
#define TURNS 16
#define EQUATIONS 300
#define BRAKE_TIMES 2.0		/* speed, for what it slows down by until that is seen */
#define BRAKE_MOST_NS UINT64_C(300000000)
#define LONGEST_NS UINT64_C(30000000000)
#define SILENT_S 0.06		/* it stands for no longer where it turns, */
#define SILENT 25		/* ... or for so many readings */
#define SETTLE 4		/* readings after the output has changed */
#define EDGE 8			/* readings, for a speed */
#define FIT 0.9			/* part of the changes of speed, or ways, that it explains */
#define LAG_PART 0.1		/* of the delay: less is not seen */
#define MORE_DELAY_S 0.001	/* of the amplifier and the winding */
#define QUICK 0.4		/* radians, over the delay */
#define DAMPING 0.9
#define INTEGRAL_PART 0.1
#define HEARD 0.03		/* output for a count */
#define STANDS_PART 0.01	/* of max-speed: it is not commanded to move, */
#define RESTS_PART 0.05		/* ... nor does it */
#define ROUNDED 1e-6		/* a limit that came as a float */
#define STILL_MORE 0.1		/* above silent-output: the watch would say that it is silent */

/* The terms of an equation. */
enum { PUSHED, MOVED, RUBBED, SPED_UP };

/* It stands, and nothing is so near that it would stop there. */
static bool has_room(const struct servo *servo, double distance)
{
	const double low = servo->position - FAR * distance;
	const double high = servo->position + FAR * distance;

	return fabs(servo->wanted_rate) <= servo->config.speed_most * STANDS_PART &&
	       fabs(servo->rate) <= servo->config.speed_most * RESTS_PART && isnan(servo->low_at) &&
	       isnan(servo->high_at) &&
	       (!servo->homed || (low >= servo->config.least && high <= servo->config.most));
}

bool servo_tune_begin(struct servo_tune *tune, const struct servo *servo, double distance,
		      double most, uint64_t now_ns)
{
	const double output_most = servo->config.output_most;

	if (!servo->enabled || tune->state == SERVO_TUNE_RUNS || !(distance > 0) ||
	    !isfinite(distance) || !(most >= 0 && most <= output_most * (1 + ROUNDED)) ||
	    distance * fabs(servo->config.scale) < 8 * MOVED_COUNTS || !has_room(servo, distance))
		return false;
	*tune = (struct servo_tune){
		.state = SERVO_TUNE_RUNS,
		.distance = distance,
		.most = most > 0 ? fmin(most, output_most) : output_most,
		.from = servo->position,
		.begun_at = servo->position,
		.turned_at = servo->position,
		.begun_ns = now_ns,
		.turned_ns = now_ns,
		.rested_ns = now_ns,
		.step_ns = now_ns,
		.sign = 1,
	};
	return true;
}

static bool fail(struct servo_tune *tune, enum servo_tune_reason reason)
{
	tune->state = SERVO_TUNE_FAILED;
	tune->reason = reason;
	return true;
}

bool servo_tune_abort(struct servo_tune *tune)
{
	return tune->state == SERVO_TUNE_RUNS && fail(tune, SERVO_TUNE_STOPPED);
}

/* The output is another one from now on. */
static void change(struct servo_tune *tune, double output, uint64_t now_ns)
{
	tune->output = output;
	tune->places = 0;
	tune->turned_ns = tune->waited_ns = tune->applied_ns = now_ns;
	tune->applied = false;
	tune->peak = 0;
}

static void add_equation(struct servo_tune *tune, const double row[SERVO_TUNE_TERMS])
{
	for (unsigned int i = 0; i < SERVO_TUNE_TERMS; i++)
		for (unsigned int k = 0; k < SERVO_TUNE_TERMS; k++)
			tune->moment[i][k] += row[i] * row[k];
	tune->equations++;
}

static double seconds_between(const struct servo_tune *tune, unsigned int from, unsigned int to)
{
	return (double)(tune->place_ns[to] - tune->place_ns[from]) / SECOND;
}

/* The window is full: the speeds at its ends are those between some readings. */
static void take_window(struct servo_tune *tune)
{
	const unsigned int last = SERVO_TUNE_WINDOW - 1;
	const double first_rate = (tune->place[EDGE] - tune->place[0]) /
				  seconds_between(tune, 0, EDGE);
	const double last_rate = (tune->place[last] - tune->place[last - EDGE]) /
				 seconds_between(tune, last - EDGE, last);
	const double seconds = seconds_between(tune, EDGE / 2, last - EDGE / 2);
	const double way = tune->place[last - EDGE / 2] - tune->place[EDGE / 2];
	const double direction = first_rate > 0 ? 1 : -1;

	if (first_rate * last_rate <= 0)
		return;
	add_equation(tune, (const double[SERVO_TUNE_TERMS]){
				   [PUSHED] = tune->output * seconds,
				   [MOVED] = way,
				   [RUBBED] = direction * seconds,
				   [SPED_UP] = last_rate - first_rate,
			   });
}

/* A new reading. */
static void take_place(struct servo_tune *tune, const struct servo *servo)
{
	const unsigned int last = SERVO_TUNE_WINDOW - 1;
	const double passed_s = (double)(servo->read_ns - tune->read_ns) / SECOND;

	if (tune->read_ns)
		tune->interval += (passed_s - tune->interval) / (tune->interval > 0 ? 16 : 1);
	tune->places++;
	if (tune->places <= SETTLE)
		return;
	memmove(&tune->place[0], &tune->place[1], last * sizeof(tune->place[0]));
	memmove(&tune->place_ns[0], &tune->place_ns[1], last * sizeof(tune->place_ns[0]));
	tune->place[last] = servo->position;
	tune->place_ns[last] = servo->read_ns;
	if (tune->push > 0 && tune->places >= SETTLE + SERVO_TUNE_WINDOW)
		take_window(tune);
}

/* It has stopped after its output was turned, and goes back: how it has braked. */
static void note_braking(struct servo_tune *tune, const struct servo *servo)
{
	const double way = fabs(servo->position - tune->turned_from);

	tune->turned_at = servo->position;
	if (tune->turned_rate > 0 && way * fabs(servo->config.scale) >= MOVED_COUNTS)
		tune->braking[tune->sign > 0] = tune->turned_rate * tune->turned_rate / (2 * way);
	tune->turned_rate = 0;
}

/* By far: what happens to some of its turns only does not matter. */
static double median(const double *of, unsigned int count)
{
	double sorted[SERVO_TUNE_TURNS];

	for (unsigned int i = 0; i < count; i++) {
		unsigned int at = i;

		for (; at && sorted[at - 1] > of[i]; at--)
			sorted[at] = sorted[at - 1];
		sorted[at] = of[i];
	}
	return count ? sorted[count / 2] : 0;
}

/* A turned output is applied: how long it has taken, as usual, in the slower direction. */
static void note_dead(struct servo_tune *tune)
{
	const unsigned int up = tune->sign > 0;
	double *dead = tune->dead_of[up];

	memmove(&dead[1], &dead[0], (SERVO_TUNE_TURNS - 1) * sizeof(dead[0]));
	dead[0] = (double)since(tune->turned_ns, tune->waited_ns) / SECOND;
	if (tune->deads[up] < SERVO_TUNE_TURNS)
		tune->deads[up]++;
	tune->dead = fmax(median(tune->dead_of[0], tune->deads[0]),
			  median(tune->dead_of[1], tune->deads[1]));
}

/* How far it would go on, if its output were turned now. */
static double way_on(const struct servo_tune *tune, const struct servo *servo)
{
	const double rate = fabs(servo->rate), braking = tune->braking[tune->sign < 0];
	const double late = rate * (tune->delay + servo->config.smooth + tune->dead);

	if (braking <= 0)
		return fabs(servo->position - tune->turned_at) + late;
	return rate * rate / (2 * braking) + late;
}

static double fastest(const struct servo *servo)
{
	return FASTEST * servo->config.speed_most;
}

static void turn(struct servo_tune *tune, const struct servo *servo, uint64_t now_ns)
{
	const double seconds = (double)since(tune->applied_ns, now_ns) / SECOND;
	const double least = SHORTEST * tune->interval;

	if (seconds < least / 2 || tune->peak > TOO_FAST * fastest(servo) ||
	    (seconds < least && tune->peak >= fastest(servo) * NEARLY))
		tune->push = fmax(tune->push / GROW, tune->least);
	else if (seconds > least && tune->peak < fastest(servo))
		tune->push = fmin(tune->push * (seconds > LONG_S ? GROW_SOON : GROW), tune->most);
	tune->turned_rate = fabs(servo->rate);
	tune->turned_from = servo->position;
	tune->sign = -tune->sign;
	tune->turns++;
	change(tune, tune->sign * tune->push, now_ns);
}

/* The first movement is against the output. */
static bool is_reversed(const struct servo_tune *tune, const struct servo *servo)
{
	const double back = (tune->from - servo->position) * fabs(servo->config.scale);

	return tune->rests && tune->push <= 0 && back >= MOVED_COUNTS;
}

/* Nothing else would see it: what it is pushed with may be less than silent-output. */
static bool is_silent(struct servo_tune *tune, const struct servo *servo, uint64_t now_ns)
{
	const double allowed_s = fmax(SILENT_S, SILENT * tune->interval);

	if (fabs((servo->position - tune->moved_at) * servo->config.scale) >= 2) {
		tune->moved_at = servo->position;
		tune->moved_ns = now_ns;
	}
	return tune->push > 0 && (double)since(tune->moved_ns, now_ns) / SECOND > allowed_s;
}

/*
 * What held it in its place may have drawn a belt or a spring tight. It has to come to rest without
 * output, or its first movement would not be that of the push. False: it does not.
 */
static bool rest(struct servo_tune *tune, struct servo *servo, uint64_t now_ns)
{
	if (fabs((servo->position - tune->from) * servo->config.scale) > REST_COUNTS) {
		tune->from = tune->turned_at = servo->position;
		tune->rested_ns = now_ns;
	}
	servo_forget_output(servo);
	if (since(tune->rested_ns, now_ns) >= REST_NS) {
		tune->rests = true;
		return has_room(servo, tune->distance);
	}
	return since(tune->begun_ns, now_ns) < REST_MOST_NS &&
	       fabs(servo->position - tune->begun_at) < PART * tune->distance;
}

/* More and more, until it moves. */
static void find_push(struct servo_tune *tune, const struct servo *servo, double seconds,
		      uint64_t now_ns)
{
	tune->output += RAMP * seconds;
	if (fabs((servo->position - tune->from) * servo->config.scale) < MOVED_COUNTS)
		return;
	tune->least = fmin(tune->output * LEAST_TIMES, tune->most);
	tune->push = fmin(tune->output * BEGIN_TIMES + BEGIN_MORE, tune->most);
	tune->back_ns = now_ns;
	change(tune, tune->push, now_ns);
}

/* What it would reach, if its output were turned now: it gets faster until that is applied. */
static double speed_on(const struct servo_tune *tune, const struct servo *servo, uint64_t now_ns)
{
	const double late_s = tune->delay + servo->config.smooth + tune->dead;
	const double pushed_s = (double)since(tune->back_ns, now_ns) / SECOND;

	return fabs(servo->rate) * (1 + late_s / fmax(pushed_s, late_s));
}

/* The speed at which its output is turned. What is pushed for too short a time tells nothing. */
static double limit(const struct servo_tune *tune, const struct servo *servo, uint64_t now_ns)
{
	const double pushed_s = (double)since(tune->applied_ns, now_ns) / SECOND;

	return pushed_s > SHORTEST / 2 * tune->interval ? fastest(servo) :
							  FASTEST_SOON * servo->config.speed_most;
}

/* Back and forth. */
static void push(struct servo_tune *tune, const struct servo *servo, uint64_t now_ns)
{
	const double off = servo->position - tune->from;

	tune->peak = fmax(tune->peak, fabs(servo->rate));
	if (servo->rate * tune->sign <= 0) {
		tune->back_ns = now_ns;
		return;
	}
	if (tune->turned_rate > 0)
		note_braking(tune, servo);
	if (off * tune->sign + way_on(tune, servo) >= PART * tune->distance ||
	    speed_on(tune, servo, now_ns) >= limit(tune, servo, now_ns))
		turn(tune, servo, now_ns);
}

/*
 * The best factors with which three of the terms make the fourth, `of`, by Gauss' elimination. The
 * part of it that they explain; 0: they say too little.
 */
static double solve(const struct servo_tune *tune, const unsigned int by[3], unsigned int of,
		    double found[3])
{
	double m[3][4], rest = tune->moment[of][of];

	for (unsigned int i = 0; i < 3; i++) {
		for (unsigned int k = 0; k < 3; k++)
			m[i][k] = tune->moment[by[i]][by[k]];
		m[i][3] = tune->moment[by[i]][of];
	}
	for (unsigned int i = 0; i < 3; i++) {
		/* a symmetric matrix of moments: what is left of the diagonal is what is new */
		if (!(m[i][i] > 1e-9 * tune->moment[by[i]][by[i]]))
			return 0;
		for (unsigned int k = i + 1; k < 3; k++) {
			const double factor = m[k][i] / m[i][i];

			for (unsigned int n = i; n < 4; n++)
				m[k][n] -= factor * m[i][n];
		}
	}
	for (unsigned int i = 3; i-- > 0;) {
		found[i] = m[i][3];
		for (unsigned int k = i + 1; k < 3; k++)
			found[i] -= m[i][k] * found[k];
		found[i] /= m[i][i];
		rest -= found[i] * tune->moment[by[i]][of];
	}
	return 1 - rest / tune->moment[of][of];
}

/*
 * A motor that soon has the speed of its output tells little by how it gets faster, and one that
 * does not tells little by its speeds.
 */
static bool find_model(struct servo_tune *tune)
{
	static const unsigned int with_way[] = { PUSHED, MOVED, RUBBED };
	static const unsigned int with_rise[] = { PUSHED, SPED_UP, RUBBED };
	double slow[3], quick[3], lag_s;
	const double fits_slow = solve(tune, with_way, SPED_UP, slow);
	const double fits_quick = solve(tune, with_rise, MOVED, quick);

	if (fits_slow > FIT && slow[0] > 0) {
		tune->rate = slow[0];
		tune->slowing = fmax(-slow[1], 0);
		tune->friction = fmax(-slow[2], 0);
		return true;
	}
	if (!(fits_quick > FIT && quick[0] > 0))
		return false;
	lag_s = fmax(-quick[1], tune->delay * LAG_PART);
	tune->rate = quick[0] / lag_s;
	tune->slowing = 1 / lag_s;
	tune->friction = fmax(-quick[2], 0) / lag_s;
	return true;
}

static void choose_gains(struct servo_tune *tune, const struct servo *servo)
{
	/* a direction that takes its time to change is in the loop as well */
	const double delay = fmax(tune->delay, tune->dead) + servo->config.smooth + MORE_DELAY_S;
	const double count = 1 / fabs(servo->config.scale);
	const double noise = count / (tune->delay / 2 + servo->config.smooth);
	struct servo_gains *gains = &tune->gains;
	double quick = QUICK / delay;

	do {
		/* one that brakes by itself bears more */
		gains->p = quick * fmax(quick, tune->slowing / 2) / tune->rate;
		gains->d = fmax(2 * DAMPING * quick - tune->slowing, 0) / tune->rate;
		gains->i = gains->p * quick * INTEGRAL_PART;
		quick *= 0.95;
	} while (gains->d * noise + gains->p * count > HEARD && quick > 1);
	gains->velocity = tune->slowing / tune->rate;
	gains->acceleration = 1 / tune->rate;
}

/* All that it has told is told: it is brought to rest. */
/* False: it runs, until it stands. */
static bool end_slowly(struct servo_tune *tune, enum servo_tune_reason reason, uint64_t now_ns)
{
	tune->reason = reason;
	tune->brakes = true;
	tune->turned_ns = now_ns;
	return false;
}

static void conclude(struct servo_tune *tune, const struct servo *servo, uint64_t now_ns)
{
	if (!find_model(tune)) {
		end_slowly(tune, SERVO_TUNE_UNLIKE, now_ns);
		return;
	}
	choose_gains(tune, servo);
	end_slowly(tune, SERVO_TUNE_FINE, now_ns);
}

/* The push, as long as it does not turn it before that is seen; then what was found. */
static double braking_output(const struct servo_tune *tune, const struct servo *servo)
{
	const double late_s = tune->delay + servo->config.smooth + tune->dead;
	const double rate = fabs(servo->rate), braking = tune->braking[servo->rate < 0];
	const bool pushed = braking > 0 && rate > BRAKE_TIMES * braking * late_s;

	return -copysign(pushed ? tune->push : fmin(tune->gains.d * rate, tune->push), servo->rate);
}

/* An amplifier that is off may let it go on for long. */
static bool brake(struct servo_tune *tune, struct servo *servo, uint64_t now_ns)
{
	if (fabs(servo->rate) > servo->config.speed_most * RESTS_PART &&
	    fabs(servo->position - tune->from) < FAR * tune->distance &&
	    since(tune->turned_ns, now_ns) < BRAKE_MOST_NS) {
		servo_force(servo, braking_output(tune, servo));
		return false;
	}
	tune->state = tune->reason == SERVO_TUNE_FINE ? SERVO_TUNE_DONE : SERVO_TUNE_FAILED;
	return true;
}

/*
 * The time until a turned output is applied is in each turn. That it is in doubt later, by a packet
 * that was lost, is none of it.
 */
static void note_applied(struct servo_tune *tune, bool applied, uint64_t now_ns)
{
	if (tune->push <= 0)
		return;
	if (!applied)
		tune->places = 0;
	if (tune->applied)
		return;
	tune->applied_ns = tune->moved_ns = now_ns; /* without voltage it may stand */
	tune->applied = applied;
	if (applied)
		note_dead(tune);
	else
		tune->waited_ns = now_ns;
}

bool servo_tune_step(struct servo_tune *tune, struct servo *servo, bool applied, uint64_t now_ns)
{
	const double seconds = (double)since(tune->step_ns, now_ns) / SECOND;
	double late_s;

	if (tune->state != SERVO_TUNE_RUNS)
		return false;
	if (!servo->enabled)
		return fail(tune, SERVO_TUNE_STOPPED);
	tune->step_ns = now_ns;
	/* until an output acts on the whole of the next reading */
	late_s = (double)since(servo->read_ns, now_ns) / SECOND + seconds;
	tune->delay += (late_s - tune->delay) / 64;
	note_applied(tune, applied, now_ns);
	if (servo->read_ns > tune->read_ns)
		take_place(tune, servo);
	tune->read_ns = servo->read_ns;
	if (tune->brakes)
		return brake(tune, servo, now_ns);
	if (fabs(servo->position - tune->from) > FAR * tune->distance)
		return fail(tune, SERVO_TUNE_FAR);
	if (since(tune->begun_ns, now_ns) > LONGEST_NS)
		return end_slowly(tune, SERVO_TUNE_LATE, now_ns);
	if (is_reversed(tune, servo))
		return fail(tune, SERVO_TUNE_REVERSED);
	if (is_silent(tune, servo, now_ns))
		return fail(tune, SERVO_TUNE_SILENT);
	if (!tune->rests && !rest(tune, servo, now_ns))
		return fail(tune, SERVO_TUNE_UNLIKE);
	if (tune->push > 0)
		push(tune, servo, now_ns);
	else if (tune->rests)
		find_push(tune, servo, seconds, now_ns);
	if (tune->push <= 0 &&
	    tune->output > fmin(tune->most, servo->config.silent_output + STILL_MORE))
		return fail(tune, SERVO_TUNE_STILL);
	if (tune->turns >= TURNS && tune->equations >= EQUATIONS && tune->turned_rate <= 0)
		conclude(tune, servo, now_ns);
	servo_force(servo, tune->output);
	return false;
}
