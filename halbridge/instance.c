/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * One device in HAL, for both shells: the realtime module calls read and write
 * from its functs, the userspace component from a loop.
 *
 * Everything a pin points to is in HAL's memory, which outlives the component;
 * the rest is allocated here and freed after HAL has let go of the names.
 */
#include "halbridge/instance.h"
#include <errno.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>
#include <rtapi.h>
#include <hal.h>
#include "halbridge/memory.h"
#include "shm/read_into.h"

_Static_assert(sizeof(hal_bit_t) == sizeof(bool) && sizeof(hal_float_t) == sizeof(double) &&
		       sizeof(hal_s32_t) == 4 && sizeof(hal_u32_t) == 4,
	       "the binding copies these types");

#define NO_ROOM "HAL has no room for all names, try names=core"

uint64_t instance_now(void)
{
	struct timespec time;

	clock_gettime(CLOCK_MONOTONIC, &time);
	return (uint64_t)time.tv_sec * 1000000000 + (uint64_t)time.tv_nsec;
}

static enum exchange_got get(struct instance *instance, pokeys_client *client)
{
	struct pokeys_state *spare = exchange_spare(&instance->exchange);
	int r = client ? client_read_into(client, spare) : -ENOTCONN;

	if (!r) {
		instance->exchange.state = spare;
		return EXCHANGE_STATE;
	}
	if (r == -EPROTO || atomic_load_explicit(&instance->refused, memory_order_relaxed))
		return EXCHANGE_REFUSED;
	return EXCHANGE_NOTHING;
}

/* For the monitor. pthread_self() is a load: of glibc's it makes no system call. */
static void note_caller(_Atomic uintptr_t *who)
{
	atomic_store_explicit(who, (uintptr_t)pthread_self(), memory_order_relaxed);
}

static void read_device(struct instance *instance, pokeys_client *client)
{
	const uint64_t now_ns = instance_now();
	const enum exchange_got got = get(instance, client);

	note_caller(&instance->read_by);
	legacy_link_look(&instance->link, instance->exchange.legacy.linked);
	binding_gather(&instance->binding, TABLE_AT_READ);
	exchange_read(&instance->exchange, instance->binding.values, got, now_ns);
	binding_scatter(&instance->binding, TABLE_AT_READ);
	timing_read(&instance->timing, instance->binding.values, instance_now() - now_ns);
}

void instance_read(struct instance *instance)
{
	pokeys_client *client = handover_take(&instance->reader);

	if (!atomic_load(&instance->closed))
		read_device(instance, client);
	handover_give_back(&instance->reader);
}

static void write_device(struct instance *instance, pokeys_client *client, uint64_t period_ns)
{
	const uint64_t now_ns = instance_now();

	note_caller(&instance->write_by);
	binding_gather(&instance->binding, TABLE_AT_WRITE);
	exchange_write(&instance->exchange, instance->binding.values, now_ns, period_ns);
	exchange_written(&instance->exchange,
			 client && !pokeys_client_write(client, &instance->exchange.command));
	binding_scatter(&instance->binding, TABLE_AT_WRITE);
	if (instance->binding.values->read_missing)
		binding_scatter(&instance->binding, TABLE_AT_READ);
	timing_write(&instance->timing, instance->binding.values, instance_now() - now_ns);
}

void instance_write(struct instance *instance, uint64_t period_ns)
{
	pokeys_client *client = handover_take(&instance->writer);

	if (!atomic_load(&instance->closed))
		write_device(instance, client, period_ns);
	handover_give_back(&instance->writer);
}

void instance_close(struct instance *instance)
{
	atomic_store(&instance->closed, true);
}

void instance_leave(struct instance *instance)
{
	binding_gather(&instance->binding, TABLE_AT_READ);
	exchange_read(&instance->exchange, instance->binding.values, EXCHANGE_NOTHING,
		      instance_now());
	binding_scatter(&instance->binding, TABLE_AT_READ);
}

static hal_type_t hal_type(const struct table_row *row)
{
	static const hal_type_t types[] = { HAL_BIT, HAL_FLOAT, HAL_S32, HAL_U32 };

	return types[row->type];
}

static int export_pin(int component, const struct table_row *row, const char *name, void **pointer)
{
	static const hal_pin_dir_t directions[] = { HAL_IN, HAL_OUT, HAL_IO };

	return hal_pin_new(name, hal_type(row), directions[row->direction], pointer, component);
}

static int export_parameter(int component, const struct table_row *row, const char *name,
			    void *value)
{
	return hal_param_new(name, hal_type(row), row->direction == TABLE_RO ? HAL_RO : HAL_RW,
			     value, component);
}

/* All names of one device, pins in the order that the binding counts them. */
static int export_names(const struct instance *instance, int component)
{
	void **pointers = instance->pointers;
	char name[TABLE_NAME_MAX + 1];

	for (struct table_cursor at = table_walk(instance->schemes); table_next(&at);) {
		int r = table_full_name(at.row, instance->prefix, at.index, name);

		if (r >= 0)
			r = at.row->kind == TABLE_PIN ?
				    export_pin(component, at.row, name, pointers++) :
				    export_parameter(component, at.row, name,
						     (char *)instance->values + at.offset);
		if (r < 0) {
			rtapi_print_msg(RTAPI_MSG_ERR, "%s: cannot export %s: %s%s\n",
					instance->prefix, name, strerror(-r),
					r == -ENOMEM ? ": " NO_ROOM : "");
			return r;
		}
	}
	return 0;
}

/* Differs for each start of a commander; who reads it does not need it random. */
static uint32_t session(unsigned int number)
{
	uint64_t seed = (instance_now() ^ (uint64_t)getpid() << 32) + number;

	return (uint32_t)(seed * UINT64_C(0x9e3779b97f4a7c15) >> 32);
}

static int allocate(struct instance *instance)
{
	instance->values = memory_take(sizeof(*instance->values));
	instance->pointers = memory_take(table_pin_count(instance->schemes) *
					 sizeof(*instance->pointers));
	if (!instance->values || !instance->pointers) {
		rtapi_print_msg(RTAPI_MSG_ERR, "%s: " NO_ROOM "\n", instance->prefix);
		return -ENOMEM;
	}
	table_set_parameters(instance->values);
	return binding_init(&instance->binding, instance->values,
			    (void *volatile *)instance->pointers, instance->schemes);
}

int instance_make(struct instance **out, int component, unsigned int number, const char *prefix,
		  unsigned int schemes)
{
	struct instance *instance = calloc(1, sizeof(*instance));
	int r;

	*out = instance;
	if (!instance)
		return -ENOMEM;
	instance->number = number;
	instance->schemes = schemes;
	snprintf(instance->prefix, sizeof(instance->prefix), "%s", prefix);
	exchange_init(&instance->exchange, session(number));
	instance->exchange.legacy.on = schemes & TABLE_LEGACY;
	r = allocate(instance);
	if (!r)
		r = wish_init(&instance->wisher.wish);
	if (!r)
		r = legacy_range_init(&instance->range, instance->values);
	if (!r)
		r = export_names(instance, component);
	if (r)
		return r;
	binding_exported(&instance->binding);
	legacy_link_init(&instance->link, (void *volatile *)instance->pointers, schemes);
	/* before the first period the pins already say that they know nothing */
	exchange_read(&instance->exchange, instance->values, EXCHANGE_NOTHING, instance_now());
	binding_scatter_all(&instance->binding);
	return 0;
}

void instance_end(struct instance *instance)
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
