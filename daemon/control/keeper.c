// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * When a record is written, and by whom.
 *
 * What led to a fault is in the ring already when the fault is seen; what it led to
 * comes after. So a record is written half a second later. A fault that comes again
 * and again, a cable that rattles, must not fill the disk: there is one record of each
 * reason in a while, and a number of them. Of each reason, because a machine that was
 * busy for a moment must not cost the record of the cable that came out a little later.
 *
 * The control thread only gives the order. A disk may be slow for seconds, and the
 * control thread feeds the watchdog. At the end as well: a daemon that waits for a
 * disk is killed by the service manager, and one that is started anew waits for it.
 *
 * A daemon that ends removes its ring. One that is still there was left by a daemon
 * that died, and is the best witness of why: it is put aside before our own ring
 * takes its name.
 */
#include <errno.h>
#include <linux/magic.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <time.h>
#include <unistd.h>
#include "daemon/control/clock.h"
#include "daemon/control/keeper.h"
#include "daemon/control/log.h"
#include "daemon/control/thread.h"
#include "daemon/recorder/read.h"
#include "wire/pulse.h"

#define AFTER_NS UINT64_C(500000000)
#define NOBODY ((gid_t)-1)
enum {
	NAP_MS = 20,
	BURST = 10,
	SLOTS_A_CYCLE = 8,
	STOP_NAP_MS = 5,
	REMOVE_MS = 100, /* for what was begun and is given up */
};

enum record_reason keeper_reason(const struct event *event, bool machine_on)
{
	switch (event->code) {
	case EVENT_LINK:
		return event->a == POKEYS_LINK_LOST && event->b == POKEYS_LINK_RUNNING ?
			       RECORD_LOST :
			       RECORD_NOTHING;
	case EVENT_COMMANDER:
		return !event->a && !event->c && machine_on ? RECORD_COMMANDER : RECORD_NOTHING;
	case EVENT_ENGINE:
		if (event->a == WIRE_ENGINE_STOP_EMERGENCY)
			return RECORD_EMERGENCY;
		return event->a == WIRE_ENGINE_STOP_LIMIT ? RECORD_LIMIT : RECORD_NOTHING;
	case EVENT_HEATER:
		return event->b != POKEYS_HEATER_FINE ? RECORD_HEATER : RECORD_NOTHING;
	case EVENT_SERVO:
		/* the heater, or whoever has pressed a button, is the reason */
		return event->b != POKEYS_SERVO_FINE && event->b != POKEYS_SERVO_EMERGENCY &&
				       event->b != POKEYS_SERVO_HEATER ?
			       RECORD_SERVO :
			       RECORD_NOTHING;
	case EVENT_CYCLE_SKIPPED:
		return event->a >= BURST ? RECORD_LATE : RECORD_NOTHING;
	case EVENT_TRANSPORT:
		return event->level <= EVENT_ERROR ? RECORD_TRANSPORT : RECORD_NOTHING;
	default:
		return RECORD_NOTHING;
	}
}

void keeper_event(struct keeper *keeper, const struct event *event, uint64_t now_ns)
{
	const uint64_t bit = event->device < TRANSPORT_CHANNELS ? UINT64_C(1) << event->device : 0;
	const enum record_reason reason = keeper_reason(event, keeper->machine_on & bit);

	if (event->code == EVENT_MACHINE)
		keeper->machine_on = event->a ? keeper->machine_on | bit :
						keeper->machine_on & ~bit;
	if (!keeper->running || !reason || now_ns < keeper->not_before_ns[reason])
		return;
	keeper->not_before_ns[reason] = now_ns + keeper->config->record_interval_ns;
	if (keeper->due && keeper->due <= reason)
		return; /* the record that is due will have this one in it */
	keeper->due = reason;
	keeper->due_ns = now_ns + AFTER_NS;
}

static void tell(struct keeper *keeper)
{
	if (!atomic_load_explicit(&keeper->done, memory_order_acquire))
		return;
	if (keeper->result)
		log_line(EVENT_WARNING, "no record could be written in %s: %s", keeper->folder,
			 strerror(-keeper->result));
	else
		log_line(EVENT_NOTICE, "the last %llu packets are in %s",
			 (unsigned long long)keeper->packets, keeper->path);
	atomic_store_explicit(&keeper->done, 0, memory_order_relaxed);
}

