/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * From the ring to a file and back: frames with right checksums, the order of
 * time, which reply belongs to which request; and files that are damaged, which
 * are refused or read as far as they go, and never lead anybody astray.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>
#include <pokeys/async.h>
#include <pokeys/state.h>
#include "daemon/recorder/export.h"
#include "daemon/recorder/pcapng.h"
#include "daemon/recorder/replay.h"
#include "daemon/recorder/unpack.h"
#include "daemon/transport/frame.h"
#include "wire/op.h"

#define WALL 1700000000000000000

static char path[] = "/tmp/pokeysd-test-files.XXXXXX";
static struct recorder recorder;
static struct recorder_file file;
static struct stations stations;
static char *bytes;
static size_t length;

static int begin(void **state)
{
	char why[128];
	int fd;

	(void)state;
	strcpy(path + sizeof(path) - 7, "XXXXXX");
	fd = mkstemp(path);
	assert_true(fd >= 0);
	close(fd);
	assert_int_equal(recorder_create(&recorder, path, RECORDER_SLOTS_MIN), 0);
	recorder.head->devices = 2;
	recorder.head->period_ns = 1000000;
	strcpy(recorder.head->name[0], "mill");
	strcpy(recorder.head->name[1], "lathe");
	assert_int_equal(recorder_open(&file, path, why, sizeof(why)), 0);
	return 0;
}

static int end(void **state)
{
	(void)state;
	recorder_release(&file);
	recorder_close(&recorder);
	unlink(path);
	free(bytes);
	bytes = NULL;
	return 0;
}

/* A packet of device `device`, its 64 bytes a good one of this operation and id. */
static void put(enum recorder_kind kind, uint8_t device, uint64_t t_ns, enum wire_op op, uint8_t id,
		uint8_t tries_or_verdict)
{
	static const uint64_t nothing[128]; /* larger than any operation's struct */
	uint8_t packet[WIRE_PK];
	const struct recorder_slot slot = {
		.t_ns = t_ns,
		.taken_ns = t_ns + 7000,
		.stamped = kind == RECORDER_RECEIVED,
		.kind = (uint8_t)kind,
		.device = device,
		.length = WIRE_PK,
		.cycle = 5,
		.tries = kind == RECORDER_SENT ? tries_or_verdict : 0,
		.verdict = kind == RECORDER_RECEIVED ? tries_or_verdict : 0,
		.peer = 0x0a000002u + device,
		.peer_port = 20055,
		.local = 0x0a000001,
		.local_port = 40000,
	};

	if (kind == RECORDER_SENT)
		wire_encode_req(op, packet, nothing);
	else
		wire_encode_rep(op, packet, nothing);
	wire_finish(packet, id);
	recorder_write(&recorder, &slot, packet, sizeof(packet));
}

static void put_event(uint64_t t_ns)
{
	const struct event event = {
		.t_ns = t_ns,
		.code = EVENT_LINK,
		.level = EVENT_WARNING,
		.device = 0,
		.a = POKEYS_LINK_LOST,
		.b = POKEYS_LINK_RUNNING,
		.c = POKEYS_FAULT_NO_ANSWER,
	};

	recorder_tap(&recorder, &event);
}

static void put_cycle(uint64_t tick_ns, uint64_t late_ns, uint32_t skipped)
{
	const struct recorder_cycle cycle = {
		.cycle = 5,
		.tick_ns = tick_ns,
		.woke_ns = tick_ns + late_ns,
		.published_ns = tick_ns + late_ns + 100000,
		.skipped = skipped,
	};
	const struct recorder_slot slot = {
		.t_ns = tick_ns + 500000,
		.kind = RECORDER_CYCLE,
		.device = 255,
		.length = sizeof(cycle),
	};

	recorder_write(&recorder, &slot, &cycle, sizeof(cycle));
}

static struct export_summary export(int device)
{
	const struct export_options options = {
		.device = device,
		.application = "test",
		.comment = "why",
		.wall_ns = WALL,
		.stations = &stations,
	};
	struct export_summary summary;
	FILE *to;

	free(bytes);
	to = open_memstream(&bytes, &length);
	assert_non_null(to);
	assert_int_equal(export_record(&file, &options, to, &summary), 0);
	fclose(to);
	return summary;
}

