/* SPDX-License-Identifier: MIT */
/*
 * One device's services: publish its images, take its commands.
 *
 * The first value of each image is already a whole one, so that a client that
 * attaches before the loop's first cycle reads "searching, nothing known yet"
 * instead of something it must refuse.
 *
 * When a commander dies, its writer's mark stays set inside the command image
 * and nobody can ever write there again. So the service is made anew. The
 * realtime thread may be reading from the old one: it is handed the new one
 * through a handover, and in between reads "nobody has ever written".
 */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include "shm/host_private.h"
#include "shm/say.h"

enum { SERVICE_NAME_MAX = POKEYS_SHM_NAME_MAX + 24 };

static const char *service_name(char name[SERVICE_NAME_MAX], const struct shm_device *device,
				const char *image)
{
	snprintf(name, SERVICE_NAME_MAX, "pokeys/%s/%s", device->name, image);
	return name;
}

static void stamp_state(struct pokeys_state *state, const struct shm_device *device)
{
	state->magic = POKEYS_STATE_MAGIC;
	state->version = POKEYS_STATE_VERSION;
	state->size_units = sizeof(*state) / 8;
	state->hash = POKEYS_STATE_HASH;
	state->epoch = device->host->manifest.epoch;
}

static void stamp_diag(struct pokeys_diag *diag, const struct shm_device *device)
{
	diag->magic = POKEYS_DIAG_MAGIC;
	diag->version = POKEYS_DIAG_VERSION;
	diag->size_units = sizeof(*diag) / 8;
	diag->hash = POKEYS_DIAG_HASH;
	diag->epoch = device->host->manifest.epoch;
}

/* Both cells, so that their pages are there before the realtime thread comes. */
static void fill_state(struct shm_device *device, const struct pokeys_state *first)
{
	shm_device_write(device, first);
	shm_device_write(device, first);
}

static int open_state(struct shm_device *device, struct iox_error *error)
{
	const struct iox_node *node = device->host->node;
	struct pokeys_state first = { .link = POKEYS_LINK_SEARCHING, .flags = POKEYS_STATE_STALE };
	char name[SERVICE_NAME_MAX];
	struct iox_image *image;
	int r;

	stamp_state(&first, device);
	service_name(name, device, "state");
	r = iox_state_create(node, name, &first, &image, error);
	if (r)
		return r;
	r = iox_state_writer_open(node, name, &device->state, error);
	iox_image_destroy(image);
	if (!r)
		fill_state(device, &first);
	return r;
}

static int open_diag(struct shm_device *device, struct iox_error *error)
{
	const struct iox_node *node = device->host->node;
	struct pokeys_diag first = { 0 };
	char name[SERVICE_NAME_MAX];
	struct iox_image *image;
	int r;

	stamp_diag(&first, device);
	service_name(name, device, "diag");
	r = iox_diag_create(node, name, &first, &image, error);
	if (r)
		return r;
	r = iox_diag_writer_open(node, name, &device->diag, error);
	iox_image_destroy(image);
	if (!r) {
		shm_device_write_diag(device, &first);
		shm_device_write_diag(device, &first);
	}
	return r;
}

static int open_command(struct shm_device *device, struct iox_error *error)
{
	static const struct pokeys_command nothing;
	const struct iox_node *node = device->host->node;
	struct iox_command_reader *reader = NULL;
	char name[SERVICE_NAME_MAX];
	struct iox_image *image = NULL;
	int r;

	service_name(name, device, "command");
	r = iox_command_create(node, name, &nothing, &image, error);
	if (r && r != -EEXIST)
		return r;
	r = iox_command_reader_open(node, name, &reader, error);
	if (image)
		iox_image_destroy(image);
	if (!r)
		handover_swap(&device->command, reader);
	return r;
}

static void close_command(struct shm_device *device)
{
	struct iox_command_reader *reader = handover_swap(&device->command, NULL);

	if (reader)
		iox_command_reader_close(reader);
}

int shm_device_open(struct shm_device *device, struct shm_host *host, const char *name,
		    char *why, size_t size)
{
	struct iox_error error = { "" };
	char event[SERVICE_NAME_MAX];
	int r;

	memset(device, 0, sizeof(*device));
	device->host = host;
	snprintf(device->name, sizeof(device->name), "%s", name);
	r = open_state(device, &error);
	if (!r)
		r = open_diag(device, &error);
	if (!r)
		r = open_command(device, &error);
	if (!r)
		r = iox_notifier_open(host->node, service_name(event, device, "event"),
				      &device->notifier, &error);
	if (!r)
		return 0;
	shm_device_close(device);
	return say(why, size, r, "device %s: cannot make its shared memory in %s: %s (%s)",
		   name, host->root, strerror(-r), error.text);
}

void shm_device_close(struct shm_device *device)
{
	close_command(device);
	if (device->notifier)
		iox_notifier_close(device->notifier);
	if (device->diag)
		iox_diag_writer_close(device->diag);
	if (device->state)
		iox_state_writer_close(device->state);
	device->notifier = NULL;
	device->diag = NULL;
	device->state = NULL;
}

/*
 * Is the place of the commander stuck? Taking it for a moment tells: a free
 * place can be had and given back, one that died refuses.
 */
static int probe_command(struct shm_device *device)
{
	struct iox_command_writer *writer;
	char name[SERVICE_NAME_MAX];
	int r;

	service_name(name, device, "command");
	r = iox_command_writer_open(device->host->node, name, &writer, NULL);
	if (!r)
		iox_command_writer_close(writer);
	return r;
}

int shm_device_recycle(struct shm_device *device)
{
	int r;

	if (atomic_load(&device->command.pointer)) {
		r = probe_command(device);
		if (r != -EDEADLK)
			return !r || r == -EBUSY ? 0 : -EAGAIN;
		close_command(device);
	}
	if (open_command(device, NULL))
		return -EAGAIN;
	/* it is still the old one if somebody else had it open at that moment */
	return probe_command(device) == -EDEADLK ? -EAGAIN : 1;
}

int shm_device_notify(struct shm_device *device)
{
	int r = iox_notify(device->notifier, NULL);

	return r < 0 ? r : 0;
}

int shm_device_commanders(struct shm_device *device)
{
	char name[SERVICE_NAME_MAX];

	return iox_writers(device->host->node, service_name(name, device, "command"), NULL,
			   NULL);
}

void shm_device_write(struct shm_device *device, const struct pokeys_state *state)
{
	struct pokeys_state *cell = iox_state_loan(device->state);

	if (!cell)
		return;
	memcpy(cell, state, sizeof(*cell));
	shm_device_commit(device);
}

struct pokeys_state *shm_device_loan(struct shm_device *device)
{
	return iox_state_loan(device->state);
}

void shm_device_commit(struct shm_device *device)
{
	struct pokeys_state *cell = iox_state_loan(device->state);

	if (!cell)
		return;
	stamp_state(cell, device);
	iox_state_commit(device->state);
}

void shm_device_write_diag(struct shm_device *device, const struct pokeys_diag *diag)
{
	struct pokeys_diag *cell = iox_diag_loan(device->diag);

	if (!cell)
		return;
	memcpy(cell, diag, sizeof(*cell));
	stamp_diag(cell, device);
	iox_diag_commit(device->diag);
}

int shm_device_read_command(struct shm_device *device, struct pokeys_command *out)
{
	const struct iox_command_reader *reader = handover_take(&device->command);
	int r = reader ? iox_command_read(reader, out) : 0;

	handover_give_back(&device->command);
	return r;
}
