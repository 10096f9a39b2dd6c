/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A commander of servo motors for tests: lines from standard input say what it wants of motor N.
 *
 *   on N        enable it where it is; off first, as a daemon wants it
 *   off N
 *   to N UNITS  go there with SPEED
 *   reset N     clear its fault
 *
 * Usage: servo_commander RUNTIME-DIRECTORY DEVICE. It ends with its standard input.
 */
#include <math.h>
#include <poll.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>
#include <pokeys/shm.h>

#define PERIOD_NS 1000000
#define SPEED 50.0		/* units/s */
enum { OFF_CYCLES = 50 };

static struct pokeys_command command;
static double target[POKEYS_SERVOS];
static unsigned int waits[POKEYS_SERVOS]; /* cycles until it is enabled */

static uint64_t now(void)
{
	struct timespec time;

	clock_gettime(CLOCK_MONOTONIC, &time);
	return (uint64_t)time.tv_sec * 1000000000u + (uint64_t)time.tv_nsec;
}

static void obey(const char *line)
{
	struct pokeys_one_shot shot = { .operation = POKEYS_ONE_SHOT_SERVO_RESET };
	char verb[8];
	unsigned int motor;
	double to = 0;

	if (sscanf(line, "%7s %u %lf", verb, &motor, &to) < 2 || motor >= POKEYS_SERVOS)
		exit(2);
	if (!strcmp(verb, "to")) {
		target[motor] = to;
		return;
	}
	command.servo[motor].enable = 0;
	waits[motor] = strcmp(verb, "on") ? 0 : OFF_CYCLES;
	if (strcmp(verb, "reset"))
		return;
	shot.id = command.one_shot_head++;
	shot.index = (uint8_t)motor;
	command.one_shot[shot.id % POKEYS_ONE_SHOTS] = shot;
}

/* Every line that is there; false at the end. */
static bool hears(void)
{
	struct pollfd input = { .fd = STDIN_FILENO, .events = POLLIN };
	char line[80];

	while (poll(&input, 1, 0) > 0) {
		size_t length = 0;

		do {
			if (read(STDIN_FILENO, line + length, 1) != 1)
				return false;
		} while (line[length++] != '\n' && length < sizeof(line) - 1);
		line[length] = '\0';
		obey(line);
	}
	return true;
}

static void go(const struct pokeys_state *state)
{
	const double step = SPEED * PERIOD_NS / 1e9;

	for (unsigned int i = 0; i < POKEYS_SERVOS; i++) {
		struct pokeys_servo_command *servo = &command.servo[i];

		servo->velocity = NAN;
		if (!servo->enable) {
			servo->position = target[i] = state->servo[i].position;
			servo->enable = waits[i] && !--waits[i];
		}
		servo->position += fmax(fmin(target[i] - servo->position, step), -step);
	}
}

int main(int argc, char **argv)
{
	struct timespec period = { .tv_nsec = PERIOD_NS };
	pokeys_client *client;

	if (argc != 3 || pokeys_client_open(&client, argv[1], argv[2], "servo_commander",
					    POKEYS_CLIENT_COMMANDER))
		return 1;
	command.session = (uint32_t)now() | 1;
	command.period_ns = PERIOD_NS;
	while (hears()) {
		struct pokeys_state state;

		pokeys_client_poll(client);
		command.t_thread_ns = now();
		if (!pokeys_client_read(client, &state))
			go(&state);
		command.heartbeat++;
		command.t_ns = now();
		pokeys_client_write(client, &command);
		nanosleep(&period, NULL);
	}
	pokeys_client_close(client);
	return 0;
}
