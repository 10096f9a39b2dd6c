/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The device layer keeps pointers into the world and into itself, so what is put back
 * goes where it was.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/lose.h"

int lose_request = -1, lose_reply = -1;

static struct world picture;
static void *device_picture;

static void watch(struct world *w, const uint8_t *packet)
{
	(void)packet;
	w->swallow = lose_request-- == 0;
}

static bool lose(struct world *w, const uint8_t *packet)
{
	(void)w;
	(void)packet;
	return lose_reply-- == 0;
}

void lose_begin(struct world *world)
{
	lose_request = lose_reply = -1;
	world->watch = watch;
	world->lose_reply = lose;
}

void lose_keep(const struct world *world)
{
	picture = *world;
	device_picture = realloc(device_picture, device_size());
	assert_non_null(device_picture);
	memcpy(device_picture, world->device, device_size());
}

void lose_put_back(struct world *world)
{
	*world = picture;
	memcpy(world->device, device_picture, device_size());
	lose_request = lose_reply = -1;
}

const struct world *lose_kept(void)
{
	return &picture;
}

void lose_one(int k, int packets)
{
	if (k < packets)
		lose_request = k;
	else
		lose_reply = k - packets;
}

void lose_end(void)
{
	free(device_picture);
	device_picture = NULL;
}
