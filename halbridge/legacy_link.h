/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Is an axis driven by its older name?
 */
#ifndef HALBRIDGE_LEGACY_LINK_H
#define HALBRIDGE_LEGACY_LINK_H

#include <stdbool.h>
#include <pokeys/state.h>

struct legacy_link {
	void *volatile *pointer[POKEYS_AXES]; /* of PEv2.N.joint-pos-cmd; NULL = not exported */
	void *own[POKEYS_AXES];               /* where it points while it is not linked */
};

/* After the export; `pointers` as for the binding, filled by HAL. Cold. */
void legacy_link_init(struct legacy_link *link, void *volatile *pointers, unsigned int schemes);

/* Which axes' pins are linked now. Realtime. */
void legacy_link_look(const struct legacy_link *link, bool linked[POKEYS_AXES]);

#endif
