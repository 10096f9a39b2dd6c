/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * SHA-1 of 32 bytes, and the hash that a locked device wants (protocol section
 * 1.11), against values of another implementation.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "wire/sha1.h"

static void hex(const uint8_t digest[WIRE_SHA1_DIGEST], char text[2 * WIRE_SHA1_DIGEST + 1])
{
	static const char digits[] = "0123456789abcdef";

	for (unsigned int i = 0; i < WIRE_SHA1_DIGEST; i++) {
		text[2 * i] = digits[digest[i] >> 4];
		text[2 * i + 1] = digits[digest[i] & 15];
	}
	text[2 * WIRE_SHA1_DIGEST] = '\0';
}

static void known_messages_have_their_digests(void **state)
{
	uint8_t message[WIRE_SHA1_MESSAGE], digest[WIRE_SHA1_DIGEST];
	char text[2 * WIRE_SHA1_DIGEST + 1];

	(void)state;
	for (unsigned int i = 0; i < sizeof(message); i++)
		message[i] = (uint8_t)i;
	wire_sha1(message, digest);
	hex(digest, text);
	assert_string_equal(text, "ae5bd8efea5322c4d9986d06680a781392f9a642");
	memcpy(message, "abcdefghijklmnopqrstuvwxyz012345", sizeof(message));
	wire_sha1(message, digest);
	hex(digest, text);
	assert_string_equal(text, "a3eb15172cc7e6090a2eb32e6dc8c3bd30c39a02");
	memset(message, 0, sizeof(message));
	wire_sha1(message, digest);
	hex(digest, text);
	assert_string_equal(text, "de8a847bff8c343d69b853a215e6ee775ef2ef96");
	memset(message, 0xff, sizeof(message));
	wire_sha1(message, digest);
	hex(digest, text);
	assert_string_equal(text, "9e5175008751d08f361488c9927086b276b965fa");
}

static void password_is_mixed_with_the_seed_whatever_its_length(void **state)
{
	static const struct {
		const char *password, *hash;
	} rows[] = {
		{ "", "95e96dd17403929a339e339e680dd076e78ac039" },
		{ "open sesame", "a9e4f40d8895c2af0fe50e9288e05283f501dc37" },
		{ "xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxx", "4e78b8c990088d33f3c3283d381db36e48d5eb23" },
		/* what is beyond 32 characters does not count */
		{ "xxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxxyz",
		  "4e78b8c990088d33f3c3283d381db36e48d5eb23" },
	};
	uint8_t seed[WIRE_SHA1_MESSAGE], digest[WIRE_SHA1_DIGEST];
	char text[2 * WIRE_SHA1_DIGEST + 1];

	(void)state;
	for (unsigned int i = 0; i < sizeof(seed); i++)
		seed[i] = (uint8_t)(i * 37 + 11);
	for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
		wire_password_hash(rows[i].password, seed, digest);
		hex(digest, text);
		assert_string_equal(text, rows[i].hash);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(known_messages_have_their_digests),
		cmocka_unit_test(password_is_mixed_with_the_seed_whatever_its_length),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
