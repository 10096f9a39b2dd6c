/* SPDX-License-Identifier: MIT */
/*
 * A client's life: find the daemon, attach, notice that another one has taken
 * over, attach anew.
 *
 * A commander looks at the link `current` while all is well: it names the root of
 * the daemon that started last. All others look at their device's file in the mirror.
 * Both are still there when the daemon was killed, and that is no reason to detach:
 * its last image stays readable, and the reader decides by its own clock how much it
 * is worth.
 */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "shm/client_private.h"
#include "shm/say.h"

static enum pokeys_client_state set_status(struct pokeys_client *client,
					   enum pokeys_client_state state, const char *why)
{
	pthread_mutex_lock(&client->status.lock);
	client->status.state = state;
	snprintf(client->status.why, sizeof(client->status.why), "%s", why);
	pthread_mutex_unlock(&client->status.lock);
	return state;
}

static int check_names(const char *directory, const char *device, const char *program,
		       unsigned int flags)
{
	if (flags & ~(unsigned int)(POKEYS_CLIENT_COMMANDER | POKEYS_CLIENT_EVENTS))
		return -EINVAL;
	if (!runtime_device_name_ok(device) || !runtime_device_name_ok(program))
		return -EINVAL;
	return runtime_check_directory(directory, NULL, 0) ? -EINVAL : 0;
}

int pokeys_client_open(pokeys_client **out, const char *runtime_directory, const char *device,
		       const char *program, unsigned int flags)
{
	struct pokeys_client *client;

	if (!runtime_directory)
		runtime_directory = POKEYS_RUNTIME_DIRECTORY;
	if (check_names(runtime_directory, device, program, flags))
		return -EINVAL;
	client = calloc(1, sizeof(*client));
	if (!client)
		return -ENOMEM;
	snprintf(client->directory, sizeof(client->directory), "%s", runtime_directory);
	snprintf(client->device, sizeof(client->device), "%s", device);
	snprintf(client->program, sizeof(client->program), "%s", program);
	client->flags = flags;
	pthread_mutex_init(&client->status.lock, NULL);
	pthread_mutex_init(&client->cold, NULL);
	set_status(client, POKEYS_CLIENT_DETACHED, "not looked for a daemon yet");
	*out = client;
	return 0;
}

void pokeys_client_close(pokeys_client *client)
{
	if (!client)
		return;
	client_follow_end(client);
	client_hold_end(client);
	client_unwatch(client);
	if (client->root_name[0]) {
		client_leave(client);
		client_detach(client);
	}
	pthread_mutex_destroy(&client->cold);
	pthread_mutex_destroy(&client->status.lock);
	free(client);
}

/* No link: nobody there. Anything else: somebody who should not be. */
static enum pokeys_client_state explain_current(struct pokeys_client *client, int r)
{
	char why[CLIENT_WHY_MAX] = "";

	if (r == -ENOENT || r == -ENOTDIR) {
		say(why, sizeof(why), 0, "no daemon in %s; is pokeysd running?", client->directory);
		return set_status(client, POKEYS_CLIENT_DETACHED, why);
	}
	if (r == -EACCES)
		runtime_denied(client->directory, why, sizeof(why));
	else if (r == -EPROTO)
		say(why, sizeof(why), 0, "%s/current: not a link that pokeysd made; remove it",
		    client->directory);
	else
		say(why, sizeof(why), 0, "%s/current: %s", client->directory, strerror(-r));
	return set_status(client, POKEYS_CLIENT_REFUSED, why);
}

static enum pokeys_client_state look_mirror(struct pokeys_client *client)
{
	char why[CLIENT_WHY_MAX] = "";
	int r;

	if (client->view && mirror_is_current(client->view, client->directory, client->device))
		return POKEYS_CLIENT_ATTACHED;
	client_unwatch(client);
	r = client_watch(client, why, sizeof(why));
	if (!r)
		return set_status(client, POKEYS_CLIENT_ATTACHED, why);
	return set_status(client, r == -ENOENT ? POKEYS_CLIENT_DETACHED : POKEYS_CLIENT_REFUSED,
			  why);
}

static enum pokeys_client_state look_root(struct pokeys_client *client)
{
	char name[SHM_ROOT_NAME_MAX];
	char why[CLIENT_WHY_MAX] = "";
	int r = runtime_current(client->directory, name);

	if (!r && !strcmp(name, client->root_name))
		return POKEYS_CLIENT_ATTACHED;
	if (client->root_name[0])
		client_detach(client);
	if (r)
		return explain_current(client, r);
	r = client_attach(client, name, why, sizeof(why));
	if (!r)
		return set_status(client, POKEYS_CLIENT_ATTACHED, why);
	return set_status(client, r == -ENOENT ? POKEYS_CLIENT_DETACHED : POKEYS_CLIENT_REFUSED,
			  why);
}

enum pokeys_client_state client_look(struct pokeys_client *client)
{
	enum pokeys_client_state state;

	pthread_mutex_lock(&client->cold);
	state = client_commands(client) ? look_root(client) : look_mirror(client);
	pthread_mutex_unlock(&client->cold);
	return state;
}

/* What the holder attaches to, and when, is its own. */
enum pokeys_client_state pokeys_client_poll(pokeys_client *client)
{
	return client->holder.running ? pokeys_client_status(client, NULL, 0) : client_look(client);
}

enum pokeys_client_state pokeys_client_status(const pokeys_client *client, char *why, size_t size)
{
	struct client_status *status = (struct client_status *)&client->status;
	enum pokeys_client_state state;

	pthread_mutex_lock(&status->lock);
	state = status->state;
	say(why, size, 0, "%s", status->why);
	pthread_mutex_unlock(&status->lock);
	return state;
}

int pokeys_client_follow(pokeys_client *client, unsigned int interval_ms)
{
	if (interval_ms < 1 || interval_ms > 10000)
		return -EINVAL;
	if (client->holder.running)
		return -EBUSY;
	return client_follow_start(client, interval_ms);
}

int pokeys_client_commanders(pokeys_client *client)
{
	char name[POKEYS_SHM_NAME_MAX + 24];
	int r;

	snprintf(name, sizeof(name), "pokeys/%s/command", client->device);
	pthread_mutex_lock(&client->cold);
	if (!client_commands(client))
		r = client->view ? !!client->view->shared->commanders : -ENOTCONN;
	else
		r = client->node ? iox_writers(client->node, name, NULL, NULL) : -ENOTCONN;
	pthread_mutex_unlock(&client->cold);
	return r;
}

int pokeys_shm_devices(const char *runtime_directory, char names[][POKEYS_SHM_NAME_MAX], size_t max)
{
	int r;

	if (!runtime_directory)
		runtime_directory = POKEYS_RUNTIME_DIRECTORY;
	r = runtime_check_directory(runtime_directory, NULL, 0);
	return r ? r : mirror_devices(runtime_directory, names, max);
}
