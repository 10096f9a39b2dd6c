// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * One terminal, two jobs: told with both places, for whatever board it is; and what can be
 * wired in this way on one of them is left alone.
 */
#include "tests/control/faults.h"

static void a_terminal_told_twice_is_a_fault(void **state)
{
	(void)state;
	assert_fault(GOOD "digital-inputs = 1-8\ndigital-outputs = 8\n",
		     "f:4: [device a]: digital-outputs: terminal 8 is used by digital-inputs "
		     "(line 3) as well, and can only be used by one of them; "
		     "remove the other");
	assert_fault(GOOD "analog-inputs = 41-44\n\ndigital-inputs = 40-42, 44\n",
		     "f:5: [device a]: digital-inputs: terminals 41, 42 and 44 are used by "
		     "analog-inputs (line 3) as well, and can only be used by one of them; "
		     "remove the other");
	assert_fault(GOOD "safe-on = 3\nsafe-hold = 3\n",
		     "f:4: [device a]: safe-hold: terminal 3 is used by safe-on (line 3) as well, "
		     "and can only be used by one of them; "
		     "remove the other");
	assert_fault(GOOD "inverted-pins = 3\n",
		     "f:3: [device a]: inverted-pins: pin 3 is neither in digital-inputs nor in "
		     "digital-outputs");
	assert_fault(GOOD "digital-outputs = 20\nsafe-on = 20\naxis.2.home-pin = 20\n",
		     "f:5: [device a]: axis.2.home-pin: terminal 20 is used by digital-outputs "
		     "(line 3) as well, and can only be used by one of them; "
		     "remove the other");
}

/* Two keys that want one terminal, on whatever board; one fault, which names both. */
static void every_pair_that_excludes_itself_is_a_fault(void **state)
{
	static const struct {
		const char *first, *second, *terminals;
	} pairs[] = {
		{ "digital-outputs = 9", "encoder.2.pins = 8, 9", "terminal 9" },
		{ "digital-outputs = 20", "axis.1.limit-minus-pin = 20", "terminal 20" },
		{ "digital-outputs = 20", "axis.1.limit-plus-pin = 20", "terminal 20" },
		{ "digital-outputs = 20", "axis.1.home-pin = 20", "terminal 20" },
		{ "digital-outputs = 20", "axis.1.enable-pin = 20", "terminal 20" },
		{ "digital-inputs = 20", "axis.1.enable-pin = 20", "terminal 20" },
		{ "axis.0.enable-pin = 20", "axis.1.enable-pin = 20", "terminal 20" },
		{ "axis.0.home-pin = 20", "axis.1.enable-pin = 20", "terminal 20" },
		{ "digital-outputs = 52", "emergency-pin = 52", "terminal 52" },
		{ "emergency-pin = default", "digital-outputs = 52", "terminal 52" },
		{ "digital-outputs = 20", "charge-pump = 20", "terminal 20" },
		{ "digital-outputs = 53", "charge-pump = default", "terminal 53" },
		{ "digital-outputs = 1,12,15", "fast-encoders = on", "terminals 1 and 15" },
		{ "digital-outputs = 1,3,12", "fast-encoders = alternative", "terminals 1 and 3" },
		{ "digital-outputs = 11", "fast-encoders = on\nfast-encoder-index = on",
		  "terminal 11" },
		{ "ultra-fast-encoder = on", "digital-outputs = 8,9,12,13,14",
		  "terminals 8, 12 and 13" },
		{ "analog-inputs = 43", "encoder.4.pins = 43,44", "terminal 43" },
		{ "digital-outputs = 9-12", "generator = external", "terminals 9 and 11" },
		{ "generator = internal", "digital-outputs = 46", "terminal 46" },
		{ "poextbus-connector = terminals", "digital-outputs = 34-36",
		  "terminals 35 and 36" },
		{ "synced-pwm = on\nsynced-pwm-channel = 0", "digital-outputs = 22",
		  "terminal 22" },
		{ "synced-outputs = on\nsynced-outputs-pins = 0,21", "digital-inputs = 21",
		  "terminal 21" },
		{ "safe-on = 3", "digital-inputs = 3", "terminal 3" },
		{ "counter-inputs = 9", "safe-hold = 9", "terminal 9" },
		{ "analog-inputs = 41", "resume-outputs = 41", "terminal 41" },
	};

	(void)state;
	for (size_t i = 0; i < sizeof(pairs) / sizeof(pairs[0]); i++) {
		char text[512], expected[128];

		snprintf(text, sizeof(text), GOOD "%s\n%s\n", pairs[i].first, pairs[i].second);
		snprintf(expected, sizeof(expected), ": %s %s used by ", pairs[i].terminals,
			 strchr(pairs[i].terminals, 's') ? "are" : "is");
		if (parse(text) != 1 || !strstr(heard.line[0], expected))
			fail_msg("%s: %d faults, the first: %s", text, heard.count, heard.line[0]);
	}
}

