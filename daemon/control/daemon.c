// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The order in which things are taken, and given back.
 *
 * An interface that is not there is waited for before anything is taken. Memory is
 * locked before the large allocations, so that they are locked as they come.
 * The runtime folder is taken before the network: a second daemon must not
 * send a single packet to a device that the first one drives. The shared
 * memory is published only after the loop has run, so that a reader never
 * finds an image that nobody has written.
 *
 * Taking the folder clears what a daemon that was killed has left there. So one that is
 * asked to end before it has begun (signals.c) takes it all the same, and goes no further.
 *
 * Everything refused here is refused before a device was touched, in one line
 * that says what to do.
 */
#include <errno.h>
#include <net/if.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "daemon/control/clock.h"
#include "daemon/control/daemon.h"
#include "daemon/control/log.h"
#include "daemon/control/notify.h"
#include "daemon/control/options.h"
#include "daemon/control/signals.h"
#include "daemon/control/thread.h"
#include "daemon/rt/realtime.h"
#include "shm/runtime.h"

_Static_assert((int)CONFIG_PATH_MAX == (int)SHM_DIRECTORY_MAX, "a folder that is taken");

enum { FIRST_CYCLES = 3, INTERFACE_S = 10, LOOK_MS = 100, START_MS = 5000, STOP_MS = 950 };

static void sleep_ms(long ms)
{
	const struct timespec nap = { .tv_nsec = ms * 1000000 };

	nanosleep(&nap, NULL);
}

/*
 * While a machine starts, a USB adapter or a VLAN comes seconds after us. The service
 * manager would have started us ten times by then, and no more; those who wait so long
 * are started again for as long as it takes.
 */
static int await_interface(const struct config *config)
{
	if (!*config->interface || if_nametoindex(config->interface))
		return 0;
	log_line(EVENT_WARNING,
		 "there is no network interface %s (ip link lists those that are "
		 "there); waiting for it",
		 config->interface);
	for (int waited = 0; waited < INTERFACE_S * 1000; waited += LOOK_MS) {
		sleep_ms(LOOK_MS);
		if (signals_ending())
			return 0;
		if (!if_nametoindex(config->interface))
			continue;
		log_line(EVENT_NOTICE, "%s is there", config->interface);
		return 0;
	}
	log_line(EVENT_ERROR, "%s has not come in %d s; was another one meant (interface)?",
		 config->interface, INTERFACE_S);
	return STATUS_FAILED;
}

/*
 * What comes in at a port of a bridge, or at one interface of a bond, belongs to the
 * whole: a socket that is bound to the part is given nothing of it.
 */
static void warn_of_part(const char *interface)
{
	static const char *const marks[] = { "brport", "bonding_slave" };
	char path[80], whole[256] = "";
	const char *name;
	bool part = false;

	for (size_t i = 0; i < sizeof(marks) / sizeof(marks[0]); i++) {
		snprintf(path, sizeof(path), "/sys/class/net/%s/%s", interface, marks[i]);
		part |= !access(path, F_OK);
	}
	snprintf(path, sizeof(path), "/sys/class/net/%s/master", interface);
	if (!*interface || !part || readlink(path, whole, sizeof(whole) - 1) < 0)
		return;
	name = strrchr(whole, '/') ? strrchr(whole, '/') + 1 : whole;
	log_line(EVENT_WARNING,
		 "%s is a part of %s, which gets what comes in there, so no device "
		 "will be heard; name %s (interface)",
		 interface, name, name);
}

static int take_signals(struct daemon *daemon)
{
	daemon->signal_fd = signals_open();
	if (daemon->signal_fd >= 0)
		return 0;
	log_line(EVENT_ERROR, "signals cannot be taken: %s", strerror(-daemon->signal_fd));
	return STATUS_FAILED;
}

static int lock_memory(struct daemon *daemon)
{
	if (realtime_lock_memory(daemon->why, sizeof(daemon->why)) == 0) {
		atomic_fetch_or(&daemon->loop.shared.flags, POKEYS_STATE_REALTIME);
		return 0;
	}
	if (daemon->config->realtime_required) {
		log_line(EVENT_ERROR, "%s (or go on without: --no-realtime)", daemon->why);
		return STATUS_NO_RIGHT;
	}
	log_line(EVENT_WARNING, "%s; going on without", daemon->why);
	return 0;
}

