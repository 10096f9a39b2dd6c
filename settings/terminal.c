/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * One table of everything that can use a terminal, and one of what goes together.
 *
 * Several may listen to one level: the limit switches of two axes are wired in a row,
 * and HAL shows them as digital inputs besides. What drives a terminal has it alone. A
 * terminal that one part drives and another part listens to is a short circuit through
 * the switch, or an axis that the driver's enable signal stops.
 *
 * Where a signal is depends on the board (wire/model.c, protocol section 2.5).
 */
#include "settings/terminal.h"
#include <stdbool.h>
#include "wire/encoder.h"
#include "wire/io.h"
#include "wire/pulse.h"

enum { AXIS_ENABLED = 0x01, AXIS_MODE = 0x0D, ENCODER_COUNTS = 0x01, FAST_INDEX = 0x01 };
enum { DEFAULT = 1, BIAS = 10, BOARDS_MAX = 4 };

struct look {
	const struct pokeys_settings *settings;
	const struct terminal_daemon *daemon;
	const struct wire_pinmap *board;
};

/* Of a terminal as it is printed; 0 = none. */
static uint64_t bit(unsigned int terminal)
{
	return terminal && terminal <= POKEYS_PINS ? UINT64_C(1) << (terminal - 1) : 0;
}

static uint64_t with(const struct look *look, unsigned int wanted, unsigned int of)
{
	const struct pokeys_settings *s = look->settings;
	uint64_t pins = 0;

	for (unsigned int i = 0; i < POKEYS_PINS; i++)
		if (s->pin_set[i / 8] >> i % 8 & 1 && (s->pin_function[i] & of) == wanted)
			pins |= bit(i + 1);
	return pins;
}

static uint64_t inputs(const struct look *look, unsigned int index)
{
	(void)index;
	return with(look, WIRE_PIN_INPUT, WIRE_PIN_INPUT | WIRE_PIN_COUNTER);
}

static uint64_t counters(const struct look *look, unsigned int index)
{
	(void)index;
	return with(look, WIRE_PIN_COUNTER, WIRE_PIN_COUNTER);
}

static uint64_t outputs(const struct look *look, unsigned int index)
{
	(void)index;
	return with(look, WIRE_PIN_OUTPUT, WIRE_PIN_OUTPUT);
}

static uint64_t analog(const struct look *look, unsigned int index)
{
	(void)index;
	return with(look, WIRE_PIN_ANALOG_IN, WIRE_PIN_ANALOG_IN);
}

static uint64_t safe_on(const struct look *look, unsigned int index)
{
	(void)index;
	return look->daemon->safe_on;
}

static uint64_t safe_hold(const struct look *look, unsigned int index)
{
	(void)index;
	return look->daemon->safe_hold;
}

static uint64_t resume(const struct look *look, unsigned int index)
{
	(void)index;
	return look->daemon->resume;
}

static uint64_t sensor(const struct look *look, unsigned int index)
{
	return index < look->daemon->heaters ? look->daemon->heater[index].sensor : 0;
}

static uint64_t heater(const struct look *look, unsigned int index)
{
	return index < look->daemon->heaters ? look->daemon->heater[index].output : 0;
}

/* The terminal of a PWM channel + 1. */
static uint64_t pwm_bit(const struct look *look, uint8_t pwm)
{
	return pwm && pwm <= WIRE_MODEL_PWMS ? bit(look->board->pwm_pin[pwm - 1]) : 0;
}

static uint64_t commanded_pwm(const struct look *look, unsigned int index)
{
	return look->daemon->pwm >> index & 1 ? bit(look->board->pwm_pin[index]) : 0;
}

static uint64_t heater_pwm(const struct look *look, unsigned int index)
{
	return index < look->daemon->heaters ? pwm_bit(look, look->daemon->heater[index].pwm) : 0;
}

static uint64_t heater_fan(const struct look *look, unsigned int index)
{
	return index < look->daemon->heaters ? look->daemon->heater[index].fan : 0;
}

