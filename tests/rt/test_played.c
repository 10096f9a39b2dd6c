/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What the real loop's recorder kept, over a real network and with the kernel's time
 * stamps, is played against a mailbox in virtual time, as fast as it goes.
 *
 * The loop looks at its deadlines whenever it comes to it on this machine, and that
 * moment is in the record only where something was sent: so ids and retries are taken
 * from it (not exact). What is judged is what became of every reply.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>
#include "daemon/recorder/export.h"
#include "tests/recorder/player.h"
#include "tests/rt/rig.h"

enum { SLOTS = 1 << 18, REPLIES = 4000 };

/* a pause of the machine must not count as a loss; the test itself causes the only one */
#define LOST_AFTER_MS 2000
#define SILENCE_MS "3000"

static struct rig_options options = {
	.transport = "socket",
	.period_ns = 1000000,
	.lost_after_ns = LOST_AFTER_MS * UINT64_C(1000000),
};
static struct rig rig;
static struct recorder_file file;

static int begin(void **state)
{
	char path[128], why[128] = "";

	(void)state;
	if (rig_start(&rig, &options) < 0)
		return -1;
	snprintf(path, sizeof(path), "%s/recorder", rig.folder);
	if (recorder_create(&rig.loop.recorder, path, SLOTS) < 0)
		return -1;
	rig.loop.recorder.head->devices = 1;
	rig.loop.recorder.head->period_ns = rig.options.period_ns;
	strcpy(rig.loop.recorder.head->name[0], "dut");
	rig.loop.events.tap = recorder_tap;
	rig.loop.events.tap_context = &rig.loop.recorder;
	return recorder_open(&file, path, why, sizeof(why)) || rig_run(&rig) ? -1 : 0;
}

static int end(void **state)
{
	(void)state;
	rig_halt(&rig);
	recorder_release(&file);
	recorder_close(&rig.loop.recorder);
	rig_stop(&rig);
	return 0;
}

static void fault(const char *way, const char *name, const char *value)
{
	assert_int_equal(rig_simulator(&rig, "fault", way, name, value, NULL), 0);
}

static void await_replies(uint64_t more)
{
	struct pokeys_state before, after;
	unsigned int waited = 0;

	rig_state(&rig, &before);
	for (rig_state(&rig, &after); after.statistics.accepted < before.statistics.accepted + more;
	     rig_state(&rig, &after)) {
		if ((waited += 5) > RIG_PATIENCE_MS)
			fail_msg("not so many replies in %d ms", RIG_PATIENCE_MS);
		rig_sleep_ms(5);
	}
}

static void load(struct replay *record)
{
	static struct stations stations;
	const struct export_options how = {
		.device = EXPORT_ALL,
		.application = "test",
		.comment = "",
		.wall_ns = export_wall(),
		.stations = &stations,
	};
	struct export_summary summary;
	char path[128], why[128] = "";
	FILE *f;

	snprintf(path, sizeof(path), "%s/record.pcapng", rig.folder);
	f = fopen(path, "w+");
	assert_non_null(f);
	assert_int_equal(export_record(&file, &how, f, &summary), 0);
	rewind(f);
	if (replay_load(record, f, why, sizeof(why)))
		fail_msg("%s", why);
	fclose(f);
}

static void what_became_of_every_reply_comes_about_again(void **state)
{
	const pokeys_device_t *daemon = device_mailbox(rig.device);
	const struct player_options plain = { .mailbox = &daemon->options };
	const struct player_options copies = { .mailbox = &daemon->options, .copies = 2 };
	struct replay record;
	struct played played;

	(void)state;
	fault("both", "loss", "0.03");
	fault("both", "duplicate", "0.1");
	fault("reply", "reorder", "0.1");
	fault("reply", "reorder-us", "2000");
	fault("reply", "truncate", "0.02");
	fault("reply", "corrupt", "0.02");
	await_replies(REPLIES / 2);
	assert_int_equal(rig_simulator(&rig, "stray", "20", NULL), 0);
	assert_int_equal(rig_simulator(&rig, "silence", SILENCE_MS, NULL), 0);
	await_replies(REPLIES / 2);
	rig_halt(&rig);
	assert_true(recorder_written(&file) < SLOTS);
	load(&record);
	player_play(&record, &plain, &played);
	printf("%llu requests, %llu retries, %llu replies, %llu accepted, %llu resets\n",
	       (unsigned long long)played.requests, (unsigned long long)played.retries,
	       (unsigned long long)played.replies, (unsigned long long)played.accepted,
	       (unsigned long long)played.resets);
	if (played.differences)
		fail_msg("%llu differences; %s", (unsigned long long)played.differences,
			 played.first);
	assert_int_equal(played.requests + played.retries, daemon->statistics.sent);
	assert_int_equal(played.replies, daemon->statistics.received);
	assert_int_equal(played.accepted, daemon->statistics.accepted);
	assert_true(played.replies > played.accepted);
	player_play(&record, &copies, &played);
	if (played.differences)
		fail_msg("with copies: %s", played.first);
	replay_free(&record);
}

int main(int argc, char **argv)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(what_became_of_every_reply_comes_about_again, begin,
						end),
	};

	if (argc < 2)
		return 2;
	options.simulator = argv[1];
	return cmocka_run_group_tests(tests, NULL, NULL);
}
