/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The names of numbers in an event, as its line shows them. */

#include <pokeys/command.h>
#include <pokeys/state.h>
#include "daemon/device/event_name.h"

static const char *pick(const char *const *names, size_t count, int64_t which)
{
	return which >= 0 && (uint64_t)which < count && names[which] ? names[which] : "unknown";
}

#define PICK(names, which) pick(names, sizeof(names) / sizeof((names)[0]), which)

static const char *const kind_names[EVENT_CODES] = {
	[EVENT_LINK] = "link",
	[EVENT_IDENTIFIED] = "identified",
	[EVENT_WRONG_SERIAL] = "wrong-serial",
	[EVENT_CONFIG_CHANGED] = "setting-written",
	[EVENT_CONFIG_REFUSED] = "setting-refused",
	[EVENT_REBOOTED] = "restarted",
	[EVENT_COMMANDER] = "commander",
	[EVENT_SAFE] = "safe-state",
	[EVENT_MACHINE] = "machine",
	[EVENT_BAD_COMMAND] = "command-refused",
	[EVENT_FOREIGN_IMAGE] = "command-foreign",
	[EVENT_ONE_SHOT] = "one-shot",
	[EVENT_STALE] = "stale",
	[EVENT_PACKETS] = "packets",
	[EVENT_CYCLE_SKIPPED] = "cycles-skipped",
	[EVENT_TRANSPORT] = "transport",
	[EVENT_ENGINE] = "engine",
	[EVENT_WISH_REFUSED] = "wish-refused",
	[EVENT_FOREIGN_WISH] = "wish-foreign",
	[EVENT_LOCKED] = "locked",
	[EVENT_TASK] = "task",
	[EVENT_PHASE] = "phase-lock",
	[EVENT_THREADING] = "threading-refused",
	[EVENT_CONFIG_MISSING] = "setting-missing",
	[EVENT_POSTEP] = "postep",
	[EVENT_STEP_MODE] = "step-mode",
	[EVENT_NOT_SAFE] = "not-safe",
	[EVENT_SUSPENDED] = "suspended",
	[EVENT_OUTPUTS_HELD] = "outputs-held",
	[EVENT_POSITION_LOST] = "position-lost",
	[EVENT_EMERGENCY] = "emergency",
	[EVENT_TERMINALS_SHARED] = "terminals-shared",
	[EVENT_CONFIG_FOREIGN] = "setting-foreign",
	[EVENT_HEATER] = "heater",
	[EVENT_HEATER_REFUSED] = "heater-refused",
	[EVENT_HEATER_TUNED] = "heater-tuned",
	[EVENT_HEATER_LEFT] = "heater-left",
	[EVENT_HEATER_UNHEARD] = "heater-unheard",
	[EVENT_SERVO] = "servo",
	[EVENT_SERVO_REFUSED] = "servo-refused",
	[EVENT_SERVO_LEFT] = "servo-left",
	[EVENT_SERVO_UNHEARD] = "servo-unheard",
	[EVENT_HEATER_GAIN] = "heater-gain",
	[EVENT_SERVO_GAIN] = "servo-gain",
	[EVENT_SERVO_HOME] = "servo-home",
	[EVENT_MOVES] = "moves",
	[EVENT_SERVO_TUNED] = "servo-tuned",
	[EVENT_TERMINALS_ABSENT] = "terminals-absent",
	[EVENT_LIMIT_OVERRIDE] = "limit-override",
};

const char *event_kind_name(uint32_t code)
{
	return PICK(kind_names, code);
}

static const char *const link_names[] = {
	[POKEYS_LINK_SEARCHING] = "searching",
	[POKEYS_LINK_IDENTIFYING] = "identifying",
	[POKEYS_LINK_CONFIGURING] = "configuring",
	[POKEYS_LINK_RUNNING] = "running",
	[POKEYS_LINK_LOST] = "lost",
};

const char *event_link_name(int64_t link)
{
	return PICK(link_names, link);
}