static uint64_t heater_fan_pwm(const struct look *look, unsigned int index)
{
	return index < look->daemon->heaters ? pwm_bit(look, look->daemon->heater[index].fan_pwm) :
					       0;
}

static uint64_t servo_pwm(const struct look *look, unsigned int index)
{
	return index < look->daemon->servos ? pwm_bit(look, look->daemon->servo[index].pwm) : 0;
}

static uint64_t servo_reverse(const struct look *look, unsigned int index)
{
	return index < look->daemon->servos ?
		       pwm_bit(look, look->daemon->servo[index].reverse_pwm) :
		       0;
}

static uint64_t servo_direction(const struct look *look, unsigned int index)
{
	return index < look->daemon->servos ? look->daemon->servo[index].direction : 0;
}

static uint64_t servo_enable(const struct look *look, unsigned int index)
{
	return index < look->daemon->servos ? look->daemon->servo[index].enable : 0;
}

static uint64_t servo_low(const struct look *look, unsigned int index)
{
	return index < look->daemon->servos ? look->daemon->servo[index].low : 0;
}

static uint64_t servo_home(const struct look *look, unsigned int index)
{
	return index < look->daemon->servos ? look->daemon->servo[index].home : 0;
}

static uint64_t servo_high(const struct look *look, unsigned int index)
{
	return index < look->daemon->servos ? look->daemon->servo[index].high : 0;
}

static bool is_external(const struct pokeys_settings *s)
{
	return s->set & POKEYS_SET_GENERATOR && !(s->set & POKEYS_SET_AXES && !s->axes) &&
	       (s->generator & WIRE_GENERATOR_TYPE) == WIRE_GENERATOR_EXTERNAL;
}

static uint64_t generator(const struct look *look, unsigned int index)
{
	const struct pokeys_settings *s = look->settings;
	const unsigned int axes = s->set & POKEYS_SET_AXES ? s->axes : WIRE_MODEL_INTERNAL_AXES;
	uint64_t pins = 0;

	(void)index;
	if (is_external(s))
		return look->board->generator;
	if (!(s->set & POKEYS_SET_GENERATOR) ||
	    (s->generator & WIRE_GENERATOR_TYPE) != WIRE_GENERATOR_INTERNAL)
		return 0;
	for (unsigned int i = 0; i < axes && i < WIRE_MODEL_INTERNAL_AXES; i++)
		pins |= bit(look->board->step[i]) | bit(look->board->direction[i]);
	return pins;
}

static uint64_t generator_io(const struct look *look, unsigned int index)
{
	const struct pokeys_settings *s = look->settings;

	(void)index;
	return is_external(s) && s->generator & WIRE_GENERATOR_EXTENDED_IO ?
		       look->board->generator_io :
		       0;
}

static uint64_t special(uint8_t value, uint8_t by_default)
{
	return value == DEFAULT ? bit(by_default) : value > BIAS ? bit(value - BIAS) : 0;
}

static uint64_t charge_pump(const struct look *look, unsigned int index)
{
	(void)index;
	return look->settings->set & POKEYS_SET_CHARGE_PUMP ?
		       special(look->settings->charge_pump, look->board->charge_pump) :
		       0;
}

static uint64_t emergency(const struct look *look, unsigned int index)
{
	(void)index;
	return look->settings->set & POKEYS_SET_EMERGENCY_PIN ?
		       special(look->settings->emergency_pin, look->board->emergency) :
		       0;
}

static uint64_t synced_pwm(const struct look *look, unsigned int index)
{
	const struct pokeys_settings *s = look->settings;

	(void)index;
	return s->set & POKEYS_SET_SYNC_PWM && s->sync_pwm_enable &&
			       s->sync_pwm_channel < WIRE_MODEL_PWMS ?
		       bit(look->board->pwm_pin[s->sync_pwm_channel]) :
		       0;
}

