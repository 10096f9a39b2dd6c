/* SPDX-License-Identifier: MIT */
/*
 * Closed loops of the daemon in the state image: heaters and servo motors. A part of state.h, which
 * has the rules for changes; a program includes that.
 */
#ifndef POKEYS_LOOP_H
#define POKEYS_LOOP_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
	POKEYS_HEATERS = 7, /* one for each analog input */
	POKEYS_SERVOS = 6,  /* one for each PWM output */
};

/* Gains that can be changed while a loop runs; a heater has the first three. */
enum pokeys_gain {
	POKEYS_GAIN_P = 0,
	POKEYS_GAIN_I = 1,
	POKEYS_GAIN_D = 2,
	POKEYS_GAIN_VELOCITY = 3,
	POKEYS_GAIN_ACCELERATION = 4,
	POKEYS_GAINS
};

/* Why a heater or a servo motor cannot be used: of a condition DEVICE, the first that applies. */
enum pokeys_obstacle {
	POKEYS_OBSTACLE_NONE = 0,
	POKEYS_OBSTACLE_LINK = 1,      /* the device does not run */
	POKEYS_OBSTACLE_SHARED = 2,    /* something else uses a terminal of it */
	POKEYS_OBSTACLE_SENSOR = 3,    /* its terminal is no analog input any more */
	POKEYS_OBSTACLE_FILTER = 4,    /* the filter of the analog inputs is too slow */
	POKEYS_OBSTACLE_ENCODER = 5,   /* the encoder is off */
	POKEYS_OBSTACLE_INDEX = 6,     /* the index input resets the encoder's count */
	POKEYS_OBSTACLE_OUTPUT = 7,    /* an output is not set up as in pokeysd.conf */
	POKEYS_OBSTACLE_PWM = 8,       /* no such channel on the board, or another period */
	POKEYS_OBSTACLE_LIMIT = 9,     /* the input of a limit switch is not set up */
	POKEYS_OBSTACLE_FAN = 10,      /* the output of its fan is not set up, or not there */
	POKEYS_OBSTACLE_FAILSAFE = 11, /* the device's failsafe would leave it on */
	POKEYS_OBSTACLE_CONFIG = 12,   /* its configuration cannot be used */
};

enum pokeys_heater_state {
	POKEYS_HEATER_NONE = 0, /* pokeysd.conf has no such heater */
	POKEYS_HEATER_OFF = 1,
	POKEYS_HEATER_HEATING = 2,  /* it has a target */
	POKEYS_HEATER_TUNING = 3,   /* it oscillates to find its gains */
	POKEYS_HEATER_FAULT = 4,    /* off, until it is reset */
	POKEYS_HEATER_STOPPING = 5, /* off, but the device has not acknowledged that yet */
};

/* Why a heater was switched off, or could not be switched on. */
enum pokeys_heater_fault {
	POKEYS_HEATER_FINE = 0,
	POKEYS_HEATER_DEVICE = 1, /* the device is lost, was restarted, or cannot be used */
	POKEYS_HEATER_STALE = 2,  /* no readings of the sensor */
	POKEYS_HEATER_ODD = 3,    /* the reading is no number */
	POKEYS_HEATER_OPEN = 4,   /* the sensor's wire is broken */
	POKEYS_HEATER_SHORTED = 5,
	POKEYS_HEATER_OVER = 6,      /* above max-temperature, also while off */
	POKEYS_HEATER_UNDER = 7,     /* below min-temperature */
	POKEYS_HEATER_JUMP = 8,      /* the temperature changes faster than max-rate */
	POKEYS_HEATER_NO_RISE = 9,   /* it heats and does not get warm */
	POKEYS_HEATER_FELL = 10,     /* it does not stay warm */
	POKEYS_HEATER_UNHEEDED = 11, /* full power has no effect */
};

/* Why the last target was not taken. */
enum pokeys_heater_refusal {
	POKEYS_HEATER_TAKEN = 0,
	POKEYS_HEATER_OUT_OF_RANGE = 1, /* the previous target stays */
	POKEYS_HEATER_AFTER_FAULT = 2,  /* off (0) has to be commanded first */
	POKEYS_HEATER_NOT_READY = 3,    /* heater.condition would be a fault at once */
};