static const char *const fault_texts[] = {
	[POKEYS_FAULT_NONE] = "",
	[POKEYS_FAULT_NO_ADDRESS] = ": not found in the network; compare its serial number with "
				    "pokeysctl discover",
	[POKEYS_FAULT_NO_ANSWER] = ": it does not answer; check power, cable and address, "
				   "and whether sudo pokeysctl discover finds it",
	[POKEYS_FAULT_WRONG_SERIAL] = ": another device answers at its address",
	[POKEYS_FAULT_UNSUPPORTED] = ": a device type that this driver does not know",
	[POKEYS_FAULT_CONFIG_REFUSED] = ": the device refused a setting",
	[POKEYS_FAULT_LOCKED] = ": it is locked",
	[POKEYS_FAULT_REBOOTED] = ": the device was restarted",
	[POKEYS_FAULT_NETWORK] = ": the kernel cannot send; check the interface and the route",
	[POKEYS_FAULT_IN_USE] = ": another pokeysd or another section drives it",
	[POKEYS_FAULT_SUSPENDED] = ": this computer was suspended",
};

const char *event_fault_text(int64_t fault)
{
	return PICK(fault_texts, fault);
}

static const char *const packet_name[EVENT_PACKETS_KINDS] = {
	[EVENT_PACKETS_MISSED] = "request without a reply by its deadline",
	[EVENT_PACKETS_STRAY] = "answer that came too late, or to nothing that was asked",
	[EVENT_PACKETS_CORRUPT] = "damaged packet",
	[EVENT_PACKETS_WRONG_SOURCE] = "packet from another source",
	[EVENT_PACKETS_NOT_SENT] = "packet that the kernel refused to send",
};

static const char *const packet_names[EVENT_PACKETS_KINDS] = {
	[EVENT_PACKETS_MISSED] = "requests without a reply by their deadline",
	[EVENT_PACKETS_STRAY] = "answers that came too late, or to nothing that was asked",
	[EVENT_PACKETS_CORRUPT] = "damaged packets",
	[EVENT_PACKETS_WRONG_SOURCE] = "packets from another source",
	[EVENT_PACKETS_NOT_SENT] = "packets that the kernel refused to send",
};

const char *event_packets_name(int64_t kind, int64_t count)
{
	return count == 1 ? PICK(packet_name, kind) : PICK(packet_names, kind);
}

static const char *const one_shot_names[] = {
	[POKEYS_ONE_SHOT_NOP] = "nop",
	[POKEYS_ONE_SHOT_SET_ENCODER] = "set encoder",
	[POKEYS_ONE_SHOT_ARM_INDEX] = "arm index",
	[POKEYS_ONE_SHOT_SET_POSITION] = "set position",
	[POKEYS_ONE_SHOT_CLEAR_FAULT] = "clear fault",
	[POKEYS_ONE_SHOT_HOME] = "home",
	[POKEYS_ONE_SHOT_HOME_CANCEL] = "cancel homing",
	[POKEYS_ONE_SHOT_HOME_FINISH] = "finish homing",
	[POKEYS_ONE_SHOT_PROBE] = "probe",
	[POKEYS_ONE_SHOT_PROBE_FINISH] = "finish probing",
	[POKEYS_ONE_SHOT_RESET_COUNTERS] = "reset counters",
	[POKEYS_ONE_SHOT_SAVE_CONFIG] = "save configuration",
	[POKEYS_ONE_SHOT_SET_RTC] = "set clock",
	[POKEYS_ONE_SHOT_REBOOT] = "reboot",
	[POKEYS_ONE_SHOT_JOG] = "jog",
	[POKEYS_ONE_SHOT_JOG_END] = "end jogging",
	[POKEYS_ONE_SHOT_THREAD_PREPARE] = "prepare threading",
	[POKEYS_ONE_SHOT_THREAD_FORCE] = "force threading",
	[POKEYS_ONE_SHOT_THREAD_ARM] = "arm threading",
	[POKEYS_ONE_SHOT_THREAD_RELEASE] = "release threading",
	[POKEYS_ONE_SHOT_THREAD_CANCEL] = "cancel threading",
	[POKEYS_ONE_SHOT_HEATER_RESET] = "reset heater",
	[POKEYS_ONE_SHOT_HEATER_TUNE] = "tune heater",
	[POKEYS_ONE_SHOT_SERVO_RESET] = "reset servo",
	[POKEYS_ONE_SHOT_SERVO_PLACE] = "place servo",
	[POKEYS_ONE_SHOT_HEATER_GAIN] = "gain of heater",
	[POKEYS_ONE_SHOT_SERVO_GAIN] = "gain of servo",
	[POKEYS_ONE_SHOT_SERVO_HOME] = "home servo",
	[POKEYS_ONE_SHOT_MOVE] = "move",
	[POKEYS_ONE_SHOT_MOVES_CONTROL] = "control of moves",
	[POKEYS_ONE_SHOT_SERVO_TUNE] = "tune servo",
};

