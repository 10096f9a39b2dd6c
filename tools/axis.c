// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeysctl axis: move one axis, or let the device home it, without LinuxCNC: to find out which
 * motor turns which way, and whether its switches are seen.
 *
 * The device makes the ramps: it gets a position and a speed, so nothing here has to be in time.
 * An axis in buffered mode needs a position each millisecond, and is refused. All steps of the
 * daemon's rules for motion are taken one by one, and each is seen to have happened: the machine
 * is on, and the axis is enabled at its present position. Only then it gets a new position, at
 * most a second away, so that it does not go far if this program, the daemon or the link is
 * lost. What was known of the device when the command began has to hold until its end. At the
 * end, and when something goes wrong, the machine is off.
 */
#include "tools/axis.h"
#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <pokeys/names.h>
#include "tools/argument.h"
#include "tools/commander.h"
#include "tools/view.h"

enum { FOLLOW_MS = 3000, LOST_MS = 1000, STILL_MS = 10000 };

/*
 * Two positions within 100 ms are a stream of them to the daemon, and then it lets the axis
 * catch up with twice the speed. So they are given less often.
 */
enum { GIVE_MS = 250 };
#define AHEAD_S		0.75		/* beyond the way that it needs to brake */

#define USUAL_PART	0.1		/* of the axis' highest speed */
#define LEAVE_PART	0.05		/* of it, off a limit switch; for two seconds at most */
#define LEAVE_S		2
#define FURTHEST	(1 << 24)	/* of the device's own planner */
#define HOME_LIMIT_MS	125000		/* the daemon's own limit is 120 s */

static const struct pokeys_axis *axis_of(const struct axis *axis)
{
	return &axis->state.engine.axis[axis->number];
}

static struct pokeys_axis_command *command_of(struct axis *axis)
{
	return &axis->command.axis[axis->number];
}

/* The first reason is the one; what follows from it would only hide it. */
static bool fails(struct axis *axis, const char *format, ...) __attribute__((format(printf, 2, 3)));

static bool fails(struct axis *axis, const char *format, ...)
{
	char text[240];
	va_list arguments;

	va_start(arguments, format);
	vsnprintf(text, sizeof(text), format, arguments);
	va_end(arguments);
	if (!axis->told)
		complain("%s: axis %u: %s", axis->device, axis->number, text);
	axis->told = true;
	return false;
}

/* Send axis->command. It says when this program last read the state. */
static void give(struct axis *axis)
{
	axis->command.t_thread_ns = axis->read_ns;
	axis->given_ms = commander_ms();
	if (pokeys_client_command(axis->client, &axis->command))
		axis->lapsed = true;
}

/* It is another daemon, another device, or another count than at the beginning. */
static bool is_another(const struct axis *axis)
{
	return axis->state.epoch != axis->began.epoch ||
	       axis->state.t_link_ns != axis->began.t_link_ns ||
	       axis_of(axis)->position_epoch !=
		       axis->began.engine.axis[axis->number].position_epoch;
}

static bool is_on(const struct axis *axis)
{
	return axis->state.flags & POKEYS_STATE_MACHINE_ON;
}

/* The machine was on, and something has stopped it. */
static bool has_stopped(struct axis *axis)
{
	const struct pokeys_engine *engine = &axis->state.engine;

	if (!axis->on || is_on(axis))
		return false;
	fails(axis, "stopped at %d pulses: %s%s%s", axis_of(axis)->position,
	      pokeys_engine_state_name(engine->state),
	      axis_of(axis)->limit_minus ? ", negative limit switch" : "",
	      axis_of(axis)->limit_plus ? ", positive limit switch" : "");
	return true;
}

