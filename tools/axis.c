// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeysctl axis: move one axis, or let the device home it, without LinuxCNC: to find out which
 * motor turns which way, and whether its switches are seen.
 *
 * The device makes the ramps: it gets one position and a speed, so nothing here has to be in
 * time. An axis in buffered mode needs a position each millisecond, and is refused. All steps of
 * the daemon's rules for motion are taken one by one, and each is seen to have happened: the
 * machine is on, the axis is enabled where it stands, and only then it gets its position. At the
 * end, and whatever goes wrong, the machine is off.
 */
#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <pokeys/names.h>
#include "tools/commander.h"
#include "tools/view.h"

enum { FOLLOW_MS = 3000, LOST_MS = 1000, STOP_MS = 10000 };
#define LOST_NS (LOST_MS * UINT64_C(1000000))

#define USUAL_PART	0.1		/* of the axis' highest speed */
#define FURTHEST	(1 << 24)	/* of the device's own planner */
#define HOME_LIMIT_MS	125000		/* the daemon's own limit is 120 s */

struct axis {
	const char *device;
	unsigned int number;
	double speed;			/* pulses/s, 0 = not said */
	pokeys_client *client;
	struct pokeys_state state;
	struct pokeys_command command;
	uint32_t override;		/* the flag, while it is moved off a limit switch */
	bool on;			/* the machine is, or was until something stopped it */
	bool told;			/* it has been said what is wrong */
};

static const struct pokeys_axis *axis_of(const struct axis *axis)
{
	return &axis->state.engine.axis[axis->number];
}

/* The first reason is the one; what follows from it would only hide it. */
__attribute__((format(printf, 2, 3)))
static bool fails(struct axis *axis, const char *format, ...)
{
	char text[200];
	va_list arguments;

	va_start(arguments, format);
	vsnprintf(text, sizeof(text), format, arguments);
	va_end(arguments);
	if (!axis->told)
		complain("%s: axis %u: %s", axis->device, axis->number, text);
	axis->told = true;
	return false;
}

/* Command what is in axis->command. The daemon wants to know that we have looked. */
static void give(struct axis *axis)
{
	axis->command.t_thread_ns = view_now();
	pokeys_client_command(axis->client, &axis->command);
}

/* Renew the lease and look. False if it had run out. */
static bool look(struct axis *axis)
{
	if (pokeys_client_renew(axis->client))
		return fails(axis, "this program was stopped, or pokeysd was away; the axis was "
			     "stopped");
	commander_nap();
	commander_read(axis->client, &axis->state);
	return true;
}

static bool is_on(const struct axis *axis)
{
	return axis->state.flags & POKEYS_STATE_MACHINE_ON;
}

/* It has lost the permission, or the daemon. */
static bool has_stopped(struct axis *axis)
{
	const struct pokeys_engine *engine = &axis->state.engine;

	if (is_on(axis))
		return false;
	fails(axis, "stopped at %d pulses: %s%s%s", axis_of(axis)->position,
	      pokeys_engine_state_name(engine->state),
	      axis_of(axis)->limit_minus ? ", negative limit switch" : "",
	      axis_of(axis)->limit_plus ? ", positive limit switch" : "");
	return true;
}

/* Until a bit of the state is there. */
static bool await(struct axis *axis, const char *what, bool (*is_so)(const struct axis *axis))
{
	const uint64_t end_ms = commander_ms() + FOLLOW_MS;

	while (!is_so(axis)) {
		if (commander_ms() > end_ms)
			return fails(axis, "%s; the log says why (journalctl -u pokeysd)", what);
		if (!look(axis) || (axis->on && has_stopped(axis)))
			return false;
	}
	return true;
}

static bool is_commanded(const struct axis *axis)
{
	return axis->state.flags & POKEYS_STATE_COMMANDER;
}

static bool is_off(const struct axis *axis)
{
	return !is_on(axis);
}

static bool is_enabled(const struct axis *axis)
{
	return axis_of(axis)->enabled;
}

/* Everything off, every axis where it is. */
static void clear(struct axis *axis)
{
	axis->command.flags = axis->override;
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		axis->command.axis[i] = (struct pokeys_axis_command){
			.position = axis->state.engine.axis[i].position,
			.mode = axis->state.engine.axis[i].mode,
		};
}

