/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Which of the daemon's devices has a serial number?
 */
#ifndef HALBRIDGE_FIND_SERIAL_H
#define HALBRIDGE_FIND_SERIAL_H

#include <stddef.h>
#include <stdint.h>
#include <pokeys/shm.h>

/*
 * Look into the state of each device. Returns 1 and its name, 0 if none has
 * it (yet: a device that was not found on the network has no number), or
 * -errno; `all` gets names and numbers for a person. Cold, some milliseconds.
 */
int find_serial(const char *runtime, uint32_t serial, char name[POKEYS_SHM_NAME_MAX], char *all,
		size_t size);

#endif
