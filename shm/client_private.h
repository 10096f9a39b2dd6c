/* SPDX-License-Identifier: MIT */
/* What the files of the client share. */
#ifndef SHM_CLIENT_PRIVATE_H
#define SHM_CLIENT_PRIVATE_H

#include <pthread.h>
#include <stdbool.h>
#include <pokeys/shm.h>
#include "shm/handover.h"
#include "shm/iox.h"
#include "shm/mirror.h"
#include "shm/runtime.h"

enum { CLIENT_WHY_MAX = 256 };

struct client_status {
	pthread_mutex_t lock;
	enum pokeys_client_state state;
	char why[CLIENT_WHY_MAX];
};

struct client_follower {
	pthread_t thread;
	pthread_mutex_t lock;
	pthread_cond_t wake;
	unsigned int interval_ms;
	bool running;
	bool stop;
};

struct client_holder {
	pthread_t thread;
	pthread_mutex_t lock; /* of what follows */
	pthread_cond_t wake;
	uint64_t renewed_ns;
	struct pokeys_command command;
	bool given, lapsed, stop;
	/* the thread's */
	uint64_t look_ns, heartbeat;
	bool resumed;
	char root[SHM_ROOT_NAME_MAX]; /* of the daemon that it commanded last */
	/* from the start on */
	uint64_t period_ns, lease_ns;
	uint32_t session;
	bool running;
};

struct pokeys_client {
	char directory[SHM_DIRECTORY_MAX];
	char device[POKEYS_SHM_NAME_MAX];
	char program[POKEYS_SHM_NAME_MAX];
	unsigned int flags;

	/* for the realtime thread; NULL while not attached. One that does not command: */
	struct handover mirror; /* struct mirror_view */
	/* a commander: */
	struct handover state;                /* struct iox_state_reader */
	struct handover diag;                 /* struct iox_diag_reader */
	struct handover command;              /* struct iox_command_writer */
	const struct pokeys_command *written; /* the last image; NULL = none yet */
	struct handover report;               /* struct iox_report_reader */
	struct handover wish;                 /* struct iox_wish_writer */

	/* of the thread that polls, under `cold` */
	pthread_mutex_t cold;
	struct mirror_view *view; /* what `mirror` has */
	struct iox_node *node;
	uint64_t news;                     /* seen last */
	char root_name[SHM_ROOT_NAME_MAX]; /* attached to; "" = to none */

	struct client_status status;
	struct client_follower follower;
	struct client_holder holder;
};

static inline bool client_commands(const struct pokeys_client *client)
{
	return client->flags & POKEYS_CLIENT_COMMANDER;
}

/* client.c: as pokeys_client_poll(), for threads of the library. */
enum pokeys_client_state client_look(struct pokeys_client *client);

/* monitor.c, who does not command: attach, or let go. 0, or -errno with the reason in `why`. */
int client_watch(struct pokeys_client *client, char *why, size_t size);
void client_unwatch(struct pokeys_client *client);

/* wait.c: a number that changes when there is news. Of the thread that polls, attached. */
uint64_t client_news(const struct pokeys_client *client);

/* attach.c, a commander: attach to the root of this name. 0, or -errno with the reason in `why`. */
int client_attach(struct pokeys_client *client, const char *root_name, char *why, size_t size);
/* Give everything back. Waits for a realtime visit that is under way. */
void client_detach(struct pokeys_client *client);

/* read.c: as pokeys_client_write(), for the holder as well. */
int client_write(struct pokeys_client *client, const struct pokeys_command *command);
/* read.c: tell the daemon that this commander ends. Does nothing if it has written no command. */
void client_leave(struct pokeys_client *client);

/*
 * follow.c: a thread that inherits nothing from its caller, neither scheduling class nor
 * signals nor the core. 0 or -errno.
 */
int client_thread(pthread_t *out, void *(*run)(void *), void *argument);

void client_hold_end(struct pokeys_client *client);

int client_follow_start(struct pokeys_client *client, unsigned int interval_ms);
void client_follow_end(struct pokeys_client *client);

#endif