static int open_memory(struct daemon *daemon)
{
	const struct config *config = daemon->config;
	char why[256] = "";
	int result = shm_host_open(&daemon->host, config->runtime_directory,
				   *config->group ? config->group : NULL,
				   *config->monitor_group ? config->monitor_group : NULL, why,
				   sizeof(why));

	if (result == 0 && *why)
		log_line(EVENT_WARNING, "%s", why);
	for (uint32_t i = 0; result == 0 && i < config->devices; i++)
		result = shm_host_add(daemon->host, config->device[i].name,
				      &daemon->loop.devices[i].shm, why, sizeof(why));
	if (result == 0)
		return 0;
	log_line(EVENT_ERROR, "%s", why);
	return result == -EBUSY ? STATUS_BUSY : STATUS_FAILED;
}

/* Without it the devices are driven all the same, so it is no reason to be without a daemon. */
static void open_desk(struct daemon *daemon)
{
	int result = desk_open(&daemon->desk);

	if (result)
		log_line(EVENT_WARNING,
			 "%s/control: cannot be made: %s; pokeysctl config apply and "
			 "save do not work",
			 daemon->config->runtime_directory, strerror(-result));
}

/*
 * The lock first: what is found after it is nobody's. The desk before the memory can be
 * found: whoever has found that may order.
 */
static int take_folder(struct daemon *daemon)
{
	int status = open_memory(daemon);

	if (status)
		return status;
	open_desk(daemon);
	keeper_open(&daemon->keeper, daemon->config, &daemon->loop, getenv("LOGS_DIRECTORY"),
		    shm_host_monitors(daemon->host));
	return 0;
}

/* Said, for nobody has asked for just that. */
static void say_waiting(const struct daemon *daemon)
{
	const struct waiting *waiting = &daemon->waiting;
	char poll[48] = "";

	if (waiting->busy_poll_us)
		snprintf(poll, sizeof(poll), " (polls the card for up to %u us)",
			 waiting->busy_poll_us);
	if (waiting->refused)
		log_line(EVENT_WARNING, "mode is %s instead of %s: %s", waiting_name(waiting->wait),
			 waiting_name(daemon->config->wait), waiting->why);
	else
		log_line(EVENT_INFO, "mode is %s%s: %s", waiting_name(waiting->wait), poll,
			 waiting->why);
}

/* With the way to wait that is the best for this one. */
static int try_transport(struct daemon *daemon, struct waiting_facts *facts,
			 enum config_transport wanted, const char **why)
{
	const struct config *config = daemon->config;
	struct transport_options options = {
		.interface = *config->interface ? config->interface : NULL,
	};

	facts->transport = wanted;
	waiting_choose(facts, &daemon->waiting);
	options.spin = daemon->waiting.mode == LOOP_SPIN;
	options.busy_poll_us = daemon->waiting.busy_poll_us;
	return transport_open(&daemon->loop.transport, config_transport_name(wanted), &options,
			      why);
}

/*
 * What comes instead of AF_XDP was opened to wait as is good for AF_XDP; the ring may
 * have a better way.
 */
static int instead_of_xdp(struct daemon *daemon, struct waiting_facts *facts)
{
	const char *why;

	transport_close(daemon->loop.transport);
	daemon->loop.transport = NULL;
	return try_transport(daemon, facts, CONFIG_AUTO, &why);
}

static int open_transport(struct daemon *daemon)
{
	const enum config_transport wanted = daemon->config->transport;
	struct waiting_facts facts;
	const char *why = NULL;
	int result;

	waiting_look(daemon->config, &facts);
	result = try_transport(daemon, &facts, wanted, &why);
	if (!result && why && wanted == CONFIG_XDP)
		result = instead_of_xdp(daemon, &facts);
	if (result) {
		log_line(EVENT_ERROR, "transport %s: %s%s%s", config_transport_name(wanted),
			 strerror(-result), why ? ": " : "", why ? why : "");
		return STATUS_FAILED;
	}
	say_waiting(daemon);
	if (why) {
		log_line(EVENT_NOTICE, "transport is %s, for %s", daemon->loop.transport->ops->name,
			 why);
		atomic_fetch_or(&daemon->loop.shared.flags, POKEYS_STATE_FALLBACK);
	}
	return 0;
}

