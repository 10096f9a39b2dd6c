/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The table itself: every name once, short enough for HAL, every member of
 * struct values has one, and the names of one member agree.
 */
#include "tests/halbridge/rig.h"
#include <errno.h>

enum { NAMES = 16384 };

static int compare(const void *a, const void *b)
{
	return strcmp(a, b);
}

static void check_unique(unsigned int schemes)
{
	static char names[NAMES][TABLE_NAME_MAX + 1];
	size_t count = 0;

	for (struct table_cursor at = table_walk(schemes); table_next(&at);)
		assert_true(table_name(at.row, TABLE_DEVICES - 1, at.index, names[count++]) > 0);
	assert_int_equal(count, table_name_count(schemes));
	qsort(names, count, sizeof(names[0]), compare);
	for (size_t i = 1; i < count; i++)
		assert_string_not_equal(names[i - 1], names[i]);
}

static void every_name_is_unique_and_fits(void **state)
{
	(void)state;
	check_unique(TABLE_CANONICAL);
	check_unique(TABLE_BOTH);
	check_unique(TABLE_LEGACY);
	check_unique(TABLE_ALL);
	check_unique(TABLE_LOOPS);
	check_unique(TABLE_FORMER);
}

/* How often a whole name is made; the offset of its member goes to *offset. */
static unsigned int find(const char *wanted, unsigned int schemes, size_t *offset)
{
	char name[TABLE_NAME_MAX + 1];
	unsigned int found = 0;

	for (struct table_cursor at = table_walk(schemes); table_next(&at);) {
		table_name(at.row, 1, at.index, name);
		if (strcmp(name, wanted))
			continue;
		*offset = at.offset;
		found++;
	}
	return found;
}

/* Of these a configuration may rely on nothing: they are the ones to be told about. */
static bool is_told_about(const char *name)
{
	static const char *const parts[] = {
		"failsafe.",
		"engine.backlash",
		"engine.postep",
		"joint.%02u.backlash-",
		"joint.%02u.postep.",
		"synced-pwm.",
		"synced-out.",
		"rate.",
		"threading.",
		"matrix.row-pin.",
		"matrix.column-pin.",
		"joint.%02u.limit-neg-d",
		"encoder.%02u.set",
		"encoder.%02u.count-lost",
		"joint.%02u.limit-pos-d",
		"joint.%02u.home-d",
	};

	for (size_t i = 0; i < sizeof(parts) / sizeof(parts[0]); i++) {
		if (!strncmp(name, parts[i], strlen(parts[i])))
			return true;
	}
	return false;
}

/* HAL keeps pins and parameters apart: a name may be one of each, and they show the same. */
static void what_was_a_pin_stands_beside_the_parameter(void **state)
{
	size_t offset, parameter;

	(void)state;
	for (struct table_cursor at = table_walk(TABLE_FORMER); table_next(&at);)
		assert_int_equal(at.row->kind, TABLE_PIN);
	assert_int_equal(find("pokeys.1.PEv2.7.AxesConfig", TABLE_FORMER, &offset), 1);
	assert_int_equal(find("pokeys.1.PEv2.7.AxesConfig", TABLE_ALL, &parameter), 1);
	assert_int_equal(offset, parameter);
}

