/* SPDX-License-Identifier: MIT */
/*
 * A client that does not command: it reads the mirror and leaves no trace.
 */
#include <errno.h>
#include <stdlib.h>
#include "shm/client_private.h"
#include "shm/say.h"

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
	client->view = view;
	client->news = client_news(client);
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
