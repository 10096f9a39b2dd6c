// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * One device, one daemon, one section: who comes second is told who was first, and
 * takes over. Two daemons are two structs here; a name is had by a socket, not by a
 * process. Without the claim both would be aimed.
 */
#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <unistd.h>
#include <cmocka.h>
#include "daemon/control/claim.h"
#include "daemon/control/log.h"

#define MS UINT64_C(1000000)

static struct config config;
static const struct teller teller = { .config = &config };
static struct loop_shared shared[2];
static struct claims one, other;
static _Atomic uint64_t found[TRANSPORT_CHANNELS];
static uint64_t now;
static int said;
static char text[4096];

/* An address that no other test on this machine has. */
static uint32_t any_address(void)
{
	uint32_t random = 0;

	assert_int_equal(getrandom(&random, sizeof(random), 0), sizeof(random));
	return 0x0a000000u | (random & 0x00ffffffu);
}

static int setup(void **state)
{
	char name[] = "/tmp/pokeysd-claim-XXXXXX";

	(void)state;
	memset(&config, 0, sizeof(config));
	memset(shared, 0, sizeof(shared));
	memset((void *)found, 0, sizeof(found));
	config.devices = 2;
	strcpy(config.device[0].name, "mill");
	strcpy(config.device[1].name, "lathe");
	config.device[0].address = any_address();
	config.device[0].port = config.device[1].port = 20055;
	config.device[1].serial = 7;
	claims_init(&one, &teller, &shared[0]);
	claims_init(&other, &teller, &shared[1]);
	now = 1000 * MS;
	said = mkstemp(name);
	unlink(name);
	log_open(said, EVENT_DEBUG);
	return said < 0;
}

static int teardown(void **state)
{
	(void)state;
	claims_close(&one);
	claims_close(&other);
	close(said);
	return 0;
}

static const char *log_text(void)
{
	ssize_t length = pread(said, text, sizeof(text) - 1, 0);

	text[length > 0 ? length : 0] = '\0';
	return text;
}

static unsigned int count(const char *what)
{
	unsigned int n = 0;

	for (const char *at = log_text(); (at = strstr(at, what)); at++)
		n++;
	return n;
}

static uint64_t where(uint32_t address)
{
	return (uint64_t)address << 16 | 20055;
}

static void run(struct claims *claims)
{
	claims_run(claims, found, now);
}

static void what_is_free_is_aimed_at(void **state)
{
	(void)state;
	run(&one);
	assert_true(shared[0].address[0] == where(config.device[0].address));
	assert_true(shared[0].address[1] == 0);
	assert_string_equal(log_text(), "");
}

/* It is found again through another one: the same device. */
static void another_interface_to_it_keeps_the_claim(void **state)
{
	const uint64_t aside = where(config.device[0].address) | UINT64_C(7) << 48;

	(void)state;
	run(&one);
	atomic_store(&found[0], aside);
	run(&one);
	assert_true(shared[0].address[0] == aside);
	for (int i = 0; i < 30; i++, now += 20 * MS) {
		atomic_store(&found[0], i % 2 ? 0 : aside);
		run(&one);
		run(&other);
	}
	assert_true(shared[1].address[0] == 0);
	assert_true(shared[0].address[0] == where(config.device[0].address));
	assert_int_equal(count("another pokeysd"), 1);
	claims_close(&one);
	atomic_store(&found[0], aside);
	run(&other);
	assert_true(shared[1].address[0] == aside);
	assert_int_equal(count("the device is free"), 1);
	atomic_store(&found[0], 0);
}

static void second_daemon_is_told_who_was_first_and_takes_over(void **state)
{
	char expected[64];

	(void)state;
	run(&one);
	for (int i = 0; i < 30; i++, now += 20 * MS) {
		run(&other);
		run(&one);
	}
	assert_true(shared[1].address[0] == 0);
	assert_int_equal(shared[1].in_use, 1);
	assert_int_equal(shared[0].in_use, 0);
	snprintf(expected, sizeof(expected), "another pokeysd (process %d of user %u)",
		 (int)getpid(), (unsigned int)geteuid());
	assert_int_equal(count(expected), 1);
	assert_int_equal(count("mill: "), 1);
	claims_close(&one);
	now += 200 * MS;
	run(&other);
	assert_true(shared[1].address[0] == where(config.device[0].address));
	assert_int_equal(shared[1].in_use, 0);
	assert_int_equal(count("mill: the device is free"), 1);
}

/* Nobody answers it, and its queue is full: it is told all the same, without waiting. */
static void many_who_ask_find_out_or_go_on(void **state)
{
	static struct claims many[20];

	(void)state;
	run(&one);
	for (int i = 0; i < 20; i++) {
		claims_init(&many[i], &teller, &shared[1]);
		run(&many[i]);
	}
	assert_int_equal(count("is driven by another pokeysd"), 20);
	run(&one);
	run(&other);
	assert_true(shared[1].address[0] == 0);
	claims_close(&one);
	now += 200 * MS;
	run(&other);
	assert_true(shared[1].address[0] != 0);
}

static void two_sections_are_not_one_device(void **state)
{
	(void)state;
	found[1] = where(config.device[0].address);
	for (int i = 0; i < 30; i++, now += 20 * MS)
		run(&one);
	assert_true(shared[0].address[0] == where(config.device[0].address));
	assert_true(shared[0].address[1] == 0);
	assert_int_equal(count("lathe: "), 1);
	assert_int_equal(count("is that of [device mill]"), 1);
}

static void device_that_moves_gives_its_old_address_back(void **state)
{
	uint32_t first = any_address(), second = any_address();

	(void)state;
	found[1] = where(first);
	run(&one);
	assert_true(shared[0].address[1] == where(first));
	found[1] = where(second);
	run(&one);
	assert_true(shared[0].address[1] == where(second));
	found[1] = where(first);
	config.device[0].address = 0;
	run(&other);
	assert_true(shared[1].address[1] == where(first));
}

int main(void)
{
#define BOTH(name) cmocka_unit_test_setup_teardown(name, setup, teardown)
	const struct CMUnitTest tests[] = {
		BOTH(what_is_free_is_aimed_at),
		BOTH(another_interface_to_it_keeps_the_claim),
		BOTH(second_daemon_is_told_who_was_first_and_takes_over),
		BOTH(many_who_ask_find_out_or_go_on),
		BOTH(two_sections_are_not_one_device),
		BOTH(device_that_moves_gives_its_old_address_back),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
