// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What the daemon is held against: a client that asks the same questions once a
 * period, in one of several ways (client_socket.c, client_ring.c, client_xdp.c).
 *
 * All contenders stand alike: SCHED_FIFO 80 on one core where that is permitted,
 * memory locked, times from the start of the cycle that was due until the last answer is in
 * the program's hands. A way that spins is awake before the tick, as the
 * daemon's mode spin is; the others pay for their wake-up, as its mode sleep
 * does.
 *
 * Prints one line of JSON. Status 77 and a line on stderr: this way is not to be
 * had here. `hold` asks nothing: it makes the interface a polled one until its
 * standard input ends, for the daemon's sake.
 */
#include <arpa/inet.h>
#include <errno.h>
#include <ifaddrs.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>
#include "bench/client.h"

enum { CYCLES_MAX = 60000, UNAVAILABLE = 77, PATIENCE = 3 };
#define AWAKE_NS UINT64_C(100000)

static uint64_t clock_ns(clockid_t clock)
{
	struct timespec t;

	clock_gettime(clock, &t);
	return (uint64_t)t.tv_sec * UINT64_C(1000000000) + (uint64_t)t.tv_nsec;
}

uint64_t client_now(void)
{
	return clock_ns(CLOCK_MONOTONIC);
}

void client_stamp_all(struct client *c)
{
	for (int i = 0; i < c->ask.count; i++)
		ask_stamp(&c->ask, i);
	c->open = (1u << c->ask.count) - 1;
}

void client_take(struct client *c, const uint8_t *packet, ssize_t length)
{
	int i = ask_match(&c->ask, packet, length);

	if (i < 0 || !(c->open >> i & 1))
		return;
	c->open &= ~(1u << i);
	if (!c->open)
		samples_add(&c->newest, client_now() - c->begin_ns);
}

bool client_late(const struct client *c)
{
	return client_now() - c->begin_ns >= CLIENT_TIMEOUT_NS;
}

const char *client_interface(const struct client *c, struct sockaddr_in *own, char name[16])
{
	socklen_t size = sizeof(*own);
	struct ifaddrs *all;

	*name = '\0';
	if (getsockname(c->fd, (struct sockaddr *)own, &size) < 0 || getifaddrs(&all) < 0)
		return "the interface cannot be found";
	for (struct ifaddrs *a = all; a; a = a->ifa_next) {
		struct sockaddr_in address;

		if (!a->ifa_addr || a->ifa_addr->sa_family != AF_INET)
			continue;
		memcpy(&address, a->ifa_addr, sizeof(address));
		if (address.sin_addr.s_addr == own->sin_addr.s_addr)
			snprintf(name, 16, "%.*s", (int)strcspn(a->ifa_name, ":"), a->ifa_name);
	}
	freeifaddrs(all);
	return *name ? NULL : "the interface cannot be found";
}

static int client_open(struct client *c, const char *address, int port)
{
	struct sockaddr_in to = { .sin_family = AF_INET, .sin_port = htons((uint16_t)port) };

	if (inet_pton(AF_INET, address, &to.sin_addr) != 1) {
		fprintf(stderr, "bench-client: not an IPv4 address: %s\n", address);
		return -EINVAL;
	}
	c->fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
	if (c->fd < 0 || connect(c->fd, (struct sockaddr *)&to, sizeof(to)) < 0) {
		fprintf(stderr, "bench-client: %s: %s\n", address, strerror(errno));
		return -errno;
	}
	if (samples_init(&c->newest, CYCLES_MAX) < 0)
		return -ENOMEM;
	return samples_init(&c->all, CYCLES_MAX);
}

/* As realtime as this machine allows. */
static void become_realtime(int cpu)
{
	struct sched_param parameter = { .sched_priority = 80 };
	cpu_set_t set;

	CPU_ZERO(&set);
	CPU_SET((size_t)cpu, &set);
	prctl(PR_SET_TIMERSLACK, 1UL);
	if (sched_setaffinity(0, sizeof(set), &set) < 0 ||
	    sched_setscheduler(0, SCHED_FIFO, &parameter) < 0 || mlockall(MCL_CURRENT) < 0)
		fprintf(stderr, "bench-client: not realtime: %s\n", strerror(errno));
}

