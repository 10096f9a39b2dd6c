/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Keyboards: the matrix, the kbd48CNC, and PoNET modules in general.
 *
 * A kbd48CNC is a PoNET module whose keys the daemon has put into order; the
 * same bits stand raw in the module's words. Its lamps are commanded as soon
 * as one of them has been true, a module's outputs as soon as one word is not
 * 0, so that what somebody else shows stays until we have something to show.
 *
 * A module that does not answer keeps its last inputs and says so: `present`
 * falls. Its keys fall as well, when the daemon has waited a little.
 */
#include "halbridge/keys.h"
#include <stddef.h>
#include <string.h>
#include "halbridge/bits.h"
#include "halbridge/news.h"

enum { NO_MODULE = 255, BRIGHTNESS_MOST = 255, AS_IT_IS = -1 };

void keys_init(struct keys *keys)
{
	memset(keys, 0, sizeof(*keys));
	keys->brightness = AS_IT_IS;
	for (unsigned int i = 0; i < POKEYS_PONET; i++)
		keys->module_brightness[i] = AS_IT_IS;
}

static void read_matrix(struct keys *keys, struct values *values, const struct pokeys_state *state)
{
	bool pressed = news(keys->matrix, state->matrix, sizeof(keys->matrix), !keys->begun);
	bool enabled = news(&keys->matrix_enabled, &state->matrix_enabled, 1, !keys->begun);

	if (!pressed && !enabled)
		return;
	bits_to_bools(values->matrix.key, state->matrix, NULL, POKEYS_MATRIX_BYTES);
	values->matrix.enabled = state->matrix_enabled;
	values_changed(values, BLOCK_MATRIX);
}

static bool is_present(const struct pokeys_ponet_module *module)
{
	return module->type && !module->status && !module->failures;
}

static void read_module(struct value_ponet_module *value, const struct pokeys_ponet_module *module)
{
	value->present = is_present(module);
	value->type = module->type;
	value->address = module->address;
	value->size = module->size;
	value->options = module->options;
	value->status = module->status;
	value->light = module->light;
	value->version = module->version;
	value->failures = module->failures;
	memcpy(value->in, module->data, sizeof(value->in));
}

static void read_kbd48(struct values *values, const struct pokeys_state *state)
{
	uint8_t buttons[VALUES_KEYS / 8];
	unsigned int number = state->kbd48_module;
	bool there = number < POKEYS_PONET;

	memcpy(buttons, &state->kbd48_keys, sizeof(buttons));
	bits_to_bools(values->kbd48.button, buttons, NULL, sizeof(buttons));
	values->kbd48.module = there ? number : NO_MODULE;
	values->kbd48.present = there && is_present(&state->ponet[number]);
	values->kbd48.light = there ? state->ponet[number].light : 0;
	values_changed(values, BLOCK_KBD48);
}

void keys_read(struct keys *keys, struct values *values, const struct pokeys_state *state)
{
	const uint8_t bus[] = { state->ponet_state, state->ponet_count, state->kbd48_module };
	bool first = !keys->begun;
	bool bus_news = news(keys->bus, bus, sizeof(bus), first);
	bool modules = news(keys->module, state->ponet, sizeof(keys->module), first);

	read_matrix(keys, values, state);
	if (news(&keys->keys, &state->kbd48_keys, sizeof(keys->keys), first) || bus_news || modules)
		read_kbd48(values, state);
	keys->begun = true;
	if (!bus_news && !modules)
		return;
	values->ponet.state = state->ponet_state;
	values->ponet.count = state->ponet_count;
	for (unsigned int i = 0; i < POKEYS_PONET; i++)
		read_module(&values->ponet.module[i], &state->ponet[i]);
	values_changed(values, BLOCK_PONET);
}

/* -1..255, else the last good one. */
static int32_t brightness_of(int32_t wanted, int32_t *good, bool *bad, size_t offset,
			     struct refusals *refusals)
{
	bool wrong = wanted < AS_IT_IS || wanted > BRIGHTNESS_MOST;

	refusal_mark(refusals, bad, wrong, offset, REFUSAL_RANGE, wanted);
	if (!wrong)
		*good = wanted;
	return *good;
}

static void write_kbd48(struct keys *keys, struct values *values, struct pokeys_command *command,
			struct refusals *refusals)
{
	int32_t brightness = brightness_of(values->kbd48.brightness, &keys->brightness,
					   &keys->brightness_bad,
					   offsetof(struct values, kbd48.brightness), refusals);
	uint64_t leds = 0;

	bools_to_bits((uint8_t *)&leds, values->kbd48.led, VALUES_KEYS / 8);
	if (values->kbd48.auto_brightness && values->kbd48.present)
		brightness = BRIGHTNESS_MOST - (int32_t)values->kbd48.light;
	keys->leds_wanted |= leds != 0;
	command->kbd48_leds = leds;
	command->kbd48_flags = keys->leds_wanted ? POKEYS_KBD48_LEDS : 0;
	if (brightness >= 0)
		command->kbd48_flags |= POKEYS_KBD48_BRIGHTNESS;
	command->kbd48_brightness = brightness >= 0 ? (uint8_t)brightness : 0;
	values->kbd48.brightness_sent = command->kbd48_brightness;
}

static void write_module(struct keys *keys, const struct value_ponet_module *value, unsigned int i,
			 struct pokeys_command *command, struct refusals *refusals)
{
	const size_t at = offsetof(struct values, ponet.module) + i * sizeof(*value) +
			  offsetof(struct value_ponet_module, brightness);
	int32_t brightness = brightness_of(value->brightness, &keys->module_brightness[i],
					   &keys->module_bad[i], at, refusals);

	if (value->out[0] | value->out[1] | value->out[2] | value->out[3] || brightness >= 0)
		command->ponet_mask |= UINT32_C(1) << i;
	memcpy(command->ponet_data[i], value->out, sizeof(command->ponet_data[i]));
	command->ponet_brightness[i] = brightness >= 0 ? (uint8_t)brightness : BRIGHTNESS_MOST;
}

void keys_write(struct keys *keys, struct values *values, struct pokeys_command *command,
		struct refusals *refusals)
{
	write_kbd48(keys, values, command, refusals);
	for (unsigned int i = 0; i < POKEYS_PONET; i++)
		write_module(keys, &values->ponet.module[i], i, command, refusals);
}
