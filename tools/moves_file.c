// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * A file of moves: pairs of words, a motor or an axis and where it goes, in units. All of it is
 * checked against the device before anything moves: names, soft limits, what can be counted.
 */
#include "tools/moves_file.h"
#include <errno.h>
#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "tools/argument.h"
#include "tools/print.h"

enum { FRACTIONS = 256 };

#define SPEED_MOST 1e6		/* units/s, as max-speed */

/* A motor or an axis, for a line that names it. */
struct member {
	bool is_axis;
	unsigned int index;
	const char *name;
	double per_unit;    /* counts or pulses */
	double least, most; /* soft limits, units */
};

/* The moves of a line, by number. */
struct places {
	double motor[POKEYS_SERVOS], axis[POKEYS_AXES];
	struct move move;
};

bool moves_wrong(const struct program *program, const char *format, ...)
{
	char text[240];
	va_list arguments;

	va_start(arguments, format);
	vsnprintf(text, sizeof(text), format, arguments);
	va_end(arguments);
	complain("%s:%u: %s", program->name, program->line, text);
	return false;
}

static bool is_called(const char *name, size_t size, const char *word)
{
	char clean[32];

	return !strcmp(print_clean(name, size, clean), word);
}

static bool is_number(unsigned int index, const char *word)
{
	char number[12];

	snprintf(number, sizeof(number), "%u", index);
	return !strcmp(number, word);
}

static bool find_motor(const struct pokeys_state *state, const char *word, struct member *member)
{
	for (unsigned int i = 0; i < POKEYS_SERVOS && print_has_servo(state, i); i++) {
		const struct pokeys_servo *servo = &state->servo[i];

		if (!is_called(servo->name, sizeof(servo->name), word) && !is_number(i, word))
			continue;
		*member = (struct member){
			.index = i,
			.name = servo->name,
			.per_unit = servo->counts_per_unit,
			.least = -INFINITY,
			.most = INFINITY,
		};
		if (servo->homed) {
			member->least = (double)servo->minimum;
			member->most = (double)servo->maximum;
		}
		return true;
	}
	return false;
}

static double limit_of(int32_t pulses, double per_unit)
{
	return pulses == INT32_MIN || pulses == INT32_MAX ? copysign(INFINITY, pulses) * per_unit :
							    pulses / per_unit;
}

static bool find_axis(const struct pokeys_state *state, const char *word, struct member *member)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		const struct pokeys_axis *axis = &state->engine.axis[i];
		double one, other;

		if (axis->pulses_per_unit == 0 || !is_called(axis->name, sizeof(axis->name), word))
			continue;
		one = limit_of(axis->soft_minimum, axis->pulses_per_unit);
		other = limit_of(axis->soft_maximum, axis->pulses_per_unit);
		*member = (struct member){
			.is_axis = true,
			.index = i,
			.name = axis->name,
			.per_unit = axis->pulses_per_unit,
			.least = fmin(one, other),
			.most = fmax(one, other),
		};
		return true;
	}
	return false;
}

enum { NAMES_MAX = 160 };

static void add_name(char names[NAMES_MAX], const char *name, size_t size)
{
	char clean[32];

	snprintf(names + strlen(names), NAMES_MAX - strlen(names), ", %s",
		 print_clean(name, size, clean));
}

/* By its name, or a motor by its number. */
static bool find(const struct program *program, const struct loop_run *run, const char *word,
		 struct member *member)
{
	const struct pokeys_state *state = &run->state;
	char names[NAMES_MAX] = "";

	if (find_motor(state, word, member) || find_axis(state, word, member))
		return true;
	for (unsigned int i = 0; i < POKEYS_SERVOS && print_has_servo(state, i); i++)
		add_name(names, state->servo[i].name, sizeof(state->servo[i].name));
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		if (state->engine.axis[i].pulses_per_unit != 0)
			add_name(names, state->engine.axis[i].name,
				 sizeof(state->engine.axis[i].name));
	if (!*names)
		return moves_wrong(program,
				   "%s has no servo motor, and no axis with "
				   "pulses-per-unit; see pokeysd.conf(5)",
				   run->device);
	return moves_wrong(program,
			   "\"%s\" is not a motor or an axis of %s (%s); a line has their "
			   "names and positions, or speed and a number",
			   argument_written(word), run->device, names + 2);
}

static bool take_number(const struct program *program, const char *word, const char *after_what,
			double *number)
{
	char *after;

	if (!word)
		return moves_wrong(program, "there is not a number after %s",
				   argument_written(after_what));
	*number = strtod(word, &after);
	if (after != word && !*after && isfinite(*number))
		return true;
	return moves_wrong(program, "\"%s\" is not a number", argument_written(word));
}

static bool take_speed(struct program *program, double speed)
{
	if (!((float)speed > 0 && speed <= SPEED_MOST))
		return moves_wrong(program, "speed is a number above 0, up to %.0f units/s",
				   SPEED_MOST);
	program->speed = speed;
	return true;
}

/* The limits of a motor come as floats, and the daemon rounds to counts. */
static bool is_beyond(const struct member *member, double to)
{
	const double half = 0.5 / fabs(member->per_unit);

	return to < member->least - half - fabs(member->least) * (double)FLT_EPSILON ||
	       to > member->most + half + fabs(member->most) * (double)FLT_EPSILON;
}

