/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Where people's orders come in: a socket in the runtime folder, for
 * pokeysctl config. One packet asks, one answers:
 *
 *	config apply DEVICE	read the configuration again, give the device what it wants
 *	config save DEVICE	keep the device's settings in its flash memory
 *
 *	ok TEXT | refused TEXT	(TEXT may have several lines)
 *
 * The control thread's, cold. Nothing here waits; desk_run() is called a few
 * ten times a second.
 */
#ifndef CONTROL_DESK_H
#define CONTROL_DESK_H

#include "daemon/control/config.h"
#include "daemon/device/event.h"

enum {
	DESK_CLIENTS = 8,
	DESK_REQUEST_MAX = 128, /* bytes */
	DESK_ANSWER_MAX = 4000,
};

enum desk_phase {
	DESK_FREE,
	DESK_ASKING,   /* connected, has not said what it wants */
	DESK_ORDERED,  /* the loop has not executed it yet */
	DESK_APPLYING, /* it did; the report is watched */
	DESK_SAVING,   /* it did; an event will say how it went */
};

struct desk_client {
	int fd;
	enum desk_phase phase;
	uint8_t device;
	uint8_t what;      /* enum device_order */
	bool restart;      /* the file has news that want a restart */
	uint32_t id;       /* of its order */
	uint64_t since_ns; /* in this phase */
	uint64_t cycle;    /* the loop had ended when its order was executed */
};

/* The newest report of a device: 0, or -errno. */
typedef int (*desk_read)(void *context, uint32_t device, struct pokeys_report *out);

struct desk {
	const struct config *config; /* as at the start */
	const char *config_path;
	struct loop *loop;
	desk_read read;
	void *context;
	int listen_fd;
	char socket[CONFIG_PATH_MAX + 16];
	uint32_t next_id;
	uint64_t refused; /* requests that were none, or not possible */
	struct desk_client client[DESK_CLIENTS];
};

/* Not open yet; everything handed over outlives it. */
void desk_init(struct desk *desk, const struct config *config, const char *config_path,
	       struct loop *loop, desk_read read, void *context);

/* Make the socket, for the folder's group (mode 660). 0 or -errno. */
int desk_open(struct desk *desk);

/* Take requests, give answers. */
void desk_run(struct desk *desk, uint64_t now_ns);

/* What a device had to say: it may be an answer to somebody. */
void desk_event(struct desk *desk, const struct event *event, uint64_t now_ns);

/*
 * Read the configuration again and give every device what it wants. Logs what
 * came of it; a file with a fault changes nothing.
 */
void desk_reload(struct desk *desk);

/* Ends all clients, removes the socket. */
void desk_close(struct desk *desk);

/* For the files of this part. */

void desk_answer(struct desk *desk, struct desk_client *client, bool ok, const char *format, ...)
	__attribute__((format(printf, 4, 5)));
/* Begin "config VERB DEVICE"; answers at once if it cannot be. */
void desk_begin(struct desk *desk, struct desk_client *client, char *request, uint64_t now_ns);
/* Take what the loop has executed, before anything that came of it is looked at. */
void desk_take_results(struct desk *desk, uint64_t now_ns);
/* An order of this client was executed. */
void desk_executed(struct desk *desk, struct desk_client *client, int result, uint64_t now_ns);
/* While applying or saving: is there an answer yet? */
void desk_watch(struct desk *desk, struct desk_client *client, uint64_t now_ns);

#endif
