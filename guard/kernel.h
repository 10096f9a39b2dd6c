/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Parts of the guard that hold descriptors of what is loaded; after guard_load() only. */
#ifndef GUARD_KERNEL_H
#define GUARD_KERNEL_H

#include "guard/guard.h"

enum { GUARD_PATH = 256 };

/* The path of a pin, or of the pins' folder for "". Returns `path`. */
const char *guard_pin(const char *name, char path[GUARD_PATH]);

/*
 * Check that the pins' folder is on a BPF file system; create it unless --pins gave it. Returns 0,
 * or an exit status after logging.
 */
int guard_make_pin_folder(void);

/* Give the counters to group pokeys, whose members read them where they can enter the folder. */
void guard_open_pins(void);

/* Log what was refused, and what is lost without it. Returns an exit status. */
int guard_refused(const char *what, int error);

/* They stay ours: not to be closed. */
int guard_program_fd(void);
int guard_devices_fd(void);
int guard_ports_fd(void);
int guard_sockets_fd(void); /* loaded with sockets only */

/* The program stays attached while its link is open. 0, or -errno of a pin that is left. */
int guard_remove_pins(void);

#endif