static uint64_t synced_outputs(const struct look *look, unsigned int index)
{
	const struct pokeys_settings *s = look->settings;
	uint64_t pins = 0;

	(void)index;
	if (!(s->set & POKEYS_SET_SYNC_OUTPUTS) || !s->sync_out_enable)
		return 0;
	for (unsigned int i = 0; i < sizeof(s->sync_out_pin); i++)
		pins |= bit(s->sync_out_pin[i]);
	return pins;
}

/* The terminal of an axis' switch, if there is that switch. */
static uint64_t axis_switch(const struct pokeys_axis_settings *axis, uint32_t set, uint8_t pin,
			    uint8_t which)
{
	const bool none = axis->switches_mask & which && !(axis->switches & which);

	return axis->set & set && !none ? bit(pin) : 0;
}

static uint64_t limit_minus(const struct look *look, unsigned int index)
{
	const struct pokeys_axis_settings *axis = &look->settings->axis[index];

	return axis_switch(axis, POKEYS_AXIS_SET_PIN_LIMIT_MINUS, axis->pin_limit_minus, 1);
}

static uint64_t limit_plus(const struct look *look, unsigned int index)
{
	const struct pokeys_axis_settings *axis = &look->settings->axis[index];

	return axis_switch(axis, POKEYS_AXIS_SET_PIN_LIMIT_PLUS, axis->pin_limit_plus, 2);
}

static uint64_t home(const struct look *look, unsigned int index)
{
	const struct pokeys_axis_settings *axis = &look->settings->axis[index];

	return axis_switch(axis, POKEYS_AXIS_SET_PIN_HOME, axis->pin_home, 4);
}

static uint64_t enable(const struct look *look, unsigned int index)
{
	const struct pokeys_axis_settings *axis = &look->settings->axis[index];
	const bool off = axis->options_mask & AXIS_MODE && !(axis->options & AXIS_ENABLED);

	return axis->set & POKEYS_AXIS_SET_PIN_ENABLE && !off ? bit(axis->pin_enable) : 0;
}

static bool is_fast(const struct pokeys_settings *s)
{
	return s->set & POKEYS_SET_FAST_ENCODERS && s->fast_configuration != WIRE_FAST_OFF;
}

/* A fast encoder counts instead of the one of its number. */
static uint64_t encoder(const struct look *look, unsigned int index)
{
	const struct pokeys_encoder_settings *of = &look->settings->encoder[index];
	const bool off = of->options_mask & ENCODER_COUNTS && !(of->options & ENCODER_COUNTS);

	if (!of->pins_set || off || (index < WIRE_MODEL_FASTS && is_fast(look->settings)))
		return 0;
	return (of->pin_a < POKEYS_PINS ? bit(of->pin_a + 1u) : 0) |
	       (of->pin_b < POKEYS_PINS ? bit(of->pin_b + 1u) : 0);
}

static const struct wire_encoder_pins *fast_pins(const struct look *look)
{
	return look->settings->fast_configuration == WIRE_FAST_OLD ? look->board->fast_old :
								     look->board->fast;
}

static uint64_t fast(const struct look *look, unsigned int index)
{
	const struct wire_encoder_pins *of = fast_pins(look);
	uint64_t pins = 0;

	(void)index;
	for (unsigned int i = 0; is_fast(look->settings) && i < WIRE_MODEL_FASTS; i++)
		pins |= bit(of[i].a) | bit(of[i].b);
	return pins;
}

static uint64_t fast_index(const struct look *look, unsigned int index)
{
	const struct wire_encoder_pins *of = fast_pins(look);
	const bool on = is_fast(look->settings) && look->settings->fast_options & FAST_INDEX;
	uint64_t pins = 0;

	(void)index;
	for (unsigned int i = 0; on && i < WIRE_MODEL_FASTS; i++)
		pins |= bit(of[i].index);
	return pins;
}

static uint64_t ultra(const struct look *look, unsigned int index)
{
	const struct wire_encoder_pins *of = &look->board->ultra;

	(void)index;
	return look->settings->set & POKEYS_SET_ULTRA_FAST && look->settings->ultra_enable ?
		       bit(of->a) | bit(of->b) | bit(of->index) :
		       0;
}