static bool idle(const struct keeper *keeper)
{
	return !atomic_load_explicit(&keeper->order, memory_order_acquire) &&
	       !atomic_load_explicit(&keeper->done, memory_order_acquire);
}

static void give(struct keeper *keeper, enum record_reason reason)
{
	atomic_store_explicit(&keeper->order, reason, memory_order_release);
}

void keeper_run(struct keeper *keeper, uint64_t now_ns)
{
	if (!keeper->open)
		return;
	tell(keeper);
	if (!keeper->due || now_ns < keeper->due_ns || !idle(keeper))
		return;
	give(keeper, keeper->due);
	keeper->due = RECORD_NOTHING;
}

/* The thread: one order at a time. */
static void execute(struct keeper *keeper)
{
	const enum record_reason reason = atomic_load_explicit(&keeper->order,
							       memory_order_acquire);
	const struct keeper_order order = {
		.ring = reason == RECORD_DIED ? keeper->died : keeper->ring,
		.folder = keeper->folder,
		.reason = reason,
		.files = keeper->config->record_files,
		.readers = keeper->readers,
	};

	if (!reason)
		return;
	keeper->result = keeper_write(&order, keeper->path, &keeper->begun, &keeper->packets);
	if (reason == RECORD_DIED)
		unlink(keeper->died);
	atomic_store_explicit(&keeper->done, 1, memory_order_release);
	atomic_store_explicit(&keeper->order, RECORD_NOTHING, memory_order_release);
}

static void *run(void *argument)
{
	const struct timespec nap = { .tv_nsec = NAP_MS * 1000000 };
	struct keeper *keeper = argument;

	keeper_tidy(keeper->folder);
	while (!atomic_load_explicit(&keeper->stop, memory_order_acquire)) {
		execute(keeper);
		nanosleep(&nap, NULL);
	}
	return NULL;
}

/*
 * What a daemon that died has left, to be written as soon as the thread runs; or what the
 * one after it has put aside, and the disk did not take.
 */
static void put_aside(struct keeper *keeper)
{
	if (rename(keeper->ring, keeper->died) && access(keeper->died, F_OK))
		return;
	if (*keeper->folder)
		give(keeper, RECORD_DIED);
	else
		unlink(keeper->died);
}

static void start(struct keeper *keeper)
{
	int result = thread_make(&keeper->thread, run, keeper);

	keeper->running = !result;
	if (result)
		log_line(EVENT_WARNING,
			 "no records will be written: the thread for it cannot be "
			 "made: %s",
			 strerror(-result));
}

static uint32_t slots_for(const struct config *config)
{
	const double cycles = (double)config->recorder_seconds * 1e9 /
			      (double)config->loop.period_ns;
	const double slots = cycles * (SLOTS_A_CYCLE * (double)config->devices + 1);

	return slots < RECORDER_SLOTS_MAX ? (uint32_t)slots : RECORDER_SLOTS_MAX;
}

static int make_ring(struct keeper *keeper)
{
	const struct config *config = keeper->config;
	struct recorder *recorder = &keeper->loop->recorder;
	int result = recorder_create(recorder, keeper->ring, slots_for(config));

	if (result)
		return result;
	recorder->head->period_ns = config->loop.period_ns;
	recorder->head->spins = keeper->loop->options.mode == LOOP_SPIN;
	recorder->head->devices = config->devices;
	for (uint32_t i = 0; i < config->devices; i++)
		snprintf(recorder->head->name[i], sizeof(recorder->head->name[i]), "%s",
			 config->device[i].name);
	keeper->loop->events.tap_context = recorder;
	keeper->loop->events.tap = recorder_tap;
	keeper->open = true;
	return 0;
}

/* Writing to a mapped file of a disk faults, and waits for the disk, again and again. */
static bool in_memory(const char *folder)
{
	struct statfs found;

	return !statfs(folder, &found) &&
	       (found.f_type == TMPFS_MAGIC || found.f_type == RAMFS_MAGIC);
}

static void open_ring(struct keeper *keeper)
{
	const char *folder = keeper->config->runtime_directory;
	int result;

	if (!in_memory(folder)) {
		log_line(EVENT_WARNING,
			 "%s is on a disk, for which the realtime thread would have "
			 "to wait; nothing is recorded (runtime-directory in /run or /dev/shm, "
			 "or recorder-seconds = 0)",
			 folder);
		return;
	}
	result = make_ring(keeper);
	if (result)
		log_line(EVENT_WARNING, "%s: cannot be made: %s; nothing is recorded", keeper->ring,
			 strerror(-result));
	else if (keeper->readers != NOBODY &&
		 (lchown(keeper->ring, (uid_t)-1, keeper->readers) || chmod(keeper->ring, 0640)))
		log_line(EVENT_WARNING,
			 "%s: cannot be given to monitor-group, whose members "
			 "cannot read it now: %s",
			 keeper->ring, strerror(errno));
}