enum pokeys_heater_tuning {
	POKEYS_HEATER_TUNING_NONE = 0,
	POKEYS_HEATER_TUNING_RUNS = 1,
	POKEYS_HEATER_TUNING_DONE = 2,
	POKEYS_HEATER_TUNING_FAILED = 3, /* by a fault, another command, or after an hour */
};

enum pokeys_heater_fan {
	POKEYS_HEATER_FAN_NONE = 0,
	POKEYS_HEATER_FAN_OFF = 1,
	POKEYS_HEATER_FAN_ON = 2,
};

/*
 * A closed loop of the daemon's; heater[0] is the first [heater NAME] of the device in
 * pokeysd.conf. Gains are for a power of 0 to 255, kelvin and seconds.
 */
struct pokeys_heater {
	uint64_t t_ns;                   /* when the temperature was measured */
	float temperature;               /* degrees C; NaN = not known */
	float target;                    /* in effect, degrees C; 0 = off */
	float power;                     /* 0 to 1 */
	float minimum, maximum;          /* degrees C; outside is a fault */
	float target_maximum, p, i, d;   /* degrees C; gains in effect */
	float tuned_p, tuned_i, tuned_d; /* found by the last tuning; valid if it is done */
	uint32_t fault_count;            /* faults since the daemon's start */
	uint16_t tune_cycles;            /* oscillations of the last tuning */
	uint8_t state;                   /* enum pokeys_heater_state */
	uint8_t fault;                   /* enum pokeys_heater_fault: this switched it off */
	uint8_t condition;               /* likewise: what is wrong now */
	uint8_t refused;                 /* enum pokeys_heater_refusal */
	uint8_t tuning;                  /* enum pokeys_heater_tuning */
	uint8_t at_temperature;          /* 1 = within at-temperature-k of its target */
	uint8_t limited;                 /* 1 = max-heater-power-w gives it less than it asks for */
	uint8_t fan;                     /* enum pokeys_heater_fan */
	uint8_t stops_machine;           /* 1 = on-fault = machine */
	uint8_t obstacle;                /* enum pokeys_obstacle: why condition is DEVICE */
	char name[32];                   /* of its section, NUL terminated */
};

enum pokeys_servo_state {
	POKEYS_SERVO_NONE = 0, /* pokeysd.conf has no such motor */
	POKEYS_SERVO_OFF = 1,
	POKEYS_SERVO_ENABLED = 2,
	POKEYS_SERVO_FAULT = 3,    /* off, until it is reset */
	POKEYS_SERVO_STOPPING = 4, /* off, but the device has not acknowledged that yet */
};

/* Why a servo motor was stopped, or could not be enabled. */
enum pokeys_servo_fault {
	POKEYS_SERVO_FINE = 0,
	POKEYS_SERVO_DEVICE = 1,      /* the device is lost, was restarted, or cannot be used */
	POKEYS_SERVO_STALE = 2,       /* no readings of the encoder */
	POKEYS_SERVO_EMERGENCY = 3,   /* emergency stop */
	POKEYS_SERVO_JUMP = 4,        /* the encoder counts faster than the axis can move */
	POKEYS_SERVO_ODD = 5,         /* the command is no number, or impossibly fast */
	POKEYS_SERVO_FOLLOWING = 6,   /* too far from the commanded position */
	POKEYS_SERVO_STALLED = 7,     /* it is pushed hard, and does not move */
	POKEYS_SERVO_SILENT = 8,      /* the output changes, and the encoder does not count */
	POKEYS_SERVO_RUNAWAY = 9,     /* it gets faster against its output */
	POKEYS_SERVO_SOFT_LIMIT = 10, /* commanded beyond min-position or max-position */
	POKEYS_SERVO_SWITCH = 11,     /* at a limit switch */
	POKEYS_SERVO_HEATER = 12,     /* a heater with on-fault = machine has a fault */
};

