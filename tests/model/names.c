// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The model's table: names are there once, agree with HAL's, and leave nothing out. What is
 * left out of the image on purpose is listed here, with the reason.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <pokeys/state.h>

#include "halbridge/table.h"
#include "model/model.h"

enum { NAMES_MOST = 5000 };

/* Members of the state image that have no row. */
#define PART(member_, why_)						\
	{ offsetof(struct pokeys_state, member_),				\
	  sizeof(((struct pokeys_state *)0)->member_), why_ }

static const struct {
	size_t offset, size;
	const char *why;
} not_shown[] = {
	PART(magic, "identifies the image"),
	PART(version, "identifies the image"),
	PART(size_units, "identifies the image"),
	PART(hash, "identifies the image"),
	{ offsetof(struct pokeys_state, flags) + 2, 2, "no flag" },
	PART(capability.reserved, "nothing"),
	PART(capability.reserved2, "nothing"),
	PART(digital_in[7], "no pin"),
	PART(digital_out[7], "no pin"),
	PART(digital_out_owned[7], "no pin"),
	{ offsetof(struct pokeys_state, capability.digital_in) + 7, 1, "no pin" },
	{ offsetof(struct pokeys_state, capability.digital_out) + 7, 1, "no pin" },
	{ offsetof(struct pokeys_state, capability.analog_in) + 7, 1, "no pin" },
	{ offsetof(struct pokeys_state, capability.counter) + 7, 1, "no pin" },
	{ offsetof(struct pokeys_state, capability.pwm_pins) + 7, 1, "no pin" },
	{ offsetof(struct pokeys_state, kbd48_keys) + 6, 2, "no key" },
	PART(pin_function[POKEYS_PINS], "no pin"),
	PART(analog[POKEYS_ANALOG], "no input"),
	PART(counter[POKEYS_PINS], "no counter"),
	{ offsetof(struct pokeys_state, pwm_enabled) + 1, 3, "no channel" },
	PART(engine.stops, "for pokeys_shm, which shows what they cost"),
	PART(moves.reserved, "nothing"),
	PART(poextbus[10], "no byte of the bus"),
	PART(poextbus[11], "no byte of the bus"),
	PART(poextbus[12], "no byte of the bus"),
	PART(poextbus[13], "no byte of the bus"),
	PART(poextbus[14], "no byte of the bus"),
	PART(poextbus[15], "no byte of the bus"),
	PART(reserved2, "nothing"),
	PART(slow_millihertz[17], "no group"),
	PART(slow_millihertz[18], "no group"),
	PART(slow_millihertz[19], "no group"),
	PART(rtc.unnamed, "not documented"),
	PART(rtc.reserved, "nothing"),
	PART(one_shot_session, "answers to the commander alone"),
	PART(one_shot_ack, "answers to the commander alone"),
	PART(one_shot, "answers to the commander alone"),
	PART(reserved3, "nothing"),
	PART(phase.reserved, "nothing"),
};

/* Where in an element of an array of structs an offset is; SIZE_MAX = in none. */
static size_t part_of(size_t offset, size_t begin, size_t whole, size_t each)
{
	return offset < begin || offset >= begin + whole ? SIZE_MAX : (offset - begin) % each;
}

#define PART_OF(array_, offset_)							\
	part_of(offset_, offsetof(struct pokeys_state, array_),				\
		sizeof(((struct pokeys_state *)0)->array_),				\
		sizeof(((struct pokeys_state *)0)->array_[0]))

static bool is_left_out(size_t offset)
{
	const size_t in_postep = PART_OF(postep, offset);
	const size_t in_servo = PART_OF(servo, offset);
	const size_t in_axis = PART_OF(engine.axis, offset);

	for (size_t i = 0; i < sizeof(not_shown) / sizeof(not_shown[0]); i++)
		if (offset - not_shown[i].offset < not_shown[i].size)
			return true;
	/* counted by update_count */
	return in_postep == offsetof(struct pokeys_postep, updates) ||
	       in_postep == offsetof(struct pokeys_postep, reserved) ||
	       in_servo - offsetof(struct pokeys_servo, reserved) <
		       sizeof(((struct pokeys_servo *)0)->reserved) ||
	       in_axis - offsetof(struct pokeys_axis, reserved) <
		       sizeof(((struct pokeys_axis *)0)->reserved);
}

