/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The functions of HAL and RTAPI that pokeys_shm.so and LinuxCNC's own pid.so use, on fixed arrays.
 * The module finds them in the executable (linked with its symbols exported).
 */
#include "tests/halbridge/fake_hal.h"
#include <dlfcn.h>
#include <errno.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <rtapi.h>
#include <hal.h>

enum { NAMES = 16384, ARENA = 1 << 20, FUNCTS = 16, COMPLAINTS = 64 };

static struct {
	char name[HAL_NAME_LEN + 1];
	void *value;
} entries[NAMES];
static size_t entry_count;
static uint64_t storage[NAMES];
static _Alignas(64) unsigned char arena[ARENA];
static size_t arena_used;
static struct {
	char name[HAL_NAME_LEN + 1];
	struct fake_funct funct;
} functs[FUNCTS];
static size_t funct_count;
static char said[1024];
static unsigned int errors;
static char complaints[COMPLAINTS][sizeof(said)];
static _Atomic unsigned int complaint_count;

int hal_init(const char *name)
{
	return strcmp(name, "pokeys_shm") && strcmp(name, "pid") ? -EINVAL : 1;
}

int hal_exit(int component)
{
	(void)component;
	entry_count = 0;
	funct_count = 0;
	arena_used = 0;
	return 0;
}

int hal_stop_threads(void)
{
	return 0;
}

int hal_start_threads(void)
{
	return 0;
}

int hal_ready(int component)
{
	return component == 1 ? 0 : -EINVAL;
}

/* Where HAL has its memory: the module looks for its own blocks there. */
static char some_memory[64];
char *hal_shmem_base = some_memory;

void *hal_malloc(long size)
{
	void *at = arena + arena_used;

	arena_used += ((size_t)size + 63) & ~(size_t)63;
	return arena_used > ARENA ? NULL : at;
}

static int enter(const char *name, void *value)
{
	if (entry_count == NAMES || strlen(name) > HAL_NAME_LEN || fake_hal_value(name))
		return -EINVAL;
	strcpy(entries[entry_count].name, name);
	entries[entry_count++].value = value;
	return 0;
}

int hal_pin_new(const char *name, hal_type_t type, hal_pin_dir_t direction, void **pointer,
		int component)
{
	(void)type;
	(void)direction;
	(void)component;
	storage[entry_count] = 0;
	*pointer = &storage[entry_count];
	return enter(name, *pointer);
}

/* The name of a pin is a format. */
static int new_pin(void **pointer, const char *format, va_list arguments)
{
	char name[HAL_NAME_LEN + 1];

	vsnprintf(name, sizeof(name), format, arguments);
	return hal_pin_new(name, HAL_FLOAT, HAL_IN, pointer, 1);
}

#define NEW_PIN(type_)									\
int hal_pin_##type_##_newf(hal_pin_dir_t direction, hal_##type_##_t **pointer, int component,	\
			   const char *format, ...)					\
{											\
	va_list arguments;								\
	int r;										\
											\
	(void)direction;								\
	(void)component;								\
	va_start(arguments, format);							\
	r = new_pin((void **)pointer, format, arguments);				\
	va_end(arguments);								\
	return r;									\
}

NEW_PIN(bit)
NEW_PIN(float)
NEW_PIN(s32)
NEW_PIN(u32)

int rtapi_snprintf(char *text, unsigned long size, const char *format, ...)
{
	va_list arguments;
	int length;

	va_start(arguments, format);
	length = vsnprintf(text, size, format, arguments);
	va_end(arguments);
	return length;
}

int rtapi_get_msg_level(void)
{
	return RTAPI_MSG_ERR;
}

int rtapi_set_msg_level(int level)
{
	(void)level;
	return 0;
}

int hal_param_new(const char *name, hal_type_t type, hal_param_dir_t direction, void *value,
		  int component)
{
	(void)type;
	(void)direction;
	(void)component;
	return enter(name, value);
}

int hal_export_funct(const char *name, void (*funct)(void *, long), void *argument, int fp,
		     int reentrant, int component)
{
	(void)fp;
	(void)reentrant;
	(void)component;
	if (funct_count == FUNCTS)
		return -ENOMEM;
	strcpy(functs[funct_count].name, name);
	functs[funct_count++].funct = (struct fake_funct){ funct, argument };
	return 0;
}

void rtapi_print_msg(msg_level_t level, const char *format, ...)
{
	va_list arguments;

	errors += level == RTAPI_MSG_ERR;
	va_start(arguments, format);
	vsnprintf(said, sizeof(said), format, arguments);
	va_end(arguments);
	if (level == RTAPI_MSG_ERR && complaint_count < COMPLAINTS) {
		snprintf(complaints[complaint_count], sizeof(complaints[0]), "%s", said);
		complaint_count++;
	}
}

static void give(void *handle, const char *symbol, const char *word)
{
	char ***address = dlsym(handle, symbol);

	**address = word ? strdup(word) : NULL;
}

static int open_module(struct fake_module *module, const char *path)
{
	module->handle = dlopen(path, RTLD_NOW | RTLD_GLOBAL);
	if (!module->handle) {
		fprintf(stderr, "%s\n", dlerror());
		return -ENOENT;
	}
	*(void **)&module->main = dlsym(module->handle, "rtapi_app_main");
	*(void **)&module->exit = dlsym(module->handle, "rtapi_app_exit");
	said[0] = '\0';
	errors = 0;
	complaint_count = 0;
	return 0;
}

int fake_hal_load_plain(struct fake_module *module, const char *path)
{
	int r = open_module(module, path);

	return r ? r : module->main();
}

int fake_hal_load(struct fake_module *module, const char *path, const char *devices,
		  const char *names, const char *runtime)
{
	int r = open_module(module, path);

	if (r)
		return r;
	give(module->handle, "rtapi_info_address_devices", devices);
	give(module->handle, "rtapi_info_address_names", names);
	give(module->handle, "rtapi_info_address_runtime", runtime);
	return module->main();
}

void fake_hal_unload(struct fake_module *module)
{
	module->exit();
	dlclose(module->handle);
}

struct fake_funct fake_hal_funct(const char *name)
{
	for (size_t i = 0; i < funct_count; i++) {
		if (!strcmp(functs[i].name, name))
			return functs[i].funct;
	}
	fprintf(stderr, "no funct %s\n", name);
	abort();
}

void *fake_hal_value(const char *name)
{
	for (size_t i = 0; i < entry_count; i++) {
		if (!strcmp(entries[i].name, name))
			return entries[i].value;
	}
	return NULL;
}

size_t fake_hal_names(void)
{
	return entry_count;
}

const char *fake_hal_said(void)
{
	return said;
}

unsigned int fake_hal_complaints(const char *part)
{
	unsigned int count = 0;

	for (unsigned int i = 0; i < complaint_count; i++)
		count += strstr(complaints[i], part) != NULL;
	return count;
}

unsigned int fake_hal_errors(void)
{
	return errors;
}
