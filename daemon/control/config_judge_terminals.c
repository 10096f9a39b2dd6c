// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * No terminal may be told two things. settings/terminal.c says what uses a terminal and
 * what goes together; here it is told with the lines of the file. The device is not known
 * yet: what only some boards cannot do, the daemon tells once it has found it.
 */
#include "daemon/control/config_judge.h"
#include "settings/terminal.h"
#include "wire/io.h"

/* Terminals that have any of these bits, bit = pin - 1. */
static uint64_t pins_with(const struct judged *j, uint8_t bits)
{
	uint64_t pins = 0;

	for (int pin = 0; pin < POKEYS_PINS; pin++)
		if (j->raw->settings.pin_function[pin] & bits)
			pins |= UINT64_C(1) << pin;
	return pins;
}

/* The first pin that is in both, 1-based; 0 = none. */
static int shared_pin(uint64_t a, uint64_t b)
{
	return a & b ? __builtin_ctzll(a & b) + 1 : 0;
}

static bool is_one(uint64_t pins)
{
	return !(pins & (pins - 1));
}

/* Pins, if it is not all of them. */
static uint64_t resumed_by_name(const struct judged *j)
{
	const uint64_t all = (UINT64_C(1) << POKEYS_PINS) - 1;
	const uint64_t pins = j->raw->resume & all;

	return pins == all ? 0 : pins;
}

/*
 * A safe value for a terminal that is no output does nothing, and somebody
 * relies on it. Where the file lists the outputs, it lists all of them.
 */
static void judge_safe(const struct judged *j)
{
	static const char *const keys[] = { "safe-on", "safe-hold", "resume-outputs" };
	const uint64_t listed = pins_with(j, WIRE_PIN_OUTPUT);
	const uint64_t other = pins_with(j, WIRE_PIN_INPUT | WIRE_PIN_ANALOG_IN);
	const uint64_t pins[] = { j->raw->safe_on, j->raw->safe_hold, resumed_by_name(j) };

	for (int i = 0; listed && i < 3; i++) {
		int pin = shared_pin(pins[i], ~(listed | other));

		if (pin)
			judge_fault(j, keys[i], 0, "%s: pin %d is not in digital-outputs", keys[i],
				    pin);
	}
}

static void judge_inverted(const struct judged *j)
{
	const uint64_t digital = pins_with(j, WIRE_PIN_INPUT | WIRE_PIN_OUTPUT);
	int pin = shared_pin(pins_with(j, WIRE_PIN_INVERT), ~digital);

	if (pin)
		judge_fault(j, "inverted-pins", 0, "inverted-pins: pin %d is neither in "
			    "digital-inputs nor in digital-outputs", pin);
}

/* Each two at the line of the later one. */
static void judge_shared(const struct judged *j, const struct terminal_conflict *conflict)
{
	const struct terminal_owner *first = &conflict->a, *later = &conflict->b;
	char name[SETTINGS_NAME_MAX], other[SETTINGS_NAME_MAX], list[TERMINAL_LIST_MAX];
	uint32_t line = config_line_of(j->lines, first->key, first->index);

	if (line > config_line_of(j->lines, later->key, later->index)) {
		first = &conflict->b;
		later = &conflict->a;
		line = config_line_of(j->lines, first->key, first->index);
	}
	terminal_owner_name(first->number, other);
	terminal_owner_name(later->number, name);
	terminal_list(conflict->terminals, list);
	judge_fault(j, later->key, later->index,
		    "%s: %s %s used by %s (line %u) as well, and can only be used by one of them; "
		    "remove the other",
		    name, list, is_one(conflict->terminals) ? "is" : "are", other, line);
}

void judge_terminals(const struct judged *j)
{
	const struct terminal_daemon daemon = {
		j->raw->safe_on, j->raw->safe_hold, resumed_by_name(j),
	};
	struct terminal_conflict conflict[TERMINAL_CONFLICTS_MAX];
	const size_t count = terminal_conflicts(&j->raw->settings, &daemon, NULL, conflict);

	for (size_t i = 0; i < count; i++)
		judge_shared(j, &conflict[i]);
	judge_safe(j);
	judge_inverted(j);
}
