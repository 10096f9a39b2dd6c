/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A thread of the library commands for a program, as long as that renews its lease.
 */
#include <errno.h>
#include <string.h>
#include "shm/client_private.h"
#include "tests/shm/folder.h"

enum { PERIOD_MS = 2, LONG_MS = 60000, SHORT_MS = 50 };

static uint64_t heartbeat(struct shm_device *mill)
{
	struct pokeys_command command = { 0 };

	assert_true(shm_device_read_command(mill, &command) >= 0);
	return command.heartbeat;
}

/* Until it beats; gives up after a minute. */
static void await_beats(struct shm_device *mill, uint64_t more)
{
	const uint64_t before = heartbeat(mill);

	for (int i = 0; i < 60000 && heartbeat(mill) < before + more; i++)
		folder_sleep_ms(1);
	assert_true(heartbeat(mill) >= before + more);
}

/* Until it has not beaten for a hundred periods. */
static void await_silence(struct shm_device *mill)
{
	uint64_t last = heartbeat(mill);
	int still = 0;

	for (int i = 0; i < 60000 && still < 100 * PERIOD_MS; i++) {
		folder_sleep_ms(1);
		still = heartbeat(mill) == last ? still + 1 : 0;
		last = heartbeat(mill);
	}
	assert_true(still >= 100 * PERIOD_MS);
}

static void a_command_is_held_with_new_heartbeats(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client = folder_client(folder, POKEYS_CLIENT_COMMANDER);
	struct pokeys_command command = { .flags = POKEYS_COMMAND_LIMIT_OVERRIDE }, first, now;

	assert_int_equal(pokeys_client_command(client, &command), -ENOTCONN);
	assert_int_equal(pokeys_client_renew(client), -ENOTCONN);
	assert_int_equal(pokeys_client_hold(client, PERIOD_MS, LONG_MS), 0);
	command.digital_out[2] = 0x81;
	assert_int_equal(pokeys_client_command(client, &command), 0);
	await_beats(mill, 10);
	assert_int_equal(shm_device_read_command(mill, &first), 1);
	assert_int_equal(first.digital_out[2], 0x81);
	assert_int_equal(first.flags, POKEYS_COMMAND_LIMIT_OVERRIDE);
	assert_int_equal(first.period_ns, PERIOD_MS * 1000000);
	assert_int_not_equal(first.session, 0);
	command.digital_out[2] = 0x42;
	assert_int_equal(pokeys_client_command(client, &command), 0);
	await_beats(mill, 10);
	assert_int_equal(shm_device_read_command(mill, &now), 1);
	assert_int_equal(now.digital_out[2], 0x42);
	assert_int_equal(now.session, first.session);
	assert_true(now.t_ns > first.t_ns);
	assert_int_equal(pokeys_client_write(client, &command), -EBUSY);
	pokeys_client_close(client);
	assert_int_equal(shm_device_commanders(mill), 0);
	shm_host_close(host);
}

/* The program hangs; what it is told when it goes on. */
static void without_renewal_nothing_is_written(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client = folder_client(folder, POKEYS_CLIENT_COMMANDER);
	struct pokeys_command command = { 0 };

	assert_int_equal(pokeys_client_hold(client, PERIOD_MS, SHORT_MS), 0);
	for (int round = 0; round < 3; round++) {
		const uint64_t before = heartbeat(mill);

		/* the lease may be over before the first beat, where everything is slow */
		do {
			pokeys_client_command(client, &command);
			folder_sleep_ms(10);
		} while (heartbeat(mill) == before);
		await_silence(mill);
		assert_int_equal(pokeys_client_renew(client), 1);
		assert_int_equal(pokeys_client_renew(client), 1); /* it renews nothing */
		await_silence(mill);
	}
	pokeys_client_close(client);
	shm_host_close(host);
}

