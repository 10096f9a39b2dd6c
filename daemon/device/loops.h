/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The closed loops of a device, heaters and servo motors, for whoever only has to know that some
 * outputs are theirs. Realtime thread only.
 */
#ifndef DEVICE_LOOPS_H
#define DEVICE_LOOPS_H

#include <stdbool.h>
#include <stdint.h>
#include "wire/io.h"

struct device;

/* An output that a loop has switched on: the device may have it on until off is acknowledged. */
struct left_on {
	bool on;
	bool said;         /* that the device does not acknowledge it, and no failsafe helps */
	uint64_t off_ns;   /* to be off since then; 0: it is not */
	uint64_t asked_ns; /* ... by a device that was found */
};

/* In each cycle: it is on, or it is to be off and the device has acknowledged so, or not yet. */
void left_on(struct left_on *left);
void left_off(const struct device *device, struct left_on *left, bool settled);
/* Off is not acknowledged for so long, by a device that was there; by whatever device. */
bool left_on_late(const struct device *device, const struct left_on *left, uint64_t limit_ns);
bool left_on_long(const struct device *device, const struct left_on *left, uint64_t limit_ns);

void loops_init(struct device *device);

/* In each cycle, before anything is sent. */
void loops_cycle(struct device *device);

/* Another commander than before. */
void loops_session(struct device *device);

/* Pins that are their outputs, and those of them that are on. */
uint64_t loops_pins(const struct device *device);
uint64_t loops_pins_on(const struct device *device);

/* Bit = PWM channel of theirs; their part of a request, whose other channels stay. */
uint8_t loops_channels(const struct device *device);
void loops_pwm(const struct device *device, struct wire_pwm_req *pwm);
/* PWM channels at the terminals of their digital outputs: enabled, they would drive these. */
uint8_t loops_channels_forbidden(const struct device *device);

/* The board has a terminal for this PWM channel, and a period in this range, in ticks. */
bool loops_have_pwm(const struct device *device, unsigned int channel, uint32_t least,
		    uint32_t most);

/* All of them are off. */
bool loops_off(const struct device *device);

/* Pins and channels of those that are off, which the device has not acknowledged. */
uint64_t loops_pins_stopping(const struct device *device);
uint8_t loops_channels_stopping(const struct device *device);
/* As safe_pins_settled(), of the duty (ticks) of a channel, and of the pulses before. */
bool loops_duty_settled(const struct device *device, unsigned int channel, uint32_t duty);
/* One that the failsafe switches off may be on in the device. */
bool loops_may_run(const struct device *device);

/* What the device has acknowledged may not be so any more: its failsafe may have acted. */
void loops_doubt(struct device *device);

/* The device's own failsafe has to switch off what it may have been left with. */
bool loops_covered(const struct device *device);
/* It has had its turn: what it switches off is off. */
void loops_stopped_itself(struct device *device);
/* The device has just begun: all of them are off. */
void loops_began_again(struct device *device);

/* Forget which terminals something else has; then mark those of an owner of settings/terminal.h. */
void loops_unshare(struct device *device);
void loops_share(struct device *device, const char *key, unsigned int index);

#endif
