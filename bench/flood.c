// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Somebody who sends what nobody asked for: 64-byte datagrams from a PoKeys port,
 * so many a second, for at most so many seconds or until it is ended (SIGTERM).
 *
 * A few at a time, at fixed moments: one at a time would be a system call for each
 * and this core, which the simulated device shares, would have no time left for
 * anything else. It is realtime so that the rate holds on a busy machine.
 *
 * Prints "sending" when it begins, and at its end a line of JSON: how many were
 * sent, in how long.
 */
#include <arpa/inet.h>
#include <errno.h>
#include <sched.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

enum { PORT = 20055, PACKET = 64, PART_MAX = 64, PART_NS = 100000, SECONDS_MAX = 60 };

static volatile sig_atomic_t ended;

static void end(int number)
{
	(void)number;
	ended = 1;
}

static uint64_t now_ns(void)
{
	struct timespec t;

	clock_gettime(CLOCK_MONOTONIC, &t);
	return (uint64_t)t.tv_sec * UINT64_C(1000000000) + (uint64_t)t.tv_nsec;
}

static int open_socket(const char *from, const char *to, int port)
{
	struct sockaddr_in own = { .sin_family = AF_INET, .sin_port = htons(PORT) };
	struct sockaddr_in peer = { .sin_family = AF_INET, .sin_port = htons((uint16_t)port) };
	int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0), on = 1;

	inet_pton(AF_INET, from, &own.sin_addr);
	inet_pton(AF_INET, to, &peer.sin_addr);
	/* the simulator beside us listens to searches at the same port of all addresses */
	setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
	if (fd < 0 || bind(fd, (struct sockaddr *)&own, sizeof(own)) < 0 ||
	    connect(fd, (struct sockaddr *)&peer, sizeof(peer)) < 0) {
		fprintf(stderr, "bench-flood: %s to %s: %s\n", from, to, strerror(errno));
		exit(1);
	}
	return fd;
}

static void settle(int cpu)
{
	const struct sched_param parameter = { .sched_priority = 10 };
	struct sigaction action = { .sa_handler = end };
	cpu_set_t set;

	CPU_ZERO(&set);
	CPU_SET((size_t)cpu, &set);
	if (sched_setaffinity(0, sizeof(set), &set) < 0 ||
	    sched_setscheduler(0, SCHED_FIFO, &parameter) < 0)
		fprintf(stderr, "bench-flood: not realtime: %s\n", strerror(errno));
	sigaction(SIGTERM, &action, NULL);
	sigaction(SIGINT, &action, NULL);
}

/* Errors (nobody listens there) are part of it. */
static uint64_t flood(int fd, unsigned int part, uint64_t until)
{
	static uint8_t packet[PACKET] = { 0xaa, 0xcc };
	struct iovec body = { packet, sizeof(packet) };
	struct mmsghdr message[PART_MAX];
	uint64_t next = now_ns(), sent = 0;

	memset(message, 0, sizeof(message));
	for (unsigned int i = 0; i < part; i++) {
		message[i].msg_hdr.msg_iov = &body;
		message[i].msg_hdr.msg_iovlen = 1;
	}
	for (; !ended && next < until; next += PART_NS) {
		const struct timespec t = { (time_t)(next / 1000000000u),
					    (long)(next % 1000000000u) };
		int n;

		clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL);
		for (unsigned int i = 0; i < part && !ended; i += n > 0 ? (unsigned int)n : 0) {
			n = sendmmsg(fd, message + i, part - i, MSG_DONTWAIT);
			if (n > 0)
				sent += (uint64_t)n;
			else if (errno != ECONNREFUSED)
				break;
		}
	}
	return sent;
}

int main(int argc, char **argv)
{
	uint64_t began, sent, rate, seconds;
	int fd;

	rate = argc == 7 ? strtoull(argv[4], NULL, 10) : 0;
	seconds = argc == 7 ? strtoull(argv[5], NULL, 10) : 0;
	if (rate < 10000 || rate > 640000 || seconds < 1 || seconds > SECONDS_MAX) {
		fprintf(stderr,
			"usage: bench-flood FROM TO PORT RATE (10000..640000) SECONDS (1..%d)"
			" CPU\n",
			SECONDS_MAX);
		return 2;
	}
	fd = open_socket(argv[1], argv[2], atoi(argv[3]));
	settle(atoi(argv[6]));
	puts("sending");
	fflush(stdout);
	began = now_ns();
	sent = flood(fd, (unsigned int)(rate / (1000000000u / PART_NS)),
		     began + seconds * UINT64_C(1000000000));
	printf("{\"sent\": %llu, \"ns\": %llu}\n", (unsigned long long)sent,
	       (unsigned long long)(now_ns() - began));
	return 0;
}
