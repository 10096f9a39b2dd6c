/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What each one-shot does on the wire, and what can be read back when its
 * answer did not come.
 *
 * Setting a position moves the coordinates under whatever follows them. So it
 * is refused for an axis that is driven, is just being released, or moves;
 * and where only 0x20 can be used, which tells all axes where to be, while
 * the engine is on at all. The axis stands then, which is why reading the
 * position back tells for certain whether it was set. It is read back in any case: the
 * outcome comes in one image with the position and its epoch.
 */

#include <string.h>
#include "daemon/device/internal.h"

#define SAVE_NS (3 * SECOND)	/* flash; protocol section 5.4 has no figure, others wait 1 s */
#define SAVE_AGAIN_NS (2 * SECOND)	/* each save wears the flash */
#define LOOKS 8		/* at a position, until a status that shows it is believed */

static void simply_done(struct device *device, const mailbox_entry_t *entry)
{
	(void)entry;
	one_shot_end(device, POKEYS_OUTCOME_DONE);
}

static void next_step(struct device *device)
{
	device->one_shots.step++;
	device->one_shots.phase = ONE_SHOT_NEXT;
}

static bool ask_status(struct device *device)
{
	static const struct wire_pulse_status_req request;

	return one_shot_request(device, WIRE_OP_PULSE_STATUS, &request);
}

static struct refusal needs_machine_off(const struct device *device,
					const struct pokeys_one_shot *shot)
{
	const bool off = !device->safe.permitted && motion_standing(device) &&
			 servoing_standing(device);

	(void)shot;
	return refusal(off ? REFUSAL_NONE : REFUSAL_MACHINE_ON, 0);
}

struct refusal operation_needs_engine(const struct device *device,
				      const struct pokeys_one_shot *shot)
{
	(void)shot;
	return refusal(device->image.capability.pulse_engine >= 2 ? REFUSAL_NONE :
								    REFUSAL_NO_ENGINE,
		       0);
}

/* Set position. */

static struct refusal why_not_axis(const struct device *device, unsigned int i, int32_t position)
{
	const uint8_t state = device->image.engine.axis[i].state;
	const uint8_t busy = device->motion.driven | device->motion.releasing;

	if (i >= device->image.capability.axes)
		return refusal(REFUSAL_AXIS_ABSENT, i);
	if (position < -(INT32_C(1) << 24) || position > INT32_C(1) << 24)
		return refusal(REFUSAL_POSITION, i);
	if (busy >> i & 1 ||
	    (state != WIRE_AXIS_STOPPED && state != WIRE_AXIS_READY && state != WIRE_AXIS_HOME &&
	     state != WIRE_AXIS_LIMIT && state != WIRE_AXIS_ERROR))
		return refusal(REFUSAL_AXIS_DRIVEN, i);
	return refusal(REFUSAL_NONE, 0);
}

static struct refusal why_not_position(const struct device *device,
				       const struct pokeys_one_shot *shot)
{
	struct refusal why = operation_needs_engine(device, shot);

	if (why.reason)
		return why;
	if (!shot->mask)
		return refusal(REFUSAL_NO_AXIS, 0);
	if (!task_idle(device))
		return refusal(REFUSAL_BUSY, 0);
	if (device->motion.phase != MOTION_OFF && !reference_by_mask(device))
		return refusal(REFUSAL_ENGINE_ON, 0);
	for (unsigned int i = 0; i < POKEYS_AXES && !why.reason; i++)
		if (shot->mask >> i & 1)
			why = why_not_axis(device, i, shot->value[i]);
	return why;
}

static bool position_send(struct device *device)
{
	const struct pokeys_one_shot *shot = &device->one_shots.now;
	struct wire_pulse_positions_req set = { .mask = shot->mask };
	struct refusal why;

	if (device->one_shots.step)
		return ask_status(device);
	if (device->motion.phase == MOTION_HOLD || device->motion.phase == MOTION_START)
		return false; /* it will soon be known which axes follow */
	why = why_not_position(device, shot);
	if (why.reason) {
		one_shot_refuse(device, why);
		return false;
	}
	memcpy(set.position, shot->value, sizeof(set.position));
	return one_shot_request(device, WIRE_OP_PULSE_POSITIONS, &set);
}

static bool positions_are(const struct pokeys_one_shot *shot, const mailbox_entry_t *entry)
{
	struct wire_pulse_status_rep status;

	wire_pulse_status_decode_rep(entry->response_buffer, &status);
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		if (shot->mask >> i & 1 && status.position[i] != shot->value[i])
			return false;
	}
	return true;
}

