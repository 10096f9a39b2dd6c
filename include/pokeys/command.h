/* SPDX-License-Identifier: MIT */
/*
 * The command image: the latest wish of the one commander of a device.
 *
 * Overwritten as a whole as often as the commander likes (LinuxCNC: each
 * servo period), read by the daemon once a cycle. Nothing here is an event:
 * a value that is overwritten before it was read is simply not wanted any
 * more. Events are one-shots: they go through the ring at the end, each has
 * an id, and its outcome comes back in the state image.
 *
 * The daemon believes nothing in here: another layout, a value out of range,
 * NaN or a ring that makes no sense is refused, counted and flagged
 * (POKEYS_STATE_BAD_COMMAND); the last good value of that field stays, but a
 * bad axis in velocity mode stands. Only machine-on and an axis' enable always
 * fall when they are 0 here.
 *
 * One-shots have the ids 0, 1, 2 ... of their session: the first has id 0 and
 * stands in slot 0, and ids 0..one_shot_head-1 have been queued. A slot may be
 * used again when its one-shot was taken (state.one_shot_ack is above its id).
 * What was queued before state.one_shot_session shows this session is never
 * executed (outcome POKEYS_OUTCOME_UNKNOWN): a daemon that was started anew
 * cannot know what the one before it had done. So queue only from then on.
 *
 * Motion: the rising edge of POKEYS_COMMAND_MACHINE_ON must be seen while the
 * link is running and the heartbeat fresh. From then on the axes' references
 * are those of the newest image, so at the edge they have to be what
 * state.engine.axis[].position says. A commander must therefore read the state
 * first. If t_thread_ns is 0 or too old (POKEYS_READ_OLD_NS), or if the device's
 * data are too old, the rising edges of machine-on and of an axis' enable are
 * refused. Of machine-on, POKEYS_STATE_EDGE_UNREAD says so until something else
 * ends it: only then may a commander give the edge again by itself.
 */
#ifndef POKEYS_COMMAND_H
#define POKEYS_COMMAND_H

#include <stdint.h>
#include <pokeys/state.h>

