/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The table itself: every name once, short enough for HAL, every member of
 * struct values bound once, and the binding carries each pin to its member
 * and no other.
 */
#include "tests/halbridge/rig.h"
#include <errno.h>
#include "halbridge/binding.h"

enum { NAMES = 4096 };

static int compare(const void *a, const void *b)
{
	return strcmp(a, b);
}

static void every_name_is_unique_and_fits(void **state)
{
	static char names[NAMES][TABLE_NAME_MAX + 1];
	size_t count = 0;

	(void)state;
	for (size_t i = 0; i < table_row_count; i++)
		for (unsigned int k = 0; k < table_rows[i].count; k++)
			assert_true(table_name(&table_rows[i], TABLE_DEVICES - 1, k,
					       names[count++]) > 0);
	assert_int_equal(count, table_name_count());
	qsort(names, count, sizeof(names[0]), compare);
	for (size_t i = 1; i < count; i++)
		assert_string_not_equal(names[i - 1], names[i]);
}

static void indices_are_padded(void **state)
{
	char name[TABLE_NAME_MAX + 1];
	bool seen = false;

	(void)state;
	for (size_t i = 0; i < table_row_count; i++) {
		if (strcmp(table_rows[i].name, "encoder.%02u.count"))
			continue;
		table_name(&table_rows[i], 1, 7, name);
		assert_string_equal(name, "pokeys.1.encoder.07.count");
		assert_int_equal(table_rows[i].count, POKEYS_ENCODERS);
		seen = true;
	}
	assert_true(seen);
}

static void a_name_too_long_for_hal_is_refused(void **state)
{
	const struct table_row row = {
		.name = "name.as.long.as.hal.will.take.it.%02u.xx", .count = 101,
	};
	char name[TABLE_NAME_MAX + 1];

	(void)state;
	assert_int_equal(table_name(&row, 0, 99, name), TABLE_NAME_MAX);
	assert_int_equal(table_name(&row, 0, 100, name), -ENAMETOOLONG);
}

static size_t size_of(unsigned int type)
{
	return type == TABLE_BIT ? 1 : type == TABLE_FLOAT ? 8 : 4;
}

static void no_member_is_bound_twice_and_none_is_forgotten(void **state)
{
	static unsigned char used[sizeof(struct values)];
	size_t bound = 0;

	(void)state;
	for (size_t i = 0; i < table_row_count; i++) {
		const struct table_row *row = &table_rows[i];

		for (unsigned int k = 0; k < row->count; k++) {
			size_t at = row->offset + (size_t)k * row->stride;

			assert_true(at + size_of(row->type) <= sizeof(struct values));
			for (size_t b = 0; b < size_of(row->type); b++, bound++)
				assert_int_equal(used[at + b]++, 0);
		}
	}
	/* what is left is padding: at most 7 bytes a struct */
	assert_true(sizeof(struct values) - bound <=
		    8 * (1 + POKEYS_PINS + POKEYS_ANALOG + POKEYS_ENCODERS + POKEYS_AXES));
}

static void kinds_and_directions_fit_together(void **state)
{
	(void)state;
	for (size_t i = 0; i < table_row_count; i++) {
		const struct table_row *row = &table_rows[i];

		if (row->kind == TABLE_PIN)
			assert_true(row->direction <= TABLE_IO && row->initial == 0);
		else
			assert_true(row->direction == TABLE_RO || row->direction == TABLE_RW);
		assert_true(row->help && *row->help);
	}
}

/* One pin's storage, as HAL would give it. */
static uint64_t storage[BINDING_PINS];
static void *volatile pointers[BINDING_PINS];
static struct binding binding;
static struct values values;

static int bind_all(void **state)
{
	(void)state;
	memset(&values, 0, sizeof(values));
	memset(storage, 0, sizeof(storage));
	for (size_t i = 0; i < BINDING_PINS; i++)
		pointers[i] = &storage[i];
	return binding_init(&binding, &values, pointers);
}