/* Why it was not enabled. */
enum pokeys_servo_refusal {
	POKEYS_SERVO_TAKEN = 0,
	POKEYS_SERVO_AFTER_FAULT = 1, /* the fault has to be reset first */
	POKEYS_SERVO_NOT_READY = 2,   /* servo.condition would be a fault at once */
	POKEYS_SERVO_ELSEWHERE = 3,   /* the commanded position is not where the axis is */
	POKEYS_SERVO_OFF_FIRST = 4,   /* off has to be commanded first */
	POKEYS_SERVO_UNREAD = 5,      /* its commander does not read the position */
};

/* What the daemon does to find the home switch of a motor that is enabled. */
enum pokeys_servo_homing {
	POKEYS_SERVO_HOMING_NONE = 0,     /* the commander moves it */
	POKEYS_SERVO_HOMING_LEAVE = 1,    /* off the switch, on which it was at the beginning */
	POKEYS_SERVO_HOMING_SEARCH = 2,   /* towards the switch */
	POKEYS_SERVO_HOMING_BACK = 3,     /* off it again */
	POKEYS_SERVO_HOMING_APPROACH = 4, /* slowly, for its exact place */
	POKEYS_SERVO_HOMING_GO = 5,       /* to home-position */
	POKEYS_SERVO_HOMING_HOLD = 6,     /* over; held until the commanded position is there */
};

/* How the last homing of a motor has ended. */
enum pokeys_servo_home_end {
	POKEYS_SERVO_HOME_NONE = 0, /* there was none, or it has not ended */
	POKEYS_SERVO_HOME_DONE = 1,
	POKEYS_SERVO_HOME_ABORTED = 2,   /* on request */
	POKEYS_SERVO_HOME_STOPPED = 3,   /* the motor was switched off, or had a fault */
	POKEYS_SERVO_HOME_NOT_FOUND = 4, /* no switch within home-distance */
	POKEYS_SERVO_HOME_NOT_LEFT = 5,  /* the switch stays pressed */
	POKEYS_SERVO_HOME_LATE = 6,      /* it took too long */
	POKEYS_SERVO_HOME_UNREAD = 7,    /* no readings of the switch */
};

enum pokeys_servo_tuning {
	POKEYS_SERVO_TUNING_NONE = 0,
	POKEYS_SERVO_TUNING_RUNS = 1,
	POKEYS_SERVO_TUNING_DONE = 2,
	POKEYS_SERVO_TUNING_FAILED = 3,
};

/* Why the last search for gains has found none. */
enum pokeys_servo_tune_reason {
	POKEYS_SERVO_TUNE_FINE = 0,
	POKEYS_SERVO_TUNE_STOPPED = 1,  /* on request, switched off, or a fault */
	POKEYS_SERVO_TUNE_STILL = 2,    /* the motor does not move */
	POKEYS_SERVO_TUNE_REVERSED = 3, /* it moves against its output */
	POKEYS_SERVO_TUNE_SILENT = 4,   /* it moved, and the encoder does not count any more */
	POKEYS_SERVO_TUNE_FAR = 5,      /* it went further than it was to */
	POKEYS_SERVO_TUNE_UNLIKE = 6,   /* it does not answer as a motor does */
	POKEYS_SERVO_TUNE_LATE = 7,     /* not enough readings in 30 s */
};

/* max-age-ms is at most this: the daemon stops a motor that it could not watch for as long. */
#define POKEYS_SERVO_STALE_MOST_NS UINT64_C(100000000)

/*
 * A motor that the daemon controls; servo[0] is the first [servo NAME] of the device in
 * pokeysd.conf. Units are those of counts-per-unit. Outputs are parts of the full voltage.
 */