static int load(struct replay *replay, const char *from, size_t size, char why[128])
{
	FILE *memory = fmemopen((void *)(uintptr_t)from, size, "r");
	int rc;

	assert_non_null(memory);
	rc = replay_load(replay, memory, why, 128);
	fclose(memory);
	return rc;
}

static struct replay load_good(void)
{
	struct replay replay;
	char why[128] = "";

	if (load(&replay, bytes, length, why))
		fail_msg("%s", why);
	return replay;
}

static const struct frame_path way = {
	.from_mac = { 2, 0, 0, 0, 0, 1 },
	.to_mac = { 2, 0, 0, 0, 0, 2 },
	.from = 0x0a000001,
	.to = 0x0a000002,
	.from_port = 40000,
	.to_port = 20055,
};

static void a_frame_is_taken_apart_again(void **state)
{
	/* both sums computed by another program */
	static const uint8_t expected[FRAME_HEAD + 5] = {
		2, 0,  0,    0,    0,    2,    2,  0,  0,    0,    0,   1,   8,   0,   0x45, 0,
		0, 33, 0,    0,    0x40, 0,    64, 17, 0x26, 0xca, 10,  0,   0,   1,   10,   0,
		0, 2,  0x9c, 0x40, 0x4e, 0x57, 0,  13, 0xbd, 0x67, 'h', 'e', 'l', 'l', 'o',
	};
	uint8_t out[64];
	struct unpacked back;

	(void)state;
	assert_int_equal(frame_make_cut(out, &way, (const uint8_t *)"hello", 5, 5),
			 sizeof(expected));
	assert_memory_equal(out, expected, sizeof(expected));
	assert_true(unpack_frame(out, sizeof(expected), &back));
	assert_int_equal(back.from, way.from);
	assert_int_equal(back.to_port, 20055);
	assert_int_equal(back.length, 5);
	assert_memory_equal(back.data, "hello", 5);
	for (size_t i = 0; i < FRAME_HEAD; i++)
		assert_false(unpack_frame(out, i, &back));
}

static void a_frame_that_was_cut_has_no_udp_checksum(void **state)
{
	uint8_t out[64];
	struct unpacked back;

	(void)state;
	assert_int_equal(frame_make_cut(out, &way, (const uint8_t *)"abc", 3, 1000),
			 FRAME_HEAD + 3);
	assert_int_equal(out[40] << 8 | out[41], 0);
	assert_true(unpack_frame(out, FRAME_HEAD + 3, &back));
	assert_int_equal(back.length, 1000);
	assert_int_equal(back.kept, 3);
}

static void a_request_finds_its_reply(void **state)
{
	struct export_summary summary;
	struct replay replay;

	(void)state;
	put(RECORDER_SENT, 0, 1000, WIRE_OP_DEVICE_DATA, 9, 1);
	put(RECORDER_SENT, 1, 1000, WIRE_OP_DEVICE_DATA, 9, 1);
	put(RECORDER_RECEIVED, 1, 61000, WIRE_OP_DEVICE_DATA, 9, POKEYS_VERDICT_ACCEPTED);
	put(RECORDER_RECEIVED, 0, 81000, WIRE_OP_DEVICE_DATA, 9, POKEYS_VERDICT_ACCEPTED);
	put(RECORDER_RECEIVED, 0, 91000, WIRE_OP_DEVICE_DATA, 9, POKEYS_VERDICT_DUPLICATE);
	summary = export(EXPORT_ALL);
	assert_int_equal(summary.packets, 5);
	assert_int_equal(summary.last_ns - summary.first_ns, 90000);
	replay = load_good();
	assert_int_equal(replay.lines, 5);
	assert_int_equal(replay.line[0].t_ns, WALL + 1000);
	assert_string_equal(replay.line[0].device, "mill");
	assert_string_equal(replay_operation(&replay, &replay.line[0]), "device_data");
	assert_int_equal(replay.line[0].partner, 3);
	assert_int_equal(replay.line[1].partner, 2);
	assert_int_equal(replay.line[3].partner, 0);
	assert_true(replay.line[3].stamped);
	assert_int_equal(replay.line[3].taken_ns, 7000);
	assert_int_equal(replay.line[3].cycle, 5);
	assert_int_equal(replay.line[4].verdict, POKEYS_VERDICT_DUPLICATE);
	assert_int_equal(replay.line[4].partner, REPLAY_NONE);
	replay_free(&replay);
}

