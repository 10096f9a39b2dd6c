// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeysctl as the one commander of a device, for a while: to try an output, or to move an
 * axis, without LinuxCNC.
 *
 * There is one commander at a time, the daemon judges what it wants, and the device goes to its
 * safe state when it is killed or hangs. So it cannot interfere with a machine that is at work:
 * then somebody else commands.
 *
 * As root it becomes the daemon's user before it attaches: nothing here needs a right of root's.
 */
#include "tools/commander.h"
#include <errno.h>
#include <grp.h>
#include <signal.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>
#include "tools/view.h"

enum {
	PERIOD_MS = 1,
	LEASE_MS = 1000,
	ATTACH_MS = 3000,
	REFUSED_MS = 1000,
};
#define SILENT_NS UINT64_C(500000000)

static volatile sig_atomic_t ended;

static void end(int number)
{
	(void)number;
	ended = 1;
}

bool commander_ended(void)
{
	return ended;
}

uint64_t commander_ms(void)
{
	return view_now() / 1000000;
}

void commander_nap(unsigned int ms)
{
	const struct timespec moment = { .tv_nsec = ms * 1000000L };

	nanosleep(&moment, NULL);
}

bool commander_read(pokeys_client *client, struct pokeys_state *state)
{
	return !pokeys_client_read(client, state) && state->link == POKEYS_LINK_RUNNING &&
	       state->flags & POKEYS_STATE_COMMANDER &&
	       pokeys_age_ns(state->t_publish_ns, view_now()) < SILENT_NS;
}

uint32_t commander_session(void)
{
	return (uint32_t)(view_now() >> 10 ^ (uint64_t)getpid() << 16) | 1;
}

void commander_order(struct pokeys_command *command, struct pokeys_one_shot shot)
{
	shot.id = command->one_shot_head++;
	command->one_shot[shot.id % POKEYS_ONE_SHOTS] = shot;
}

enum pokeys_outcome commander_outcome(const struct pokeys_command *command,
				      const struct pokeys_state *state)
{
	const uint32_t id = command->one_shot_head - 1;
	const struct pokeys_one_shot_result *result =
		&state->one_shot[id % POKEYS_ONE_SHOT_RESULTS];

	if (state->one_shot_session != command->session || state->one_shot_ack <= id ||
	    result->id != id)
		return POKEYS_OUTCOME_NONE;
	return (enum pokeys_outcome)result->outcome;
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
	const uint64_t end_ms = commander_ms() + ATTACH_MS;
	const uint64_t refused_ms = commander_ms() + REFUSED_MS;
	enum pokeys_client_state attached;
	char why[256];
	bool read = false;

	do {
		attached = pokeys_client_status(client, why, sizeof(why));
		/* the daemon takes a moment to clear the place of a commander that died */
		if (attached == POKEYS_CLIENT_REFUSED && commander_ms() > refused_ms) {
			complain("%s", why);
			return false;
		}
		read = attached == POKEYS_CLIENT_ATTACHED && !pokeys_client_read(client, state);
		read = read && pokeys_age_ns(state->t_publish_ns, view_now()) < SILENT_NS;
		if (read && state->link == POKEYS_LINK_RUNNING && state->flags & POKEYS_STATE_SAFE)
			return true;
		commander_nap(COMMANDER_TURN_MS);
	} while (!ended && commander_ms() < end_ms);
	if (ended)
		complain("ended before anything was commanded");
	else if (!read)
		complain("%s",
			 attached == POKEYS_CLIENT_ATTACHED ? "pokeysd does not publish" : why);
	else
		complain("%s; pokeysctl status says why",
			 state->link != POKEYS_LINK_RUNNING ?
				 "the device does not answer" :
				 "the outputs are not in the safe state");
	return false;
}

pokeys_client *commander_open(const struct options *options, const char *device,
			      struct pokeys_state *state, int *status)
{
	const struct sigaction action = { .sa_handler = end };
	pokeys_client *client;
	int result;

	*status = STATUS_FAILED;
	if (!drop_root(options->runtime_directory))
		return NULL;
	if (pokeys_client_open(&client, options->runtime_directory, device, "pokeysctl",
			       POKEYS_CLIENT_COMMANDER)) {
		complain("\"%s\" is not the name of a device, or the path of the runtime folder "
			 "is too long (49 characters)",
			 device);
		*status = STATUS_USAGE;
		return NULL;
	}
	sigaction(SIGINT, &action, NULL);
	sigaction(SIGTERM, &action, NULL);
	sigaction(SIGHUP, &action, NULL);
	result = pokeys_client_hold(client, PERIOD_MS, LEASE_MS);
	if (result)
		complain("no thread for the heartbeat: %s", strerror(-result));
	if (!result && attach(client, state))
		return client;
	pokeys_client_close(client);
	return NULL;
}
