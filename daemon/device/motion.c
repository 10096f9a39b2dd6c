/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The pulse engine's state: from permission to running and back (protocol
 * sections 3.24.3 and 5.3).
 *
 *	off --permitted, an axis is enabled--> hold --> start --> on
 *	 ^                                                         |
 *	 +---- permission gone, or the engine is not running ------+
 *
 * hold tells every axis to stay where it is before the engine may run: the
 * documents do not say what becomes of a reference from before. start asks
 * the engine to run; on means a status said that it does.
 *
 * The rule for the first move: from the edge of machine-on the references are
 * those of the newest command image, never one from before the edge. The
 * daemon adds no jump of its own; where the command stands then is the
 * commander's business, it is told the position all the time. While a position
 * is being set nobody knows it: the engine does not begin to run, nor an axis to
 * follow, before a status that was asked for afterwards.
 *
 * Off is not believed but seen: stop is sent, answered, and then a status
 * that was asked for after the answer must show the engine standing, or it is
 * sent again. So a late "run" that overtook the stop is caught too. An engine
 * that stops by itself takes the permission away with it, and one that has
 * tripped (100, 101) is left as it is until a commander clears the fault.
 *
 * Homing and probing (task.c) get the engine when it stands, and give it back
 * by having it stopped.
 */

#include <string.h>
#include "daemon/device/internal.h"

#define RUN_AGAIN_NS (20 * MS)

bool motion_drivable(const struct device *device, unsigned int axis)
{
	const uint8_t mode = device->image.engine.axis[axis].mode;

	return axis < device->image.engine.axes_enabled && mode != POKEYS_AXIS_OFF;
}

static bool has_engine(const struct device *device)
{
	return device->image.capability.pulse_engine >= 2;
}

/* A stop would also clear a trip, and that is the commander's to do. */
static bool stands(uint8_t state)
{
	return state == WIRE_ENGINE_STOPPED || engine_tripped(state);
}

bool motion_standing(const struct device *device)
{
	const struct motion *motion = &device->motion;

	if (!has_engine(device))
		return true;
	return motion->phase == MOTION_OFF && !motion->stop_wanted && !motion->stop_open &&
	       !motion->run_open && !device->task.open && !motion->verify &&
	       stands(device->image.engine.state);
}

void motion_begin(struct device *device)
{
	memset(&device->motion, 0, sizeof(device->motion));
	buffer_begin(device);
	device->motion.verify = true;
	device->motion.state_ended_ns = device->now_ns;
}

/* From now on these axes stay where they are; those that run by speed get speed 0. */
static void hold(struct device *device, uint8_t axes)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		const struct pokeys_axis *axis = &device->image.engine.axis[i];

		if (axes >> i & 1)
			device->motion.hold[i] = axis->mode == POKEYS_AXIS_VELOCITY ?
							 0 :
							 axis->position;
	}
}

/* The axes that are to follow the command. */
static uint8_t wished(const struct device *device)
{
	const struct motion *motion = &device->motion;
	uint8_t axes = 0;

	if (!device->safe.permitted)
		return 0;
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		const struct axis_wish *wish = &device->intake.axis[i];
		const bool was = motion->driven >> i & 1;

		if (wish->enable && (wish->good || was) && motion_drivable(device, i) &&
		    wish->mode == device->image.engine.axis[i].mode)
			axes |= (uint8_t)(1u << i);
	}
	axes &= (uint8_t)~device->task.parked;
	return axes & (uint8_t)~(one_shot_axes(device) & ~motion->driven);
}

static void enter_off(struct device *device)
{
	device->motion.phase = MOTION_OFF;
	device->motion.stop_wanted = !engine_tripped(device->image.engine.state);
	reference_forget(device);
}

uint8_t motion_masked(const struct device *device, uint8_t axes)
{
	uint8_t with_mask = 0;

	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		const struct setting *setting = &device->configure.setting[SETTING_AXIS + i];

		if (setting->value.axis.config.options & WIRE_AXIS_ENABLED_MASKED)
			with_mask |= (uint8_t)(1u << i);
	}
	return with_mask & axes;
}

/* The device drives its axes by itself soon: a stop switches their outputs on. */
static bool lacks_power(const struct device *device)
{
	return !device->task.powered && motion_masked(device, task_powers(device));
}

/*
 * An axis that stands on a limit switch can only be homed off it if the override holds
 * meanwhile: it goes with the stop before, and is taken away by the one behind.
 */
static bool override_wished(const struct device *device)
{
	return !task_idle(device) && device->safe.permitted && device->intake.limit_override;
}

static bool lacks_override(const struct device *device)
{
	return override_wished(device) && task_wants_stand(device) && !device->motion.override_sent;
}

/* Off, and everything that was asked of the engine is seen to be done. */
static void update_off(struct device *device, uint8_t axes)
{
	struct motion *motion = &device->motion;
	const uint8_t state = device->image.engine.state;

	if (motion->verify || motion->run_open || motion->stop_open || device->task.open ||
	    one_shot_axes(device) || configure_writing(device))
		return;
	motion->stop_wanted = !stands(state) || lacks_power(device) || lacks_override(device);
	if (stands(state))
		motion->releasing = 0;
	if (motion->stop_wanted || state != WIRE_ENGINE_STOPPED)
		return;
	if (task_take_engine(device)) {
		motion->phase = MOTION_TASK;
		return;
	}
	if (!axes || !task_idle(device))
		return;
	motion->phase = MOTION_HOLD;
	reference_forget(device);
	hold(device, UINT8_MAX);
}

