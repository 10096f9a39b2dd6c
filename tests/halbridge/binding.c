/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The binding carries each pin to its member and no other, writes what has
 * changed, and lets either of two names of one input speak.
 */
#include "tests/halbridge/rig.h"
#include "halbridge/binding.h"

/* One pin's storage, as HAL would give it. */
static uint64_t storage[BINDING_PINS];
static void *volatile pointers[BINDING_PINS];
static struct binding binding;
static struct values values;

/* Another place than a pin has of its own, as when a signal is linked to it. */
static uint64_t signal_value;

static int bind_all(void **state)
{
	(void)state;
	memset(&values, 0, sizeof(values));
	memset(storage, 0, sizeof(storage));
	signal_value = 0;
	for (size_t i = 0; i < BINDING_PINS; i++)
		pointers[i] = &storage[i];
	return binding_init(&binding, &values, pointers, TABLE_ALL);
}

/* Call f for each pin with its number, in the order of the walk. */
static void each_pin(void (*f)(const struct table_row *row, size_t offset, size_t pin))
{
	size_t pin = 0;

	for (struct table_cursor at = table_walk(TABLE_ALL); table_next(&at);) {
		if (at.row->kind == TABLE_PIN)
			f(at.row, at.offset, pin++);
	}
}

/* A value that is right only for this member. */
static uint64_t mark(const struct table_row *row, size_t offset)
{
	double number = (double)offset + 0.5;
	uint64_t bytes = 0;

	if (row->type == TABLE_FLOAT)
		memcpy(&bytes, &number, sizeof(bytes));
	else
		bytes = row->type == TABLE_BIT ? 1 : 1000 + offset;
	return bytes;
}

static void set_member(const struct table_row *row, size_t offset, size_t pin)
{
	uint64_t bytes = mark(row, offset);

	(void)pin;
	memcpy((unsigned char *)&values + offset, &bytes, table_type_size(row->type));
}

static enum table_when now;

static void check_scattered(const struct table_row *row, size_t offset, size_t pin)
{
	bool ours = row->direction == TABLE_IO ||
		    (row->direction == TABLE_OUT && (row->when == now || now == TABLE_WHENS));
	/* I/O pins are written at read, if their block has changed */
	ours &= row->direction != TABLE_IO || now == TABLE_AT_READ;

	assert_true(storage[pin] == (ours ? mark(row, offset) : 0));
}

static void out_pins_get_their_member(void **state)
{
	(void)state;
	for (now = TABLE_AT_READ; now < TABLE_WHENS; now++) {
		bind_all(NULL);
		binding_gather(&binding, now);
		each_pin(set_member);
		values.changed = UINT32_MAX;
		binding_scatter(&binding, now);
		each_pin(check_scattered);
	}
}

static void check_block(const struct table_row *row, size_t offset, size_t pin)
{
	if (row->direction == TABLE_OUT && row->when == TABLE_AT_READ &&
	    values_block_of(offset) == BLOCK_JOINT)
		assert_true(storage[pin] == mark(row, offset));
	else if (row->direction == TABLE_OUT && values_block_of(offset) == BLOCK_MATRIX)
		assert_true(storage[pin] == 0);
}

static void only_blocks_that_changed_are_written(void **state)
{
	(void)state;
	binding.out_slice = 0;
	binding_gather(&binding, TABLE_AT_READ);
	each_pin(set_member);
	values.changed = 0;
	values_changed(&values, BLOCK_JOINT);
	binding_scatter(&binding, TABLE_AT_READ);
	each_pin(check_block);
	assert_int_equal(values.changed, 0);
}

static void in_the_end_every_pin_is_written_anew(void **state)
{
	(void)state;
	now = TABLE_AT_READ;
	binding_gather(&binding, TABLE_AT_READ);
	each_pin(set_member);
	for (unsigned int i = 0; i < BINDING_OUT_TURNS; i++) {
		values.changed = 0;
		binding_scatter(&binding, TABLE_AT_READ);
	}
	binding_scatter(&binding, TABLE_AT_WRITE);
	now = TABLE_WHENS;
	each_pin(check_scattered);
}

static void set_storage(const struct table_row *row, size_t offset, size_t pin)
{
	storage[pin] = mark(row, offset);
}