#ifdef __cplusplus
extern "C" {
#endif

#define POKEYS_COMMAND_MAGIC	UINT32_C(0x4d434b50)	/* "PKCM" */
#define POKEYS_COMMAND_VERSION	6
#define POKEYS_COMMAND_HASH	UINT64_C(0xc06793d84e920364)

enum {
	POKEYS_ONE_SHOTS = 64,
	POKEYS_READ_AGES = 16,
};

/*
 * Motion may begin only if the commander's last read was at most this old at its write, plus
 * four of the commander's periods.
 */
#define POKEYS_READ_OLD_NS	UINT64_C(100000000)

/* command.flags */
enum {
	POKEYS_COMMAND_MACHINE_ON = 1u << 0, /* motion is wanted; its rising edge enables */
	POKEYS_COMMAND_LIMIT_OVERRIDE = 1u << 1,
	POKEYS_COMMAND_EMERGENCY = 1u << 2, /* emergency stop: axes stop and outputs go to the
					     * safe state at once, until this is 0 and
					     * machine-on rises */
	POKEYS_COMMAND_RESUMED = 1u << 3,   /* this commander already drove the device under an
					     * earlier daemon: outputs wait for machine-on as
					     * after a loss. Read only when a session begins */
	POKEYS_COMMAND_ENDS = 1u << 4,      /* this commander is ending: the daemon carries out
					     * this image, then treats the heartbeat as late.
					     * pokeys_client_close() writes it */
};

/* command.kbd48_flags */
enum {
	POKEYS_KBD48_LEDS = 1u << 0,       /* kbd48_leds is commanded */
	POKEYS_KBD48_BRIGHTNESS = 1u << 1, /* kbd48_brightness is commanded */
};

enum pokeys_axis_mode {
	POKEYS_AXIS_OFF = 0,
	POKEYS_AXIS_POSITION = 1, /* absolute reference and speed */
	POKEYS_AXIS_VELOCITY = 2,
	POKEYS_AXIS_BUFFERED = 3,
};

struct pokeys_axis_command {
	int32_t position; /* pulses; position and buffered mode */
	float velocity;   /* pulses/s; position mode: feed forward, 0 = as fast as
			   * allowed; velocity mode: with a sign */
	uint8_t mode;     /* enum pokeys_axis_mode */
	uint8_t enable;   /* 1 = this axis may move */
	uint8_t reserved[6];
};

/* A servo motor. It is enabled at the rising edge of `enable`, at the commanded position. */
struct pokeys_servo_command {
	double position; /* units of counts-per-unit */
	float velocity;  /* units/s, of that position, for the feed-forward; NaN:
			  * the daemon estimates it from the positions */
	uint8_t enable;
	uint8_t reserved[3];
};

/* one_shot.flags of HOME, PROBE, SERVO_PLACE, SERVO_HOME and MOVE */
enum {
	POKEYS_HOME_FINISH_ITSELF = 1u << 0, /* do not wait for HOME_FINISH */
	POKEYS_PROBE_ACTIVE_HIGH = 1u << 0,
	POKEYS_PROBE_HYBRID = 1u << 1, /* the commander moves: no mask, positions, speed */
	POKEYS_SERVO_HOMED = 1u << 0,  /* that is its position on the machine */
	POKEYS_SERVO_END_HOMING = 1u << 1,
	POKEYS_MOVE_BEGINS = 1u << 0, /* a path: need not follow a taken move */
};

enum pokeys_one_shot_operation {
	POKEYS_ONE_SHOT_NOP = 0,         /* answered DONE at once: a test of the way */
	POKEYS_ONE_SHOT_SET_ENCODER = 1, /* index, value = counts */
	POKEYS_ONE_SHOT_ARM_INDEX = 2,   /* index; the index pulse then zeroes the count */
	/*
	 * Set position: mask of axes that are not driven, value[] = pulses. Its outcome comes
	 * in the image with the new position and its odd position_epoch.
	 */
	POKEYS_ONE_SHOT_SET_POSITION = 3,
	POKEYS_ONE_SHOT_CLEAR_FAULT = 4, /* engine out of limit or emergency state */
	/*
	 * Homing: mask of axes that are homed together, value[] = home offsets,
	 * parameter[0] = time limit in s (0 = 120). Its outcome comes when all of
	 * them are homed, or when that has failed and they stand again. Refused if
	 * one of them has no home switch (axis.N.home).
	 */
	POKEYS_ONE_SHOT_HOME = 5,
	POKEYS_ONE_SHOT_HOME_CANCEL = 6, /* done when the engine stands */
	POKEYS_ONE_SHOT_HOME_FINISH = 7, /* after HOME without POKEYS_HOME_FINISH_ITSELF */
	/*
	 * Probing: mask of axes, value[] = furthest positions, parameter[0] = time
	 * limit in s (0 = 60), parameter[1] = speed as part of the axes' highest,
	 * above 0 up to 1, index = input (1..8 external, else terminal + 8), flags.
	 * Results: state.engine.axis[].probe, probe_status, task_result.
	 */
	POKEYS_ONE_SHOT_PROBE = 8,
	POKEYS_ONE_SHOT_PROBE_FINISH = 9, /* ends it; done when it has ended */
	POKEYS_ONE_SHOT_RESET_COUNTERS = 10,
	POKEYS_ONE_SHOT_SAVE_CONFIG = 11, /* only while motion is not permitted */
	POKEYS_ONE_SHOT_SET_RTC = 12,     /* value[] = year, month, day, hour, minute, second,
					   * day of week 0..6, day of year */
	POKEYS_ONE_SHOT_REBOOT = 13,      /* only while motion is not permitted */
	/*
	 * All axes that are set up with an encoder for it (mpg-encoder) follow their hand
	 * wheels until JOG_END, whatever is commanded. parameter[0] = time limit in s,
	 * 0 = none. Its outcome comes with the end: DONE if it was JOG_END.
	 */
	POKEYS_ONE_SHOT_JOG = 14,
	POKEYS_ONE_SHOT_JOG_END = 15, /* done when the engine stands */
	/*
	 * Threading by the device, docs/motion.md; why one was refused says
	 * state.threading.refused. PREPARE waits until the buffer is empty, FORCE does not;
	 * parameter[0] = time limit of the whole in s (0 = 300). Done when prepared.
	 */
	POKEYS_ONE_SHOT_THREAD_PREPARE = 16,
	POKEYS_ONE_SHOT_THREAD_FORCE = 17,
	POKEYS_ONE_SHOT_THREAD_ARM = 18,     /* done when it waits for the index or is active */
	POKEYS_ONE_SHOT_THREAD_RELEASE = 19, /* done when nothing is left to be caught up */
	POKEYS_ONE_SHOT_THREAD_CANCEL = 20,  /* done when the engine stands */
	/* index = heater, here and below. Refused while the cause of its fault is there. */
	POKEYS_ONE_SHOT_HEATER_RESET = 21,
	/*
	 * Search for a heater's gains: parameter[0] = temperature of the search, degrees C; 0
	 * ends the search. Done when it has begun; state.heater[].tuning shows its progress.
	 */
	POKEYS_ONE_SHOT_HEATER_TUNE = 22,
	/*
	 * index = servo motor, here and below. Refused while the cause of its fault is there;
	 * limit switches and soft limits are no such causes.
	 */
	POKEYS_ONE_SHOT_SERVO_RESET = 23,
	/*
	 * Its position is value[0] counts of its encoder, divided by counts-per-unit; flags.
	 * Refused while it is enabled. Nothing moves.
	 */
	POKEYS_ONE_SHOT_SERVO_PLACE = 24,
	/*
	 * Another gain, until the daemon ends: mask = enum pokeys_gain, parameter[0] = value, in
	 * the units of pokeysd.conf. The output does not jump. Refused if it is no gain, or if p
	 * and i would both be 0, or while a heater searches for its gains.
	 */
	POKEYS_ONE_SHOT_HEATER_GAIN = 25,
	POKEYS_ONE_SHOT_SERVO_GAIN = 26,
	/*
	 * Find its home switch; refused without one in pokeysd.conf, while the motor is not
	 * enabled, or while it is commanded to move.
	 * It has to stay enabled; its commanded position does not matter meanwhile. Afterwards the
	 * daemon holds it until that position is where it is. With POKEYS_SERVO_END_HOMING: slow
	 * down, and hold it; refused if it is not homing. Done when it has begun;
	 * state.servo[].homing and .home_end show its progress.
	 */
	POKEYS_ONE_SHOT_SERVO_HOME = 27,
	/*
	 * Add a straight move of enabled servo motors (mask) and enabled axes of the pulse engine
	 * (index: one bit each), of 8 in all, to the queue. value[] and fraction[] = target
	 * position of each, in the order of their numbers, motors first: counts of a motor's
	 * encoder as for SERVO_PLACE, and pulses of an axis. parameter[0] = speed along the path,
	 * units/s, 0 = as fast as they can move. Done when the move is in the queue; if it is
	 * refused, state.moves.refused has the reason. After a refused move, after a path that
	 * ended early and at the beginning of a session, the daemon refuses all moves until one has
	 * POKEYS_MOVE_BEGINS.
	 * They have to stay enabled; their commanded positions do not matter until the path has
	 * ended. The daemon then holds each until its commanded position has matched its held
	 * position for 0.1 s.
	 */
	POKEYS_ONE_SHOT_MOVE = 28,
	/* index = enum pokeys_moves_control; of FEED, parameter[0] = 0 to 2 */
	POKEYS_ONE_SHOT_MOVES_CONTROL = 29,
	/*
	 * Search for a servo motor's gains: the daemon drives the motor back and forth around its
	 * position, by about half of parameter[0] (units) to each side, with an output of at most
	 * parameter[1] (0 = max-output). Refused if the motor is not enabled or is moving, if a
	 * limit switch is pressed or a soft limit too near, or if the distance is less than 96
	 * counts of the encoder. The motor has to stay enabled; it is off at the end. Distance 0
	 * ends the search. Done when it has begun; state.servo[].tuning shows its progress.
	 */
	POKEYS_ONE_SHOT_SERVO_TUNE = 30,
};

/* Controls the path. ABORT and STOP are refused if there is no path. */
enum pokeys_moves_control {
	POKEYS_MOVES_HOLD = 0, /* slow down on the path, and wait there */
	POKEYS_MOVES_RESUME = 1,
	POKEYS_MOVES_FEED = 2,  /* part of the commanded speeds, until the session ends */
	POKEYS_MOVES_ABORT = 3, /* slow down on the path, and discard the rest */
	POKEYS_MOVES_STOP = 4,  /* stop the commanded positions at once, and discard
				 * the rest; an axis in position mode passes its
				 * position and comes back to it, and with one in
				 * buffered mode this is ABORT */
};

struct pokeys_one_shot {
	uint32_t id;       /* the n-th one-shot of this session is n */
	uint8_t operation; /* enum pokeys_one_shot_operation */
	uint8_t index;
	uint8_t mask;
	uint8_t flags;
	int32_t value[8];
	float parameter[4];
	uint8_t fraction[8]; /* MOVE: 256ths, added to value[] */
};

struct pokeys_command {
	uint32_t magic;
	uint16_t version, size_units;
	uint64_t hash;
	uint64_t heartbeat;   /* changes at each write */
	uint64_t t_ns;        /* CLOCK_MONOTONIC of the write */
	uint64_t t_thread_ns; /* when the servo thread's last read of the state began;
			       * 0 = it has not read any. Also for phase lock */
	uint64_t period_ns;   /* of the commander */
	uint32_t session;     /* differs for each start of the commander, never 0 */
	uint32_t flags;       /* POKEYS_COMMAND_* */
	/*
	 * How old the fast data were when the commander read them, ns, before its
	 * last writes: that before this one at [heartbeat % 16]; 0 = not fresh, or
	 * not known. Several, because the daemon may read less often than the
	 * commander writes, and the histogram shall miss none.
	 */
	uint32_t read_age_ns[POKEYS_READ_AGES];

	uint8_t digital_out[POKEYS_PIN_BYTES];      /* value */
	uint8_t digital_out_mask[POKEYS_PIN_BYTES]; /* 1 = commanded by us */
	uint32_t pwm_duty[POKEYS_PWM];              /* ticks */
	uint32_t pwm_period;                        /* ticks; 0 = leave */
	uint32_t pwm_enable;                        /* bit = channel */
	uint8_t poextbus[16];                       /* [0..9] */
	uint8_t poextbus_mask[16];
	uint8_t external_outputs, external_outputs_mask, relays, relays_mask;
	uint32_t reserved;
	uint8_t ponet_data[POKEYS_PONET][16];
	uint8_t ponet_brightness[POKEYS_PONET];
	uint32_t ponet_mask; /* bit = module is commanded */
	uint8_t kbd48_flags; /* POKEYS_KBD48_* */
	uint8_t kbd48_brightness;
	uint8_t reserved3[2];
	uint64_t kbd48_leds; /* bits as in state.kbd48_keys */
	struct pokeys_axis_command axis[POKEYS_AXES];
	float heater_target[POKEYS_HEATERS]; /* degrees C, 0 = off */
	uint32_t heater_mask;                /* bit = heater is commanded; others are
					      * off */
	struct pokeys_servo_command servo[POKEYS_SERVOS];

	uint32_t one_shot_head; /* one-shots ever queued in this session */
	uint32_t reserved2;
	struct pokeys_one_shot one_shot[POKEYS_ONE_SHOTS]; /* [id % 64] */
};

#ifdef __cplusplus
}
#endif

#endif /* POKEYS_COMMAND_H */