static void a_retry_is_a_line_of_its_own_and_the_answer_is_that_of_all(void **state)
{
	struct replay replay;

	(void)state;
	put(RECORDER_SENT, 0, 500, WIRE_OP_TICK, 3, 1);
	put(RECORDER_SENT, 0, 1000, WIRE_OP_TICK, 3, 1); /* its answer was not recorded */
	put(RECORDER_SENT, 1, 1500, WIRE_OP_TICK, 3, 1);
	put(RECORDER_SENT, 0, 2000, WIRE_OP_TICK, 3, 2);
	put(RECORDER_SENT, 0, 2500, WIRE_OP_TICK, 3, 3);
	put(RECORDER_RECEIVED, 0, 3000, WIRE_OP_TICK, 3, POKEYS_VERDICT_ACCEPTED);
	put(RECORDER_SENT, 0, 4000, WIRE_OP_TICK, 3, 1);
	export(EXPORT_ALL);
	replay = load_good();
	assert_int_equal(replay.line[4].tries, 3);
	assert_int_equal(replay.line[4].partner, 5);
	for (size_t i = 1; i < 5; i++) {
		if (i == 2)
			continue;
		assert_ptr_equal(replay_answer(&replay, &replay.line[i]), &replay.line[5]);
		assert_ptr_equal(replay_first_try(&replay, &replay.line[i]), &replay.line[1]);
	}
	assert_int_equal(replay.line[1].partner, REPLAY_NONE);
	assert_null(replay_answer(&replay, &replay.line[0]));
	assert_null(replay_answer(&replay, &replay.line[2]));
	assert_null(replay_answer(&replay, &replay.line[6]));
	replay_free(&replay);
}

/* The thread was late: the answer was there when it sent once more. */
static void an_answer_that_was_there_before_the_retry_is_the_answer(void **state)
{
	struct replay replay;

	(void)state;
	put(RECORDER_SENT, 0, 1000, WIRE_OP_TICK, 3, 1);
	put(RECORDER_RECEIVED, 0, 2000, WIRE_OP_TICK, 3, POKEYS_VERDICT_ACCEPTED);
	put(RECORDER_SENT, 0, 3000, WIRE_OP_TICK, 3, 2);
	export(EXPORT_ALL);
	replay = load_good();
	assert_int_equal(replay.line[0].partner, 1);
	assert_ptr_equal(replay_answer(&replay, &replay.line[0]), &replay.line[1]);
	assert_ptr_equal(replay_answer(&replay, &replay.line[2]), &replay.line[1]);
	replay_free(&replay);
}

static void a_reply_without_its_sub_operation_is_named_by_its_request(void **state)
{
	struct replay replay;

	(void)state;
	put(RECORDER_SENT, 0, 1000, WIRE_OP_PULSE_AXIS_GET, 3, 1);
	put(RECORDER_RECEIVED, 0, 2000, WIRE_OP_PULSE_STATUS, 3, POKEYS_VERDICT_ACCEPTED);
	export(EXPORT_ALL);
	replay = load_good();
	assert_string_equal(replay_operation(&replay, &replay.line[1]), "pulse_axis_get");
	replay_free(&replay);
}

static void lines_are_in_the_order_of_time(void **state)
{
	struct replay replay;

	(void)state;
	put(RECORDER_SENT, 0, 5000, WIRE_OP_TICK, 1, 1);
	put_event(9000);
	put(RECORDER_RECEIVED, 0, 8000, WIRE_OP_TICK, 1, POKEYS_VERDICT_ACCEPTED);
	put(RECORDER_RECEIVED, 0, 4000, WIRE_OP_TICK, 200, POKEYS_VERDICT_NOT_IN_FLIGHT);
	export(EXPORT_ALL);
	replay = load_good();
	assert_int_equal(replay.lines, 4);
	for (size_t i = 1; i < replay.lines; i++)
		assert_true(replay.line[i].t_ns > replay.line[i - 1].t_ns);
	assert_int_equal(replay.line[3].kind, REPLAY_EVENT);
	assert_non_null(strstr(replay.line[3].text, "lost (was running)"));
	assert_int_equal(replay.line[3].level, EVENT_WARNING);
	assert_string_equal(replay.line[3].device, "mill");
	replay_free(&replay);
}

