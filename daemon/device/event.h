/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What the realtime side has to say, for somebody else to write down.
 *
 * A bounded ring with one writer (the realtime thread) and one reader (the
 * control thread). The writer never waits: a full ring drops the event and
 * counts it. The texts are in event_text*.c, so that the journal,
 * the man page and the tests use the same ones.
 */
#ifndef DEVICE_EVENT_H
#define DEVICE_EVENT_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { EVENT_RING = 1024 };

/* syslog's levels */
enum event_level {
	EVENT_ERROR = 3,
	EVENT_WARNING = 4,
	EVENT_NOTICE = 5,
	EVENT_INFO = 6,
	EVENT_DEBUG = 7,
};

enum event_code {
	EVENT_NONE = 0,
	EVENT_LINK,             /* a = enum pokeys_link now, b = before, c = enum pokeys_fault */
	EVENT_IDENTIFIED,       /* a = serial, b = hardware id, c = firmware
				 * major<<16|minor<<8|revision */
	EVENT_WRONG_SERIAL,     /* a = found, b = wanted */
	EVENT_CONFIG_CHANGED,   /* a = enum wire_op, b = pin, encoder or axis, -1 = none,
				 * c = written */
	EVENT_CONFIG_REFUSED,   /* a = enum wire_op, b = as above, c = enum setting_reason */
	EVENT_REBOOTED,         /* a = tick before, b = tick now (ms) */
	EVENT_COMMANDER,        /* a = 1 came, 0 lost; b = age of the heartbeat, us,
				 * or -1: another session, of which none came yet; c = 1: it has
				 * said that it ends */
	EVENT_SAFE,             /* a = 1 entered, 0 left; b = the device is there */
	EVENT_MACHINE,          /* a = 1 motion permitted, 0 not */
	EVENT_BAD_COMMAND,      /* a = enum command_fault, b = index */
	EVENT_FOREIGN_IMAGE,    /* the command image has another layout; a = magic,
				 * b = version */
	EVENT_ONE_SHOT,         /* a = operation, b = id or EVENT_ORDERED, c = enum
				 * pokeys_outcome, bits 8..15 = enum one_shot_refusal, 16..23 =
				 * its axis or encoder */
	EVENT_STALE,            /* a = 1 stale, 0 fresh again; b = age, us; -1 = not all came yet */
	EVENT_PACKETS,          /* first of a kind or at most once in 10 s: a = enum
				 * event_packets, b = how many */
	EVENT_CYCLE_SKIPPED,    /* at most once in 10 s: a = how many since the last */
	EVENT_TRANSPORT,        /* a = -errno */
	EVENT_ENGINE,           /* pulse engine, a = state now, b = before (protocol section
				 * 3.24.1) */
	EVENT_WISH_REFUSED,     /* a setting of the commander's is out of range; a = enum
				 * pokeys_setting, b = pin, encoder or axis, c = which part of
				 * an axis (wish_axis_part) */
	EVENT_FOREIGN_WISH,     /* the wish has another layout, or no session or generation */
	EVENT_LOCKED,           /* a = enum lock_reason, b = level of access (0 open .. 255) */
	EVENT_TASK,             /* homing or probing has ended: a = enum pokeys_task, b = enum
				 * pokeys_task_result, c = axes, bits */
	EVENT_PHASE,            /* phase lock: a = enum pokeys_phase_state, b = period of the
				 * commander's thread, c = jitter of its reads (ns) */
	EVENT_THREADING,        /* a one-shot of threading was refused: a = operation, b = enum
				 * pokeys_threading_refusal */
	EVENT_CONFIG_MISSING,   /* a setting that this device does not have is wanted: a = enum
				 * wire_op, b = firmware that brought it (as in EVENT_IDENTIFIED),
				 * c = 1 only a PoKeys57CNC has it */
	EVENT_POSTEP,           /* faults of a PoStep driver: a = axis, b = those that are new (bits
				 * as in struct pokeys_postep) */
	EVENT_STEP_MODE,        /* motion is not permitted for a PoStep driver's step mode: a =
				 * axis, b = the one it has, -1 = it does not tell, c = wanted, -1 =
				 * the one that it is getting is no longer wanted */
	EVENT_NOT_SAFE,         /* the daemon ends, and a device that it drove has not
				 * acknowledged the safe state: a = ms until its own failsafe acts,
				 * 0 = off, -1 = not known; b = on what (WIRE_FAILSAFE_*) */
	EVENT_SUSPENDED,        /* this computer was; a = for how long, ms */
	EVENT_OUTPUTS_HELD,     /* after a loss, until machine-on rises: a = 1 they are, 0 no
				 * longer */
	EVENT_POSITION_LOST,    /* a = axes, bits; b = enum place_loss */
	EVENT_EMERGENCY,        /* the commander's: a = 1 stop, 0 released; b = outputs stay */
	EVENT_TERMINALS_SHARED, /* a = terminals, bit = terminal - 1, b and c = numbers of their
				 * owners (settings/terminal.h) */
	EVENT_CONFIG_FOREIGN,   /* somebody else has written a setting: as EVENT_CONFIG_CHANGED */
	EVENT_HEATER,           /* a = heater, b = enum heater_fault (0 = it was reset),
				 * c = temperature, tenths of a degree C, or
				 * EVENT_NO_TEMPERATURE */
	EVENT_HEATER_REFUSED,   /* a target was: a = heater, b = enum heater_refusal, c = the
				 * target as above, or (HEATER_NOT_READY) enum heater_fault */
	EVENT_HEATER_TUNED,     /* a = heater, b = enum heater_tuning, c = target as above */
	EVENT_HEATER_LEFT,      /* its commander has: it is off; a = heater, c = temperature */
	EVENT_HEATER_UNHEARD,   /* a heater is off, and the device does not acknowledge it: nothing
				 * is sent to it for its failsafe's time; a = ms, 0 = no failsafe
				 * is known to switch heater b off soon */
	EVENT_SERVO,            /* a = servo motor, b = enum servo_fault (0 = it was reset), c =
				 * position, thousandths of a unit */
	EVENT_SERVO_REFUSED,    /* it was not enabled: a = motor, b = enum servo_refusal, c = enum
				 * servo_fault, its condition */
	EVENT_SERVO_LEFT,       /* its commander has: it is off; a = motor, c = position */
	EVENT_SERVO_UNHEARD,    /* as EVENT_HEATER_UNHEARD, of a motor */
	EVENT_HEATER_GAIN,      /* another one until the daemon ends: a = heater, b = enum
				 * pokeys_gain, c = value times EVENT_GAIN_SCALE */
	EVENT_SERVO_GAIN,       /* likewise, of a motor */
	EVENT_SERVO_HOME,       /* a = servo motor, b = enum pokeys_servo_home_end (0 = it has
				 * begun), c = position, thousandths of a unit */
	EVENT_MOVES,            /* a path has ended before its end: a = enum pokeys_moves_end, b =
				 * what has stopped it (servo motor, or POKEYS_SERVOS + axis),
				 * c = moves that are left out */
	EVENT_SERVO_TUNED,      /* a = servo motor, b = enum pokeys_servo_tuning, c = enum
				 * pokeys_servo_tune_reason */
	EVENT_TERMINALS_ABSENT, /* a = terminals, bit = terminal - 1; b = the WIRE_PIN_ function
				 * that they are wanted for, and that this board lacks there */
	EVENT_LIMIT_OVERRIDE,   /* a = 1 limit switches stop no axis, 0 they do again */
	/* records are read by the numbers: new ones come last */
	EVENT_CODES
};

