/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The two images for the device's settings: the report, written by the daemon
 * now and then, and the wish, written by the commander now and then. Both are
 * read much more often than they are written, so the daemon's reader says
 * "nothing new" without a copy, and must not thereby lose a write.
 */
#include <errno.h>
#include <signal.h>
#include <string.h>
#include "shm/host_private.h"
#include "tests/shm/folder.h"

struct pair {
	struct folder *folder;
	struct shm_device *mill;
	struct shm_host *host;
	pokeys_client *client;
};

static void begin(struct pair *pair, void **state)
{
	pair->folder = *state;
	pair->host = folder_host_mill(pair->folder, &pair->mill);
	pair->client = folder_client(pair->folder, POKEYS_CLIENT_COMMANDER);
	assert_int_equal(pokeys_client_poll(pair->client), POKEYS_CLIENT_ATTACHED);
}

static void end(struct pair *pair)
{
	pokeys_client_close(pair->client);
	shm_host_close(pair->host);
}

static void first_report_is_whole_and_knows_nothing(void **state)
{
	struct pokeys_report report;
	struct pair pair;

	begin(&pair, state);
	assert_int_equal(pokeys_client_read_report(pair.client, &report), 0);
	assert_int_equal(report.state, POKEYS_CONFIG_UNKNOWN);
	assert_int_equal(report.generation, 0);
	assert_int_equal(report.device.set, 0);
	assert_true(report.epoch == shm_host_epoch(pair.host));
	end(&pair);
}

static void report_is_read_as_it_was_written(void **state)
{
	struct pokeys_report written, report;
	struct pair pair;

	begin(&pair, state);
	for (unsigned int i = 0; i < 5; i++) {
		memset(&written, (int)i + 1, sizeof(written));
		shm_device_write_report(pair.mill, &written);
		assert_int_equal(pokeys_client_read_report(pair.client, &report), 0);
		assert_memory_equal(&report.device, &written.device, sizeof(report.device));
		assert_memory_equal(&report.wanted, &written.wanted, sizeof(report.wanted));
		assert_int_equal(report.magic, POKEYS_REPORT_MAGIC);
		assert_int_equal(report.count, written.count);
	}
	end(&pair);
}

static void wish_is_news_once(void **state)
{
	struct pokeys_wish wish = { .session = 7, .generation = 1 };
	struct pokeys_wish out;
	struct pair pair;

	begin(&pair, state);
	assert_int_equal(shm_device_read_wish(pair.mill, &out), 0);
	wish.settings.axis[7].max_speed = 25000.0f;
	assert_int_equal(pokeys_client_write_wish(pair.client, &wish), 0);
	assert_int_equal(shm_device_read_wish(pair.mill, &out), 1);
	assert_int_equal(out.session, 7);
	assert_int_equal(out.generation, 1);
	assert_memory_equal(&out.settings, &wish.settings, sizeof(wish.settings));
	for (int i = 0; i < 3; i++)
		assert_int_equal(shm_device_read_wish(pair.mill, &out), 0);
	end(&pair);
}

static void newest_of_many_wishes_is_read(void **state)
{
	struct pokeys_wish wish = { .session = 7 };
	struct pokeys_wish out;
	struct pair pair;

	begin(&pair, state);
	for (unsigned int i = 1; i <= 10; i++) {
		for (unsigned int j = 0; j < i; j++) {
			wish.generation++;
			assert_int_equal(pokeys_client_write_wish(pair.client, &wish), 0);
		}
		assert_int_equal(shm_device_read_wish(pair.mill, &out), 1);
		assert_int_equal(out.generation, wish.generation);
		assert_int_equal(shm_device_read_wish(pair.mill, &out), 0);
	}
	end(&pair);
}

static void only_an_attached_commander_may_wish(void **state)
{
	struct pokeys_wish wish = { .generation = 1 };
	struct pokeys_report report;
	pokeys_client *reader = folder_client(*state, 0);
	pokeys_client *early = folder_client(*state, POKEYS_CLIENT_COMMANDER);

	assert_int_equal(pokeys_client_write_wish(reader, &wish), -EPERM);
	assert_int_equal(pokeys_client_write_wish(early, &wish), -ENOTCONN);
	assert_int_equal(pokeys_client_read_report(early, &report), -ENOTCONN);
	pokeys_client_close(early);
	pokeys_client_close(reader);
}

static void wish_that_is_none_is_refused_once_and_out_untouched(void **state)
{
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(*state, &mill);
	struct iox_wish_writer *writer;
	struct pokeys_wish out, before;

	assert_int_equal(iox_wish_writer_open(host->node, "pokeys/mill/wish", &writer, NULL), 0);
	memset(&before, 0x5a, sizeof(before));
	for (int how = 0; how < 4; how++) {
		struct pokeys_wish *cell = iox_wish_loan(writer);

		memset(cell, how, sizeof(*cell));
		cell->magic = how == 1 ? 0 : POKEYS_WISH_MAGIC;
		cell->version = how == 2 ? 9 : POKEYS_WISH_VERSION;
		cell->size_units = sizeof(*cell) / 8;
		cell->hash = how == 3 ? 1 : how == 0 ? 0 : POKEYS_WISH_HASH;
		iox_wish_commit(writer);
		out = before;
		assert_int_equal(shm_device_read_wish(mill, &out), -EPROTO);
		assert_int_equal(shm_device_read_wish(mill, &out), 0);
		assert_memory_equal(&out, &before, sizeof(out));
	}
	iox_wish_writer_close(writer);
	shm_host_close(host);
}

