/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_ENCODER_H
#define SIM_ENCODER_H

#include <stdbool.h>
#include <stdint.h>

/*
 * Encoders (protocol section 3.8): 0..24 normal, of which 0..2 are replaced
 * by the fast ones when those are switched on, and 25 ultra fast. Outside
 * stands a shaft with a position in quadrature steps (four to a cycle); the
 * device counts one, two or four of them as it is configured.
 */

#define SIM_ENCODERS 26
#define SIM_BASIC_ENCODERS 25
#define SIM_ULTRA_FAST 25

#define SIM_TICK_HZ 25000000u	/* clock of the rotation timer */

#define SIM_ENC_ENABLE 0x01
#define SIM_ENC_X4 0x02
#define SIM_ENC_X2 0x04

struct sim_encoders_config {
	uint8_t option[SIM_BASIC_ENCODERS];
	uint8_t pins[2 * SIM_BASIC_ENCODERS]; /* channel A of all, then B of all */
	uint8_t fast;                         /* 0xCE @2 */
	uint8_t fast_index;                   /* 0xCE @3 bit 0 */
	uint8_t ultra_on;                     /* 0x1C @2 */
	uint8_t ultra_options;                /* 0x1C @3: invert, A=dir B=clock, 4x */
	uint32_t ultra_filter;
};

struct sim_encoders {
	uint32_t raw[SIM_ENCODERS];
	uint8_t ultra_armed;  /* 1: reset on the next index */
	uint32_t index_count; /* ultra fast */
	uint64_t index_ns;
	uint32_t index_ticks; /* ticks of the last rotation, 25 MHz */
	int32_t ultra_speed;  /* counts of the last 100 ms */
	uint32_t ultra_mark;
};

/* The shafts. */
struct sim_shaft {
	int64_t position;    /* quadrature steps */
	int64_t rate;        /* steps per second, turning by itself */
	int64_t rest;        /* of rate, in step * ms */
	int64_t index_every; /* steps from index to index, 0 none */
};

struct sim_device;

/* Counters to 0: power-up. */
void sim_encoders_reset(struct sim_device *dev);

/* Turns a shaft by so many quadrature steps. */
void sim_encoder_turn(struct sim_device *dev, unsigned int encoder, int64_t steps);

/* Counts to a turn of that many steps, with the sign it counts in; 0: it is off. */
double sim_encoder_counts(const struct sim_device *dev, unsigned int encoder, int64_t steps);

/* Ticks of the spindle's last turn; of the one under way if that takes longer already. */
uint32_t sim_spindle_ticks(const struct sim_device *dev);

/* One index pulse. */
void sim_encoder_index(struct sim_device *dev, unsigned int encoder);

/* One millisecond of shafts which turn by themselves. */
void sim_encoders_slot(struct sim_device *dev);

/* Follows the levels of the encoder pins; called when pins have changed. */
void sim_encoders_pins(struct sim_device *dev, uint64_t before, uint64_t after);

#endif
