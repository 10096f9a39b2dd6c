/* SPDX-License-Identifier: MIT */
/*
 * What has happened, for who reads the mirror. Cold: it keeps the thread that polls away while it
 * copies.
 */
#include <errno.h>
#include <limits.h>
#include "shm/client_private.h"

static int read_events(const struct mirror_view *view, struct pokeys_events_cursor *cursor,
		       struct pokeys_event *out, size_t max)
{
	if (cursor->epoch != view->head.epoch)
		*cursor = (struct pokeys_events_cursor){ .epoch = view->head.epoch };
	return (int)mirror_read_events(view, &cursor->next, out, max < INT_MAX ? max : INT_MAX);
}

int pokeys_client_read_events(pokeys_client *client, struct pokeys_events_cursor *cursor,
			      struct pokeys_event *out, size_t event_size, size_t max)
{
	int r;

	if (event_size != sizeof(*out))
		return -EINVAL;
	if (client_commands(client))
		return -EPERM;
	pthread_mutex_lock(&client->cold);
	r = client->view ? read_events(client->view, cursor, out, max) : -ENOTCONN;
	pthread_mutex_unlock(&client->cold);
	return r;
}
