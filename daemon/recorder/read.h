/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The recorder's file: made by the daemon, read by anybody who may. Cold.
 */
#ifndef RECORDER_READ_H
#define RECORDER_READ_H

#include "daemon/recorder/ring.h"

#define RECORDER_FILE "recorder"	/* in the runtime folder */

/*
 * Make the file (one that is there is replaced) and map it, every page present:
 * room for `slots`, rounded up to a power of two. 0 or -errno.
 */
int recorder_create(struct recorder *recorder, const char *path, uint32_t slots);

/* Unmap it; the file stays. */
void recorder_close(struct recorder *recorder);

/* A file that is read, by its writer or after him. */
struct recorder_file {
	int fd;
	struct recorder_head head; /* as it was when it was opened */
};

/* 0; -errno; -EPROTO with one line in `why`: it is no record of this version. */
int recorder_open(struct recorder_file *file, const char *path, char *why, size_t size);
void recorder_release(struct recorder_file *file);

/* Does the daemon still run whose ring it is? One that was killed has not said that it ended. */
bool recorder_lives(const struct recorder_file *file);

/* Slots written since the start, as of now. */
uint64_t recorder_written(const struct recorder_file *file);

/*
 * Copy slots from number *next on, at most `count`. Returns how many are whole and moves
 * *next behind them; numbers that have been overwritten already are passed over.
 */
size_t recorder_read(const struct recorder_file *file, uint64_t *next, struct recorder_slot *out,
		     size_t count);

#endif