static void one_device_alone_can_be_written(void **state)
{
	struct replay replay;

	(void)state;
	put(RECORDER_SENT, 0, 1000, WIRE_OP_TICK, 1, 1);
	put(RECORDER_SENT, 1, 2000, WIRE_OP_TICK, 2, 1);
	put_event(3000);
	put_cycle(4000, 300000, 0);
	assert_int_equal(export(1).packets, 1);
	replay = load_good();
	assert_int_equal(replay.lines, 2);
	assert_string_equal(replay.line[0].device, "lathe");
	assert_int_equal(replay.line[1].kind, REPLAY_EVENT); /* of all: the late cycle */
	replay_free(&replay);
}

static void a_cycle_is_told_only_if_it_was_late(void **state)
{
	struct replay replay;

	(void)state;
	put_cycle(1000000, 20000, 0);
	put_cycle(2000000, 300000, 0);
	put_cycle(3000000, 20000, 2);
	assert_int_equal(export(EXPORT_ALL).events, 2);
	replay = load_good();
	assert_string_equal(replay.line[0].text,
			    "cycle 5 began 300 us late, its data was out after 400 us; 0 missed");
	assert_non_null(strstr(replay.line[1].text, "; 2 missed"));
	replay_free(&replay);
}

static void a_datagram_of_any_length_is_written(void **state)
{
	static const uint16_t lengths[] = { 0, 1, 5, 63, 65, 80, 81, 1472, 65000 };
	uint8_t data[RECORDER_DATA];
	struct replay replay;

	(void)state;
	memset(data, 0xAA, sizeof(data));
	for (size_t i = 0; i < sizeof(lengths) / sizeof(*lengths); i++) {
		const struct recorder_slot slot = {
			.t_ns = i + 1,
			.kind = RECORDER_RECEIVED,
			.length = lengths[i],
			.verdict = POKEYS_VERDICT_BAD_LENGTH,
		};

		recorder_write(&recorder, &slot, data, sizeof(data));
	}
	assert_int_equal(export(EXPORT_ALL).packets, 9);
	replay = load_good();
	for (size_t i = 0; i < replay.lines; i++) {
		assert_int_equal(replay.line[i].length, lengths[i]);
		assert_int_equal(replay.line[i].verdict, POKEYS_VERDICT_BAD_LENGTH);
		assert_non_null(replay_operation(&replay, &replay.line[i]));
	}
	assert_int_equal(replay.lines, 9);
	replay_free(&replay);
}

/* A reply that the daemon has not judged, as in a capture of somebody else's. */
static void without_the_daemons_word_the_first_reply_that_fits_is_the_answer(void **state)
{
	struct replay replay;

	(void)state;
	put(RECORDER_SENT, 0, 1000, WIRE_OP_TICK, 1, 1);
	put(RECORDER_RECEIVED, 0, 2000, WIRE_OP_DEVICE_DATA, 1, POKEYS_VERDICT_NONE);
	put(RECORDER_RECEIVED, 0, 3000, WIRE_OP_TICK, 1, POKEYS_VERDICT_NONE);
	put(RECORDER_RECEIVED, 0, 4000, WIRE_OP_TICK, 1, POKEYS_VERDICT_NONE);
	export(EXPORT_ALL);
	replay = load_good();
	assert_false(replay.line[1].known);
	assert_int_equal(replay.line[0].partner, 2);
	assert_int_equal(replay.line[1].partner, REPLAY_NONE);
	assert_int_equal(replay.line[3].partner, REPLAY_NONE);
	replay_free(&replay);
}

static void fill(void)
{
	for (uint8_t i = 0; i < 3; i++) {
		put(RECORDER_SENT, i % 2, 1000u * i, WIRE_OP_TICK, i, 1);
		put_event(1000u * i + 10);
	}
	export(EXPORT_ALL);
}

static void a_file_that_ends_early_is_refused(void **state)
{
	char why[128];
	size_t good = 0;

	(void)state;
	fill();
	for (size_t cut = 1; cut < length; cut++) {
		struct replay replay;

		good += !load(&replay, bytes, cut, why);
		assert_true(replay.lines <= 6);
		replay_free(&replay);
	}
	/* only where a block ends: behind the section, 2 interfaces, 3 packets, 2 of 3 events */
	assert_int_equal(good, 8);
}

static void a_file_with_a_damaged_byte_harms_nobody(void **state)
{
	char why[128];

	(void)state;
	fill();
	for (size_t at = 0; at < length; at++) {
		const char flip = at % 2 ? 0x01 : 0x7f;
		struct replay replay;

		bytes[at] ^= flip;
		load(&replay, bytes, length, why);
		assert_true(replay.lines <= 6);
		replay_free(&replay);
		bytes[at] ^= flip;
	}
}

