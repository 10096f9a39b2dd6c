/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What the realtime thread writes into the ring comes out again whole and in
 * order, whoever reads it and whenever; and a file that is none is refused.
 */
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>
#include <cmocka.h>
#include "daemon/recorder/read.h"

enum { SLOTS = 4096 };

static char folder[64], path[96];
static struct recorder recorder;
static struct recorder_file file;

static int begin(void **state)
{
	char why[128];

	(void)state;
	strcpy(folder, "/tmp/pokeysd-test-ring.XXXXXX");
	assert_non_null(mkdtemp(folder));
	snprintf(path, sizeof(path), "%s/recorder", folder);
	assert_int_equal(recorder_create(&recorder, path, SLOTS), 0);
	assert_int_equal(recorder_open(&file, path, why, sizeof(why)), 0);
	return 0;
}

static int end(void **state)
{
	(void)state;
	recorder_release(&file);
	recorder_close(&recorder);
	unlink(path);
	rmdir(folder);
	return 0;
}

/*
 * A slot whose every byte follows from its number. The operation of its packet is 0 whatever the
 * number, because the recorder leaves out what follows that of a password.
 */
static void put(uint64_t number)
{
	const struct recorder_slot slot = {
		.t_ns = number * 3,
		.taken_ns = number * 5,
		.kind = RECORDER_SENT,
		.cycle = (uint32_t)number,
	};
	uint64_t data[RECORDER_DATA / 8];

	for (size_t i = 0; i < RECORDER_DATA / 8; i++)
		data[i] = number << 16 | i;
	recorder_write(&recorder, &slot, data, sizeof(data));
}

static void assert_whole(const struct recorder_slot *slot)
{
	uint64_t data[RECORDER_DATA / 8];

	memcpy(data, slot->data, sizeof(data));
	assert_int_equal(slot->t_ns, slot->number * 3);
	assert_int_equal(slot->taken_ns, slot->number * 5);
	assert_int_equal(slot->cycle, (uint32_t)slot->number);
	for (size_t i = 0; i < RECORDER_DATA / 8; i++)
		assert_int_equal(data[i], slot->number << 16 | i);
}

static void what_is_written_comes_out_in_order(void **state)
{
	static struct recorder_slot out[SLOTS];
	uint64_t next = 0;

	(void)state;
	assert_int_equal(recorder_read(&file, &next, out, SLOTS), 0);
	for (uint64_t i = 0; i < 10; i++)
		put(i);
	assert_int_equal(recorder_written(&file), 10);
	assert_int_equal(recorder_read(&file, &next, out, 4), 4);
	assert_int_equal(recorder_read(&file, &next, out + 4, SLOTS), 6);
	assert_int_equal(next, 10);
	for (uint64_t i = 0; i < 10; i++) {
		assert_int_equal(out[i].number, i);
		assert_whole(&out[i]);
	}
}

static void only_the_last_round_is_there(void **state)
{
	static struct recorder_slot out[SLOTS];
	uint64_t next = 0;
	size_t count = 0, n;

	(void)state;
	for (uint64_t i = 0; i < 3 * SLOTS + 7; i++)
		put(i);
	while ((n = recorder_read(&file, &next, out, SLOTS))) {
		for (size_t i = 0; i < n; i++) {
			assert_int_equal(out[i].number, 2 * SLOTS + 8 + count + i);
			assert_whole(&out[i]);
		}
		count += n;
	}
	assert_int_equal(count, SLOTS - 1); /* the oldest may be overwritten any moment */
	assert_int_equal(next, 3 * SLOTS + 7);
}

static _Atomic bool stop;

static void *write_on(void *argument)
{
	const struct timespec moment = { .tv_nsec = 1000 };

	(void)argument;
	for (uint64_t i = 0; !stop; i++) {
		put(i);
		if (i % 512 == 511) /* or it would always be a round ahead of who reads */
			nanosleep(&moment, NULL);
	}
	return NULL;
}

static void reading_while_it_is_written_finds_whole_slots_only(void **state)
{
	struct recorder_slot out[64];
	uint64_t next = 0, last = 0, seen = 0;
	pthread_t thread;

	(void)state;
	stop = false;
	assert_int_equal(pthread_create(&thread, NULL, write_on, NULL), 0);
	while (seen < 20000) {
		size_t n = recorder_read(&file, &next, out, 64);

		for (size_t i = 0; i < n; i++) {
			assert_whole(&out[i]);
			assert_true(!seen || out[i].number > last);
			last = out[i].number;
			seen++;
		}
	}
	stop = true;
	pthread_join(thread, NULL);
}

static void a_recorder_that_is_off_takes_everything(void **state)
{
	struct recorder off = { 0 };
	const struct recorder_slot slot = { 0 };

	(void)state;
	recorder_write(&off, &slot, "x", 1);
}

static void a_long_datagram_is_cut_and_its_length_kept(void **state)
{
	const struct recorder_slot slot = { .length = 2000, .kind = RECORDER_RECEIVED };
	uint8_t data[2000];
	struct recorder_slot out;
	uint64_t next = 0;

	(void)state;
	memset(data, 7, sizeof(data));
	recorder_write(&recorder, &slot, data, sizeof(data));
	put(1);
	assert_int_equal(recorder_read(&file, &next, &out, 1), 1);
	assert_int_equal(out.length, 2000);
	assert_int_equal(out.data[RECORDER_DATA - 1], 7);
	assert_int_equal(recorder_read(&file, &next, &out, 1), 1);
	assert_whole(&out);
}

