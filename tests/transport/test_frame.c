/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Frames as AF_XDP sends and receives them: what is made is right by the RFCs'
 * rules and by what a kernel has made of the same datagram; what is not whole in
 * any way is refused.
 */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "daemon/transport/frame.h"

static const struct frame_path path = {
	{ 2, 0, 0, 0, 0, 9 }, { 2, 0, 0, 0, 0, 1 }, 0x0a000002, 0x0a000001, 20055, 40000,
};

/* As captured from a kernel's socket that sent "pokeys" from and to the same. */
static const uint8_t captured[] = {
	2, 0,  0,    0,    0,    9,    2,  0,  0,    0,    0,   1,   0x08, 0x00, 0x45, 0,
	0, 34, 0x0c, 0x3d, 0x40, 0,    64, 17, 0x1a, 0x8c, 10,  0,   0,    1,    10,   0,
	0, 2,  0x9c, 0x40, 0x4e, 0x57, 0,  14, 0xab, 0xef, 'p', 'o', 'k',  'e',  'y',  's',
};

/* In memory of exactly its length, so that a sanitizer sees a step too far. */
static bool read_copy(const uint8_t *frame, size_t length)
{
	uint8_t *copy = malloc(length ? length : 1);
	struct frame_datagram d;
	bool whole;

	memcpy(copy, frame, length);
	whole = frame_read(copy, length, &d);
	free(copy);
	return whole;
}

static void every_length_comes_back_whole(void **state)
{
	uint8_t frame[FRAME_HEAD + 512], data[512];
	struct frame_datagram d;

	(void)state;
	for (size_t i = 0; i < sizeof data; i++)
		data[i] = (uint8_t)(i * 37 + i / 256);
	for (size_t n = 0; n <= sizeof data; n++) {
		size_t length = frame_make(frame, &path, data, n);

		assert_int_equal(length, FRAME_HEAD + n);
		assert_true(frame_read(frame, length, &d));
		assert_int_equal(d.length, n);
		assert_memory_equal(d.data, data, n);
		assert_int_equal(d.from, path.from);
		assert_int_equal(d.to, path.to);
		assert_int_equal(d.from_port, path.from_port);
		assert_int_equal(d.to_port, path.to_port);
	}
}

static void padding_is_not_part_of_the_datagram(void **state)
{
	uint8_t frame[60] = { 0 };
	struct frame_datagram d;

	(void)state;
	memcpy(frame, captured, sizeof captured);
	frame[59] = 0xee;
	assert_true(frame_read(frame, sizeof frame, &d));
	assert_int_equal(d.length, 6);
}

static void every_turned_bit_is_noticed(void **state)
{
	uint8_t frame[sizeof captured];

	(void)state;
	for (size_t bit = 12 * 8; bit < sizeof captured * 8; bit++) {
		memcpy(frame, captured, sizeof captured);
		frame[bit / 8] ^= (uint8_t)(1 << bit % 8);
		if (read_copy(frame, sizeof frame))
			fail_msg("bit %zu of byte %zu was turned and nobody noticed", bit % 8,
				 bit / 8);
	}
}

static void every_shorter_frame_is_refused(void **state)
{
	(void)state;
	for (size_t n = 0; n < sizeof captured; n++)
		assert_false(read_copy(captured, n));
	assert_true(read_copy(captured, sizeof captured));
}

/* Compute the header checksum anew after a change, as a liar would. */
static void mend_header(uint8_t *ip, size_t header)
{
	uint32_t sum = 0;

	ip[10] = ip[11] = 0;
	for (size_t i = 0; i < header; i += 2)
		sum += (uint32_t)(ip[i] << 8 | ip[i + 1]);
	while (sum >> 16)
		sum = (sum & 0xffff) + (sum >> 16);
	ip[10] = (uint8_t)(~sum >> 8);
	ip[11] = (uint8_t)~sum;
}

static void frame_is_what_a_kernel_makes(void **state)
{
	uint8_t frame[256], kernel[sizeof captured];

	(void)state;
	assert_int_equal(frame_make(frame, &path, (const uint8_t *)"pokeys", 6), sizeof captured);
	/* but for the identification, which whole datagrams need not have */
	memcpy(kernel, captured, sizeof captured);
	kernel[18] = kernel[19] = 0;
	mend_header(kernel + 14, 20);
	assert_memory_equal(frame, kernel, sizeof kernel);
}

static bool read_changed(size_t at, uint8_t value)
{
	uint8_t frame[sizeof captured];

	memcpy(frame, captured, sizeof captured);
	frame[14 + at] = value;
	mend_header(frame + 14, 20);
	return read_copy(frame, sizeof frame);
}

