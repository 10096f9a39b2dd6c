// SPDX-License-Identifier: GPL-2.0-or-later
/* Which answers to a search move a device, and which do not. */
#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>
#include <cmocka.h>
#include "daemon/control/finder.h"
#include "daemon/control/log.h"
#include "wire/model.h"

static struct config config;
static const struct teller teller = { .config = &config };
static struct loop_shared shared;
static _Atomic uint64_t found[TRANSPORT_CHANNELS];
static struct transport_address from = { .address = 0x0a000005, .port = 20055 };

static struct finder_answers answers;

static int setup(void **state)
{
	(void)state;
	memset(&config, 0, sizeof(config));
	memset(&shared, 0, sizeof(shared));
	memset((void *)found, 0, sizeof(found));
	memset(&answers, 0, sizeof(answers));
	from.interface = 0;
	config.devices = 3;
	config.device[0].serial = 31234;
	config.device[0].port = 20055;
	config.device[1].serial = 70000;
	config.device[1].port = 5000;
	config.device[2].address = 0x0a000009; /* any serial number, by address */
	atomic_store(&shared.wanted, 7);
	return 0;
}

static void answer(uint32_t serial, bool old_format)
{
	uint8_t data[WIRE_DISCOVERY_LEN];
	const struct wire_discovery reply = {
		.serial = serial,
		.hardware = WIRE_HW_57CNC,
		.ip = { 10, 0, 0, 99 },
		.old_format = old_format,
	};
	size_t length = wire_discovery_encode(data, &reply);

	finder_take(&config, &shared, found, &answers, data, length, &from);
}

static uint64_t aimed(int device)
{
	return atomic_load(&found[device]);
}

static void the_device_is_where_its_answer_came_from(void **state)
{
	(void)state;
	answer(31234, false);
	assert_true(aimed(0) == (UINT64_C(0x0a000005) << 16 | 20055));
	assert_true(aimed(1) == 0);
	answer(70000, false);
	assert_true(aimed(1) == (UINT64_C(0x0a000005) << 16 | 5000));
}

/* It hears the question from two interfaces, and answers both, in any order. */
static void the_way_of_its_route_needs_no_interface(void **state)
{
	const uint64_t where = UINT64_C(0x0a000005) << 16 | 20055;

	(void)state;
	from.interface = 7;
	answer(31234, false);
	assert_true(aimed(0) == (UINT64_C(7) << 48 | where));
	from.interface = 0;
	answer(31234, false);
	assert_true(aimed(0) == where);
	from.interface = 7;
	answer(31234, false);
	assert_true(aimed(0) == where);
	answers.routed = 0; /* the next search */
	answer(31234, false);
	assert_true(aimed(0) == (UINT64_C(7) << 48 | where));
}

static void an_old_device_answers_with_sixteen_bits(void **state)
{
	(void)state;
	answer(31234, true);
	assert_true(aimed(0) != 0);
}

static void nobody_else_is_aimed_at(void **state)
{
	(void)state;
	answer(31235, false);
	answer(0, false);
	for (int i = 0; i < 3; i++)
		assert_true(aimed(i) == 0);
}

static void a_device_that_answers_is_left_where_it_is(void **state)
{
	(void)state;
	atomic_store(&shared.wanted, 2);
	answer(31234, false);
	assert_true(aimed(0) == 0);
}

static void what_is_no_answer_is_ignored(void **state)
{
	uint8_t data[64];

	(void)state;
	memset(data, 0xff, sizeof(data));
	for (size_t length = 0; length <= sizeof(data); length++)
		finder_take(&config, &shared, found, &answers, data, length, &from);
	for (int i = 0; i < 3; i++)
		assert_true(aimed(i) == 0);
}

static struct discovery_report report;

static const char *why(uint64_t missing)
{
	static char text[FINDER_WHY];

	finder_why(&config, missing, &answers, &report, text);
	return text;
}

