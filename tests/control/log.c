// SPDX-License-Identifier: GPL-2.0-or-later
/* Messages reach a reader who reads, and never wait for one who does not. */
#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>
#include <cmocka.h>
#include "daemon/control/log.h"

static char got[70000];

static const char *take(int fd)
{
	ssize_t length = read(fd, got, sizeof(got) - 1);

	got[length > 0 ? length : 0] = '\0';
	return got;
}

static void less_important_lines_are_not_written(void **state)
{
	int fd[2];

	(void)state;
	assert_int_equal(pipe(fd), 0);
	log_open(fd[1], 4);
	log_line(5, "notice");
	log_line(4, "warning %d", 7);
	log_line(3, "error");
	assert_string_equal(take(fd[0]), "pokeysd: warning 7\npokeysd: error\n");
	close(fd[0]);
	close(fd[1]);
}

static void lines_begin_with_the_name_of_their_program(void **state)
{
	int fd[2];

	(void)state;
	assert_int_equal(pipe(fd), 0);
	log_open(fd[1], 7);
	log_program("pokeys-guard");
	log_line(6, "on eth1");
	log_program("pokeysd");
	log_line(6, "ready");
	assert_string_equal(take(fd[0]), "pokeys-guard: on eth1\npokeysd: ready\n");
	close(fd[0]);
	close(fd[1]);
}

static void a_line_is_one_line(void **state)
{
	char text[3000];
	int fd[2];

	(void)state;
	assert_int_equal(pipe(fd), 0);
	log_open(fd[1], 7);
	memset(text, 'x', sizeof(text) - 1);
	text[sizeof(text) - 1] = '\0';
	log_line(6, "a\nb\x1b[2J");
	assert_string_equal(take(fd[0]), "pokeysd: a?b?[2J\n");
	log_line(6, "%s", text);
	take(fd[0]);
	assert_int_equal(strlen(got), 1023);
	assert_int_equal(strcspn(got, "\n"), 1022);
	close(fd[0]);
	close(fd[1]);
}

static void the_journal_gets_levels(void **state)
{
	char stream[64];
	struct stat st;
	int fd[2];

	(void)state;
	assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM, 0, fd), 0);
	fstat(fd[1], &st);
	snprintf(stream, sizeof(stream), "%llu:%llu", (unsigned long long)st.st_dev,
		 (unsigned long long)st.st_ino);
	setenv("JOURNAL_STREAM", stream, 1);
	log_open(fd[1], 7);
	log_line(4, "warning");
	assert_string_equal(take(fd[0]), "<4>warning\n");
	/* the variable is inherited by programs whose stderr is something else */
	setenv("JOURNAL_STREAM", "1:2", 1);
	log_open(fd[1], 7);
	log_line(4, "warning");
	assert_string_equal(take(fd[0]), "pokeysd: warning\n");
	unsetenv("JOURNAL_STREAM");
	close(fd[0]);
	close(fd[1]);
}

/* Fill whatever it is; a log that waits ends in this test's time limit. */
static void fill(int to, int from)
{
	uint64_t before = log_dropped();
	int lines = 0;

	log_open(to, 7);
	while (log_dropped() == before && lines++ < 100000)
		log_line(6, "what nobody reads, line %d", lines);
	assert_int_equal(log_dropped(), before + 1);
	log_line(6, "nor this");
	assert_int_equal(log_dropped(), before + 2);
	for (int i = 0; i < 64 && strlen(take(from)) == sizeof(got) - 1; i++)
		;
	log_line(6, "read again");
	assert_non_null(strstr(take(from), "(2 messages lost) read again\n"));
	log_line(6, "and no more of it");
	assert_string_equal(take(from), "pokeysd: and no more of it\n");
}

static void a_full_pipe_is_not_waited_for(void **state)
{
	int fd[2];

	(void)state;
	assert_int_equal(pipe(fd), 0);
	fill(fd[1], fd[0]);
	assert_false(fcntl(fd[1], F_GETFL) & O_NONBLOCK);
	close(fd[0]);
	close(fd[1]);
}

static void a_full_socket_is_not_waited_for(void **state)
{
	int fd[2], size = 8192;

	(void)state;
	assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM, 0, fd), 0);
	setsockopt(fd[1], SOL_SOCKET, SO_SNDBUF, &size, sizeof(size));
	fill(fd[1], fd[0]);
	close(fd[0]);
	close(fd[1]);
}

static void a_closed_or_full_place_costs_the_line_only(void **state)
{
	uint64_t before = log_dropped();
	int full = open("/dev/full", O_WRONLY);
	int fd[2];

	(void)state;
	log_open(987, 7);
	log_line(3, "into a descriptor that is not open");
	assert_int_equal(log_dropped(), before + 1);
	assert_true(full >= 0);
	log_open(full, 7);
	log_line(3, "onto a full disk");
	assert_int_equal(log_dropped(), before + 2);
	close(full);
	assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM, 0, fd), 0);
	close(fd[0]);
	log_open(fd[1], 7);
	log_line(3, "to a journal that is gone: no SIGPIPE either");
	assert_int_equal(log_dropped(), before + 3);
	close(fd[1]);
}

static void ten_of_a_kind_are_said_in_ten_seconds(void **state)
{
	struct log_limit limit = { 0 };
	uint64_t now = 5;
	uint32_t held;
	int said = 0;

	(void)state;
	for (int i = 0; i < 100; i++, now += 1000000)
		said += log_permit(&limit, now, &held);
	assert_int_equal(said, LOG_BURST);
	assert_false(log_permit(&limit, LOG_WHILE_NS + 4, &held));
	assert_true(log_permit(&limit, LOG_WHILE_NS + 5, &held));
	assert_int_equal(held, 91);
	assert_true(log_permit(&limit, LOG_WHILE_NS + 6, &held));
	assert_int_equal(held, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(less_important_lines_are_not_written),
		cmocka_unit_test(lines_begin_with_the_name_of_their_program),
		cmocka_unit_test(a_line_is_one_line),
		cmocka_unit_test(the_journal_gets_levels),
		cmocka_unit_test(a_full_pipe_is_not_waited_for),
		cmocka_unit_test(a_full_socket_is_not_waited_for),
		cmocka_unit_test(a_closed_or_full_place_costs_the_line_only),
		cmocka_unit_test(ten_of_a_kind_are_said_in_ten_seconds),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
