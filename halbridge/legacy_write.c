/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Outputs under their older names, laid over the command that the canonical
 * ones have made.
 *
 * External relays and outputs: which bit is which depends on the board, and a
 * board without PG-extended-io has none. They are commanded as the canonical
 * ones are, once one of them has been true: a machine that has none connected
 * must not lose what somebody else has switched on.
 *
 * Analog outputs are a pulse width: value * scale + offset, kept between the
 * limits, as a part of max-v. They did nothing for years, so they do nothing
 * until somebody says so (legacy.adcout-follows).
 *
 * All this is done with data that are stale as well: the daemon goes on sending
 * what stands in the command, and a late packet must not turn a spindle down.
 */
#include "halbridge/legacy.h"
#include <math.h>
#include <stddef.h>
#include <string.h>
#include "halbridge/exchange.h"

#define PERIOD_DEFAULT	2500	/* ticks, what the old component used */

enum { BOARD_57CNC = 32, BOARD_57CNC_PRO = 33 }; /* protocol section 2.3 */

/* Bits of the outputs' byte: relay 0..3, output 0..3. */
struct external_map {
	uint8_t relay[LEGACY_EXTERNAL], output[LEGACY_EXTERNAL];
	bool relays_apart; /* relays have a byte of their own */
};

static const struct external_map *external_map(uint32_t board)
{
	static const struct external_map cnc = { { 7, 0, 2, 1 }, { 3, 4, 5, 6 }, false };
	static const struct external_map pro = { { 0, 7, 1, 2 }, { 3, 4, 5, 6 }, false };
	static const struct external_map other = { { 0, 1, 2, 3 }, { 0, 1, 2, 3 }, true };

	return board == BOARD_57CNC ? &cnc : board == BOARD_57CNC_PRO ? &pro : &other;
}

static void write_external(struct exchange *exchange, const struct values *values)
{
	const struct external_map *map = external_map(exchange->state->identity.hardware);
	struct pokeys_command *command = &exchange->command;
	uint8_t relays = 0, outputs = 0, used = 0;

	if (!values->legacy.engine_set.extended && map->relays_apart)
		return;
	for (unsigned int i = 0; i < LEGACY_EXTERNAL; i++) {
		if (values->legacy.engine.relay[i])
			*(map->relays_apart ? &relays : &outputs) |= (uint8_t)(1u << map->relay[i]);
		if (values->legacy.engine.output[i])
			outputs |= (uint8_t)(1u << map->output[i]);
		used |= (uint8_t)(values->legacy.engine.relay[i] | values->legacy.engine.output[i]);
	}
	exchange->legacy.external_used |= used != 0;
	if (!exchange->legacy.external_used)
		return;
	command->external_outputs |= outputs;
	command->external_outputs_mask = UINT8_MAX;
	command->relays |= relays;
	command->relays_mask = map->relays_apart ? UINT8_MAX : command->relays_mask;
}

static double full_scale(const struct exchange *exchange, const struct legacy_adcout *value,
			 unsigned int i)
{
	double full = value->full;

	if (full > 0 && full <= 1e9)
		return full;
	return i == 0 && exchange->state->identity.hardware == BOARD_57CNC ? 10 : 5;
}

/* Ticks of a period that an output is on. */
static uint32_t duty_of(struct exchange *exchange, const struct legacy_adcout *value,
			unsigned int i, uint32_t period)
{
	double full = full_scale(exchange, value, i), low = value->low, high = value->high;
	double scale = value->scale, wanted;

	wanted = value->value * (scale == 0 ? 1 : scale) + value->offset;
	refusal_mark(&exchange->refusals, &exchange->legacy.value_bad[i], !isfinite(wanted),
		     offsetof(struct values, legacy.adcout) + i * sizeof(*value) +
			     offsetof(struct legacy_adcout, value),
		     REFUSAL_NOT_FINITE, value->value);
	if (!(low < high)) {
		low = 0;
		high = full;
	}
	if (!isfinite(wanted))
		return 0;
	wanted = fmin(fmax(wanted, low), high) / full;
	return (uint32_t)(fmin(fmax(wanted, 0), 1) * period + 0.5);
}