void keeper_open(struct keeper *keeper, const struct config *config, struct loop *loop,
		 const char *logs, gid_t readers)
{
	*keeper = (struct keeper){
		.config = config,
		.loop = loop,
		.folder = "",
		.readers = readers,
	};
	if (*config->record_folder)
		keeper->folder = config->record_folder;
	else if (logs)
		keeper->folder = logs;
	if (!config->record_files)
		keeper->folder = "";
	snprintf(keeper->ring, sizeof(keeper->ring), "%s/" RECORDER_FILE,
		 config->runtime_directory);
	snprintf(keeper->died, sizeof(keeper->died), "%s/" RECORDER_FILE ".died",
		 config->runtime_directory);
	put_aside(keeper);
	if (keeper->order)
		start(keeper);
}

void keeper_record(struct keeper *keeper)
{
	if (keeper->config->recorder_seconds)
		open_ring(keeper);
	if (*keeper->folder && keeper->open && !keeper->running)
		start(keeper);
}

/* Until nothing is to be written any more, or the disk has had its time. */
static void finish(struct keeper *keeper, unsigned int patience_ms)
{
	const struct timespec nap = { .tv_nsec = STOP_NAP_MS * 1000000 };
	const uint64_t end_ns = clock_now() + patience_ms * UINT64_C(1000000);

	do {
		tell(keeper);
		if (idle(keeper)) {
			if (!keeper->due)
				return;
			give(keeper, keeper->due);
			keeper->due = RECORD_NOTHING;
		}
		nanosleep(&nap, NULL);
	} while (clock_now() < end_ns);
	tell(keeper);
}

static void give_up(const struct keeper *keeper, enum record_reason reason,
		    unsigned int patience_ms)
{
	if (reason)
		log_line(EVENT_WARNING,
			 "the record \"%s\" is not written: %s did not take it "
			 "within %u ms, and the daemon ends",
			 keeper_word(reason), keeper->folder, patience_ms);
}

/* A thread of its own: the same disk may have hung up with the folder in its hands. */
static void *remove_begun(void *argument)
{
	struct keeper *keeper = argument;
	char beside[KEEPER_PATH];

	keeper_beside(keeper->path, beside);
	unlink(beside);
	atomic_store_explicit(&keeper->removed, true, memory_order_release);
	return NULL;
}

/*
 * The writer is left with its write and dies with the process. What it had begun goes
 * now, if the disk lets it; else the next daemon removes it.
 */
static void abandon(struct keeper *keeper)
{
	const struct timespec nap = { .tv_nsec = STOP_NAP_MS * 1000000 };
	const uint64_t end_ns = clock_now() + REMOVE_MS * UINT64_C(1000000);
	pthread_t thread;

	if (!atomic_load_explicit(&keeper->begun, memory_order_acquire) ||
	    thread_make(&thread, remove_begun, keeper))
		return;
	pthread_detach(thread);
	while (!atomic_load_explicit(&keeper->removed, memory_order_acquire) &&
	       clock_now() < end_ns)
		nanosleep(&nap, NULL);
}

void keeper_stop(struct keeper *keeper, unsigned int patience_ms)
{
	enum record_reason left;

	if (!keeper->running)
		return;
	keeper->running = false;
	finish(keeper, patience_ms);
	left = atomic_load_explicit(&keeper->order, memory_order_acquire);
	atomic_store_explicit(&keeper->stop, true, memory_order_release);
	if (!left) {
		pthread_join(keeper->thread, NULL);
		tell(keeper);
	}
	give_up(keeper, left, patience_ms);
	give_up(keeper, keeper->due, patience_ms);
	if (left)
		abandon(keeper);
	keeper->due = RECORD_NOTHING;
}

void keeper_close(struct keeper *keeper)
{
	if (!keeper->open)
		return;
	keeper->loop->events.tap = NULL;
	atomic_store_explicit(&keeper->loop->recorder.head->ended, 1, memory_order_release);
	unlink(keeper->ring);
	recorder_close(&keeper->loop->recorder);
	keeper->open = false;
}