static bool is_tripped(const struct axis *axis)
{
	return axis->state.engine.state == 100 || axis->state.engine.state == 101;
}

static bool is_my_session(const struct axis *axis)
{
	return axis->state.one_shot_session == axis->command.session;
}

/* The outcome of the one-shot that was given last; NONE = not yet. */
static enum pokeys_outcome outcome_of(const struct axis *axis)
{
	const uint32_t id = axis->command.one_shot_head - 1;
	const struct pokeys_one_shot_result *result =
		&axis->state.one_shot[id % POKEYS_ONE_SHOT_RESULTS];

	if (!is_my_session(axis) || axis->state.one_shot_ack <= id || result->id != id)
		return POKEYS_OUTCOME_NONE;
	return (enum pokeys_outcome)result->outcome;
}

static bool is_answered(const struct axis *axis)
{
	return outcome_of(axis) != POKEYS_OUTCOME_NONE;
}

static bool order(struct axis *axis, struct pokeys_one_shot shot)
{
	if (!await(axis, "the daemon does not take orders of this program", is_my_session))
		return false;
	shot.id = axis->command.one_shot_head;
	axis->command.one_shot[shot.id % POKEYS_ONE_SHOTS] = shot;
	axis->command.one_shot_head++;
	give(axis);
	return true;
}

static bool clear_fault(struct axis *axis)
{
	return order(axis, (struct pokeys_one_shot){ .operation = POKEYS_ONE_SHOT_CLEAR_FAULT }) &&
	       await(axis, "the pulse engine cannot be taken out of its stop", is_answered) &&
	       (outcome_of(axis) == POKEYS_OUTCOME_DONE ||
		fails(axis, "the pulse engine stays %s",
		      pokeys_engine_state_name(axis->state.engine.state)));
}

/* The machine on, seen to have been off before. */
static bool switch_on(struct axis *axis)
{
	clear(axis);
	give(axis);
	if (!await(axis, "the daemon does not take the command", is_commanded))
		return false;
	if (is_tripped(axis) && !clear_fault(axis))
		return false;
	clear(axis);
	axis->command.flags |= POKEYS_COMMAND_MACHINE_ON;
	give(axis);
	axis->on = await(axis, "the daemon does not permit motion", is_on);
	return axis->on;
}

static bool switch_off(struct axis *axis)
{
	axis->override = 0;
	axis->on = false;
	clear(axis);
	give(axis);
	return await(axis, "the machine does not go off", is_off);
}

/* What stands in the way of any motion. */
static bool may_move(struct axis *axis)
{
	const struct pokeys_engine *engine = &axis->state.engine;

	if (axis->state.capability.pulse_engine < 2)
		return fails(axis, "the device has no pulse engine");
	if (axis->number >= engine->axes_enabled || !axis_of(axis)->mode)
		return fails(axis, "it is not set up; see axes and axis.%u.mode in pokeysd.conf(5)",
			     axis->number);
	if (engine->emergency && !is_tripped(axis))
		return fails(axis, "the emergency input is active");
	return true;
}

/* Off a limit switch an axis may only go back, and before that nothing else goes anywhere. */
static bool leads_away(struct axis *axis, bool forward)
{
	if (forward && axis_of(axis)->limit_plus)
		return fails(axis, "it stands on its positive limit switch, and can only be moved "
			     "back from it: a negative number");
	if (!forward && axis_of(axis)->limit_minus)
		return fails(axis, "it stands on its negative limit switch, and can only be moved "
			     "back from it: a positive number");
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		const struct pokeys_axis *other = &axis->state.engine.axis[i];

		if (i != axis->number && other->mode && (other->limit_minus || other->limit_plus))
			return fails(axis, "axis %u stands on a limit switch; move that one off it "
				     "first", i);
	}
	return true;
}

/* Where it can stand at the earliest: it has to brake. */
static int32_t brake(const struct axis *axis)
{
	const double rate = (double)axis_of(axis)->max_acceleration;
	const double way = rate > 0 ? axis->speed * axis->speed / (2 * rate) + axis->speed / 10 : 0;
	const int32_t here = axis_of(axis)->position;
	const int32_t there = axis->command.axis[axis->number].position;
	const double stop = here + (there > here ? way : -way);

	return fabs(stop - here) < abs(there - here) ? (int32_t)stop : there;
}

