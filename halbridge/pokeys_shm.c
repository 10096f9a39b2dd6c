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
#include <unistd.h>
#include <rtapi.h>
#include <rtapi_app.h>
#include <hal.h>
#include "halbridge/instance.h"
#include "halbridge/memory.h"
#include "halbridge/monitor.h"
#include "halbridge/settings.h"

int rtapi_app_main(void);
void rtapi_app_exit(void);

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"	/* the macros end in a semicolon of their own */
MODULE_AUTHOR("pokeysd");
MODULE_DESCRIPTION("PoKeys devices through the shared memory of pokeysd");
MODULE_LICENSE("GPL");

static char *devices;
RTAPI_MP_STRING(devices, "devices of the daemon, comma separated; default: its only one");
static char *names;
RTAPI_MP_STRING(names, "naming schemes: both, canonical, legacy or all; default: both "
		 "for the first device, canonical for others");
static char *runtime;
RTAPI_MP_STRING(runtime, "runtime folder of the daemon; default " POKEYS_RUNTIME_DIRECTORY);
#pragma GCC diagnostic pop

#define QUIET_NS	UINT64_C(20000000)	/* many servo periods without a visit: none runs */
#define QUIET_TRIES	50

static int component;
static size_t instance_count;
static struct instance *instances[TABLE_DEVICES];
static struct monitor monitor;

_Static_assert(sizeof(hal_bit_t) == sizeof(bool) && sizeof(hal_float_t) == sizeof(double) &&
	       sizeof(hal_s32_t) == 4 && sizeof(hal_u32_t) == 4, "the binding copies these types");

static uint64_t now(void)
{
	struct timespec time;

	clock_gettime(CLOCK_MONOTONIC, &time);
	return (uint64_t)time.tv_sec * 1000000000 + (uint64_t)time.tv_nsec;
}

static enum exchange_got get(struct instance *instance, pokeys_client *client)
{
	int r = client ? pokeys_client_read(client, &instance->exchange.state) : -ENOTCONN;

	if (!r)
		return EXCHANGE_STATE;
	if (r == -EPROTO || atomic_load_explicit(&instance->refused, memory_order_relaxed))
		return EXCHANGE_REFUSED;
	return EXCHANGE_NOTHING;
}

/* pokeys.N.read. Realtime. */
static void read_funct(void *argument, long period)
{
	struct instance *instance = argument;
	pokeys_client *client = handover_take(&instance->reader);
	enum exchange_got got = get(instance, client);

	(void)period;
	legacy_link_look(&instance->link, instance->exchange.legacy.linked);
	binding_gather(&instance->binding, TABLE_AT_READ);
	exchange_read(&instance->exchange, instance->binding.values, got, now());
	binding_scatter(&instance->binding, TABLE_AT_READ);
	handover_give_back(&instance->reader);
}

/* pokeys.N.write. Realtime. */
static void write_funct(void *argument, long period)
{
	struct instance *instance = argument;
	pokeys_client *client = handover_take(&instance->writer);

	binding_gather(&instance->binding, TABLE_AT_WRITE);
	exchange_write(&instance->exchange, instance->binding.values, now(), (uint64_t)period);
	exchange_written(&instance->exchange,
			 client && !pokeys_client_write(client, &instance->exchange.command));
	binding_scatter(&instance->binding, TABLE_AT_WRITE);
	handover_give_back(&instance->writer);
}

static hal_type_t hal_type(const struct table_row *row)
{
	static const hal_type_t types[] = { HAL_BIT, HAL_FLOAT, HAL_S32, HAL_U32 };

	return types[row->type];
}

static int export_pin(const struct table_row *row, const char *name, void **pointer)
{
	static const hal_pin_dir_t directions[] = { HAL_IN, HAL_OUT, HAL_IO };

	return hal_pin_new(name, hal_type(row), directions[row->direction], pointer, component);
}

static int export_parameter(const struct table_row *row, const char *name, void *value)
{
	return hal_param_new(name, hal_type(row), row->direction == TABLE_RO ? HAL_RO : HAL_RW,
			     value, component);
}

