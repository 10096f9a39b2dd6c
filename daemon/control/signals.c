// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * A daemon that is ended in the middle of its start has work to do: what one that was
 * killed has left in the runtime folder looks like a daemon that hangs, until somebody
 * clears it, and not everybody who starts us does so afterwards, as the unit does. So
 * signals are held from the first line of main(), and none finds us
 * without somebody who acts upon it; those who wait for something, and whoever is about
 * to begin with the devices, ask whether one has come.
 *
 * They are blocked before the first thread exists, so that every one of them goes to the
 * signalfd and none interrupts the realtime thread.
 */
#include <errno.h>
#include <signal.h>
#include <stddef.h>
#include <sys/signalfd.h>
#include "daemon/control/signals.h"

static void fill(sigset_t *set)
{
	sigemptyset(set);
	sigaddset(set, SIGTERM);
	sigaddset(set, SIGINT);
	sigaddset(set, SIGHUP);
}

void signals_hold(void)
{
	sigset_t set;

	fill(&set);
	sigprocmask(SIG_BLOCK, &set, NULL);
}

void signals_release(void)
{
	sigset_t set;

	fill(&set);
	sigprocmask(SIG_UNBLOCK, &set, NULL);
}

const char *signals_ending(void)
{
	sigset_t waiting;

	sigpending(&waiting);
	if (sigismember(&waiting, SIGTERM) == 1)
		return "SIGTERM";
	return sigismember(&waiting, SIGINT) == 1 ? "SIGINT" : NULL;
}

int signals_open(void)
{
	sigset_t set;
	int fd;

	fill(&set);
	signal(SIGPIPE, SIG_IGN);
	fd = signalfd(-1, &set, SFD_NONBLOCK | SFD_CLOEXEC);
	return fd < 0 ? -errno : fd;
}
