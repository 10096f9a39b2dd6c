// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The faulty link: what it is told to do it does, as often as it is told to,
 * and the same again with the same seed. Rates are tested at five standard
 * deviations; POKEYS_SEED gives another run.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <math.h>

#include "sim/link.h"

#define US UINT64_C(1000)
#define MANY 20000

static struct sim_link link;
static struct sim_link_options options;
static uint64_t seed;

static struct sim_link_faults *faults(void)
{
	return &options.faults[SIM_LINK_REQUEST];
}

static void begin(void)
{
	memset(&options, 0, sizeof(options));
}

static void push(uint64_t now_ns, uint32_t tag)
{
	uint8_t packet[64] = { 0xBB, 0x05 };

	memcpy(packet + 8, &tag, sizeof(tag));
	sim_link_push(&link, SIM_LINK_REQUEST, now_ns, packet, sizeof(packet));
}

/* The next packet's tag by then, or -1. */
static int64_t pop(uint64_t now_ns)
{
	uint8_t packet[64];
	uint32_t tag;

	if (!sim_link_pop(&link, SIM_LINK_REQUEST, now_ns, packet, sizeof(packet)))
		return -1;
	memcpy(&tag, packet + 8, sizeof(tag));
	return tag;
}

/* Pushes MANY packets one microsecond apart; how many came out. */
static unsigned int run_many(void)
{
	unsigned int arrived = 0;

	sim_link_init(&link, &options, seed);
	for (uint32_t i = 0; i < MANY; i++) {
		push(i * US, i);
		while (pop(i * US) >= 0)
			arrived++;
	}
	while (pop(UINT64_MAX - 1) >= 0)
		arrived++;
	return arrived;
}

static void assert_rate(uint64_t seen, double p)
{
	double mean = MANY * p;
	double bound = 5 * sqrt(MANY * p * (1 - p));

	if (fabs((double)seen - mean) > bound)
		fail_msg("%llu of %d, want %.0f +- %.0f", (unsigned long long)seen, MANY, mean,
			 bound);
}

static void a_perfect_link_delivers_all_at_once_and_in_order(void **state)
{
	(void)state;
	begin();
	sim_link_init(&link, NULL, seed);
	for (uint32_t i = 0; i < SIM_LINK_PACKETS; i++)
		push(5, i);
	assert_int_equal(sim_link_next(&link, SIM_LINK_REQUEST), 5);
	assert_int_equal(pop(4), -1);
	for (uint32_t i = 0; i < SIM_LINK_PACKETS; i++)
		assert_int_equal(pop(5), i);
	assert_true(sim_link_next(&link, SIM_LINK_REQUEST) == SIM_LINK_NEVER);
}

static void loss_has_the_rate_it_was_given(void **state)
{
	static const double rates[] = { 0.001, 0.01, 0.05, 0.33, 1 };

	(void)state;
	for (unsigned int i = 0; i < 5; i++) {
		unsigned int arrived;

		begin();
		faults()->loss = rates[i];
		arrived = run_many();
		assert_int_equal(arrived + link.way[SIM_LINK_REQUEST].stats.lost, MANY);
		assert_rate(MANY - arrived, rates[i]);
	}
}

static void directions_fail_by_themselves(void **state)
{
	uint8_t packet[64] = { 0 };

	(void)state;
	begin();
	faults()->loss = 1;
	sim_link_init(&link, &options, seed);
	sim_link_push(&link, SIM_LINK_REQUEST, 0, packet, 64);
	sim_link_push(&link, SIM_LINK_REPLY, 0, packet, 64);
	assert_int_equal(sim_link_pop(&link, SIM_LINK_REQUEST, 10, packet, 64), 0);
	assert_int_equal(sim_link_pop(&link, SIM_LINK_REPLY, 10, packet, 64), 64);
}

static uint64_t digest(uint64_t with_seed)
{
	uint64_t sum = 0;

	sim_link_init(&link, &options, with_seed);
	for (uint32_t i = 0; i < 2000; i++)
		push(i * 10 * US, i);
	for (uint64_t now = 0; sim_link_next(&link, SIM_LINK_REQUEST) != SIM_LINK_NEVER;) {
		now = sim_link_next(&link, SIM_LINK_REQUEST);
		sum = sum * 1000003 + (uint64_t)pop(now) + now;
	}
	return sum;
}

static void the_same_seed_gives_the_same_run(void **state)
{
	uint64_t first;

	(void)state;
	begin();
	faults()->loss = 0.6;
	faults()->duplicate = 0.1;
	faults()->reorder = 0.1;
	faults()->reorder_ns = 35 * US;
	faults()->delay.kind = SIM_DELAY_HEAVY_TAIL;
	faults()->delay.low_ns = 20 * US;
	first = digest(seed);
	assert_true(first == digest(seed));
	assert_true(first != digest(seed + 1));
}

