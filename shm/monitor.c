/* SPDX-License-Identifier: MIT */
/*
 * A client that does not command: it reads the mirror and leaves no trace.
 *
 * Nobody can wake it, for that would need a place where it says that it waits. So it looks for
 * a notice every few milliseconds, which costs a hundredth of a percent of a processor.
 */
#include <errno.h>
#include <stdlib.h>
#include <time.h>
#include "shm/client_private.h"
#include "shm/clock.h"
#include "shm/say.h"

enum { LOOK_NS = 5000000 };

int client_watch(struct pokeys_client *client, char *why, size_t size)
{
	struct mirror_view *view = malloc(sizeof(*view));
	int r;

	if (!view)
		return say(why, size, -ENOMEM, "out of memory");
	r = mirror_open(view, client->directory, client->device, why, size);
	if (r) {
		free(view);
		return r;
	}
	client->notices = atomic_load(&view->shared->notices);
	client->view = view;
	handover_swap(&client->mirror, view);
	return say(why, size, 0, "attached to device '%s' in %s", client->device,
		   client->directory);
}

void client_unwatch(struct pokeys_client *client)
{
	struct mirror_view *view = handover_swap(&client->mirror, NULL);

	client->view = NULL;
	if (!view)
		return;
	mirror_close(view);
	free(view);
}

/* For a moment; false if it is time already, or a signal came. */
static bool nap_until(uint64_t end_ns)
{
	const uint64_t now = clock_ns(CLOCK_MONOTONIC);
	const uint64_t rest = end_ns > now ? end_ns - now : 0;
	const struct timespec nap = { .tv_nsec = (long)(rest < LOOK_NS ? rest : LOOK_NS) };

	return rest && !nanosleep(&nap, NULL);
}

int client_wait_notice(struct pokeys_client *client, unsigned int timeout_ms)
{
	const uint64_t end_ns = clock_ns(CLOCK_MONOTONIC) + timeout_ms * UINT64_C(1000000);
	uint32_t notices;

	if (!client->view)
		return -ENOTCONN;
	for (;;) {
		notices = atomic_load_explicit(&client->view->shared->notices,
					       memory_order_acquire);
		if (notices != client->notices)
			break;
		if (!nap_until(end_ns))
			return 0;
	}
	client->notices = notices;
	return 1;
}