static void headers_that_are_well_summed_lies_are_refused(void **state)
{
	(void)state;
	assert_true(read_changed(1, 0x10));  /* type of service is nobody's business */
	assert_false(read_changed(0, 0x44)); /* header shorter than one is */
	assert_false(read_changed(0, 0x4f)); /* longer than the packet */
	assert_false(read_changed(0, 0x65)); /* version 6 */
	assert_false(read_changed(3, 35));   /* longer than the frame */
	assert_false(read_changed(3, 27));   /* shorter than the headers */
	assert_false(read_changed(3, 33));   /* shorter than the UDP length */
	assert_false(read_changed(6, 0x20)); /* more fragments */
	assert_false(read_changed(7, 1));    /* a later fragment */
	assert_false(read_changed(9, 6));    /* TCP */
}

static void header_with_options_is_read_over(void **state)
{
	uint8_t frame[sizeof captured + 4];
	struct frame_datagram d;

	(void)state;
	memcpy(frame, captured, 34);
	memset(frame + 34, 1, 4); /* no operation, four times */
	memcpy(frame + 38, captured + 34, sizeof captured - 34);
	frame[14] = 0x46;
	frame[17] = 38;
	mend_header(frame + 14, 24);
	assert_true(frame_read(frame, sizeof frame, &d));
	assert_int_equal(d.length, 6);
	assert_memory_equal(d.data, "pokeys", 6);
}

static void datagram_without_checksum_is_taken(void **state)
{
	uint8_t frame[sizeof captured];

	(void)state;
	memcpy(frame, captured, sizeof captured);
	frame[40] = frame[41] = 0;
	assert_true(read_copy(frame, sizeof frame));
}

/* Sum over the addresses, protocol 17 and the length; the kernel leaves the rest to a card. */
static void checksum_left_to_a_card_is_told_from_damage(void **state)
{
	uint8_t frame[sizeof captured];
	struct frame_datagram d;

	(void)state;
	memcpy(frame, captured, sizeof captured);
	frame[40] = 0x14;
	frame[41] = 0x22; /* 0a00 + 0001 + 0a00 + 0002 + 0011 + 000e */
	assert_false(frame_read(frame, sizeof frame, &d));
	assert_true(frame_half_summed(frame, sizeof frame));
	frame[46] ^= 1; /* the data is not in it */
	assert_true(frame_half_summed(frame, sizeof frame));
	for (size_t n = 0; n < sizeof frame; n++)
		assert_false(frame_half_summed(frame, n));
	for (size_t bit = 12 * 8; bit < sizeof captured * 8; bit++) {
		memcpy(frame, captured, sizeof captured);
		frame[bit / 8] ^= (uint8_t)(1 << bit % 8);
		assert_false(frame_half_summed(frame, sizeof frame));
	}
}

static void checksum_that_comes_out_as_none_is_sent_as_ffff(void **state)
{
	uint8_t frame[256], data[2];
	int found = 0;

	(void)state;
	for (uint32_t v = 0; v < 65536; v++) {
		data[0] = (uint8_t)(v >> 8);
		data[1] = (uint8_t)v;
		frame_make(frame, &path, data, 2);
		assert_true(frame[40] || frame[41]);
		found += frame[40] == 0xff && frame[41] == 0xff;
	}
	assert_int_equal(found, 1);
}

static void noise_is_survived(void **state)
{
	uint32_t seed = 20055;
	uint8_t frame[128];

	(void)state;
	for (int round = 0; round < 20000; round++) {
		size_t length;

		memcpy(frame, captured, sizeof captured);
		for (size_t i = round % 2 ? 0 : 14; i < sizeof frame; i++) {
			seed = seed * 1103515245 + 12345;
			if (i >= sizeof captured || seed >> 28 == 0)
				frame[i] = (uint8_t)(seed >> 16);
		}
		seed = seed * 1103515245 + 12345;
		length = (seed >> 16) % sizeof frame;
		if (length > 34)
			mend_header(frame + 14, 20);
		read_copy(frame, length);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(frame_is_what_a_kernel_makes),
		cmocka_unit_test(every_length_comes_back_whole),
		cmocka_unit_test(padding_is_not_part_of_the_datagram),
		cmocka_unit_test(every_turned_bit_is_noticed),
		cmocka_unit_test(every_shorter_frame_is_refused),
		cmocka_unit_test(headers_that_are_well_summed_lies_are_refused),
		cmocka_unit_test(header_with_options_is_read_over),
		cmocka_unit_test(datagram_without_checksum_is_taken),
		cmocka_unit_test(checksum_left_to_a_card_is_told_from_damage),
		cmocka_unit_test(checksum_that_comes_out_as_none_is_sent_as_ffff),
		cmocka_unit_test(noise_is_survived),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
