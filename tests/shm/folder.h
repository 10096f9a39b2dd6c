/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A runtime folder of a test's own, and a daemon in it.
 *
 * The folder stands on a tmpfs if there is one, its path is short (sockets
 * live below it), and folder_end() fails the test if anything is left.
 */
#ifndef TESTS_SHM_FOLDER_H
#define TESTS_SHM_FOLDER_H

#include <stdint.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <sys/types.h>
#include "shm/host.h"

struct folder {
	char base[24]; /* private folder around it */
	char path[32]; /* the runtime folder; not made yet */
	char why[256]; /* what was said last */
};

/* cmocka set-up and tear-down; *state is a struct folder. */
int folder_begin(void **state);
int folder_end(void **state);

/* A daemon with the devices named (NULL ends the list), published. */
struct shm_host *folder_host(struct folder *folder, struct shm_device **devices,
			     const char *const *names);
/* The same with one device. */
struct shm_host *folder_host_mill(struct folder *folder, struct shm_device **mill);

/* A client of device "mill", not polled yet. */
pokeys_client *folder_client(struct folder *folder, unsigned int flags);

/* Its status line, kept in folder->why. */
const char *folder_status(struct folder *folder, const pokeys_client *client);

/*
 * Another process (peer.c) in a role; `said` (if not NULL, 256 bytes) gets its
 * first line. The environment names the program: SHM_PEER.
 */
pid_t folder_peer(const struct folder *folder, const char *role, char *said);
/* The same on another folder. */
pid_t folder_peer_at(const char *directory, const char *role, char *said);
/* End it with this signal and wait for it; its status as waitpid has it. */
int folder_end_peer(pid_t pid, int signal_number);

/* Seed of random tests: POKEYS_SEED, or the time; printed. */
unsigned int folder_seed(void);
/* A count from the environment, or `usual`. */
unsigned int folder_count(const char *variable, unsigned int usual);

/* An image with a pattern that shows every torn read: value = cycle in each word. */
void folder_pattern(struct pokeys_state *state, uint64_t cycle);
int folder_pattern_whole(const struct pokeys_state *state);

uint64_t folder_now_ns(void);
void folder_sleep_ms(unsigned int ms);

#endif