static void an_event_is_kept_as_it_is(void **state)
{
	const struct event event = { .t_ns = 77, .code = EVENT_LINK, .device = 3, .a = -5 };
	struct recorder_slot out;
	uint64_t next = 0;

	(void)state;
	recorder_tap(&recorder, &event);
	assert_int_equal(recorder_read(&file, &next, &out, 1), 1);
	assert_int_equal(out.kind, RECORDER_EVENT);
	assert_int_equal(out.device, 3);
	assert_int_equal(out.t_ns, 77);
	assert_memory_equal(out.data, &event, sizeof(event));
}

static int open_again(char *why, size_t size)
{
	recorder_release(&file);
	return recorder_open(&file, path, why, size);
}

static void what_is_no_record_is_refused(void **state)
{
	char why[128] = "";

	(void)state;
	recorder.head->slots = SLOTS + 300;
	assert_int_equal(open_again(why, sizeof(why)), -EPROTO);
	assert_non_null(strstr(why, "damaged"));
	recorder.head->slots = 2 * SLOTS;
	assert_int_equal(open_again(why, sizeof(why)), -EPROTO);
	recorder.head->slots = SLOTS;
	recorder.head->version++;
	assert_int_equal(open_again(why, sizeof(why)), -EPROTO);
	assert_non_null(strstr(why, "another version"));
	recorder.head->version--;
	recorder.head->magic[0] = 'X';
	assert_int_equal(open_again(why, sizeof(why)), -EPROTO);
	assert_int_equal(truncate(path, 10), 0);
	assert_int_equal(open_again(why, sizeof(why)), -EPROTO);
	unlink(path);
	assert_int_equal(open_again(why, sizeof(why)), -ENOENT);
	assert_non_null(strstr(why, path));
}

static void a_slot_of_another_number_is_left_out(void **state)
{
	static struct recorder_slot out[SLOTS];
	uint64_t next = 0;

	(void)state;
	for (uint64_t i = 0; i < 5; i++)
		put(i);
	recorder.slot[2].number = 99;
	assert_int_equal(recorder_read(&file, &next, out, SLOTS), 4);
	assert_int_equal(out[2].number, 3);
}

static int interrupted; /* so many times more */

int __real_posix_fallocate64(int fd, off_t from, off_t length);
int __wrap_posix_fallocate64(int fd, off_t from, off_t length);

/* As older kernels (6.1) do in a folder in memory when a signal comes. */
int __wrap_posix_fallocate64(int fd, off_t from, off_t length)
{
	return interrupted-- > 0 ? EINTR : __real_posix_fallocate64(fd, from, length);
}

static void a_signal_does_not_keep_the_file_from_being_made(void **state)
{
	(void)state;
	recorder_close(&recorder);
	interrupted = 3;
	assert_int_equal(recorder_create(&recorder, path, SLOTS), 0);
	assert_int_equal(interrupted, -1);
}

/* In requests that set or prove one; the first 8 bytes, with the level, stay. */
static void passwords_are_not_recorded(void **state)
{
	static const struct {
		uint8_t operation, kind, kept;
	} tried[] = {
		{ 0xE2, RECORDER_SENT, 8 },
		{ 0xE3, RECORDER_SENT, 8 },
		/* whatever a device repeats of the request */
		{ 0xE2, RECORDER_RECEIVED, 9 },
		{ 0xE3, RECORDER_RECEIVED, 9 },
		{ 0xE1, RECORDER_SENT, 64 },
		{ 0xE1, RECORDER_RECEIVED, 64 },
	};
	struct recorder_slot out;
	uint64_t next = 0;

	(void)state;
	for (size_t i = 0; i < sizeof(tried) / sizeof(*tried); i++) {
		const struct recorder_slot slot = { .kind = tried[i].kind, .length = 64 };
		uint8_t packet[64];

		memset(packet, 0x5A, sizeof(packet));
		packet[0] = 0xBB;
		packet[1] = tried[i].operation;
		recorder_write(&recorder, &slot, packet, sizeof(packet));
		assert_int_equal(recorder_read(&file, &next, &out, 1), 1);
		assert_memory_equal(out.data, packet, tried[i].kept);
		for (size_t at = tried[i].kept; at < sizeof(packet); at++)
			assert_int_equal(out.data[at], 0);
	}
}

int main(void)
{
#define TEST(name) cmocka_unit_test_setup_teardown(name, begin, end)
	const struct CMUnitTest tests[] = {
		TEST(what_is_written_comes_out_in_order),
		TEST(only_the_last_round_is_there),
		TEST(reading_while_it_is_written_finds_whole_slots_only),
		TEST(a_recorder_that_is_off_takes_everything),
		TEST(a_long_datagram_is_cut_and_its_length_kept),
		TEST(passwords_are_not_recorded),
		TEST(an_event_is_kept_as_it_is),
		TEST(what_is_no_record_is_refused),
		TEST(a_slot_of_another_number_is_left_out),
		TEST(a_signal_does_not_keep_the_file_from_being_made),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
