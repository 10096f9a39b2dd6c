// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * A name that matches no value is an error and not an empty result. Most such names are pins
 * of LinuxCNC's HAL, so the message says where to read them instead.
 */
#include "tools/choose.h"
#include <ctype.h>
#include <fnmatch.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "model/model.h"
#include "tools/pokeysctl.h"

bool choose(const struct choice *choice, const char *name)
{
	for (size_t i = 0; i < choice->count; i++)
		if (!fnmatch(choice->patterns[i], name, 0))
			return true;
	return !choice->count;
}

const char *choose_only(const struct choice *choice)
{
	return choice->count == 1 && !strpbrk(choice->patterns[0], "*?[\\") ? choice->patterns[0] :
									      NULL;
}

void choose_each(const struct choice *choice, choose_function *each, void *argument)
{
	const struct model_row *row;
	char name[MODEL_NAME_MAX + 1];

	for (size_t number = 0; (row = model_row(number)); number++) {
		if (choice->readable && row->image == MODEL_COMMAND)
			continue;
		for (unsigned int i = 0; i < model_names(row); i++) {
			model_name(row, i, name);
			if (choose(choice, name))
				each(argument, row, i, name);
		}
	}
}

static void count(void *argument, const struct model_row *row, unsigned int index, const char *name)
{
	(void)row;
	(void)index;
	(void)name;
	++*(size_t *)argument;
}

static bool fits(const char *pattern, bool readable)
{
	const struct choice one = { (char *const *)&pattern, 1, readable };
	size_t found = 0;

	choose_each(&one, count, &found);
	return found;
}

/* A full name of a HAL pin, with "pokeys.0." */
static bool has_prefix(const char *name)
{
	return !strncmp(name, "pokeys.", 7) && isdigit((unsigned char)name[7]) && name[8] == '.';
}

/* With the number of the name that was asked for, where it has one. */
static const char *numbered(const char *pattern, const char *name, char text[MODEL_NAME_MAX + 1])
{
	const char *place = pattern ? strstr(pattern, "NN") : NULL;
	const char *digits = name + strcspn(name, "0123456789");

	if (!place || !*digits)
		return pattern;
	snprintf(text, MODEL_NAME_MAX + 1, "%.*s%02lu%s", (int)(place - pattern), pattern,
		 strtoul(digits, NULL, 10), place + 2);
	return text;
}

int choose_check(const struct choice *choice, const char *command)
{
	for (size_t i = 0; i < choice->count; i++) {
		const char *name = choice->patterns[i], *instead;
		char text[MODEL_NAME_MAX + 1];

		if (fits(name, choice->readable))
			continue;
		if (has_prefix(name))
			complain("%s: write \"%s\" without \"%.9s\"", command, name, name);
		else if (fits(name, false))
			complain("%s: \"%s\" can be commanded, but not read", command, name);
		else if (model_is_hal_name(name, &instead))
			complain("%s: \"%s\" exists only in LinuxCNC (halcmd getp pokeys.N.%s)%s%s",
				 command, name, name, instead ? "; the device's own value is " : "",
				 instead ? numbered(instead, name, text) : "");
		else
			complain("%s: no value is named \"%s\"; \"pokeysctl names\" lists the "
				 "names",
				 command, name);
		return STATUS_USAGE;
	}
	return STATUS_OK;
}