static void position_answered(struct device *device, const mailbox_entry_t *entry)
{
	const struct pokeys_one_shot *shot = &device->one_shots.now;

	if (!device->one_shots.step) {
		next_step(device);
		return;
	}
	if (!positions_are(shot, entry)) {
		one_shot_end(device, POKEYS_OUTCOME_FAILED);
		return;
	}
	/* not while it is uncertain what another axis shows */
	if (!place_set(device, shot->mask, entry)) {
		if (device->one_shots.step < LOOKS)
			next_step(device);
		else
			one_shot_end(device, POKEYS_OUTCOME_UNKNOWN);
		return;
	}
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		if (shot->mask >> i & 1)
			device->image.engine.axis[i].reference = shot->value[i];
	}
	one_shot_end(device, POKEYS_OUTCOME_DONE);
}

/* Clear fault. */

static bool clear_send(struct device *device)
{
	static const struct wire_pulse_state_req stop = { .state = WIRE_ENGINE_STOPPED };

	if (device->one_shots.step)
		return ask_status(device);
	if (!engine_tripped(device->image.engine.state)) {
		one_shot_end(device, POKEYS_OUTCOME_DONE);
		return false;
	}
	return one_shot_request(device, WIRE_OP_PULSE_STATE, &stop);
}

static void clear_answered(struct device *device, const mailbox_entry_t *entry)
{
	struct wire_pulse_status_rep status;

	if (!device->one_shots.step) {
		next_step(device);
		return;
	}
	wire_pulse_status_decode_rep(entry->response_buffer, &status);
	one_shot_end(device, engine_tripped(status.engine_state) ? POKEYS_OUTCOME_FAILED :
								   POKEYS_OUTCOME_DONE);
}

/* Counters, flash, clock, reboot: nothing of them can be read back. */

static struct refusal why_not_counters(const struct device *device,
				       const struct pokeys_one_shot *shot)
{
	(void)shot;
	return refusal(device->image.capability.digital_counters ? REFUSAL_NONE :
								   REFUSAL_NO_COUNTERS,
		       0);
}

static bool counters_send(struct device *device)
{
	return one_shot_request(device, WIRE_OP_COUNTER_RESET, NULL);
}

bool operation_saved_just_now(const struct device *device)
{
	const uint64_t saved_ns = device->one_shots.saved_ns;

	return saved_ns && device->now_ns - saved_ns < SAVE_AGAIN_NS;
}

static struct refusal why_not_save(const struct device *device, const struct pokeys_one_shot *shot)
{
	if (operation_saved_just_now(device))
		return refusal(REFUSAL_SAVED_JUST_NOW, 0);
	return needs_machine_off(device, shot);
}

/* It was allowed when it was taken; the machine may have been switched on since then. */
static bool still_off(struct device *device)
{
	const struct refusal why = needs_machine_off(device, &device->one_shots.now);

	if (why.reason)
		one_shot_refuse(device, why);
	return !why.reason;
}

static bool save_send(struct device *device)
{
	static const struct wire_confirm_req confirmed = WIRE_CONFIRMED;

	if (!still_off(device))
		return false;
	if (!one_shot_request_patiently(device, WIRE_OP_SAVE, &confirmed, SAVE_NS))
		return false;
	device->life.patient_until_ns = device->now_ns + SAVE_NS;
	device->one_shots.saved_ns = device->now_ns;
	return true;
}

static void save_answered(struct device *device, const mailbox_entry_t *entry)
{
	device->life.patient_until_ns = 0;
	device->one_shots.saved_ns = device->now_ns;
	simply_done(device, entry);
}

static bool within(int32_t value, int32_t low, int32_t high)
{
	return value >= low && value <= high;
}

static struct refusal why_not_clock(const struct device *device, const struct pokeys_one_shot *shot)
{
	const int32_t *v = shot->value;
	bool good;

	(void)device;
	good = within(v[0], 2000, 2199) && within(v[1], 1, 12) && within(v[2], 1, 31) &&
	       within(v[3], 0, 23) && within(v[4], 0, 59) && within(v[5], 0, 59) &&
	       within(v[6], 0, 6) && within(v[7], 0, 366);
	return refusal(good ? REFUSAL_NONE : REFUSAL_VALUE, 0);
}

