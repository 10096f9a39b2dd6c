/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Why a thread of our own: printing from the servo thread formats, and may
 * wait for the reader of a pipe; and a device that was not named must be
 * looked for in files. Ten times a second this thread compares what is with
 * what it last said, and prints a line when it changed.
 *
 * Everything at RTAPI_MSG_ERR becomes a pop-up on the operator's screen, so
 * only what needs a hand goes there: a connection that was lost, a daemon
 * that cannot be used, a value that is not. A link that comes and goes is
 * said once in ten seconds.
 *
 * It is joined before the module is unmapped; a thread that outlives that
 * takes LinuxCNC with it. Its class is set, not inherited.
 */
#include "halbridge/monitor.h"
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <pokeys/names.h>
#include <rtapi.h>
#include "halbridge/find_serial.h"
#include "halbridge/latency.h"
#include "shm/mirror.h"

enum {
	ROUND_MS = 100,
	FOLLOW_MS = 50, /* how often the library looks for another daemon */
	QUIET_ROUNDS = 100,
	REFUSED_ROUNDS = 5,        /* the place of a commander that died is free in less */
	CREDIT_MOST = 5,           /* refusals at once; one more each second */
	SEARCH_ROUNDS = 10,        /* for a serial number: that attaches to every device */
	STACK_BYTES = 1024 * 1024, /* it attaches in here, which wants 160 kB and more */
};

int monitor_open_client(struct instance *instance, const char *runtime)
{
	pokeys_client *client;
	int r = pokeys_client_open(&client, runtime, instance->device, "pokeys_shm",
				   POKEYS_CLIENT_COMMANDER);

	if (r)
		return r;
	r = pokeys_client_follow(client, FOLLOW_MS);
	if (r) {
		pokeys_client_close(client);
		return r;
	}
	instance->client = client;
	handover_swap(&instance->reader, client);
	handover_swap(&instance->writer, client);
	return 0;
}

/* The daemon's only device, if it has only one. Returns how many, or -errno. */
static int only_device(const char *runtime, char name[POKEYS_SHM_NAME_MAX], char *all, size_t size)
{
	char names[TABLE_DEVICES][POKEYS_SHM_NAME_MAX];
	int count = pokeys_shm_devices(runtime, names, TABLE_DEVICES);
	size_t at = 0;

	if (count == 1)
		memcpy(name, names[0], POKEYS_SHM_NAME_MAX);
	all[0] = '\0';
	for (int i = 0; i < count && i < TABLE_DEVICES && at < size; i++)
		at += (size_t)snprintf(all + at, size - at, "%s%s", i ? "," : "", names[i]);
	return count;
}

/* No device was named: take the only one there is. What hinders goes to `why`. */
static enum pokeys_client_state look_for_device(const struct monitor *monitor,
						struct instance *instance, char why[MONITOR_LINE])
{
	const char *folder = monitor->runtime ? monitor->runtime : POKEYS_RUNTIME_DIRECTORY;
	char all[TABLE_DEVICES * (POKEYS_SHM_NAME_MAX + 12)];
	int count, r;

	if (instance->no_serial) {
		snprintf(why, MONITOR_LINE,
			 "no device is driven, for its DEVICE_ID is no serial "
			 "number; mend that in the INI file, or leave it out for the only one");
		return POKEYS_CLIENT_REFUSED;
	}
	count = instance->serial ?
			find_serial(monitor->runtime, instance->serial, instance->device, all,
				    sizeof(all)) :
			only_device(monitor->runtime, instance->device, all, sizeof(all));
	if (count == 0 && *all) {
		snprintf(why, MONITOR_LINE,
			 "no device of the daemon has the serial number %u yet "
			 "(%s)",
			 instance->serial, all);
		return POKEYS_CLIENT_DETACHED;
	}
	if (count == 0) {
		snprintf(why, MONITOR_LINE, "no daemon in %s; is pokeysd running?", folder);
		return POKEYS_CLIENT_DETACHED;
	}
	if (count == 1) {
		r = monitor_open_client(instance, monitor->runtime);
		snprintf(why, MONITOR_LINE, "device '%s': %s", instance->device, strerror(-r));
		return r ? POKEYS_CLIENT_REFUSED : POKEYS_CLIENT_DETACHED;
	}
	if (count < 0)
		mirror_explain(folder, count, why, MONITOR_LINE);
	else
		snprintf(why, MONITOR_LINE,
			 "the daemon has %d devices (%s): name one with devices= (or, for "
			 "the userspace component, [POKEYS]DEVICE_ID)",
			 count, all);
	return POKEYS_CLIENT_REFUSED;
}