/* Renew the lease and look. False if something is wrong, and it has been said. */
static bool look(struct axis *axis)
{
	static const char lapsed[] = "this program was stopped, or pokeysd was away; the axis "
				     "was stopped";
	struct pokeys_state state;
	uint64_t now_ns;

	if (axis->lapsed || pokeys_client_renew(axis->client))
		return fails(axis, "%s", lapsed);
	commander_nap(COMMANDER_TURN_MS);
	now_ns = view_now();
	axis->fresh = commander_read(axis->client, &state) &&
		      pokeys_state_age_ns(&state, now_ns) < LOST_MS * UINT64_C(1000000);
	if (axis->fresh) {
		axis->state = state;
		axis->read_ns = now_ns;
		axis->fresh_ms = commander_ms();
	} else if (commander_ms() - axis->fresh_ms > LOST_MS && axis->given) {
		/* as well if it is us who were away */
		if (pokeys_client_renew(axis->client))
			return fails(axis, "%s", lapsed);
		return fails(axis, "the device or pokeysd is away; the axis may still move: use "
				   "the emergency stop");
	}
	if (axis->fresh && !axis->homing && is_another(axis))
		return fails(axis,
			     "the device or pokeysd was restarted, or its position was set; "
			     "it is at %d pulses",
			     axis_of(axis)->position);
	if (commander_ended() && !axis->ending)
		return fails(axis, "ended by a signal");
	return !has_stopped(axis);
}

/* Until it is seen that it is so. */
static bool await(struct axis *axis, const char *what, bool (*is_so)(const struct axis *axis))
{
	const uint64_t end_ms = commander_ms() + FOLLOW_MS;

	do {
		if (commander_ms() > end_ms)
			return fails(axis, "%s; \"pokeysctl events\" may say why", what);
		if (!look(axis))
			return false;
	} while (!axis->fresh || !is_so(axis));
	return true;
}

static bool is_commanded(const struct axis *axis)
{
	return axis->state.one_shot_session == axis->command.session;
}

static bool is_off(const struct axis *axis)
{
	return !is_on(axis) && axis->state.flags & POKEYS_STATE_COMMANDER;
}

static bool is_enabled(const struct axis *axis)
{
	return axis_of(axis)->enabled;
}

static bool is_tripped(const struct axis *axis)
{
	return axis->state.engine.state == 100 || axis->state.engine.state == 101;
}

static bool is_clear(const struct axis *axis)
{
	return !is_tripped(axis);
}

static bool on_switch(const struct axis *axis)
{
	return axis_of(axis)->limit_minus || axis_of(axis)->limit_plus;
}

/* The engine is neither running nor on its way to stop. */
static bool is_still(const struct axis *axis)
{
	return !axis->state.engine.state || is_tripped(axis);
}

/* Every axis where it is, and off; flags as they are. */
static void keep_all(struct axis *axis)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		axis->command.axis[i] = (struct pokeys_axis_command){
			.position = axis->state.engine.axis[i].position,
			.mode = axis->state.engine.axis[i].mode,
		};
}

static enum pokeys_outcome outcome_of(const struct axis *axis)
{
	return commander_outcome(&axis->command, &axis->state);
}

static bool is_answered(const struct axis *axis)
{
	return outcome_of(axis) != POKEYS_OUTCOME_NONE;
}

static void order(struct axis *axis, struct pokeys_one_shot shot)
{
	commander_order(&axis->command, shot);
	give(axis);
}

/* Nothing is commanded, and the daemon has seen that. */
static bool begin(struct axis *axis)
{
	keep_all(axis);
	give(axis);
	axis->given = true;
	return await(axis, "the daemon does not take the command", is_commanded);
}

static bool clear_fault(struct axis *axis)
{
	order(axis, (struct pokeys_one_shot){ .operation = POKEYS_ONE_SHOT_CLEAR_FAULT });
	if (!await(axis, "the pulse engine cannot be taken out of its stop", is_answered))
		return false;
	if (outcome_of(axis) != POKEYS_OUTCOME_DONE)
		return fails(axis, "the pulse engine stays %s",
			     pokeys_engine_state_name(axis->state.engine.state));
	return await(axis, "the pulse engine stays stopped", is_clear);
}

static bool switch_on(struct axis *axis)
{
	if (axis->state.engine.emergency)
		return fails(axis, "the emergency input is active");
	/* what another commander has moved stands, before it is commanded to be where it is */
	if (!await(axis, "the pulse engine does not stop", is_still))
		return false;
	keep_all(axis);
	axis->command.flags |= POKEYS_COMMAND_MACHINE_ON;
	give(axis);
	axis->on = await(axis, "the daemon does not permit motion", is_on);
	return axis->on;
}

