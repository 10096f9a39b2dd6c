/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A device that was restarted counts from 0, and LinuxCNC goes by the position that it is
 * shown: it would believe the machine to be at 0, or, homed as before, send it to a
 * wrong place. The daemon reports each new count (axis.position_epoch); how long data were
 * stale says nothing, because a device can be back within one period.
 *
 * So pos-fb does not jump, but for a delay that was left out of it (joint.h): from then on
 * it is what the device counts, plus what was lost, and commands are taken back by the
 * same. Where the axis really stands nobody knows, its motor may have had no power. That
 * is what position-lost says, until the joint is homed: by the device (then its own count
 * is valid again), by LinuxCNC (motion-homed rises), or its position is set.
 *
 * A motion buffer that ran dry, a limit switch and the emergency input stop axes without a
 * ramp. The counts of those that moved are right, but their motors may have lost steps, so
 * that is a loss as well. Such stops are counted: the engine's state may be another one before
 * anybody reads it. So is an error of a motor's driver, which leaves the motor without
 * current, and another daemon than before: it cannot know what was while nobody looked.
 *
 * LinuxCNC takes an order to unhome a joint by an edge, and refuses it while the machine
 * does not stand. So unhome comes again and again until no such joint counts as homed.
 */
#include "halbridge/position.h"

#define UNHOME_NS	UINT64_C(250000000)	/* so long it is true, and then false */
#define ALARM_NS	UINT64_C(1000000000)
#define MOVED_NS	UINT64_C(100000000)	/* a stop so long afterwards is one with a ramp */

/* Homed in LinuxCNC's own way. */
static void acknowledge(struct position *position, bool homed)
{
	if (homed && !position->homed)
		position->lost = false;
	position->homed = homed;
}

/* The commander's own, or the device has homed it. */
static bool is_told(uint8_t epoch)
{
	return epoch & 1;
}

/* Returns true if the count is another than before. */
static bool judge(struct position *position, struct joint *joint, const struct pokeys_axis *axis)
{
	const bool anew = position->known &&
			  (position->restarted || axis->position_epoch != position->epoch);
	const bool told = is_told(axis->position_epoch) && !position->restarted;

	if (anew)
		joint_carry(joint, told ? 0 : joint->carry + position->shown - axis->position,
			    axis->position);
	if (anew)
		position->lost = !told;
	position->known = true;
	position->restarted = false;
	position->epoch = axis->position_epoch;
	position->shown = axis->position;
	return anew;
}

/* True for a while, false for a while, as long as it is wanted. */
static bool pulse(uint64_t *since_ns, bool wanted, uint64_t now_ns)
{
	if (!wanted)
		*since_ns = 0;
	else if (!*since_ns)
		*since_ns = now_ns;
	return wanted && (now_ns - *since_ns) / UNHOME_NS % 2 == 0;
}

/*
 * The driver of an axis that is enabled has an error, and not for one reading only. Many say
 * so when they are switched off, or have none when they are there before us.
 */
static bool judge_error(struct position *position, const struct pokeys_axis *axis, bool knew)
{
	if (!axis->error)
		position->errors = 0;
	else if (!knew || (!axis->enabled && !position->errors))
		position->errors = POSITION_ERRORS;
	else if (position->errors < POSITION_ERRORS)
		return ++position->errors == POSITION_ERRORS;
	return false;
}

/* The axis has lost steps, or may have: it was stopped without a ramp, or has no current. */
static bool judge_motor(struct position *position, const struct pokeys_axis *axis, bool knew,
			bool moved, bool stopped, uint64_t now_ns)
{
	const bool error = judge_error(position, axis, knew);

	if (moved)
		position->moved_ns = now_ns;
	if (axis->mode == POKEYS_AXIS_VELOCITY)
		return false;
	return error || (stopped && position->moved_ns && now_ns - position->moved_ns < MOVED_NS);
}

static void show(struct positions *positions, struct values *values, uint64_t now_ns)
{
	const bool lost_before = values->position_lost, unhome_before = values->unhome;
	bool unhome = false;

	values->position_lost = false;
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		const struct position *position = &positions->joint[i];

		if (values->joint[i].position_lost != position->lost)
			values_changed(values, BLOCK_JOINT);
		values->joint[i].position_lost = position->lost;
		values->position_lost |= position->lost;
		unhome |= position->lost && position->homed;
	}
	values->unhome = pulse(&positions->unhome_ns, unhome, now_ns);
	if (values->position_lost != lost_before || values->unhome != unhome_before)
		values_changed(values, BLOCK_MACHINE);
}

static void alarm(struct positions *positions, bool lost, bool machine_is_on, uint64_t now_ns)
{
	if (lost)
		positions->alarm_ns = now_ns;
	positions->alarm = lost || (positions->alarm &&
				    (machine_is_on || now_ns - positions->alarm_ns < ALARM_NS));
}

bool positions_read(struct positions *positions, struct joint joint[POKEYS_AXES],
		    struct values *values, const struct pokeys_engine *engine, bool fresh,
		    bool restarted, uint64_t now_ns)
{
	const bool dry = engine->buffer_underruns != positions->underruns &&
			 values->engine.dry_loses;
	const bool stopped = engine->stops != positions->stops && values->engine.dry_loses;
	bool anew = false, lost = false, knew, moved;

	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		struct position *position = &positions->joint[i];
		const struct pokeys_axis *axis = &engine->axis[i];

		position->restarted |= restarted;
		acknowledge(position, values->joint[i].motion_homed);
		if (!fresh)
			continue;
		/* as it is until its settings come, after the daemon or the device has begun */
		joint_hold(&joint[i], position->known && axis->mode == POKEYS_AXIS_OFF,
			   position->shown);
		if (axis->mode == POKEYS_AXIS_OFF)
			continue;
		knew = position->known;
		moved = knew && axis->position != position->shown;
		if (judge(position, &joint[i], axis)) {
			anew = true;
			lost |= position->lost;
		} else if (dry && knew && axis->mode == POKEYS_AXIS_BUFFERED) {
			lost = position->lost = true;
		}
		if (judge_motor(position, axis, knew, moved, stopped, now_ns))
			lost = position->lost = true;
	}
	alarm(positions, lost, values->machine_is_on, now_ns);
	if (fresh) {
		positions->underruns = engine->buffer_underruns;
		positions->stops = engine->stops;
	}
	show(positions, values, now_ns);
	return anew;
}