static bool is_axis_beyond(const struct loop_run *run, const struct member *member, double to)
{
	const struct pokeys_axis *axis = &run->state.engine.axis[member->index];
	const double pulses = round(to * member->per_unit);

	return pulses < axis->soft_minimum || pulses > axis->soft_maximum;
}

/* In position mode the device's own planner has a shorter range. */
static double furthest(const struct loop_run *run, const struct member *member)
{
	if (!member->is_axis)
		return INT32_MAX - 1;
	return run->state.engine.axis[member->index].mode == POKEYS_AXIS_POSITION ? 1 << 24 :
										    2100000000;
}

static bool take_place(const struct program *program, const struct loop_run *run,
		       struct places *places, const struct member *member, double to)
{
	uint8_t *given = member->is_axis ? &places->move.axes : &places->move.motors;

	if (*given >> member->index & 1)
		return moves_wrong(program, "%.31s is given twice", member->name);
	if (fabs(to * member->per_unit) > furthest(run, member))
		return moves_wrong(program, "%.31s %g is further than the device can count",
				   member->name, to);
	if (member->is_axis ? is_axis_beyond(run, member, to) : is_beyond(member, to))
		return moves_wrong(program, "%.31s %g is beyond its soft limits, %g to %g",
				   member->name, to, member->least, member->most);
	*given |= (uint8_t)(1u << member->index);
	(member->is_axis ? places->axis : places->motor)[member->index] = to * member->per_unit;
	return true;
}

/* The words of a line, in pairs. */
static bool take_words(struct program *program, const struct loop_run *run, char *line,
		       struct places *places)
{
	char *rest = NULL;

	for (char *word = strtok_r(line, " \t\r\n", &rest); word;
	     word = strtok_r(NULL, " \t\r\n", &rest)) {
		const bool is_speed = !strcmp(word, "speed");
		struct member member = { .index = 0 };
		double number = 0;

		if (!is_speed && !find(program, run, word, &member))
			return false;
		if (!take_number(program, strtok_r(NULL, " \t\r\n", &rest), word, &number))
			return false;
		if (!(is_speed ? take_speed(program, number) :
				 take_place(program, run, places, &member, number)))
			return false;
	}
	return true;
}

static void lay(struct move *move, unsigned int at, double counts)
{
	const int64_t parts = llround(counts * FRACTIONS);

	move->counts[at] = (int32_t)(parts >> 8);
	move->fraction[at] = (uint8_t)(parts & (FRACTIONS - 1));
}

static void keep(struct program *program, struct places *places)
{
	struct move *move = &places->move;
	unsigned int values = 0;

	for (unsigned int i = 0; i < POKEYS_SERVOS; i++)
		if (move->motors >> i & 1)
			lay(move, values++, places->motor[i]);
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		if (move->axes >> i & 1)
			lay(move, values++, places->axis[i]);
	move->speed = program->speed;
	move->line = program->line;
	program->motors |= move->motors;
	program->axes |= move->axes;
	program->move[program->count++] = *move;
}

static bool grow(struct program *program)
{
	const size_t room = program->room ? 2 * program->room : 1024;
	struct move *larger;

	if (program->count < program->room)
		return true;
	larger = reallocarray(program->move, room, sizeof(*larger));
	if (!larger)
		return moves_wrong(program, "not enough memory for more than %zu moves",
				   program->count);
	program->move = larger;
	program->room = room;
	return true;
}

static bool take_line(struct program *program, const struct loop_run *run, char *line)
{
	struct places places = { .move = { .motors = 0 } };

	line[strcspn(line, "#;")] = '\0';
	if (!take_words(program, run, line, &places))
		return false;
	if (!places.move.motors && !places.move.axes)
		return true;
	if (__builtin_popcount(places.move.motors) + __builtin_popcount(places.move.axes) >
	    MOVES_VALUES)
		return moves_wrong(program, "a move is of %d motors and axes at most",
				   MOVES_VALUES);
	if (program->speed <= 0)
		return moves_wrong(program, "no speed is given; write \"speed 20\" before, or give "
					    "--speed 20");
	if (!grow(program))
		return false;
	keep(program, &places);
	return true;
}

char *moves_read(struct program *program, const char *name)
{
	const bool is_input = !strcmp(name, "-");
	FILE *file = is_input ? stdin : fopen(name, "r");
	char *text = NULL;
	bool whole = false;
	size_t size = 0;

	program->name = is_input ? "standard input" : name;
	if (!file) {
		complain("%s: %s", name, strerror(errno));
		return NULL;
	}
	if (getdelim(&text, &size, '\0', file) < 0)
		complain("%s: %s", program->name, ferror(file) ? strerror(errno) : "is empty");
	else if (!feof(file))
		complain("%s: not a text file", program->name);
	else
		whole = true;
	if (!is_input)
		fclose(file);
	if (whole)
		return text;
	free(text);
	return NULL;
}

bool moves_take(struct program *program, const struct loop_run *run, char *text)
{
	char *rest = text;

	for (char *line = strsep(&rest, "\n"); line; line = strsep(&rest, "\n")) {
		program->line++;
		if (!take_line(program, run, line))
			return false;
	}
	if (program->count)
		return true;
	complain("%s: contains no moves; example of a line: x 10 y 5 speed 20", program->name);
	return false;
}