/* Whatever has happened. The device brakes by itself. */
static bool switch_off(struct axis *axis)
{
	axis->ending = true;
	axis->on = false;
	axis->lapsed = false;
	axis->command.flags = 0;
	keep_all(axis);
	give(axis);
	return await(axis, "the machine does not go off", is_off) &&
	       await(axis, "the pulse engine does not stop", is_still);
}

/* Report what prevents any motion. */
static bool may_move(struct axis *axis)
{
	const struct pokeys_engine *engine = &axis->state.engine;

	if (axis->state.capability.pulse_engine < 2)
		return fails(axis, "the device has no pulse engine");
	if (axis->number >= engine->axes_enabled || !axis_of(axis)->mode)
		return fails(axis, "it is not set up; see axes and axis.%u.mode in pokeysd.conf(5)",
			     axis->number);
	if (engine->state == 101)
		return fails(axis,
			     "the pulse engine is stopped by emergency; release the button, "
			     "then: pokeysctl axis %s %u clear",
			     axis->device, axis->number);
	return true;
}

/* Off a limit switch an axis may only go back, and before that nothing else goes anywhere. */
static bool leads_away(struct axis *axis, bool forward)
{
	if (forward && axis_of(axis)->limit_plus)
		return fails(axis, "it is on its positive limit switch, and can only be moved back "
				   "from it: a negative number");
	if (!forward && axis_of(axis)->limit_minus)
		return fails(axis, "it is on its negative limit switch, and can only be moved back "
				   "from it: a positive number");
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		const struct pokeys_axis *other = &axis->state.engine.axis[i];

		if (i != axis->number && other->mode && (other->limit_minus || other->limit_plus))
			return fails(axis,
				     "axis %u is on a limit switch; move that one off it "
				     "first",
				     i);
	}
	return true;
}

/* Speeds are sent to the device only while no axis is in speed mode; never to older firmware. */
static bool has_speeds(const struct pokeys_state *state)
{
	const struct pokeys_identity *id = &state->identity;
	const unsigned int version = id->firmware_major << 16 | id->firmware_minor << 8 |
				     id->firmware_revision;

	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		if (state->engine.axis[i].mode == POKEYS_AXIS_VELOCITY)
			return false;
	return version >= (4u << 16 | 4u << 8 | 7u);
}

static bool choose_speed(struct axis *axis)
{
	const double most = (double)axis_of(axis)->max_speed;

	if (!(most > 0))
		return fails(axis, "its highest speed is not set; see axis.%u.max-speed",
			     axis->number);
	if (axis->speed > most)
		return fails(axis, "--speed %g is above its highest speed, %g pulses/s",
			     axis->speed, most);
	if (!has_speeds(&axis->state) && axis->speed != most)
		return fails(axis,
			     "this device would move it at its highest speed (an axis is in "
			     "velocity mode, or the firmware is older than 4.4.7); --speed %g "
			     "permits that",
			     most);
	if (axis->speed <= 0)
		axis->speed = most * USUAL_PART;
	return true;
}

/* Where it goes, by what was read last. */
static bool plan(struct axis *axis, const struct axis_order *wanted, int32_t *to)
{
	const int64_t from = axis_of(axis)->position;
	const int64_t there = wanted->verb == AXIS_MOVE_TO ? wanted->pulses : from + wanted->pulses;

	if (there > FURTHEST || there < -FURTHEST)
		return fails(axis, "%lld pulses are too far; the device goes to +-%d",
			     (long long)there, FURTHEST);
	*to = (int32_t)there;
	return there == from || leads_away(axis, there > from);
}

static bool is_there(const struct axis *axis, int32_t to)
{
	return axis_of(axis)->in_position && axis_of(axis)->position == to &&
	       axis_of(axis)->reference == to;
}

/* On the way to `to`, as far as it may go before it is looked at again. */
static int32_t next_stop(const struct axis *axis, double speed, int32_t to)
{
	const double rate = (double)axis_of(axis)->max_acceleration;
	const double way = speed * AHEAD_S + (rate > 0 ? speed * speed / (2 * rate) : 0) + 1;
	const double here = axis_of(axis)->position;

	if (fabs(to - here) <= way)
		return to;
	return (int32_t)(to > here ? here + way : here - way);
}

/*
 * Go there, or until `enough`. Not in one go, and never two positions at once.
 */
