/* SPDX-License-Identifier: MIT */
/*
 * One device's services: publish its images.
 *
 * The first value of each image is already a whole one, so that a client that
 * attaches before the loop's first cycle reads "searching, nothing known yet"
 * instead of something it must refuse.
 *
 * A new image fills both of its cells, so that their pages are there before
 * the realtime thread comes. The commander's image goes first, the mirror's after it: the
 * cell stays as it is until the next but one. What the commander writes is in host_intake.c.
 */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include "shm/host_private.h"
#include "shm/say.h"

enum { CACHE_LINE = 64 };

static void stamp_state(struct pokeys_state *state, const struct shm_device *device)
{
	state->magic = POKEYS_STATE_MAGIC;
	state->version = POKEYS_STATE_VERSION;
	state->size_units = sizeof(*state) / 8;
	state->hash = POKEYS_STATE_HASH;
	state->epoch = device->host->manifest.epoch;
}

static void stamp_report(struct pokeys_report *report, const struct shm_device *device)
{
	report->magic = POKEYS_REPORT_MAGIC;
	report->version = POKEYS_REPORT_VERSION;
	report->size_units = sizeof(*report) / 8;
	report->hash = POKEYS_REPORT_HASH;
	report->epoch = device->host->manifest.epoch;
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
	char name[SHM_SERVICE_NAME_MAX];
	struct iox_image *image;
	int r;

	stamp_state(&first, device);
	shm_service_name(name, device->name, "state");
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
	char name[SHM_SERVICE_NAME_MAX];
	struct iox_image *image;
	int r;

	stamp_diag(&first, device);
	shm_service_name(name, device->name, "diag");
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

static int open_report(struct shm_device *device, struct iox_error *error)
{
	const struct iox_node *node = device->host->node;
	struct pokeys_report first = { .state = POKEYS_CONFIG_UNKNOWN };
	char name[SHM_SERVICE_NAME_MAX];
	struct iox_image *image;
	int r;

	stamp_report(&first, device);
	shm_service_name(name, device->name, "settings");
	r = iox_report_create(node, name, &first, &image, error);
	if (r)
		return r;
	r = iox_report_writer_open(node, name, &device->report, error);
	iox_image_destroy(image);
	if (!r) {
		shm_device_write_report(device, &first);
		shm_device_write_report(device, &first);
	}
	return r;
}

int shm_device_open(struct shm_device *device, struct shm_host *host, const char *name, char *why,
		    size_t size)
{
	struct iox_error error = { "" };
	int r;

	memset(device, 0, sizeof(*device));
	device->host = host;
	snprintf(device->name, sizeof(device->name), "%s", name);
	r = mirror_make(&device->mirror, host->mirror_fd, host->mirror_gid, name,
			(unsigned int)host->count, host->manifest.epoch);
	if (r)
		return say(why, size, r, "device %s: %s/" MIRROR_FOLDER "/%s cannot be made: %s",
			   name, host->directory, name, strerror(-r));
	r = open_state(device, &error);
	if (!r)
		r = open_diag(device, &error);
	if (!r)
		r = open_report(device, &error);
	if (!r)
		r = shm_intakes_open(device, &error);
	if (!r)
		return 0;
	shm_device_close(device);
	return say(why, size, r, "device %s: cannot make its shared memory in %s: %s (%s)", name,
		   host->root, strerror(-r), error.text);
}

void shm_device_close(struct shm_device *device)
{
	mirror_remove(&device->mirror);
	shm_intakes_close(device);
	if (device->report)
		iox_report_writer_close(device->report);
	if (device->diag)
		iox_diag_writer_close(device->diag);
	if (device->state)
		iox_state_writer_close(device->state);
	device->report = NULL;
	device->diag = NULL;
	device->state = NULL;
}

void shm_device_notify(struct shm_device *device)
{
	mirror_notify(&device->mirror);
}

int shm_device_commanders(struct shm_device *device)
{
	char name[SHM_SERVICE_NAME_MAX];

	return iox_writers(device->host->node, shm_service_name(name, device->name, "command"),
			   NULL, NULL);
}

void shm_device_write(struct shm_device *device, const struct pokeys_state *state)
{
	struct pokeys_state *cell = iox_state_loan(device->state);

	if (!cell)
		return;
	memcpy(cell, state, sizeof(*cell));
	shm_device_commit(device);
	shm_device_mirror(device);
}

struct pokeys_state *shm_device_loan(struct shm_device *device)
{
	return iox_state_loan(device->state);
}

void shm_device_prepare(struct shm_device *device)
{
	volatile char *cell = (volatile char *)iox_state_loan(device->state);

	for (size_t at = 0; cell && at < sizeof(struct pokeys_state); at += CACHE_LINE)
		cell[at] = cell[at];
}

void shm_device_commit(struct shm_device *device)
{
	struct pokeys_state *cell = iox_state_loan(device->state);

	if (!cell)
		return;
	stamp_state(cell, device);
	iox_state_commit(device->state);
	device->newest = cell;
}

void shm_device_mirror(struct shm_device *device)
{
	if (device->newest)
		mirror_write(&device->mirror, MIRROR_STATE, device->newest);
}

void shm_device_write_diag(struct shm_device *device, const struct pokeys_diag *diag)
{
	struct pokeys_diag *cell = iox_diag_loan(device->diag);

	if (!cell)
		return;
	memcpy(cell, diag, sizeof(*cell));
	stamp_diag(cell, device);
	iox_diag_commit(device->diag);
	mirror_write(&device->mirror, MIRROR_DIAG, cell);
}

void shm_device_write_report(struct shm_device *device, const struct pokeys_report *report)
{
	struct pokeys_report *cell = iox_report_loan(device->report);

	if (!cell)
		return;
	memcpy(cell, report, sizeof(*cell));
	stamp_report(cell, device);
	iox_report_commit(device->report);
	mirror_write(&device->mirror, MIRROR_REPORT, cell);
}

void shm_device_write_event(struct shm_device *device, const struct pokeys_event *event)
{
	mirror_write_event(&device->mirror, event);
	mirror_notify(&device->mirror);
}
