// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Orders through the socket: what is done, what is refused and in which words,
 * and that nobody who stands there can hold the daemon up. The realtime loop is
 * played by the test: it executes orders when it is told to.
 */
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

static unsigned int chmod_calls;

/* In place of the C library's: by name, so of whatever the name leads to at that moment. */
int chmod(const char *path, mode_t mode)
{
	chmod_calls++;
	return fchmodat(AT_FDCWD, path, mode, 0);
}

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
	return rmdir(folder);		/* fails if anything is left */
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
static const char *heard(int fd)
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
static struct loop_order execute(int result)
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

static void apply_brings_what_the_file_says_now(void **state)
{
	struct loop_order order;
	int fd;

	(void)state;
	write_config("[device mill]\naddress = 10.0.0.1\naxes = 2\n"
		     "[device lathe]\naddress = 10.0.0.2\n");
	fd = ask("config apply mill");
	assert_string_equal(heard(fd), "");
	order = execute(0);
	assert_int_equal(order.device, 0);
	assert_int_equal(order.what, DEVICE_ORDER_APPLY);
	assert_true(order.replace);
	assert_int_equal(order.settings.axes, 2);
	report.state = POKEYS_CONFIG_APPLIED;
	desk_run(&desk, now);
	/* a report of before the order is not believed */
	assert_string_equal(heard(fd), "");
	pass(300 * MS);
	assert_string_equal(heard(fd), "ok mill: the device has all that is wanted");
}

/* A loop that is held: what the device had before the order does not answer it. */
static void report_of_before_the_order_is_not_believed_however_late_the_loop_is(void **state)
{
	int fd = ask("config apply mill");

	(void)state;
	report.state = POKEYS_CONFIG_APPLIED;
	execute(0);
	loop.shared.cycles--;		/* the cycle that executed it has not ended */
	pass(2000 * MS);
	assert_string_equal(heard(fd), "");
	loop.shared.cycles++;
	report.state = POKEYS_CONFIG_WAITING;
	pass(20 * MS);
	assert_says(fd, "waits until the machine is off");
}

static void apply_says_what_became_of_it(void **state)
{
	static const struct {
		uint8_t state;
		const char *said;
	} cases[] = {
		{ POKEYS_CONFIG_WAITING, "ok mill: the configuration was taken over; what differs "
					 "waits until the machine is off" },
		{ POKEYS_CONFIG_REFUSED, "refused mill: the device did not take everything" },
		{ POKEYS_CONFIG_APPLIED, "ok mill: the device has all" },
	};

	(void)state;
	for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
		int fd = ask("config apply mill");

		report.state = POKEYS_CONFIG_APPLYING;
		execute(0);
		pass(1000 * MS);
		assert_string_equal(heard(fd), "");
		report.state = cases[i].state;
		pass(20 * MS);
		assert_says(fd, cases[i].said);
	}
}

static void apply_does_not_take_for_ever(void **state)
{
	int fd = ask("config apply mill");

	(void)state;
	execute(0);
	report.state = POKEYS_CONFIG_APPLYING;
	pass(5001 * MS);
	assert_says(fd, "ok mill: the configuration was taken over and is still being applied");
	fd = ask("config apply mill");
	execute(0);
	read_result = -EPROTO;
	pass(5001 * MS);
	assert_says(fd, "still being applied");
	/* a loop that does not run takes no order */
	fd = ask("config apply mill");
	pass(3001 * MS);
	assert_says(fd, "refused mill: the realtime loop does not take the order");
}

static void broken_file_changes_nothing_and_the_faults_go_to_the_caller(void **state)
{
	char expected[400];

	(void)state;
	write_config("[device mill]\naddress = 10.0.0.1\naxes = 9\nnonsense = 3\n");
	heard(ask("config apply mill"));
	snprintf(expected, sizeof(expected),
		 "refused nothing was changed:\n%s:3: [device mill]: axes: \"9\" is out of range; "
		 "allowed: leave | 0..8\n%s:4: [device mill]: there is no key "
		 "nonsense", config_path,
		 config_path);
	assert_int_equal(strncmp(answer, expected, strlen(expected)), 0);
	assert_int_equal(loop.orders.given, 0);
	unlink(config_path);
	assert_says(ask("config apply mill"), "there is no such file");
	write_config("[device lathe]\naddress = 10.0.0.2\n");
	assert_says(ask("config apply mill"), "has no [device mill] any more");
	assert_int_equal(loop.orders.given, 0);
	assert_int_equal(desk.refused, 3);
}

/* Who opens a pipe waits for its other end. */
static void configuration_that_became_a_pipe_holds_nobody_up(void **state)
{
	(void)state;
	unlink(config_path);
	assert_int_equal(mkfifo(config_path, 0600), 0);
	assert_says(ask("config apply mill"), "is not a file; the daemon reads it again");
	desk_reload(&desk);
	assert_int_equal(loop.orders.given, 0);
}

static void file_with_very_many_faults_is_answered_all_the_same(void **state)
{
	FILE *file = fopen(config_path, "w");

	(void)state;
	for (int i = 0; i < 1000; i++)
		fprintf(file, "there is nothing of the kind here, not even by far %d\n", i);
	fclose(file);
	heard(ask("config apply mill"));
	assert_true(strlen(answer) > 1000 && strlen(answer) < DESK_ANSWER_MAX);
}

static void change_that_wants_a_restart_is_told(void **state)
{
	int fd;

	(void)state;
	write_config("[device mill]\naddress = 10.0.0.1\naxes = 3\nlost-after-ms = 300\n"
		     "[device lathe]\naddress = 10.0.0.2\n");
	fd = ask("config apply mill");
	execute(0);
	report.state = POKEYS_CONFIG_APPLIED;
	pass(300 * MS);
	assert_says(fd, "those want a restart");
}

