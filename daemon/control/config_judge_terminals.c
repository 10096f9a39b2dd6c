// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * No terminal may be told two things. settings/terminal.c says what uses a terminal and
 * what goes together; here it is told with the lines of the file. The device is not known
 * yet: what only some boards cannot do, the daemon tells once it has found it.
 */
#include <stdio.h>
#include <string.h>
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

static void judge_inverted(const struct judged *j, const struct terminal_daemon *daemon)
{
	uint64_t digital = pins_with(j, WIRE_PIN_INPUT | WIRE_PIN_OUTPUT);
	int pin;

	for (unsigned int i = 0; i < daemon->heaters; i++)
		digital |= daemon->heater[i].output | daemon->heater[i].fan;
	for (unsigned int i = 0; i < daemon->servos; i++)
		digital |= daemon->servo[i].direction | daemon->servo[i].enable |
			   daemon->servo[i].low | daemon->servo[i].high | daemon->servo[i].home;
	pin = shared_pin(pins_with(j, WIRE_PIN_INVERT), ~digital);

	if (pin)
		judge_fault(j, "inverted-pins", 0,
			    "inverted-pins: pin %d is neither in "
			    "digital-inputs nor in digital-outputs",
			    pin);
}

/* The line, the section and the key of an owner in the file. */
struct place {
	uint32_t line;
	char section[48], key[SETTINGS_NAME_MAX];
};

#define HEATER_KEY "heater.#."
#define SERVO_KEY "servo.#."

static struct judged_part heater_of(const struct judged *j, uint32_t number)
{
	uint32_t i = 0;

	while (i + 1 < j->file->heaters &&
	       !(judge_has_heater(j, i) && j->file->heater[i].number == number))
		i++;
	return judge_heater_part(j->file, i);
}

static struct judged_part servo_of(const struct judged *j, uint32_t number)
{
	uint32_t i = 0;

	while (i + 1 < j->file->servos &&
	       !(judge_has_servo(j, i) && j->file->servo[i].number == number))
		i++;
	return judge_servo_part(j->file, i);
}

static void place_in(struct judged_part part, const char *key, struct place *place)
{
	place->line = config_line_of(part.lines, key, 0);
	snprintf(place->section, sizeof(place->section), "[%s %s]", part.word, part.name);
	snprintf(place->key, sizeof(place->key), "%s", key);
}

static void find_place(const struct judged *j, const struct terminal_owner *owner,
		       struct place *place)
{
	if (!strncmp(owner->key, HEATER_KEY, strlen(HEATER_KEY))) {
		place_in(heater_of(j, owner->index), owner->key + strlen(HEATER_KEY), place);
	} else if (!strncmp(owner->key, SERVO_KEY, strlen(SERVO_KEY))) {
		place_in(servo_of(j, owner->index), owner->key + strlen(SERVO_KEY), place);
	} else {
		place->line = config_line_of(j->lines, owner->key, owner->index);
		snprintf(place->section, sizeof(place->section), "[device %s]", j->raw->name);
		terminal_owner_name(owner->number, place->key);
	}
}

/* Each two at the line of the later one. */
static void judge_shared(const struct judged *j, const struct terminal_conflict *conflict)
{
	struct place place[2];
	const struct place *first = &place[0], *later = &place[1];
	char list[TERMINAL_LIST_MAX], where[CONFIG_WHERE];
	bool elsewhere;

	find_place(j, &conflict->a, &place[0]);
	find_place(j, &conflict->b, &place[1]);
	if (first->line > later->line) {
		first = &place[1];
		later = &place[0];
	}
	elsewhere = strcmp(first->section, later->section) != 0;
	config_fault(j->file, later->line,
		     "%s: %s: %s %s used by %s%s%s (%s) as well, and can only be used by one "
		     "of them; remove the other",
		     later->section, later->key, terminal_list(conflict->terminals, list),
		     is_one(conflict->terminals) ? "is" : "are", elsewhere ? first->section : "",
		     elsewhere ? " " : "", first->key,
		     config_where(j->file, first->line, later->line, where));
}

/* What the heaters of this device use. */
static void take_heaters(const struct judged *j, struct terminal_daemon *daemon)
{
	struct heating_config config[POKEYS_HEATERS];
	unsigned int count = 0;

	for (uint32_t i = 0; i < j->file->heaters; i++) {
		if (judge_has_heater(j, i) && j->file->heater[i].number < POKEYS_HEATERS) {
			config[j->file->heater[i].number] = j->file->heater[i].out;
			count++;
		}
	}
	heating_terminals(config, count, daemon);
	for (uint32_t i = 0; i < j->file->heaters; i++) {
		const struct config_raw_heater *raw = &j->file->heater[i];

		if (!judge_has_heater(j, i) || raw->number >= POKEYS_HEATERS)
			continue;
		if (!raw->sensor_pin)
			daemon->heater[raw->number].sensor = 0;
		if (!raw->output_pin)
			daemon->heater[raw->number].output = 0;
	}
}

static void take_servos(const struct judged *j, struct terminal_daemon *daemon)
{
	struct servoing_config config[POKEYS_SERVOS];
	unsigned int count = 0;

	for (uint32_t i = 0; i < j->file->servos; i++) {
		const struct config_raw_servo *raw = &j->file->servo[i];

		if (judge_has_servo(j, i) && raw->number < POKEYS_SERVOS) {
			config[raw->number] = raw->out;
			count++;
		}
	}
	servoing_terminals(config, count, daemon);
}

void judge_terminals(const struct judged *j)
{
	struct terminal_daemon daemon = {
		.safe_on = j->raw->safe_on,
		.safe_hold = j->raw->safe_hold,
		.resume = resumed_by_name(j),
	};
	struct terminal_conflict conflict[TERMINAL_CONFLICTS_MAX];
	size_t count;

	take_heaters(j, &daemon);
	take_servos(j, &daemon);
	count = terminal_conflicts(&j->raw->settings, &daemon, NULL, conflict);
	for (size_t i = 0; i < count; i++)
		judge_shared(j, &conflict[i]);
	judge_safe(j);
	judge_inverted(j, &daemon);
}
