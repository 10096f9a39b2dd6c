/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Terminals and their owners in words. Cold. */
#include <stdio.h>
#include <string.h>
#include "settings/terminal.h"

const char *terminal_owner_name(unsigned int number, char out[SETTINGS_NAME_MAX])
{
	unsigned int index;
	const char *key = terminal_key(number, &index);
	const char *mark = key ? strchr(key, '#') : NULL;

	if (mark)
		snprintf(out, SETTINGS_NAME_MAX, "%.*s%u%s", (int)(mark - key), key, index,
			 mark + 1);
	else
		snprintf(out, SETTINGS_NAME_MAX, "%s", key ? key : "");
	return out;
}

const char *terminal_list(uint64_t terminals, char out[TERMINAL_LIST_MAX])
{
	size_t n = (size_t)sprintf(out, "terminal%s", terminals & (terminals - 1) ? "s" : "");
	const char *before = " ";

	for (uint64_t left = terminals; left; before = left & (left - 1) ? ", " : " and ") {
		n += (size_t)sprintf(out + n, "%s%d", before, __builtin_ctzll(left) + 1);
		left &= left - 1;
	}
	return out;
}
