// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * A monitor that samples the daemon cycle by cycle, so that its figures are
 * exact like the other contenders': round trip of the newest reply, and time
 * from the tick to both fast answers in (their kernel's receive stamps).
 * Sleeps between looks and shares no core with the daemon on purpose.
 */
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <pokeys/shm.h>
#include "bench/samples.h"

enum { CYCLES_MAX = 60000 };

static struct samples round_trip, both, publish;

static void sleep_us(long us)
{
	struct timespec t = { .tv_nsec = us * 1000 };

	nanosleep(&t, NULL);
}

/* A sample of this cycle, if its fast data are of this cycle. */
static void take(const struct pokeys_state *s)
{
	uint64_t newest = s->t_digital_ns > s->t_motion_ns ? s->t_digital_ns : s->t_motion_ns;
	uint64_t oldest = s->t_digital_ns < s->t_motion_ns ? s->t_digital_ns : s->t_motion_ns;

	if (oldest < s->t_cycle_ns)
		return;
	samples_add(&round_trip, s->statistics.rtt_last_ns);
	samples_add(&both, newest - s->t_cycle_ns);
	samples_add(&publish, s->t_publish_ns - s->t_cycle_ns);
}

int main(int argc, char **argv)
{
	struct pokeys_state state = { 0 };
	uint64_t seen = 0, cycles, missed = 0;
	pokeys_client *client;

	if (argc != 4 || (cycles = strtoull(argv[3], NULL, 10)) < 1 || cycles > CYCLES_MAX) {
		fprintf(stderr, "usage: bench-watch RUNTIME_FOLDER DEVICE CYCLES (1..%d)\n", CYCLES_MAX);
		return 2;
	}
	if (samples_init(&round_trip, CYCLES_MAX) < 0 || samples_init(&both, CYCLES_MAX) < 0 ||
	    samples_init(&publish, CYCLES_MAX) < 0 ||
	    pokeys_client_open(&client, argv[1], argv[2], "bench-watch", 0) < 0)
		return 1;
	if (pokeys_client_poll(client) != POKEYS_CLIENT_ATTACHED) {
		fprintf(stderr, "bench-watch: no daemon in %s\n", argv[1]);
		return 1;
	}
	for (uint64_t taken = 0; taken < cycles; sleep_us(200)) {
		if (pokeys_client_read(client, &state) < 0 || state.cycle == seen)
			continue;
		if (seen && state.cycle - seen > 1)
			missed += state.cycle - seen - 1;
		seen = state.cycle;
		taken++;
		take(&state);
	}
	pokeys_client_close(client);
	printf("{\"cycles\": %llu, \"missed\": %llu, \"lost\": %llu, ", (unsigned long long)cycles,
	       (unsigned long long)missed, (unsigned long long)state.statistics.lost);
	samples_print(&round_trip, "round_trip");
	printf(", ");
	samples_print(&both, "both");
	printf(", ");
	samples_print(&publish, "publish");
	printf("}\n");
	return 0;
}
