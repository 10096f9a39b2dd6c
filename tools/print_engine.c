// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The pulse engine for a person: its axes, their PoStep drivers, its threading. Of the
 * last two nothing is said where they are not in use.
 *
 * The device asks a driver when it likes. One that it has not had an answer from for
 * longer than the daemon would wait for one is silent, and of what it said before only
 * its faults may still be worth knowing. How long that is counts until the device was
 * asked last, for a daemon that died is not the driver's fault.
 */
#include <string.h>
#include <pokeys/names.h>
#include "tools/print.h"

#define SILENT_NS UINT64_C(2000000000)

static bool is_silent(const struct pokeys_state *state, unsigned int axis)
{
	const uint64_t heard_ns = state->postep[axis].t_update_ns;

	return !heard_ns ||
	       (state->t_postep_ns > heard_ns && state->t_postep_ns - heard_ns > SILENT_NS);
}

bool print_has_postep(const struct view_device *device, unsigned int axis)
{
	return device->state.postep[axis].t_update_ns || device->postep_axes >> axis & 1;
}

const char *print_postep(const struct pokeys_state *state, unsigned int axis, char text[40])
{
	const struct pokeys_postep *driver = &state->postep[axis];
	char silence[16];

	if (!driver->t_update_ns)
		snprintf(text, 40, "NOT HEARD OF");
	else if (is_silent(state, axis))
		snprintf(text, 40, "SILENT for %s",
			 print_duration((double)(state->t_postep_ns - driver->t_update_ns),
					silence));
	else
		snprintf(text, 40, "%g V %u C %s", driver->supply / 4.0, driver->temperature,
			 pokeys_postep_state_name(driver->state));
	return text;
}

const char *print_postep_faults(const struct pokeys_postep *driver, char text[128])
{
	size_t at = 0;

	text[0] = '\0';
	for (unsigned int i = 0; i < 8; i++)
		if (driver->faults >> i & 1)
			at += (size_t)snprintf(text + at, 128 - at, "%s%s", at ? ", " : "",
					       pokeys_postep_fault_name(i));
	return text;
}

/* What it is set up for is asked rarely: until then it has mode 0. */
static void print_postep_modes(const struct pokeys_postep *driver, FILE *to)
{
	if (driver->mode && driver->step_mode <= 8)
		fprintf(to, ", step mode 1/%u", 1u << driver->step_mode);
	if (driver->mode && driver->temperature_limit)
		fprintf(to, ", limit %u C", driver->temperature_limit);
}

static void print_drivers(const struct view_device *device, FILE *to)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		const struct pokeys_postep *driver = &device->state.postep[i];
		char text[40], faults[128];

		if (!print_has_postep(device, i))
			continue;
		fprintf(to, "  PoStep %u    %s", i, print_postep(&device->state, i, text));
		if (!is_silent(&device->state, i))
			print_postep_modes(driver, to);
		if (driver->faults)
			fprintf(to, ", FAULT: %s", print_postep_faults(driver, faults));
		fputc('\n', to);
	}
}

/* What the device says of it. */
static const char *threading_step(const struct pokeys_threading *threading)
{
	return threading->active    ? "active" :
	       threading->waiting   ? "waiting for the spindle's index" :
	       threading->prepared  ? "prepared" :
	       threading->preparing ? "preparing" :
				      "beginning";
}

static size_t put_axes(uint8_t axes, char *text, size_t size)
{
	size_t at = (size_t)snprintf(text, size, ", axes");

	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		if (axes >> i & 1)
			at += (size_t)snprintf(text + at, size - at, " %u", i);
	return at;
}

static void put_thread(const struct pokeys_state *state, char text[200])
{
	const struct pokeys_threading *threading = &state->threading;
	const uint8_t phase = state->engine.task_phase;
	size_t at;

	at = (size_t)snprintf(text, 200, "%s",
			      phase == POKEYS_TASK_FINISHING ? "being released" :
			      phase == POKEYS_TASK_STOPPING  ? "being stopped" :
							       threading_step(threading));
	at += put_axes(state->engine.task_axes, text + at, 200 - at);
	snprintf(text + at, 200 - at, ", spindle %u/min, index %u, %u slots behind",
		 threading->spindle_rpm, threading->index_count, threading->behind);
}

/* The last thread, and the last request for one, if that was not taken. */
static void put_outcome(const struct pokeys_state *state, char text[200])
{
	const struct pokeys_engine *engine = &state->engine;
	const uint8_t refused = state->threading.refused;
	const bool ended = engine->task == POKEYS_TASK_THREADING && engine->task_result;

	if (ended)
		snprintf(text, 200, "the last one: %s",
			 pokeys_task_result_name(engine->task_result));
	if (refused)
		snprintf(text + strlen(text), 200 - strlen(text), "%srefused: %s",
			 ended ? "; " : "", pokeys_threading_refusal_name(refused));
}

const char *print_threading(const struct pokeys_state *state, char text[200])
{
	const struct pokeys_threading *threading = &state->threading;
	const bool known = state->link == POKEYS_LINK_RUNNING ||
			   state->link == POKEYS_LINK_CONFIGURING;

	text[0] = '\0';
	if (state->engine.task == POKEYS_TASK_THREADING &&
	    state->engine.task_phase != POKEYS_TASK_IDLE)
		put_thread(state, text);
	else if (known && (threading->preparing | threading->prepared | threading->waiting |
			   threading->active))
		snprintf(text, 200, "NOT OURS (%s), it is being cancelled",
			 threading_step(threading));
	else
		put_outcome(state, text);
	return text;
}

/* What moves call it, and where it is in units; empty without a scale. */
static const char *in_units(const struct pokeys_axis *axis, char text[60])
{
	char name[32];

	text[0] = '\0';
	if (axis->pulses_per_unit != 0)
		snprintf(text, 60, ", %s at %.4f",
			 print_clean(axis->name, sizeof(axis->name), name),
			 print_rounded(axis->position / axis->pulses_per_unit, 4));
	return text;
}

static void print_axes(const struct pokeys_engine *engine, FILE *to)
{
	for (unsigned int i = 0; i < engine->axes_enabled && i < POKEYS_AXES; i++) {
		const struct pokeys_axis *axis = &engine->axis[i];
		char text[60];

		fprintf(to, "  axis %u      %d (reference %d) %s%s%s%s%s%s%s\n", i, axis->position,
			axis->reference, pokeys_axis_state_name(axis->state), in_units(axis, text),
			axis->homed ? ", homed" : "", axis->limit_minus ? ", LIMIT -" : "",
			axis->limit_plus ? ", LIMIT +" : "", axis->home ? ", at home switch" : "",
			axis->error ? ", DRIVER ERROR" : "");
	}
}

void print_engine(const struct view_device *device, FILE *to)
{
	const struct pokeys_state *state = &device->state;
	char text[200];

	if (!state->t_motion_ns)
		return;
	fprintf(to, "  engine      %s%s\n", pokeys_engine_state_name(state->engine.state),
		state->engine.emergency ? ", EMERGENCY" : "");
	print_axes(&state->engine, to);
	print_drivers(device, to);
	if (*print_threading(state, text))
		fprintf(to, "  threading   %s\n", text);
}
