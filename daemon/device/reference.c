/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Where the axes are to go: absolute references, or speeds (protocol section
 * 3.24.3, 0x25 from firmware 4.4.7 on, else 0x20).
 *
 * An absolute reference may be lost, repeated or overtaken without harm, as
 * long as the newest one arrives in the end. So the rule is: send whenever
 * what is wanted differs from what was sent last, or if that may be lost, also
 * while older ones are under way; put the newest values into a resend; and count
 * the answer to the newest one as an acknowledgement when none of the older ones
 * is awaited any more, and not if it was resent with other values. If an
 * axis has stopped elsewhere than at its acknowledged reference, that is sent
 * again: an older packet has overtaken, or the device had not been ready.
 *
 * 0x20 has no mask, all eight values count. An axis that we do not drive gets
 * the place where it is held, and one that the device runs by speed gets
 * speed 0: for it the same number is pulses per second. Only 0x20 carries
 * speeds, so a device with one such axis is driven by it alone; its other axes
 * then go as fast as they are allowed to.
 *
 * The device brakes towards each reference, so an axis would follow a moving
 * position at its braking distance. While the position moves, the reference is
 * ahead of it by this distance. If no further command arrives, the axis brakes
 * and stops there, where it could stop at all. An axis that is limited to the
 * commanded speed could never make up a lag with another cause. So it may move
 * at twice that speed while the position moves.
 *
 * A speed cannot be read back, and an older packet that arrives late would leave
 * the axis running. So speeds are sent again all the time.
 */

#include <math.h>
#include <string.h>
#include "daemon/device/internal.h"

#define FULL_SPEED 65535
#define SUB_MOVE_PV 0x25
#define AFFIRM_NS (10 * MS)
#define CATCH_UP 2.0f
#define LEAD_MOST_S 0.1
#define AGE_MOST_NS (50 * MS)	/* of positions: it may stand since then */
#define UNDER_WAY 2		/* cycles and round trips that a good axis is late by, at most */

static bool any_by_speed(const struct device *device)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		if (device->image.engine.axis[i].mode == POKEYS_AXIS_VELOCITY)
			return true;
	}
	return false;
}

bool reference_by_mask(const struct device *device)
{
	return wire_firmware_at_least(&device->identify.identity.firmware, 4, 4, 7) &&
	       !any_by_speed(device);
}

/* As part of the axis' highest speed; 0 is "as fast as allowed". */
static uint16_t ratio(float velocity, float max_speed)
{
	float part;

	if (velocity == 0 || !(max_speed > 0))
		return FULL_SPEED;
	part = velocity / max_speed * FULL_SPEED;
	if (part >= FULL_SPEED)
		return FULL_SPEED;
	return part < 1 ? 1 : (uint16_t)lround(part);
}

static uint8_t axes_told(const struct device *device)
{
	uint8_t axes = 0;

	if (device->motion.phase != MOTION_HOLD)
		axes = device->motion.driven | device->motion.releasing;
	else
		for (unsigned int i = 0; i < POKEYS_AXES; i++)
			axes |= (uint8_t)(motion_drivable(device, i) << i);
	return axes & (uint8_t)~buffer_axes(device);
}

bool reference_any(const struct device *device)
{
	return axes_told(device) != 0;
}

/* How far before its reference the axis begins to brake. */
static double braking_way(const struct device *device, unsigned int i, double speed)
{
	const struct wire_axis_config *set =
		&device->configure.setting[SETTING_AXIS + i].value.axis.config;
	const double rate = (double)set->max_decel * 1e6; /* pulses/s^2 */

	speed = fabs(speed);
	return rate > 0 ? fmin(speed * speed / (2 * rate), speed * LEAD_MOST_S) : 0;
}

/*
 * How far the axis is behind now: since its position was read, it has gone on, and it is late by
 * what is under way.
 */
static double behind(const struct device *device, unsigned int i, double position, double speed)
{
	const double known = (double)device->image.engine.axis[i].position;
	const uint64_t age_ns = device->now_ns - device->image.t_motion_ns;
	const uint64_t late_ns = (age_ns < AGE_MOST_NS ? age_ns : AGE_MOST_NS) +
				 plan_answers_ns(device, UNDER_WAY);

	return (position - known) * copysign(1, speed) -
	       fabs(speed) * (double)late_ns / (double)SECOND;
}

/*
 * One that is not led is behind by this way. One that is behind by more has not the speed of the
 * position, and could stop earlier.
 */
static double way_of(const struct device *device, unsigned int i, double position, double speed)
{
	const double way = braking_way(device, i, speed);
	const double more = behind(device, i, position, speed) - way;

	return copysign(fmax(way - fmax(more, 0), 0), speed);
}

