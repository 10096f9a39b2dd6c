/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Where the axes are, and whether the device still counts from the same zero.
 *
 * A device that was restarted counts from 0, and may answer again within a
 * millisecond. Another one in its place, another client that sets a counter, a
 * pulse engine that was set up anew: each leaves positions that look like any other
 * and are wrong by the length of the machine. So whether a position is valid does not
 * depend on how long a silence was. Each status is compared with the one before: no
 * axis moves faster than it can, and none moves at all while the engine stands. A
 * position that cannot be is not taken, and the device is asked at once whether it is
 * still the same start (restart.c); meanwhile it gets only questions. If it is, and goes on
 * saying so, somebody else has set that position.
 *
 * axis[].position_epoch changes each time, in the image with the first position of the
 * new count, and tells whether the commander knows of it:
 * it is even when the count began anew by itself, odd when the commander has set the
 * position or the device has homed the axis. A commander that homes in another way, as
 * LinuxCNC's motion does, has to remember by itself.
 *
 * One status may be damaged (its payload has no checksum), so three in a row must say
 * the same. The slack is for the device's clock, which is not ours.
 */

#include <math.h>
#include <string.h>
#include "daemon/device/internal.h"

enum {
	ALIKE = 3,         /* readings in a row that say the same odd thing */
	UNLIKE = 50,       /* ... or each another: they are taken, or none ever would be */
	SLACK = 8,         /* pulses */
	KHZ_DEFAULT = 125, /* of the generator, until it has said it */
};

#define GAP_NS (20 * MS)	/* without a status for so long, an axis may be anywhere */
#define STOOD_NS (100 * MS)	/* so long still, no pulse can be on its way any more */
#define HURRY 1.25		/* clocks, and rounding of the highest speed */

static bool stands(uint8_t state)
{
	return state == WIRE_ENGINE_STOPPED || engine_tripped(state);
}

/* Pulses that this axis makes at most in a millisecond. */
static double fastest(const struct device *device, unsigned int i)
{
	const struct pokeys_axis *axis = &device->image.engine.axis[i];
	const double khz = device->image.capability.axis_khz ? device->image.capability.axis_khz :
							       KHZ_DEFAULT;
	const double own = (double)axis->max_speed / 1e3;

	return axis->mode != POKEYS_AXIS_POSITION || !(own > 0) || own > khz ? khz : own;
}

/* As they were set up before: an engine that was just restarted has no axes yet. */
static uint8_t set_up(const struct device *device)
{
	uint8_t axes = 0;

	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		axes |= (uint8_t)((device->image.engine.axis[i].mode != POKEYS_AXIS_OFF) << i);
	return axes;
}

/* The axes of which the two readings cannot be of one count. */
static uint8_t apart(const struct device *device, const struct place_reading *before,
		     const struct place_reading *now)
{
	const uint64_t first = before->asked_ns < now->asked_ns ? before->asked_ns : now->asked_ns;
	const uint64_t last = before->came_ns > now->came_ns ? before->came_ns : now->came_ns;
	const double ms = (double)(last - first + before->slept_ns) / 1e6;
	const uint8_t both = before->axes & now->axes & set_up(device);
	uint8_t axes = 0;

	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		const int32_t way = (int32_t)((uint32_t)now->position[i] -
					      (uint32_t)before->position[i]);
		const double most = before->stood && now->stood ?
					    0 :
					    fastest(device, i) * HURRY * ms + SLACK;

		if (both >> i & 1 && fabs((double)way) > most)
			axes |= (uint8_t)(1u << i);
	}
	return axes;
}

/* ... or for as long as plan.c would, but for not less than three answers. */
static uint64_t gap_ns(const struct device *device)
{
	const uint64_t usual = plan_answers_ns(device, PLAN_GAP);
	const uint64_t least = plan_answers_ns(device, 3);

	return usual < GAP_NS ? usual : least > GAP_NS ? least : GAP_NS;
}

/*
 * After a silence an axis may be anywhere that it could have gone to, so nothing but the
 * device's clock tells whether it is still the same count. The silence ends with the answer:
 * its question may have been resent for as long.
 */
static bool is_uncertain(const struct device *device, const struct place_reading *now)
{
	const struct place_reading *last = &device->place.last;
	const uint8_t both = last->axes & now->axes & set_up(device);
	const uint64_t gap = gap_ns(device), since = last->came_ns + gap;
	const uint64_t judged = now->came_ns > since ? now->came_ns - gap : last->came_ns;

	if (!running(device) || now->came_ns + last->slept_ns < since ||
	    (restart_judged(device, judged) && !plan_doubts(device)))
		return false;
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		if (both >> i & 1 && now->position[i] != last->position[i])
			return true;
	return false;
}