/* Until it is there. */
static bool travel(struct axis *axis)
{
	struct pokeys_axis_command *command = &axis->command.axis[axis->number];
	const uint64_t began_ms = commander_ms();
	bool braking = false;
	uint64_t seen_ms = began_ms, moved_ms = began_ms;
	int32_t last = axis_of(axis)->position;

	while (!(axis_of(axis)->in_position && axis_of(axis)->position == command->position)) {
		if (!look(axis) || has_stopped(axis))
			return false;
		if (axis->state.flags & POKEYS_STATE_BAD_COMMAND)
			return fails(axis, "the daemon refuses this position; the log says why "
				     "(journalctl -u pokeysd)");
		if (axis_of(axis)->position != last)
			moved_ms = commander_ms();
		last = axis_of(axis)->position;
		if (pokeys_age_ns(axis->state.t_publish_ns, view_now()) < LOST_NS)
			seen_ms = commander_ms();
		if (commander_ms() - seen_ms > LOST_MS)
			return fails(axis, "the device or pokeysd is away");
		if (commander_ms() - moved_ms > STOP_MS)
			return fails(axis, "it is at %d pulses and does not move; the log says "
				     "why (journalctl -u pokeysd)", last);
		if (commander_ended() && !braking) {
			command->position = brake(axis);
			give(axis);
			braking = true;
		}
	}
	if (!braking)
		return true;
	return fails(axis, "ended by a signal; it is at %d pulses", axis_of(axis)->position);
}

/* pulses from where it is, or to where it shall be. */
static bool move(struct axis *axis, bool absolute, int32_t pulses)
{
	struct pokeys_axis_command *command = &axis->command.axis[axis->number];
	const int64_t from = axis_of(axis)->position, to = absolute ? pulses : from + pulses;
	const double most = (double)axis_of(axis)->max_speed;

	if (axis_of(axis)->mode != POKEYS_AXIS_POSITION)
		return fails(axis, "it is in %s mode, and only one in position mode can be moved; "
			     "see axis.%u.mode in pokeysd.conf(5)",
			     axis_of(axis)->mode == POKEYS_AXIS_BUFFERED ? "buffered" : "velocity",
			     axis->number);
	if (to > FURTHEST || to < -FURTHEST)
		return fails(axis, "%lld pulses are too far; the device goes to +-%d",
			     (long long)to, FURTHEST);
	if (axis->speed > most)
		return fails(axis, "--speed %g is above its highest speed, %g pulses/s",
			     axis->speed, most);
	if (to != from && !leads_away(axis, to > from))
		return false;
	if (axis_of(axis)->limit_minus || axis_of(axis)->limit_plus)
		axis->override = POKEYS_COMMAND_LIMIT_OVERRIDE;
	if (axis->speed <= 0)
		axis->speed = most * USUAL_PART;
	if (!switch_on(axis))
		return false;
	command->position = axis_of(axis)->position;
	command->enable = 1;
	give(axis);
	if (!await(axis, "the daemon does not enable it", is_enabled))
		return false;
	printf("%s: axis %u from %lld to %lld pulses, %g pulses/s; Ctrl-C stops it\n", axis->device,
	       axis->number, (long long)from, (long long)to, axis->speed);
	fflush(stdout);
	command->position = (int32_t)to;
	command->velocity = (float)axis->speed;
	give(axis);
	return travel(axis);
}

