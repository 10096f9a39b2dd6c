// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * A commander that changes a position now and then, at any moment of the daemon's
 * cycle, and sees from the state image when it left for the device.
 *
 * The age of a command when it arrives is that time and half a round trip: the
 * simulated device runs in another process, and its clock of motion ticks once a
 * millisecond, so what it does then is its own affair.
 *
 *	bench-age RUNTIME_FOLDER DEVICE COMMANDS
 *
 * The axis 0 must be set up in position or buffered mode.
 */
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>
#include <pokeys/command.h>
#include <pokeys/shm.h>
#include "bench/samples.h"

enum { COMMANDS_MAX = 20000, STEP = 40, RUNNING = 3 };

#define MS UINT64_C(1000000)
#define PATIENCE (2000 * MS)

static pokeys_client *client;
static struct pokeys_command command;
static struct pokeys_state state;
static struct samples left, arrived, half;

static uint64_t now_ns(void)
{
	struct timespec t;

	clock_gettime(CLOCK_MONOTONIC, &t);
	return (uint64_t)t.tv_sec * UINT64_C(1000000000) + (uint64_t)t.tv_nsec;
}

static void sleep_ns(uint64_t ns)
{
	struct timespec t = { .tv_nsec = (long)ns };

	nanosleep(&t, NULL);
}

static uint64_t write_command(void)
{
	command.heartbeat++;
	command.t_ns = command.t_thread_ns = now_ns(); /* the state is read beside it */
	pokeys_client_write(client, &command);
	return command.t_ns;
}

/* Beating, until the state is as wanted. */
static bool until(bool (*good)(void))
{
	const uint64_t end = now_ns() + 5 * PATIENCE;

	while (now_ns() < end) {
		write_command();
		if (!pokeys_client_read(client, &state) && good())
			return true;
		sleep_ns(MS / 2);
	}
	return false;
}

static bool is_heard(void)
{
	return state.flags & POKEYS_STATE_COMMANDER && state.engine.axis[0].mode;
}

/* Many images without machine-on have been seen: the next one with it is an edge. */
static bool is_low(void)
{
	return state.command_heartbeat > 40;
}

static bool is_driven(void)
{
	return state.flags & POKEYS_STATE_MACHINE_ON && state.engine.state == RUNNING &&
	       state.engine.axis[0].enabled && state.engine.axis[0].in_position;
}

static bool begin(const char *folder, const char *device)
{
	if (samples_init(&left, COMMANDS_MAX) < 0 || samples_init(&arrived, COMMANDS_MAX) < 0 ||
	    samples_init(&half, COMMANDS_MAX) < 0 ||
	    pokeys_client_open(&client, folder, device, "bench-age", POKEYS_CLIENT_COMMANDER) < 0 ||
	    pokeys_client_poll(client) != POKEYS_CLIENT_ATTACHED)
		return false;
	command.session = (uint32_t)getpid();
	if (!until(is_heard) || !until(is_low))
		return false;
	command.axis[0] = (struct pokeys_axis_command){
		.position = state.engine.axis[0].position,
		.mode = state.engine.axis[0].mode,
		.enable = 1,
	};
	command.flags = POKEYS_COMMAND_MACHINE_ON;
	return until(is_driven);
}

/* A new position: when did it leave? Beats meanwhile. */
static void take(int32_t position)
{
	uint64_t written, beat;

	command.axis[0].position = position;
	written = beat = write_command();
	while (now_ns() - written < PATIENCE) {
		if (!pokeys_client_read(client, &state) &&
		    state.engine.axis[0].reference == position &&
		    state.engine.axis[0].t_reference_ns >= written) {
			const uint64_t gone = state.engine.axis[0].t_reference_ns - written;

			samples_add(&left, gone);
			samples_add(&half, state.statistics.rtt_smoothed_ns / 2);
			samples_add(&arrived, gone + state.statistics.rtt_smoothed_ns / 2);
			return;
		}
		if (now_ns() - beat > 5 * MS)
			beat = write_command();
		sleep_ns(MS / 20);
	}
}

int main(int argc, char **argv)
{
	const unsigned long commands = argc == 4 ? strtoul(argv[3], NULL, 10) : 0;
	uint32_t random = 12345;

	if (!commands || commands > COMMANDS_MAX) {
		fprintf(stderr, "usage: bench-age RUNTIME_FOLDER DEVICE COMMANDS (1..%d)\n",
			COMMANDS_MAX);
		return 2;
	}
	if (!begin(argv[1], argv[2])) {
		fprintf(stderr,
			"bench-age: the axis is not driven: engine %u, flags 0x%x, mode %u\n",
			state.engine.state, state.flags, state.engine.axis[0].mode);
		return 1;
	}
	for (unsigned long i = 0; i < commands; i++) {
		take((int32_t)(i & 1 ? 0 : STEP));
		random = random * 1664525 + 1013904223;
		sleep_ns(2 * MS + random % MS);
	}
	printf("{\"commands\": %lu, \"period_ns\": %llu, ", commands,
	       (unsigned long long)state.period_ns);
	samples_print(&left, "left");
	printf(", ");
	samples_print(&half, "half_round_trip");
	printf(", ");
	samples_print(&arrived, "arrived");
	printf("}\n");
	pokeys_client_close(client);
	return 0;
}
