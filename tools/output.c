// SPDX-License-Identifier: GPL-2.0-or-later
/* pokeysctl output: hold digital outputs. */
#include <stdio.h>
#include <string.h>
#include "settings/terminal.h"
#include "tools/hold.h"

static uint64_t load(const uint8_t bytes[POKEYS_PIN_BYTES])
{
	uint64_t pins = 0;

	for (unsigned int i = 0; i < POKEYS_PIN_BYTES; i++)
		pins |= (uint64_t)bytes[i] << 8 * i;
	return pins;
}

static void store(uint8_t bytes[POKEYS_PIN_BYTES], uint64_t pins)
{
	for (unsigned int i = 0; i < POKEYS_PIN_BYTES; i++)
		bytes[i] = (uint8_t)(pins >> 8 * i);
}

static bool begin(struct hold *hold, const struct pokeys_state *state,
		  const struct pokeys_report *report)
{
	const uint64_t missing = hold->terminals & ~load(state->digital_out_owned);
	char text[TERMINAL_LIST_MAX];

	(void)report;
	if (missing)
		complain("%s: %s: no digital output of this device; add it to digital-outputs in "
			 "pokeysd.conf, then run: pokeysctl config apply %s",
			 hold->device, terminal_list(missing, text), hold->device);
	hold->before = load(state->digital_out) & hold->terminals;
	return !missing;
}

static void fill(const struct hold *hold, bool wanted, struct pokeys_command *image)
{
	store(image->digital_out, wanted ? hold->wanted : hold->before);
	store(image->digital_out_mask, hold->terminals);
}

static bool is_so(const struct hold *hold, bool wanted, const struct pokeys_state *state)
{
	return (load(state->digital_out) & hold->terminals) ==
	       (wanted ? hold->wanted : hold->before);
}

int command_output(const struct options *options)
{
	static const struct hold_kind kind = { begin, fill, is_so };
	char *const *names = options->names;
	struct hold hold = { .kind = &kind };

	if (options->name_count != 3 || (strcmp(names[2], "on") && strcmp(names[2], "off"))) {
		complain("output needs a device, terminals, and on or off: pokeysctl output mill "
			 "31 on --for 5");
		return STATUS_USAGE;
	}
	if (!hold_terminals(names[1], &hold.terminals)) {
		complain("\"%s\": terminals are numbers from 1 to %d, such as 31 or 31,33-34",
			 names[1], POKEYS_PINS);
		return STATUS_USAGE;
	}
	hold.device = names[0];
	snprintf(hold.how, sizeof(hold.how), "%s", names[2]);
	hold.wanted = strcmp(names[2], "on") ? 0 : hold.terminals;
	return hold_for(&hold, options);
}