/* EVENT_HEATER: nobody knows it. */
#define EVENT_NO_TEMPERATURE INT64_MIN

#define EVENT_GAIN_SCALE 1e12

/* EVENT_ONE_SHOT: no commander's, but a terminal's; ids of commanders begin anywhere. */
enum { EVENT_ORDERED = -1 };

/* EVENT_ONE_SHOT: why it was refused. Records are read by the numbers: new ones come last. */
enum one_shot_refusal {
	REFUSAL_NONE, /* it was not, or another event says why */
	REFUSAL_NOT_OFFERED,
	REFUSAL_NOT_RUNNING, /* the device */
	REFUSAL_VALUE,       /* a value is out of range */
	REFUSAL_POSITION,    /* ... the position of an axis */
	REFUSAL_MACHINE_OFF,
	REFUSAL_MACHINE_ON,
	REFUSAL_NO_ENGINE, /* no pulse engine */
	REFUSAL_ENGINE_ON,
	REFUSAL_BUSY,    /* a task or a path is under way */
	REFUSAL_NO_AXIS, /* the request names none */
	REFUSAL_AXIS_ABSENT,
	REFUSAL_AXIS_OFF,
	REFUSAL_AXIS_DRIVEN,
	REFUSAL_AXIS_BUFFERED,
	REFUSAL_NO_HOME_SWITCH,
	REFUSAL_SOFT_LIMIT,
	REFUSAL_NO_HAND_WHEEL,
	REFUSAL_NOTHING_TO_FINISH,
	REFUSAL_ENGINE_OFF,
	REFUSAL_NO_ENCODER,
	REFUSAL_SERVO_ENCODER, /* it cannot be set */
	REFUSAL_SERVO_INDEX,   /* it cannot be armed */
	REFUSAL_NO_INDEX,
	REFUSAL_INDEX_FIRMWARE,
	REFUSAL_PROBE_INPUT,
	REFUSAL_HYBRID_AXES,
	REFUSAL_NO_COUNTERS,
	REFUSAL_SAVED_JUST_NOW,
	REFUSALS
};

/* EVENT_CONFIG_REFUSED: why the device does not have what is wanted. */
enum setting_reason {
	SETTING_UNTAKEN,    /* the device says that it has it, and has another value */
	SETTING_LOCKED,     /* its configuration is locked */
	SETTING_UNANSWERED, /* it answers no request to read or write it */
};