static int open_devices(struct daemon *daemon)
{
	const struct config *config = daemon->config;
	struct loop *loop = &daemon->loop;
	size_t size = (device_size() + 63) / 64 * 64;
	int result;

	loop->options = config->loop;
	loop->options.mode = daemon->waiting.mode;
	loop->count = config->devices;
	daemon->devices = aligned_alloc(64, size * config->devices);
	if (!daemon->devices) {
		log_line(EVENT_ERROR, "no memory for %u devices", config->devices);
		return STATUS_FAILED;
	}
	memset(daemon->devices, 0, size * config->devices);
	for (uint32_t i = 0; i < config->devices; i++)
		loop->devices[i].device = (void *)((char *)daemon->devices + size * i);
	result = loop_prepare(loop);
	if (result) {
		log_line(EVENT_ERROR, "the loop cannot be prepared: %s", strerror(-result));
		return STATUS_FAILED;
	}
	daemon->prepared = true;
	if (loop->options.mode == LOOP_SPIN && loop->options.duty < config->loop.duty)
		log_line(EVENT_WARNING,
			 "duty = %g is more than the kernel leaves to realtime "
			 "threads (kernel.sched_rt_runtime_us); using %g",
			 config->loop.duty, loop->options.duty);
	for (uint32_t i = 0; i < config->devices; i++) {
		struct pokeys_io io;

		loop_io(loop, i, &io);
		device_init(loop->devices[i].device, &config->device[i], &io, &loop->events);
	}
	claims_run(&daemon->claims, daemon->finder.found, clock_now());
	return 0;
}

int daemon_open(struct daemon *daemon)
{
	int status = await_interface(daemon->config);

	if (!status)
		warn_of_part(daemon->config->interface);
	status = status ? status : take_signals(daemon);
	status = status ? status : lock_memory(daemon);
	status = status ? status : take_folder(daemon);
	if (status || signals_ending())
		return status;
	status = open_transport(daemon);
	status = status ? status : open_devices(daemon);
	if (!status)
		keeper_record(&daemon->keeper);
	return status;
}

/* The realtime thread. */
static void *run_loop(void *argument)
{
	struct daemon *daemon = argument;
	const struct realtime_options options = {
		.priority = daemon->config->priority,
		.cpu = daemon->config->cpu,
		.required = daemon->config->realtime_required,
	};
	int result = realtime_enter(&options, daemon->why, sizeof(daemon->why));

	if (result)
		atomic_fetch_and(&daemon->loop.shared.flags, ~(uint32_t)POKEYS_STATE_REALTIME);
	if (result && options.required) {
		atomic_store(&daemon->entered, result);
	} else {
		atomic_store(&daemon->entered, 1);
		daemon->loop_result = loop_run(&daemon->loop);
	}
	atomic_store(&daemon->left, true);
	return NULL;
}

static int make_thread(struct daemon *daemon)
{
	int result = thread_make(&daemon->thread, run_loop, daemon);

	daemon->started = !result;
	if (!result)
		return 0;
	log_line(EVENT_ERROR, "the realtime thread cannot be made: %s", strerror(-result));
	return STATUS_FAILED;
}

/* A core that does not exist is the configuration's fault, not a missing right. */
static int refused(struct daemon *daemon, int entered)
{
	log_line(EVENT_ERROR, "%s%s", daemon->why,
		 entered == -EINVAL ? "" : " (or go on without: --no-realtime)");
	return entered == -EINVAL ? STATUS_CONFIG : STATUS_NO_RIGHT;
}

/* It answers, is allowed what it needs, and has done its first cycles. */
static int await_first_cycles(struct daemon *daemon)
{
	for (int waited = 0; waited < START_MS; waited += 5) {
		int entered = atomic_load(&daemon->entered);

		if (entered < 0)
			return refused(daemon, entered);
		if (atomic_load(&daemon->left))
			return 0; /* daemon_attend() says why */
		if (atomic_load(&daemon->loop.shared.cycles) >= FIRST_CYCLES) {
			if (*daemon->why)
				log_line(EVENT_WARNING, "%s; going on without", daemon->why);
			return 0;
		}
		sleep_ms(5);
	}
	log_line(EVENT_ERROR,
		 "the realtime thread does not run: %d ms and no cycle; is something "
		 "of a higher priority on its core?",
		 START_MS);
	return STATUS_FAILED;
}

static int publish(struct daemon *daemon)
{
	char why[256] = "";

	if (shm_host_publish(daemon->host, why, sizeof(why)) == 0)
		return 0;
	log_line(EVENT_ERROR, "%s", why);
	return STATUS_FAILED;
}

/* As the desk sees a device: through our own reader, like everybody. */
static int read_report(void *context, uint32_t device, struct pokeys_report *out)
{
	struct daemon *daemon = context;

	return daemon->reader[device] ? pokeys_client_read_report(daemon->reader[device], out) :
					-ENOTCONN;
}

