/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A desk in a folder of its own, and somebody who asks. The realtime loop is played by
 * the test: it executes orders when it is told to.
 */
#ifndef TESTS_CONTROL_DESK_RIG_H
#define TESTS_CONTROL_DESK_RIG_H

#include <errno.h>
#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>
#include <cmocka.h>
#include "daemon/control/desk.h"
#include "daemon/control/log.h"

#define MS UINT64_C(1000000)

static char folder[] = "/tmp/pokeysd-desk-XXXXXX";
static char config_path[64], answer[8192];
static struct config config;
static struct loop loop;
static struct desk desk;
static struct pokeys_report report;
static int read_result;
static uint64_t now;

static int read_report(void *context, uint32_t device, struct pokeys_report *out)
{
	(void)context;
	assert_true(device < config.devices);
	*out = report;
	return read_result;
}

static void complain(void *context, const char *line)
{
	(void)context;
	fail_msg("%s", line);
}

static void write_config(const char *text)
{
	FILE *file = fopen(config_path, "w");

	assert_non_null(file);
	fputs(text, file);
	fclose(file);
}

#define GOOD "[device mill]\naddress = 10.0.0.1\naxes = 3\n[device lathe]\naddress = 10.0.0.2\n"

static int setup(void **state)
{
	(void)state;
	memcpy(folder + sizeof(folder) - 7, "XXXXXX", 6);
	if (!mkdtemp(folder))
		return -1;
	snprintf(config_path, sizeof(config_path), "%s/conf", folder);
	write_config(GOOD);
	assert_int_equal(config_read(config_path, &config, complain, NULL), 0);
	snprintf(config.runtime_directory, sizeof(config.runtime_directory), "%s", folder);
	memset(&loop, 0, sizeof(loop));
	loop.count = config.devices;
	memset(&report, 0, sizeof(report));
	read_result = 0;
	now = 1000 * MS;
	log_open(open("/dev/null", 1), EVENT_DEBUG);
	desk_init(&desk, &config, config_path, &loop, read_report, NULL);
	return desk_open(&desk);
}

static int teardown(void **state)
{
	(void)state;
	desk_close(&desk);
	unlink(config_path);
	return rmdir(folder); /* fails if anything is left */
}

static int attach(void)
{
	struct sockaddr_un address = { .sun_family = AF_UNIX };
	int fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);

	snprintf(address.sun_path, sizeof(address.sun_path), "%s/control", folder);
	assert_int_equal(connect(fd, (const struct sockaddr *)&address, sizeof(address)), 0);
	return fd;
}

static int ask(const char *request)
{
	int fd = attach();

	assert_int_equal(send(fd, request, strlen(request), 0), (ssize_t)strlen(request));
	desk_run(&desk, now);
	return fd;
}

/* The answer, "" if there is none yet. Closes when there is one. */
static inline const char *heard(int fd)
{
	ssize_t length = recv(fd, answer, sizeof(answer) - 1, MSG_DONTWAIT);

	answer[length > 0 ? length : 0] = '\0';
	if (length >= 0)
		close(fd);
	return answer;
}

static void assert_says(int fd, const char *text)
{
	if (!strstr(heard(fd), text))
		fail_msg("it said: %s", answer);
}

/* The loop does what was ordered; the last one. */
static inline struct loop_order execute(int result)
{
	struct loop_order *order = NULL;

	while (loop.orders.done != loop.orders.given) {
		order = &loop.orders.slot[loop.orders.done % LOOP_ORDERS];
		order->result = result;
		loop.orders.done++;
	}
	assert_non_null(order);
	desk_run(&desk, now);
	loop.shared.cycles++;
	return *order;
}

static void pass(uint64_t ns)
{
	now += ns;
	desk_run(&desk, now);
}

#endif
