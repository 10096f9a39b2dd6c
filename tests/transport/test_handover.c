/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A message of somebody who may send anything: no descriptor is left open by it. */
#include <dirent.h>
#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>
#include <cmocka.h>
#include "daemon/transport/handover.h"

enum { MANY = 3 };

static int pair[2];

static int begin(void **state)
{
	(void)state;
	return socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, pair);
}

static int end(void **state)
{
	(void)state;
	close(pair[0]);
	close(pair[1]);
	return 0;
}

static int descriptors(void)
{
	DIR *all = opendir("/proc/self/fd");
	int count = 0;

	assert_non_null(all);
	while (readdir(all))
		count++;
	closedir(all);
	return count;
}

/* One message with so many descriptors. */
static void send_with(size_t count)
{
	struct handover_request request = { .version = HANDOVER_VERSION };
	struct iovec body = { &request, sizeof(request) };
	union {
		struct cmsghdr align;
		char room[CMSG_SPACE(MANY * sizeof(int))];
	} carried = { 0 };
	struct msghdr m = {
		.msg_iov = &body,
		.msg_iovlen = 1,
		.msg_control = carried.room,
		.msg_controllen = CMSG_SPACE(count * sizeof(int)),
	};
	struct cmsghdr *c = CMSG_FIRSTHDR(&m);
	const int fds[MANY] = { pair[0], pair[0], pair[0] };

	c->cmsg_level = SOL_SOCKET;
	c->cmsg_type = SCM_RIGHTS;
	c->cmsg_len = CMSG_LEN(count * sizeof(int));
	memcpy(CMSG_DATA(c), fds, count * sizeof(int));
	assert_int_equal(sendmsg(pair[0], &m, 0), sizeof(request));
}

static void of_many_descriptors_one_is_taken_in(void **state)
{
	(void)state;
	for (size_t count = 1; count <= MANY; count++) {
		const int before = descriptors();
		struct handover_request request;
		int fd;

		send_with(count);
		assert_int_equal(handover_receive(pair[1], &request, sizeof(request), &fd),
				 sizeof(request));
		assert_int_equal(request.version, HANDOVER_VERSION);
		assert_true(fd >= 0);
		close(fd);
		assert_int_equal(descriptors(), before);
	}
}

static void without_one_there_is_none(void **state)
{
	struct handover_request request = { .version = HANDOVER_VERSION };
	int fd = 0;

	(void)state;
	assert_int_equal(handover_receive(pair[1], &request, sizeof(request), &fd), -EAGAIN);
	assert_int_equal(fd, -1);
	assert_int_equal(handover_send(pair[0], &request, sizeof(request), -1), sizeof(request));
	fd = 0;
	assert_int_equal(handover_receive(pair[1], &request, sizeof(request), &fd),
			 sizeof(request));
	assert_int_equal(fd, -1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(of_many_descriptors_one_is_taken_in, begin, end),
		cmocka_unit_test_setup_teardown(without_one_there_is_none, begin, end),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
