/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The servo motors of a device: which encoder and which outputs each of them has.
 */
#ifndef DEVICE_SERVOING_H
#define DEVICE_SERVOING_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/state.h>
#include "daemon/device/loops.h"
#include "daemon/loops/drive.h"
#include "daemon/loops/servo.h"
#include "daemon/loops/servo_home.h"
#include "daemon/loops/servo_tune.h"
#include "wire/io.h"

enum {
	SERVOING_NONE = 255,          /* no such pin, or channel */
	SERVOING_FAILSAFE_MOST = 10,  /* x100 ms: longer, an axis runs too far */
	SERVOING_PERIOD_LEAST = 250,  /* ticks of PWM, so that a duty is one of as many */
	SERVOING_PERIOD_MOST = 25000, /* 1 ms: a new duty is in effect in the next cycle */
};

struct servoing_config {
	char name[32];
	struct servo_config servo;
	struct drive_config drive;
	uint8_t encoder;
	uint8_t pwm, reverse_pwm;         /* channels */
	uint8_t direction, enable;        /* pins, from 0 */
	uint8_t low, high;                /* pins of the limit switches */
	bool low_inverted, high_inverted; /* pressed while low */
	uint8_t home_pin;                 /* home switch: one of those, or another pin, from 0 */
	bool home_inverted;
	struct servo_home_config home;
	double acceleration;   /* on a path, units/s^2 */
	bool inverted;         /* an output above 0 makes the position shrink */
	bool without_failsafe; /* it may run although the device cannot stop it */
};

/* The state of one motor. */
struct servoing {
	struct servo servo;
	struct servo_home home;
	struct servo_tune tune;
	struct drive drive;
	struct drive_wires wires;
	bool good;             /* its configuration can be used */
	bool shared;           /* something else of the device has a terminal of it */
	struct left_on driven; /* it was enabled, or is */
	uint32_t faults;
	/* what was said last */
	uint8_t fault, refusal, home_end, tuning;
};

struct servoings {
	uint8_t count;
	uint8_t counts_epoch[POKEYS_ENCODERS]; /* its counter was written, or set up again */
	struct servoing servoing[POKEYS_SERVOS];
};

/* What the commander wants; servo_step() judges it. */
struct servoing_wish {
	bool enable;
	double position, velocity; /* units, units/s; NaN: not known */
};

struct device;

void servoing_init(struct device *device);

/* In each cycle, before anything is sent. */
void servoing_cycle(struct device *device);

/* Another commander than before. */
void servoing_session(struct device *device);

/* Pins that are outputs of motors, and those of them that are on. */
uint64_t servoing_pins(const struct device *device);
uint64_t servoing_pins_on(const struct device *device);

/* Pins and channels of motors that are off, which the device has not acknowledged. */
uint64_t servoing_pins_stopping(const struct device *device);
uint8_t servoing_channels_stopping(const struct device *device);
/* A motor that the failsafe stops is enabled, or was and may still be so in the device. */
bool servoing_may_run(const struct device *device);

/* Bit = PWM channel of a motor. */
uint8_t servoing_channels(const struct device *device);
/* Their part of a request; what else is in it stays. */
void servoing_pwm(const struct device *device, struct wire_pwm_req *pwm);

/* The device's own failsafe has to stop what it may have been left with. */
bool servoing_covered(const struct device *device);

/* A motor is off for so long without the device having acknowledged it that only silence helps. */
bool servoing_unheard(const struct device *device);
/* The device's failsafe has acted: what it stops is off. It has just begun: all of them are. */
void servoing_stopped_itself(struct device *device);
void servoing_began_again(struct device *device);

/* Forget which terminals something else has; then mark those of an owner of settings/terminal.h. */
void servoing_unshare(struct device *device);
void servoing_share(struct device *device, const char *key, unsigned int index);

/* For finding out what uses a terminal. */
struct terminal_daemon;
void servoing_terminals(const struct servoing_config *config, unsigned int count,
			struct terminal_daemon *out);

/* None of them is enabled; and the device has acknowledged that. */
bool servoing_off(const struct device *device);
bool servoing_standing(const struct device *device);

/* Its index input sets the counter of this encoder to 0. */
bool servoing_index_resets(const struct device *device, uint8_t encoder);
/* A switch, or none, is pressed. */
bool servoing_is_pressed(const struct device *device, uint8_t pin, bool inverted);
/* A pin has neither more nor fewer functions than pokeysd.conf wants, this one among them. */
bool servoing_is_as_wanted(const struct device *device, uint8_t pin, uint8_t function);

/* In each cycle, before a motor's step: what is commanded while it is homing. */
void servoing_home_step(struct device *device, unsigned int index, struct servo_wish *wish);
/* It is homing with this limit switch, which therefore does not stop it. */
bool servoing_seeks(const struct device *device, unsigned int index, bool low);
void servoing_home_show(struct device *device, unsigned int index);

/*
 * Likewise: its output while it searches for its gains. `settled`: the device has acknowledged what
 * is on the wires.
 */
void servoing_tune_step(struct device *device, unsigned int index, bool settled);
void servoing_tune_show(struct device *device, unsigned int index);
/* It searches: nothing else may move it. */
bool servoing_tunes(const struct device *device, unsigned int index);

/* May this encoder's counter be written? That of its bank are written with it. */
bool servoing_may_write(const struct device *device, unsigned int encoder);
/* May it be set to 0 by its index? The fast ones have one switch for it. */
bool servoing_may_arm(const struct device *device, unsigned int encoder);
/* Counters of these encoders (bits) were written, or begin again. */
void servoing_written(struct device *device, uint32_t encoders);

/* One-shots, by a motor's index. All return false if they refuse. */
bool servoing_reset(struct device *device, unsigned int index);
bool servoing_place(struct device *device, unsigned int index, int32_t counts, bool homed);
/* Begin homing, or end it. */
bool servoing_home(struct device *device, unsigned int index, bool end);
/* Search for gains, within so many units; 0: end it. */
bool servoing_tune(struct device *device, unsigned int index, double distance, double most);
/* `which` is enum pokeys_gain. */
bool servoing_regain(struct device *device, unsigned int index, unsigned int which, double value);

#endif