/* Axes that the device is homing. */
static uint8_t homing(const struct device *device)
{
	const struct pokeys_engine *engine = &device->image.engine;

	return !task_idle(device) && engine->task == POKEYS_TASK_HOMING ? engine->task_axes : 0;
}

/* Axes whose position is being set: it was sent, and no status has shown it. */
static uint8_t being_set(const struct device *device)
{
	return device->one_shots.acted ? one_shot_axes(device) & (uint8_t)~device->place.known : 0;
}

/* Axes that have been told where they are since the last reading, or are just being told. */
static uint8_t told(const struct device *device)
{
	uint8_t axes = being_set(device) | (homing(device) & (uint8_t)~device->place.arrived);

	if (device->place.last.asked_ns <= device->place.told_ns)
		axes |= device->place.told;
	return axes;
}

/* With the first position of the new count, not before: who reads both reads them together. */
static void change_epoch(struct device *device)
{
	struct place *place = &device->place;

	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		struct pokeys_axis *axis = &device->image.engine.axis[i];
		const uint8_t epoch = axis->position_epoch;

		if (place->known >> i & 1)
			axis->position_epoch = (uint8_t)((epoch + 1) | 1);
		else if (place->lost >> i & 1)
			axis->position_epoch = (uint8_t)((epoch | 1) + 1);
		if (place->known & place->homed & (1u << i))
			axis->homed = 1;
	}
	place->known = place->lost = place->homed = 0;
}

/* Axes that the device has just homed: this status is the first that counts from there. */
static uint8_t arrived(const struct device *device, const struct wire_pulse_status_rep *status)
{
	uint8_t axes = 0;

	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		if (status->axis_state[i] == WIRE_AXIS_HOME &&
		    device->image.engine.axis[i].state != WIRE_AXIS_HOME)
			axes |= (uint8_t)(1u << i);
	return axes & homing(device);
}

/* Axes that are being homed and count from the edge of their switch already. */
static uint8_t counts_from_edge(const struct device *device,
				const struct wire_pulse_status_rep *status)
{
	uint8_t axes = 0;

	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		if (status->axis_state[i] == WIRE_AXIS_HOMING_RESETTING ||
		    status->axis_state[i] == WIRE_AXIS_HOMING_BACKING_OFF)
			axes |= (uint8_t)(1u << i);
	return axes & homing(device);
}

/* How far the homing of axes is, as this status tells. */
static void follow_homing(struct device *device, const struct wire_pulse_status_rep *status)
{
	struct place *place = &device->place;
	const uint8_t homed = arrived(device, status);

	place->jumped |= counts_from_edge(device, status);
	place->arrived |= homed;
	place->homed |= homed & (uint8_t)~place->lost;
	place->known |= homed & (uint8_t)~place->lost;
}

static void believe(struct device *device, const struct place_reading *now,
		    const struct wire_pulse_status_rep *status)
{
	device->place.last = *now;
	device->place.alike = device->place.unlike = 0;
	follow_homing(device, status);
	change_epoch(device);
}

/* These axes have jumped, and we know that they were being told where they are. */
static bool take_jump(struct device *device, uint8_t axes)
{
	struct place *place = &device->place;
	uint8_t lost;

	if (axes & being_set(device))
		return false; /* its outcome says as what to take it */
	place->jumped |= axes;
	/* ... or it was said to have failed */
	lost = axes & (uint8_t)~(homing(device) | place->known | place->lost);
	if (lost)
		place_lost(device, lost, PLACE_NOT_HOMED);
	return true;
}

static void read(struct device *device, const struct wire_pulse_status_rep *status,
		 uint64_t asked_ns, uint64_t came_ns, struct place_reading *now)
{
	struct place *place = &device->place;

	if (!stands(status->engine_state))
		place->moved_ns = came_ns;
	*now = (struct place_reading){
		.axes = UINT8_MAX,
		.asked_ns = asked_ns,
		.came_ns = came_ns,
		.stood = asked_ns > place->moved_ns && asked_ns - place->moved_ns >= STOOD_NS,
	};
	memcpy(now->position, status->position, sizeof(now->position));
}