static void write_adcout(struct exchange *exchange, struct values *values)
{
	struct pokeys_command *command = &exchange->command;
	uint32_t period = values->legacy.pwm_period;

	if (!period)
		period = exchange->state->pwm_period ? exchange->state->pwm_period : PERIOD_DEFAULT;
	for (unsigned int i = 0; i < POKEYS_PWM; i++) {
		struct legacy_adcout *value = &values->legacy.adcout[i];
		unsigned int channel = POKEYS_PWM - 1 - i;

		value->duty = duty_of(exchange, value, i, period);
		if (!values->legacy.choice.adcout)
			continue;
		command->pwm_duty[channel] = value->enable ? value->duty : 0;
		command->pwm_enable |= (uint32_t)value->enable << channel;
	}
	if (values->legacy.choice.adcout)
		command->pwm_period = period;
}

static void write_ponet(struct exchange *exchange, const struct values *values)
{
	struct pokeys_command *command = &exchange->command;

	for (unsigned int i = 0; i < POKEYS_PONET; i++) {
		if (i == exchange->state->kbd48_module || !exchange->state->ponet[i].type)
			continue;
		for (unsigned int k = 0; k < LEGACY_WORDS; k++)
			command->ponet_data[i][k] = (uint8_t)values->legacy.ponet.out[i][k];
		command->ponet_mask |= 1u << i;
	}
}

/* The keyboard's lamps, if they are commanded at all. */
static void write_keys(struct exchange *exchange, struct values *values)
{
	struct pokeys_command *command = &exchange->command;

	if (!(command->kbd48_flags & POKEYS_KBD48_LEDS))
		return;
	if (values->legacy.choice.pressed_key)
		command->kbd48_leds |= exchange->state->kbd48_keys;
	if (!values->legacy.choice.key_brightness || command->kbd48_flags & POKEYS_KBD48_BRIGHTNESS)
		return;
	command->kbd48_flags |= POKEYS_KBD48_BRIGHTNESS;
	command->kbd48_brightness = (uint8_t)(UINT8_MAX - values->kbd48.light);
	values->kbd48.brightness_sent = command->kbd48_brightness;
	values_changed(values, BLOCK_KBD48);
}

static void write_emergency_pin(struct exchange *exchange, const struct values *values)
{
	const uint32_t pin = values->legacy.engine_set.emergency_out_pin - 1;
	struct pokeys_command *command = &exchange->command;

	if (pin >= POKEYS_PINS)
		return;
	command->digital_out[pin / 8] &= (uint8_t)~(1u << pin % 8);
	command->digital_out[pin / 8] |= (uint8_t)(values->legacy.engine.emergency_out << pin % 8);
}

void legacy_write_outputs(struct exchange *exchange, struct values *values)
{
	write_external(exchange, values);
	write_adcout(exchange, values);
	if (values->legacy.choice.ponet_out)
		write_ponet(exchange, values);
	write_keys(exchange, values);
	if (values->legacy.choice.emergency_out)
		write_emergency_pin(exchange, values);
	if (!values->legacy.poextbus.count)
		memset(exchange->command.poextbus_mask, 0, sizeof(exchange->command.poextbus_mask));
}

/* Which output is which depends on the device. */
static bool is_known(const struct exchange *exchange)
{
	return exchange->state->link == POKEYS_LINK_CONFIGURING ||
	       exchange->state->link == POKEYS_LINK_RUNNING;
}

void legacy_write(struct exchange *exchange, struct values *values, uint64_t now_ns)
{
	if (!exchange->legacy.on)
		return;
	if (is_known(exchange))
		legacy_write_outputs(exchange, values);
	legacy_write_engine(exchange, values, now_ns);
}
