/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Recorded traffic against a mailbox (fault catalogue). The device layer and the
 * simulated device run over a bad link, the recorder listens, its ring becomes a
 * pcapng file, and the file alone is played: a fresh mailbox sends the same bytes at the
 * same times, and makes the same of every reply.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>
#include "daemon/recorder/export.h"
#include "tests/device/world.h"
#include "tests/recorder/player.h"

enum { SLOTS = 1 << 17 };

static struct world world;
static struct recorder recorder;
static struct recorder_file file;
static char *bytes;
static size_t length;

static void write_packet(enum recorder_kind kind, const uint8_t *packet, size_t size, uint8_t tries,
			 uint8_t verdict)
{
	const struct recorder_slot slot = {
		.t_ns = world.now,
		.taken_ns = world.now,
		.stamped = kind == RECORDER_RECEIVED,
		.peer = world.config.address,
		.peer_port = 20055,
		.local = 1,
		.local_port = 40000,
		.length = (uint16_t)size,
		.kind = (uint8_t)kind,
		.tries = tries,
		.verdict = verdict,
		.once = kind == RECORDER_SENT &&
			device_mailbox(world.device)->mailbox[packet[6]].once,
	};

	recorder_write(&recorder, &slot, packet, size);
}

static void hear_request(struct world *w, const uint8_t *packet)
{
	const pokeys_device_t *mailbox = device_mailbox(w->device);

	write_packet(RECORDER_SENT, packet, 64, mailbox->mailbox[packet[6]].tries, 0);
}

static void hear_reply(struct world *w, const uint8_t *packet, size_t size)
{
	write_packet(RECORDER_RECEIVED, packet, size, 0, device_mailbox(w->device)->verdict);
}

static void begin(uint64_t seed)
{
	char path[] = "/tmp/pokeysd-test-played.XXXXXX", why[128];
	const int fd = mkstemp(path);

	assert_true(fd >= 0);
	close(fd);
	assert_int_equal(recorder_create(&recorder, path, SLOTS), 0);
	recorder.head->devices = 1;
	recorder.head->period_ns = 1 * MS;
	strcpy(recorder.head->name[0], "mill");
	assert_int_equal(recorder_open(&file, path, why, sizeof(why)), 0);
	unlink(path);
	world_init(&world, NULL);
	world.config.serial = 65432;
	world_pin(&world, 0, 4);
	world_axes(&world);
	world_start(&world);
	world.watch = hear_request;
	world.heard = hear_reply;
	world.events.tap = recorder_tap;
	world.events.tap_context = &recorder;
	sim_prng_init(&world.rig.link.way[0].prng, seed);
	sim_prng_init(&world.rig.link.way[1].prng, ~seed);
}

static void end(void)
{
	recorder_release(&file);
	recorder_close(&recorder);
	free(bytes);
	bytes = NULL;
}

/* The ring as a file, and the file read back. */
static void load(struct replay *record)
{
	static struct stations stations;
	const struct export_options options = {
		.device = EXPORT_ALL,
		.application = "test",
		.comment = "",
		.stations = &stations,
	};
	struct export_summary summary;
	FILE *f = open_memstream(&bytes, &length);
	char why[128] = "";

	assert_non_null(f);
	assert_true(recorder_written(&file) < SLOTS);
	assert_int_equal(export_record(&file, &options, f, &summary), 0);
	fclose(f);
	f = fmemopen(bytes, length, "r");
	assert_non_null(f);
	if (replay_load(record, f, why, sizeof(why)))
		fail_msg("%s", why);
	fclose(f);
	assert_int_equal(record->others, 0);
}