static enum pokeys_client_state attachment(const struct monitor *monitor, struct instance *instance,
					   char why[MONITOR_LINE])
{
	volatile uint32_t *attach_state = &instance->binding.values->attach_state;
	enum pokeys_client_state state;

	if (instance->client)
		state = pokeys_client_status(instance->client, why, MONITOR_LINE);
	else
		state = look_for_device(monitor, instance, why);
	if (state != POKEYS_CLIENT_ATTACHED || *attach_state != 2)
		return state;
	snprintf(why, MONITOR_LINE,
		 "device '%s': what is in shared memory is not a state image "
		 "of this version",
		 instance->device);
	return POKEYS_CLIENT_REFUSED;
}

/* Say how attaching stands, when that has changed and is not about to change again. */
static void say_attachment(struct monitor *monitor, struct instance *instance)
{
	struct monitor_memory *memory = &monitor->memory[instance->number];
	char why[MONITOR_LINE] = "";
	enum pokeys_client_state state = attachment(monitor, instance, why);
	bool refused = state == POKEYS_CLIENT_REFUSED;

	atomic_store(&instance->refused, refused);
	memory->rounds = strcmp(why, memory->seen) ? 0 : memory->rounds + 1;
	memcpy(memory->seen, why, sizeof(why));
	if (memory->rounds < (refused ? REFUSED_ROUNDS : 1) || !strcmp(why, memory->said))
		return;
	memcpy(memory->said, why, sizeof(why));
	rtapi_print_msg(refused ? RTAPI_MSG_ERR : RTAPI_MSG_INFO, "%s: %s\n", instance->prefix,
			why);
}

static void say_connection(struct monitor *monitor, struct instance *instance)
{
	struct monitor_memory *memory = &monitor->memory[instance->number];
	const struct values *values = instance->binding.values;
	bool connected = *(const volatile bool *)&values->connected;

	memory->quiet -= memory->quiet > 0;
	if (connected == memory->was_connected)
		return;
	if (connected) {
		rtapi_print_msg(RTAPI_MSG_INFO, "%s: device '%s', serial %u, is connected\n",
				instance->prefix, instance->device, values->info.serial);
	} else if (memory->quiet) {
		return; /* said below, if it lasts */
	} else if (!values->daemon_alive) {
		rtapi_print_msg(RTAPI_MSG_ERR,
				"%s: connection to '%s' lost: nothing new from "
				"pokeysd; it was held up, or does not run (pokeysctl status)\n",
				instance->prefix, instance->device);
		memory->quiet = QUIET_ROUNDS;
	} else {
		rtapi_print_msg(RTAPI_MSG_ERR,
				"%s: connection to '%s' lost: data "
				"%.0f ms old, link %s, fault: %s\n",
				instance->prefix, instance->device, values->age_us / 1000,
				pokeys_link_name((uint8_t)values->link_state),
				pokeys_fault_name((uint8_t)values->fault));
		memory->quiet = QUIET_ROUNDS;
	}
	memory->was_connected = connected;
}