static void a_renewed_command_goes_on(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client = folder_client(folder, POKEYS_CLIENT_COMMANDER);
	struct pokeys_command command = { 0 };

	assert_int_equal(pokeys_client_hold(client, PERIOD_MS, LONG_MS), 0);
	assert_int_equal(pokeys_client_command(client, &command), 0);
	for (int i = 0; i < 20; i++) {
		const uint64_t before = client->holder.renewed_ns;

		await_beats(mill, 5);
		assert_int_equal(pokeys_client_renew(client), 0);
		assert_true(client->holder.renewed_ns > before);
	}
	pokeys_client_close(client);
	shm_host_close(host);
}

/* The next daemon has to treat its outputs as after a loss. */
static void the_next_daemon_is_told_that_it_is_not_the_first(void **state)
{
	struct folder *folder = *state;
	pokeys_client *client = folder_client(folder, POKEYS_CLIENT_COMMANDER);
	struct pokeys_command command = { 0 }, now;
	struct shm_device *mill;
	struct shm_host *host;

	assert_int_equal(pokeys_client_hold(client, PERIOD_MS, LONG_MS), 0);
	assert_int_equal(pokeys_client_command(client, &command), 0);
	for (int i = 0; i < 3; i++) {
		host = folder_host_mill(folder, &mill);
		if (i) {
			/* nothing is commanded again by itself */
			while (pokeys_client_poll(client) != POKEYS_CLIENT_ATTACHED)
				folder_sleep_ms(1);
			folder_sleep_ms(20 * PERIOD_MS);
			assert_int_equal(heartbeat(mill), 0);
			assert_int_equal(pokeys_client_renew(client), 1);
			assert_int_equal(pokeys_client_command(client, &command), 1);
		}
		await_beats(mill, 5);
		assert_int_equal(shm_device_read_command(mill, &now), 1);
		assert_int_equal(now.flags, i ? POKEYS_COMMAND_RESUMED : 0);
		shm_host_close(host);
		while (pokeys_client_poll(client) == POKEYS_CLIENT_ATTACHED)
			folder_sleep_ms(1);
		folder_sleep_ms(20 * PERIOD_MS);
	}
	pokeys_client_close(client);
}

static void wrong_use_is_refused(void **state)
{
	struct folder *folder = *state;
	pokeys_client *reader = folder_client(folder, 0);
	pokeys_client *client = folder_client(folder, POKEYS_CLIENT_COMMANDER);

	assert_int_equal(pokeys_client_hold(reader, 10, 1000), -EPERM);
	assert_int_equal(pokeys_client_hold(client, 0, 1000), -EINVAL);
	assert_int_equal(pokeys_client_hold(client, 1001, 1000), -EINVAL);
	assert_int_equal(pokeys_client_hold(client, 10, 9), -EINVAL);
	assert_int_equal(pokeys_client_hold(client, 10, 60001), -EINVAL);
	assert_int_equal(pokeys_client_hold(client, 10, 1000), 0);
	assert_int_equal(pokeys_client_hold(client, 10, 1000), -EALREADY);
	assert_int_equal(pokeys_client_follow(client, 10), -EBUSY);
	pokeys_client_close(client);
	client = folder_client(folder, POKEYS_CLIENT_COMMANDER);
	assert_int_equal(pokeys_client_follow(client, 10), 0);
	assert_int_equal(pokeys_client_hold(client, 10, 1000), -EBUSY);
	pokeys_client_close(client);
	pokeys_client_close(reader);
}

int main(void)
{
#define BOTH(name) cmocka_unit_test_setup_teardown(name, folder_begin, folder_end)
	const struct CMUnitTest tests[] = {
		BOTH(a_command_is_held_with_new_heartbeats),
		BOTH(without_renewal_nothing_is_written),
		BOTH(a_renewed_command_goes_on),
		BOTH(the_next_daemon_is_told_that_it_is_not_the_first),
		BOTH(wrong_use_is_refused),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
