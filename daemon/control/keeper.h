/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Who keeps the flight recorder: makes its ring, and writes it into a file when
 * something went wrong. A file may take its time, so a thread of its own writes it.
 */
#ifndef CONTROL_KEEPER_H
#define CONTROL_KEEPER_H

#include <pthread.h>
#include "daemon/control/config.h"
#include "daemon/device/event.h"
#include "daemon/rt/loop.h"

/* Why a record is written, the gravest first; also the end of its file's name. */
enum record_reason {
	RECORD_NOTHING,
	RECORD_LOST,      /* a device that was running does not answer */
	RECORD_COMMANDER, /* silent while the machine was on */
	RECORD_EMERGENCY, /* the pulse engine was stopped by its emergency input */
	RECORD_LIMIT,     /* ... by a limit switch */
	RECORD_HEATER,    /* a heater was switched off by a fault */
	RECORD_SERVO,     /* a servo motor was stopped by one */
	RECORD_TRANSPORT, /* the transport has failed for good */
	RECORD_LATE,      /* a burst of missed cycles */
	RECORD_DIED,      /* what the daemon before this one left */
	RECORD_REASONS
};

enum { KEEPER_PATH = 400 };

struct keeper {
	const struct config *config;
	struct loop *loop;
	const char *folder; /* of the records; empty = none are written */
	gid_t readers;      /* group that may read ring and records; -1 = none */
	char ring[KEEPER_PATH], died[KEEPER_PATH]; /* files of the runtime folder */
	bool open, running;
	pthread_t thread;
	/* the control thread's */
	uint64_t machine_on;    /* bit = device whose machine is on */
	enum record_reason due; /* to be written at due_ns */
	uint64_t due_ns, not_before_ns[RECORD_REASONS];
	/* between the two */
	_Atomic bool stop;
	_Atomic uint32_t order; /* enum record_reason; the thread's until it is 0 again */
	_Atomic uint32_t done;  /* 1: `path`, `result` and `packets` have to be reported */
	_Atomic bool begun;     /* beside `path` there may be a file that is not whole */
	_Atomic bool removed;   /* ... it was given up, and is gone */
	char path[KEEPER_PATH];
	int result; /* 0 or -errno */
	uint64_t packets;
};

/* What an event is a reason for. `machine_on`: the machine of its device is. Pure. */
enum record_reason keeper_reason(const struct event *event, bool machine_on);

/*
 * Take from the runtime folder, which has to be locked, what a daemon that died has left
 * there, and have it written. What goes wrong is logged, and the daemon goes on without.
 * `logs` is the folder that the service manager gives ($LOGS_DIRECTORY), NULL = none.
 * Members of `readers` may read the ring and the records; with (gid_t)-1, group and mode
 * are those that new files have.
 */
void keeper_open(struct keeper *keeper, const struct config *config, struct loop *loop,
		 const char *logs, gid_t readers);

/*
 * Make the ring, and the thread that writes it. Once, after keeper_open(), when it is known
 * how the loop will wait, and before it runs; loop->recorder and the tap of loop->events
 * are set. What goes wrong is logged, and the daemon goes on without.
 */
void keeper_record(struct keeper *keeper);

/* An event of the loop; a record is due half a second later. */
void keeper_event(struct keeper *keeper, const struct event *event, uint64_t now_ns);

/* Give orders, tell what became of them; a few times a second. */
void keeper_run(struct keeper *keeper, uint64_t now_ns);

/* How long an ending daemon waits for the disk; the service manager allows 3 s in total. */
enum { KEEPER_STOP_MS = 1500 };

/*
 * End the thread. Records that are due are written first, for at most patience_ms. A record
 * that is not written by then is logged, its incomplete file is removed if that takes no longer
 * than 0.1 s, and the thread is left in its write, because the process is about to end.
 * Control thread. Idempotent.
 */
void keeper_stop(struct keeper *keeper, unsigned int patience_ms);

/* After the loop has ended: give the ring back, its file as well. */
void keeper_close(struct keeper *keeper);

/* The word for it, as in the file's name. */
const char *keeper_word(enum record_reason reason);

/* A record that is to be written. */
struct keeper_order {
	const char *ring, *folder;
	enum record_reason reason;
	uint32_t files; /* are kept in the folder, the newest */
	gid_t readers;  /* as in struct keeper */
};

/*
 * Write a ring's file into its folder, and remove the oldest records there if there are more
 * than `files`.
 * 0 or -errno; path of the new file into `path`. *begun is true while `path` stands and
 * the file beside it is being written. One thread at a time; waits for the disk.
 */
int keeper_write(const struct keeper_order *order, char path[KEEPER_PATH], _Atomic bool *begun,
		 uint64_t *packets);

/* Where the record `path` is while it is being written. */
void keeper_beside(const char *path, char beside[KEEPER_PATH]);

/*
 * Remove the records that this user's daemons had begun in the folder when they were
 * killed, and nothing else. Waits for the disk.
 */
void keeper_tidy(const char *folder);

#endif