static void update_on(struct device *device)
{
	const struct motion *motion = &device->motion;
	const uint8_t state = device->image.engine.state;

	if (motion->verify || motion->run_open || state == WIRE_ENGINE_RUNNING ||
	    (motion->phase != MOTION_ON && state == WIRE_ENGINE_STOPPED) ||
	    task_explains(device, state))
		return;
	/* by itself: a restart, of which nothing else may tell yet */
	if (!engine_tripped(state))
		plan_doubt(device);
	safe_permit_drop(device);
	enter_off(device);
}

static void update_phase(struct device *device, uint8_t axes)
{
	struct motion *motion = &device->motion;

	if (motion->phase != MOTION_OFF && (!device->safe.permitted || task_wants_stand(device))) {
		enter_off(device);
		return;
	}
	switch ((enum motion_phase)motion->phase) {
	case MOTION_OFF:
		update_off(device, axes);
		break;
	case MOTION_HOLD:
		if (((motion->known && !reference_due(device)) || !reference_any(device)) &&
		    buffer_ready(device))
			motion->phase = MOTION_START;
		update_on(device);
		break;
	case MOTION_START:
		update_on(device);
		if (motion->phase == MOTION_OFF || motion->verify || motion->run_open ||
		    device->image.engine.state != WIRE_ENGINE_RUNNING)
			break;
		motion->phase = MOTION_ON;
		reference_forget(device);
		break;
	case MOTION_ON:
		update_on(device);
		break;
	case MOTION_TASK:
		break;
	}
}

void motion_update(struct device *device)
{
	struct motion *motion = &device->motion;
	uint8_t axes, released;

	if (!has_engine(device))
		return;
	threading_update(device);
	task_update(device);
	update_phase(device, wished(device));
	axes = motion->phase == MOTION_ON ? wished(device) : 0;
	released = motion->driven & (uint8_t)~axes;
	hold(device, released);
	motion->releasing = (uint8_t)((motion->releasing | released) & ~axes &
				      ~buffer_axes(device));
	motion->driven = axes;
	reference_release(device);
	buffer_update(device);
}

static void state_ended(struct device *device, uint64_t now_ns)
{
	device->now_ns = now_ns;
	device->motion.verify = true;
	device->motion.state_ended_ns = now_ns;
}

void motion_displaced(struct device *device)
{
	state_ended(device, device->now_ns);
}

static void run_ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
		      uint64_t now_ns)
{
	struct device *device = device_of(mailbox);

	(void)entry;
	(void)context;
	state_ended(device, now_ns);
	place_moves(device);
	device->motion.run_open = false;
	device->motion.run_after_ns = now_ns + RUN_AGAIN_NS;
	reference_forget(device);
}

static void stop_ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
		       uint64_t now_ns)
{
	struct device *device = device_of(mailbox);

	(void)context;
	state_ended(device, now_ns);
	device->motion.stop_open = false;
	if (!answered(entry))
		return;
	device->motion.stop_wanted = false; /* until a status says otherwise */
	task_powered(device, device->motion.mask_stopped);
}

void motion_status(struct device *device, uint64_t asked_ns)
{
	if (asked_ns >= device->motion.state_ended_ns)
		device->motion.verify = false;
}

static bool send_stop(struct device *device)
{
	const struct wire_pulse_state_req stop = {
		.state = WIRE_ENGINE_STOPPED,
		.enable_mask = motion_masked(device, task_powers(device)),
		.limit_override = override_wished(device),
	};
	struct motion *motion = &device->motion;

	if (!motion->stop_wanted || motion->stop_open ||
	    (!motion->verify && device->image.engine.state == WIRE_ENGINE_STOPPING))
		return false;
	motion->stop_open = request_send(device, WIRE_OP_PULSE_STATE, &stop, stop_ended, NULL,
					 NULL);
	motion->mask_stopped = stop.enable_mask;
	motion->override_sent = stop.limit_override;
	return motion->stop_open;
}

static bool send_run(struct device *device)
{
	struct motion *motion = &device->motion;
	const struct wire_pulse_state_req run = {
		.state = WIRE_ENGINE_RUNNING,
		.limit_override = device->intake.limit_override,
		.enable_mask = motion_masked(device, wished(device)),
	};

	motion->run_open = request_send(device, WIRE_OP_PULSE_STATE, &run, run_ended, NULL, NULL);
	motion->mask_sent = run.enable_mask;
	motion->override_sent = run.limit_override;
	return motion->run_open;
}

static bool run_due(const struct device *device)
{
	const struct motion *motion = &device->motion;

	if (motion->run_open || motion->verify || device->now_ns < motion->run_after_ns)
		return false;
	if (motion->phase == MOTION_START)
		return device->image.engine.state == WIRE_ENGINE_STOPPED;
	return motion->phase == MOTION_ON &&
	       (motion_masked(device, wished(device)) != motion->mask_sent ||
		device->intake.limit_override != motion->override_sent);
}

bool motion_send_state(struct device *device)
{
	if (!has_engine(device))
		return false;
	if (device->motion.phase == MOTION_OFF)
		return send_stop(device);
	return task_send(device) || (run_due(device) && send_run(device));
}
