/* SPDX-License-Identifier: MIT */
/*
 * A client without the daemon: the mailbox of <pokeys/async.h> over one plain
 * non-blocking UDP socket, in one thread.
 *
 * It identifies the device, then reads its digital inputs and the status of
 * its pulse engine at a given rate. The loop never waits for an answer: it
 * sleeps until a packet, a deadline or the next tick, whichever comes first,
 * and what has been answered by then is used. A lost packet costs a resend and
 * delays nothing else.
 *
 * Create, send, receive and check are all that it needs of the mailbox; the
 * rest are questions (how does a request stand, when is the next deadline, what
 * was counted), which change nothing. Answered requests are not given back: the
 * mailbox takes their entries when it needs them, many requests later.
 *
 *	cc async_client.c $(pkg-config --cflags --libs pokeys_async)
 *	./a.out --address 192.168.1.20 --rate 500 --seconds 10
 *	./a.out --address 192.168.1.20 --timeout-us 5000
 *
 * Without --timeout-us a resend waits as long as the measured round trip says.
 */
#ifndef _GNU_SOURCE
#define _GNU_SOURCE /* ppoll */
#endif
#include <arpa/inet.h>
#include <errno.h>
#include <getopt.h>
#include <inttypes.h>
#include <poll.h>
#include <pokeys/async.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#define SECOND_NS 1000000000ull
#define PATIENCE_NS (2 * SECOND_NS)

/* Operations, protocol sections 2.1, 3.4 and 3.24.2. */
enum { OP_DEVICE_DATA = 0x00, OP_IO = 0xCC, OP_PULSE_ENGINE = 0x85 };

struct settings {
	const char *address;
	unsigned long port, seconds, rate, timeout_us;
};

/* A value that is read again and again. */
struct reading {
	pokeys_command_t op;
	int id;                             /* of the request under way, -1 = none */
	uint64_t fresh, missed;             /* answered, not answered */
	uint8_t next[POKEYS_PAYLOAD_SIZE];  /* the mailbox writes here */
	uint8_t value[POKEYS_PAYLOAD_SIZE]; /* the last answer, whole */
};

static pokeys_device_t device;
static volatile sig_atomic_t interrupted;

static void on_signal(int signal_number)
{
	(void)signal_number;
	interrupted = 1;
}

static uint64_t now_ns(void)
{
	struct timespec t;

	clock_gettime(CLOCK_MONOTONIC, &t);
	return (uint64_t)t.tv_sec * SECOND_NS + (uint64_t)t.tv_nsec;
}

/* The two functions the mailbox needs. The socket is connected: the kernel checks the source. */

static int udp_send(void *context, const uint8_t *packet, size_t length)
{
	const ssize_t n = send(*(const int *)context, packet, length, MSG_DONTWAIT | MSG_NOSIGNAL);

	return n < 0 ? -errno : 0;
}

static int udp_receive(void *context, uint8_t *packet, size_t size, struct pokeys_rx *rx)
{
	const ssize_t n = recv(*(const int *)context, packet, size, MSG_DONTWAIT | MSG_TRUNC);

	(void)rx;
	if (n >= 0)
		return (int)n;
	/* "refused" says that nobody listened a moment ago; that may change */
	return errno == ECONNREFUSED || errno == EINTR ? -EAGAIN : -errno;
}

static int udp_open(const struct settings *settings)
{
	struct sockaddr_in to = { .sin_family = AF_INET };
	int fd;

	to.sin_port = htons((uint16_t)settings->port);
	if (inet_pton(AF_INET, settings->address, &to.sin_addr) != 1) {
		fprintf(stderr, "async_client: --address %s: not an IPv4 address (192.168.1.20)\n",
			settings->address);
		return -1;
	}
	fd = socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
	if (fd < 0 || connect(fd, (const struct sockaddr *)&to, sizeof(to)) < 0) {
		fprintf(stderr, "async_client: %s port %lu: %s\n", settings->address,
			settings->port, strerror(errno));
		if (fd >= 0)
			close(fd);
		return -1;
	}
	return fd;
}