/* Whoever reads it sees where to look: at a number, an address, or a firewall. */
static void the_log_says_where_it_asked_and_who_answered(void **state)
{
	(void)state;
	memset(&report, 0, sizeof(report));
	strcpy(config.device[0].name, "mill");
	strcpy(config.device[1].name, "panel");
	assert_string_equal(why(1), "mill (serial 31234): not found by a search: no interface but "
				    "loopback is up and has an IPv4 address");
	report.networks = 2;
	report.network[0] = (struct discovery_network){
		.own = { .address = 0x0a090901, .prefix = 24, .interface = 1 },
	};
	report.network[1] = (struct discovery_network){
		.own = { .address = 0x0a070001, .prefix = 30, .interface = 1 },
		.error = -EOPNOTSUPP,
	};
	answer(20007, false);
	answer(20005, false);
	answer(20007, false);
	answer(31234, false);
	assert_string_equal(why(1),
			    "mill (serial 31234): not found by a search at lo (10.9.9.1/24)"
			    ", lo (10.7.0.1/30, not asked: it cannot send broadcasts); answers "
			    "came from serial 20005, 20007; if one of them is meant, correct serial"
			    " in pokeysd.conf and restart pokeysd");
	for (int i = 0; i < 2; i++)
		for (uint32_t serial = 20010; serial >= 20005; serial--)
			answer(serial, false);
	assert_int_equal(answers.ours, 1);
	assert_string_equal(why(3),
			    "mill (serial 31234), panel (serial 70000): not found by a "
			    "search at lo (10.9.9.1/24), lo (10.7.0.1/30, not asked: it cannot "
			    "send broadcasts); answers came from serial 20005, 20006, 20007, 20008 "
			    "and others; if one of them is meant, correct serial in pokeysd.conf "
			    "and restart pokeysd");
}

/* By a clock of the test's; each line is one datagram. */
static void a_cause_that_changes_does_not_fill_the_log(void **state)
{
	const uint64_t second = UINT64_C(1000000000);
	static struct finder finder = {
		.teller = &teller,
		.running = true,
		.lock = PTHREAD_MUTEX_INITIALIZER,
	};
	unsigned int lines = 0;
	char line[256];
	int ends[2];

	(void)state;
	assert_int_equal(socketpair(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0, ends), 0);
	log_open(ends[1], EVENT_DEBUG);
	for (unsigned int i = 0; i < 130; i++) {
		snprintf(finder.why, sizeof(finder.why), "%s", i % 2 ? "answers" : "none");
		finder_report(&finder, 1000 * second + i * second);
		lines += read(ends[0], line, sizeof(line)) > 0;
	}
	log_open(STDERR_FILENO, EVENT_DEBUG);
	assert_int_equal(lines, 3 * 3);
	close(ends[0]);
	close(ends[1]);
}

static void a_line_of_any_length_fits(void **state)
{
	(void)state;
	report.networks = ADDRESSES_OWN_MAX;
	config.devices = TRANSPORT_CHANNELS;
	for (int i = 0; i < ADDRESSES_OWN_MAX; i++)
		report.network[i].own.address = UINT32_MAX;
	for (uint32_t i = 0; i < config.devices; i++) {
		memset(config.device[i].name, 'm', sizeof(config.device[i].name) - 1);
		config.device[i].serial = UINT32_MAX;
	}
	assert_in_range(strlen(why(UINT64_MAX)), 100, FINDER_WHY - 1);
	assert_non_null(strstr(why(UINT64_MAX), " and 60 more: not found by a search"));
	assert_non_null(strstr(why(UINT64_MAX), "whether this computer drops the answer"));
}

static void no_thread_is_made_without_serial_numbers(void **state)
{
	struct finder finder;

	(void)state;
	config.device[0].serial = 0;
	config.device[1].serial = 0;
	assert_int_equal(finder_start(&finder, &teller, &shared), 0);
	assert_false(finder.running);
	finder_stop(&finder);
}

#define TEST(name) cmocka_unit_test_setup(name, setup)

int main(void)
{
	const struct CMUnitTest tests[] = {
		TEST(the_device_is_where_its_answer_came_from),
		TEST(the_way_of_its_route_needs_no_interface),
		TEST(an_old_device_answers_with_sixteen_bits),
		TEST(nobody_else_is_aimed_at),
		TEST(a_device_that_answers_is_left_where_it_is),
		TEST(what_is_no_answer_is_ignored),
		TEST(the_log_says_where_it_asked_and_who_answered),
		TEST(a_cause_that_changes_does_not_fill_the_log),
		TEST(a_line_of_any_length_fits),
		TEST(no_thread_is_made_without_serial_numbers),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
