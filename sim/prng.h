/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_PRNG_H
#define SIM_PRNG_H

#include <stdint.h>

/*
 * Random numbers which are the same on every machine: xoshiro256** 1.0 by
 * Blackman and Vigna (public domain), seeded through splitmix64 as its
 * authors advise, so that seeds 0, 1, 2 ... give unrelated streams. libc's
 * rand() would make a seed printed by a failing test worthless elsewhere.
 */
struct sim_prng {
	uint64_t s[4];
};

/* Any seed will do, 0 included. */
void sim_prng_init(struct sim_prng *prng, uint64_t seed);

/* 64 random bits. */
uint64_t sim_prng_next(struct sim_prng *prng);

/* Uniform in [0, 1), 53 bits. */
double sim_prng_unit(struct sim_prng *prng);

/* Uniform in [0, bound); 0 when bound is 0. The bias is below bound / 2^64. */
uint64_t sim_prng_below(struct sim_prng *prng, uint64_t bound);

/* True with probability p; draws nothing when p <= 0. */
int sim_prng_chance(struct sim_prng *prng, double p);

/* Exponentially distributed with the given mean. */
double sim_prng_exponential(struct sim_prng *prng, double mean);

#endif