/* Sleep until a packet or this moment, then let the mailbox work. 0 or -errno. */
static int wait_and_dispatch(int fd, const struct settings *settings, uint64_t until_ns)
{
	const uint64_t deadline = pokeys_device_next_deadline(&device);
	const uint64_t now = now_ns();
	struct pollfd wanted = { .fd = fd, .events = POLLIN };
	struct timespec sleep = { 0, 0 };
	int r;

	if (deadline < until_ns)
		until_ns = deadline;
	if (until_ns > now) {
		sleep.tv_sec = (time_t)((until_ns - now) / SECOND_NS);
		sleep.tv_nsec = (long)((until_ns - now) % SECOND_NS);
	}
	if (ppoll(&wanted, 1, &sleep, NULL) < 0 && errno != EINTR)
		return -errno;
	r = PK_ReceiveAndDispatch(&device);
	PK_TimeoutAndRetryCheck(&device, settings->timeout_us);
	return r < 0 ? r : 0;
}

static int create_and_send(pokeys_command_t op, void *target)
{
	const int id = CreateRequestAsync(&device, op, NULL, 0, target, POKEYS_PAYLOAD_SIZE);

	/* over the budget of transmissions: it goes out in a later tick */
	if (id >= 0)
		SendRequestAsync(&device, (uint8_t)id);
	return id;
}

static void print_identity(const uint8_t *payload)
{
	uint32_t serial;

	memcpy(&serial, payload + 4, sizeof(serial));
	printf("device: %.10s serial %" PRIu32 " firmware %u.%u.%u\n", (const char *)payload + 23,
	       serial, 1u + (payload[8] >> 4), payload[8] & 0x0Fu, payload[9]);
}

static int identify(int fd, const struct settings *settings)
{
	const uint64_t until = now_ns() + PATIENCE_NS;
	static uint8_t payload[POKEYS_PAYLOAD_SIZE]; /* outlives what is in flight */

	while (now_ns() < until && !interrupted) {
		const int id = create_and_send(OP_DEVICE_DATA, payload);

		while (id >= 0 && now_ns() < until && !interrupted &&
		       pokeys_request_state(&device, (uint8_t)id) == POKEYS_REQUEST_IN_FLIGHT) {
			const int r = wait_and_dispatch(fd, settings, until);

			if (r < 0) {
				fprintf(stderr, "async_client: %s\n", strerror(-r));
				return r;
			}
		}
		if (id >= 0 && pokeys_request_state(&device, (uint8_t)id) == POKEYS_REQUEST_DONE) {
			print_identity(payload);
			return 0;
		}
	}
	fprintf(stderr,
		"async_client: %s port %lu: no answer; is the device on, is the address "
		"right?\n",
		settings->address, settings->port);
	return -ETIMEDOUT;
}

/* Use what was answered since the last tick, ask again. */
static void update(struct reading *reading)
{
	const uint8_t id = (uint8_t)reading->id;

	if (reading->id >= 0) {
		switch (pokeys_request_state(&device, id)) {
		case POKEYS_REQUEST_CREATED:
			SendRequestAsync(&device, id);
			return;
		case POKEYS_REQUEST_IN_FLIGHT:
			return;
		case POKEYS_REQUEST_DONE:
			memcpy(reading->value, reading->next, sizeof(reading->value));
			reading->fresh++;
			break;
		case POKEYS_REQUEST_FREE:
		case POKEYS_REQUEST_TIMED_OUT:
		case POKEYS_REQUEST_UNKNOWN:
		case POKEYS_REQUEST_CANCELLED:
			reading->missed++;
			break;
		}
	}
	reading->id = create_and_send(reading->op, reading->next);
}

static void print_readings(const struct reading *io, const struct reading *engine)
{
	int32_t position[2];

	memcpy(position, engine->value + 16, sizeof(position));
	printf("inputs %02x%02x%02x%02x%02x%02x%02x  engine state %u  x %" PRId32 " y %" PRId32
	       "  round trip %" PRIu64 " us\n",
	       io->value[6], io->value[5], io->value[4], io->value[3], io->value[2], io->value[1],
	       io->value[0], engine->value[2], position[0], position[1],
	       device.statistics.rtt_smoothed_ns / 1000);
	fflush(stdout);
}

static void print_statistics(const struct reading *io, const struct reading *engine)
{
	struct pokeys_statistics s;

	pokeys_device_statistics(&device, &s);
	printf("inputs read %" PRIu64 " times, missed %" PRIu64 "; engine read %" PRIu64
	       " times, missed %" PRIu64 "\n",
	       io->fresh, io->missed, engine->fresh, engine->missed);
	printf("sent %" PRIu64 " resent %" PRIu64 " answered %" PRIu64 " timed_out %" PRIu64
	       " stray %" PRIu64 " duplicate %" PRIu64 "\n",
	       s.sent, s.resent, s.done, s.timed_out, s.not_in_flight, s.duplicate);
	printf("round trip us: smoothed %" PRIu64 " least %" PRIu64 " most %" PRIu64
	       ", deadline %" PRIu64 "\n",
	       s.rtt_smoothed_ns / 1000, s.rtt_min_ns / 1000, s.rtt_max_ns / 1000,
	       s.deadline_ns / 1000);
}

