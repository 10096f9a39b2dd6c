/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The daemon put together: from a configuration to a loop that runs, and back.
 */
#ifndef CONTROL_DAEMON_H
#define CONTROL_DAEMON_H

#include <pthread.h>
#include "daemon/control/claim.h"
#include "daemon/control/config.h"
#include "daemon/control/desk.h"
#include "daemon/control/drain.h"
#include "daemon/control/finder.h"
#include "daemon/control/keeper.h"
#include "daemon/control/metrics.h"
#include "daemon/control/report.h"
#include "daemon/control/tell.h"
#include "daemon/control/waiting.h"
#include "daemon/control/watchdog.h"

struct daemon {
	const struct config *config;
	struct waiting waiting;
	struct loop loop;
	struct shm_host *host;
	struct finder finder;
	struct claims claims;
	struct teller teller;
	struct drain drain;
	struct keeper keeper;
	struct desk desk;
	struct metrics metrics;
	struct watchdog watchdog;
	struct report report;
	pokeys_client *reader[TRANSPORT_CHANNELS]; /* our own, of what we publish */
	void *devices;                             /* their memory */
	int signal_fd, latency_fd;
	bool prepared, started, joined;
	pthread_t thread; /* the realtime one */
	/* its answer to being started, and its end */
	_Atomic int entered; /* 0 = not yet, 1 = it runs, < 0 = refused */
	_Atomic bool left;   /* it has done its last */
	int loop_result;
	char why[256];
	uint64_t next_notify_ns, next_maintain_ns, next_status_ns;
	bool told_removed; /* the shared memory's files */
	bool told_reading; /* that it cannot be read back */
};

/* All of it, `config` being what config_path holds; an exit status of options.h. */
int daemon_run(struct daemon *daemon, const struct config *config, const char *config_path);

/* Parts of it, in this order; each logs what is wrong. 0 or an exit status. */
int daemon_open(struct daemon *daemon);
int daemon_start(struct daemon *daemon);

/* Until a signal or the loop's end. 0 or an exit status. */
int daemon_attend(struct daemon *daemon);

/* Devices to the safe state, everything given back. Idempotent. An exit status if it fails. */
int daemon_stop(struct daemon *daemon);
void daemon_close(struct daemon *daemon);

#endif
