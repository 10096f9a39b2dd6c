// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The simulator's own random numbers. Everything random in the simulator and
 * in its tests is drawn from here, so one 64-bit seed, printed at the start,
 * repeats a run exactly: same losses, same delays, same bits flipped.
 *
 * sim_prng_chance() draws nothing for a probability of zero. A fault which is
 * switched off therefore does not shift the stream of those switched on.
 */
#include "sim/prng.h"

#include <math.h>

static uint64_t rotate_left(uint64_t x, int k)
{
	return (x << k) | (x >> (64 - k));
}

static uint64_t splitmix(uint64_t *state)
{
	uint64_t z = (*state += 0x9e3779b97f4a7c15u);

	z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
	z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
	return z ^ (z >> 31);
}

void sim_prng_init(struct sim_prng *prng, uint64_t seed)
{
	for (int i = 0; i < 4; i++)
		prng->s[i] = splitmix(&seed);
}

uint64_t sim_prng_next(struct sim_prng *prng)
{
	uint64_t *s = prng->s;
	uint64_t result = rotate_left(s[1] * 5, 7) * 9;
	uint64_t t = s[1] << 17;

	s[2] ^= s[0];
	s[3] ^= s[1];
	s[1] ^= s[2];
	s[0] ^= s[3];
	s[2] ^= t;
	s[3] = rotate_left(s[3], 45);
	return result;
}

double sim_prng_unit(struct sim_prng *prng)
{
	return (double)(sim_prng_next(prng) >> 11) * 0x1p-53;
}

uint64_t sim_prng_below(struct sim_prng *prng, uint64_t bound)
{
	__extension__ typedef unsigned __int128 wide;

	return (uint64_t)(((wide)sim_prng_next(prng) * bound) >> 64);
}

int sim_prng_chance(struct sim_prng *prng, double p)
{
	return p > 0 && sim_prng_unit(prng) < p;
}

double sim_prng_exponential(struct sim_prng *prng, double mean)
{
	return -mean * log(1.0 - sim_prng_unit(prng));
}
