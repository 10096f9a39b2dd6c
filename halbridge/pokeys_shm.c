/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * pokeys_shm: the realtime HAL component. A shell: it exports what the table
 * says and copies images and pins around the exchange.
 *
 * The two functs make no system call and take no lock: reading and writing
 * shared memory is wait-free, the clock is read through the vDSO, and nothing
 * is printed. Loading needs neither daemon nor device: the pins are there and
 * `connected` is false until the library's thread finds them.
 *
 * Everything a pin points to is in HAL's memory, which outlives the module;
 * everything else is allocated here and freed after HAL has taken the functs
 * out of its threads and the last visit is over.
 *
 * Statics are set anew at each start and end: HAL's loader may keep the
 * shared object mapped after unloadrt, and a module that is loaded again then
 * finds the values, even the module parameters, of its former life.
 */
#include <errno.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <rtapi.h>
#include <rtapi_app.h>
#include <hal.h>
#include "halbridge/ini_adopt.h"
#include "halbridge/instance.h"
#include "halbridge/monitor.h"
#include "halbridge/settings.h"

int rtapi_app_main(void);
void rtapi_app_exit(void);

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic" /* the macros end in a semicolon of their own */
MODULE_AUTHOR("pokeysd");
MODULE_DESCRIPTION("PoKeys devices through the shared memory of pokeysd");
MODULE_LICENSE("GPL");

static char *devices;
RTAPI_MP_STRING(devices, "devices of the daemon, comma separated; default: its only one");
static char *names;
RTAPI_MP_STRING(names,
		"naming schemes: both, canonical, core, legacy, heaters, servos, "
		"loops or all; default: both for the first device, canonical (with ini= legacy) "
		"for others");
static char *runtime;
RTAPI_MP_STRING(runtime, "runtime folder of the daemon; default " POKEYS_RUNTIME_DIRECTORY);
static char *ini;
RTAPI_MP_STRING(ini, "INI file whose [POKEYS] is read, as the userspace component does; "
		     "auto: the one LinuxCNC runs with; default: none");
#pragma GCC diagnostic pop

#define QUIET_NS	UINT64_C(20000000)	/* many servo periods without a visit: none runs */
#define QUIET_TRIES	50

static int component;
static bool loaded; /* all instances are whole */
static size_t instance_count;
static struct instance *instances[TABLE_DEVICES];
static struct monitor monitor;
static struct ini_file machine; /* path NULL: none */

/* pokeys.N.read. Realtime. */
static void read_funct(void *argument, long period)
{
	(void)period;
	instance_read(argument);
}

/* pokeys.N.write. Realtime. */
static void write_funct(void *argument, long period)
{
	instance_write(argument, (uint64_t)period);
}

static int export_functs(struct instance *instance)
{
	char name[HAL_NAME_LEN + 1];
	int r;

	snprintf(name, sizeof(name), "pokeys.%u.read", instance->number);
	r = hal_export_funct(name, read_funct, instance, 1, 0, component);
	if (r)
		return r;
	snprintf(name, sizeof(name), "pokeys.%u.write", instance->number);
	return hal_export_funct(name, write_funct, instance, 1, 0, component);
}

static int make_instance(unsigned int number, const char *device, unsigned int schemes)
{
	char prefix[INSTANCE_PREFIX];
	int r;

	snprintf(prefix, sizeof(prefix), "pokeys.%u", number);
	r = instance_make(&instances[number], component, number, prefix, schemes);
	if (r)
		return r;
	memcpy(instances[number]->device, device, sizeof(instances[number]->device));
	return export_functs(instances[number]);
}

static void adopt_machine(void)
{
	for (size_t i = 0; machine.path && i < instance_count; i++)
		ini_adopt(&machine, instances[i]);
}

static int start(const struct settings *settings)
{
	int r = 0;

	instance_count = settings->count;
	for (unsigned int i = 0; i < settings->count && !r; i++)
		r = make_instance(i, settings->device[i], settings->schemes[i]);
	if (!r)
		adopt_machine();
	for (size_t i = 0; i < settings->count && !r; i++) {
		if (instances[i]->device[0])
			r = monitor_open_client(instances[i], settings->runtime);
	}
	if (r)
		return r;
	monitor = (struct monitor){
		.runtime = settings->runtime,
		.instances = instances,
		.count = instance_count,
	};
	r = monitor_start(&monitor);
	if (!r)
		r = hal_ready(component);
	loaded = !r;
	return r;
}

