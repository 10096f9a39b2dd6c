/* SPDX-License-Identifier: GPL-2.0-or-later */
/* pokeysctl as the one commander of a device, for a while. Cold, main thread. */
#ifndef TOOLS_COMMANDER_H
#define TOOLS_COMMANDER_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/shm.h>
#include "tools/pokeysctl.h"

/*
 * Become the commander of a device that runs and that nobody else commands; the library's
 * holder beats for a second at a time (pokeys_client_hold()). *state is what the device is then.
 * NULL with a *status to exit with, and it has been said why. Signals that end a program are
 * counted from then on (commander_ended()).
 */
pokeys_client *commander_open(const struct options *options, const char *device,
			      struct pokeys_state *state, int *status);

/* Has a signal asked for the end? */
bool commander_ended(void);

/* CLOCK_MONOTONIC. */
uint64_t commander_ms(void);

enum { COMMANDER_TURN_MS = 20 }; /* often enough for whoever looks on */

void commander_nap(unsigned int ms);

/* The state, by a daemon that lives, of a device that runs, with our heartbeat. */
bool commander_read(pokeys_client *client, struct pokeys_state *state);

/* A number for pokeys_command.session that no other start of this program has had. */
uint32_t commander_session(void);

/* Append a one-shot to the command. The caller sends the command. */
void commander_order(struct pokeys_command *command, struct pokeys_one_shot shot);

/* The outcome of the newest one-shot of the command. POKEYS_OUTCOME_NONE: not known yet. */
enum pokeys_outcome commander_outcome(const struct pokeys_command *command,
				      const struct pokeys_state *state);

#endif