static int poll_device(int fd, const struct settings *settings)
{
	static struct reading io = { .op = OP_IO, .id = -1 };
	static struct reading engine = { .op = OP_PULSE_ENGINE, .id = -1 };
	const uint64_t period = SECOND_NS / settings->rate;
	const uint64_t start = now_ns();
	uint64_t tick = start, shown = start;
	int r = 0;

	while (r == 0 && !interrupted && tick < start + settings->seconds * SECOND_NS) {
		update(&io);
		update(&engine);
		if (tick - shown >= SECOND_NS) {
			print_readings(&io, &engine);
			shown += SECOND_NS;
		}
		tick += period;
		while (r == 0 && !interrupted && now_ns() < tick)
			r = wait_and_dispatch(fd, settings, tick);
		/* ticks that were slept through are skipped, not caught up */
		while (now_ns() > tick + period)
			tick += period;
	}
	if (r < 0)
		fprintf(stderr, "async_client: receiving: %s\n", strerror(-r));
	print_readings(&io, &engine);
	print_statistics(&io, &engine);
	return r < 0 || !io.fresh || !engine.fresh ? 1 : 0;
}

static int parse_number(const char *option, const char *text, unsigned long low, unsigned long high,
			unsigned long *value)
{
	char *end;

	errno = 0;
	*value = strtoul(text, &end, 10);
	if (!errno && *text >= '0' && *text <= '9' && !*end && *value >= low && *value <= high)
		return 0;
	fprintf(stderr, "async_client: --%s %s: wanted a number from %lu to %lu\n", option, text,
		low, high);
	return -1;
}

static int parse(int argc, char **argv, struct settings *settings)
{
	static const struct option options[] = {
		{ "address", required_argument, NULL, 'a' },
		{ "port", required_argument, NULL, 'p' },
		{ "seconds", required_argument, NULL, 's' },
		{ "rate", required_argument, NULL, 'r' },
		{ "timeout-us", required_argument, NULL, 't' },
		{ "help", no_argument, NULL, 'h' },
		{ 0 },
	};
	int c, bad = 0;

	while (!bad && (c = getopt_long(argc, argv, "a:p:s:r:t:h", options, NULL)) != -1) {
		if (c == 'a')
			settings->address = optarg;
		else if (c == 'p')
			bad = parse_number("port", optarg, 1, 65535, &settings->port);
		else if (c == 's')
			bad = parse_number("seconds", optarg, 1, 86400, &settings->seconds);
		else if (c == 'r')
			bad = parse_number("rate", optarg, 1, 2000, &settings->rate);
		else if (c == 't')
			bad = parse_number("timeout-us", optarg, 0, 10000000,
					   &settings->timeout_us);
		else
			bad = c == 'h' ? 1 : -1;
	}
	if (!bad && optind < argc) {
		fprintf(stderr, "async_client: %s: not an option\n", argv[optind]);
		bad = -1;
	}
	if (bad)
		fprintf(bad > 0 ? stdout : stderr,
			"usage: async_client [--address IPV4] "
			"[--port N] [--seconds N] [--rate HZ] [--timeout-us N]\n");
	return bad;
}

int main(int argc, char **argv)
{
	struct settings settings = { "127.0.0.1", 20055, 5, 200, 0 };
	struct sigaction action = { .sa_handler = on_signal };
	struct pokeys_io io = { udp_send, udp_receive, NULL };
	int fd, status;

	status = parse(argc, argv, &settings);
	if (status)
		return status > 0 ? 0 : 2;
	sigaction(SIGINT, &action, NULL);
	sigaction(SIGTERM, &action, NULL);
	fd = udp_open(&settings);
	if (fd < 0)
		return 2;
	io.context = &fd;
	status = pokeys_device_init(&device, &io, NULL);
	if (status == 0)
		status = identify(fd, &settings);
	if (status == 0)
		status = poll_device(fd, &settings);
	close(fd);
	return status ? 1 : 0;
}
