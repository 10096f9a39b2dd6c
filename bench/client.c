// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What the daemon's round trip is held against: a client that asks the same
 * two questions (0xCC and the pulse engine's status, protocol sections 3.4
 * and 3.24.2) once a period, in one of three ways.
 *
 *   blocking  sendto, select, recvfrom, one question after the other: what the
 *             vendor's library does
 *   spinning  both questions at once on a connected socket, then recv in a
 *             tight loop: the least that a socket can cost
 *   sleeping  both at once, then poll and recv
 *
 * Prints one line of JSON: percentiles of the round trip of each request, of
 * the time until both answers are in, and processor time a cycle.
 */
#include <arpa/inet.h>
#include <errno.h>
#include <poll.h>
#include <sched.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>
#include "bench/samples.h"

enum { QUESTIONS = 2, PACKET = 64, CYCLES_MAX = 60000 };
#define TIMEOUT_NS UINT64_C(20000000)

struct client {
	int fd;
	uint8_t question[QUESTIONS][PACKET];
	uint8_t id;
	struct samples each, both;
	uint64_t lost;
};

static uint64_t clock_ns(clockid_t clock)
{
	struct timespec t;

	clock_gettime(clock, &t);
	return (uint64_t)t.tv_sec * UINT64_C(1000000000) + (uint64_t)t.tv_nsec;
}

static void question_stamp(struct client *c, int i)
{
	uint8_t *q = c->question[i], sum = 0;

	q[6] = ++c->id;
	for (int k = 0; k < 7; k++)
		sum = (uint8_t)(sum + q[k]);
	q[7] = sum;
}

/* Which question a datagram answers, -1 if none. */
static int answer_of(const struct client *c, const uint8_t *packet, ssize_t length)
{
	for (int i = 0; length == PACKET && packet[0] == 0xaa && i < QUESTIONS; i++)
		if (packet[1] == c->question[i][1] && packet[6] == c->question[i][6])
			return i;
	return -1;
}

static void cycle_blocking(struct client *c)
{
	uint64_t begin = clock_ns(CLOCK_MONOTONIC);

	for (int i = 0; i < QUESTIONS; i++) {
		uint8_t packet[PACKET * 2];
		struct timeval limit = { .tv_usec = TIMEOUT_NS / 1000 };
		uint64_t t = clock_ns(CLOCK_MONOTONIC);
		fd_set set;

		question_stamp(c, i);
		if (send(c->fd, c->question[i], PACKET, 0) != PACKET) {
			c->lost++;
			return;
		}
		FD_ZERO(&set);
		FD_SET(c->fd, &set);
		/* what was given up before and comes now is not its answer */
		do {
			if (select(c->fd + 1, &set, NULL, NULL, &limit) != 1) {
				c->lost++;
				return;
			}
		} while (answer_of(c, packet, recv(c->fd, packet, sizeof(packet), 0)) != i);
		samples_add(&c->each, clock_ns(CLOCK_MONOTONIC) - t);
	}
	samples_add(&c->both, clock_ns(CLOCK_MONOTONIC) - begin);
}

static void cycle_at_once(struct client *c, bool sleeping)
{
	uint64_t begin = clock_ns(CLOCK_MONOTONIC), now = begin;
	int open = QUESTIONS;

	for (int i = 0; i < QUESTIONS; i++) {
		question_stamp(c, i);
		if (send(c->fd, c->question[i], PACKET, MSG_DONTWAIT) != PACKET)
			c->lost++;
	}
	while (open > 0 && now - begin < TIMEOUT_NS) {
		struct pollfd p = { .fd = c->fd, .events = POLLIN };
		uint8_t packet[PACKET * 2];
		ssize_t length;

		if (sleeping)
			poll(&p, 1, (int)(TIMEOUT_NS / 1000000));
		length = recv(c->fd, packet, sizeof(packet), MSG_DONTWAIT);
		now = clock_ns(CLOCK_MONOTONIC);
		if (length > 0 && answer_of(c, packet, length) >= 0) {
			samples_add(&c->each, now - begin);
			open--;
		}
	}
	if (open > 0)
		c->lost++;
	else
		samples_add(&c->both, now - begin);
}