int daemon_start(struct daemon *daemon)
{
	int status, result;

	daemon->why[0] = '\0';
	status = make_thread(daemon);
	status = status ? status : await_first_cycles(daemon);
	if (status)
		return status;
	status = publish(daemon);
	if (status)
		return status;
	daemon->latency_fd = realtime_hold_cpu_awake();
	if (daemon->latency_fd < 0)
		log_line(EVENT_INFO, "/dev/cpu_dma_latency: %s; sleeping cores may wake up late",
			 strerror(-daemon->latency_fd));
	result = finder_start(&daemon->finder, &daemon->teller, &daemon->loop.shared);
	if (!result)
		return 0;
	log_line(EVENT_ERROR, "the search thread cannot be made: %s", strerror(-result));
	return STATUS_FAILED;
}

/*
 * The realtime thread has done its last; false = it does not come to an end. One that
 * still makes cycles does, however slowly on a busy machine: the loop gives up by itself.
 */
static bool await_end(const struct daemon *daemon)
{
	uint64_t cycles = 0, end_ns = 0;

	do {
		uint64_t now_ns = clock_now();

		if (!end_ns || cycles != atomic_load(&daemon->loop.shared.cycles))
			end_ns = now_ns + STOP_MS * UINT64_C(1000000);
		cycles = atomic_load(&daemon->loop.shared.cycles);
		if (now_ns >= end_ns)
			break;
		sleep_ms(1);
	} while (!atomic_load(&daemon->left));
	return atomic_load(&daemon->left);
}

int daemon_stop(struct daemon *daemon)
{
	int status = 0;

	atomic_store(&daemon->finder.stop, true);
	if (daemon->started && !daemon->joined) {
		atomic_store(&daemon->loop.shared.stop, true);
		daemon->joined = await_end(daemon);
		if (daemon->joined) {
			pthread_join(daemon->thread, NULL);
		} else {
			log_line(EVENT_ERROR, "the realtime thread does not end; whether the "
					      "devices are in their safe state is not known");
			status = STATUS_FAILED;
		}
	}
	watchdog_stop(&daemon->watchdog);
	finder_stop(&daemon->finder);
	drain_run(&daemon->drain, clock_now());
	keeper_stop(&daemon->keeper, KEEPER_STOP_MS);
	return status;
}

void daemon_close(struct daemon *daemon)
{
	desk_close(&daemon->desk);
	for (uint32_t i = 0; i < TRANSPORT_CHANNELS; i++)
		pokeys_client_close(daemon->reader[i]);
	/* a thread that did not end still uses the rest; the process ends anyway */
	if (daemon->started && !daemon->joined)
		return;
	keeper_close(&daemon->keeper);
	claims_close(&daemon->claims);
	if (daemon->prepared)
		loop_release(&daemon->loop);
	if (daemon->loop.transport)
		transport_close(daemon->loop.transport);
	shm_host_close(daemon->host);
	free(daemon->devices);
	if (daemon->latency_fd >= 0)
		close(daemon->latency_fd);
	if (daemon->signal_fd >= 0)
		close(daemon->signal_fd);
}

/* Before a packet was sent; what was taken is given back as at any other end. */
static bool ends_early(void)
{
	const char *signal = signals_ending();

	if (!signal)
		return false;
	log_line(EVENT_INFO, "ending (%s)", signal);
	notify_stopping();
	return true;
}

/* To those who read the shared memory, where a device has a place before anything is said of it. */
static void show_event(void *context, uint32_t device, const struct pokeys_event *event)
{
	struct daemon *daemon = context;

	shm_device_write_event(daemon->loop.devices[device].shm, event);
}

int daemon_run(struct daemon *daemon, const struct config *config, const char *config_path)
{
	int status, stopped;

	memset(daemon, 0, sizeof(*daemon));
	daemon->config = config;
	daemon->signal_fd = -1;
	daemon->latency_fd = -1;
	desk_init(&daemon->desk, config, config_path, &daemon->loop, read_report, daemon);
	daemon->teller = (struct teller){ config, show_event, daemon };
	drain_init(&daemon->drain, &daemon->teller, &daemon->loop.events, &daemon->desk,
		   &daemon->keeper);
	claims_init(&daemon->claims, &daemon->teller, &daemon->loop.shared);
	status = daemon_open(daemon);
	if (!status && !ends_early()) {
		status = daemon_start(daemon);
		status = status ? status : daemon_attend(daemon);
	}
	stopped = daemon_stop(daemon);
	daemon_close(daemon);
	return status ? status : stopped;
}
