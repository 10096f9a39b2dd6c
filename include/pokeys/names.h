/* SPDX-License-Identifier: MIT */
/*
 * Words for the numbers in the images: short, stable, for people and for
 * scripts. An unknown number is "unknown", never NULL. Any thread, realtime.
 */
#ifndef POKEYS_NAMES_H
#define POKEYS_NAMES_H

#include <stddef.h>
#include <pokeys/settings.h>
#include <pokeys/state.h>

#ifdef __cplusplus
extern "C" {
#endif

/* clang-format off: a number and its word in each line */
/* enum pokeys_link */
static inline const char *pokeys_link_name(uint8_t link)
{
	switch (link) {
	case POKEYS_LINK_SEARCHING:
		return "searching";
	case POKEYS_LINK_IDENTIFYING:
		return "identifying";
	case POKEYS_LINK_CONFIGURING:
		return "configuring";
	case POKEYS_LINK_RUNNING:
		return "running";
	case POKEYS_LINK_LOST:
		return "lost";
	default:
		return "unknown";
	}
}

/* enum pokeys_fault */
static inline const char *pokeys_fault_name(uint8_t fault)
{
	switch (fault) {
	case POKEYS_FAULT_NONE:
		return "none";
	case POKEYS_FAULT_NO_ADDRESS:
		return "no address";
	case POKEYS_FAULT_NO_ANSWER:
		return "no answer";
	case POKEYS_FAULT_WRONG_SERIAL:
		return "wrong serial number";
	case POKEYS_FAULT_UNSUPPORTED:
		return "unsupported device";
	case POKEYS_FAULT_CONFIG_REFUSED:
		return "setting refused";
	case POKEYS_FAULT_LOCKED:
		return "configuration locked";
	case POKEYS_FAULT_REBOOTED:
		return "rebooted";
	case POKEYS_FAULT_NETWORK:
		return "network unreachable";
	case POKEYS_FAULT_IN_USE:
		return "in use";
	case POKEYS_FAULT_SUSPENDED:
		return "computer was suspended";
	default:
		return "unknown";
	}
}

/* enum pokeys_phase_state */
static inline const char *pokeys_phase_name(uint8_t phase)
{
	switch (phase) {
	case POKEYS_PHASE_OFF:
		return "off";
	case POKEYS_PHASE_FREE:
		return "free";
	case POKEYS_PHASE_UNFIT:
		return "unfit";
	case POKEYS_PHASE_SEEKING:
		return "seeking";
	case POKEYS_PHASE_LOCKED:
		return "locked";
	default:
		return "unknown";
	}
}

/* enum pokeys_setting */
static inline const char *pokeys_setting_name(uint8_t setting)
{
	switch (setting) {
	case POKEYS_SETTING_NONE:
		return "none";
	case POKEYS_SETTING_PIN:
		return "pin function";
	case POKEYS_SETTING_ENCODER:
		return "encoder";
	case POKEYS_SETTING_ENCODER_PINS:
		return "encoder pins";
	case POKEYS_SETTING_FAST_ENCODERS:
		return "fast encoders";
	case POKEYS_SETTING_ULTRA_FAST:
		return "ultra-fast encoder";
	case POKEYS_SETTING_ENGINE:
		return "pulse engine";
	case POKEYS_SETTING_EMERGENCY:
		return "emergency pin";
	case POKEYS_SETTING_AXIS:
		return "axis";
	case POKEYS_SETTING_PWM:
		return "PWM period";
	case POKEYS_SETTING_ANALOG_FILTER:
		return "analog filter";
	case POKEYS_SETTING_FAILSAFE:
		return "failsafe";
	case POKEYS_SETTING_MATRIX:
		return "matrix keyboard";
	case POKEYS_SETTING_NAME:
		return "name";
	case POKEYS_SETTING_POEXTBUS:
		return "PoExtBus";
	case POKEYS_SETTING_BACKLASH:
		return "backlash";
	case POKEYS_SETTING_POSTEP:
		return "PoStep";
	case POKEYS_SETTING_POSTEP_MODES:
		return "PoStep driver";
	case POKEYS_SETTING_SYNC_PWM:
		return "synced PWM";
	case POKEYS_SETTING_SYNC_OUTPUTS:
		return "synced outputs";
	case POKEYS_SETTING_THREADING:
		return "threading";
	default:
		return "unknown";
	}
}

/* State of an axis, protocol section 3.24.1 */
static inline const char *pokeys_axis_state_name(uint8_t state)
{
	switch (state) {
	case 0:
		return "stopped";
	case 1:
		return "ready";
	case 2:
		return "running";
	case 5:
		return "buffer";
	case 8:
		return "homing resetting";
	case 9:
		return "homing backing off";
	case 10:
		return "home";
	case 11:
		return "homing start";
	case 12:
		return "homing search";
	case 13:
		return "homing back";
	case 14:
		return "probed";
	case 15:
		return "probe start";
	case 16:
		return "probe search";
	case 20:
		return "error";
	case 30:
		return "limit";
	default:
		return "unknown";
	}
}

/* State of the pulse engine, protocol section 3.24.1 */
static inline const char *pokeys_engine_state_name(uint8_t state)
{
	switch (state) {
	case 0:
		return "stopped";
	case 1:
		return "internal";
	case 2:
		return "buffer";
	case 3:
		return "running";
	case 10:
		return "jogging";
	case 11:
		return "stopping";
	case 20:
		return "home";
	case 21:
		return "homing";
	case 30:
		return "probe complete";
	case 31:
		return "probing";
	case 32:
		return "probe error";
	case 40:
		return "hybrid probe stopping";
	case 41:
		return "hybrid probe complete";
	case 100:
		return "stopped by limit";
	case 101:
		return "stopped by emergency";
	default:
		return "unknown";
	}
}

/* enum pokeys_task_result */
static inline const char *pokeys_task_result_name(uint8_t result)
{
	switch (result) {
	case POKEYS_TASK_RESULT_NONE:
		return "ended";
	case POKEYS_TASK_DONE:
		return "done";
	case POKEYS_TASK_CANCELLED:
		return "cancelled";
	case POKEYS_TASK_TIMED_OUT:
		return "not done within its time limit";
	case POKEYS_TASK_FAILED:
		return "failed: the device did not begin, or stopped by itself";
	case POKEYS_TASK_TRIPPED:
		return "stopped by a limit switch or the emergency input";
	case POKEYS_TASK_NOT_FOUND:
		return "at its end without a contact";
	case POKEYS_TASK_LOST:
		return "lost with the link";
	case POKEYS_TASK_STARVED:
		return "stopped: the motion buffer ran dry in the middle of a thread";
	case POKEYS_TASK_BEHIND:
		return "stopped: the spindle is too far behind its target speed";
	default:
		return "unknown";
	}
}

/* enum pokeys_threading_refusal */
static inline const char *pokeys_threading_refusal_name(uint8_t refusal)
{
	switch (refusal) {
	case POKEYS_THREADING_WELL:
		return "not refused";
	case POKEYS_THREADING_OFF:
		return "the machine is off";
	case POKEYS_THREADING_NOT_SET:
		return "its settings are not given, or the device has not taken them yet";
	case POKEYS_THREADING_NO_AXIS:
		return "no enabled axis in buffered mode takes part";
	case POKEYS_THREADING_MOVING:
		return "an axis has not come to rest";
	case POKEYS_THREADING_BUSY:
		return "the device is at work already";
	case POKEYS_THREADING_NOT_PREPARED:
		return "it is not prepared";
	case POKEYS_THREADING_NOT_BEGUN:
		return "it has not begun";
	case POKEYS_THREADING_BAD_LIMIT:
		return "the time limit is out of range";
	default:
		return "unknown";
	}
}

/* State of a PoStep driver */
static inline const char *pokeys_postep_state_name(uint8_t state)
{
	switch (state) {
	case 1:
		return "asleep";
	case 2:
		return "active";
	case 3:
		return "idle";
	case 4:
		return "overheated";
	case 5:
		return "DC motor";
	default:
		return "unknown";
	}
}

/* A fault of a PoStep driver, the number of its bit in `faults` */
static inline const char *pokeys_postep_fault_name(unsigned int bit)
{
	switch (bit) {
	case 0:
		return "over-temperature";
	case 1:
		return "overcurrent A";
	case 2:
		return "overcurrent B";
	case 3:
		return "predriver fault A";
	case 4:
		return "predriver fault B";
	case 5:
		return "undervoltage";
	case 6:
		return "stall";
	case 7:
		return "stall latched";
	default:
		return "unknown";
	}
}

/* enum pokeys_heater_state */
static inline const char *pokeys_heater_state_name(uint8_t state)
{
	switch (state) {
	case POKEYS_HEATER_NONE:
		return "none";
	case POKEYS_HEATER_OFF:
		return "off";
	case POKEYS_HEATER_HEATING:
		return "heating";
	case POKEYS_HEATER_TUNING:
		return "tuning";
	case POKEYS_HEATER_FAULT:
		return "fault";
	case POKEYS_HEATER_STOPPING:
		return "stopping";
	default:
		return "unknown";
	}
}

/* enum pokeys_heater_fault */
static inline const char *pokeys_heater_fault_name(uint8_t fault)
{
	switch (fault) {
	case POKEYS_HEATER_FINE:
		return "none";
	case POKEYS_HEATER_DEVICE:
		return "device not ready";
	case POKEYS_HEATER_STALE:
		return "no readings";
	case POKEYS_HEATER_ODD:
		return "reading is no number";
	case POKEYS_HEATER_OPEN:
		return "sensor open";
	case POKEYS_HEATER_SHORTED:
		return "sensor shorted";
	case POKEYS_HEATER_OVER:
		return "too hot";
	case POKEYS_HEATER_UNDER:
		return "too cold";
	case POKEYS_HEATER_JUMP:
		return "temperature jumps";
	case POKEYS_HEATER_NO_RISE:
		return "does not get warm";
	case POKEYS_HEATER_FELL:
		return "does not stay warm";
	case POKEYS_HEATER_UNHEEDED:
		return "full power has no effect";
	default:
		return "unknown";
	}
}

/* enum pokeys_heater_refusal */
static inline const char *pokeys_heater_refusal_name(uint8_t refusal)
{
	switch (refusal) {
	case POKEYS_HEATER_TAKEN:
		return "none";
	case POKEYS_HEATER_OUT_OF_RANGE:
		return "target out of range";
	case POKEYS_HEATER_AFTER_FAULT:
		return "off has to be commanded first";
	case POKEYS_HEATER_NOT_READY:
		return "sensor or device not ready";
	default:
		return "unknown";
	}
}

/* enum pokeys_heater_tuning */
static inline const char *pokeys_heater_tuning_name(uint8_t tuning)
{
	switch (tuning) {
	case POKEYS_HEATER_TUNING_NONE:
		return "none";
	case POKEYS_HEATER_TUNING_RUNS:
		return "runs";
	case POKEYS_HEATER_TUNING_DONE:
		return "done";
	case POKEYS_HEATER_TUNING_FAILED:
		return "failed";
	default:
		return "unknown";
	}
}

/* enum pokeys_obstacle */
static inline const char *pokeys_obstacle_name(uint8_t obstacle)
{
	switch (obstacle) {
	case POKEYS_OBSTACLE_NONE:
		return "none";
	case POKEYS_OBSTACLE_LINK:
		return "the device does not run";
	case POKEYS_OBSTACLE_SHARED:
		return "something else uses its terminal";
	case POKEYS_OBSTACLE_SENSOR:
		return "the sensor's terminal is not set up";
	case POKEYS_OBSTACLE_FILTER:
		return "the analog filter is too slow";
	case POKEYS_OBSTACLE_ENCODER:
		return "the encoder is off";
	case POKEYS_OBSTACLE_INDEX:
		return "the index input resets the encoder";
	case POKEYS_OBSTACLE_OUTPUT:
		return "the output is not set up";
	case POKEYS_OBSTACLE_PWM:
		return "no such PWM output, or another period";
	case POKEYS_OBSTACLE_LIMIT:
		return "a limit switch is not set up";
	case POKEYS_OBSTACLE_FAN:
		return "the fan's output is not set up";
	case POKEYS_OBSTACLE_FAILSAFE:
		return "the failsafe would leave it on";
	case POKEYS_OBSTACLE_CONFIG:
		return "its configuration cannot be used";
	default:
		return "unknown";
	}
}

/* enum pokeys_heater_fan */
static inline const char *pokeys_heater_fan_name(uint8_t fan)
{
	switch (fan) {
	case POKEYS_HEATER_FAN_NONE:
		return "none";
	case POKEYS_HEATER_FAN_OFF:
		return "off";
	case POKEYS_HEATER_FAN_ON:
		return "on";
	default:
		return "unknown";
	}
}

/* enum pokeys_gain: the key in pokeysd.conf */
static inline const char *pokeys_gain_name(uint8_t gain)
{
	switch (gain) {
	case POKEYS_GAIN_P:
		return "pid-p";
	case POKEYS_GAIN_I:
		return "pid-i";
	case POKEYS_GAIN_D:
		return "pid-d";
	case POKEYS_GAIN_VELOCITY:
		return "velocity-gain";
	case POKEYS_GAIN_ACCELERATION:
		return "acceleration-gain";
	default:
		return "unknown";
	}
}

/* enum pokeys_servo_state */
static inline const char *pokeys_servo_state_name(uint8_t state)
{
	switch (state) {
	case POKEYS_SERVO_NONE:
		return "none";
	case POKEYS_SERVO_OFF:
		return "off";
	case POKEYS_SERVO_ENABLED:
		return "enabled";
	case POKEYS_SERVO_FAULT:
		return "fault";
	case POKEYS_SERVO_STOPPING:
		return "stopping";
	default:
		return "unknown";
	}
}

/* enum pokeys_servo_fault */
static inline const char *pokeys_servo_fault_name(uint8_t fault)
{
	switch (fault) {
	case POKEYS_SERVO_FINE:
		return "none";
	case POKEYS_SERVO_DEVICE:
		return "device not ready";
	case POKEYS_SERVO_STALE:
		return "no readings";
	case POKEYS_SERVO_EMERGENCY:
		return "emergency stop";
	case POKEYS_SERVO_JUMP:
		return "encoder jumps";
	case POKEYS_SERVO_ODD:
		return "command is impossible";
	case POKEYS_SERVO_FOLLOWING:
		return "following error";
	case POKEYS_SERVO_STALLED:
		return "stalled";
	case POKEYS_SERVO_SILENT:
		return "encoder silent";
	case POKEYS_SERVO_RUNAWAY:
		return "runs away";
	case POKEYS_SERVO_SOFT_LIMIT:
		return "soft limit";
	case POKEYS_SERVO_SWITCH:
		return "limit switch";
	case POKEYS_SERVO_HEATER:
		return "heater fault";
	default:
		return "unknown";
	}
}

/* enum pokeys_servo_refusal */
static inline const char *pokeys_servo_refusal_name(uint8_t refusal)
{
	switch (refusal) {
	case POKEYS_SERVO_TAKEN:
		return "none";
	case POKEYS_SERVO_AFTER_FAULT:
		return "the fault has to be reset first";
	case POKEYS_SERVO_NOT_READY:
		return "encoder or device not ready";
	case POKEYS_SERVO_ELSEWHERE:
		return "not at the commanded position";
	case POKEYS_SERVO_OFF_FIRST:
		return "off has to be commanded first";
	case POKEYS_SERVO_UNREAD:
		return "its commander does not read the position";
	default:
		return "unknown";
	}
}

/* enum pokeys_servo_homing */
static inline const char *pokeys_servo_homing_name(uint8_t homing)
{
	switch (homing) {
	case POKEYS_SERVO_HOMING_NONE:
		return "none";
	case POKEYS_SERVO_HOMING_LEAVE:
		return "leaves the switch";
	case POKEYS_SERVO_HOMING_SEARCH:
		return "searches for the switch";
	case POKEYS_SERVO_HOMING_BACK:
		return "backs off";
	case POKEYS_SERVO_HOMING_APPROACH:
		return "approaches the switch";
	case POKEYS_SERVO_HOMING_GO:
		return "goes to home-position";
	case POKEYS_SERVO_HOMING_HOLD:
		return "holds its position";
	default:
		return "unknown";
	}
}

/* enum pokeys_servo_home_end */
static inline const char *pokeys_servo_home_end_name(uint8_t end)
{
	switch (end) {
	case POKEYS_SERVO_HOME_NONE:
		return "none";
	case POKEYS_SERVO_HOME_DONE:
		return "done";
	case POKEYS_SERVO_HOME_ABORTED:
		return "aborted";
	case POKEYS_SERVO_HOME_STOPPED:
		return "the motor was switched off, or had a fault";
	case POKEYS_SERVO_HOME_NOT_FOUND:
		return "the home switch did not close";
	case POKEYS_SERVO_HOME_NOT_LEFT:
		return "the home switch did not open";
	case POKEYS_SERVO_HOME_LATE:
		return "homing took too long";
	case POKEYS_SERVO_HOME_UNREAD:
		return "no readings of the home switch";
	default:
		return "unknown";
	}
}

/* enum pokeys_servo_tuning */
static inline const char *pokeys_servo_tuning_name(uint8_t tuning)
{
	switch (tuning) {
	case POKEYS_SERVO_TUNING_NONE:
		return "none";
	case POKEYS_SERVO_TUNING_RUNS:
		return "runs";
	case POKEYS_SERVO_TUNING_DONE:
		return "done";
	case POKEYS_SERVO_TUNING_FAILED:
		return "failed";
	default:
		return "unknown";
	}
}

/* enum pokeys_servo_tune_reason */
static inline const char *pokeys_servo_tune_reason_name(uint8_t reason)
{
	switch (reason) {
	case POKEYS_SERVO_TUNE_FINE:
		return "none";
	case POKEYS_SERVO_TUNE_STOPPED:
		return "the motor was switched off, or had a fault";
	case POKEYS_SERVO_TUNE_STILL:
		return "the motor does not move";
	case POKEYS_SERVO_TUNE_REVERSED:
		return "the motor moves against its output";
	case POKEYS_SERVO_TUNE_SILENT:
		return "the motor, or its encoder, stands still";
	case POKEYS_SERVO_TUNE_FAR:
		return "the motor went too far";
	case POKEYS_SERVO_TUNE_UNLIKE:
		return "it does not respond like a motor";
	case POKEYS_SERVO_TUNE_LATE:
		return "not enough readings; try a longer distance";
	default:
		return "unknown";
	}
}

/* enum pokeys_moves_state */
static inline const char *pokeys_moves_state_name(uint8_t state)
{
	switch (state) {
	case POKEYS_MOVES_IDLE:
		return "idle";
	case POKEYS_MOVES_MOVING:
		return "moving";
	case POKEYS_MOVES_HELD:
		return "held";
	case POKEYS_MOVES_ABORTING:
		return "aborting";
	case POKEYS_MOVES_HANDOVER:
		return "holds its position";
	default:
		return "unknown";
	}
}

/* enum pokeys_moves_end */
static inline const char *pokeys_moves_end_name(uint8_t end)
{
	switch (end) {
	case POKEYS_MOVES_NONE:
		return "none";
	case POKEYS_MOVES_DONE:
		return "done";
	case POKEYS_MOVES_ABORTED:
		return "aborted";
	case POKEYS_MOVES_STOPPED:
		return "a motor or axis was switched off, or had a fault";
	default:
		return "unknown";
	}
}

/* enum pokeys_moves_refusal */
static inline const char *pokeys_moves_refusal_name(uint8_t refusal)
{
	switch (refusal) {
	case POKEYS_MOVES_TAKEN:
		return "none";
	case POKEYS_MOVES_FULL:
		return "the queue is full";
	case POKEYS_MOVES_ODD:
		return "there is no such motor or axis, or a value is invalid";
	case POKEYS_MOVES_ENDING:
		return "the path is being aborted";
	case POKEYS_MOVES_OFF:
		return "a motor or axis is not enabled";
	case POKEYS_MOVES_HOMING:
		return "a motor or axis is homing";
	case POKEYS_MOVES_COMMANDED:
		return "a motor or axis is being moved by its commander";
	case POKEYS_MOVES_LIMIT:
		return "its end is beyond a soft limit";
	case POKEYS_MOVES_BROKEN:
		return "an earlier move was refused, or the path ended early";
	default:
		return "unknown";
	}
}

/* clang-format on */

/* What moves or heats, or may begin to, for "... on"; NULL = nothing. */
static inline const char *pokeys_what_is_on(const struct pokeys_state *state)
{
	if (state->flags & POKEYS_STATE_MACHINE_ON)
		return "machine";
	for (unsigned int i = 0; i < POKEYS_SERVOS; i++)
		if (state->servo[i].state == POKEYS_SERVO_ENABLED)
			return "a motor";
	for (unsigned int i = 0; i < POKEYS_HEATERS; i++)
		if (state->heater[i].target > 0)
			return "a heater";
	return NULL;
}

#ifdef __cplusplus
}
#endif

#endif /* POKEYS_NAMES_H */
