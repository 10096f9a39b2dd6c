/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Keyboards and PoNET modules.
 */
#ifndef HALBRIDGE_KEYS_H
#define HALBRIDGE_KEYS_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/command.h>
#include <pokeys/state.h>
#include "halbridge/refusal.h"
#include "halbridge/values.h"

/* What the pins were last filled from, and what is commanded. */
struct keys {
	bool begun;
	uint8_t matrix[POKEYS_MATRIX_BYTES], matrix_enabled;
	struct pokeys_ponet_module module[POKEYS_PONET];
	uint8_t bus[3]; /* state, count, kbd48_module */
	uint64_t keys;
	bool leds_wanted, brightness_bad, module_bad[POKEYS_PONET];
	int32_t brightness, module_brightness[POKEYS_PONET]; /* last good ones */
};

void keys_init(struct keys *keys);

/* From a fresh state image to the pins. Realtime. */
void keys_read(struct keys *keys, struct values *values, const struct pokeys_state *state);

/* From the pins to the command. Realtime. */
void keys_write(struct keys *keys, struct values *values, struct pokeys_command *command,
		struct refusals *refusals);

#endif