/* EVENT_LOCKED: why the device does not let us in. */
enum lock_reason {
	LOCK_CONFIGURATION, /* settings differ, and its configuration is locked */
	LOCK_NO_PASSWORD,
	LOCK_WRONG_PASSWORD,
};

/* EVENT_PACKETS: what went wrong with packets. */
enum event_packets {
	EVENT_PACKETS_MISSED, /* requests without a reply by their deadline */
	EVENT_PACKETS_STRAY,  /* answers to nothing that was asked */
	EVENT_PACKETS_CORRUPT,
	EVENT_PACKETS_WRONG_SOURCE,
	EVENT_PACKETS_NOT_SENT, /* the kernel refused */
	EVENT_PACKETS_KINDS
};

/* EVENT_BAD_COMMAND: what in the command image was refused. */
enum command_fault {
	COMMAND_FAULT_NONE = 0,
	COMMAND_FAULT_IMAGE,     /* all of it; index = -errno of the reader */
	COMMAND_FAULT_SESSION,   /* session 0 */
	COMMAND_FAULT_FLAGS,     /* flags that do not exist; index = the flags */
	COMMAND_FAULT_OUTPUT,    /* outputs beyond pin 55 */
	COMMAND_FAULT_AXIS_MODE, /* index = axis, here and below */
	COMMAND_FAULT_AXIS_ENABLE,
	COMMAND_FAULT_AXIS_POSITION,   /* beyond what the device's planner can do */
	COMMAND_FAULT_AXIS_VELOCITY,   /* not a number, or beyond any axis */
	COMMAND_FAULT_AXIS_SETUP,      /* enabled, but not set up in the device for this mode */
	COMMAND_FAULT_AXIS_SPEED,      /* above the axis' highest, in velocity mode */
	COMMAND_FAULT_AXIS_SOFT_LIMIT, /* beyond the device's soft limits, and going further out */
	COMMAND_FAULT_AXIS_UNREAD,     /* enabled by one that does not know where it stands */
	COMMAND_FAULT_UNREAD,          /* machine-on, likewise; index = age of what it read, ms */
	COMMAND_FAULT_NOT_OFFERED,     /* index = enum command_part */
	COMMAND_FAULT_ONE_SHOT_RING,   /* index = how many the ring claims to hold */
	COMMAND_FAULT_ONE_SHOT_ID,     /* index = id that was expected */
	COMMAND_FAULT_PWM_CHANNEL,     /* enables channels that do not exist; index = the bits */
	COMMAND_FAULT_PWM_DUTY,        /* above the period; index = channel, 0-based */
	COMMAND_FAULT_POEXTBUS,        /* beyond its ten bytes; index = byte */
	COMMAND_FAULT_PONET,           /* no such module; index = module */
	COMMAND_FAULT_KBD48,           /* flags or lights that do not exist; index = the flags */
	COMMAND_FAULT_PWM_LOOP,        /* enables one of a heater or motor; index = channel */
	COMMAND_FAULT_PWM_PERIOD,      /* heaters and motors have another one; index = period */
	COMMAND_FAULT_HEATER,          /* there is no such heater; index = heater */
	COMMAND_FAULT_HEATER_TARGET,   /* is no number; index = heater */
	COMMAND_FAULT_SERVO,           /* enables one that does not exist; index = motor */
	COMMAND_FAULT_SERVO_POSITION,  /* or its speed is no number; index = motor */
	COMMAND_FAULTS
};

/* Why positions are not valid any more. */
enum place_loss {
	PLACE_RESTART,       /* the device, or this is another one */
	PLACE_ENGINE,        /* its pulse engine was set up anew */
	PLACE_SET_ELSEWHERE, /* not by the commander */
	PLACE_NOT_HOMED,     /* homing or setting a position has ended halfway */
	PLACE_NO_CLOCK,      /* nobody knows: it did not tell its clock */
	PLACE_LOSSES
};

/* Parts of the command image that not every device has. */
enum command_part {
	COMMAND_PART_PWM,
	COMMAND_PART_POEXTBUS,
	COMMAND_PART_EXTERNAL_OUTPUTS,
	COMMAND_PART_PONET,
	COMMAND_PARTS
};

struct event {
	uint64_t t_ns;
	uint16_t code;
	uint8_t level;
	uint8_t device; /* index, 255 = none */
	uint32_t reserved;
	int64_t a, b, c;
};

struct event_ring {
	_Atomic uint32_t head, tail;
	_Atomic uint64_t dropped;
	_Atomic uint32_t high_water;
	/* Sees each event as it is pushed, also one that is dropped; NULL = nobody. Realtime. */
	void (*tap)(void *context, const struct event *event);
	void *tap_context;
	struct event slot[EVENT_RING];
};

/* Realtime, writer's side. */
void event_push(struct event_ring *ring, const struct event *event);

/* Reader's side: 1 = *out is the oldest, 0 = empty. */
int event_pop(struct event_ring *ring, struct event *out);

/* One line for a person; `device` is its name (or NULL). Cold. Returns the length. */
size_t event_format(const struct event *event, const char *device, char *text, size_t size);

#endif
