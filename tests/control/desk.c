// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Orders through the socket: what is done, what is refused and in which words. Who may
 * ask, and how long: desk_socket.c.
 */
#include "tests/control/desk_rig.h"

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
	loop.shared.cycles--; /* the cycle that executed it has not ended */
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
		 "nonsense",
		 config_path, config_path);
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
	assert_says(fd, "those need a restart");
}

static void save_is_answered_when_the_device_has_said_how_it_went(void **state)
{
	struct event event = { .code = EVENT_ONE_SHOT,
			       .device = 1,
			       .a = POKEYS_ONE_SHOT_SAVE_CONFIG,
			       .b = EVENT_ORDERED,
			       .c = POKEYS_OUTCOME_DONE };
	struct loop_order order;
	int fd = ask("config save lathe");

	(void)state;
	order = execute(0);
	assert_int_equal(order.what, DEVICE_ORDER_SAVE);
	assert_false(order.replace);
	pass(1000 * MS);
	event.device = 0; /* another device's */
	desk_event(&desk, &event, now);
	assert_string_equal(heard(fd), "");
	event.device = 1;
	event.b = 7; /* pressed in HAL */
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
	const struct event event = { .code = EVENT_ONE_SHOT,
				     .device = 0,
				     .a = POKEYS_ONE_SHOT_SAVE_CONFIG,
				     .b = EVENT_ORDERED,
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
		{ "config apply mill", -ENOTCONN,
		  "ok mill: the configuration was taken over; the "
		  "device is away and gets its settings when" },
	};

	(void)state;
	for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
		int fd = ask(cases[i].request);

		execute(cases[i].result);
		assert_says(fd, cases[i].said);
	}
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

static void reload_reaches_as_many_devices_as_there_may_be(void **state)
{
	char text[64 * TRANSPORT_CHANNELS] = "";

	(void)state;
	for (int i = 0; i < TRANSPORT_CHANNELS; i++)
		sprintf(text + strlen(text), "[device d%d]\nserial = %d\n", i, i + 1);
	write_config(text);
	assert_int_equal(config_read(config_path, &config, complain, NULL), 0);
	loop.count = config.devices;
	desk_reload(&desk);
	assert_int_equal(loop.orders.given, TRANSPORT_CHANNELS);
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
		BOTH(reload_gives_every_device_what_the_file_says),
		BOTH(reload_reaches_as_many_devices_as_there_may_be),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
