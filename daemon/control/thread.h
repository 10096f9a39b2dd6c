/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A thread of the daemon, made as each of them has to be. */
#ifndef CONTROL_THREAD_H
#define CONTROL_THREAD_H

#include <pthread.h>

/*
 * Start `run(argument)` in a thread with a small stack that takes no signal; the
 * caller's own mask stays. 0 or -errno; *thread is written on success only. Any
 * thread, but not the realtime one: it allocates.
 */
int thread_make(pthread_t *thread, void *(*run)(void *argument), void *argument);

#endif
