/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A HAL that consists of arrays: enough to load pokeys_shm.so, or LinuxCNC's pid.so, and run its
 * functs by hand.
 */
#ifndef TESTS_HALBRIDGE_FAKE_HAL_H
#define TESTS_HALBRIDGE_FAKE_HAL_H

#include <stddef.h>

struct fake_module {
	void *handle;
	int (*main)(void);
	void (*exit)(void);
};

/*
 * Load the module and give it its parameters (NULL = not given). Returns 0,
 * else what the module's main returned, or -ENOENT if it cannot be loaded.
 */
int fake_hal_load(struct fake_module *module, const char *path, const char *devices,
		  const char *names, const char *runtime);
/* One that gets no parameters. */
int fake_hal_load_plain(struct fake_module *module, const char *path);
void fake_hal_unload(struct fake_module *module);

/* Run an exported funct; aborts if there is none of that name. */
struct fake_funct {
	void (*run)(void *argument, long period);
	void *argument;
};
struct fake_funct fake_hal_funct(const char *name);

/* Where a pin's or parameter's value is; NULL if there is none of that name. */
void *fake_hal_value(const char *name);
size_t fake_hal_names(void);

/* The last line the module printed, and how many at error level. */
const char *fake_hal_said(void);
unsigned int fake_hal_errors(void);

/* How many lines at error level have had this in them. Any thread. */
unsigned int fake_hal_complaints(const char *part);

#endif