static void foreign_report_is_refused_and_out_untouched(void **state)
{
	struct pokeys_report out, before;
	struct pokeys_report *cell;
	struct pair pair;

	begin(&pair, state);
	memset(&before, 0x5a, sizeof(before));
	cell = iox_report_loan(pair.mill->report);
	memset(cell, 0xa5, sizeof(*cell));
	iox_report_commit(pair.mill->report);
	out = before;
	assert_int_equal(pokeys_client_read_report(pair.client, &out), -EPROTO);
	assert_memory_equal(&out, &before, sizeof(out));
	end(&pair);
}

/* A commander that is killed leaves marks in both images; the next one gets both. */
static void wish_of_a_killed_commander_is_forgotten(void **state)
{
	struct folder *folder = *state;
	struct pokeys_wish wish = { .session = 9, .generation = 1 };
	struct pokeys_wish out;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *client = folder_client(folder, POKEYS_CLIENT_COMMANDER);
	char said[256];

	folder_end_peer(folder_peer(folder, "commander", said), SIGKILL);
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_REFUSED);
	assert_int_equal(shm_host_maintain(host), 1);
	assert_int_equal(shm_device_read_wish(mill, &out), 0);
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	assert_int_equal(shm_device_read_wish(mill, &out), 0);
	assert_int_equal(pokeys_client_write_wish(client, &wish), 0);
	assert_int_equal(shm_device_read_wish(mill, &out), 1);
	assert_int_equal(out.session, 9);
	pokeys_client_close(client);
	shm_host_close(host);
}

/* Killed between wish and report: the next daemon has no wish until it is written again. */
static void wish_ends_with_the_daemon_and_the_report_shows_it(void **state)
{
	struct folder *folder = *state;
	struct pokeys_wish wish = { .session = 9, .generation = 3 };
	struct pokeys_report report;
	struct pokeys_wish out;
	struct shm_device *mill;
	struct shm_host *host;
	pokeys_client *client = folder_client(folder, POKEYS_CLIENT_COMMANDER);
	char said[256];
	pid_t daemon = folder_peer(folder, "host", said);
	uint64_t epoch;

	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	assert_int_equal(pokeys_client_read_report(client, &report), 0);
	epoch = report.epoch;
	assert_int_equal(pokeys_client_write_wish(client, &wish), 0);
	folder_end_peer(daemon, SIGKILL);
	assert_int_equal(pokeys_client_write_wish(client, &wish), 0); /* to nobody */
	assert_int_equal(pokeys_client_read_report(client, &report), 0);
	host = folder_host_mill(folder, &mill);
	assert_int_equal(pokeys_client_poll(client), POKEYS_CLIENT_ATTACHED);
	assert_int_equal(shm_device_read_wish(mill, &out), 0);
	assert_int_equal(pokeys_client_read_report(client, &report), 0);
	assert_true(report.epoch != epoch);
	assert_int_equal(report.generation, 0);
	assert_int_equal(pokeys_client_write_wish(client, &wish), 0);
	assert_int_equal(shm_device_read_wish(mill, &out), 1);
	assert_int_equal(out.generation, 3);
	pokeys_client_close(client);
	shm_host_close(host);
}

static void library_tells_the_hash_of_each_image(void **state)
{
	(void)state;
	assert_true(pokeys_shm_layout(POKEYS_SHM_REPORT) == POKEYS_REPORT_HASH);
	assert_true(pokeys_shm_layout(POKEYS_SHM_WISH) == POKEYS_WISH_HASH);
	assert_true(pokeys_shm_layout(POKEYS_SHM_IMAGES) == 0);
}

int main(void)
{
#define BOTH(name) cmocka_unit_test_setup_teardown(name, folder_begin, folder_end)
	const struct CMUnitTest tests[] = {
		BOTH(first_report_is_whole_and_knows_nothing),
		BOTH(report_is_read_as_it_was_written),
		BOTH(wish_is_news_once),
		BOTH(newest_of_many_wishes_is_read),
		BOTH(only_an_attached_commander_may_wish),
		BOTH(wish_that_is_none_is_refused_once_and_out_untouched),
		BOTH(foreign_report_is_refused_and_out_untouched),
		BOTH(wish_of_a_killed_commander_is_forgotten),
		BOTH(wish_ends_with_the_daemon_and_the_report_shows_it),
		cmocka_unit_test(library_tells_the_hash_of_each_image),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
