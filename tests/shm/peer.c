/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The other process of a test: a daemon, a reader or a commander that can be
 * killed. Started by exec (iceoryx2 does not survive a fork), says one line
 * when it is ready, and goes on until it is ended.
 *
 *	peer host DIRECTORY       publish patterns each millisecond, maintain
 *	peer flood DIRECTORY      the same without a pause
 *	peer known DIRECTORY      publish values that a monitor's test knows
 *	peer halted DIRECTORY     the same, with axes whose positions are too old
 *	peer future DIRECTORY     the same, with axes whose positions are an hour ahead
 *	peer reader DIRECTORY     read as fast as it can
 *	peer commander DIRECTORY  command each millisecond
 *	peer listener DIRECTORY   read, and be one who could be notified
 *	peer fixed DIRECTORY      be a daemon that breaks rule 1 (one root for ever)
 *	peer once DIRECTORY       poll once, say how it stands, end
 */
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/prctl.h>
#include <unistd.h>
#include "shm/iox.h"
#include "tests/shm/folder.h"

static volatile sig_atomic_t ended;

static void end(int signal_number)
{
	(void)signal_number;
	ended = 1;
}

static void say_ready(const char *what)
{
	printf("%s\n", what);
	fflush(stdout);
}

static void fill_known(struct pokeys_state *state, uint64_t cycle)
{
	memset(state, 0, sizeof(*state));
	state->cycle = cycle;
	state->t_publish_ns = state->t_digital_ns = folder_now_ns();
	state->stale_after_ns = UINT64_C(3600000000000);
	state->link = POKEYS_LINK_RUNNING;
	state->identity.serial = 12345;
	memcpy(state->identity.type, "PoKeys57CNC", sizeof("PoKeys57CNC"));
	state->digital_in[0] = 0x81;
	state->digital_in[6] = 0x40;
	state->digital_out[1] = 0x02;
	state->analog[2] = 4095;
	state->encoder[0] = -7;
	state->encoder[25] = 1000000;
	state->encoder_enabled = 1u | 1u << 25;
	state->engine.axes_enabled = 2;
	state->engine.axis[1].position = -250;
	state->engine.axis[1].enabled = 1;
	state->statistics.sent = 10;
	state->statistics.missed = 3;
	state->statistics.late = 2;
	state->statistics.lost = 1;
}

static void fill_halted(struct pokeys_state *state, uint64_t cycle)
{
	fill_known(state, cycle);
	state->capability.pulse_engine = 2;
	/* short, because twice this is subtracted: every machine has been up for longer */
	state->stale_after_ns = UINT64_C(1000000000);
	state->t_motion_ns = state->t_digital_ns - 2 * state->stale_after_ns;
}

static void fill_future(struct pokeys_state *state, uint64_t cycle)
{
	fill_known(state, cycle);
	state->capability.pulse_engine = 2;
	state->t_motion_ns = state->t_digital_ns + UINT64_C(3600000000000);
}

static int run_host(const char *directory, void (*fill)(struct pokeys_state *, uint64_t),
		    unsigned int pause_ms)
{
	struct shm_device *mill;
	struct shm_host *host;
	struct pokeys_state image;
	char why[256];

	if (shm_host_open(&host, directory, NULL, NULL, why, sizeof(why)) ||
	    shm_host_add(host, "mill", &mill, why, sizeof(why))) {
		say_ready(why);
		return 1;
	}
	fill(&image, 1);
	shm_device_write(mill, &image);
	if (shm_host_publish(host, why, sizeof(why))) {
		say_ready(why);
		return 1;
	}
	say_ready("ready");
	for (uint64_t cycle = 2; !ended; cycle++) {
		fill(&image, cycle);
		shm_device_write(mill, &image);
		if (cycle % 50 == 0)
			shm_host_maintain(host);
		if (cycle % 100 == 0)
			shm_device_notify(mill);
		if (pause_ms)
			folder_sleep_ms(pause_ms);
	}
	shm_host_close(host);
	return 0;
}

static int run_client(const char *directory, unsigned int flags)
{
	struct pokeys_command command = { .session = (uint32_t)getpid() };
	struct pokeys_state state;
	pokeys_client *client;
	bool said = false;

	if (pokeys_client_open(&client, directory, "mill", "peer", flags) ||
	    pokeys_client_follow(client, 5))
		return 1;
	while (!ended) {
		if (pokeys_client_read(client, &state) == 0 && !said) {
			say_ready("ready");
			said = true;
		}
		if (flags & POKEYS_CLIENT_COMMANDER) {
			command.heartbeat++;
			pokeys_client_write(client, &command);
			folder_sleep_ms(1);
		}
	}
	pokeys_client_close(client);
	return 0;
}

/* What a daemon without rule 1 does: the same root each time, open what is there. */
static int run_fixed(const char *directory)
{
	struct pokeys_state first = { .magic = POKEYS_STATE_MAGIC };
	struct iox_state_writer *writer;
	struct iox_error error = { "" };
	struct iox_image *image;
	struct iox_node *node;
	int r;

	r = iox_node_open(directory, "fixed", &node, &error);
	if (!r)
		r = iox_state_create(node, "pokeys/mill/state", &first, &image, &error);
	if (!r || r == -EEXIST)
		r = iox_state_writer_open(node, "pokeys/mill/state", &writer, &error);
	say_ready(r ? error.text : "ready");
	while (!ended)
		folder_sleep_ms(1);
	return 0;
}

static int run_once(const char *directory)
{
	pokeys_client *client;
	char why[256];
	enum pokeys_client_state state;

	if (pokeys_client_open(&client, directory, "mill", "peer", POKEYS_CLIENT_COMMANDER))
		return 1;
	state = pokeys_client_poll(client);
	pokeys_client_status(client, why, sizeof(why));
	say_ready(state == POKEYS_CLIENT_ATTACHED ? "ready" : why);
	pokeys_client_close(client);
	return 0;
}

int main(int argc, char **argv)
{
	struct sigaction action = { .sa_handler = end };

	if (argc != 3)
		return 2;
	prctl(PR_SET_PDEATHSIG, SIGKILL); /* a test that crashes leaves none of us */
	sigaction(SIGTERM, &action, NULL);
	if (!strcmp(argv[1], "host"))
		return run_host(argv[2], folder_pattern, 1);
	if (!strcmp(argv[1], "flood"))
		return run_host(argv[2], folder_pattern, 0);
	if (!strcmp(argv[1], "known"))
		return run_host(argv[2], fill_known, 1);
	if (!strcmp(argv[1], "halted"))
		return run_host(argv[2], fill_halted, 1);
	if (!strcmp(argv[1], "future"))
		return run_host(argv[2], fill_future, 1);
	if (!strcmp(argv[1], "reader"))
		return run_client(argv[2], 0);
	if (!strcmp(argv[1], "commander"))
		return run_client(argv[2], POKEYS_CLIENT_COMMANDER);
	if (!strcmp(argv[1], "listener"))
		return run_client(argv[2], POKEYS_CLIENT_EVENTS);
	if (!strcmp(argv[1], "fixed"))
		return run_fixed(argv[2]);
	if (!strcmp(argv[1], "once"))
		return run_once(argv[2]);
	return 2;
}
