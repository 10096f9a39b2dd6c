/* SPDX-License-Identifier: MIT */
/*
 * What the commander of a device writes and the daemon takes: the command
 * image, once a servo period, and the wish for its settings, rarely.
 *
 * When a commander dies, its writer's mark stays set inside both images and
 * nobody can ever write there again. So the services are made anew. The
 * realtime thread may be reading from the old ones: it is handed the new ones
 * through a handover, and in between reads "nobody has ever written".
 *
 * The two are the same but for their type, and C has no word for that: the
 * macro makes four functions of each, and all that follows is written once.
 */
#include <errno.h>
#include <stdio.h>
#include "shm/host_private.h"

struct intake_kind {
	const char *image;
	int (*create)(const struct iox_node *node, const char *service, struct iox_image **out,
		      struct iox_error *error);
	int (*open)(const struct iox_node *node, const char *service, void **out,
		    struct iox_error *error);
	void (*close)(void *reader);
	int (*probe)(const struct iox_node *node, const char *service);
};

/* probe: taking the writer's place for a moment tells whether it is free, had, or stuck. */
#define INTAKE(name)									\
	static int create_##name(const struct iox_node *node, const char *service,	\
				 struct iox_image **out, struct iox_error *error)	\
	{										\
		static const struct pokeys_##name nothing;				\
											\
		return iox_##name##_create(node, service, &nothing, out, error);	\
	}										\
	static int open_##name(const struct iox_node *node, const char *service,	\
			       void **out, struct iox_error *error)			\
	{										\
		struct iox_##name##_reader *reader = NULL;				\
		int r = iox_##name##_reader_open(node, service, &reader, error);	\
											\
		*out = reader;								\
		return r;								\
	}										\
	static void close_##name(void *reader)						\
	{										\
		iox_##name##_reader_close(reader);					\
	}										\
	static int probe_##name(const struct iox_node *node, const char *service)	\
	{										\
		struct iox_##name##_writer *writer;					\
		int r = iox_##name##_writer_open(node, service, &writer, NULL);		\
											\
		if (!r)									\
			iox_##name##_writer_close(writer);				\
		return r;								\
	}										\
	static const struct intake_kind name##_kind = {					\
		#name, create_##name, open_##name, close_##name, probe_##name		\
	}

INTAKE(command);
INTAKE(wish);

static const struct intake_kind *const kinds[SHM_INTAKES] = {
	[SHM_INTAKE_COMMAND] = &command_kind,
	[SHM_INTAKE_WISH] = &wish_kind,
};

const char *shm_service_name(char name[SHM_SERVICE_NAME_MAX], const char *device, const char *image)
{
	snprintf(name, SHM_SERVICE_NAME_MAX, "pokeys/%s/%s", device, image);
	return name;
}

static int open_intake(struct shm_device *device, enum shm_intake which, struct iox_error *error)
{
	const struct intake_kind *kind = kinds[which];
	const struct iox_node *node = device->host->node;
	char name[SHM_SERVICE_NAME_MAX];
	struct iox_image *image = NULL;
	void *reader = NULL;
	int r;

	shm_service_name(name, device->name, kind->image);
	r = kind->create(node, name, &image, error);
	if (r && r != -EEXIST)
		return r;
	r = kind->open(node, name, &reader, error);
	if (image)
		iox_image_destroy(image);
	if (!r)
		handover_swap(&device->intake[which], reader);
	return r;
}

static void close_intake(struct shm_device *device, enum shm_intake which)
{
	void *reader = handover_swap(&device->intake[which], NULL);

	if (reader)
		kinds[which]->close(reader);
}

int shm_intakes_open(struct shm_device *device, struct iox_error *error)
{
	int r = 0;

	for (enum shm_intake which = 0; !r && which < SHM_INTAKES; which++)
		r = open_intake(device, which, error);
	return r;
}

void shm_intakes_close(struct shm_device *device)
{
	for (enum shm_intake which = 0; which < SHM_INTAKES; which++)
		close_intake(device, which);
}

/* As long as files are made, nobody enters; who wants to attaches with its next look. */
static int make_again(struct shm_device *device, enum shm_intake which)
{
	int r = shm_root_close(device->host);

	if (!r)
		r = open_intake(device, which, NULL);
	shm_root_open(device->host);
	return r;
}

/* 1 made anew, 0 its place is free or had, -EAGAIN try again. */
static int recycle(struct shm_device *device, enum shm_intake which)
{
	const struct iox_node *node = device->host->node;
	char name[SHM_SERVICE_NAME_MAX];
	int r;

	shm_service_name(name, device->name, kinds[which]->image);
	if (atomic_load(&device->intake[which].pointer)) {
		r = kinds[which]->probe(node, name);
		if (r != -EDEADLK)
			return !r || r == -EBUSY ? 0 : -EAGAIN;
		close_intake(device, which);
	}
	if (make_again(device, which))
		return -EAGAIN;
	/* it is still the old one if somebody else had it open at that moment */
	return kinds[which]->probe(node, name) == -EDEADLK ? -EAGAIN : 1;
}

int shm_intakes_recycle(struct shm_device *device)
{
	bool again = false;
	int made = 0;

	for (enum shm_intake which = 0; which < SHM_INTAKES; which++) {
		int r = recycle(device, which);

		again |= r < 0;
		made |= r > 0;
	}
	return again ? -EAGAIN : made;
}

int shm_device_read_command(struct shm_device *device, struct pokeys_command *out)
{
	const struct iox_command_reader *reader =
		handover_take(&device->intake[SHM_INTAKE_COMMAND]);
	int r = reader ? iox_command_read(reader, out) : 0;

	handover_give_back(&device->intake[SHM_INTAKE_COMMAND]);
	return r;
}

int shm_device_read_wish(struct shm_device *device, struct pokeys_wish *out)
{
	struct iox_wish_reader *reader = handover_take(&device->intake[SHM_INTAKE_WISH]);
	int r = reader ? iox_wish_news(reader, out) : 0;

	handover_give_back(&device->intake[SHM_INTAKE_WISH]);
	return r;
}
