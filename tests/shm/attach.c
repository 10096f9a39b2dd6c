/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Attach, read, command, detach; reader first; one commander, one daemon.
 */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "tests/shm/folder.h"

static void state_goes_from_host_to_client(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client = folder_client(folder, 0);
	struct pokeys_state in, out;

	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	folder_pattern(&in, 41);
	shm_device_write(mill, &in);
	assert_int_equal(pokeys_client_read(client, &out), 0);
	assert_true(folder_pattern_whole(&out));
	assert_int_equal(out.cycle, 41);
	assert_int_equal(out.magic, POKEYS_STATE_MAGIC);
	assert_int_equal(out.epoch, shm_host_epoch(host));
	pokeys_client_close(client);
	shm_host_close(host);
}

static void loan_is_published_by_commit_and_then_mirrored(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client = folder_client(folder, POKEYS_CLIENT_COMMANDER);
	pokeys_client *reader = folder_client(folder, 0);
	struct pokeys_state out;

	pokeys_client_poll(client);
	pokeys_client_poll(reader);
	for (uint64_t cycle = 1; cycle < 4; cycle++) {
		shm_device_prepare(mill);
		folder_pattern(shm_device_loan(mill), cycle);
		assert_int_equal(pokeys_client_read(client, &out), 0);
		assert_int_equal(out.cycle, cycle - 1);
		shm_device_commit(mill);
		assert_int_equal(pokeys_client_read(client, &out), 0);
		assert_int_equal(out.cycle, cycle);
		assert_true(folder_pattern_whole(&out));
		assert_int_equal(pokeys_client_read(reader, &out), 0);
		assert_int_equal(out.cycle, cycle - 1);
		shm_device_mirror(mill);
		assert_int_equal(pokeys_client_read(reader, &out), 0);
		assert_int_equal(out.cycle, cycle);
		assert_true(folder_pattern_whole(&out));
	}
	pokeys_client_close(client);
	pokeys_client_close(reader);
	shm_host_close(host);
}

static void before_the_first_cycle_the_device_is_searched(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client = folder_client(folder, 0);
	struct pokeys_state out;
	struct pokeys_diag diag;

	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	assert_int_equal(pokeys_client_read(client, &out), 0);
	assert_int_equal(out.link, POKEYS_LINK_SEARCHING);
	assert_int_equal(out.t_publish_ns, 0);
	assert_true(out.flags & POKEYS_STATE_STALE);
	assert_int_equal(pokeys_client_read_diag(client, &diag), 0);
	assert_int_equal(diag.magic, POKEYS_DIAG_MAGIC);
	pokeys_client_close(client);
	shm_host_close(host);
}

static void diag_goes_from_host_to_client(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client = folder_client(folder, 0);
	struct pokeys_diag in = { .cycle = 9 }, out;

	pokeys_client_poll(client);
	in.cycle_work.bucket[POKEYS_HISTOGRAM_BUCKETS - 1] = 77;
	shm_device_write_diag(mill, &in);
	assert_int_equal(pokeys_client_read_diag(client, &out), 0);
	assert_int_equal(out.cycle, 9);
	assert_int_equal(out.cycle_work.bucket[POKEYS_HISTOGRAM_BUCKETS - 1], 77);
	pokeys_client_close(client);
	shm_host_close(host);
}

static void command_goes_from_commander_to_host(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client = folder_client(folder, POKEYS_CLIENT_COMMANDER);
	struct pokeys_command in = { .heartbeat = 3 }, out;

	assert_int_equal(shm_device_read_command(mill, &out), 0);
	assert_int_equal(pokeys_client_write(client, &in), -ENOTCONN);
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	assert_int_equal(shm_device_read_command(mill, &out), 0);
	in.one_shot[63].value[7] = -5;
	assert_int_equal(pokeys_client_write(client, &in), 0);
	assert_int_equal(shm_device_read_command(mill, &out), 1);
	assert_int_equal(out.heartbeat, 3);
	assert_int_equal(out.one_shot[63].value[7], -5);
	assert_int_equal(out.magic, POKEYS_COMMAND_MAGIC);
	pokeys_client_close(client);
	shm_host_close(host);
}

static void a_new_commander_begins_with_nothing_written(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	struct pokeys_command command = { .heartbeat = 3 };
	pokeys_client *client;

	for (int i = 0; i < 3; i++) {
		client = folder_client(folder, POKEYS_CLIENT_COMMANDER);
		assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
		assert_int_equal(shm_device_read_command(mill, &command), 0);
		pokeys_client_write(client, &command);
		assert_int_equal(shm_device_read_command(mill, &command), 1);
		pokeys_client_close(client);
	}
	shm_host_close(host);
}

static void a_reader_may_not_command(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client = folder_client(folder, 0);
	struct pokeys_command command = { 0 };

	pokeys_client_poll(client);
	assert_int_equal(pokeys_client_write(client, &command), -EPERM);
	assert_int_equal(pokeys_client_wait(client, 0), -EPERM);
	pokeys_client_close(client);
	shm_host_close(host);
}

