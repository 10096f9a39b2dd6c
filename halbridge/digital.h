/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Everything that is one bit and is not a motion: pins, external outputs,
 * PoExtBus, and the digital counters beside them.
 */
#ifndef HALBRIDGE_DIGITAL_H
#define HALBRIDGE_DIGITAL_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/command.h>
#include <pokeys/state.h>
#include "halbridge/refusal.h"
#include "halbridge/values.h"

/* What the pins were last filled from, and what is commanded. */
struct digital {
	bool begun;
	uint8_t in[POKEYS_PIN_BYTES], out[POKEYS_PIN_BYTES], invert[POKEYS_PIN_BYTES];
	uint8_t shown_invert[POKEYS_PIN_BYTES];
	uint8_t bus[POKEYS_POEXTBUS], external, relays;
	bool external_wanted, relays_wanted, bus_wanted[POKEYS_POEXTBUS];
	uint32_t counter[POKEYS_PINS];
	uint64_t idle; /* pins that are set and drive nothing, as told */
};

/* From a fresh state image to the pins. Realtime. */
void digital_read(struct digital *digital, struct values *values, const struct pokeys_state *state);

/*
 * From the pins to the command. A pin that is set though the device has no output there is
 * refused, once the device's settings are as they shall be and while its data are fresh.
 * Realtime.
 */
void digital_write(struct digital *digital, const struct values *values,
		   const struct pokeys_state *state, bool fresh, struct pokeys_command *command,
		   struct refusals *refusals);

#endif
