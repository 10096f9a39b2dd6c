// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What the faulty link does to a packet.
 *
 * - Jitter alone does not reorder: a packet waits for the one sent before it,
 *   as in a queue of a switch. Reordering is a fault of its own, or every test
 *   of jitter would in truth be a test of reordering.
 * - Bursts run in time, not per packet (a Gilbert-Elliott model with
 *   exponential stays): an outage of 50 ms is 50 ms, however much is sent.
 * - wrong_id and wrong_op mend the checksum, for otherwise they would only be
 *   another way of being corrupt. The checksum covers bytes 0..6 (protocol
 *   section 1.3).
 */
#include "sim/link_fault.h"

#include <math.h>

static uint64_t draw_period(struct sim_prng *prng, uint64_t mean_ns)
{
	return (uint64_t)sim_prng_exponential(prng, (double)mean_ns) + 1;
}

/* Runs the good and bad periods up to now. */
static bool in_burst(struct sim_link_way *way, uint64_t now_ns)
{
	const struct sim_link_faults *faults = &way->faults;

	if (!faults->burst_every_ns || !faults->burst_length_ns)
		return false;
	if (!way->burst_started) {
		way->burst_started = true;
		way->burst_bad = false;
		way->burst_change_ns = now_ns + draw_period(&way->prng, faults->burst_every_ns);
	}
	while (way->burst_change_ns <= now_ns) {
		way->burst_bad = !way->burst_bad;
		way->burst_change_ns += draw_period(&way->prng, way->burst_bad ?
									faults->burst_length_ns :
									faults->burst_every_ns);
	}
	return way->burst_bad;
}

static bool is_lost(struct sim_link_way *way, uint64_t now_ns)
{
	if (now_ns >= way->silent_from_ns && now_ns < way->silent_until_ns) {
		way->stats.lost_silence++;
		return true;
	}
	if (in_burst(way, now_ns) && sim_prng_chance(&way->prng, way->faults.burst_loss)) {
		way->stats.lost_burst++;
		return true;
	}
	if (sim_prng_chance(&way->prng, way->faults.loss)) {
		way->stats.lost++;
		return true;
	}
	return false;
}

static void mend_checksum(uint8_t *bytes)
{
	uint8_t sum = 0;

	for (int i = 0; i < 7; i++)
		sum = (uint8_t)(sum + bytes[i]);
	bytes[7] = sum;
}

/* Replaces one header byte by another value, and the checksum with it. */
static void replace(struct sim_link_way *way, uint8_t *bytes, size_t len, unsigned int at)
{
	if (len < 8)
		return;
	bytes[at] = (uint8_t)(bytes[at] + 1 + sim_prng_below(&way->prng, 255));
	mend_checksum(bytes);
}

static size_t damage(struct sim_link_way *way, uint8_t *bytes, size_t len)
{
	const struct sim_link_faults *faults = &way->faults;

	if (!len)
		return 0;
	if (sim_prng_chance(&way->prng, faults->wrong_id)) {
		way->stats.wrong_id++;
		replace(way, bytes, len, 6);
	}
	if (sim_prng_chance(&way->prng, faults->wrong_op)) {
		way->stats.wrong_op++;
		replace(way, bytes, len, 1);
	}
	if (sim_prng_chance(&way->prng, faults->corrupt)) {
		uint64_t bit = sim_prng_below(&way->prng, len * 8);

		way->stats.corrupted++;
		bytes[bit / 8] ^= (uint8_t)(1u << (bit % 8));
	}
	if (sim_prng_chance(&way->prng, faults->truncate)) {
		way->stats.truncated++;
		len = (size_t)sim_prng_below(&way->prng, len);
	}
	return len;
}

uint64_t sim_delay_draw(const struct sim_delay *delay, struct sim_prng *prng)
{
	double alpha = delay->alpha > 0 ? delay->alpha : 1.5;
	double drawn;

	switch (delay->kind) {
	case SIM_DELAY_UNIFORM:
		if (delay->high_ns <= delay->low_ns)
			return delay->low_ns;
		return delay->low_ns + sim_prng_below(prng, delay->high_ns - delay->low_ns + 1);
	case SIM_DELAY_HEAVY_TAIL:
		drawn = (double)delay->low_ns * pow(1.0 - sim_prng_unit(prng), -1.0 / alpha);
		if (delay->high_ns && drawn > (double)delay->high_ns)
			return delay->high_ns;
		return drawn < 0x1p62 ? (uint64_t)drawn : UINT64_C(1) << 62;
	case SIM_DELAY_CONSTANT:
	default:
		return delay->low_ns;
	}
}

static uint64_t arrival(struct sim_link_way *way, uint64_t now_ns)
{
	uint64_t due_ns = now_ns + sim_delay_draw(&way->faults.delay, &way->prng);

	if (sim_prng_chance(&way->prng, way->faults.reorder)) {
		way->stats.reordered++;
		return due_ns + way->faults.reorder_ns;
	}
	if (due_ns < way->last_due_ns)
		due_ns = way->last_due_ns;
	way->last_due_ns = due_ns;
	return due_ns;
}

void sim_link_decide(struct sim_link_way *way, uint64_t now_ns, uint8_t *bytes, size_t len,
		     struct sim_link_fate *fate)
{
	fate->copies = 0;
	fate->len = len;
	fate->due_ns = now_ns;
	if (is_lost(way, now_ns))
		return;
	fate->copies = 1;
	fate->len = damage(way, bytes, len);
	fate->due_ns = arrival(way, now_ns);
	if (sim_prng_chance(&way->prng, way->faults.duplicate)) {
		unsigned int more = way->faults.copies ? way->faults.copies : 1;

		fate->copies += more;
		way->stats.duplicated += more;
	}
}