static uint64_t poextbus(const struct look *look, unsigned int index)
{
	(void)index;
	return look->settings->set & POKEYS_SET_POEXTBUS && look->settings->poextbus_connector ?
		       look->board->poextbus :
		       0;
}

static uint64_t matrix(const struct look *look, const uint8_t *pin, unsigned int count,
		       unsigned int room)
{
	const struct pokeys_settings *s = look->settings;
	uint64_t pins = 0;

	if (!(s->set & POKEYS_SET_MATRIX) || !s->matrix_enable)
		return 0;
	for (unsigned int i = 0; i < count && i < room; i++)
		pins |= pin[i] < POKEYS_PINS ? bit(pin[i] + 1u) : 0;
	return pins;
}

static uint64_t rows(const struct look *look, unsigned int index)
{
	(void)index;
	return matrix(look, look->settings->matrix_row_pin, look->settings->matrix_rows,
		      sizeof(look->settings->matrix_row_pin));
}

static uint64_t columns(const struct look *look, unsigned int index)
{
	(void)index;
	return matrix(look, look->settings->matrix_column_pin, look->settings->matrix_columns,
		      sizeof(look->settings->matrix_column_pin));
}

static const struct source {
	const char *key;
	enum terminal_kind kind;
	unsigned int count;
	uint64_t (*used)(const struct look *look, unsigned int index);
} sources[] = {
	{ "digital-inputs", TERMINAL_INPUT, 1, inputs },
	{ "digital-outputs", TERMINAL_OUTPUT, 1, outputs },
	{ "analog-inputs", TERMINAL_ANALOG, 1, analog },
	{ "counter-inputs", TERMINAL_COUNTER, 1, counters },
	{ "generator", TERMINAL_DRIVEN, 1, generator },
	{ "generator-extended-io", TERMINAL_DRIVEN, 1, generator_io },
	{ "charge-pump", TERMINAL_DRIVEN, 1, charge_pump },
	{ "emergency-pin", TERMINAL_LISTENER, 1, emergency },
	{ "synced-pwm-channel", TERMINAL_DRIVEN, 1, synced_pwm },
	{ "synced-outputs-pins", TERMINAL_FOLLOWER, 1, synced_outputs },
	{ "axis.#.limit-minus-pin", TERMINAL_LISTENER, POKEYS_AXES, limit_minus },
	{ "axis.#.limit-plus-pin", TERMINAL_LISTENER, POKEYS_AXES, limit_plus },
	{ "axis.#.home-pin", TERMINAL_LISTENER, POKEYS_AXES, home },
	{ "axis.#.enable-pin", TERMINAL_DRIVEN, POKEYS_AXES, enable },
	{ "encoder.#.pins", TERMINAL_LISTENER, WIRE_ENCODER_BASIC, encoder },
	{ "fast-encoders", TERMINAL_LISTENER, 1, fast },
	{ "fast-encoder-index", TERMINAL_LISTENER, 1, fast_index },
	{ "ultra-fast-encoder", TERMINAL_LISTENER, 1, ultra },
	{ "poextbus-connector", TERMINAL_DRIVEN, 1, poextbus },
	{ "matrix-rows", TERMINAL_SCANNED, 1, rows },
	{ "matrix-columns", TERMINAL_SCANNED, 1, columns },
	{ "safe-on", TERMINAL_SAFE_ON, 1, safe_on },
	{ "safe-hold", TERMINAL_SAFE_HOLD, 1, safe_hold },
	{ "resume-outputs", TERMINAL_RESUME, 1, resume },
	/* records have their numbers: new ones come last */
	{ "heater.#.sensor-pin", TERMINAL_SENSOR, POKEYS_HEATERS, sensor },
	{ "heater.#.output-pin", TERMINAL_LOOP, POKEYS_HEATERS, heater },
	{ "heater.#.pwm", TERMINAL_DRIVEN, POKEYS_HEATERS, heater_pwm },
	{ "servo.#.pwm", TERMINAL_DRIVEN, POKEYS_SERVOS, servo_pwm },
	{ "servo.#.reverse-pwm", TERMINAL_DRIVEN, POKEYS_SERVOS, servo_reverse },
	{ "servo.#.direction-pin", TERMINAL_LOOP, POKEYS_SERVOS, servo_direction },
	{ "servo.#.enable-pin", TERMINAL_LOOP, POKEYS_SERVOS, servo_enable },
	{ "servo.#.limit-minus-pin", TERMINAL_LISTENER, POKEYS_SERVOS, servo_low },
	{ "servo.#.limit-plus-pin", TERMINAL_LISTENER, POKEYS_SERVOS, servo_high },
	{ "heater.#.fan-pin", TERMINAL_LOOP, POKEYS_HEATERS, heater_fan },
	{ "heater.#.fan-pwm", TERMINAL_DRIVEN, POKEYS_HEATERS, heater_fan_pwm },
	{ "servo.#.home-pin", TERMINAL_LISTENER, POKEYS_SERVOS, servo_home },
	{ "pwm.#.enable", TERMINAL_COMMANDED, WIRE_MODEL_PWMS, commanded_pwm },
};