static void both_is_without_what_is_set_apart(void **state)
{
	size_t apart = 0, failsafe = 0;

	(void)state;
	for (struct table_cursor at = table_walk(TABLE_CANONICAL); table_next(&at);) {
		if (at.row->scheme != TABLE_APART)
			continue;
		if (!is_told_about(at.row->name))
			fail_msg("%s is set apart", at.row->name);
		failsafe += !strncmp(at.row->name, "failsafe.", 9);
		apart++;
	}
	assert_int_equal(failsafe, 5 + POKEYS_PINS + POKEYS_POEXTBUS + POKEYS_PWM);
	assert_int_equal(table_name_count(TABLE_ALL) - table_name_count(TABLE_BOTH | TABLE_PONET |
									TABLE_HEATER | TABLE_SERVO),
			 apart);
	assert_int_equal(find("pokeys.1.heater.06.target", TABLE_CANONICAL, &(size_t){ 0 }), 0);
	assert_int_equal(find("pokeys.1.heater.06.target", TABLE_HEATERS, &(size_t){ 0 }), 1);
	assert_int_equal(find("pokeys.1.heater.06.pid-p", TABLE_ALL, &(size_t){ 0 }), 0);
	assert_int_equal(find("pokeys.1.heater.06.pid-p", TABLE_LOOPS, &(size_t){ 0 }), 1);
	assert_int_equal(find("pokeys.1.servo.05.pid-p", TABLE_HEATERS, &(size_t){ 0 }), 0);
	assert_int_equal(find("pokeys.1.servo.05.pid-p", TABLE_SERVOS, &(size_t){ 0 }), 1);
	assert_int_equal(find("pokeys.1.failsafe.pin.54", TABLE_BOTH, &(size_t){ 0 }), 0);
	assert_int_equal(find("pokeys.1.failsafe.pin.54", TABLE_ALL, &(size_t){ 0 }), 1);
	assert_int_equal(find("pokeys.1.failsafe.state", TABLE_BOTH, &(size_t){ 0 }), 1);
	assert_int_equal(find("pokeys.1.joint.07.postep.supply", TABLE_BOTH, &(size_t){ 0 }), 0);
	assert_int_equal(find("pokeys.1.joint.07.postep.supply", TABLE_CANONICAL, &(size_t){ 0 }),
			 1);
	assert_int_equal(find("pokeys.1.threading.arm", TABLE_BOTH, &(size_t){ 0 }), 0);
	assert_int_equal(find("pokeys.1.threading.arm", TABLE_CANONICAL, &(size_t){ 0 }), 1);
}

static void indices_are_padded_and_lead_to_their_member(void **state)
{
	size_t offset;

	(void)state;
	assert_int_equal(find("pokeys.1.encoder.07.count", TABLE_CANONICAL, &offset), 1);
	assert_int_equal(offset, offsetof(struct values, encoder[7].count));
	assert_int_equal(find("pokeys.1.pin.54.in", TABLE_CANONICAL, &offset), 1);
	assert_int_equal(offset, offsetof(struct values, pin.in[54]));
	assert_int_equal(find("pokeys.1.pin.55.in", TABLE_CANONICAL, &offset), 0);
}

static void two_indices_lead_to_their_member(void **state)
{
	size_t offset;

	(void)state;
	assert_int_equal(find("pokeys.1.matrix.03.05", TABLE_CANONICAL, &offset), 1);
	assert_int_equal(offset, offsetof(struct values, matrix.key[3 * 8 + 5]));
	assert_int_equal(find("pokeys.1.PoRelay8.00.relay-1", TABLE_CANONICAL, &offset), 1);
	assert_int_equal(offset, offsetof(struct values, poextbus.out[72]));
	assert_int_equal(find("pokeys.1.PoRelay8.09.relay-8", TABLE_CANONICAL, &offset), 1);
	assert_int_equal(offset, offsetof(struct values, poextbus.out[7]));
	assert_int_equal(find("pokeys.1.PoNET.15.out-3", TABLE_CANONICAL, &offset), 1);
	assert_int_equal(offset, offsetof(struct values, ponet.module[15].out[3]));
}

static void a_name_too_long_for_hal_is_refused(void **state)
{
	const struct table_row row = {
		.name = "name.as.long.as.hal.will.take.it.%02u.xx",
		.count = 101,
	};
	char name[TABLE_NAME_MAX + 1];

	(void)state;
	assert_int_equal(table_name(&row, 0, 99, name), TABLE_NAME_MAX);
	assert_int_equal(table_name(&row, 0, 100, name), -ENAMETOOLONG);
}