static void say_refusals(struct monitor *monitor, struct instance *instance)
{
	struct monitor_memory *memory = &monitor->memory[instance->number];
	struct refusal_note note;
	char line[MONITOR_LINE];

	while (memory->credit && refusal_take(&instance->exchange.refusals, &note)) {
		memory->credit--;
		refusal_line(&note, instance->prefix, instance->schemes, line, sizeof(line));
		rtapi_print_msg(RTAPI_MSG_ERR, "%s\n", line);
	}
}

static void say_callers(struct monitor *monitor, struct instance *instance)
{
	const struct callers_seen seen = {
		.reader = atomic_load_explicit(&instance->read_by, memory_order_relaxed),
		.writer = atomic_load_explicit(&instance->write_by, memory_order_relaxed),
		.reads = atomic_load_explicit(&instance->reader.use, memory_order_relaxed),
		.writes = atomic_load_explicit(&instance->writer.use, memory_order_relaxed),
	};

	const char *device = instance->device[0] ? instance->device : "not found yet";
	const char *prefix = instance->prefix;

	switch (callers_look(&monitor->memory[instance->number].callers, &seen)) {
	case CALLERS_AS_BEFORE:
		break;
	case CALLERS_TWO_THREADS:
		rtapi_print_msg(RTAPI_MSG_ERR,
				"%s (device '%s'): %s.read and %s.write are in "
				"different threads, and one that interrupts the other makes wrong "
				"commands; delf one of them and addf it to the other's thread\n",
				prefix, device, prefix, prefix);
		break;
	case CALLERS_NO_READ:
		rtapi_print_msg(RTAPI_MSG_ERR,
				"%s (device '%s'): %s.write runs without "
				"%s.read: positions are unknown, and no axis is driven; use addf "
				"to add %s.read to the same thread before %s.write, then switch "
				"the machine off and on\n",
				prefix, device, prefix, prefix, prefix, prefix);
		break;
	}
}

static void say_timing(struct monitor *monitor, const struct instance *instance)
{
	struct monitor_memory *memory = &monitor->memory[instance->number];
	const struct values *values = instance->binding.values;
	const uint32_t count = *(const volatile uint32_t *)&values->time_exceeded_count;

	memory->slow_quiet -= memory->slow_quiet > 0;
	if (count == memory->exceeded || memory->slow_quiet)
		return;
	rtapi_print_msg(memory->exceeded ? RTAPI_MSG_WARN : RTAPI_MSG_ERR,
			"%s: read and write took %u us in one period, more than time-threshold "
			"(%g us); %u such period%s so far; run \"pokeysctl doctor\" to find "
			"the cause\n",
			instance->prefix,
			atomic_load_explicit(&instance->timing.last_us, memory_order_relaxed),
			values->time_threshold, count, count == 1 ? "" : "s");
	memory->exceeded = count;
	memory->slow_quiet = QUIET_ROUNDS;
}

static void say_setting(void *argument, const struct wish_item *item, double value)
{
	const struct instance *instance = argument;
	char line[MONITOR_LINE];

	wisher_explain(item, instance->prefix, value, line, sizeof(line));
	rtapi_print_msg(RTAPI_MSG_ERR, "%s\n", line);
}

static void see_to_settings(struct instance *instance)
{
	volatile uint32_t *session = &instance->exchange.command.session;

	wisher_round(&instance->wisher, instance->binding.values, instance->client, *session,
		     say_setting, instance);
}

static void say_range(void *argument, const struct legacy_range_item *item, double value)
{
	const struct instance *instance = argument;
	char name[TABLE_NAME_MAX + 1];

	table_full_name(item->row, instance->prefix, item->index, name);
	if (item->row->low < item->row->high)
		rtapi_print_msg(RTAPI_MSG_ERR,
				"%s = %.10g: must be %.10g to %.10g; it is %.10g "
				"again\n",
				name, value, item->row->low, item->row->high, item->good);
	else
		rtapi_print_msg(RTAPI_MSG_ERR, "%s = %g: must be a number; it is %g again\n", name,
				value, item->good);
}

