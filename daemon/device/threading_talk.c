/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What is known of the device's threading, and the requests beside those of its task.
 *
 * Its status (0x85/35) takes the place of the engine's in every other cycle, and only
 * while there is something to see: so there are two fast requests a cycle as ever.
 * "Known" is a status that was asked for after everything else had been answered.
 */

#include <string.h>
#include "daemon/device/internal.h"

#define AGAIN_NS (20 * MS)
#define TRIES 3

bool threading_ours(const struct device *device)
{
	const uint8_t phase = device->image.engine.task_phase;

	return device->image.engine.task == POKEYS_TASK_THREADING && phase != POKEYS_TASK_IDLE &&
	       phase != POKEYS_TASK_STOPPING;
}

/* The status is of after everything that was asked of the device. */
bool threading_known(const struct device *device)
{
	const struct threading *threading = &device->threading;

	return threading->known_ns >= device->motion.state_ended_ns &&
	       threading->known_ns >= threading->acted_ns && !threading->arm_open &&
	       !threading->cancel_open && !device->task.open;
}

uint8_t threading_step_seen(const struct device *device)
{
	const struct pokeys_threading *image = &device->image.threading;

	return image->active    ? THREAD_ACTIVE :
	       image->waiting   ? THREAD_WAITING :
	       image->prepared  ? THREAD_PREPARED :
	       image->preparing ? THREAD_PREPARING :
				  THREAD_NONE;
}

bool threading_stretched(const struct device *device)
{
	return device->threading.stretched;
}

bool threading_paces(const struct device *device)
{
	return device->threading.stretched && !device->threading.released;
}

bool threading_holds(const struct device *device)
{
	return device->threading.stretched && threading_step_seen(device) < THREAD_PREPARED &&
	       device->image.engine.task_phase != POKEYS_TASK_FINISHING;
}

bool threading_dirty(const struct device *device)
{
	return device->threading.dirty;
}

bool threading_active(const struct device *device)
{
	return threading_step_seen(device) == THREAD_ACTIVE || device->threading.released;
}

void threading_begin(struct device *device)
{
	struct threading *threading = &device->threading;

	threading->open = threading->arm_open = threading->cancel_open = false;
	threading->cancelled = false;
	threading->known_ns = 0;
	memset(&device->image.threading, 0, sizeof(device->image.threading));
}

void threading_found(struct device *device)
{
	device->threading.dirty = true;
	device->threading.cancelled = false;
}

void threading_suspect(struct device *device)
{
	struct setting *setting = &device->configure.setting[SETTING_THREADING];

	device->configure.found_running = false;
	if (!running(device) && setting->state == SETTING_DONE && !setting->known)
		setting->state = SETTING_READ;
}

void device_threading_forget(struct device *device)
{
	device->threading.written = false;
}

/* A copy of a request that came late has begun it anew, and nobody wants it. */
static void look_for_copies(struct device *device)
{
	struct threading *threading = &device->threading;

	if (threading_ours(device) || threading->dirty || !threading_known(device) ||
	    threading_step_seen(device) == THREAD_NONE)
		return;
	threading_found(device);
	if (device->motion.phase == MOTION_ON)
		safe_permit_drop(device);
}

void threading_update(struct device *device)
{
	struct threading *threading = &device->threading;

	if (threading->dirty && !threading_ours(device) && threading->cancelled &&
	    threading_known(device) && threading_step_seen(device) == THREAD_NONE)
		threading->dirty = false;
	look_for_copies(device);
	if (threading->stretched)
		device->image.threading.behind = buffer_behind(device);
}

static void cancel_ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
			 uint64_t now_ns)
{
	struct device *device = device_of(mailbox);
	struct threading *threading = &device->threading;

	(void)context;
	device->now_ns = now_ns;
	threading->cancel_open = false;
	threading->cancelled = answered(entry);
	threading->cancel_after_ns = now_ns + AGAIN_NS;
	device->threading.acted_ns = now_ns;
}

static bool cancel_due(const struct device *device)
{
	const struct threading *threading = &device->threading;

	if (!threading->dirty || threading_ours(device) || threading->cancel_open ||
	    device->task.open || threading->arm_open)
		return false;
	return !threading->cancelled ||
	       (device->now_ns >= threading->cancel_after_ns && threading_known(device) &&
		threading_step_seen(device) != THREAD_NONE);
}

static void arm_ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
		      uint64_t now_ns)
{
	struct device *device = device_of(mailbox);

	(void)entry;
	(void)context;
	device->now_ns = now_ns;
	device->threading.arm_open = false;
	device->threading.acted_ns = now_ns;
}

/* With something to play: what comes first has to lie there when the index comes. */
static bool arm_due(const struct device *device)
{
	const struct threading *threading = &device->threading;

	return threading_ours(device) && device->image.engine.task_phase == POKEYS_TASK_WORKING &&
	       threading->arm.open && threading->step == THREAD_PREPARED &&
	       threading_known(device) && threading->arm_tries < TRIES && buffer_loaded(device);
}

bool threading_send(struct device *device)
{
	struct threading *threading = &device->threading;

	if (cancel_due(device))
		return threading->cancel_open = request_send(device, WIRE_OP_THREAD_CANCEL, NULL,
							     cancel_ended, NULL, NULL);
	if (!arm_due(device))
		return false;
	threading->arm_open = request_send(device, WIRE_OP_THREAD_ARM, NULL, arm_ended, NULL, NULL);
	threading->arm_tries += threading->arm_open;
	return threading->arm_open;
}

static void status_ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
			 uint64_t now_ns)
{
	struct device *device = device_of(mailbox);
	struct threading *threading = &device->threading;
	struct pokeys_threading *image = &device->image.threading;
	struct wire_thread_status_rep status;

	(void)context;
	device->now_ns = now_ns;
	threading->open = false;
	if (!answered(entry) || device->access.phase != ACCESS_OPEN ||
	    entry->timestamp_first_sent < threading->known_ns)
		return;
	wire_thread_status_decode_rep(entry->response_buffer, &status);
	image->preparing = !!status.preparing;
	image->prepared = !!status.prepared;
	image->waiting = !!status.waiting;
	image->active = !!status.active;
	image->ignore_axes = status.ignore_axes;
	image->velocity = status.velocity;
	image->position_error = status.position_error;
	image->spindle_rpm = status.rpm;
	image->index_count = status.index_count;
	threading->known_ns = entry->timestamp_first_sent;
	threading->heard_ns = now_ns;
}

bool threading_asks(struct device *device)
{
	struct threading *threading = &device->threading;

	if (threading->open || !(threading_ours(device) || threading->dirty ||
				 device->now_ns < threading->watch_until_ns))
		return false;
	threading->turn = !threading->turn;
	return threading->turn;
}

void threading_ask(struct device *device)
{
	device->threading.open = request_send(device, WIRE_OP_THREAD_STATUS, NULL, status_ended,
					      NULL, NULL);
}
