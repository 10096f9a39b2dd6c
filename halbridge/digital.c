/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Bits both ways.
 *
 * Pins: exactly those that the device has configured as outputs are commanded,
 * with the value of their .out pin, connected or not; a pin that is an input
 * there stays untouched whatever its .out pin says, and that is told.
 *
 * External outputs and PoExtBus have no such configuration: whatever is
 * commanded is switched. Loading the component must not switch off what was
 * on, so nobody speaks until one of the outputs that are written together (a
 * byte) has once been true; from then on all of them are followed.
 *
 * The inputs of PoExtBus are what the device has shifted out: the bus itself
 * cannot be read (protocol section 3.12).
 */
#include "halbridge/digital.h"
#include <stddef.h>
#include <string.h>
#include <pokeys/settings.h>
#include "halbridge/bits.h"
#include "halbridge/news.h"

static void read_pins(struct digital *digital, struct values *values,
		      const struct pokeys_state *state)
{
	bool first = !digital->begun;
	bool inverted = news(digital->shown_invert, digital->invert, sizeof(digital->invert),
			     first);

	if (news(digital->in, state->digital_in, VALUES_PINS / 8, first)) {
		bits_to_bools(values->pin.in, state->digital_in, NULL, VALUES_PINS / 8);
		bools_invert(values->pin.in_not, values->pin.in, VALUES_PINS / 8);
		values_changed(values, BLOCK_PIN);
	}
	if (news(digital->out, state->digital_out, VALUES_PINS / 8, first) || inverted) {
		bits_to_bools(values->pin.out_fb, state->digital_out, digital->invert,
			      VALUES_PINS / 8);
		values_changed(values, BLOCK_PIN);
	}
}

static void read_external(struct digital *digital, struct values *values,
			  const struct pokeys_engine *engine)
{
	bool first = !digital->begun;
	bool outputs = news(&digital->external, &engine->outputs, 1, first);
	bool relays = news(&digital->relays, &engine->relays, 1, first);

	if (!outputs && !relays)
		return;
	bits_to_bools(values->external.output_fb, &engine->outputs, NULL, 1);
	bits_to_bools(values->external.relay_fb, &engine->relays, NULL, 1);
	values_changed(values, BLOCK_EXTERNAL);
}

static void read_bus(struct digital *digital, struct values *values, const uint8_t *bus)
{
	if (!news(digital->bus, bus, sizeof(digital->bus), !digital->begun))
		return;
	bits_to_bools(values->poextbus.in, bus, NULL, POKEYS_POEXTBUS);
	bools_invert(values->poextbus.in_not, values->poextbus.in, POKEYS_POEXTBUS);
	values_changed(values, BLOCK_POEXTBUS);
}

static void read_counters(struct digital *digital, struct values *values, const uint32_t *counter)
{
	if (!news(digital->counter, counter, sizeof(digital->counter), !digital->begun))
		return;
	memcpy(values->counter.value, counter, sizeof(values->counter.value));
	values_changed(values, BLOCK_COUNTER);
}

void digital_read(struct digital *digital, struct values *values, const struct pokeys_state *state)
{
	read_pins(digital, values, state);
	read_external(digital, values, &state->engine);
	read_bus(digital, values, state->poextbus);
	read_counters(digital, values, state->counter);
	digital->begun = true;
}

/* The terminals of these bytes, bit = pin. */
static uint64_t pins_of(const uint8_t bytes[POKEYS_PIN_BYTES])
{
	uint64_t pins;

	memcpy(&pins, bytes, sizeof(pins));
	return pins & ((UINT64_C(1) << POKEYS_PINS) - 1);
}

static void mark_idle(struct digital *digital, uint64_t idle, struct refusals *refusals)
{
	for (uint64_t left = idle ^ digital->idle; left; left &= left - 1) {
		const unsigned int pin = (unsigned int)__builtin_ctzll(left);
		bool was;

		refusal_changed(refusals, &was, idle >> pin & 1,
				offsetof(struct values, pin.out) + pin * sizeof(bool),
				REFUSAL_NO_OUTPUT, 1);
	}
	digital->idle = idle;
}

/* Set, and nothing is driven. While settings are on their way it may yet become an output. */
static void judge_idle(struct digital *digital, const uint8_t set[POKEYS_PIN_BYTES],
		       const struct pokeys_state *state, bool fresh, struct refusals *refusals)
{
	const bool settled = fresh && (state->config_state == POKEYS_CONFIG_APPLIED ||
				       state->config_state == POKEYS_CONFIG_REFUSED);
	const uint64_t without = settled ? ~pins_of(state->digital_out_owned) : digital->idle;
	const uint64_t idle = pins_of(set) & without;

	if (idle != digital->idle)
		mark_idle(digital, idle, refusals);
}

static void write_pins(struct digital *digital, const struct values *values,
		       const struct pokeys_state *state, bool fresh, struct pokeys_command *command,
		       struct refusals *refusals)
{
	uint8_t out[POKEYS_PIN_BYTES] = { 0 };

	bools_to_bits(out, values->pin.out, VALUES_PINS / 8);
	bools_to_bits(digital->invert, values->pin.out_invert, VALUES_PINS / 8);
	for (unsigned int i = 0; i < VALUES_PINS / 8; i++)
		command->digital_out[i] = out[i] ^ digital->invert[i];
	judge_idle(digital, out, state, fresh, refusals);
}

static void write_bus(struct digital *digital, const struct values *values,
		      struct pokeys_command *command)
{
	uint8_t out[POKEYS_POEXTBUS], invert[POKEYS_POEXTBUS];

	bools_to_bits(out, values->poextbus.out, sizeof(out));
	bools_to_bits(invert, values->poextbus.out_invert, sizeof(invert));
	for (unsigned int i = 0; i < POKEYS_POEXTBUS; i++) {
		digital->bus_wanted[i] |= out[i] | invert[i];
		command->poextbus[i] = digital->bus_wanted[i] ? out[i] ^ invert[i] : 0;
		command->poextbus_mask[i] = digital->bus_wanted[i] ? UINT8_MAX : 0;
	}
}

static void write_external(struct digital *digital, const struct values *values,
			   struct pokeys_command *command)
{
	bools_to_bits(&command->external_outputs, values->external.output, 1);
	bools_to_bits(&command->relays, values->external.relay, 1);
	digital->external_wanted |= command->external_outputs;
	digital->relays_wanted |= command->relays;
	command->external_outputs_mask = digital->external_wanted ? UINT8_MAX : 0;
	command->relays_mask = digital->relays_wanted ? UINT8_MAX : 0;
}

void digital_write(struct digital *digital, const struct values *values,
		   const struct pokeys_state *state, bool fresh, struct pokeys_command *command,
		   struct refusals *refusals)
{
	write_pins(digital, values, state, fresh, command, refusals);
	memcpy(command->digital_out_mask, state->digital_out_owned, POKEYS_PIN_BYTES);
	write_bus(digital, values, command);
	write_external(digital, values, command);
}
