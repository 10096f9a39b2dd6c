/* SPDX-License-Identifier: MIT */
/*
 * Waiting for news.
 *
 * Nobody can wake a client, for that would need a place where it says that it waits, and
 * others would have to believe what it says there. So it looks at counters every few
 * milliseconds, which costs a hundredth of a percent of a processor.
 */
#include <errno.h>
#include "shm/client_private.h"
#include "shm/clock.h"

enum { LOOK_NS = 5000000 };

/* Only the thread that is here now lets go of these. */
static void *attached(const struct handover *handover)
{
	return atomic_load_explicit(&handover->pointer, memory_order_relaxed);
}

/* The daemon writes diagnostics ten times a second; the link changes in between. */
static uint64_t commander_news(const struct pokeys_client *client)
{
	struct pokeys_state state = { 0 };

	iox_state_read(attached(&client->state), &state);
	return (iox_diag_count(attached(&client->diag)) +
		iox_report_count(attached(&client->report)))
		       << 16 |
	       (uint64_t)state.link << 8 | state.fault;
}

uint64_t client_news(const struct pokeys_client *client)
{
	if (client_commands(client))
		return commander_news(client);
	return atomic_load_explicit(&client->view->shared->notices, memory_order_acquire);
}

static bool is_attached(const struct pokeys_client *client)
{
	return client_commands(client) ? client->root_name[0] : client->view != NULL;
}

/* For a moment; false if it is time already, or a signal came. */
static bool nap_until(uint64_t end_ns)
{
	const uint64_t now = clock_ns(CLOCK_MONOTONIC);
	const uint64_t rest = end_ns > now ? end_ns - now : 0;
	const struct timespec nap = { .tv_nsec = (long)(rest < LOOK_NS ? rest : LOOK_NS) };

	return rest && !nanosleep(&nap, NULL);
}

static int wait_for_news(struct pokeys_client *client, unsigned int timeout_ms)
{
	const uint64_t end_ns = clock_ns(CLOCK_MONOTONIC) + timeout_ms * UINT64_C(1000000);
	uint64_t news;

	for (;;) {
		news = client_news(client);
		if (news != client->news)
			break;
		if (!nap_until(end_ns))
			return 0;
	}
	client->news = news;
	return 1;
}

int pokeys_client_wait(pokeys_client *client, unsigned int timeout_ms)
{
	if (!(client->flags & POKEYS_CLIENT_EVENTS))
		return -EPERM;
	if (client->follower.running || client->holder.running)
		return -EBUSY;
	return is_attached(client) ? wait_for_news(client, timeout_ms) : -ENOTCONN;
}
