// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Memory is locked, so a stack of the usual size would be 8 MiB of it. Signals are the
 * signalfd's: one that a thread took would interrupt it and be lost to the control
 * thread.
 */
#include <signal.h>
#include "daemon/control/thread.h"

enum { STACK_SIZE = 256 * 1024 };

int thread_make(pthread_t *thread, void *(*run)(void *argument), void *argument)
{
	pthread_attr_t attributes;
	sigset_t all, before;
	int result;

	pthread_attr_init(&attributes);
	pthread_attr_setstacksize(&attributes, STACK_SIZE);
	sigfillset(&all);
	pthread_sigmask(SIG_SETMASK, &all, &before);
	result = pthread_create(thread, &attributes, run, argument);
	pthread_sigmask(SIG_SETMASK, &before, NULL);
	pthread_attr_destroy(&attributes);
	return -result;
}
