/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What the commands that hold something for a while share. */
#ifndef TOOLS_HOLD_H
#define TOOLS_HOLD_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/shm.h>
#include "tools/pokeysctl.h"

struct hold;

struct hold_kind {
	/* Can it be? If not, false, and it has been said why. Keeps what is there now. */
	bool (*begin)(struct hold *hold, const struct pokeys_state *state,
		      const struct pokeys_report *report);
	/* The command for what is wanted, or for what was there; `image` is empty. */
	void (*fill)(const struct hold *hold, bool wanted, struct pokeys_command *image);
	bool (*is_so)(const struct hold *hold, bool wanted, const struct pokeys_state *state);
};

struct hold {
	const struct hold_kind *kind;
	const char *device;
	char how[48];              /* "on", as it is said behind the terminals */
	uint64_t terminals;        /* bit = terminal - 1 */
	uint64_t wanted, before;   /* outputs: of them, those that are on */
	double duty;               /* PWM: 0..1 */
	uint32_t channels, period; /* bit = channel; ticks */
};

/* "31", "31,33" or "31-34". False if it is none of them. */
bool hold_terminals(const char *text, uint64_t *terminals);

/* Hold it as long as the options say. An exit status. */
int hold_for(struct hold *hold, const struct options *options);

#endif
