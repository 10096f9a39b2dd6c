/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * One layout in three languages: what the headers publish, what the C compiler
 * makes, what the Rust crate wrote down. (Python: layout.py.) The expected
 * hash is printed when it differs: put it into the header and the crate when
 * the layout was meant to change, and raise the version.
 */
#include <inttypes.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <stdio.h>
#include <string.h>
#include <cmocka.h>
#include "shm/iox.h"
#include "tests/shm/layout_text.h"

static const uint64_t published[LAYOUT_IMAGES] = {
	POKEYS_STATE_HASH,  POKEYS_DIAG_HASH, POKEYS_COMMAND_HASH,
	POKEYS_REPORT_HASH, POKEYS_WISH_HASH,
};

static void published_hash_is_that_of_the_members(void **state)
{
	char text[LAYOUT_TEXT_MAX];

	(void)state;
	for (enum layout_image image = 0; image < LAYOUT_IMAGES; image++) {
		layout_text(image, text);
		if (layout_hash(text) != published[image])
			fail_msg("%s: the hash is 0x%016" PRIx64 " now", layout_name(image),
				 layout_hash(text));
	}
}

static void rust_has_the_same_hash(void **state)
{
	(void)state;
	assert_true(iox_state_hash() == POKEYS_STATE_HASH);
	assert_true(iox_diag_hash() == POKEYS_DIAG_HASH);
	assert_true(iox_command_hash() == POKEYS_COMMAND_HASH);
	assert_true(iox_report_hash() == POKEYS_REPORT_HASH);
	assert_true(iox_wish_hash() == POKEYS_WISH_HASH);
}

static void there_is_no_hole_and_no_end_padding(void **state)
{
	(void)state;
	for (enum layout_image image = 0; image < LAYOUT_IMAGES; image++)
		assert_true(layout_gapless(image));
}

static void size_fits_the_header_field(void **state)
{
	(void)state;
	for (enum layout_image image = 0; image < LAYOUT_IMAGES; image++) {
		assert_int_equal(layout_size(image) % 8, 0);
		assert_true(layout_size(image) / 8 <= UINT16_MAX);
	}
}

static void hash_is_fnv_1a(void **state)
{
	(void)state;
	/* the reference vectors of the algorithm's authors */
	assert_true(layout_hash("") == UINT64_C(0xcbf29ce484222325));
	assert_true(layout_hash("a") == UINT64_C(0xaf63dc4c8601ec8c));
	assert_true(layout_hash("foobar") == UINT64_C(0x85944171f73967e8));
}

static void a_change_deep_inside_changes_the_hash(void **state)
{
	char text[LAYOUT_TEXT_MAX];
	char *at;

	(void)state;
	layout_text(LAYOUT_STATE, text);
	at = strstr(text, "max_acceleration");
	assert_non_null(at);
	at[0] = 'M';
	assert_true(layout_hash(text) != POKEYS_STATE_HASH);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(published_hash_is_that_of_the_members),
		cmocka_unit_test(rust_has_the_same_hash),
		cmocka_unit_test(there_is_no_hole_and_no_end_padding),
		cmocka_unit_test(size_fits_the_header_field),
		cmocka_unit_test(hash_is_fnv_1a),
		cmocka_unit_test(a_change_deep_inside_changes_the_hash),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
