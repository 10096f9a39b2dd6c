// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The daemon's rules for motion, step by step: it sees the machine off, then on with every axis
 * where it is, and then the axes enabled. What does not happen is reported with its reason.
 */
#include "tools/axis_run.h"
#include <stdarg.h>
#include <stdio.h>
#include <pokeys/names.h>
#include "tools/print.h"

static const struct pokeys_axis *axis_of(const struct loop_run *run, unsigned int axis)
{
	return &run->state.engine.axis[axis];
}

/* The first reason only, as the others follow from it. Returns false. */
static bool fails(struct loop_run *run, unsigned int axis, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

static bool fails(struct loop_run *run, unsigned int axis, const char *format, ...)
{
	char text[240], name[32];
	va_list arguments;

	va_start(arguments, format);
	vsnprintf(text, sizeof(text), format, arguments);
	va_end(arguments);
	loop_end_line(run);
	if (!run->told)
		complain("%s: axis %s: %s", run->device,
			 print_clean(axis_of(run, axis)->name, POKEYS_AXIS_NAME, name), text);
	run->told = true;
	return false;
}

static bool is_on(const struct loop_run *run)
{
	return run->state.flags & POKEYS_STATE_MACHINE_ON;
}

static bool is_off(const struct loop_run *run)
{
	return !is_on(run) && run->state.flags & POKEYS_STATE_COMMANDER &&
	       run->state.one_shot_session == run->command.session;
}

static bool is_tripped(const struct loop_run *run)
{
	return run->state.engine.state == 100 || run->state.engine.state == 101;
}

/* The pulse engine is neither running nor on its way to stop. */
static bool is_still(const struct loop_run *run)
{
	return is_off(run) && (!run->state.engine.state || is_tripped(run));
}

static void send(struct loop_run *run)
{
	run->command.t_thread_ns = run->fresh_ms * 1000000;
	pokeys_client_command(run->client, &run->command);
}

static uint8_t enabled_axes(const struct loop_run *run)
{
	uint8_t axes = 0;

	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		axes |= (uint8_t)((axis_of(run, i)->enabled != 0) << i);
	return axes;
}

static bool are_enabled(const struct loop_run *run)
{
	uint8_t axes = 0;

	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		axes |= (uint8_t)(run->command.axis[i].enable << i);
	return !(axes & ~enabled_axes(run));
}

static void command(struct loop_run *run, uint8_t axes, bool enable)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		run->command.axis[i] =
			axes >> i & 1 ?
				(struct pokeys_axis_command){
					.position = axis_of(run, i)->position,
					.mode = axis_of(run, i)->mode,
					.enable = enable,
				} :
				(struct pokeys_axis_command){ .mode = POKEYS_AXIS_OFF };
}

void axis_run_keep(struct loop_run *run, uint8_t axes)
{
	command(run, axes, true);
}

/* What prevents any motion of this axis. */
static bool may_move(struct loop_run *run, unsigned int axis)
{
	const struct pokeys_engine *engine = &run->state.engine;

	if (axis >= engine->axes_enabled || !axis_of(run, axis)->mode)
		return fails(run, axis,
			     "it is not set up; see axes and axis.%u.mode in "
			     "pokeysd.conf(5)",
			     axis);
	if (engine->emergency)
		return fails(run, axis, "the emergency input is active");
	if (axis_of(run, axis)->limit_minus || axis_of(run, axis)->limit_plus)
		return fails(run, axis,
			     "it is on its %s limit switch; move it off first: "
			     "pokeysctl axis %s %u move PULSES",
			     axis_of(run, axis)->limit_minus ? "negative" : "positive", run->device,
			     axis);
	if (is_tripped(run))
		return fails(run, axis,
			     "the pulse engine is stopped by %s; when the cause is "
			     "gone: pokeysctl axis %s %u clear",
			     engine->state == 101 ? "emergency" : "a limit switch", run->device,
			     axis);
	return true;
}

bool axis_run_begin(struct loop_run *run, uint8_t axes)
{
	const unsigned int first = (unsigned int)__builtin_ctz(axes);

	run->command.flags = 0;
	command(run, axes, false);
	send(run);
	/* what another commander has moved stands, before it is commanded to be where it is */
	if (!loop_await(run, "the daemon does not take the command", is_off) ||
	    !loop_await(run, "the pulse engine does not stop", is_still))
		return false;
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		if (axes >> i & 1 && !may_move(run, i))
			return false;
	command(run, axes, false);
	run->command.flags = POKEYS_COMMAND_MACHINE_ON;
	send(run);
	if (!loop_await(run, "the daemon does not permit motion", is_on))
		return false;
	command(run, axes, true);
	send(run);
	if (!loop_await(run, "the daemon does not enable the axes", are_enabled))
		return false;
	return axis_run_check(run, axes) || fails(run, first, "it is not enabled");
}

bool axis_run_check(struct loop_run *run, uint8_t axes)
{
	const unsigned int off = (unsigned int)(axes & ~enabled_axes(run));
	unsigned int axis;

	if (!off)
		return true;
	axis = (unsigned int)__builtin_ctz(off);
	return fails(run, axis, "stopped at %d pulses: %s%s%s", axis_of(run, axis)->position,
		     is_tripped(run) ? pokeys_engine_state_name(run->state.engine.state) :
				       "it was switched off; \"pokeysctl events\" says why",
		     axis_of(run, axis)->limit_minus ? ", negative limit switch" : "",
		     axis_of(run, axis)->limit_plus ? ", positive limit switch" : "");
}

bool axis_run_stands(const struct loop_run *run, uint8_t axes)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		if (axes >> i & 1 && axis_of(run, i)->enabled && !axis_of(run, i)->in_position)
			return false;
	return true;
}

void axis_run_switch_off(struct loop_run *run)
{
	run->command.flags = 0;
	command(run, 0, false);
	send(run);
}

bool axis_run_finish(struct loop_run *run)
{
	*run->name = '\0'; /* no motor's */
	return loop_await(run, "the pulse engine does not stop", is_still);
}
