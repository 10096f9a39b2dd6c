// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * A commander for the tests of the daemon: keeps a heartbeat and some outputs
 * until it is ended or killed, as LinuxCNC would.
 *
 *	commander RUNTIME-DIRECTORY DEVICE [TERMINAL ...]
 *
 * Prints "commanding" when its first image is written, or one line that says
 * why it may not and ends with 1.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>
#include <pokeys/shm.h>

static uint64_t now(void)
{
	struct timespec t;

	clock_gettime(CLOCK_MONOTONIC, &t);
	return (uint64_t)t.tv_sec * UINT64_C(1000000000) + (uint64_t)t.tv_nsec;
}

/* Attach, and again if the daemon is another one; -1 if somebody else commands. */
static int attach(pokeys_client *client)
{
	char why[200];

	switch (pokeys_client_poll(client)) {
	case POKEYS_CLIENT_ATTACHED:
		return 1;
	case POKEYS_CLIENT_REFUSED:
		pokeys_client_status(client, why, sizeof(why));
		puts(why);
		return -1;
	case POKEYS_CLIENT_DETACHED:
	default:
		return 0;
	}
}

int main(int argc, char **argv)
{
	struct pokeys_command command = { .session = (uint32_t)getpid(), .period_ns = 1000000 };
	pokeys_client *client;
	int told = 0;

	if (argc < 3 ||
	    pokeys_client_open(&client, argv[1], argv[2], "test", POKEYS_CLIENT_COMMANDER))
		return 2;
	for (int i = 3; i < argc; i++) {
		int pin = atoi(argv[i]) - 1;

		command.digital_out[pin / 8] |= (uint8_t)(1u << pin % 8);
		command.digital_out_mask[pin / 8] |= (uint8_t)(1u << pin % 8);
	}
	for (unsigned int round = 0;; round++) {
		const struct timespec nap = { .tv_nsec = 1000000 };

		if (round % 50 == 0 && attach(client) < 0) {
			pokeys_client_close(client);
			return 1;
		}
		command.heartbeat++;
		command.t_ns = now();
		if (!pokeys_client_write(client, &command) && !told++) {
			puts("commanding");
			fflush(stdout);
		}
		nanosleep(&nap, NULL);
	}
}
