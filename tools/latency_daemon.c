// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The daemon that latency measures beside its own threads. It may be starting just
 * now, started anew by systemd, or held on a busy machine for longer than a daemon
 * that lives is ever silent; each of these is over in a moment. So where there is any
 * sign of one it is waited for, and when it does not come what was seen last is told,
 * for "no daemon" sends people to look at a service that runs.
 */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>
#include "shm/mirror.h"
#include "tools/latency.h"
#include "tools/pokeysctl.h"

#define PATIENCE_NS UINT64_C(5000000000)

/*
 * The device whose diagnostic image is read; every device of a daemon has the same loop.
 * An older image would have nothing of the seconds that are measured.
 */
static const struct view_device *find(struct view *view, uint64_t since_ns)
{
	view_read(view);
	for (size_t i = 0; i < view->count; i++) {
		const struct view_device *device = &view->device[i];

		if (device->has_diag && device->freshness >= VIEW_STALE &&
		    device->diag.t_publish_ns >= since_ns)
			return device;
	}
	return NULL;
}

/* A daemon holds this file from its first moment; one that was killed leaves it. */
static bool has_begun(const char *runtime_directory)
{
	char path[256];

	return snprintf(path, sizeof(path), "%s/lock", runtime_directory) < (int)sizeof(path) &&
	       !access(path, F_OK);
}

/* What keeps us from it. */
static void explain(const struct view *view, const char *directory, int known, char *why,
		    size_t size)
{
	const struct view_device *device = &view->device[0];

	if (known < 0)
		mirror_explain(directory, known, why, size);
	else if (!known)
		snprintf(why, size, "no daemon runs in %s%s", directory,
			 has_begun(directory) ? " any more, or it is only just starting" : "");
	else if (!view->count)
		snprintf(why, size, "%s: a daemon is there, but cannot be attached to", directory);
	else if (device->freshness == VIEW_NONE || device->freshness == VIEW_DEAD)
		snprintf(why, size, "%s: %.180s", device->name, device->why);
	else
		snprintf(why, size, "%s: the daemon publishes no histograms", device->name);
}

const struct view_device *latency_daemon(struct view *view, const char *runtime_directory,
					 char *why, size_t size)
{
	const struct timespec pause = { .tv_nsec = 20000000 };
	const uint64_t since_ns = view_now(), end_ns = since_ns + PATIENCE_NS;
	const struct view_device *device = NULL;
	char names[VIEW_DEVICES][POKEYS_SHM_NAME_MAX];
	int known;

	for (;;) {
		known = pokeys_shm_devices(runtime_directory, names, VIEW_DEVICES);
		if (known > 0 && !view->count)
			view_attach(view, runtime_directory, names, (size_t)known);
		device = find(view, since_ns);
		if (device || view_now() >= end_ns || known == -EACCES || known == -EINVAL ||
		    (!known && !has_begun(runtime_directory)))
			break;
		nanosleep(&pause, NULL);
	}
	if (!device)
		explain(view, runtime_directory, known, why, size);
	return device;
}
