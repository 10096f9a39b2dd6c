/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The whole realtime side for real: simulator over UDP, transport, loop,
 * device and shared memory, in a runtime folder and on an address of its own.
 */
#ifndef TESTS_RT_RIG_H
#define TESTS_RT_RIG_H

#include <pthread.h>
#include <stdbool.h>
#include <sys/types.h>
#include <pokeys/shm.h>
#include "daemon/rt/loop.h"

struct rig_options {
	const char *simulator; /* path of pokeys-sim */
	const char *transport; /* "io_uring", "socket" */
	uint64_t period_ns;
	enum loop_mode mode;
	bool realtime;              /* lock memory, SCHED_FIFO; off if refused */
	uint64_t deadline_floor_ns; /* of the mailbox, 0 = its default */
	uint64_t lost_after_ns;     /* 0 = the default */
};

/* Whatever takes longer on the busiest machine hangs. */
enum { RIG_PATIENCE_MS = 60000 };

struct rig {
	struct rig_options options;
	char folder[64], control[96], runtime[96];
	pid_t simulator;
	uint32_t address;
	uint16_t port;
	struct shm_host *host;
	struct loop loop;
	struct device *device;
	pthread_t thread;
	bool running;
	bool is_realtime; /* priority and locked memory were granted */
	int result;       /* of loop_run */
	pokeys_client *client;
};

/* 0, or -errno after one line on stderr; rig_stop cleans up in either case. */
int rig_start(struct rig *rig, const struct rig_options *options);
/* Start the loop's thread. */
int rig_run(struct rig *rig);
/* Ask the loop to end and join it. */
void rig_halt(struct rig *rig);
void rig_stop(struct rig *rig);

/* A command of the simulator's control socket; its exit status. */
int rig_simulator(struct rig *rig, const char *command, ...);

/* The newest images, as a monitor reads them. */
void rig_state(struct rig *rig, struct pokeys_state *out);
void rig_diag(struct rig *rig, struct pokeys_diag *out);
/* True when the link is so within RIG_PATIENCE_MS. */
bool rig_await_link(struct rig *rig, enum pokeys_link link);

void rig_sleep_ms(unsigned int ms);

#endif
