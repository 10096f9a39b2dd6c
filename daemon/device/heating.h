/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The heaters of a device: which sensor and which output each of them has.
 */
#ifndef DEVICE_HEATING_H
#define DEVICE_HEATING_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/state.h>
#include "daemon/device/loops.h"
#include "daemon/loops/heater.h"
#include "daemon/loops/power.h"
#include "daemon/loops/switching.h"
#include "wire/io.h"

/* pokeysd.conf has gains for a power of 0 to 255, as Marlin and Klipper have them. */
#define HEATING_GAIN_SCALE 255
#define HEATING_GAIN_MOST 100000

/* What a heater bears of its device. */
enum {
	HEATING_FAILSAFE_MOST = 50,     /* x100 ms: longer, nobody switches it off for too long */
	HEATING_FILTER_MOST = 100,      /* RC of the analog inputs' filter */
	HEATING_PERIOD_LEAST = 250,     /* ticks of PWM, so that a power is one of as many */
	HEATING_PERIOD_MOST = 25000000, /* 1 s */
};

enum heating_output {
	HEATING_NO_OUTPUT, /* of a fan that there is not */
	HEATING_PWM,
	HEATING_PIN, /* a digital output */
};

/* Runs while the heater is hot, or may be. */
struct heating_fan_config {
	uint8_t kind;   /* enum heating_output */
	uint8_t output; /* PWM channel, or pin, from 0 */
	double speed;   /* PWM: 0 to 1 */
	struct fan_config fan;
};

struct heating_config {
	char name[32];
	struct heater_config heater;
	uint8_t sensor;    /* analog input, 0 = terminal 41 */
	uint8_t kind;      /* enum heating_output */
	uint8_t output;    /* PWM channel, or pin, from 0 */
	uint64_t least_ns; /* PIN: on, and off, at least so long */
	double within;     /* at temperature if so near to the target, K */
	double watts;      /* at a power of 1; 0: not known, nor needed */
	struct heating_fan_config fan;
	bool stops_machine;    /* a fault of it stops the servo motors as well */
	bool without_failsafe; /* it may heat although the device cannot switch it off */
};

/* The state of one heater. */
struct heating {
	struct heater heater;
	struct switching switching;
	bool good; /* its configuration can be used */
	bool on;   /* PIN */
	bool fan;  /* is to run */
	/* something else of the device has a terminal of it, or of its fan */
	bool shared, fan_shared;
	struct left_on hot;  /* it heated, or heats */
	uint64_t sampled_ns; /* of the newest reading that it was given */
	uint32_t faults;
	/* what was said last */
	uint8_t fault, refusal, tuning;
};

struct heatings {
	uint8_t count;
	uint64_t step_ns; /* of the next step */
	struct heating heating[POKEYS_HEATERS];
};

/* The commander's targets: finite numbers, of which heater_command() checks the range. */
struct heating_wish {
	uint32_t mask; /* bit = heater is commanded */
	double target[POKEYS_HEATERS];
};

struct device;

/* After a step: all of them together get no more than the supply has. */
void heating_supply(struct device *device);

/* After a step: the fans of heaters that are hot run. */
void heating_fans(struct device *device);
/* The output of a heater's fan is there and set up; true also without a fan. */
bool heating_fan_usable(const struct device *device, unsigned int index);
/* A pin has neither more nor fewer functions than pokeysd.conf wants. */
bool heating_is_as_wanted(const struct device *device, unsigned int pin);
/* Their pins, and those of them that run; their PWM channels; their part of a request. */
uint64_t heating_fan_pins(const struct device *device);
uint64_t heating_fan_pins_on(const struct device *device);
uint8_t heating_fan_channels(const struct device *device);
void heating_fan_pwm(const struct device *device, struct wire_pwm_req *pwm);
enum pokeys_heater_fan heating_fan_state(const struct device *device, unsigned int index);

void heating_init(struct device *device);

/* In each cycle, before anything is sent. */
void heating_cycle(struct device *device);

/* Pins that are outputs of heaters or of their fans, and those of them that are on. */
uint64_t heating_pins(const struct device *device);
uint64_t heating_pins_on(const struct device *device);

/* Pins and channels of heaters that are off, which the device has not acknowledged. */
uint64_t heating_pins_stopping(const struct device *device);
uint8_t heating_channels_stopping(const struct device *device);
/* A heater that the failsafe switches off may be on in the device. */
bool heating_may_heat(const struct device *device);

/* Bit = PWM channel of a heater or of a fan. */
uint8_t heating_channels(const struct device *device);
/* Their part of a request; what else is in it stays. */
void heating_pwm(const struct device *device, struct wire_pwm_req *pwm);

/* Another commander than before. */
void heating_session(struct device *device);

/* The device's own failsafe has to switch off what it may have been left with. */
bool heating_covered(const struct device *device);

/* A heater is off for so long without the device having acknowledged it that only silence helps. */
bool heating_unheard(const struct device *device);
/* The device's failsafe has acted: what it switches off is off. It has just begun: all are. */
void heating_stopped_itself(struct device *device);
void heating_began_again(struct device *device);

/* Forget which terminals something else has; then mark those of an owner of settings/terminal.h. */
void heating_unshare(struct device *device);
void heating_share(struct device *device, const char *key, unsigned int index);

/* For finding out what uses a terminal. */
struct terminal_daemon;
void heating_terminals(const struct heating_config *config, unsigned int count,
		       struct terminal_daemon *out);

/* One whose faults stop the whole machine has a fault. */
bool heating_stops_machine(const struct device *device);

/* All of them are off. */
bool heating_off(const struct device *device);

/* One-shots, by a heater's index. All return false if they refuse. */
bool heating_reset(struct device *device, unsigned int index);
bool heating_tune(struct device *device, unsigned int index, double target);
/* `which` is enum pokeys_gain, the value in units of HEATING_GAIN_SCALE. */
bool heating_regain(struct device *device, unsigned int index, unsigned int which, double value);

#endif