static void await(uint64_t tick_ns, bool spins)
{
	const uint64_t until = spins ? tick_ns - AWAKE_NS : tick_ns;
	const struct timespec t = {
		.tv_sec = (time_t)(until / UINT64_C(1000000000)),
		.tv_nsec = (long)(until % UINT64_C(1000000000)),
	};

	clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL);
	while (spins && client_now() < tick_ns)
		;
}

/*
 * Processor time of a cycle, mean. On a machine that is busy with other things it
 * ends early, with *cycles what there was time for.
 */
static uint64_t run(struct client *c, const struct client_way *way, uint64_t *cycles,
		    uint64_t period)
{
	const uint64_t cpu = clock_ns(CLOCK_THREAD_CPUTIME_ID);
	const uint64_t end = client_now() + *cycles * period * PATIENCE;
	uint64_t i;

	c->tick_ns = client_now();
	for (i = 0; i < *cycles && client_now() < end; i++) {
		c->tick_ns += period;
		await(c->tick_ns, way->spins);
		c->begin_ns = client_now();
		way->cycle(c);
		if (c->open)
			c->lost++;
		else
			samples_add(&c->all, client_now() - c->tick_ns);
		c->open = 0;
		/* held up for long: what was missed is not caught up with */
		if (client_now() > c->tick_ns + period)
			c->tick_ns = client_now();
	}
	*cycles = i;
	return (clock_ns(CLOCK_THREAD_CPUTIME_ID) - cpu) / (i ? i : 1);
}

static const struct client_way *find(const char *name)
{
	const struct client_way *const lists[] = {
		client_socket_ways,
		client_ring_ways,
		client_xdp_ways,
	};

	for (size_t i = 0; i < sizeof(lists) / sizeof(lists[0]); i++)
		for (const struct client_way *way = lists[i]; way->name; way++)
			if (!strcmp(way->name, name))
				return way;
	return NULL;
}

static int refuse(const char *way, const char *why)
{
	fprintf(stderr, "%s: %s\n", way, why);
	return UNAVAILABLE;
}

static int hold(const struct client *c)
{
	const char *why = client_make_polled(c);
	char byte;

	if (why)
		return refuse("hold", why);
	puts("held");
	fflush(stdout);
	while (read(STDIN_FILENO, &byte, 1) > 0)
		;
	return 0;
}

static void print(struct client *c, const char *way, uint64_t cycles, uint64_t cpu)
{
	printf("{\"way\": \"%s\", \"cycles\": %llu, \"questions\": %d, \"lost\": %llu, \"cpu_ns\": "
	       "%llu, ",
	       way, (unsigned long long)cycles, c->ask.count, (unsigned long long)c->lost,
	       (unsigned long long)cpu);
	samples_print(&c->newest, "round_trip");
	printf(", ");
	samples_print(&c->all, "all");
	printf("}\n");
}

static int usage(void)
{
	fprintf(stderr, "usage: bench-client ADDRESS PORT WAY fast|all CYCLES PERIOD_US CPU\n"
			"       bench-client ADDRESS PORT hold\n"
			"ways: blocking sleeping spinning batching ring ring-spin ring-napi xdp\n");
	return 2;
}

int main(int argc, char **argv)
{
	static struct client c;
	const struct client_way *way;
	uint64_t cycles, cpu;
	const char *why;

	if (argc == 4 && !strcmp(argv[3], "hold")) {
		ask_fast(&c.ask);
		return client_open(&c, argv[1], atoi(argv[2])) < 0 ? 1 : hold(&c);
	}
	way = argc == 8 ? find(argv[3]) : NULL;
	cycles = way ? strtoull(argv[5], NULL, 10) : 0;
	if (cycles < 1 || cycles > CYCLES_MAX ||
	    (strcmp(argv[4], "fast") && strcmp(argv[4], "all")))
		return usage();
	if (strcmp(argv[4], "all"))
		ask_fast(&c.ask);
	else
		ask_all(&c.ask);
	if (client_open(&c, argv[1], atoi(argv[2])) < 0)
		return 1;
	become_realtime(atoi(argv[7]));
	c.begin_ns = client_now();
	why = way->open(&c);
	if (why)
		return refuse(way->name, why);
	c.newest.count = c.all.count = 0;
	c.open = 0;
	cpu = run(&c, way, &cycles, strtoull(argv[6], NULL, 10) * 1000);
	print(&c, way->name, cycles, cpu);
	return 0;
}