static void bursts_lose_in_a_row(void **state)
{
	unsigned int runs = 0, longest = 0, length = 0;
	int64_t before = -1;
	int64_t tag;

	(void)state;
	begin();
	faults()->burst_every_ns = 900 * US;
	faults()->burst_length_ns = 100 * US;
	faults()->burst_loss = 1;
	sim_link_init(&link, &options, seed);
	for (uint32_t i = 0; i < 200000; i++) {
		push(i * US, i);
		tag = pop(i * US);
		if (tag < 0)
			continue;
		length = (unsigned int)(tag - before - 1);
		runs += length > 0;
		longest = length > longest ? length : longest;
		before = tag;
	}
	/* One burst a millisecond on average, a tenth of the time; 200 in all. */
	assert_in_range(runs, 140, 260);
	assert_in_range(link.way[SIM_LINK_REQUEST].stats.lost_burst, 13000, 27000);
	assert_true(longest > 200);
}

static void a_uniform_delay_keeps_its_bounds_and_the_order(void **state)
{
	uint64_t low = UINT64_MAX, high = 0;

	(void)state;
	begin();
	faults()->delay.kind = SIM_DELAY_UNIFORM;
	faults()->delay.low_ns = 100 * US;
	faults()->delay.high_ns = 300 * US;
	sim_link_init(&link, &options, seed);
	for (uint32_t i = 0; i < 5000; i++) {
		uint64_t sent = i * 1000 * US;
		uint64_t took;

		push(sent, i);
		took = sim_link_next(&link, SIM_LINK_REQUEST) - sent;
		low = took < low ? took : low;
		high = took > high ? took : high;
		assert_int_equal(pop(sent + took), i);
	}
	assert_in_range(low, 100 * US, 101 * US);
	assert_in_range(high, 299 * US, 300 * US);
}

static void jitter_alone_does_not_reorder(void **state)
{
	uint32_t expected = 0;

	(void)state;
	begin();
	faults()->delay.kind = SIM_DELAY_UNIFORM;
	faults()->delay.high_ns = 500 * US;
	sim_link_init(&link, &options, seed);
	for (uint32_t i = 0; i < 1000; i++)
		push(i * US, i);
	while (expected < 1000)
		assert_int_equal(pop(UINT64_MAX - 1), expected++);
}

static void a_heavy_tail_is_cut_where_told(void **state)
{
	unsigned int late = 0;

	(void)state;
	begin();
	faults()->delay.kind = SIM_DELAY_HEAVY_TAIL;
	faults()->delay.low_ns = 100 * US;
	faults()->delay.high_ns = 5000 * US;
	faults()->delay.alpha = 1;
	sim_link_init(&link, &options, seed);
	for (uint32_t i = 0; i < MANY; i++) {
		uint64_t sent = i * 10000 * US;
		uint64_t took;

		push(sent, i);
		took = sim_link_next(&link, SIM_LINK_REQUEST) - sent;
		assert_in_range(took, 100 * US, 5000 * US);
		late += took > 1000 * US;
		pop(sent + took);
	}
	assert_rate(late, 0.1);
}

static void reordered_packets_are_overtaken(void **state)
{
	unsigned int overtaken = 0;
	int64_t before = -1;
	int64_t tag;

	(void)state;
	begin();
	faults()->reorder = 0.1;
	faults()->reorder_ns = 10 * US;
	sim_link_init(&link, &options, seed);
	for (uint32_t i = 0; i < MANY; i++) {
		push(i * US, i);
		while ((tag = pop(i * US)) >= 0) {
			overtaken += tag < before;
			before = tag > before ? tag : before;
		}
	}
	assert_rate(overtaken, 0.1);
	assert_int_equal(link.way[SIM_LINK_REQUEST].stats.lost, 0);
}

static void copies_come_as_often_as_told(void **state)
{
	(void)state;
	begin();
	faults()->duplicate = 1;
	faults()->copies = 49;
	faults()->copy_gap_ns = 7 * US;
	sim_link_init(&link, &options, seed);
	push(0, 5);
	for (uint64_t i = 0; i < 50; i++) {
		assert_int_equal(sim_link_next(&link, SIM_LINK_REQUEST), i * 7 * US);
		assert_int_equal(pop(i * 7 * US), 5);
	}
	assert_true(sim_link_next(&link, SIM_LINK_REQUEST) == SIM_LINK_NEVER);
}

/* The bits in which two packets differ. */
static unsigned int bits_apart(const uint8_t *a, const uint8_t *b)
{
	unsigned int bits = 0;

	for (int i = 0; i < 64; i++)
		bits += (unsigned int)__builtin_popcount((unsigned int)(a[i] ^ b[i]));
	return bits;
}

