/* SPDX-License-Identifier: MIT */
/*
 * The holder: a thread of the library that commands for a program.
 *
 * A commander has to write a new heartbeat many times a second, or its device goes to the safe
 * state. A program that only wants a lamp on for a while would write a loop for it, and make the
 * mistake that all such loops have: a thread that beats while the rest hangs. So the program
 * renews a lease, and the thread beats no longer than that. When the lease was over, or the
 * daemon was away, the program is told at its next call, and has to command again.
 *
 * The lease is counted by a clock that goes on while the computer sleeps.
 *
 * Not realtime, and not meant for motion: the daemon's heartbeat limit is the only deadline.
 */
#include <errno.h>
#include <string.h>
#include <unistd.h>
#include "shm/client_private.h"
#include "shm/clock.h"

enum { LOOK_NS = 100000000 }; /* how often the daemon is looked for */

static uint64_t now_ns(void)
{
	return clock_ns(CLOCK_MONOTONIC);
}

static uint64_t lease_now_ns(void)
{
	return clock_ns(CLOCK_BOOTTIME);
}

/* Differs for each start, and from that of another process; never 0. */
static uint32_t new_session(void)
{
	const uint64_t now = now_ns();

	return (uint32_t)(now ^ now >> 32 ^ (uint64_t)getpid() << 16) | 1;
}

/* The program has to command again. */
static void lapse(struct client_holder *holder)
{
	pthread_mutex_lock(&holder->lock);
	holder->lapsed = holder->lapsed || holder->given;
	holder->given = false;
	pthread_mutex_unlock(&holder->lock);
}

/*
 * A daemon that comes after another one knows nothing of it: outputs have to wait then, as after
 * any loss.
 */
static void look(struct pokeys_client *client, struct client_holder *holder, uint64_t now)
{
	if (now < holder->look_ns)
		return;
	holder->look_ns = now + LOOK_NS;
	if (client_look(client) != POKEYS_CLIENT_ATTACHED || !holder->root[0] ||
	    !strcmp(holder->root, client->root_name))
		return;
	lapse(holder);
	strcpy(holder->root, client->root_name);
	holder->resumed = true;
	holder->session = new_session();
}

/* What is to be written now; false if nothing is. Under the lock. */
static bool is_held(struct client_holder *holder, uint64_t now, struct pokeys_command *command)
{
	if (!holder->given)
		return false;
	if (lease_now_ns() - holder->renewed_ns >= holder->lease_ns) {
		holder->given = false;
		holder->lapsed = true;
		return false;
	}
	*command = holder->command;
	command->heartbeat = ++holder->heartbeat;
	command->t_ns = now;
	command->period_ns = holder->period_ns;
	if (!command->session)
		command->session = holder->session;
	if (holder->resumed)
		command->flags |= POKEYS_COMMAND_RESUMED;
	return true;
}

/* Somebody else may have the device when the daemon is back. */
static void has_written(struct pokeys_client *client, struct client_holder *holder, int r)
{
	if (!r)
		strcpy(holder->root, client->root_name);
	else if (holder->root[0])
		lapse(holder);
}

static struct timespec after(uint64_t now, uint64_t ns)
{
	const uint64_t then = now + ns;

	return (struct timespec){ .tv_sec = (time_t)(then / 1000000000u),
				  .tv_nsec = (long)(then % 1000000000u) };
}

static void *hold(void *argument)
{
	struct pokeys_client *client = argument;
	struct client_holder *holder = &client->holder;
	struct pokeys_command command;
	struct timespec when;
	uint64_t now;
	bool held;

	pthread_setname_np(pthread_self(), "pokeys-hold");
	pthread_mutex_lock(&holder->lock);
	while (!holder->stop) {
		pthread_mutex_unlock(&holder->lock);
		now = now_ns();
		look(client, holder, now);
		pthread_mutex_lock(&holder->lock);
		held = is_held(holder, now_ns(), &command);
		pthread_mutex_unlock(&holder->lock);
		if (held)
			has_written(client, holder, client_write(client, &command));
		when = after(now, holder->period_ns);
		pthread_mutex_lock(&holder->lock);
		if (!holder->stop)
			pthread_cond_timedwait(&holder->wake, &holder->lock, &when);
	}
	pthread_mutex_unlock(&holder->lock);
	return NULL;
}

int pokeys_client_hold(pokeys_client *client, unsigned int period_ms, unsigned int lease_ms)
{
	struct client_holder *holder = &client->holder;
	pthread_condattr_t attributes;
	int r;

	if (!client_commands(client))
		return -EPERM;
	if (period_ms < 1 || period_ms > 1000 || lease_ms < 10 || lease_ms > 60000)
		return -EINVAL;
	if (holder->running)
		return -EALREADY;
	if (client->follower.running)
		return -EBUSY;
	memset(holder, 0, sizeof(*holder));
	holder->period_ns = period_ms * UINT64_C(1000000);
	holder->lease_ns = lease_ms * UINT64_C(1000000);
	holder->session = new_session();
	pthread_mutex_init(&holder->lock, NULL);
	pthread_condattr_init(&attributes);
	pthread_condattr_setclock(&attributes, CLOCK_MONOTONIC);
	pthread_cond_init(&holder->wake, &attributes);
	pthread_condattr_destroy(&attributes);
	r = client_thread(&holder->thread, hold, client);
	holder->running = !r;
	return r;
}

/* 0, or 1 if the lease was over meanwhile. */
static int renew(struct client_holder *holder, const struct pokeys_command *command)
{
	int lapsed;

	pthread_mutex_lock(&holder->lock);
	lapsed = holder->lapsed ||
		 (holder->given && lease_now_ns() - holder->renewed_ns >= holder->lease_ns);
	holder->lapsed = !command && lapsed;
	if (command) {
		holder->command = *command;
		holder->given = true;
	}
	if (command || !lapsed)
		holder->renewed_ns = lease_now_ns();
	pthread_cond_signal(&holder->wake);
	pthread_mutex_unlock(&holder->lock);
	return lapsed;
}

int pokeys_client_command(pokeys_client *client, const struct pokeys_command *command)
{
	return client->holder.running ? renew(&client->holder, command) : -ENOTCONN;
}

int pokeys_client_renew(pokeys_client *client)
{
	return client->holder.running ? renew(&client->holder, NULL) : -ENOTCONN;
}

void client_hold_end(struct pokeys_client *client)
{
	struct client_holder *holder = &client->holder;

	if (!holder->running)
		return;
	pthread_mutex_lock(&holder->lock);
	holder->stop = true;
	pthread_cond_signal(&holder->wake);
	pthread_mutex_unlock(&holder->lock);
	pthread_join(holder->thread, NULL);
	pthread_cond_destroy(&holder->wake);
	pthread_mutex_destroy(&holder->lock);
	holder->running = false;
}