enum { OWNERS_MAX = 176, SOURCES = sizeof(sources) / sizeof(sources[0]) };

static size_t list_owners(const struct look *look, struct terminal_owner out[OWNERS_MAX])
{
	size_t count = 0;

	for (size_t i = 0; i < SOURCES; i++) {
		for (unsigned int k = 0; k < sources[i].count; k++) {
			out[count] = (struct terminal_owner){
				.terminals = sources[i].used(look, k),
				.key = sources[i].key,
				.index = (uint8_t)k,
				.kind = (uint8_t)sources[i].kind,
				.number = (uint8_t)count,
			};
			count++;
		}
	}
	return count;
}

#define KIND(kind) (1u << TERMINAL_##kind)

static const unsigned int goes_with[TERMINAL_KINDS] = {
	[TERMINAL_INPUT] = KIND(LISTENER) | KIND(SCANNED),
	[TERMINAL_COUNTER] = KIND(LISTENER),
	[TERMINAL_ANALOG] = KIND(SENSOR),
	[TERMINAL_OUTPUT] = KIND(FOLLOWER) | KIND(LOOP) | KIND(SAFE_ON) | KIND(SAFE_HOLD) |
			    KIND(RESUME),
	[TERMINAL_LISTENER] = KIND(LISTENER) | KIND(INPUT) | KIND(COUNTER),
	[TERMINAL_SCANNED] = KIND(INPUT),
	[TERMINAL_FOLLOWER] = KIND(OUTPUT) | KIND(SAFE_ON) | KIND(SAFE_HOLD) | KIND(RESUME),
	[TERMINAL_SENSOR] = KIND(ANALOG),
	[TERMINAL_LOOP] = KIND(OUTPUT),
	[TERMINAL_SAFE_ON] = KIND(OUTPUT) | KIND(FOLLOWER) | KIND(RESUME),
	[TERMINAL_SAFE_HOLD] = KIND(OUTPUT) | KIND(FOLLOWER) | KIND(RESUME),
	[TERMINAL_RESUME] = KIND(OUTPUT) | KIND(FOLLOWER) | KIND(SAFE_ON) | KIND(SAFE_HOLD),
};

static uint64_t shared(const struct terminal_owner *a, const struct terminal_owner *b)
{
	return goes_with[a->kind] >> b->kind & 1 ? 0 : a->terminals & b->terminals;
}

