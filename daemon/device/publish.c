/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The state image as of now.
 *
 * Decoders keep the image up to date as replies come; here is added what
 * depends on the moment: flags, ages against limits, counters. It is copied
 * as a whole, so a reader never sees half a cycle. Magic, version, hash and
 * epoch belong to whoever owns the memory.
 *
 * Stale means that the fast data is older than the limit, whatever the
 * reason: the flag falls when the data is fresh again and needs nobody to
 * clear it.
 */

#include <string.h>
#include "daemon/device/internal.h"

/* Under loss it comes and goes many times a second; a line a second will do. */
static void say_stale(struct device *device, bool stale, uint64_t age_ns)
{
	struct meter *meter = &device->meter;

	if (!running(device) || stale == meter->stale_said ||
	    (stale && meter->stale_said_ns && device->now_ns - meter->stale_said_ns < SECOND))
		return;
	device_say(device, EVENT_STALE, stale ? EVENT_WARNING : EVENT_NOTICE, stale,
		   age_ns == POKEYS_NEVER ? -1 : (int64_t)(age_ns / 1000), 0);
	meter->stale_said = stale;
	if (stale)
		meter->stale_said_ns = device->now_ns;
}

static void judge_stale(struct device *device, uint64_t now_ns)
{
	const uint64_t age = pokeys_state_age_ns(&device->image, now_ns);
	const bool stale = age > device->config.stale_after_ns;

	device->now_ns = now_ns;
	if (stale != device->meter.stale)
		say_stale(device, stale, age);
	device->meter.stale = stale;
}

static uint32_t flags(const struct device *device)
{
	const struct safe *safe = &device->safe;
	const struct intake *intake = &device->intake;
	uint32_t set = 0;

	if (device->meter.stale)
		set |= POKEYS_STATE_STALE;
	if (intake->fresh)
		set |= POKEYS_STATE_COMMANDER;
	if (safe->reached)
		set |= POKEYS_STATE_SAFE;
	if (safe->permitted)
		set |= POKEYS_STATE_MACHINE_ON;
	if (intake->fresh && intake->machine_on && !safe->permitted)
		set |= POKEYS_STATE_NEEDS_EDGE;
	if (safe->edge_unread)
		set |= POKEYS_STATE_EDGE_UNREAD;
	if (intake->fresh && running(device) && safe_holds(device))
		set |= POKEYS_STATE_OUTPUTS_HELD;
	if (intake->bad)
		set |= POKEYS_STATE_BAD_COMMAND;
	if (safe->stopping)
		set |= POKEYS_STATE_STOPPING;
	return set;
}

/* Also by what is commanded now, which may not be sent yet. */
static bool in_position(const struct device *device, unsigned int i)
{
	const struct pokeys_axis *axis = &device->image.engine.axis[i];
	const bool driven = device->motion.driven >> i & 1;

	if (axis->mode == POKEYS_AXIS_BUFFERED)
		return device->buffer.synced && !device->buffer.busy && !device->buffer.open &&
		       !device->buffer.doubt && !buffer_level(device) &&
		       axis->position == axis->reference &&
		       (!driven || axis->reference == moving_axis_wish(device, i)->position);
	return axis->mode != POKEYS_AXIS_VELOCITY && reference_met(device, i);
}

void device_publish(struct device *device, uint64_t now_ns, struct pokeys_state *out)
{
	struct pokeys_state *image = &device->image;

	judge_stale(device, now_ns);
	image->cycle = device->cycle;
	image->period_ns = device->config.period_ns;
	image->t_cycle_ns = device->tick_ns;
	image->t_publish_ns = now_ns;
	image->stale_after_ns = device->config.stale_after_ns;
	image->flags = flags(device);
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		image->engine.axis[i].in_position = in_position(device, i);
	image->config_state = (uint8_t)configure_state(device);
	image->failsafe = (uint8_t)failsafe_state(device);
	image->command_heartbeat = device->intake.heartbeat;
	image->command_t_ns = device->intake.t_ns;
	meter_publish(device, &image->statistics);
	*out = *image;
}

void device_diag(const struct device *device, struct pokeys_diag *out)
{
	out->round_trip = device->meter.round_trip;
	out->fast_round_trip = device->meter.fast_round_trip;
	out->read_round_trip = device->meter.class_round_trip[POKEYS_CLASS_READ];
	out->write_round_trip = device->meter.class_round_trip[POKEYS_CLASS_WRITE];
	out->one_shot_round_trip = device->meter.class_round_trip[POKEYS_CLASS_ONESHOT];
	out->receive = device->meter.receive;
	out->fresh = device->meter.fresh;
	out->age_at_read = device->meter.age_at_read;
}