static bool travel(struct axis *axis, double speed, int32_t to,
		   bool (*enough)(const struct axis *axis))
{
	uint64_t moved_ms = commander_ms();
	int32_t last = axis_of(axis)->position;

	command_of(axis)->velocity = (float)speed;
	while (!(axis->fresh && (is_there(axis, to) || (enough && enough(axis))))) {
		const uint64_t now_ms = commander_ms();

		if (axis->fresh && command_of(axis)->position != to &&
		    now_ms - axis->given_ms >= GIVE_MS) {
			command_of(axis)->position = next_stop(axis, speed, to);
			give(axis);
		}
		if (!look(axis))
			return false;
		if (axis->state.flags & POKEYS_STATE_BAD_COMMAND)
			return fails(axis, "the daemon refuses this position; \"pokeysctl "
					   "events\" says why");
		if (axis_of(axis)->position != last)
			moved_ms = now_ms;
		last = axis_of(axis)->position;
		if (now_ms - moved_ms > STILL_MS)
			return fails(axis,
				     "it is at %d pulses and does not move; \"pokeysctl "
				     "events\" may say why",
				     last);
	}
	return true;
}

static bool is_off_switch(const struct axis *axis)
{
	return !on_switch(axis);
}

/*
 * Off the limit switch, while the device does not look at any: slowly, and not far. It goes
 * nowhere near the other end, and if plus and minus are exchanged it does not go far into the
 * machine.
 */
static bool leave_switch(struct axis *axis, int32_t to)
{
	const double speed = (double)axis_of(axis)->max_speed * LEAVE_PART;
	const int32_t from = axis_of(axis)->position;
	const double most = speed * LEAVE_S;
	const int32_t end = fabs((double)to - from) <= most ?
				    to :
				    (int32_t)(to > from ? from + most : from - most);

	if (!travel(axis, speed, end, is_off_switch))
		return false;
	if (on_switch(axis))
		return fails(axis,
			     "its limit switch is still pressed, %d pulses on; move it "
			     "further, or are plus and minus exchanged?",
			     abs(axis_of(axis)->position - from));
	axis->command.flags &= ~(uint32_t)POKEYS_COMMAND_LIMIT_OVERRIDE;
	give(axis);
	return true;
}

static bool move(struct axis *axis, const struct axis_order *wanted)
{
	bool leaves;
	int32_t to;

	if (axis_of(axis)->mode != POKEYS_AXIS_POSITION)
		return fails(axis,
			     "it is in %s mode, and only one in position mode can be moved; "
			     "see axis.%u.mode in pokeysd.conf(5)",
			     axis_of(axis)->mode == POKEYS_AXIS_BUFFERED ? "buffered" : "velocity",
			     axis->number);
	if (!choose_speed(axis) || !plan(axis, wanted, &to) || !begin(axis))
		return false;
	leaves = on_switch(axis);
	if (leaves)
		axis->command.flags |= POKEYS_COMMAND_LIMIT_OVERRIDE;
	if (is_tripped(axis) && !clear_fault(axis))
		return false;
	if (!switch_on(axis))
		return false;
	keep_all(axis);
	command_of(axis)->enable = 1;
	give(axis);
	/* from here on it is held, so what is read now is where it starts */
	if (!await(axis, "the daemon does not enable it", is_enabled) || !plan(axis, wanted, &to))
		return false;
	printf("%s: axis %u from %d to %d pulses, %g pulses/s; Ctrl-C stops it\n", axis->device,
	       axis->number, axis_of(axis)->position, to, axis->speed);
	fflush(stdout);
	return (!leaves || leave_switch(axis, to)) && travel(axis, axis->speed, to, NULL);
}

/* The device does it; the daemon ends it when the machine goes off. */
static bool home(struct axis *axis)
{
	const uint64_t end_ms = commander_ms() + HOME_LIMIT_MS;

	if (!begin(axis) || (is_tripped(axis) && !clear_fault(axis)) || !switch_on(axis))
		return false;
	printf("%s: asking the device to home axis %u; Ctrl-C stops the axis\n", axis->device,
	       axis->number);
	fflush(stdout);
	axis->homing = true;
	order(axis, (struct pokeys_one_shot){ .operation = POKEYS_ONE_SHOT_HOME,
					      .mask = (uint8_t)(1u << axis->number),
					      .flags = POKEYS_HOME_FINISH_ITSELF });
	do {
		if (!look(axis))
			return false;
		if (commander_ms() > end_ms)
			return fails(axis, "no answer from the daemon");
	} while (!axis->fresh || !is_answered(axis));
	if (outcome_of(axis) == POKEYS_OUTCOME_REFUSED)
		return fails(axis, "the daemon refuses to home it; \"pokeysctl events\" says why");
	if (outcome_of(axis) != POKEYS_OUTCOME_DONE)
		return fails(axis, "homing was %s",
			     pokeys_task_result_name(axis->state.engine.task_result));
	return true;
}