/* Call f for each pin with its number, in the order of the table. */
static void each_pin(void (*f)(const struct table_row *row, size_t offset, size_t pin))
{
	size_t pin = 0;

	for (size_t i = 0; i < table_row_count; i++) {
		const struct table_row *row = &table_rows[i];

		for (unsigned int k = 0; row->kind == TABLE_PIN && k < row->count; k++)
			f(row, row->offset + (size_t)k * row->stride, pin++);
	}
}

/* A value that is right only for this pin. */
static uint64_t mark(const struct table_row *row, size_t pin)
{
	double number = (double)pin + 0.5;
	uint64_t bytes = 0;

	if (row->type == TABLE_FLOAT)
		memcpy(&bytes, &number, sizeof(bytes));
	else
		bytes = row->type == TABLE_BIT ? 1 : 1000 + pin;
	return bytes;
}

static void set_member(const struct table_row *row, size_t offset, size_t pin)
{
	uint64_t bytes = mark(row, pin);

	memcpy((unsigned char *)&values + offset, &bytes, size_of(row->type));
}

static enum table_when now;

static void check_scattered(const struct table_row *row, size_t offset, size_t pin)
{
	bool ours = row->direction == TABLE_IO ||
		    (row->direction == TABLE_OUT && row->when == now);

	(void)offset;
	assert_true(storage[pin] == (ours ? mark(row, pin) : 0));
}

static void out_pins_get_their_member(void **state)
{
	(void)state;
	for (now = TABLE_AT_READ; now < TABLE_WHENS; now++) {
		bind_all(NULL);
		binding_gather(&binding, now);
		each_pin(set_member);
		binding_scatter(&binding, now);
		each_pin(check_scattered);
	}
}

static void set_storage(const struct table_row *row, size_t offset, size_t pin)
{
	(void)offset;
	storage[pin] = mark(row, pin);
}

static void check_gathered(const struct table_row *row, size_t offset, size_t pin)
{
	bool ours = row->direction == TABLE_IO ||
		    (row->direction == TABLE_IN && row->when == now);
	uint64_t bytes = 0;

	memcpy(&bytes, (unsigned char *)&values + offset, size_of(row->type));
	assert_true(bytes == (ours ? mark(row, pin) : 0));
}

static void in_pins_fill_their_member(void **state)
{
	(void)state;
	for (now = TABLE_AT_READ; now < TABLE_WHENS; now++) {
		bind_all(NULL);
		each_pin(set_storage);
		binding_gather(&binding, now);
		each_pin(check_gathered);
	}
}

static size_t io_pin;

static void find_io(const struct table_row *row, size_t offset, size_t pin)
{
	if (row->direction == TABLE_IO &&
	    offset == offsetof(struct values, encoder[4].index_enable))
		io_pin = pin;
}

static void an_io_pin_is_written_only_if_we_changed_it(void **state)
{
	(void)state;
	each_pin(find_io);
	storage[io_pin] = 0;
	binding_gather(&binding, TABLE_AT_READ);
	storage[io_pin] = 1;	/* somebody else's wish, in between */
	binding_scatter(&binding, TABLE_AT_READ);
	assert_int_equal(storage[io_pin], 1);
	binding_gather(&binding, TABLE_AT_READ);
	assert_true(values.encoder[4].index_enable);
	values.encoder[4].index_enable = false;
	binding_scatter(&binding, TABLE_AT_READ);
	assert_int_equal(storage[io_pin], 0);
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
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(every_name_is_unique_and_fits),
		cmocka_unit_test(indices_are_padded),
		cmocka_unit_test(a_name_too_long_for_hal_is_refused),
		cmocka_unit_test(no_member_is_bound_twice_and_none_is_forgotten),
		cmocka_unit_test(kinds_and_directions_fit_together),
		cmocka_unit_test(out_pins_get_their_member),
		cmocka_unit_test(in_pins_fill_their_member),
		cmocka_unit_test_setup(an_io_pin_is_written_only_if_we_changed_it, bind_all),
		cmocka_unit_test(parameters_start_at_their_initial_value),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
