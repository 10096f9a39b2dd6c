/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_PINS_H
#define SIM_PINS_H

#include <stdbool.h>
#include <stdint.h>

/*
 * The 55 pins: what they are configured as, what is latched into outputs,
 * what level stands on them, and digital counters (protocol sections 3.2 to
 * 3.5). Pins are counted from 0 here, as in the I/O commands on the wire.
 */

#define SIM_PINS 55
#define SIM_NO_PIN 0xFF

/* Pin function byte. */
#define SIM_PIN_DIGITAL_IN 0x02
#define SIM_PIN_DIGITAL_OUT 0x04
#define SIM_PIN_ANALOG_IN 0x08
#define SIM_PIN_TRIGGERED_IN 0x20
#define SIM_PIN_COUNTER 0x40
#define SIM_PIN_INVERT 0x80

/* Counter option byte. */
#define SIM_COUNT_RISING 0x01
#define SIM_COUNT_FALLING 0x02

struct sim_pins_config {
	uint8_t function[SIM_PINS];
	uint8_t counter_option[SIM_PINS];
	uint8_t direction[SIM_PINS]; /* counter direction pin code, 0 none */
	uint8_t connection_signal;   /* 0x1B */
	uint8_t startup_auto;        /* 0x1E */
	uint8_t startup_valid;
	uint8_t startup_values[7];
};

struct sim_pins {
	uint64_t latch; /* bit = pin: logical value last written */
	uint64_t level; /* electrical level after the last settling */
	uint32_t counter[SIM_PINS];
};

/* What stands outside of the pins. */
struct sim_pins_bench {
	uint64_t level;         /* driven from outside; pulled up when nothing does */
	uint8_t wire[SIM_PINS]; /* pin which drives this one, or SIM_NO_PIN */
};

struct sim_device;

/* Power-up of the runtime part: latches from the startup settings, counters 0. */
void sim_pins_reset(struct sim_device *dev);

/* The bench with nothing connected. */
void sim_pins_bench_init(struct sim_pins_bench *bench);

/* Works out every level again and counts the edges. Call after any change. */
void sim_pins_settle(struct sim_device *dev);

/* Electrical level of a pin, 0 or 1; a pin which does not exist reads 1. */
unsigned int sim_pin_level(const struct sim_device *dev, unsigned int pin);

/* Input bitmap as 0xCC reports it (bit = pin). */
uint64_t sim_pins_inputs(const struct sim_device *dev);

/* Latches new values into the digital outputs named by mask. */
void sim_pins_write(struct sim_device *dev, uint64_t values, uint64_t mask);

#endif