static void corruption_flips_one_bit_anywhere(void **state)
{
	uint8_t sent[64] = { 0xBB, 0x05 };
	uint8_t got[64];
	uint64_t seen = 0;

	(void)state;
	begin();
	faults()->corrupt = 1;
	sim_link_init(&link, &options, seed);
	for (int i = 0; i < 2000; i++) {
		sim_link_push(&link, SIM_LINK_REQUEST, 0, sent, 64);
		assert_int_equal(sim_link_pop(&link, SIM_LINK_REQUEST, 0, got, 64), 64);
		assert_int_equal(bits_apart(sent, got), 1);
		for (int byte = 0; byte < 64; byte++)
			seen |= (uint64_t)(sent[byte] != got[byte]) << byte;
	}
	assert_true(seen == UINT64_MAX);
}

static void truncation_gives_every_shorter_length(void **state)
{
	uint8_t packet[64] = { 0 };
	uint64_t seen = 0;
	size_t len;

	(void)state;
	begin();
	faults()->truncate = 1;
	sim_link_init(&link, &options, seed);
	for (int i = 0; i < 3000; i++) {
		sim_link_push(&link, SIM_LINK_REQUEST, 0, packet, 64);
		assert_true(sim_link_pop_from(&link, SIM_LINK_REQUEST, 0, NULL, packet, 64, &len));
		assert_true(len < 64);
		seen |= UINT64_C(1) << len;
	}
	assert_true(seen == UINT64_MAX);
}

static void a_wrong_id_has_a_good_checksum(void **state)
{
	uint8_t sent[64] = { 0xAA, 0x05, 1, 2, 3, 4, 77, 0 };
	uint8_t got[64];
	uint8_t sum;

	(void)state;
	begin();
	faults()->wrong_id = 1;
	faults()->wrong_op = 1;
	sim_link_init(&link, &options, seed);
	for (int i = 0; i < 500; i++) {
		sim_link_push(&link, SIM_LINK_REQUEST, 0, sent, 64);
		sim_link_pop(&link, SIM_LINK_REQUEST, 0, got, 64);
		sum = 0;
		for (int byte = 0; byte < 7; byte++)
			sum = (uint8_t)(sum + got[byte]);
		assert_int_equal(got[7], sum);
		assert_int_not_equal(got[6], 77);
		assert_int_not_equal(got[1], 0x05);
	}
}

static void silence_is_a_window(void **state)
{
	(void)state;
	begin();
	sim_link_init(&link, NULL, seed);
	sim_link_silence(&link, SIM_LINK_REQUEST, 100, 200);
	for (uint32_t i = 0; i < 300; i += 50)
		push(i, i);
	assert_int_equal(pop(1000), 0);
	assert_int_equal(pop(1000), 50);
	assert_int_equal(pop(1000), 200);
	assert_int_equal(pop(1000), 250);
	assert_int_equal(link.way[SIM_LINK_REQUEST].stats.lost_silence, 2);
}

static void a_full_link_drops_and_counts(void **state)
{
	(void)state;
	begin();
	sim_link_init(&link, NULL, seed);
	for (uint32_t i = 0; i < SIM_LINK_PACKETS + 10; i++)
		push(0, i);
	assert_int_equal(link.way[SIM_LINK_REQUEST].stats.overflow, 10);
	sim_link_flush(&link, SIM_LINK_REQUEST);
	assert_int_equal(pop(100), -1);
	push(0, 7);
	assert_int_equal(pop(0), 7);
}

static void an_oversized_packet_is_dropped(void **state)
{
	static uint8_t big[SIM_LINK_BYTES + 1];

	(void)state;
	begin();
	sim_link_init(&link, NULL, seed);
	sim_link_push(&link, SIM_LINK_REQUEST, 0, big, sizeof(big));
	assert_true(sim_link_next(&link, SIM_LINK_REQUEST) == SIM_LINK_NEVER);
	assert_int_equal(link.way[SIM_LINK_REQUEST].stats.overflow, 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_perfect_link_delivers_all_at_once_and_in_order),
		cmocka_unit_test(loss_has_the_rate_it_was_given),
		cmocka_unit_test(directions_fail_by_themselves),
		cmocka_unit_test(the_same_seed_gives_the_same_run),
		cmocka_unit_test(bursts_lose_in_a_row),
		cmocka_unit_test(a_uniform_delay_keeps_its_bounds_and_the_order),
		cmocka_unit_test(jitter_alone_does_not_reorder),
		cmocka_unit_test(a_heavy_tail_is_cut_where_told),
		cmocka_unit_test(reordered_packets_are_overtaken),
		cmocka_unit_test(copies_come_as_often_as_told),
		cmocka_unit_test(corruption_flips_one_bit_anywhere),
		cmocka_unit_test(truncation_gives_every_shorter_length),
		cmocka_unit_test(a_wrong_id_has_a_good_checksum),
		cmocka_unit_test(silence_is_a_window),
		cmocka_unit_test(a_full_link_drops_and_counts),
		cmocka_unit_test(an_oversized_packet_is_dropped),
	};
	const char *text = getenv("POKEYS_SEED");

	seed = text ? strtoull(text, NULL, 0) : 1;
	fprintf(stderr, "seed %llu\n", (unsigned long long)seed);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