/* Terminals that can be used in this way on a board. */
static uint64_t able(const struct wire_pinmap *board, const struct terminal_owner *owner)
{
	switch ((enum terminal_kind)owner->kind) {
	case TERMINAL_INPUT:
	case TERMINAL_LISTENER:
		return board->digital_in;
	case TERMINAL_COUNTER:
		return board->counter;
	case TERMINAL_ANALOG:
	case TERMINAL_SENSOR:
		return board->analog_in;
	case TERMINAL_OUTPUT:
	case TERMINAL_FOLLOWER:
	case TERMINAL_LOOP:
	case TERMINAL_SAFE_ON:
	case TERMINAL_SAFE_HOLD:
	case TERMINAL_RESUME:
		return board->digital_out;
	case TERMINAL_SCANNED:
	case TERMINAL_DRIVEN:
	case TERMINAL_COMMANDED:
	case TERMINAL_KINDS:
		break;
	}
	return board->digital_in | board->digital_out;
}

/* Owners on each board that is to be looked at. */
struct boards {
	const struct wire_pinmap *map[BOARDS_MAX];
	struct terminal_owner owner[BOARDS_MAX][OWNERS_MAX];
	uint64_t any[OWNERS_MAX]; /* of an owner's terminals, on whichever board */
	size_t count, owners;
};

static void add_board(struct boards *boards, struct look look, const struct wire_pinmap *map)
{
	for (size_t i = 0; i < boards->count; i++)
		if (boards->map[i] == map)
			return;
	if (boards->count == BOARDS_MAX)
		return;
	look.board = map;
	boards->map[boards->count] = map;
	boards->owners = list_owners(&look, boards->owner[boards->count]);
	for (size_t i = 0; i < boards->owners; i++)
		boards->any[i] |= boards->owner[boards->count][i].terminals;
	boards->count++;
}

static void add_known(struct boards *boards, const struct look *look)
{
	const struct wire_model *model;

	for (size_t i = 0; (model = wire_model_at(i)); i++)
		if (model->ethernet && model->pinmap->digital_in)
			add_board(boards, *look, model->pinmap);
}

/* On one of the boards they are in conflict, and no other one can do both. */
static uint64_t conflict(const struct boards *boards, size_t a, size_t b)
{
	uint64_t anywhere = 0, everywhere = UINT64_MAX;

	if (!(boards->any[a] & boards->any[b]))
		return 0;
	for (size_t i = 0; i < boards->count; i++) {
		const struct terminal_owner *of = boards->owner[i];
		const uint64_t both = shared(&of[a], &of[b]);
		const uint64_t can = able(boards->map[i], &of[a]) & able(boards->map[i], &of[b]);

		anywhere |= both;
		everywhere &= both | ~can;
	}
	return anywhere & everywhere;
}

/* Follows from the digital output, of which it has been told already. */
static bool follows(const struct terminal_owner *owner)
{
	return owner->kind >= TERMINAL_SAFE_ON;
}

size_t terminal_conflicts(const struct pokeys_settings *settings,
			  const struct terminal_daemon *daemon, const struct wire_pinmap *board,
			  struct terminal_conflict out[TERMINAL_CONFLICTS_MAX])
{
	const struct look look = { settings, daemon, board };
	struct boards boards = { .count = 0, .owners = 0 };
	uint64_t told = 0;
	size_t count = 0;

	if (board)
		add_board(&boards, look, board);
	else
		add_known(&boards, &look);
	for (size_t b = 1; b < boards.owners; b++) {
		for (size_t a = 0; a < b && count < TERMINAL_CONFLICTS_MAX; a++) {
			const struct terminal_owner *of = boards.owner[0];
			const uint64_t both = conflict(&boards, a, b) &
					      ~(follows(&of[b]) ? told : 0);

			if (!both)
				continue;
			told |= both;
			out[count++] = (struct terminal_conflict){ of[a], of[b], both };
		}
	}
	return count;
}

const char *terminal_key(unsigned int number, unsigned int *index)
{
	for (size_t i = 0; i < SOURCES; i++) {
		*index = number;
		if (number < sources[i].count)
			return sources[i].key;
		number -= sources[i].count;
	}
	return NULL;
}
