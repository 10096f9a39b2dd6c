/* SPDX-License-Identifier: MIT */
/*
 * The mailbox in its smallest form: after pokeys_device_init(), these four functions, and what is
 * in an entry.
 *
 * Once a millisecond, the digital inputs are asked for and what has come is used. Nothing waits for
 * an answer: a lost one is asked for again after the timeout, while later requests go on.
 *
 *	cc async_four.c $(pkg-config --cflags --libs pokeys_async)
 *	./a.out 192.168.1.20
 */
#include <arpa/inet.h>
#include <errno.h>
#include <pokeys/async.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

/* Read inputs and outputs at once: protocol section 3.4. Seven bytes of inputs come first. */
enum { OP_IO = 0xCC, INPUT_BYTES = 7, PORT = 20055, TIMEOUT_US = 5000, CYCLES = 2000 };

static int udp_send(void *context, const uint8_t *packet, size_t length)
{
	return send(*(const int *)context, packet, length, MSG_DONTWAIT) < 0 ? -errno : 0;
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

static int udp_open(const char *address, const char *port)
{
	struct sockaddr_in to = { .sin_family = AF_INET };
	const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);

	to.sin_port = htons((uint16_t)(port ? atoi(port) : PORT));
	if (fd >= 0 && inet_pton(AF_INET, address, &to.sin_addr) == 1 &&
	    connect(fd, (const struct sockaddr *)&to, sizeof(to)) == 0)
		return fd;
	fprintf(stderr, "async_four: %s: no IPv4 address that can be reached\n", address);
	return -1;
}

int main(int argc, char **argv)
{
	static pokeys_device_t device;
	static uint8_t inputs[INPUT_BYTES]; /* the mailbox writes here */
	const struct timespec cycle = { .tv_nsec = 1000000 };
	static bool asked[POKEYS_MAILBOX_SIZE];
	unsigned int answered = 0;
	int fd = argc > 1 ? udp_open(argv[1], argc > 2 ? argv[2] : NULL) : -1, id;
	const struct pokeys_io io = { udp_send, udp_receive, &fd };

	if (argc < 2)
		fputs("usage: async_four ADDRESS [PORT]\n", stderr);
	if (fd < 0 || pokeys_device_init(&device, &io, NULL))
		return 2;
	for (int i = 0; i < CYCLES; i++) {
		if (PK_ReceiveAndDispatch(&device) < 0)
			break;
		PK_TimeoutAndRetryCheck(&device, TIMEOUT_US);
		for (id = 0; id < POKEYS_MAILBOX_SIZE; id++) {
			if (!asked[id] || !device.mailbox[id].response_ready)
				continue;
			asked[id] = false;
			answered++;
		}
		id = CreateRequestAsync(&device, OP_IO, NULL, 0, inputs, sizeof(inputs));
		if (id >= 0) {
			SendRequestAsync(&device, (uint8_t)id);
			asked[id] = true;
		}
		nanosleep(&cycle, NULL);
	}
	printf("inputs %02x%02x%02x%02x%02x%02x%02x, %u answers\n", inputs[6], inputs[5], inputs[4],
	       inputs[3], inputs[2], inputs[1], inputs[0], answered);
	close(fd);
	return answered ? 0 : 1;
}
