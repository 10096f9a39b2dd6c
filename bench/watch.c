// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * A monitor that samples the daemon cycle by cycle, so that its figures are
 * exact like the other contenders': round trip of the newest reply; from the
 * tick to both fast answers in (their kernel's receive stamps), and to the image
 * being there for everybody to read, which is what a client's "all answers in
 * the program's hands" compares to. Sleeps between looks and shares no core with
 * the daemon on purpose.
 *
 * A cycle whose answers were not in when it was published counts as one that took a
 * whole period, or a daemon that publishes without them would look quick.
 *
 * With slow = together it also sees bursts, a tick's slow requests all at once:
 * the time from that tick to the last answer, and how many there were. A burst
 * is over when nothing slow came since the last look, so its time is final then.
 *
 * On a machine that is busy with other things it ends early.
 *
 * Lost is a request that no try of was answered, as it is for the other contenders;
 * missing are packets that nothing came back for.
 *
 * How old the data is shows at each look: `age` is as a reader finds it who
 * comes at any time.
 */
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <pokeys/shm.h>
#include "bench/samples.h"

enum { CYCLES_MAX = 60000, TICKS = 8, BURST = 4, PATIENCE = 3 };
#define START_NS UINT64_C(10000000000)

static struct samples round_trip, answered, all, burst, age;
static uint64_t incomplete;

static struct {
	uint64_t tick[TICKS];
	/* newest slow answer: at the last look, of the last burst */
	uint64_t slow_ns, done_ns;
	uint64_t accepted, cycle; /* when the last burst was over */
	uint64_t answers;         /* in all bursts */
} bursts;

static uint64_t now_ns(void)
{
	struct timespec t;

	clock_gettime(CLOCK_MONOTONIC, &t);
	return (uint64_t)t.tv_sec * UINT64_C(1000000000) + (uint64_t)t.tv_nsec;
}

static void sleep_us(long us)
{
	struct timespec t = { .tv_nsec = us * 1000 };

	nanosleep(&t, NULL);
}

/* The newest tick that is not after t. */
static uint64_t tick_of(uint64_t t)
{
	uint64_t found = 0;

	for (int i = 0; i < TICKS; i++)
		if (bursts.tick[i] <= t && bursts.tick[i] > found)
			found = bursts.tick[i];
	return found;
}

static void look_for_burst(const struct pokeys_state *s)
{
	const uint64_t slow = s->statistics.accepted - bursts.accepted -
			      2 * (s->cycle - bursts.cycle);

	bursts.tick[s->cycle % TICKS] = s->t_cycle_ns;
	if (s->t_slow_ns != bursts.slow_ns) {
		bursts.slow_ns = s->t_slow_ns;
		return;
	}
	if (bursts.slow_ns == bursts.done_ns)
		return;
	/* a single one is PoNET's, which goes by itself */
	if (bursts.cycle && slow >= BURST && slow <= POKEYS_SLOW_GROUPS &&
	    tick_of(bursts.slow_ns)) {
		samples_add(&burst, bursts.slow_ns - tick_of(bursts.slow_ns));
		bursts.answers += slow;
	}
	bursts.done_ns = bursts.slow_ns;
	bursts.accepted = s->statistics.accepted;
	bursts.cycle = s->cycle;
}

/* A sample of this cycle, if its fast data are of this cycle. */
static void take(const struct pokeys_state *s)
{
	const uint64_t newest = s->t_digital_ns > s->t_motion_ns ? s->t_digital_ns : s->t_motion_ns;
	const uint64_t oldest = s->t_digital_ns < s->t_motion_ns ? s->t_digital_ns : s->t_motion_ns;

	samples_add(&age, pokeys_state_age_ns(s, now_ns()));
	look_for_burst(s);
	if (oldest < s->t_cycle_ns) {
		incomplete++;
		samples_add(&answered, s->period_ns);
		samples_add(&all, s->period_ns);
		return;
	}
	samples_add(&round_trip, s->statistics.rtt_last_ns);
	samples_add(&answered, newest - s->t_cycle_ns);
	samples_add(&all, s->t_publish_ns - s->t_cycle_ns);
}

static bool begin(const char *folder, const char *device, pokeys_client **client)
{
	struct samples *const all_of_them[] = { &round_trip, &answered, &all, &burst, &age };

	for (size_t i = 0; i < sizeof(all_of_them) / sizeof(all_of_them[0]); i++)
		if (samples_init(all_of_them[i], CYCLES_MAX) < 0)
			return false;
	return pokeys_client_open(client, folder, device, "bench-watch", 0) >= 0;
}

static void print(uint64_t cycles, uint64_t missed, const struct pokeys_link_statistics *before,
		  const struct pokeys_link_statistics *after)
{
	const uint64_t count = burst.count ? burst.count : 1;

	printf("{\"cycles\": %llu, \"missed\": %llu, \"lost\": %llu, \"resent\": %llu, "
	       "\"missing\": %lld, "
	       "\"late\": %llu, \"incomplete\": %llu, \"burst_answers\": %.2f, ",
	       (unsigned long long)cycles, (unsigned long long)missed,
	       (unsigned long long)(after->timed_out - before->timed_out),
	       (unsigned long long)(after->resent - before->resent),
	       (long long)(after->sent - before->sent) -
		       (long long)(after->received - before->received) -
		       ((long long)after->in_flight - (long long)before->in_flight),
	       (unsigned long long)(after->cycles_late - before->cycles_late),
	       (unsigned long long)incomplete, (double)bursts.answers / (double)count);
	samples_print(&round_trip, "round_trip");
	printf(", ");
	samples_print(&answered, "answered");
	printf(", ");
	samples_print(&burst, "burst");
	printf(", ");
	samples_print(&age, "age");
	printf(", ");
	samples_print(&all, "all");
	printf("}\n");
}

int main(int argc, char **argv)
{
	struct pokeys_link_statistics before = { 0 };
	struct pokeys_state state = { 0 };
	uint64_t seen = 0, cycles, missed = 0, end, taken = 0;
	pokeys_client *client;

	if (argc != 4 || (cycles = strtoull(argv[3], NULL, 10)) < 1 || cycles > CYCLES_MAX) {
		fprintf(stderr, "usage: bench-watch RUNTIME_FOLDER DEVICE CYCLES (1..%d)\n",
			CYCLES_MAX);
		return 2;
	}
	if (!begin(argv[1], argv[2], &client))
		return 1;
	if (pokeys_client_poll(client) != POKEYS_CLIENT_ATTACHED) {
		fprintf(stderr, "bench-watch: no daemon in %s\n", argv[1]);
		return 1;
	}
	end = now_ns() + START_NS;
	for (; taken < cycles && now_ns() < end; sleep_us(200)) {
		if (pokeys_client_read(client, &state) < 0 || state.cycle == seen)
			continue;
		if (!seen) {
			before = state.statistics;
			end = now_ns() + cycles * state.period_ns * PATIENCE;
		} else if (state.cycle - seen > 1) {
			missed += state.cycle - seen - 1;
		}
		seen = state.cycle;
		taken++;
		take(&state);
	}
	pokeys_client_close(client);
	print(taken, missed, &before, &state.statistics);
	return 0;
}
