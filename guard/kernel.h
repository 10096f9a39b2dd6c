/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Parts of the guard that hold descriptors of what is loaded; after guard_load() only. */
#ifndef GUARD_KERNEL_H
#define GUARD_KERNEL_H

#include "guard/guard.h"

#define GUARD_LINK GUARD_PINS "/link"

/* They stay ours: not to be closed. */
int guard_program_fd(void);
int guard_devices_fd(void);
int guard_ports_fd(void);
int guard_sockets_fd(void);		/* loaded with sockets only */

/* Names in GUARD_PINS only; what is attached goes with its link. */
void guard_remove_pins(void);

#endif