void reference_lead(const struct device *device, unsigned int i, struct axis_wish *wish)
{
	const double highest = (double)device->image.engine.axis[i].max_speed;
	const double speed = fmin(fmax((double)wish->forward, -highest), highest);

	wish->way = 0;
	if (device->config.axis[i].lead && speed != 0)
		wish->way = (float)way_of(device, i, wish->position, speed);
}

int32_t reference_ahead(const struct device *device, unsigned int i, const struct axis_wish *wish)
{
	const struct pokeys_axis *axis = &device->image.engine.axis[i];
	const double position = wish->position, way = (double)wish->way;
	const double furthest = intake_furthest(axis->mode);
	const double least = fmin(position, fmax(axis->soft_minimum, -furthest));
	const double most = fmax(position, fmin(axis->soft_maximum, furthest));

	return (int32_t)lround(fmin(fmax(position + way, least), most));
}

static void wanted_position(const struct device *device, unsigned int i, bool by_mask,
			    struct references *out)
{
	const struct axis_wish *wish = moving_axis_wish(device, i);
	const float max_speed = device->image.engine.axis[i].max_speed;
	const float room = axis_wish_moves_on(wish, device->now_ns) ? CATCH_UP : 1;
	const bool driven = device->motion.driven >> i & 1;

	out->position[i] = driven ? reference_ahead(device, i, wish) : device->motion.hold[i];
	out->velocity[i] = driven && by_mask ? ratio(room * wish->velocity, max_speed) : FULL_SPEED;
}

static void wanted(const struct device *device, struct references *out)
{
	const bool by_mask = reference_by_mask(device);

	memset(out, 0, sizeof(*out));
	out->mask = axes_told(device);
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		const uint8_t mode = device->image.engine.axis[i].mode;

		if (by_mask && !(out->mask >> i & 1))
			continue;
		if (mode == POKEYS_AXIS_POSITION)
			wanted_position(device, i, by_mask, out);
		else if (mode == POKEYS_AXIS_VELOCITY && device->motion.driven >> i & 1)
			out->position[i] = (int32_t)lroundf(device->intake.axis[i].velocity);
	}
}

static bool same(const struct references *a, const struct references *b)
{
	return a->mask == b->mask && !memcmp(a->position, b->position, sizeof(a->position)) &&
	       !memcmp(a->velocity, b->velocity, sizeof(a->velocity));
}

/* It stands, and not where it was told to; or it runs, and nobody knows how fast. */
static bool astray(const struct device *device)
{
	const struct motion *motion = &device->motion;

	if (device->now_ns - motion->reference_ns < AFFIRM_NS)
		return false;
	if (any_by_speed(device))
		return true;
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		const struct pokeys_axis *axis = &device->image.engine.axis[i];

		if (motion->driven >> i & 1 && axis->mode == POKEYS_AXIS_POSITION &&
		    axis->state == WIRE_AXIS_READY && axis->position != motion->acked.position[i])
			return true;
	}
	return false;
}

static void ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
		  uint64_t now_ns);

unsigned int reference_under_way(const struct device *device)
{
	return pipeline_open(device, ended);
}

/* They are on their way, and there is no reason to think that they are lost. */
static bool is_under_way(const struct device *device, const struct references *want)
{
	return pipeline_awaited(device, ended) && same(want, &device->motion.sent);
}

bool reference_due(const struct device *device)
{
	const struct motion *motion = &device->motion;
	struct references want;

	if ((motion->phase != MOTION_HOLD && motion->phase != MOTION_ON) ||
	    !pipeline_may(device, ended, false))
		return false;
	wanted(device, &want);
	if (!want.mask && !(motion->phase == MOTION_ON && any_by_speed(device)))
		return false;
	if (is_under_way(device, &want))
		return false;
	return !motion->known || !same(&want, &motion->acked) ||
	       (motion->phase == MOTION_ON && astray(device));
}

static void encode_pv(const struct references *r, struct wire_pulse_move_pv_req *out)
{
	memset(out, 0, sizeof(*out));
	out->mask = r->mask;
	memcpy(out->position, r->position, sizeof(out->position));
	memcpy(out->velocity, r->velocity, sizeof(out->velocity));
}

/* What the device was sent last, for those who look. */
static void show(struct device *device, const struct references *r)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		struct pokeys_axis *axis = &device->image.engine.axis[i];

		if (!(r->mask >> i & 1))
			continue;
		if (axis->reference != r->position[i])
			device->motion.settled &= (uint8_t)~(1u << i);
		axis->reference = r->position[i];
		axis->t_reference_ns = device->now_ns;
	}
}

static void settle(struct device *device, uint8_t axes)
{
	struct motion *motion = &device->motion;

	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		if (axes & ~motion->settled & 1u << i)
			motion->settled_ns[i] = device->now_ns;
	motion->settled |= axes;
}

