/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Has a part of the image changed since the pins were filled from it?
 */
#ifndef HALBRIDGE_NEWS_H
#define HALBRIDGE_NEWS_H

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

/* Compare with what was seen last and remember. `first`: nothing was seen yet. Realtime. */
static inline bool news(void *seen, const void *now, size_t size, bool first)
{
	if (!first && !memcmp(seen, now, size))
		return false;
	memcpy(seen, now, size);
	return true;
}

#endif
