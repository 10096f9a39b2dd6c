// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Something of a device is held for a while by pokeysctl, to find a wire or to try a relay or a
 * fan without LinuxCNC.
 *
 * It is a commander like any other: there is one at a time, the daemon judges what it wants, and
 * the outputs go to the safe state when it is killed or hangs. So it cannot interfere with a
 * machine that is at work: then somebody else commands. It names nothing else, so the daemon
 * leaves that as it is. At the end digital outputs are what they were, for one that the safe
 * state holds would stay on; PWM outputs are off.
 *
 * As root it becomes the daemon's user before it attaches: nothing here needs a right of root's.
 */
#include <ctype.h>
#include <errno.h>
#include <grp.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>
#include "settings/terminal.h"
#include "tools/hold.h"
#include "tools/view.h"

enum {
	PERIOD_MS = 1, LEASE_MS = 1000, TURN_MS = 20,
	ATTACH_MS = 3000, REFUSED_MS = 1000, FOLLOW_MS = 3000, SILENT_MS = 500, LOST_MS = 1000,
};

static volatile sig_atomic_t ended;

static void end(int number)
{
	(void)number;
	ended = 1;
}

static uint64_t now_ms(void)
{
	return view_now() / 1000000;
}

static void nap(void)
{
	const struct timespec moment = { .tv_nsec = TURN_MS * 1000000L };

	nanosleep(&moment, NULL);
}

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

/* To the user and group of the folder: the daemon's, which may be root in a folder of its own. */
static bool drop_root(const char *runtime)
{
	struct stat status;

	if (geteuid())
		return true;
	if (stat(runtime, &status)) {
		complain("%s: %s; is pokeysd running?", runtime, strerror(errno));
		return false;
	}
	if (!setgroups(0, NULL) && !setresgid(status.st_gid, status.st_gid, status.st_gid) &&
	    !setresuid(status.st_uid, status.st_uid, status.st_uid))
		return true;
	complain("root cannot become the owner of %s: %s", runtime, strerror(errno));
	return false;
}

/*
 * Until nobody commands the device any more, if it runs: what its outputs are then is what the
 * others keep. Somebody may have ended just now.
 */
static bool attach(pokeys_client *client, struct pokeys_state *state)
{
	const uint64_t end_ms = now_ms() + ATTACH_MS, refused_ms = now_ms() + REFUSED_MS;
	enum pokeys_client_state attached;
	char why[256];
	bool read = false;

	do {
		attached = pokeys_client_status(client, why, sizeof(why));
		/* the daemon takes a moment to clear the place of a commander that died */
		if (attached == POKEYS_CLIENT_REFUSED && now_ms() > refused_ms) {
			complain("%s", why);
			return false;
		}
		read = attached == POKEYS_CLIENT_ATTACHED && !pokeys_client_read(client, state);
		if (read && state->link == POKEYS_LINK_RUNNING &&
		    state->flags & POKEYS_STATE_SAFE)
			return true;
		nap();
	} while (!ended && now_ms() < end_ms);
	if (ended)
		complain("ended before anything was switched");
	else if (!read)
		complain("%s", attached == POKEYS_CLIENT_ATTACHED ? "the state cannot be read" :
			 why);
	else
		complain("%s; pokeysctl status says why", state->link != POKEYS_LINK_RUNNING ?
			 "the device does not answer" : "the outputs are not in the safe state");
	return false;
}

/* By a daemon that lives, and that has our heartbeat. */
static bool is_so(pokeys_client *client, const struct hold *hold, bool wanted)
{
	struct pokeys_state state;

	return !pokeys_client_read(client, &state) && state.link == POKEYS_LINK_RUNNING &&
	       state.flags & POKEYS_STATE_COMMANDER &&
	       pokeys_age_ns(state.t_publish_ns, view_now()) < SILENT_MS * UINT64_C(1000000) &&
	       hold->kind->is_so(hold, wanted, &state);
}

static void say_so(const struct hold *hold, double seconds)
{
	char text[TERMINAL_LIST_MAX];

	printf("%s: %s %s for %g s; Ctrl-C ends it sooner\n", hold->device,
	       terminal_list(hold->terminals, text), hold->how, seconds);
	fflush(stdout);
}

/* Until they are as wanted. False if that takes too long. */
static bool follow(pokeys_client *client, const struct hold *hold, bool wanted)
{
	const uint64_t end_ms = now_ms() + FOLLOW_MS;
	struct pokeys_command image = { 0 };

	hold->kind->fill(hold, wanted, &image);
	pokeys_client_command(client, &image);
	while (!is_so(client, hold, wanted)) {
		if (now_ms() > end_ms || pokeys_client_renew(client))
			return false;
		nap();
	}
	return true;
}

/* False if they are not what they shall be any more; a busy computer may miss a moment. */
static bool keep(pokeys_client *client, const struct hold *hold, double seconds)
{
	const uint64_t over_ms = now_ms() + (uint64_t)(seconds * 1000);
	uint64_t so_ms = now_ms();

	say_so(hold, seconds);
	while (!ended && now_ms() < over_ms) {
		if (pokeys_client_renew(client)) {
			complain("%s: this program was stopped, or pokeysd was away; the outputs "
				 "went to the safe state", hold->device);
			return false;
		}
		if (is_so(client, hold, true)) {
			so_ms = now_ms();
		} else if (now_ms() - so_ms > LOST_MS) {
			complain("%s: the outputs do not follow any more; pokeysctl status %s says "
				 "why", hold->device, hold->device);
			return false;
		}
		nap();
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

static int command_it(pokeys_client *client, struct hold *hold, double seconds)
{
	struct pokeys_state state;
	int result = pokeys_client_hold(client, PERIOD_MS, LEASE_MS);

	if (result) {
		complain("no thread for the heartbeat: %s", strerror(-result));
		return STATUS_FAILED;
	}
	if (!attach(client, &state) || !hold->kind->begin(hold, &state))
		return STATUS_FAILED;
	return put_back(client, hold, switch_it(client, hold, seconds)) ? STATUS_OK : STATUS_FAILED;
}

int hold_for(struct hold *hold, const struct options *options)
{
	const struct sigaction action = { .sa_handler = end };
	pokeys_client *client;
	int status;

	if (!drop_root(options->runtime_directory))
		return STATUS_FAILED;
	if (pokeys_client_open(&client, options->runtime_directory, hold->device, "pokeysctl",
			       POKEYS_CLIENT_COMMANDER)) {
		complain("\"%s\" is not the name of a device, or the path of the runtime folder "
			 "is too long (49 characters)", hold->device);
		return STATUS_USAGE;
	}
	sigaction(SIGINT, &action, NULL);
	sigaction(SIGTERM, &action, NULL);
	sigaction(SIGHUP, &action, NULL);
	status = command_it(client, hold, options->duration_s);
	pokeys_client_close(client);
	return status;
}