/* How often our functs were entered and left so far; odd parts: under way. */
static uint32_t visits(bool *under_way)
{
	uint32_t sum = 0;

	*under_way = false;
	for (size_t i = 0; i < instance_count; i++) {
		uint32_t reads = instances[i] ? atomic_load(&instances[i]->reader.use) : 0;
		uint32_t writes = instances[i] ? atomic_load(&instances[i]->writer.use) : 0;

		*under_way |= (reads | writes) & 1;
		sum += reads + writes;
	}
	return sum;
}

/* Did any of our functs run, or was any under way, within the next `ns`? */
static bool visited_within(uint64_t ns)
{
	static const struct timespec moment = { .tv_nsec = 1000000 };
	uint64_t began = instance_now();
	bool under_way;
	uint32_t before = visits(&under_way);

	while (instance_now() - began < ns)
		nanosleep(&moment, NULL);
	return visits(&under_way) != before || under_way;
}

/*
 * HAL takes functs out of a running thread's list without asking where in it
 * the thread is; one that is inside ours then follows a pointer that is gone,
 * and takes LinuxCNC with it. So if the threads run (at a shutdown they do not
 * any more) they are stopped for the moment.
 */
static void leave_hal(void)
{
	bool running = visited_within(QUIET_NS);

	if (running)
		hal_stop_threads();
	for (size_t i = 0; loaded && i < instance_count; i++)
		instance_close(instances[i]);
	/* a slow thread still visits, but does nothing then */
	for (int i = 0; i < QUIET_TRIES && visited_within(QUIET_NS); i++)
		;
	for (size_t i = 0; loaded && i < instance_count; i++)
		instance_leave(instances[i]);
	hal_exit(component);
	if (running)
		hal_start_threads();
}

static void end(void)
{
	static const struct timespec settle = { .tv_nsec = 10000000 };

	monitor_stop(&monitor);
	if (component > 0)
		leave_hal();
	nanosleep(&settle, NULL); /* a thread may be on its way into a funct */
	for (size_t i = 0; i < TABLE_DEVICES; i++) {
		instance_end(instances[i]);
		instances[i] = NULL;
	}
	instance_count = 0;
	component = 0;
	loaded = false;
	devices = NULL;
	names = NULL;
	runtime = NULL;
	ini = NULL;
	ini_file_free(&machine);
	machine.path = NULL;
}

/* None if none is asked for. */
static int read_machine(char *why, size_t size)
{
	const char *path = ini;
	int r;

	machine.path = NULL;
	if (!ini || !*ini)
		return 0;
	if (!strcmp(ini, "auto"))
		path = getenv("INI_FILE_NAME");
	r = path ? ini_file_read(&machine, path) : -ENOENT;
	if (r)
		snprintf(why, size,
			 "ini=%s: %s; give the path of the machine's INI file, or "
			 "auto where LinuxCNC has set INI_FILE_NAME",
			 ini, strerror(-r));
	return r;
}

static int load(const struct settings *settings)
{
	int r;

	component = hal_init("pokeys_shm");
	r = component > 0 ? start(settings) : component;
	if (r)
		rtapi_print_msg(RTAPI_MSG_ERR, "pokeys_shm: not loaded: %s\n", strerror(-r));
	return r;
}

int rtapi_app_main(void)
{
	struct settings settings;
	char why[256];
	int r = read_machine(why, sizeof(why));

	if (!r)
		r = settings_read(&settings, devices, names, machine.path != NULL, runtime, why,
				  sizeof(why));
	/* what is said to loadrt counts more */
	if (!r && machine.path && !settings.runtime)
		r = ini_runtime(&machine, &settings.runtime, why, sizeof(why));
	if (r)
		rtapi_print_msg(RTAPI_MSG_ERR, "pokeys_shm: %s\n", why);
	else
		r = load(&settings);
	if (r)
		end();
	return r;
}

void rtapi_app_exit(void)
{
	end();
}
