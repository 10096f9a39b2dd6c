/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Parts of the guard that hold descriptors of what is loaded; after guard_load() only. */
#ifndef GUARD_KERNEL_H
#define GUARD_KERNEL_H

#include "guard/guard.h"

enum { GUARD_PATH = 256 };

/* The path of a pin, or of the pins' folder for "". Returns `path`. */
const char *guard_pin(const char *name, char path[GUARD_PATH]);

/* Check the place for pins; make the folder if it is ours. 0, or an exit status after a line. */
int guard_make_pin_folder(void);

/* Let group pokeys read the counters, where it can get to the folder at all. */
void guard_open_pins(void);

/* What the kernel refused, in a line with what is lost. An exit status. */
int guard_refused(const char *what, int error);

/* They stay ours: not to be closed. */
int guard_program_fd(void);
int guard_devices_fd(void);
int guard_ports_fd(void);
int guard_sockets_fd(void);		/* loaded with sockets only */

/* Names only; what is attached goes with its link. 0, or -errno of one that is left. */
int guard_remove_pins(void);

#endif