static void save_is_answered_when_the_device_has_said_how_it_went(void **state)
{
	struct event event = { .code = EVENT_ONE_SHOT, .device = 1,
			       .a = POKEYS_ONE_SHOT_SAVE_CONFIG, .b = EVENT_ORDERED,
			       .c = POKEYS_OUTCOME_DONE };
	struct loop_order order;
	int fd = ask("config save lathe");

	(void)state;
	order = execute(0);
	assert_int_equal(order.what, DEVICE_ORDER_SAVE);
	assert_false(order.replace);
	pass(1000 * MS);
	event.device = 0;		/* another device's */
	desk_event(&desk, &event, now);
	assert_string_equal(heard(fd), "");
	event.device = 1;
	event.b = 7;			/* pressed in HAL */
	desk_event(&desk, &event, now);
	assert_string_equal(heard(fd), "");
	event.b = EVENT_ORDERED;
	desk_event(&desk, &event, now);
	assert_says(fd, "ok lathe: its settings are in its flash memory now");
	fd = ask("config save lathe");
	execute(0);
	event.c = POKEYS_OUTCOME_FAILED;
	desk_event(&desk, &event, now);
	assert_says(fd, "refused lathe: the device did not save");
	fd = ask("config save lathe");
	execute(0);
	pass(8001 * MS);
	assert_says(fd, "refused lathe: the device has not said whether");
}

/* The device has saved before the control thread's next round. */
static void save_that_is_quicker_than_its_order_is_answered(void **state)
{
	const struct event event = { .code = EVENT_ONE_SHOT, .device = 0,
				     .a = POKEYS_ONE_SHOT_SAVE_CONFIG, .b = EVENT_ORDERED,
				     .c = POKEYS_OUTCOME_DONE };
	int fd = ask("config save mill");

	(void)state;
	loop.orders.done++;
	desk_event(&desk, &event, now);
	assert_says(fd, "ok mill: its settings are in its flash memory now");
}

static void what_the_loop_refuses_is_said_in_words(void **state)
{
	static const struct {
		const char *request;
		int result;
		const char *said;
	} cases[] = {
		{ "config save mill", -EBUSY,
		  "refused mill: motion is permitted; switch the machine "
					      "off first" },
		{ "config save mill", -ENOTCONN, "refused mill: the device is away" },
		{ "config save mill", -EAGAIN,
		  "refused mill: its flash memory was written less than "
					       "2 s ago" },
		{ "config save mill", -EALREADY, "refused mill: another order is at work" },
		{ "config apply mill", -ENOTCONN, "ok mill: the configuration was taken over; the "
						  "device is away and gets its settings when" },
	};

	(void)state;
	for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
		int fd = ask(cases[i].request);

		execute(cases[i].result);
		assert_says(fd, cases[i].said);
	}
}

static void what_is_no_request_is_told_what_would_be_one(void **state)
{
	static const char *const bad[] = {
		"x", "config", "config apply", "config save", "config show mill",
		"CONFIG SAVE mill",
		"config erase mill", "\x1b[2J", "\xff\xfe", "config  save mill",
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

static void socket_is_for_the_group_and_follows_a_dead_daemon(void **state)
{
	struct desk next;
	struct stat status;

	(void)state;
	assert_int_equal(stat(desk.socket, &status), 0);
	assert_int_equal(status.st_mode & 07777, 0660);
	close(desk.listen_fd);		/* it died: the name is still there */
	desk.listen_fd = -1;
	desk_init(&next, &config, config_path, &loop, read_report, NULL);
	assert_int_equal(desk_open(&next), 0);
	desk_close(&next);
	assert_int_equal(stat(desk.socket, &status), -1);
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

static void reload_gives_every_device_what_the_file_says(void **state)
{
	(void)state;
	write_config("[device lathe]\naddress = 10.0.0.2\naxes = 1\n"
		     "[device mill]\naddress = 10.0.0.1\naxes = 8\n");
	desk_reload(&desk);
	assert_int_equal(loop.orders.given, 2);
	assert_int_equal(loop.orders.slot[0].device, 0);
	assert_int_equal(loop.orders.slot[0].settings.axes, 8);
	assert_int_equal(loop.orders.slot[1].settings.axes, 1);
	execute(0);
	write_config("[device mill]\naxes = 8\n");
	desk_reload(&desk);
	assert_int_equal(loop.orders.given, 2);
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
		BOTH(apply_brings_what_the_file_says_now),
		BOTH(report_of_before_the_order_is_not_believed_however_late_the_loop_is),
		BOTH(apply_says_what_became_of_it),
		BOTH(apply_does_not_take_for_ever),
		BOTH(broken_file_changes_nothing_and_the_faults_go_to_the_caller),
		BOTH(configuration_that_became_a_pipe_holds_nobody_up),
		BOTH(file_with_very_many_faults_is_answered_all_the_same),
		BOTH(change_that_wants_a_restart_is_told),
		BOTH(save_is_answered_when_the_device_has_said_how_it_went),
		BOTH(save_that_is_quicker_than_its_order_is_answered),
		BOTH(what_the_loop_refuses_is_said_in_words),
		BOTH(what_is_no_request_is_told_what_would_be_one),
		BOTH(requests_of_a_wrong_size_are_refused),
		BOTH(who_says_nothing_is_sent_away),
		BOTH(who_leaves_before_the_answer_harms_nobody),
		BOTH(a_ninth_is_told_to_come_again),
		BOTH(socket_is_for_the_group_and_follows_a_dead_daemon),
		BOTH(mode_is_given_to_the_socket_and_to_nothing_else),
		BOTH(reload_gives_every_device_what_the_file_says),
		BOTH(those_who_wait_hear_that_the_daemon_ends),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