bool place_take(struct device *device, const struct wire_pulse_status_rep *status,
		uint64_t asked_ns, uint64_t came_ns)
{
	struct place *place = &device->place;
	struct place_reading now;
	uint8_t axes, excused;

	read(device, status, asked_ns, came_ns, &now);
	/* of before the count changed: with which it would be shown as one of the new count */
	if (asked_ns <= place->changed_ns)
		return false;
	if (is_uncertain(device, &now)) {
		if (restart_clock_known(device)) {
			plan_doubt(device);
			return false;
		}
		place_lost(device, UINT8_MAX, PLACE_NO_CLOCK);
	}
	axes = apart(device, &place->last, &now);
	excused = axes & told(device);
	axes &= (uint8_t)~excused;
	if (!axes && !take_jump(device, excused))
		return false;
	if (!axes) {
		believe(device, &now, status);
		return true;
	}
	if (!place->alike || apart(device, &place->odd, &now))
		place->alike = 0;
	if (!place->alike++ && place->unlike < UNLIKE)
		plan_doubt(device);
	place->odd = now;
	if (place->unlike < UNLIKE)
		place->unlike++;
	if ((place->alike < ALIKE && place->unlike < UNLIKE) || plan_doubts(device))
		return false;
	place_lost(device, axes | (excused & (uint8_t)~place->known), PLACE_SET_ELSEWHERE);
	believe(device, &now, status);
	return true;
}

void place_moves(struct device *device)
{
	device->place.moved_ns = device->now_ns;
}

void place_told(struct device *device, uint8_t axes)
{
	struct place *place = &device->place;

	/* no reading since: axes told before that are not seen yet, either */
	if (place->last.asked_ns > place->told_ns)
		place->told = 0;
	place->told |= axes;
	place->told_ns = device->now_ns;
}

bool place_set(struct device *device, uint8_t axes, const mailbox_entry_t *entry)
{
	struct place *place = &device->place;
	const uint8_t lost = place->lost;

	place_told(device, axes);
	/* whatever has come between: an axis that stands is where it was said to be */
	place->known |= axes;
	place->lost &= (uint8_t)~axes;
	if (place->changed_ns < entry->timestamp_first_sent)
		place->changed_ns = entry->timestamp_first_sent - 1;
	if (decode_status(device, entry))
		return true;
	place->known &= (uint8_t)~axes;
	place->lost |= lost;
	return false;
}

void place_homing(struct device *device, uint8_t axes)
{
	device->place.arrived &= (uint8_t)~axes;
	device->place.jumped &= (uint8_t)~axes;
}

void place_homed(struct device *device, uint8_t axes)
{
	struct place *place = &device->place;
	const uint8_t missed = axes & (uint8_t)~place->arrived;

	place->jumped &= (uint8_t)~axes;
	place->arrived &= (uint8_t)~axes;
	if (!missed)
		return;
	place_told(device, missed);
	/* a restart since then has taken it away again */
	place->known |= missed & (uint8_t)~place->lost;
	place->homed |= missed & (uint8_t)~place->lost;
	place->changed_ns = device->now_ns;
}

void place_not_homed(struct device *device, uint8_t axes)
{
	struct place *place = &device->place;
	const uint8_t lost = running(device) ? axes & (place->jumped | place->arrived) : axes;

	place_told(device, axes);
	place->jumped &= (uint8_t)~axes;
	place->arrived &= (uint8_t)~axes;
	if (lost)
		place_lost(device, lost, PLACE_NOT_HOMED);
}

/* An axis may have gone on, as in any silence. */
void place_slept(struct device *device, uint64_t slept_ns)
{
	device->place.last.slept_ns += slept_ns + SLEPT_BLUR_NS;
}

void place_lost(struct device *device, uint8_t axes, enum place_loss why)
{
	device->place.lost |= axes;
	device->place.known &= (uint8_t)~axes;
	device->place.homed &= (uint8_t)~axes;
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		if (axes >> i & 1)
			device->image.engine.axis[i].homed = 0;
	if (why == PLACE_RESTART || why == PLACE_NO_CLOCK)
		decode_encoders_anew(device);
	if (why != PLACE_SET_ELSEWHERE) {
		device->place.last.axes &= (uint8_t)~axes;
		device->place.changed_ns = device->now_ns;
	}
	if (!(axes & set_up(device)))
		return;
	device_say(device, EVENT_POSITION_LOST, EVENT_WARNING, axes & set_up(device), why, 0);
	safe_permit_drop(device);
}

/* Back again: is it known that it counts from the same zero? */
void place_begin(struct device *device)
{
	if (device->place.ran && !restart_clock_known(device))
		place_lost(device, UINT8_MAX, PLACE_NO_CLOCK);
	device->place.ran = true;
	device->place.told = device->place.jumped = 0;
}
