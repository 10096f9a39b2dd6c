// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Lists of terminals stand in keys of the device's settings and in keys that are
 * the daemon's own (safe-on, safe-hold): one reader for both, or one day a list
 * would be right in one key and wrong in the next.
 */
#include <stdlib.h>
#include <string.h>
#include "settings/list.h"

bool list_part(const char **rest, char *part, size_t size)
{
	const char *start = *rest;
	size_t length;

	if (!start)
		return false;
	length = strcspn(start, ",");
	*rest = start[length] ? start + length + 1 : NULL;
	while (length && strchr(" \t", *start)) {
		start++;
		length--;
	}
	while (length && strchr(" \t", start[length - 1]))
		length--;
	if (length >= size)
		length = size - 1;
	memcpy(part, start, length);
	part[length] = '\0';
	return true;
}

const char *list_range(const char *text, int minimum, int maximum, int *first, int *last)
{
	size_t digits = strspn(text, "0123456789");
	size_t more = text[digits] == '-' ? strspn(text + digits + 1, "0123456789") : 0;
	size_t used = digits + (more ? more + 1 : 0);

	if (!digits || text[used] || digits > 3 || more > 3)
		return "is not a list of pins";
	*first = atoi(text);
	*last = more ? atoi(text + digits + 1) : *first;
	if (*first < minimum || *last > maximum)
		return "names a pin that is out of range";
	if (*first > *last)
		return "has a range that ends before it begins";
	return NULL;
}