/* All names of one device, pins in the order that the binding counts them. */
static int export_names(const struct instance *instance, struct values *values, void **pointers)
{
	char name[TABLE_NAME_MAX + 1];

	for (struct table_cursor at = table_walk(instance->schemes); table_next(&at);) {
		int r = table_name(at.row, instance->number, at.index, name);

		if (r >= 0)
			r = at.row->kind == TABLE_PIN ?
			    export_pin(at.row, name, pointers++) :
			    export_parameter(at.row, name, (char *)values + at.offset);
		if (r < 0) {
			rtapi_print_msg(RTAPI_MSG_ERR, "pokeys_shm: cannot export %s: %s%s\n",
					name, strerror(-r), r == -ENOMEM ? ": HAL has no "
					"room for all names, try names=canonical" : "");
			return r;
		}
	}
	return 0;
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

/* Differs for each start of a commander; who reads it does not need it random. */
static uint32_t session(unsigned int number)
{
	uint64_t seed = (now() ^ (uint64_t)getpid() << 32) + number;

	return (uint32_t)(seed * UINT64_C(0x9e3779b97f4a7c15) >> 32);
}

static int make_instance(unsigned int number, const char *device, unsigned int schemes)
{
	const size_t pins = table_pin_count(schemes);
	struct instance *instance = calloc(1, sizeof(*instance));
	struct values *values = memory_take(sizeof(*values));
	void **pointers = memory_take(pins * sizeof(*pointers));
	int r;

	instances[number] = instance;
	if (instance) {
		instance->values = values;
		instance->pointers = pointers;
	}
	if (!instance || !values || !pointers)
		return -ENOMEM;
	instance->number = number;
	instance->schemes = schemes;
	memcpy(instance->device, device, sizeof(instance->device));
	table_set_parameters(values);
	exchange_init(&instance->exchange, session(number));
	instance->exchange.legacy.on = schemes & TABLE_LEGACY;
	r = binding_init(&instance->binding, values, (void *volatile *)pointers,
			 schemes);
	if (!r)
		r = wish_init(&instance->wisher.wish);
	if (!r)
		r = export_names(instance, values, pointers);
	if (r)
		return r;
	legacy_link_init(&instance->link, (void *volatile *)pointers, schemes);
	/* before the first period the pins already say that they know nothing */
	exchange_read(&instance->exchange, values, EXCHANGE_NOTHING, now());
	binding_scatter_all(&instance->binding, TABLE_AT_READ);
	return export_functs(instance);
}

static int start(const struct settings *settings)
{
	int r = 0;

	instance_count = settings->count;
	for (unsigned int i = 0; i < settings->count && !r; i++)
		r = make_instance(i, settings->device[i], settings->schemes[i]);
	for (size_t i = 0; i < settings->count && !r; i++) {
		if (instances[i]->device[0])
			r = monitor_open_client(instances[i], settings->runtime);
	}
	if (r)
		return r;
	monitor = (struct monitor){
		.runtime = settings->runtime, .instances = instances, .count = instance_count,
	};
	r = monitor_start(&monitor);
	return r ? r : hal_ready(component);
}

/* Nobody is in the functs any more when this returns; then all is freed. */
static void end_instance(struct instance *instance)
{
	if (!instance)
		return;
	handover_swap(&instance->reader, NULL);
	handover_swap(&instance->writer, NULL);
	pokeys_client_close(instance->client);
	memory_give_back(instance->values);
	memory_give_back(instance->pointers);
	free(instance);
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
	uint64_t began = now();
	bool under_way;
	uint32_t before = visits(&under_way);

	while (now() - began < ns)
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
	for (int i = 0; running && i < QUIET_TRIES && visited_within(QUIET_NS); i++)
		;
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
	nanosleep(&settle, NULL);	/* a thread may be on its way into a funct */
	for (size_t i = 0; i < TABLE_DEVICES; i++) {
		end_instance(instances[i]);
		instances[i] = NULL;
	}
	instance_count = 0;
	component = 0;
	devices = NULL;
	names = NULL;
	runtime = NULL;
}

int rtapi_app_main(void)
{
	struct settings settings;
	char why[256];
	int r = settings_read(&settings, devices, names, runtime, why, sizeof(why));

	if (r) {
		rtapi_print_msg(RTAPI_MSG_ERR, "pokeys_shm: %s\n", why);
		end();
		return r;
	}
	component = hal_init("pokeys_shm");
	r = component > 0 ? start(&settings) : component;
	if (r) {
		rtapi_print_msg(RTAPI_MSG_ERR, "pokeys_shm: not loaded: %s\n", strerror(-r));
		end();
	}
	return r;
}

void rtapi_app_exit(void)
{
	end();
}
