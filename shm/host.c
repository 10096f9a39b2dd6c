/* SPDX-License-Identifier: MIT */
/*
 * The daemon's side: one start, its devices, and their housekeeping.
 *
 * All is made in a root that nobody knows; the link that names it comes last,
 * so that a client finds everything or nothing. Housekeeping looks for dead
 * clients by the record locks of their nodes (reap.c): nothing that a
 * client says or fails to say is needed, and one that is merely slow or
 * stopped stays.
 */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "shm/host_private.h"
#include "shm/reap.h"
#include "shm/room.h"
#include "shm/say.h"

/* Each device takes some 200 kB and 30 files. */
enum { DEVICE_BYTES = 256 * 1024, DEVICE_FILES = 40 };

static int check_room(const struct shm_host *host, char *why, size_t size)
{
	return room_check(host->directory, DEVICE_BYTES, DEVICE_FILES, why, size);
}

static int make_node(struct shm_host *host, char *why, size_t size)
{
	struct iox_error error = { "" };
	int r = check_room(host, why, size);

	if (r)
		return r;
	r = iox_node_open(host->root, "pokeysd", &host->node, &error);
	if (r)
		return say(why, size, r, "%s: cannot be used for shared memory: %s (%s)",
			   host->root, strerror(-r), error.text);
	return 0;
}

static int make_host(struct shm_host **out, const char *directory, char *why, size_t size)
{
	struct shm_host *host;
	int r;

	say(why, size, 0, "%s", "");
	r = runtime_check_directory(directory, why, size);
	if (r)
		return r;
	host = calloc(1, sizeof(*host));
	if (!host)
		return say(why, size, -ENOMEM, "out of memory");
	host->directory_fd = -1;
	host->lock_fd = -1;
	host->mirror_fd = -1;
	manifest_init(&host->manifest);
	snprintf(host->directory, sizeof(host->directory), "%s", directory);
	*out = host;
	return 0;
}

int shm_host_open(struct shm_host **out, const char *runtime_directory, const char *group,
		  const char *monitor_group, char *why, size_t size)
{
	struct shm_host *host = NULL;
	int r = make_host(&host, runtime_directory ? runtime_directory : POKEYS_RUNTIME_DIRECTORY,
			  why, size);

	if (r)
		return r;
	r = shm_folder_take(host, group, monitor_group, why, size);
	if (!r)
		r = make_node(host, why, size);
	if (r) {
		shm_host_close(host);
		return r;
	}
	*out = host;
	return 0;
}

int shm_host_clear(const char *runtime_directory, char *why, size_t size)
{
	struct shm_host *host = NULL;
	int r = make_host(&host, runtime_directory, why, size);

	if (r)
		return r;
	r = shm_folder_clear(host, why, size);
	shm_host_close(host);
	return r;
}

int shm_host_add(struct shm_host *host, const char *name, struct shm_device **out, char *why,
		 size_t size)
{
	struct shm_device *device = &host->devices[host->count];
	int r;

	if (!runtime_device_name_ok(name))
		return say(why, size, -EINVAL,
			   "device name '%.40s': 1 to %d characters of A-Z a-z 0-9 _ -",
			   name ? name : "", POKEYS_SHM_NAME_MAX - 1);
	if (manifest_has_device(&host->manifest, name))
		return say(why, size, -EEXIST, "device %s: there are two of this name", name);
	if (host->published || host->count == SHM_DEVICES_MAX)
		return say(why, size, -ENOSPC,
			   "device %s: at most %d devices, added before the start", name,
			   SHM_DEVICES_MAX);
	r = check_room(host, why, size);
	if (!r)
		r = shm_device_open(device, host, name, why, size);
	if (r)
		return r;
	memcpy(host->manifest.device[host->manifest.devices++], device->name, sizeof(device->name));
	host->count++;
	*out = device;
	return 0;
}

int shm_host_publish(struct shm_host *host, char *why, size_t size)
{
	int r = shm_root_guard(host);

	if (!r)
		r = manifest_write(host->root, &host->manifest);
	if (!r)
		r = shm_root_open(host);
	for (size_t i = 0; !r && i < host->count; i++)
		r = mirror_publish(&host->devices[i].mirror, host->count);
	if (!r)
		r = runtime_set_current(host->directory, host->root_name);
	if (r)
		return say(why, size, r, "%s: cannot be published: %s", host->root, strerror(-r));
	host->published = true;
	return 0;
}

uint64_t shm_host_epoch(const struct shm_host *host)
{
	return host->manifest.epoch;
}

gid_t shm_host_monitors(const struct shm_host *host)
{
	return host->mirror_gid;
}

/* A dead client may have been a commander: look at each device until it is clear. */
static int recycle_devices(struct shm_host *host)
{
	int made = 0;

	for (size_t i = 0; i < host->count; i++) {
		struct shm_device *device = &host->devices[i];
		int r = device->recycle ? shm_intakes_recycle(device) : 0;

		device->recycle = r < 0;
		made += r > 0;
	}
	return made;
}

/*
 * Somebody cleans up by hand and removes the link: whoever is attached lets go
 * then, for a daemon that ends removes it as well. So it is made again, unless
 * the root is gone with it: then there is nothing to be found any more.
 */
static int keep_current(const struct shm_host *host)
{
	char name[SHM_ROOT_NAME_MAX];

	if (manifest_gone(host->root))
		return -ESTALE;
	for (size_t i = 0; i < host->count; i++)
		if (!mirror_is_there(&host->devices[i].mirror))
			return -ESTALE;
	if (runtime_current(host->directory, name) || strcmp(name, host->root_name))
		runtime_set_current(host->directory, host->root_name);
	return 0;
}

int shm_host_maintain(struct shm_host *host)
{
	int dead = reap(host->node, host->root);

	for (size_t i = 0; dead > 0 && i < host->count; i++)
		host->devices[i].recycle = true;
	if (host->published && runtime_is_closed(host->root))
		shm_root_open(host);
	if (recycle_devices(host) && host->published)
		manifest_write(host->root, &host->manifest);
	for (size_t i = 0; i < host->count; i++)
		mirror_show_commanders(&host->devices[i].mirror,
				       shm_device_commanders(&host->devices[i]));
	/* a client that attached just when its daemon's root was removed */
	runtime_remove_stale(host->directory_fd, host->root_name);
	return host->published && keep_current(host) ? -ESTALE : dead;
}

void shm_host_close(struct shm_host *host)
{
	if (!host)
		return;
	if (host->published)
		unlinkat(host->directory_fd, "current", 0);
	for (size_t i = 0; i < host->count; i++)
		shm_device_close(&host->devices[i]);
	if (host->node)
		iox_node_close(host->node);
	shm_folder_give_back(host);
	free(host);
}