static void the_other_byte_order_is_read(void **state)
{
	static const uint8_t other[] = {
		0x0a,
		0x0d,
		0x0d,
		0x0a,
		0,
		0,
		0,
		28,
		0x1a,
		0x2b,
		0x3c,
		0x4d,
		0,
		1,
		0,
		0,
		255,
		255,
		255,
		255,
		255,
		255,
		255,
		255,
		0,
		0,
		0,
		28,
		0,
		0,
		0,
		1,
		0,
		0,
		0,
		20,
		0,
		1,
		0,
		0,
		0,
		0,
		255,
		255,
		0,
		0,
		0,
		20,
		/* 47 bytes: the headers and "hello" make no PoKeys packet */
		0,
		0,
		0,
		6,
		0,
		0,
		0,
		36,
		0,
		0,
		0,
		0,
		0,
		0,
		0,
		0,
		0,
		0,
		0,
		1,
		0,
		0,
		0,
		2,
		0,
		0,
		0,
		2,
		'n',
		'o',
		0,
		0,
		0,
		0,
		0,
		36,
	};
	struct replay replay;
	char why[128] = "";

	(void)state;
	assert_int_equal(load(&replay, (const char *)other, sizeof(other), why), 0);
	assert_int_equal(replay.lines, 0);
	assert_int_equal(replay.others, 1);
	replay_free(&replay);
}

static void what_is_no_pcapng_is_refused(void **state)
{
	struct replay replay;
	char why[128] = "";

	(void)state;
	assert_true(load(&replay, "some text that is none of it", 28, why) < 0);
	assert_string_equal(why, "it is not pcapng");
	replay_free(&replay);
}

static void a_full_disk_is_told(void **state)
{
	const struct export_options options = {
		.device = EXPORT_ALL,
		.application = "test",
		.comment = "",
		.stations = &stations,
	};
	struct export_summary summary;
	FILE *full = fopen("/dev/full", "w");

	(void)state;
	if (!full)
		skip();
	put(RECORDER_SENT, 0, 1000, WIRE_OP_TICK, 1, 1);
	assert_true(export_record(&file, &options, full, &summary) < 0);
	fclose(full);
}

/* A disk that, when it is written to, has the ring cut short behind the exporter's back. */
static ssize_t cut_ring(void *cookie, const char *data, size_t size)
{
	(void)cookie;
	(void)data;
	atomic_store(&recorder.head->written, 0);
	return (ssize_t)size;
}

static void a_ring_that_shrinks_while_it_is_read_ends(void **state)
{
	const struct export_options options = {
		.device = EXPORT_ALL,
		.application = "test",
		.comment = "why",
		.stations = &stations,
	};
	struct export_summary summary;
	FILE *to = fopencookie(NULL, "w", (cookie_io_functions_t){ .write = cut_ring });

	(void)state;
	assert_non_null(to);
	setvbuf(to, NULL, _IONBF, 0);
	put_event(1000);
	assert_int_equal(export_record(&file, &options, to, &summary), 0);
	assert_int_equal(summary.events, 0);
	fclose(to);
}

int main(void)
{
#define TEST(name) cmocka_unit_test_setup_teardown(name, begin, end)
	const struct CMUnitTest tests[] = {
		TEST(a_frame_is_taken_apart_again),
		TEST(a_frame_that_was_cut_has_no_udp_checksum),
		TEST(a_request_finds_its_reply),
		TEST(a_retry_is_a_line_of_its_own_and_the_answer_is_that_of_all),
		TEST(an_answer_that_was_there_before_the_retry_is_the_answer),
		TEST(a_reply_without_its_sub_operation_is_named_by_its_request),
		TEST(lines_are_in_the_order_of_time),
		TEST(one_device_alone_can_be_written),
		TEST(a_cycle_is_told_only_if_it_was_late),
		TEST(a_datagram_of_any_length_is_written),
		TEST(without_the_daemons_word_the_first_reply_that_fits_is_the_answer),
		TEST(a_file_that_ends_early_is_refused),
		TEST(a_file_with_a_damaged_byte_harms_nobody),
		TEST(the_other_byte_order_is_read),
		TEST(what_is_no_pcapng_is_refused),
		TEST(a_full_disk_is_told),
		TEST(a_ring_that_shrinks_while_it_is_read_ends),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