static void second_commander_is_refused_until_the_first_ends(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *first = folder_client(folder, POKEYS_CLIENT_COMMANDER);
	pokeys_client *second = folder_client(folder, POKEYS_CLIENT_COMMANDER);
	pokeys_client *reader = folder_client(folder, 0);

	pokeys_client_poll(first);
	pokeys_client_poll(reader);
	shm_host_maintain(host);
	assert_int_equal(shm_device_commanders(mill), 1);
	assert_int_equal(pokeys_client_commanders(reader), 1);
	assert_int_equal(pokeys_client_poll(second), POKEYS_CLIENT_REFUSED);
	assert_non_null(strstr(folder_status(folder, second),
			       "another commander holds device 'mill'"));
	assert_int_equal(pokeys_client_commanders(second), -ENOTCONN);
	pokeys_client_close(first);
	shm_host_maintain(host);
	assert_int_equal(pokeys_client_commanders(reader), 0);
	assert_int_equal(pokeys_client_poll(second), POKEYS_CLIENT_ATTACHED);
	pokeys_client_close(second);
	pokeys_client_close(reader);
	shm_host_close(host);
}

static void second_daemon_is_refused_by_name(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	struct shm_host *other;
	char who[48];

	assert_int_equal(shm_host_open(&other, folder->path, NULL, NULL, folder->why,
				       sizeof(folder->why)),
			 -EBUSY);
	snprintf(who, sizeof(who), "another pokeysd (pid %ld)", (long)getpid());
	assert_non_null(strstr(folder->why, who));
	shm_host_close(host);
	host = folder_host_mill(folder, &mill);
	shm_host_close(host);
}

static void reader_may_come_before_the_daemon(void **state)
{
	struct folder *folder = *state;
	pokeys_client *client = folder_client(folder, 0);
	struct shm_device *mill;
	struct shm_host *host;
	struct pokeys_state out;

	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_DETACHED);
	assert_non_null(strstr(folder_status(folder, client), "is pokeysd running?"));
	assert_int_equal(pokeys_client_read(client, &out), -ENOTCONN);
	host = folder_host_mill(folder, &mill);
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	assert_int_equal(pokeys_client_read(client, &out), 0);
	shm_host_close(host);
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_DETACHED);
	assert_int_equal(pokeys_client_read(client, &out), -ENOTCONN);
	pokeys_client_close(client);
}

static void notification_wakes_who_waits(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client = folder_client(folder, POKEYS_CLIENT_EVENTS);

	assert_int_equal(pokeys_client_wait(client, 0), -ENOTCONN);
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	assert_int_equal(pokeys_client_wait(client, 1), 0);
	shm_device_notify(mill);
	assert_int_equal(pokeys_client_wait(client, 10000), 1);
	pokeys_client_close(client);
	shm_device_notify(mill);
	shm_host_close(host);
}

static void devices_are_listed_and_kept_apart(void **state)
{
	static const char *const names[] = { "mill", "lathe-2", "A_z", NULL };
	struct folder *folder = *state;
	struct shm_device *devices[3];
	struct shm_host *host = folder_host(folder, devices, names);
	pokeys_client *client = folder_client(folder, 0);
	char found[2][POKEYS_SHM_NAME_MAX];
	struct pokeys_state image = { .cycle = 5 };

	pokeys_client_poll(client);
	shm_device_write(devices[1], &image);
	assert_int_equal(pokeys_client_read(client, &image), 0);
	assert_int_equal(image.cycle, 0);
	assert_int_equal(pokeys_shm_devices(folder->path, found, 2), 3);
	assert_string_equal(found[0], "mill");
	assert_string_equal(found[1], "lathe-2");
	pokeys_client_close(client);
	shm_host_close(host);
	assert_int_equal(pokeys_shm_devices(folder->path, found, 2), 0);
}

static void unknown_device_is_refused_by_name(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client;

	assert_int_equal(pokeys_client_open(&client, folder->path, "lathe", "test", 0), 0);
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_REFUSED);
	assert_string_equal(folder_status(folder, client),
			    "the daemon has no device 'lathe'; it has: mill");
	pokeys_client_close(client);
	shm_host_close(host);
}

static void names_that_cannot_be_are_refused(void **state)
{
	static const char *const bad[] = { "",    "a/b",    "..",
					   "a b", "mill\n", "a234567890123456789012345678901-",
					   NULL };
	struct folder *folder = *state;
	struct shm_device *mill, *other;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client;

	for (size_t i = 0; bad[i]; i++) {
		assert_int_equal(pokeys_client_open(&client, folder->path, bad[i], "test", 0),
				 -EINVAL);
		assert_int_equal(shm_host_add(host, bad[i], &other, folder->why,
					      sizeof(folder->why)),
				 -EINVAL);
	}
	assert_int_equal(pokeys_client_open(&client, "run", "mill", "test", 0), -EINVAL);
	assert_int_equal(pokeys_client_open(&client, folder->path, "mill", "test", 1u << 9),
			 -EINVAL);
	shm_host_close(host);
}

int main(void)
{
#define BOTH(name) cmocka_unit_test_setup_teardown(name, folder_begin, folder_end)
	const struct CMUnitTest tests[] = {
		BOTH(state_goes_from_host_to_client),
		BOTH(loan_is_published_by_commit_and_then_mirrored),
		BOTH(before_the_first_cycle_the_device_is_searched),
		BOTH(diag_goes_from_host_to_client),
		BOTH(command_goes_from_commander_to_host),
		BOTH(a_new_commander_begins_with_nothing_written),
		BOTH(a_reader_may_not_command),
		BOTH(second_commander_is_refused_until_the_first_ends),
		BOTH(second_daemon_is_refused_by_name),
		BOTH(reader_may_come_before_the_daemon),
		BOTH(notification_wakes_who_waits),
		BOTH(devices_are_listed_and_kept_apart),
		BOTH(unknown_device_is_refused_by_name),
		BOTH(names_that_cannot_be_are_refused),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
