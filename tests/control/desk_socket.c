// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Nobody who stands at the socket can hold the daemon up, whatever he says or does not
 * say, and the socket is for the group and for nobody else.
 */
#include "tests/control/desk_rig.h"

static unsigned int chmod_calls;

/* In place of the C library's: by name, so of whatever the name leads to at that moment. */
int chmod(const char *path, mode_t mode)
{
	chmod_calls++;
	return fchmodat(AT_FDCWD, path, mode, 0);
}

static void what_is_no_request_is_told_what_would_be_one(void **state)
{
	static const char *const bad[] = {
		"x",
		"config",
		"config apply",
		"config save",
		"config show mill",
		"CONFIG SAVE mill",
		"config erase mill",
		"\x1b[2J",
		"\xff\xfe",
		"config  save mill",
	};

	(void)state;
	for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
		assert_says(ask(bad[i]), "is no request; requests are: config apply DEVICE");
		for (const char *c = answer; *c; c++)
			assert_in_range(*c, ' ', '~');
	}
	assert_says(ask("config save lath"), "refused there is no device \"lath\"");
	assert_says(ask("config save mill lathe"), "refused there is no device \"mill lathe\"");
	assert_int_equal(loop.orders.given, 0);
	assert_int_equal(desk.refused, sizeof(bad) / sizeof(bad[0]) + 2);
}

static void requests_of_a_wrong_size_are_refused(void **state)
{
	char large[70000];
	int fd;

	(void)state;
	memset(large, 'x', sizeof(large));
	fd = attach();
	assert_true(send(fd, large, 129, 0) == 129);
	desk_run(&desk, now);
	assert_says(fd, "at most 128 characters");
	fd = attach();
	assert_true(send(fd, large, 60000, 0) == 60000);
	desk_run(&desk, now);
	assert_says(fd, "at most 128 characters");
	fd = attach();
	assert_true(send(fd, "config save mill\0x", 18, 0) == 18);
	desk_run(&desk, now);
	assert_says(fd, "at most 128 characters");
}

static void who_says_nothing_is_sent_away(void **state)
{
	int silent = attach(), gone = attach();

	(void)state;
	close(gone);
	desk_run(&desk, now);
	pass(1900 * MS);
	assert_int_equal(desk.client[0].phase, DESK_ASKING);
	pass(200 * MS);
	for (size_t i = 0; i < DESK_CLIENTS; i++)
		assert_int_equal(desk.client[i].phase, DESK_FREE);
	assert_int_equal(recv(silent, answer, 1, MSG_DONTWAIT), 0);
	close(silent);
}

static void who_leaves_before_the_answer_harms_nobody(void **state)
{
	int fd = ask("config save mill");

	(void)state;
	close(fd);
	execute(-EBUSY);
	for (size_t i = 0; i < DESK_CLIENTS; i++)
		assert_int_equal(desk.client[i].phase, DESK_FREE);
}

static void a_ninth_is_told_to_come_again(void **state)
{
	int fd[DESK_CLIENTS], more;

	(void)state;
	for (size_t i = 0; i < DESK_CLIENTS; i++)
		fd[i] = ask("config save mill");
	more = ask("config save mill");
	assert_says(more, "refused 8 orders are at work; try again");
	execute(-EBUSY);
	for (size_t i = 0; i < DESK_CLIENTS; i++)
		assert_says(fd[i], "motion is permitted");
}

static void socket_is_for_the_group_and_goes_with_its_daemon(void **state)
{
	char path[sizeof(desk.socket)];
	struct stat status;

	(void)state;
	assert_int_equal(stat(desk.socket, &status), 0);
	assert_int_equal(status.st_mode & 07777, 0660);
	strcpy(path, desk.socket);
	desk_close(&desk);
	assert_int_equal(stat(path, &status), -1);
}

/* Given by name, the mode would be given to whatever a link there leads to. */
static void mode_is_given_to_the_socket_and_to_nothing_else(void **state)
{
	mode_t before = umask(0077);
	struct desk next;
	struct stat status;

	(void)state;
	desk_close(&desk);
	chmod_calls = 0;
	desk_init(&next, &config, config_path, &loop, read_report, NULL);
	assert_int_equal(desk_open(&next), 0);
	assert_int_equal(chmod_calls, 0);
	assert_int_equal(umask(before), 0077);
	assert_int_equal(stat(next.socket, &status), 0);
	assert_int_equal(status.st_mode & 07777, 0660);
	desk_close(&next);
}

static void those_who_wait_hear_that_the_daemon_ends(void **state)
{
	int fd = ask("config save mill");

	(void)state;
	desk_close(&desk);
	assert_says(fd, "refused the daemon is ending");
}

int main(void)
{
#define BOTH(name) cmocka_unit_test_setup_teardown(name, setup, teardown)
	const struct CMUnitTest tests[] = {
		BOTH(what_is_no_request_is_told_what_would_be_one),
		BOTH(requests_of_a_wrong_size_are_refused),
		BOTH(who_says_nothing_is_sent_away),
		BOTH(who_leaves_before_the_answer_harms_nobody),
		BOTH(a_ninth_is_told_to_come_again),
		BOTH(socket_is_for_the_group_and_goes_with_its_daemon),
		BOTH(mode_is_given_to_the_socket_and_to_nothing_else),
		BOTH(those_who_wait_hear_that_the_daemon_ends),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