static size_t place_of(const struct model_row *row, unsigned int index)
{
	const unsigned int inner = row->inner ? row->inner : 1;
	const size_t place = index / inner * row->stride + index % inner * row->inner_stride;

	return row->offset + (row->type == MODEL_BIT ? (row->first_bit + place) / 8 : place);
}

/* Mark the bytes of an image that have a name. */
static void see(enum model_image image, uint8_t *seen, size_t whole)
{
	const struct model_row *row;

	for (size_t number = 0; (row = model_row(number)); number++) {
		if (row->image != image)
			continue;
		for (unsigned int i = 0; i < model_names(row); i++) {
			const size_t at = place_of(row, i);
			const size_t size = row->type == MODEL_BIT ?
						    1 :
					    row->type == MODEL_QUANTILE ?
						    sizeof(struct pokeys_histogram) :
						    row->size;

			assert_in_range(at + size, 1, whole);
			memset(seen + at, 1, size);
		}
	}
}

static void test_every_byte_of_the_diagnostics_has_a_name(void **context)
{
	static uint8_t seen[sizeof(struct pokeys_diag)];

	(void)context;
	see(MODEL_DIAG, seen, sizeof(seen));
	for (size_t at = offsetof(struct pokeys_diag, epoch); at < sizeof(seen); at++)
		if (!seen[at])
			fail_msg("byte %zu of the diagnostics has no name", at);
}

static void test_every_byte_of_the_state_has_a_name(void **context)
{
	static uint8_t seen[sizeof(struct pokeys_state)];

	(void)context;
	see(MODEL_STATE, seen, sizeof(seen));
	for (size_t at = 0; at < sizeof(seen); at++) {
		if (!seen[at] && !is_left_out(at))
			fail_msg("byte %zu of the state has no name", at);
		if (seen[at] && is_left_out(at))
			fail_msg("byte %zu of the state is shown, and said not to be", at);
	}
}

static int compare(const void *a, const void *b)
{
	return strcmp(a, b);
}

static void test_names_are_there_once_and_are_found(void **context)
{
	static char names[NAMES_MOST][MODEL_NAME_MAX + 1];
	const struct model_row *row, *found;
	unsigned int index;
	size_t count = 0;

	(void)context;
	for (size_t number = 0; (row = model_row(number)); number++)
		for (unsigned int i = 0; i < model_names(row); i++) {
			assert_true(count < NAMES_MOST);
			model_name(row, i, names[count++]);
		}
	for (size_t i = 0; i < count; i += 37) {
		char again[MODEL_NAME_MAX + 1];

		assert_true(model_find(names[i], &found, &index));
		model_name(found, index, again);
		assert_string_equal(again, names[i]);
	}
	assert_false(model_find("pin.55.in", &found, &index));
	assert_false(model_find("pin.NN.in", &found, &index));
	qsort(names, count, sizeof(names[0]), compare);
	for (size_t i = 0; i + 1 < count; i++)
		assert_string_not_equal(names[i], names[i + 1]);
	printf("%zu names\n", count);
}

static void test_a_name_of_hal_has_its_type_and_its_indices(void **context)
{
	const struct model_row *row;
	unsigned int joined = 0;

	(void)context;
	for (size_t number = 0; (row = model_row(number)); number++) {
		const struct table_row *hal = model_hal_row(row);

		assert_int_not_equal(*model_help(row), 0);
		assert_int_not_equal(row->count, 0);
		assert_non_null(row->unit);
		if (!hal)
			continue;
		joined++;
		if ((hal->type == TABLE_BIT) != !strcmp(model_type_name(row), "bit") ||
		    hal->count != row->count || hal->inner != row->inner || hal->first ||
		    hal->inner_first)
			fail_msg("%s is something else in HAL", row->name);
	}
	assert_in_range(joined, 150, 1000);
}

static const struct model_alone *find_alone(const char *name)
{
	const struct model_alone *alone;

	for (size_t i = 0; (alone = model_alone(i)); i++)
		if (!strcmp(alone->name, name))
			return alone;
	return NULL;
}

static bool has_row(const char *name)
{
	const struct model_row *row;

	for (size_t number = 0; (row = model_row(number)); number++)
		if (!strcmp(row->name, name))
			return true;
	return false;
}