static void check_gathered(const struct table_row *row, size_t offset, size_t pin)
{
	bool ours = (row->direction == TABLE_IO && now == TABLE_AT_READ) ||
		    (row->direction == TABLE_IN && row->when == now);
	uint64_t bytes = 0;

	(void)pin;
	memcpy(&bytes, (unsigned char *)&values + offset, table_type_size(row->type));
	assert_true(bytes == (ours ? mark(row, offset) : 0));
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

static size_t linked_pin;

static void find_lamp(const struct table_row *row, size_t offset, size_t pin)
{
	if (offset == offsetof(struct values, kbd48.led[3]) &&
	    !strcmp(row->name, "kbd48CNC.%02u.LED"))
		linked_pin = pin;
}

static void a_pin_that_is_linked_is_read_in_each_period(void **state)
{
	const bool *led = &values.kbd48.led[3];

	(void)state;
	each_pin(find_lamp);
	binding_exported(&binding);
	binding_gather(&binding, TABLE_AT_WRITE);
	signal_value = 1;
	pointers[linked_pin] = &signal_value;
	for (unsigned int i = 0; i < BINDING_TURNS; i++)
		binding_gather(&binding, TABLE_AT_WRITE);
	assert_true(*led);
	for (unsigned int i = 0; i < 2 * BINDING_TURNS; i++) {
		signal_value = i % 2;
		binding_gather(&binding, TABLE_AT_WRITE);
		assert_int_equal(*led, i % 2);
	}
}

static void a_pin_that_is_not_linked_has_its_turn(void **state)
{
	const bool *led = &values.kbd48.led[3];
	unsigned int periods = 0;

	(void)state;
	each_pin(find_lamp);
	binding_exported(&binding);
	binding_gather(&binding, TABLE_AT_WRITE);
	storage[linked_pin] = 1;
	while (!*led && periods++ < 1000)
		binding_gather(&binding, TABLE_AT_WRITE);
	assert_true(periods <= BINDING_TURNS);
}

static unsigned int pulses;

/* Pressed and released within two periods, by a script: the pin is not linked. */
static void pulse(const struct table_row *row, size_t offset, size_t pin)
{
	const bool *member = (const bool *)((const unsigned char *)&values + offset);

	if (row->direction != TABLE_IN || row->type != TABLE_BIT ||
	    !strstr(row->help, "rising edge"))
		return;
	pulses++;
	for (unsigned int i = 0; i < 2 * BINDING_TURNS; i++) {
		storage[pin] = i % 2;
		binding_gather(&binding, row->when);
		if (*member != i % 2)
			fail_msg("%s was not read in period %u", row->name, i);
	}
}

static void a_short_pulse_is_seen(void **state)
{
	(void)state;
	binding_exported(&binding);
	for (unsigned int when = 0; when < TABLE_WHENS; when++)
		binding_gather(&binding, (enum table_when)when);
	pulses = 0;
	each_pin(pulse);
	assert_true(pulses > 20);
}

static void a_pin_linked_to_a_used_signal_is_written_though_nothing_changed(void **state)
{
	(void)state;
	values.connected = true;
	values_changed(&values, BLOCK_LINK);
	binding_scatter(&binding, TABLE_AT_READ);
	assert_int_equal(storage[0], 1); /* the first pin is `connected` */
	signal_value = 0;
	pointers[0] = &signal_value;
	for (unsigned int i = 0; i < BINDING_OUT_TURNS; i++)
		binding_scatter(&binding, TABLE_AT_READ);
	assert_int_equal(signal_value, 1);
}

static size_t pin_a, pin_b;

/* The two names of the relay next to the device. */
static void find_pair(const struct table_row *row, size_t offset, size_t pin)
{
	if (offset != offsetof(struct values, poextbus.out[72]))
		return;
	if (row->inner)
		pin_b = pin;
	else
		pin_a = pin;
}

static void of_two_in_pins_the_one_that_changed_counts(void **state)
{
	const bool *relay = &values.poextbus.out[72];

	(void)state;
	each_pin(find_pair);
	assert_int_not_equal(pin_a, pin_b);
	storage[pin_a] = 1;
	binding_gather(&binding, TABLE_AT_WRITE);
	binding_gather(&binding, TABLE_AT_WRITE);
	assert_true(*relay);
	storage[pin_b] = 1;
	binding_gather(&binding, TABLE_AT_WRITE);
	storage[pin_b] = 0;
	binding_gather(&binding, TABLE_AT_WRITE);
	assert_false(*relay);
	storage[pin_a] = 0;
	binding_gather(&binding, TABLE_AT_WRITE);
	storage[pin_a] = 1;
	binding_gather(&binding, TABLE_AT_WRITE);
	assert_true(*relay);
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
	storage[io_pin] = 1; /* somebody else's wish, in between */
	values_changed(&values, BLOCK_ENCODER);
	binding_scatter(&binding, TABLE_AT_READ);
	assert_int_equal(storage[io_pin], 1);
	binding_gather(&binding, TABLE_AT_READ);
	assert_true(values.encoder[4].index_enable);
	values.encoder[4].index_enable = false;
	values_changed(&values, BLOCK_ENCODER);
	binding_scatter(&binding, TABLE_AT_READ);
	assert_int_equal(storage[io_pin], 0);
}

static size_t count_pin[POKEYS_ENCODERS];

static void find_counts(const struct table_row *row, size_t offset, size_t pin)
{
	for (unsigned int i = 0; i < POKEYS_ENCODERS; i++) {
		if (row->direction == TABLE_OUT &&
		    offset == offsetof(struct values, encoder[i].count))
			count_pin[i] = pin;
	}
}

static void only_what_was_touched_is_written(void **state)
{
	(void)state;
	each_pin(find_counts);
	for (unsigned int i = 0; i < POKEYS_ENCODERS; i++) {
		for (unsigned int k = 0; k < POKEYS_ENCODERS; k++) {
			values.encoder[k].count++;
			storage[count_pin[k]] = 0;
		}
		binding.next_out = 0; /* those whose turn it is are others */
		values_touched(&values, offsetof(struct values, encoder[i]),
			       sizeof(values.encoder[i]));
		binding_scatter(&binding, TABLE_AT_READ);
		for (unsigned int k = 0; k < POKEYS_ENCODERS; k++) {
			/* chunks do not begin where an encoder does */
			if (k == i)
				assert_int_equal(storage[count_pin[k]], i + 1);
			else if (k > i + 1 || k + 1 < i)
				assert_int_equal(storage[count_pin[k]], 0);
		}
	}
}

static size_t io_canonical, io_legacy;

static void find_io_pair(const struct table_row *row, size_t offset, size_t pin)
{
	if (row->direction != TABLE_IO ||
	    offset != offsetof(struct values, encoder[4].index_enable))
		return;
	if (row->scheme == TABLE_LEGACY)
		io_legacy = pin;
	else
		io_canonical = pin;
}

static void two_io_pins_of_one_member_follow_each_other(void **state)
{
	(void)state;
	each_pin(find_io_pair);
	assert_int_not_equal(io_canonical, io_legacy);
	storage[io_legacy] = 1;
	binding_gather(&binding, TABLE_AT_READ);
	binding_scatter(&binding, TABLE_AT_READ);
	assert_int_equal(storage[io_canonical], 1);
	binding_gather(&binding, TABLE_AT_READ);
	assert_true(values.encoder[4].index_enable);
	values.encoder[4].index_enable = false;
	values_changed(&values, BLOCK_ENCODER);
	binding_scatter(&binding, TABLE_AT_READ);
	assert_int_equal(storage[io_canonical] | storage[io_legacy], 0);
	storage[io_canonical] = 1;
	binding_gather(&binding, TABLE_AT_READ);
	assert_true(values.encoder[4].index_enable);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(out_pins_get_their_member),
		cmocka_unit_test_setup(only_blocks_that_changed_are_written, bind_all),
		cmocka_unit_test_setup(in_the_end_every_pin_is_written_anew, bind_all),
		cmocka_unit_test(in_pins_fill_their_member),
		cmocka_unit_test_setup(a_pin_that_is_linked_is_read_in_each_period, bind_all),
		cmocka_unit_test_setup(a_pin_that_is_not_linked_has_its_turn, bind_all),
		cmocka_unit_test_setup(a_short_pulse_is_seen, bind_all),
		cmocka_unit_test_setup(
			a_pin_linked_to_a_used_signal_is_written_though_nothing_changed, bind_all),
		cmocka_unit_test_setup(of_two_in_pins_the_one_that_changed_counts, bind_all),
		cmocka_unit_test_setup(only_what_was_touched_is_written, bind_all),
		cmocka_unit_test_setup(two_io_pins_of_one_member_follow_each_other, bind_all),
		cmocka_unit_test_setup(an_io_pin_is_written_only_if_we_changed_it, bind_all),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