static void bad_link(unsigned int i)
{
	struct sim_link_faults faults = {
		.delay = { SIM_DELAY_HEAVY_TAIL, 25 * US, (1 + 4 * (i % 6)) * MS, 1.2 },
		.loss = 0.02 * (double)(i % 7),
		.duplicate = 0.2,
		.copies = 1 + i % 4,
		.copy_gap_ns = 2 * MS,
		.reorder = 0.2,
		.reorder_ns = (1 + i % 5) * MS,
	};

	sim_link_set_faults(&world.rig.link, SIM_LINK_REQUEST, &faults);
	faults.corrupt = faults.truncate = faults.wrong_id = faults.wrong_op = 0.02;
	sim_link_set_faults(&world.rig.link, SIM_LINK_REPLY, &faults);
}

/* All that may become of a link in four seconds. */
static void live(unsigned int i)
{
	bad_link(i);
	world_commander(&world, 5);
	for (unsigned int n = 0; n < 400; n++) {
		world_output(&world, 0, n & 1);
		world_run(&world, 10 * MS);
		if (n % 3 == 0)
			sim_rig_stray(&world.rig, world.now);
		if (n == 150)
			sim_rig_silence(&world.rig, world.now, (50 + 100 * (i % 4)) * MS);
		if (n == 250 && i & 1)
			sim_rig_reboot(&world.rig, world.now, i & 2);
	}
}

static void play(const struct replay *record, unsigned int copies, bool exact, struct played *out)
{
	const struct player_options options = {
		.mailbox = &world.config.mailbox,
		.exact = exact,
		.copies = copies,
	};

	player_play(record, &options, out);
}

static void check(const struct replay *record, bool exact)
{
	const struct pokeys_statistics *daemon = &device_mailbox(world.device)->statistics;
	struct played once, twice;

	play(record, 0, exact, &once);
	if (once.differences)
		fail_msg("%llu differences; %s", (unsigned long long)once.differences, once.first);
	assert_int_equal(once.requests + once.retries, daemon->sent);
	assert_int_equal(once.retries, daemon->resent);
	assert_int_equal(once.replies, daemon->received);
	assert_int_equal(once.accepted, daemon->accepted);
	printf("%llu requests, %llu retries, %llu replies, %llu accepted, %llu unanswered, "
	       "%llu resets\n",
	       (unsigned long long)once.requests, (unsigned long long)once.retries,
	       (unsigned long long)once.replies, (unsigned long long)once.accepted,
	       (unsigned long long)once.unanswered, (unsigned long long)once.resets);
	assert_true(once.accepted > 1000 && once.replies > once.accepted + 200);
	/* and every reply once more: nothing is answered twice, and nothing else changes */
	play(record, 3, exact, &twice);
	if (twice.differences)
		fail_msg("with copies: %s", twice.first);
	assert_int_equal(twice.accepted, once.accepted);
}

static void what_was_recorded_is_made_the_same_of_again(void **state)
{
	const uint64_t seed = world_seed();

	(void)state;
	for (unsigned int i = 0; i < 16; i += WORLD_STRIDE) {
		struct replay record;

		begin(seed + i);
		live(i);
		load(&record);
		check(&record, true);
		check(&record, false);
		replay_free(&record);
		end();
	}
}

/* A player that finds nothing would find nothing here either. */
static void what_was_altered_is_found(void **state)
{
	struct replay record;
	struct played played;
	unsigned int n = 0;

	(void)state;
	begin(1);
	live(3);
	load(&record);
	for (size_t i = record.lines / 2; i < record.lines && n < 60; i++) {
		struct replay_line *line = &record.line[i], kept = *line;

		if (line->kind == REPLAY_EVENT)
			continue;
		if (line->kind == REPLAY_REQUEST)
			line->data[WIRE_AT_ID] ^= 0x80;
		else if (line->verdict == POKEYS_VERDICT_ACCEPTED)
			line->data[WIRE_AT_SUM] ^= 1;
		else
			line->verdict = POKEYS_VERDICT_ACCEPTED;
		play(&record, 0, true, &played);
		assert_true(played.differences > 0);
		*line = kept;
		n++;
	}
	play(&record, 0, true, &played);
	assert_int_equal(played.differences, 0);
	replay_free(&record);
	end();
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(what_was_recorded_is_made_the_same_of_again),
		cmocka_unit_test(what_was_altered_is_found),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