static int client_open(struct client *c, const char *address, int port)
{
	struct sockaddr_in to = { .sin_family = AF_INET, .sin_port = htons((uint16_t)port) };

	c->question[0][0] = c->question[1][0] = 0xbb;
	c->question[0][1] = 0xcc;
	c->question[1][1] = 0x85;
	if (inet_pton(AF_INET, address, &to.sin_addr) != 1) {
		fprintf(stderr, "bench-client: not an IPv4 address: %s\n", address);
		return -EINVAL;
	}
	c->fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
	if (c->fd < 0 || connect(c->fd, (struct sockaddr *)&to, sizeof(to)) < 0) {
		fprintf(stderr, "bench-client: %s: %s\n", address, strerror(errno));
		return -errno;
	}
	if (samples_init(&c->each, CYCLES_MAX * QUESTIONS) < 0)
		return -ENOMEM;
	return samples_init(&c->both, CYCLES_MAX);
}

/* As realtime as this machine allows, so that all contenders stand alike. */
static void become_realtime(int cpu)
{
	struct sched_param parameter = { .sched_priority = 80 };
	cpu_set_t set;

	CPU_ZERO(&set);
	CPU_SET((size_t)cpu, &set);
	if (sched_setaffinity(0, sizeof(set), &set) < 0 ||
	    sched_setscheduler(0, SCHED_FIFO, &parameter) < 0 || mlockall(MCL_CURRENT) < 0)
		fprintf(stderr, "bench-client: not realtime: %s\n", strerror(errno));
}

static uint64_t run(struct client *c, const char *mode, uint64_t cycles, uint64_t period)
{
	uint64_t next = clock_ns(CLOCK_MONOTONIC), cpu = clock_ns(CLOCK_THREAD_CPUTIME_ID);

	for (uint64_t i = 0; i < cycles; i++) {
		struct timespec t;

		next += period;
		t.tv_sec = (time_t)(next / UINT64_C(1000000000));
		t.tv_nsec = (long)(next % UINT64_C(1000000000));
		clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL);
		if (!strcmp(mode, "blocking"))
			cycle_blocking(c);
		else
			cycle_at_once(c, !strcmp(mode, "sleeping"));
	}
	return (clock_ns(CLOCK_THREAD_CPUTIME_ID) - cpu) / cycles;
}

int main(int argc, char **argv)
{
	static struct client c;
	uint64_t cycles, cpu;

	if (argc != 7 || (strcmp(argv[3], "blocking") && strcmp(argv[3], "spinning") &&
			  strcmp(argv[3], "sleeping"))) {
		fprintf(stderr, "usage: bench-client ADDRESS PORT blocking|spinning|sleeping"
			" CYCLES PERIOD_US CPU\n");
		return 2;
	}
	cycles = strtoull(argv[4], NULL, 10);
	if (cycles < 1 || cycles > CYCLES_MAX) {
		fprintf(stderr, "bench-client: CYCLES is 1..%d\n", CYCLES_MAX);
		return 2;
	}
	if (client_open(&c, argv[1], atoi(argv[2])) < 0)
		return 1;
	become_realtime(atoi(argv[6]));
	cpu = run(&c, argv[3], cycles, strtoull(argv[5], NULL, 10) * 1000);
	printf("{\"mode\": \"%s\", \"cycles\": %llu, \"lost\": %llu, \"cpu_ns\": %llu, ", argv[3],
	       (unsigned long long)cycles, (unsigned long long)c.lost, (unsigned long long)cpu);
	samples_print(&c.each, "round_trip");
	printf(", ");
	samples_print(&c.both, "both");
	printf("}\n");
	return 0;
}
