/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Lists as a person writes them into pokeysd.conf: "31-34, 20". Cold. */
#ifndef SETTINGS_LIST_H
#define SETTINGS_LIST_H

#include <stdbool.h>
#include <stddef.h>

/* The next part of a list with commas, without blanks around it; false at its end. */
bool list_part(const char **rest, char *part, size_t size);

/*
 * "7" or "7-12" into a first and a last terminal, both of minimum..maximum. NULL, or
 * what is wrong (a static text to stand behind what was given).
 */
const char *list_range(const char *text, int minimum, int maximum, int *first, int *last);

#endif