/* What the older names say of the device's settings. */
static void see_to_older_names(struct instance *instance)
{
	if (!instance->exchange.legacy.on)
		return;
	legacy_range_look(&instance->range, instance->values, say_range, instance);
	legacy_settings_look(&instance->settings, instance->values,
			     instance->exchange.legacy.linked);
}

static void look_around(struct monitor *monitor, unsigned int number)
{
	for (size_t i = 0; i < monitor->count; i++) {
		struct monitor_memory *memory = &monitor->memory[i];
		struct instance *instance = monitor->instances[i];

		if (number % (1000 / ROUND_MS) == 0 && memory->credit < CREDIT_MOST)
			memory->credit++;
		see_to_older_names(instance);
		if (instance->client || !instance->serial || number % SEARCH_ROUNDS == 0)
			say_attachment(monitor, instance);
		say_connection(monitor, instance);
		say_refusals(monitor, instance);
		say_callers(monitor, instance);
		say_timing(monitor, instance);
		see_to_settings(instance);
		if (instance->client && number % (1000 / ROUND_MS) == 0)
			latency_round(instance->values, instance->client, &instance->diag);
	}
}

/* Until the next round. The lock is held. */
static void wait_a_round(struct monitor *monitor)
{
	struct timespec when;

	clock_gettime(CLOCK_MONOTONIC, &when);
	when.tv_nsec += ROUND_MS * 1000000L;
	when.tv_sec += when.tv_nsec / 1000000000;
	when.tv_nsec %= 1000000000;
	while (!monitor->stop && !pthread_cond_timedwait(&monitor->wake, &monitor->lock, &when))
		;
}

static void *run(void *argument)
{
	struct monitor *monitor = argument;
	unsigned int number = 0;

	pthread_setname_np(pthread_self(), "pokeys-monitor");
	pthread_mutex_lock(&monitor->lock);
	while (!monitor->stop) {
		pthread_mutex_unlock(&monitor->lock);
		look_around(monitor, number++);
		pthread_mutex_lock(&monitor->lock);
		wait_a_round(monitor);
	}
	pthread_mutex_unlock(&monitor->lock);
	return NULL;
}

static int create_thread(struct monitor *monitor)
{
	const struct sched_param parameter = { .sched_priority = 0 };
	pthread_attr_t attributes;
	sigset_t all, before;
	int r = pthread_attr_init(&attributes);

	if (r)
		return -r;
	pthread_attr_setstacksize(&attributes, STACK_BYTES);
	pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
	pthread_attr_setschedpolicy(&attributes, SCHED_OTHER);
	pthread_attr_setschedparam(&attributes, &parameter);
	sigfillset(&all);
	pthread_sigmask(SIG_SETMASK, &all, &before);
	r = pthread_create(&monitor->thread, &attributes, run, monitor);
	pthread_sigmask(SIG_SETMASK, &before, NULL);
	pthread_attr_destroy(&attributes);
	return -r;
}

int monitor_start(struct monitor *monitor)
{
	pthread_condattr_t attributes;
	int r;

	memset(monitor->memory, 0, sizeof(monitor->memory));
	for (size_t i = 0; i < monitor->count; i++)
		monitor->memory[i].credit = CREDIT_MOST;
	monitor->stop = false;
	pthread_mutex_init(&monitor->lock, NULL);
	pthread_condattr_init(&attributes);
	pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
	pthread_cond_init(&monitor->wake, &attributes);
	pthread_condattr_destroy(&attributes);
	r = create_thread(monitor);
	monitor->running = !r;
	return r;
}

void monitor_stop(struct monitor *monitor)
{
	if (!monitor->running)
		return;
	pthread_mutex_lock(&monitor->lock);
	monitor->stop = true;
	pthread_cond_signal(&monitor->wake);
	pthread_mutex_unlock(&monitor->lock);
	pthread_join(monitor->thread, NULL);
	pthread_cond_destroy(&monitor->wake);
	pthread_mutex_destroy(&monitor->lock);
	monitor->running = false;
}
