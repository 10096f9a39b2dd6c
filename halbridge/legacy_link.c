/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The older component moved an axis when the machine was on and AxisEnabled
 * was set, and AxisEnabled shows what the device has. Both schemes are there
 * at once, so that alone would let an axis go that is driven by its canonical
 * names, and is kept still by their enable. What tells the two apart is which
 * of the names a machine has connected: HAL points an unconnected pin at a
 * place of its own, and at the signal when it is linked.
 */
#include "halbridge/legacy_link.h"
#include <string.h>
#include "halbridge/table.h"
#include "halbridge/values.h"

/* Which axis' position command stands at this offset, POKEYS_AXES = none. */
static unsigned int axis_at(size_t offset)
{
	const size_t size = sizeof(struct value_joint);
	unsigned int axis = 0;

	while (axis < POKEYS_AXES &&
	       offset != offsetof(struct values, joint[0].pos_cmd) + axis * size)
		axis++;
	return axis;
}

void legacy_link_init(struct legacy_link *link, void *volatile *pointers, unsigned int schemes)
{
	size_t pin = 0;

	memset(link, 0, sizeof(*link));
	for (struct table_cursor name = table_walk(schemes); table_next(&name);) {
		unsigned int axis = axis_at(name.offset);

		if (name.row->kind != TABLE_PIN)
			continue;
		if (axis < POKEYS_AXES && name.row->scheme == TABLE_LEGACY) {
			link->pointer[axis] = &pointers[pin];
			link->own[axis] = pointers[pin];
		}
		pin++;
	}
}

void legacy_link_look(const struct legacy_link *link, bool linked[POKEYS_AXES])
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		linked[i] = link->pointer[i] && *link->pointer[i] != link->own[i];
}
