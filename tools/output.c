// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeysctl output: hold outputs for a while, to find a wire or to try a relay without
 * LinuxCNC.
 *
 * It is a commander like any other: there is one at a time, the daemon judges what it wants, and
 * the outputs go to the safe state when it is killed or hangs. So it cannot interfere with a
 * machine that is at work: then somebody else commands. It names no other output, so the daemon
 * leaves them as they are. At the end it puts back what it found, for an output that the safe
 * state holds would stay on.
 *
 * As root it becomes the daemon's user before it attaches: a commander maps memory that a whole
 * group may write to.
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
#include <pokeys/shm.h>
#include "settings/terminal.h"
#include "tools/pokeysctl.h"
#include "tools/view.h"

enum {
	PERIOD_MS = 1, LEASE_MS = 1000, TURN_MS = 20,
	ATTACH_MS = 3000, REFUSED_MS = 1000, FOLLOW_MS = 3000, SILENT_MS = 500, LOST_MS = 1000,
};

struct outputs {
	const char *device;
	uint64_t mask, wanted, before;
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
static bool take_terminals(const char *text, uint64_t *mask)
{
	unsigned long first, last;
	char *after;

	*mask = 0;
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
			*mask |= UINT64_C(1) << (first - 1);
		text = after + 1;
	} while (*after == ',');
	return !*after;
}

static bool take_words(const struct options *options, struct outputs *outputs)
{
	char *const *names = options->names;

	if (options->name_count != 3 || (strcmp(names[2], "on") && strcmp(names[2], "off"))) {
		complain("output wants a device, terminals, and on or off: pokeysctl output mill "
			 "31 on --for 5");
		return false;
	}
	if (!take_terminals(names[1], &outputs->mask)) {
		complain("\"%s\": terminals are numbers from 1 to %d, such as 31 or 31,33-34",
			 names[1], POKEYS_PINS);
		return false;
	}
	outputs->device = names[0];
	outputs->wanted = !strcmp(names[2], "on") ? outputs->mask : 0;
	return true;
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

static bool can_be(const struct outputs *outputs, const struct pokeys_state *state)
{
	const uint64_t missing = outputs->mask & ~load(state->digital_out_owned);
	char text[TERMINAL_LIST_MAX];

	if (missing)
		complain("%s: %s: no digital output of this device; add it to digital-outputs in "
			 "pokeysd.conf and restart pokeysd", outputs->device,
			 terminal_list(missing, text));
	return !missing;
}

/* By a daemon that lives, and that has our heartbeat. */
static bool is_so(pokeys_client *client, const struct outputs *outputs, uint64_t wanted)
{
	struct pokeys_state state;

	return !pokeys_client_read(client, &state) && state.link == POKEYS_LINK_RUNNING &&
	       state.flags & POKEYS_STATE_COMMANDER &&
	       pokeys_age_ns(state.t_publish_ns, view_now()) < SILENT_MS * UINT64_C(1000000) &&
	       (load(state.digital_out) & outputs->mask) == wanted;
}

static void say_so(const struct outputs *outputs, double seconds)
{
	char text[TERMINAL_LIST_MAX];

	printf("%s: %s %s", outputs->device, terminal_list(outputs->mask, text),
	       outputs->wanted ? "on" : "off");
	printf(" for %g s; Ctrl-C ends it sooner\n", seconds);
	fflush(stdout);
}

static void command(pokeys_client *client, const struct outputs *outputs, uint64_t wanted)
{
	struct pokeys_command image = { 0 };

	store(image.digital_out, wanted);
	store(image.digital_out_mask, outputs->mask);
	pokeys_client_command(client, &image);
}

/* Until they are as wanted. False if that takes too long. */
static bool follow(pokeys_client *client, const struct outputs *outputs, uint64_t wanted)
{
	const uint64_t end_ms = now_ms() + FOLLOW_MS;

	command(client, outputs, wanted);
	while (!is_so(client, outputs, wanted)) {
		if (now_ms() > end_ms || pokeys_client_renew(client))
			return false;
		nap();
	}
	return true;
}

/* False if they are not what they shall be any more; a busy computer may miss a moment. */
static bool hold(pokeys_client *client, const struct outputs *outputs, double seconds)
{
	const uint64_t over_ms = now_ms() + (uint64_t)(seconds * 1000);
	uint64_t so_ms = now_ms();

	say_so(outputs, seconds);
	while (!ended && now_ms() < over_ms) {
		if (pokeys_client_renew(client)) {
			complain("%s: this program was stopped, or pokeysd was away; the outputs "
				 "went to the safe state", outputs->device);
			return false;
		}
		if (is_so(client, outputs, outputs->wanted)) {
			so_ms = now_ms();
		} else if (now_ms() - so_ms > LOST_MS) {
			complain("%s: the outputs do not follow any more; pokeysctl status %s says "
				 "why", outputs->device, outputs->device);
			return false;
		}
		nap();
	}
	return true;
}

/* What is said first is why; more lines would hide it. */
static bool switch_them(pokeys_client *client, const struct outputs *outputs, double seconds)
{
	if (follow(client, outputs, outputs->wanted))
		return hold(client, outputs, seconds);
	complain("%s: the outputs do not follow; pokeysctl status %s says why", outputs->device,
		 outputs->device);
	return false;
}

/* Also after a failure: an output that the safe state holds may be on. */
static bool put_back(pokeys_client *client, const struct outputs *outputs, bool well)
{
	if (follow(client, outputs, outputs->before))
		return well;
	if (well)
		complain("%s: the outputs cannot be put back; pokeysctl status %s says why",
			 outputs->device, outputs->device);
	return false;
}

static int command_them(pokeys_client *client, struct outputs *outputs, double seconds)
{
	struct pokeys_state state;
	int result = pokeys_client_hold(client, PERIOD_MS, LEASE_MS);

	if (result) {
		complain("no thread for the heartbeat: %s", strerror(-result));
		return STATUS_FAILED;
	}
	if (!attach(client, &state) || !can_be(outputs, &state))
		return STATUS_FAILED;
	outputs->before = load(state.digital_out) & outputs->mask;
	return put_back(client, outputs, switch_them(client, outputs, seconds)) ? STATUS_OK :
										  STATUS_FAILED;
}

int command_output(const struct options *options)
{
	const struct sigaction action = { .sa_handler = end };
	struct outputs outputs;
	pokeys_client *client;
	int status;

	if (!take_words(options, &outputs))
		return STATUS_USAGE;
	if (!drop_root(options->runtime_directory))
		return STATUS_FAILED;
	if (pokeys_client_open(&client, options->runtime_directory, outputs.device, "pokeysctl",
			       POKEYS_CLIENT_COMMANDER)) {
		complain("\"%s\" is not the name of a device, or the path of the runtime folder "
			 "is too long (49 characters)", outputs.device);
		return STATUS_USAGE;
	}
	sigaction(SIGINT, &action, NULL);
	sigaction(SIGTERM, &action, NULL);
	status = command_them(client, &outputs, options->duration_s);
	pokeys_client_close(client);
	return status;
}