const char *event_one_shot_name(int64_t operation)
{
	return PICK(one_shot_names, operation);
}

static const char *const outcome_names[] = {
	[POKEYS_OUTCOME_NONE] = "still open",
	[POKEYS_OUTCOME_DONE] = "done",
	[POKEYS_OUTCOME_FAILED] = "failed",
	[POKEYS_OUTCOME_UNKNOWN] = "not known: no answer, and it could not be read back",
	[POKEYS_OUTCOME_REFUSED] = "refused",
};

const char *event_outcome_name(int64_t outcome)
{
	return PICK(outcome_names, outcome);
}

static const char *const refusal_names[REFUSALS] = {
	[REFUSAL_NOT_OFFERED] = "there is no such operation",
	[REFUSAL_NOT_RUNNING] = "the device is not running (pokeysctl status says why)",
	[REFUSAL_VALUE] = "a value is out of range",
	[REFUSAL_POSITION] = "the position of axis # is out of range",
	[REFUSAL_MACHINE_OFF] = "motion is not permitted: switch machine-on on, or off and on if "
				"it is on already",
	[REFUSAL_MACHINE_ON] = "motion is permitted, or an axis or servo motor still moves",
	[REFUSAL_NO_ENGINE] = "this device has no pulse engine",
	[REFUSAL_ENGINE_ON] = "with this firmware, a position can be set only while the pulse "
			      "engine is off",
	[REFUSAL_BUSY] = "homing, probing, jogging, threading or a path is under way",
	[REFUSAL_NO_AXIS] = "no axis is named",
	[REFUSAL_AXIS_ABSENT] = "this device has no axis #",
	[REFUSAL_AXIS_OFF] = "axis # is not configured (axes and axis.#.mode in pokeysd.conf)",
	[REFUSAL_AXIS_DRIVEN] = "axis # is enabled, or still moves",
	[REFUSAL_AXIS_BUFFERED] = "axis # is in buffered mode, in which the device cannot probe",
	[REFUSAL_NO_HOME_SWITCH] = "axis # has no home switch (axis.#.home or axis.#.home-shared "
				   "in pokeysd.conf)",
	[REFUSAL_SOFT_LIMIT] = "the target of axis # is beyond its soft limits",
	[REFUSAL_NO_HAND_WHEEL] = "no axis in position mode has a hand wheel (mpg-encoder of an "
				  "axis in pokeysd.conf)",
	[REFUSAL_NOTHING_TO_FINISH] = "there is no homing to finish",
	[REFUSAL_ENGINE_OFF] = "the pulse engine is not running",
	[REFUSAL_NO_ENCODER] = "this device has no encoder #",
	[REFUSAL_SERVO_ENCODER] = "encoder # belongs to a servo motor, or an enabled servo motor "
				  "has an encoder in the same group: the device sets a whole group "
				  "at once",
	[REFUSAL_SERVO_INDEX] = "encoder # belongs to a servo motor, or it is a fast encoder and a "
				"servo motor has another one: the device arms all fast encoders "
				"together",
	[REFUSAL_NO_INDEX] = "encoder # has no index: it is not a fast or ultra-fast encoder, or "
			     "it is off (fast-encoders, ultra-fast-encoder in pokeysd.conf)",
	[REFUSAL_INDEX_FIRMWARE] = "the index of encoder # needs firmware 4.2.19 or later",
	[REFUSAL_PROBE_INPUT] = "there is no such probe input",
	[REFUSAL_HYBRID_AXES] = "a hybrid probe must not name axes",
	[REFUSAL_NO_COUNTERS] = "this device has no digital counters",
	[REFUSAL_SAVED_JUST_NOW] = "the device's flash memory was written less than 2 s ago; "
				   "try again",
};

const char *event_refusal_name(int64_t refusal)
{
	return PICK(refusal_names, refusal);
}