/* The device does it; the daemon ends it when the machine goes off. */
static bool home(struct axis *axis)
{
	const uint64_t end_ms = commander_ms() + HOME_LIMIT_MS;

	if (!switch_on(axis) ||
	    !order(axis, (struct pokeys_one_shot){ .operation = POKEYS_ONE_SHOT_HOME,
						   .mask = (uint8_t)(1u << axis->number),
						   .flags = POKEYS_HOME_FINISH_ITSELF }))
		return false;
	printf("%s: axis %u is homed by the device; Ctrl-C stops it\n", axis->device, axis->number);
	fflush(stdout);
	while (!is_answered(axis)) {
		if (!look(axis))
			return false;
		if (commander_ended())
			return fails(axis, "ended by a signal; the axis is not homed");
		if (has_stopped(axis))
			return false;
		if (commander_ms() > end_ms)
			return fails(axis, "no answer from the daemon");
	}
	if (outcome_of(axis) == POKEYS_OUTCOME_REFUSED)
		return fails(axis, "the daemon refuses to home it; the log says why (journalctl -u "
			     "pokeysd)");
	if (outcome_of(axis) != POKEYS_OUTCOME_DONE)
		return fails(axis, "homing was %s",
			     pokeys_task_result_name(axis->state.engine.task_result));
	return true;
}

/* Nobody else commands, so the daemon has stopped it; this looks whether that is so. */
static bool stand(struct axis *axis)
{
	const uint64_t end_ms = commander_ms() + FOLLOW_MS;
	uint64_t since_ms = commander_ms();
	int32_t last = axis_of(axis)->position;

	if (!switch_off(axis))
		return false;
	while (commander_ms() - since_ms < 200) {
		if (commander_ms() > end_ms)
			return fails(axis, "it does not stand: %d pulses", last);
		if (!look(axis))
			return false;
		if (axis_of(axis)->position != last)
			since_ms = commander_ms();
		last = axis_of(axis)->position;
	}
	return true;
}

enum verb { MOVE, MOVE_TO, HOME, STOP, NO_VERB };

static enum verb verb_of(const char *word, size_t arguments)
{
	if (!strcmp(word, "move") && arguments == 1)
		return MOVE;
	if (!strcmp(word, "move-to") && arguments == 1)
		return MOVE_TO;
	if (!strcmp(word, "home") && !arguments)
		return HOME;
	return !strcmp(word, "stop") && !arguments ? STOP : NO_VERB;
}

static bool take_number(const char *text, long least, long most, long *number)
{
	char *after;

	errno = 0;
	*number = strtol(text, &after, 10);
	return after != text && !*after && !errno && *number >= least && *number <= most;
}

static bool run(struct axis *axis, enum verb verb, int32_t pulses)
{
	bool well = verb == STOP || may_move(axis);

	if (well && verb == HOME)
		well = home(axis);
	else if (well && verb == STOP)
		well = stand(axis);
	else if (well)
		well = move(axis, verb == MOVE_TO, pulses);
	if (axis->command.session && !switch_off(axis))
		well = false;
	if (well)
		printf("%s: axis %u %s %d pulses\n", axis->device, axis->number,
		       verb == HOME ? "is homed, at" : "is at",
		       axis_of(axis)->position);
	return well;
}

int command_axis(const struct options *options)
{
	char *const *names = options->names;
	struct axis axis = { .speed = options->speed };
	enum verb verb = options->name_count >= 3 ?
			 verb_of(names[2], options->name_count - 3) : NO_VERB;
	long number = 0, pulses = 0;
	int status;

	if (verb == NO_VERB) {
		complain("axis wants a device, the number of an axis, and what to do: pokeysctl "
			 "axis mill 0 move 1000 (or move-to 1000, home, stop)");
		return STATUS_USAGE;
	}
	if (!take_number(names[1], 0, POKEYS_AXES - 1, &number)) {
		complain("\"%s\": axes are numbered from 0 to %d",
			 names[1] + (names[1][0] == ' '), POKEYS_AXES - 1);
		return STATUS_USAGE;
	}
	if (verb <= MOVE_TO && !take_number(names[3], -2L * FURTHEST, 2L * FURTHEST, &pulses)) {
		complain("\"%s\": pulses are a whole number, such as 1000 or -1000",
			 names[3] + (names[3][0] == ' '));
		return STATUS_USAGE;
	}
	axis.device = names[0];
	axis.number = (unsigned int)number;
	axis.client = commander_open(options, axis.device, &axis.state, &status);
	if (!axis.client)
		return status;
	axis.command.session = (uint32_t)(view_now() >> 10 ^ (uint64_t)getpid() << 16) | 1;
	status = run(&axis, verb, (int32_t)pulses) ? STATUS_OK : STATUS_FAILED;
	pokeys_client_close(axis.client);
	return status;
}