static bool axis_stands(uint8_t state)
{
	return state == WIRE_AXIS_STOPPED || state == WIRE_AXIS_READY || state == WIRE_AXIS_HOME ||
	       state == WIRE_AXIS_PROBED || state == WIRE_AXIS_ERROR || state == WIRE_AXIS_LIMIT;
}

/* Seen by a status that was asked for when the device had the reference. */
bool reference_met(const struct device *device, unsigned int i)
{
	const struct motion *motion = &device->motion;
	const struct pokeys_axis *axis = &device->image.engine.axis[i];
	const bool newest = !(motion->driven >> i & 1) ||
			    axis->reference ==
				    reference_ahead(device, i, moving_axis_wish(device, i));

	return newest && motion->settled >> i & 1 && motion->status_ns >= motion->settled_ns[i] &&
	       axis_stands(axis->state) && axis->position == axis->reference;
}

static void refresh(pokeys_device_t *mailbox, mailbox_entry_t *entry, void *context)
{
	struct device *device = device_of(mailbox);
	struct wire_pulse_move_pv_req pv;
	struct wire_pulse_move_req move;
	struct references want;

	(void)context;
	wanted(device, &want);
	if (same(&want, &device->motion.sent) || entry->serial != device->motion.reference_sent)
		return;
	device->motion.reference_mixed = entry->serial;
	device->motion.known = false;
	device->motion.sent = want;
	show(device, &want);
	if (entry->request_buffer[WIRE_AT_P1] == SUB_MOVE_PV) {
		encode_pv(&want, &pv);
		wire_pulse_move_pv_encode_req(entry->request_buffer, &pv);
	} else {
		memcpy(move.reference, want.position, sizeof(move.reference));
		wire_pulse_move_encode_req(entry->request_buffer, &move);
	}
}

void reference_release(struct device *device)
{
	struct motion *motion = &device->motion;

	if (!motion->known || !motion->releasing)
		return;
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		if (motion->acked.mask & motion->sent.mask & 1u << i &&
		    motion->acked.position[i] == motion->hold[i] &&
		    motion->sent.position[i] == motion->hold[i])
			motion->releasing &= (uint8_t)~(1u << i);
	}
}

static void acknowledge(struct device *device)
{
	struct motion *motion = &device->motion;

	motion->acked = motion->sent;
	motion->known = true;
	motion->answered = false;
	/* the others have no newer one */
	settle(device, UINT8_MAX);
	reference_release(device);
}

void reference_forget(struct device *device)
{
	device->motion.known = false;
	device->motion.answered = false;
	device->motion.settled = 0;
}

static void ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
		  uint64_t now_ns)
{
	struct device *device = device_of(mailbox);
	struct motion *motion = &device->motion;

	(void)context;
	device->now_ns = now_ns;
	if (!answered(entry)) {
		/* an older one: the device may get it after the newest */
		if (entry->tries && entry->serial < motion->reference_sent)
			motion->reference_clear = mailbox->serial + 1;
		if (motion->reference_clear > motion->reference_taken)
			motion->answered = false;
	} else if (pipeline_take(device, entry, &motion->reference_taken)) {
		motion->known = false;
		motion->answered = entry->serial == motion->reference_sent &&
				   entry->serial != motion->reference_mixed &&
				   entry->serial >= motion->reference_clear;
	} else {
		reference_forget(device); /* it may have got this one last */
	}
	if (motion->answered && !pipeline_awaited(device, ended))
		acknowledge(device);
}

static bool send(struct device *device, const struct references *want)
{
	struct wire_pulse_move_pv_req pv;
	struct wire_pulse_move_req move;

	if (reference_by_mask(device)) {
		encode_pv(want, &pv);
		return pipeline_send(device, WIRE_OP_PULSE_MOVE_PV, &pv, ended, refresh);
	}
	memcpy(move.reference, want->position, sizeof(move.reference));
	return pipeline_send(device, WIRE_OP_PULSE_MOVE, &move, ended, refresh);
}

bool reference_send(struct device *device)
{
	struct motion *motion = &device->motion;
	const struct motion before = *motion;
	struct references want;

	if (!reference_due(device))
		return false;
	wanted(device, &want);
	motion->sent = want;
	motion->answered = false;
	motion->known = motion->known && same(&want, &motion->acked);
	motion->reference_sent = device->mailbox.serial + 1;
	motion->reference_ns = device->now_ns;
	if (!send(device, &want)) {
		/* older ones may have ended for want of room */
		const uint64_t clear = motion->reference_clear;
		*motion = before;
		motion->reference_clear = clear;
		motion->answered &= clear == before.reference_clear;
		return false;
	}
	show(device, &want);
	return true;
}