/* Bytes of struct values that no name stands on. */
static size_t unbound(void)
{
	/* "both" has the canonical encoder.10 to encoder.25 and not the older ones */
	static const unsigned int schemes[] = { TABLE_ALL, TABLE_LEGACY, TABLE_LOOPS };
	static bool used[sizeof(struct values)];
	size_t bytes = 0;

	for (size_t i = 0; i < sizeof(schemes) / sizeof(schemes[0]); i++)
		for (struct table_cursor at = table_walk(schemes[i]); table_next(&at);)
			memset(&used[at.offset], 1, table_type_size(at.row->type));
	for (size_t i = 0; i < sizeof(used); i++)
		bytes += !used[i];
	return bytes;
}

static void no_member_is_forgotten(void **state)
{
	(void)state;
	/* at most 7 bytes of padding a struct, the arrays' 56th pin, two slow groups, the end */
	assert_in_range(unbound(), 0,
			5 * 2 + 3 * 8 + 4 + 32 + VALUES_TOUCHED * 8 + 5 * POKEYS_SERVOS +
				7 * (12 + POKEYS_ANALOG + POKEYS_PWM + 2 * POKEYS_AXES) +
				4 * (POKEYS_ENCODERS + POKEYS_PONET + LEGACY_ENCODERS +
				     2 * POKEYS_AXES));
}

/* Rows on one member are of one size and kind, and have one initial value. */
static void names_of_one_member_agree(void **state)
{
	static const struct table_row *first[sizeof(struct values)];

	(void)state;
	for (struct table_cursor at = table_walk(TABLE_ALL | TABLE_LOOPS); table_next(&at);) {
		const struct table_row *other = first[at.offset];
		size_t size = table_type_size(at.row->type);

		assert_true(at.offset + size <= sizeof(struct values));
		first[at.offset] = at.row;
		if (!other)
			continue;
		assert_int_equal(table_type_size(other->type), size);
		assert_int_equal(other->kind, at.row->kind);
		assert_int_equal(other->when, at.row->when);
		assert_true(other->direction == at.row->direction || at.row->kind == TABLE_PARAM);
		assert_memory_equal(&other->initial, &at.row->initial, sizeof(double));
	}
}

static void kinds_and_directions_fit_together(void **state)
{
	(void)state;
	for (struct table_cursor at = table_walk(TABLE_ALL | TABLE_LOOPS); table_next_row(&at);) {
		const struct table_row *row = at.row;

		if (row->kind == TABLE_PIN)
			assert_true(row->direction <= TABLE_IO && row->initial == 0);
		else
			assert_true(row->direction == TABLE_RO || row->direction == TABLE_RW);
		assert_true(row->help && *row->help);
		assert_true(row->count > 0 && row->low <= row->high);
	}
}

static void parameters_start_at_their_initial_value(void **state)
{
	struct values fresh;

	(void)state;
	memset(&fresh, 0, sizeof(fresh));
	table_set_parameters(&fresh);
	assert_true(fresh.encoder[25].scale == 1 && fresh.joint[7].scale == 1);
	assert_true(fresh.analog[0].scale == 1 && fresh.analog[0].offset == 0);
	assert_int_equal(fresh.packet_error_limit, 10);
	assert_int_equal(fresh.packet_error_increment, 2);
	assert_int_equal(fresh.set.pin_function[54], -1);
	assert_true(isnan(fresh.set.axis[7].soft_min));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_name_is_unique_and_fits),
		cmocka_unit_test(what_was_a_pin_stands_beside_the_parameter),
		cmocka_unit_test(both_is_without_what_is_set_apart),
		cmocka_unit_test(indices_are_padded_and_lead_to_their_member),
		cmocka_unit_test(two_indices_lead_to_their_member),
		cmocka_unit_test(a_name_too_long_for_hal_is_refused),
		cmocka_unit_test(no_member_is_forgotten),
		cmocka_unit_test(names_of_one_member_agree),
		cmocka_unit_test(kinds_and_directions_fit_together),
		cmocka_unit_test(parameters_start_at_their_initial_value),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