/* Out of a limit or emergency stop. Nothing moves by that. */
static bool clear(struct axis *axis)
{
	if (!begin(axis) || (is_tripped(axis) && !clear_fault(axis)))
		return false;
	if (axis->state.engine.emergency)
		return fails(axis, "the emergency input is still active");
	return true;
}

static bool take_number(const char *text, long least, long most, long *number)
{
	char *after;

	errno = 0;
	*number = strtol(text, &after, 10);
	return after != text && !*after && !errno && *number >= least && *number <= most;
}

static bool take_verb(const struct options *options, struct axis_order *wanted)
{
	static const struct {
		const char *word;
		enum axis_verb verb;
		size_t arguments;
	} verbs[] = {
		{ "move", AXIS_MOVE, 1 }, { "move-to", AXIS_MOVE_TO, 1 }, { "home", AXIS_HOME, 0 },
		{ "stop", AXIS_STOP, 0 }, { "clear", AXIS_CLEAR, 0 },
	};

	for (size_t i = 0; options->name_count >= 3 && i < sizeof(verbs) / sizeof(verbs[0]); i++)
		if (!strcmp(options->names[2], verbs[i].word) &&
		    options->name_count == 3 + verbs[i].arguments) {
			wanted->verb = verbs[i].verb;
			return true;
		}
	complain("axis needs a device, the number of an axis, and what to do: pokeysctl axis mill "
		 "0 move 1000 (or move-to 1000, home, stop, clear)");
	return false;
}

bool axis_take(const struct options *options, struct axis_order *wanted)
{
	char *const *names = options->names;
	long number, pulses = 0;

	if (!take_verb(options, wanted))
		return false;
	if (!take_number(names[1], 0, POKEYS_AXES - 1, &number)) {
		complain("\"%s\": axes are numbered from 0 to %d", argument_written(names[1]),
			 POKEYS_AXES - 1);
		return false;
	}
	if (wanted->verb <= AXIS_MOVE_TO &&
	    !take_number(names[3], -2L * FURTHEST, 2L * FURTHEST, &pulses)) {
		complain("\"%s\": pulses are a whole number, such as 1000 or -1000",
			 argument_written(names[3]));
		return false;
	}
	if (wanted->verb > AXIS_MOVE_TO && options->speed > 0) {
		complain("--speed is for move and move-to");
		return false;
	}
	if (options->speed > 0 && options->speed < 1) {
		complain("--speed of an axis is 1 to 1000000 pulses/s");
		return false;
	}
	wanted->axis = (unsigned int)number;
	wanted->pulses = (int32_t)pulses;
	return true;
}

bool axis_run(struct axis *axis, const struct axis_order *wanted)
{
	bool well = wanted->verb == AXIS_STOP || wanted->verb == AXIS_CLEAR || may_move(axis);

	axis->read_ns = view_now();
	axis->fresh_ms = commander_ms();
	axis->began = axis->state;
	if (!well)
		return false;
	if (wanted->verb == AXIS_HOME)
		well = home(axis);
	else if (wanted->verb == AXIS_STOP)
		well = begin(axis);
	else if (wanted->verb == AXIS_CLEAR)
		well = clear(axis);
	else
		well = move(axis, wanted);
	if (axis->given && !switch_off(axis))
		well = false;
	if (well)
		printf("%s: axis %u %s %d pulses\n", axis->device, axis->number,
		       wanted->verb == AXIS_HOME ? "is homed, at" : "is at",
		       axis_of(axis)->position);
	else if (axis->given && axis->fresh && commander_ended())
		complain("%s: axis %u: it is at %d pulses", axis->device, axis->number,
			 axis_of(axis)->position);
	return well;
}