static const char *const fault_names[COMMAND_FAULTS] = {
	[COMMAND_FAULT_NONE] = "nothing",
	[COMMAND_FAULT_IMAGE] = "the whole image cannot be read, error",
	[COMMAND_FAULT_SESSION] = "session must not be 0, it is",
	[COMMAND_FAULT_FLAGS] = "flags that do not exist:",
	[COMMAND_FAULT_OUTPUT] = "outputs above pin 55, in byte",
	[COMMAND_FAULT_AXIS_MODE] =
		"mode must be 0 off, 1 position, 2 velocity or 3 buffered, axis",
	[COMMAND_FAULT_AXIS_ENABLE] = "enable must be 0 or 1, axis",
	[COMMAND_FAULT_AXIS_POSITION] = "position must be within +-16777216 pulses (buffered: "
					"+-2100000000), axis",
	[COMMAND_FAULT_AXIS_VELOCITY] = "velocity must be a number within +-1e7 pulses/s, axis",
	[COMMAND_FAULT_AXIS_SETUP] = "enabled, but not configured in the device for this mode "
				     "(see the axis keys in pokeysd.conf): axis",
	[COMMAND_FAULT_AXIS_SPEED] = "velocity is above the configured maximum speed; the axis "
				     "stops: axis",
	[COMMAND_FAULT_AXIS_SOFT_LIMIT] = "position is beyond the soft limits, axis",
	[COMMAND_FAULT_AXIS_UNREAD] = "enable refused: the commander does not read the positions; "
				      "add pokeys.N.read before pokeys.N.write in the same "
				      "thread: axis",
	[COMMAND_FAULT_UNREAD] = NULL,
	[COMMAND_FAULT_NOT_OFFERED] = NULL, /* has a text of its own */
	[COMMAND_FAULT_ONE_SHOT_RING] = "the one-shot ring holds at most 64, it claims",
	[COMMAND_FAULT_PWM_CHANNEL] = "only PWM channels 0 to 5 can be enabled, the bits are",
	[COMMAND_FAULT_PWM_DUTY] = "duty is above the period, PWM channel",
	[COMMAND_FAULT_POEXTBUS] = "PoExtBus has ten bytes, commanded is byte",
	[COMMAND_FAULT_PONET] = "there is no such PoNET module:",
	[COMMAND_FAULT_KBD48] = "kbd48: lights above 47 or flags that do not exist:",
	[COMMAND_FAULT_PWM_LOOP] = "a heater or servo of pokeysd.conf has this PWM channel or its "
				   "terminal:",
	[COMMAND_FAULT_PWM_PERIOD] = "heaters and servos of pokeysd.conf need its pwm-period, "
				     "commanded is",
	[COMMAND_FAULT_HEATER] = "pokeysd.conf has no such heater:",
	[COMMAND_FAULT_HEATER_TARGET] = "the target is no number, and the heater is off:",
	[COMMAND_FAULT_SERVO] = "pokeysd.conf has no such servo:",
	[COMMAND_FAULT_SERVO_POSITION] = "position or velocity is no number, of servo",
	[COMMAND_FAULT_ONE_SHOT_ID] = "the slot of a one-shot holds another id, expected was",
};

const char *event_command_fault_name(int64_t fault)
{
	return PICK(fault_names, fault);
}

static const char *const part_names[COMMAND_PARTS] = {
	[COMMAND_PART_PWM] = "PWM",
	[COMMAND_PART_POEXTBUS] = "PoExtBus",
	[COMMAND_PART_EXTERNAL_OUTPUTS] = "external outputs and relays",
	[COMMAND_PART_PONET] = "PoNET",
};

const char *event_part_name(int64_t part)
{
	return PICK(part_names, part);
}

static const char *const task_names[] = {
	[POKEYS_TASK_NONE] = "nothing",    [POKEYS_TASK_HOMING] = "homing",
	[POKEYS_TASK_PROBING] = "probing", [POKEYS_TASK_HYBRID_PROBING] = "hybrid probing",
	[POKEYS_TASK_JOGGING] = "jogging", [POKEYS_TASK_THREADING] = "threading",
};

const char *event_task_name(int64_t task)
{
	return PICK(task_names, task);
}

static const char *const place_loss_names[PLACE_LOSSES] = {
	[PLACE_RESTART] = "restart or exchange of the device",
	[PLACE_ENGINE] = "the pulse engine was set up again",
	[PLACE_SET_ELSEWHERE] = "its counter was set by another client",
	[PLACE_NOT_HOMED] = "homing, or setting the position, failed",
	[PLACE_NO_CLOCK] = "the device did not report whether it was restarted",
};

const char *event_place_loss_name(int64_t why)
{
	return PICK(place_loss_names, why);
}