static void test_every_pin_that_shows_something_has_a_row(void **context)
{
	unsigned int alone = 0;

	(void)context;
	for (struct table_cursor at = table_walk(TABLE_LOOPS); table_next_row(&at);) {
		const char *name = at.row->name;

		if (at.row->kind != TABLE_PIN || at.row->direction != TABLE_OUT)
			continue;
		if (!has_row(name) && !find_alone(name))
			fail_msg("%s has no row", name);
		if (has_row(name) && find_alone(name))
			fail_msg("%s has a row, and is said to have none", name);
		alone += find_alone(name) != NULL;
	}
	assert_null(model_alone(alone));
	assert_non_null(model_alone(alone - 1));
}

static bool is_pattern(const char *pattern)
{
	const struct model_row *row;
	char name[MODEL_NAME_MAX + 1];

	for (size_t number = 0; (row = model_row(number)); number++) {
		model_pattern(row, name);
		if (!strcmp(name, pattern))
			return true;
	}
	return false;
}

static void test_what_is_there_instead_of_a_pin_is_a_name(void **context)
{
	const struct model_alone *alone;
	const char *instead;

	(void)context;
	for (size_t i = 0; (alone = model_alone(i)); i++)
		if (alone->instead && !is_pattern(alone->instead))
			fail_msg("%s: there is no %s", alone->name, alone->instead);
	assert_true(model_is_hal_name("joint.00.pos-fb", &instead));
	assert_string_equal(instead, "joint.NN.counts");
	assert_true(model_is_hal_name("encoder.0.count", &instead)); /* the older scheme's */
	assert_false(model_is_hal_name("joint.08.pos-fb", &instead));
}

static void test_terminals_are_the_boards(void **context)
{
	const struct model_row *row;
	const char *label;
	unsigned int index;

	(void)context;
	assert_true(model_find("pwm.00.duty", &row, &index));
	assert_int_equal(model_board_terminal(row, index, 32, &label), 22);
	assert_true(model_find("adc.06.volts", &row, &index));
	assert_int_equal(model_board_terminal(row, index, 32, &label), 47);
	assert_true(model_find("pin.54.in", &row, &index));
	assert_int_equal(model_board_terminal(row, index, 32, &label), 55);
	assert_int_equal(model_board_terminal(row, index, 200, &label), 0);
	assert_null(label);
	assert_true(model_find("external.00.out-fb", &row, &index));
	assert_int_equal(model_board_terminal(row, index, 32, &label), 0);
	assert_non_null(label);
	assert_true(model_find("cycle", &row, &index));
	assert_int_equal(model_board_terminal(row, index, 32, &label), 0);
	assert_null(label);
}

static void test_what_is_not_known_is_not_a_number(void **context)
{
	static struct pokeys_state state;
	struct model_images images = { .image = { [MODEL_STATE] = &state }, .now_ns = 5000 };
	const struct model_row *row;
	struct model_value value;
	unsigned int index;

	(void)context;
	assert_true(model_find("age.analog-us", &row, &index));
	model_read(row, index, &images, &value);
	assert_int_equal(value.kind, MODEL_UNKNOWN);
	state.t_analog_ns = 2000;
	model_read(row, index, &images, &value);
	assert_int_equal(value.kind, MODEL_REAL);
	assert_float_equal(value.real, 3, 1e-6);
	assert_true(model_find("cycles-skipped", &row, &index));
	model_read(row, index, &images, &value);
	assert_int_equal(value.kind, MODEL_UNKNOWN);
	memset(state.identity.type, 'x', sizeof(state.identity.type));
	assert_true(model_find("info.type", &row, &index));
	model_read(row, index, &images, &value);
	assert_string_equal(value.string, "xxxxxxxxxxxxxxxxxxxxxxxx");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_every_byte_of_the_state_has_a_name),
		cmocka_unit_test(test_every_byte_of_the_diagnostics_has_a_name),
		cmocka_unit_test(test_names_are_there_once_and_are_found),
		cmocka_unit_test(test_a_name_of_hal_has_its_type_and_its_indices),
		cmocka_unit_test(test_every_pin_that_shows_something_has_a_row),
		cmocka_unit_test(test_what_is_there_instead_of_a_pin_is_a_name),
		cmocka_unit_test(test_terminals_are_the_boards),
		cmocka_unit_test(test_what_is_not_known_is_not_a_number),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