struct pokeys_servo {
	uint64_t t_ns;            /* when the encoder was read */
	double position;          /* units */
	double commanded;         /* units; valid while it is enabled */
	double counts_per_unit;   /* below 0: the encoder counts down */
	float velocity;           /* measured, units/s */
	float commanded_velocity; /* as given, or as estimated from the positions */
	float error;              /* following error, units: the position commanded at the
				   * time of the reading - position; after a fault it
				   * keeps its value */
	float output;             /* -1 to 1; above 0 the position grows */
	float minimum, maximum;   /* soft limits, units; infinite: none */
	float p, i, d;            /* gains in effect */
	float velocity_gain, acceleration_gain;
	float max_speed, max_acceleration; /* of moves, units/s and units/s^2 */
	uint32_t fault_count;              /* faults since the daemon's start */
	uint8_t state;                     /* enum pokeys_servo_state */
	uint8_t fault;                     /* enum pokeys_servo_fault: this stopped it */
	uint8_t condition;                 /* likewise: what is wrong now */
	uint8_t refused;                   /* enum pokeys_servo_refusal */
	uint8_t homed;                     /* the position is that of the machine */
	uint8_t low, high;                 /* the limit switches are pressed */
	uint8_t encoder;                   /* its number */
	uint8_t obstacle;                  /* enum pokeys_obstacle: why condition is DEVICE */
	uint8_t homing;                    /* enum pokeys_servo_homing */
	uint8_t home_end;                  /* enum pokeys_servo_home_end */
	uint8_t home;                      /* the home switch is pressed */
	uint8_t tuning;                    /* enum pokeys_servo_tuning */
	uint8_t tune_reason;               /* enum pokeys_servo_tune_reason */
	uint8_t reserved[2];
	/* found by the last tuning; valid if it is done */
	float tuned_p, tuned_i, tuned_d;
	float tuned_velocity_gain, tuned_acceleration_gain;
	float tuned_acceleration; /* that the motor can do with its full output, units/s^2 */
	char name[32];            /* of its section, NUL terminated */
};

enum {
	POKEYS_MOVES = 32, /* moves that wait, at most, with the one under way */
};

enum pokeys_moves_state {
	POKEYS_MOVES_IDLE = 0,
	POKEYS_MOVES_MOVING = 1,
	POKEYS_MOVES_HELD = 2,     /* stopped on the path, or slowing down to stop */
	POKEYS_MOVES_ABORTING = 3, /* slowing down; then the rest of the path is discarded */
	POKEYS_MOVES_HANDOVER = 4, /* ended; held until the commanded positions match */
};

/* How the last path has ended. */
enum pokeys_moves_end {
	POKEYS_MOVES_NONE = 0, /* there was none, or it has not ended */
	POKEYS_MOVES_DONE = 1,
	POKEYS_MOVES_ABORTED = 2, /* on request */
	POKEYS_MOVES_STOPPED = 3, /* a motor or axis of it was switched off, or had a fault */
};

/* Result of the last move. BROKEN does not replace the reason of an earlier refusal. */
enum pokeys_moves_refusal {
	POKEYS_MOVES_TAKEN = 0,
	POKEYS_MOVES_FULL = 1,      /* POKEYS_MOVES are waiting */
	POKEYS_MOVES_ODD = 2,       /* no such motor or axis, or one that cannot be moved, or a
				     * position or speed is invalid */
	POKEYS_MOVES_ENDING = 3,    /* the path slows down to its end */
	POKEYS_MOVES_OFF = 4,       /* a motor or axis of it is not enabled */
	POKEYS_MOVES_HOMING = 5,    /* ... is homing */
	POKEYS_MOVES_COMMANDED = 6, /* ... is moved by its commander */
	POKEYS_MOVES_LIMIT = 7,     /* it ends beyond a soft limit */
	POKEYS_MOVES_BROKEN = 8,    /* one before it was refused, or its path has ended early */
};

/* Servo motors and axes of the pulse engine that the daemon moves together along a path. */
struct pokeys_moves {
	uint32_t taken;  /* moves since the daemon's start */
	float feed;      /* part of the commanded speeds, 0 to 2 */
	float speed;     /* along the path, units/s */
	uint8_t waiting; /* moves, with the one under way */
	uint8_t motors;  /* bit = motor that is moved, or held at the end */
	uint8_t state;   /* enum pokeys_moves_state */
	uint8_t end;     /* enum pokeys_moves_end */
	uint8_t refused; /* enum pokeys_moves_refusal */
	uint8_t held;    /* 1 = POKEYS_MOVES_HOLD is in effect */
	uint8_t axes;    /* as motors, of the pulse engine */
	uint8_t reserved[5];
};

#ifdef __cplusplus
}
#endif

#endif /* POKEYS_LOOP_H */