static bool clock_send(struct device *device)
{
	const int32_t *v = device->one_shots.now.value;
	const struct wire_rtc_req set = {
		.option = WIRE_RTC_SET,
		.year = (uint16_t)v[0],
		.month = (uint8_t)v[1],
		.day = (uint8_t)v[2],
		.hour = (uint8_t)v[3],
		.minute = (uint8_t)v[4],
		.second = (uint8_t)v[5],
		.weekday = (uint8_t)v[6],
		.yearday = (uint16_t)v[7],
	};

	return one_shot_request(device, WIRE_OP_RTC, &set);
}

static bool reboot_send(struct device *device)
{
	return still_off(device) && one_shot_request(device, WIRE_OP_REBOOT, NULL);
}

/* Faster than its clock would tell: all is to be read anew. */
static void reboot_answered(struct device *device, const mailbox_entry_t *entry)
{
	device->life.rebooted = device->life.began = true;
	simply_done(device, entry);
}

const struct operation *operation_find(uint8_t operation)
{
	static const struct operation nop;
	static const struct operation set_position = {
		.why_not = why_not_position,
		.send = position_send,
		.answered = position_answered,
		.unknown = next_step,
	};
	static const struct operation clear_fault = {
		.why_not = operation_needs_engine,
		.send = clear_send,
		.answered = clear_answered,
		.unknown = next_step,
	};
	static const struct operation reset_counters = {
		.why_not = why_not_counters,
		.send = counters_send,
		.answered = simply_done,
	};
	static const struct operation save_config = {
		.why_not = why_not_save,
		.send = save_send,
		.answered = save_answered,
	};
	static const struct operation set_rtc = {
		.why_not = why_not_clock,
		.send = clock_send,
		.answered = simply_done,
	};
	static const struct operation reboot = {
		.why_not = needs_machine_off,
		.send = reboot_send,
		.answered = reboot_answered,
	};
	static const struct operation *const offered[] = {
		[POKEYS_ONE_SHOT_NOP] = &nop,
		[POKEYS_ONE_SHOT_SET_ENCODER] = &operation_set_encoder,
		[POKEYS_ONE_SHOT_ARM_INDEX] = &operation_arm_index,
		[POKEYS_ONE_SHOT_SET_POSITION] = &set_position,
		[POKEYS_ONE_SHOT_CLEAR_FAULT] = &clear_fault,
		[POKEYS_ONE_SHOT_HOME] = &operation_home,
		[POKEYS_ONE_SHOT_HOME_CANCEL] = &operation_home_cancel,
		[POKEYS_ONE_SHOT_HOME_FINISH] = &operation_home_finish,
		[POKEYS_ONE_SHOT_PROBE] = &operation_probe,
		[POKEYS_ONE_SHOT_PROBE_FINISH] = &operation_probe_finish,
		[POKEYS_ONE_SHOT_RESET_COUNTERS] = &reset_counters,
		[POKEYS_ONE_SHOT_SAVE_CONFIG] = &save_config,
		[POKEYS_ONE_SHOT_SET_RTC] = &set_rtc,
		[POKEYS_ONE_SHOT_REBOOT] = &reboot,
		[POKEYS_ONE_SHOT_JOG] = &operation_jog,
		[POKEYS_ONE_SHOT_JOG_END] = &operation_jog_end,
		[POKEYS_ONE_SHOT_THREAD_PREPARE] = &operation_thread_begin,
		[POKEYS_ONE_SHOT_THREAD_FORCE] = &operation_thread_begin,
		[POKEYS_ONE_SHOT_THREAD_ARM] = &operation_thread_arm,
		[POKEYS_ONE_SHOT_THREAD_RELEASE] = &operation_thread_release,
		[POKEYS_ONE_SHOT_THREAD_CANCEL] = &operation_thread_cancel,
		[POKEYS_ONE_SHOT_HEATER_RESET] = &operation_heater_reset,
		[POKEYS_ONE_SHOT_HEATER_TUNE] = &operation_heater_tune,
		[POKEYS_ONE_SHOT_SERVO_RESET] = &operation_servo_reset,
		[POKEYS_ONE_SHOT_SERVO_PLACE] = &operation_servo_place,
		[POKEYS_ONE_SHOT_HEATER_GAIN] = &operation_heater_gain,
		[POKEYS_ONE_SHOT_SERVO_GAIN] = &operation_servo_gain,
		[POKEYS_ONE_SHOT_SERVO_HOME] = &operation_servo_home,
		[POKEYS_ONE_SHOT_MOVE] = &operation_move,
		[POKEYS_ONE_SHOT_MOVES_CONTROL] = &operation_moves_control,
		[POKEYS_ONE_SHOT_SERVO_TUNE] = &operation_servo_tune,
	};

	return operation < sizeof(offered) / sizeof(offered[0]) ? offered[operation] : NULL;
}
