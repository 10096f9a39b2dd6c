// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Something of a device is held for a while by pokeysctl, to find a wire or to try a relay or a
 * fan without LinuxCNC.
 *
 * It names nothing else, so the daemon leaves that as it is. At the end digital outputs are what
 * they were, for one that the safe state holds would stay on; PWM outputs are off.
 */
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include "settings/terminal.h"
#include "tools/commander.h"
#include "tools/hold.h"

enum { FOLLOW_MS = 3000, LOST_MS = 1000, USUAL_S = 5 };

/* "31", "31,33" or "31-34". */
bool hold_terminals(const char *text, uint64_t *terminals)
{
	unsigned long first, last;
	char *after;

	*terminals = 0;
	do {
		if (!isdigit((unsigned char)*text))
			return false;
		first = last = strtoul(text, &after, 10);
		if (*after == '-') {
			text = after + 1;
			if (!isdigit((unsigned char)*text))
				return false;
			last = strtoul(text, &after, 10);
		}
		if (first < 1 || last > POKEYS_PINS || first > last)
			return false;
		for (; first <= last; first++)
			*terminals |= UINT64_C(1) << (first - 1);
		text = after + 1;
	} while (*after == ',');
	return !*after;
}

/* By a daemon that lives, and that has our heartbeat. */
static bool is_so(pokeys_client *client, const struct hold *hold, bool wanted)
{
	struct pokeys_state state;

	return commander_read(client, &state) && hold->kind->is_so(hold, wanted, &state);
}

static void say_so(const struct hold *hold, double seconds)
{
	char text[TERMINAL_LIST_MAX];

	printf("%s: %s %s for %g s; Ctrl-C ends it sooner\n", hold->device,
	       terminal_list(hold->terminals, text), hold->how, seconds);
	fflush(stdout);
}

/* Until they are as wanted, or a signal asks for the end. False if that takes too long. */
static bool follow(pokeys_client *client, const struct hold *hold, bool wanted)
{
	const uint64_t end_ms = commander_ms() + FOLLOW_MS;
	struct pokeys_command image = { 0 };

	hold->kind->fill(hold, wanted, &image);
	pokeys_client_command(client, &image);
	while (!is_so(client, hold, wanted) && !(wanted && commander_ended())) {
		if (commander_ms() > end_ms || pokeys_client_renew(client))
			return false;
		commander_nap(COMMANDER_TURN_MS);
	}
	return true;
}

/* False if they are not what they shall be any more; a busy computer may miss a moment. */
static bool keep(pokeys_client *client, const struct hold *hold, double seconds)
{
	const uint64_t over_ms = commander_ms() + (uint64_t)(seconds * 1000);
	uint64_t so_ms = commander_ms();

	if (!commander_ended())
		say_so(hold, seconds);
	while (!commander_ended() && commander_ms() < over_ms) {
		if (pokeys_client_renew(client)) {
			complain("%s: this program was stopped, or pokeysd was away; the outputs "
				 "went to the safe state",
				 hold->device);
			return false;
		}
		if (is_so(client, hold, true)) {
			so_ms = commander_ms();
		} else if (commander_ms() - so_ms > LOST_MS) {
			complain("%s: the outputs do not follow any more; pokeysctl status %s says "
				 "why",
				 hold->device, hold->device);
			return false;
		}
		commander_nap(COMMANDER_TURN_MS);
	}
	return true;
}

/* What is said first is why; more lines would hide it. */
static bool switch_it(pokeys_client *client, const struct hold *hold, double seconds)
{
	if (follow(client, hold, true))
		return keep(client, hold, seconds);
	complain("%s: the outputs do not follow; pokeysctl status %s says why", hold->device,
		 hold->device);
	return false;
}

/* Also after a failure: an output that the safe state holds may be on. */
static bool put_back(pokeys_client *client, const struct hold *hold, bool well)
{
	if (follow(client, hold, false))
		return well;
	if (well)
		complain("%s: the outputs cannot be put back; pokeysctl status %s says why",
			 hold->device, hold->device);
	return false;
}

int hold_for(struct hold *hold, const struct options *options)
{
	const double seconds = options->duration_s > 0 ? options->duration_s : USUAL_S;
	struct pokeys_report report = { 0 };
	struct pokeys_state state;
	int status;
	pokeys_client *client = commander_open(options, hold->device, &state, &status);

	if (!client)
		return status;
	status = STATUS_FAILED;
	pokeys_client_read_report(client, &report); /* without one, no settings are known */
	if (hold->kind->begin(hold, &state, &report) &&
	    put_back(client, hold, switch_it(client, hold, seconds)))
		status = STATUS_OK;
	pokeys_client_close(client);
	return status;
}
