// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Buffered motion in virtual time, so that the figures are the daemon's and not
 * this machine's: eight axes at 125 kHz, how full the device's buffer is in each
 * millisecond, and how often it ran dry.
 *
 *	bench-buffer SECONDS
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/pulse.h"

enum { AXES = POKEYS_AXES, SECONDS_MAX = 600, STEP = 125, RAMP = 25, RAMP_MS = STEP / RAMP };

struct line {
	const char *name;
	double loss;        /* each way */
	uint64_t jitter_ns; /* each way, evenly from 0 */
	bool told;          /* the device counts free slots */
};

static const struct line lines[] = {
	{ "quiet", 0, 25 * US, true },
	{ "jitter of 2 ms, 0.1 % lost", 0.001, 2 * MS, true },
	{ "jitter of 2 ms, 1 % lost", 0.01, 2 * MS, true },
	{ "jitter of 2 ms, 0.1 % lost, free slots not told", 0.001, 2 * MS, false },
};

static struct world world;
static unsigned int level[SIM_RING_SLOTS + 1];

static bool is_synced(struct world *w)
{
	return w->state.engine.state == WIRE_ENGINE_RUNNING && w->state.engine.axis[0].in_position;
}

static void go(int32_t position)
{
	for (unsigned int i = 0; i < AXES; i++)
		world.command.axis[i] = (struct pokeys_axis_command){
			.position = i & 1 ? -position : position,
			.mode = POKEYS_AXIS_BUFFERED,
			.enable = 1,
		};
}

static void begin(const struct line *line)
{
	const struct sim_rig_options options = {
		.service_ns = 100 * US,
		.device.choices.count_free = line->told,
	};
	const struct sim_link_faults faults = {
		.delay = { SIM_DELAY_UNIFORM, 25 * US, line->jitter_ns, 0 },
		.loss = line->loss,
	};
	struct pokeys_settings *settings = &world.config.settings;

	world_init(&world, &options);
	world_axes(&world);
	settings->axes = AXES;
	for (unsigned int i = 0; i < AXES; i++) {
		settings->axis[i] = settings->axis[0];
		settings->axis[i].options = WIRE_AXIS_ENABLED;
		settings->axis[i].max_speed = STEP * 1e3f;
		settings->axis[i].max_acceleration = RAMP * 2e6f;
	}
	world_start(&world);
	world_commander(&world, 5);
	world_until(&world, world_is_running, SECOND);
	go(0);
	world_machine_on(&world);
	world_until(&world, is_synced, SECOND);
	world_faults(&world, &faults);
	world_run(&world, SECOND / 2);
}

static int32_t step_at(unsigned int ms, unsigned int whole)
{
	const unsigned int from_end = whole - ms;

	if (ms < RAMP_MS)
		return (int32_t)(RAMP * (ms + 1));
	return from_end < RAMP_MS ? (int32_t)(RAMP * from_end) : STEP;
}

static void measure(const struct line *line, unsigned int seconds)
{
	const unsigned int whole = 1000 * seconds;
	struct sim_ring *ring = &world.rig.device.engine.ring;
	int32_t at = 0, wrong = 0;

	begin(line);
	memset(level, 0, sizeof(level));
	for (unsigned int ms = 0; ms < whole; ms++) {
		at += step_at(ms, whole);
		go(at);
		world_cycle(&world);
		sim_rig_run(&world.rig, world.now);
		level[ring->used]++;
	}
	world_loss(&world, 0);
	world_run(&world, 2 * SECOND);
	for (unsigned int i = 0; i < AXES; i++)
		wrong += world.rig.device.engine.axis[i].pulses != (i & 1 ? -at : at);
	printf("{\"line\": \"%s\", \"loss\": %g, \"jitter_us\": %llu, \"told\": %s, "
	       "\"seconds\": %u, \"axes\": %d, \"khz\": %d, \"underruns\": %llu, \"resyncs\": %u, "
	       "\"fills_in_parts\": %llu, \"axes_off\": %d, \"level\": [",
	       line->name, line->loss, (unsigned long long)(line->jitter_ns / US),
	       line->told ? "true" : "false", seconds, AXES, STEP,
	       (unsigned long long)ring->underruns, world.state.engine.buffer_resyncs,
	       (unsigned long long)world.sent.operation[0xB0], wrong);
	for (unsigned int i = 0; i <= SIM_RING_SLOTS; i++)
		printf("%s%u", i ? ", " : "", level[i]);
	printf("]}");
}

int main(int argc, char **argv)
{
	const int seconds = argc == 2 ? atoi(argv[1]) : 0;

	if (seconds < 1 || seconds > SECONDS_MAX) {
		fprintf(stderr, "usage: bench-buffer SECONDS (1..%d)\n", SECONDS_MAX);
		return 2;
	}
	printf("[");
	for (size_t i = 0; i < sizeof(lines) / sizeof(lines[0]); i++) {
		printf("%s", i ? ", " : "");
		measure(&lines[i], (unsigned int)seconds);
	}
	printf("]\n");
	return 0;
}
