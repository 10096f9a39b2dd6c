/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Which slot of a binding is whose.
 */
#ifndef HALBRIDGE_LAYOUT_H
#define HALBRIDGE_LAYOUT_H

#include "halbridge/binding.h"

/* Fill slots and ranges of an empty binding. 0 or -ENOSPC. Cold. */
int layout_slots(struct binding *binding, unsigned int schemes);

#endif