static void a_row_of_the_keyboard_that_is_a_column_is_a_fault(void **state)
{
	(void)state;
	assert_fault(GOOD "matrix-keyboard = on\nmatrix-rows = 23,24\nmatrix-columns = 24,25\n",
		     "f:5: [device a]: matrix-columns: terminal 24 is used by matrix-rows (line 4) "
		     "as well, and can only be used by one of them; "
		     "remove the other");
	assert_fault(GOOD "matrix-keyboard = on\nmatrix-rows = 23,24\nmatrix-columns = 25\n"
			  "digital-outputs = 23,26\n",
		     "f:6: [device a]: digital-outputs: terminal 23 is used by matrix-rows (line "
		     "4) as well, and can only be used by one of them; "
		     "remove the other");
	/* it is off */
	assert_int_equal(parse(GOOD "matrix-keyboard = off\nmatrix-rows = 23\n"
				    "matrix-columns = 24\ndigital-outputs = 23\n"),
			 0);
}

/* What goes together, and what only some boards cannot do. */
static void what_can_be_wired_so_is_no_fault(void **state)
{
	static const char *const good[] = {
		/* one chain of limit switches, seen in HAL as well; a switch for limit and home */
		"axis.0.limit-minus-pin = 20\naxis.0.limit-plus-pin = 20\n"
		"axis.1.limit-minus-pin = 20\naxis.1.home-pin = 20\ndigital-inputs = 20",
		"emergency-pin = 52\ndigital-inputs = 52",
		"digital-inputs = 8,12,13\nultra-fast-encoder = on",
		"digital-inputs = 3\ncounter-inputs = 3",
		"counter-inputs = 1\nfast-encoders = on",
		"encoder.0.pins = 20,21\nfast-encoders = on\ndigital-outputs = 20",
		"encoder.5.pins = 20,21\nencoder.5.enable = off\ndigital-outputs = 20",
		"axis.1.mode = off\naxis.1.enable-pin = 20\ndigital-outputs = 20",
		"axis.1.home = off\naxis.1.home-pin = 20\ndigital-outputs = 20",
		"digital-outputs = 31,32\nsafe-on = 31\nsafe-hold = 32\nresume-outputs = 31",
		"digital-outputs = 31\nsynced-outputs = on\nsynced-outputs-pins = 31",
		"matrix-keyboard = on\nmatrix-rows = 23\nmatrix-columns = 24\n"
		"digital-inputs = 23",
		"generator = external\naxes = 0\ndigital-outputs = 9",
		/* the generator of a PoKeys57CNC has a connector of its own */
		"generator = external\ngenerator-extended-io = on\ndigital-outputs = 36",
		/* terminal 3 is a fast encoder's on a PoKeys57CNC, which has no output there */
		"fast-encoders = on\ndigital-outputs = 27",
		"poextbus-connector = dedicated\ndigital-outputs = 35",
	};

	(void)state;
	for (size_t i = 0; i < sizeof(good) / sizeof(good[0]); i++) {
		char text[512];

		snprintf(text, sizeof(text), GOOD "%s\n", good[i]);
		if (parse(text))
			fail_msg("%s: %s", text, heard.line[0]);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(a_terminal_told_twice_is_a_fault),
		cmocka_unit_test(every_pair_that_excludes_itself_is_a_fault),
		cmocka_unit_test(a_row_of_the_keyboard_that_is_a_column_is_a_fault),
		cmocka_unit_test(what_can_be_wired_so_is_no_fault),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
