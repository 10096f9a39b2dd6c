// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * When a record is written, that it is bounded in number and in rate, and that
 * whatever the disk does the daemon goes on.
 */
#include <fcntl.h>
#include <linux/magic.h>
#include <pthread.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <sys/wait.h>
#include <unistd.h>
#include <cmocka.h>
#include "daemon/control/keeper.h"
#include "daemon/control/log.h"
#include "daemon/recorder/read.h"
#include "tests/control/folder.h"
#include "wire/pulse.h"

#define MS UINT64_C(1000000)

static char folder[64], runtime[96], records[96];
static struct config config;
static struct loop loop;
static struct keeper keeper;
static int pipe_fd[2];
static gid_t readers = (gid_t)-1;

static _Atomic bool hangs, waiting;

/* In place of the C library's: a disk that answers when it likes; the ring is in memory. */
int rename(const char *from, const char *to)
{
	waiting = hangs;
	while (hangs && strstr(to, ".pcapng"))
		usleep(1000);
	return renameat(AT_FDCWD, from, AT_FDCWD, to);
}

static int setup(void **state)
{
	(void)state;
	strcpy(folder, "/dev/shm/pokeysd-test-keeper.XXXXXX"); /* as in /run: in memory */
	assert_non_null(mkdtemp(folder));
	snprintf(runtime, sizeof(runtime), "%s/run", folder);
	snprintf(records, sizeof(records), "%s/records", folder);
	assert_int_equal(mkdir(runtime, 0700) | mkdir(records, 0700), 0);
	memset(&config, 0, sizeof(config));
	memset(&loop, 0, sizeof(loop));
	config.loop.period_ns = MS;
	config.devices = 1;
	config.recorder_seconds = 1;
	config.record_files = 3;
	config.record_interval_ns = 60000 * MS;
	strcpy(config.device[0].name, "mill");
	strcpy(config.runtime_directory, runtime);
	strcpy(config.record_folder, records);
	assert_int_equal(pipe(pipe_fd), 0);
	log_open(pipe_fd[1], EVENT_DEBUG);
	return 0;
}

/* With a long limit: a busy machine writes late, and the tests only ask whether it writes. */
static void stop(void)
{
	keeper_stop(&keeper, 60000);
}

static int teardown(void **state)
{
	(void)state;
	stop();
	keeper_close(&keeper);
	folder_remove(runtime);
	folder_remove(records);
	rmdir(folder);
	close(pipe_fd[0]);
	close(pipe_fd[1]);
	return 0;
}

/* As a daemon does that goes on to drive. */
static void begin(const char *logs)
{
	keeper_open(&keeper, &config, &loop, logs, readers);
	keeper_record(&keeper);
}

static int files(const char *part)
{
	return folder_count(records, part);
}

static void happen(enum event_code code, int64_t a, int64_t b, uint64_t now_ns)
{
	const struct event event = { .t_ns = now_ns, .code = (uint16_t)code, .a = a, .b = b };

	event_push(&loop.events, &event);
	keeper_event(&keeper, &event, now_ns);
}

static void lose(uint64_t now_ns)
{
	happen(EVENT_LINK, POKEYS_LINK_LOST, POKEYS_LINK_RUNNING, now_ns);
}

static const char *logged(void)
{
	static char text[4096];
	ssize_t length;

	log_line(EVENT_ERROR, "end");
	length = read(pipe_fd[0], text, sizeof(text) - 1);
	text[length > 0 ? length : 0] = '\0';
	return text;
}

static enum record_reason reason(enum event_code code, int64_t a, int64_t b, bool on)
{
	const struct event event = {
		.code = (uint16_t)code, .level = EVENT_WARNING, .a = a, .b = b
	};

	return keeper_reason(&event, on);
}

static void faults_are_reasons_and_other_events_are_not(void **state)
{
	const struct event broken = { .code = EVENT_TRANSPORT, .level = EVENT_ERROR };

	(void)state;
	assert_int_equal(reason(EVENT_LINK, POKEYS_LINK_LOST, POKEYS_LINK_RUNNING, false),
			 RECORD_LOST);
	assert_int_equal(reason(EVENT_LINK, POKEYS_LINK_LOST, POKEYS_LINK_LOST, false), 0);
	assert_int_equal(reason(EVENT_LINK, POKEYS_LINK_RUNNING, POKEYS_LINK_LOST, false), 0);
	assert_int_equal(reason(EVENT_COMMANDER, 0, 200000, true), RECORD_COMMANDER);
	assert_int_equal(reason(EVENT_COMMANDER, 0, 200000, false), 0);
	assert_int_equal(reason(EVENT_COMMANDER, 1, 0, true), 0);
	assert_int_equal(reason(EVENT_ENGINE, WIRE_ENGINE_STOP_EMERGENCY, 3, true),
			 RECORD_EMERGENCY);
	assert_int_equal(reason(EVENT_ENGINE, WIRE_ENGINE_STOP_LIMIT, 3, true), RECORD_LIMIT);
	assert_int_equal(reason(EVENT_ENGINE, WIRE_ENGINE_RUNNING, 0, true), 0);
	assert_int_equal(reason(EVENT_HEATER, 1, POKEYS_HEATER_OPEN, false), RECORD_HEATER);
	assert_int_equal(reason(EVENT_HEATER, 1, POKEYS_HEATER_FINE, false), 0);
	assert_int_equal(reason(EVENT_SERVO, 1, POKEYS_SERVO_STALLED, true), RECORD_SERVO);
	assert_int_equal(reason(EVENT_SERVO, 1, POKEYS_SERVO_EMERGENCY, true), 0);
	assert_int_equal(reason(EVENT_SERVO, 1, POKEYS_SERVO_HEATER, true), 0);
	assert_int_equal(reason(EVENT_SERVO, 1, POKEYS_SERVO_FINE, true), 0);
	assert_int_equal(reason(EVENT_CYCLE_SKIPPED, 9, 0, true), 0);
	assert_int_equal(reason(EVENT_CYCLE_SKIPPED, 10, 0, true), RECORD_LATE);
	assert_int_equal(reason(EVENT_TRANSPORT, -5, 0, true), 0);
	assert_int_equal(keeper_reason(&broken, false), RECORD_TRANSPORT);
}

static void a_fault_is_written_half_a_second_later(void **state)
{
	(void)state;
	begin(NULL);
	lose(1000 * MS);
	keeper_run(&keeper, 1499 * MS);
	assert_int_equal(keeper.due, RECORD_LOST);
	keeper_run(&keeper, 1500 * MS);
	assert_int_equal(keeper.due, RECORD_NOTHING);
	stop();
	assert_int_equal(files("-lost.pcapng"), 1);
	assert_int_equal(files(""), 1);
	assert_non_null(strstr(logged(), "-lost.pcapng"));
}

static void there_is_one_in_a_while(void **state)
{
	(void)state;
	begin(NULL);
	lose(1000 * MS);
	for (uint64_t t = 1001; t < 61000; t += 500) {
		lose(t * MS);
		keeper_run(&keeper, t * MS);
		assert_true(keeper.due == RECORD_NOTHING || t < 1501);
	}
	lose(61000 * MS);
	assert_int_equal(keeper.due, RECORD_LOST);
}

/* A burst of missed cycles is a reason by itself, and often a forerunner. */
static void a_mild_fault_does_not_cost_the_record_of_a_grave_one(void **state)
{
	(void)state;
	begin(NULL);
	happen(EVENT_CYCLE_SKIPPED, 20, 0, 1000 * MS);
	keeper_run(&keeper, 1500 * MS);
	lose(10000 * MS);
	assert_int_equal(keeper.due, RECORD_LOST);
}

static void faults_of_half_a_second_are_one_record_named_after_the_gravest(void **state)
{
	(void)state;
	begin(NULL);
	happen(EVENT_CYCLE_SKIPPED, 20, 0, 1000 * MS);
	lose(1200 * MS);
	happen(EVENT_CYCLE_SKIPPED, 20, 0, 1300 * MS);
	keeper_run(&keeper, 1699 * MS);
	assert_int_equal(keeper.due, RECORD_LOST);
	keeper_run(&keeper, 1700 * MS);
	assert_int_equal(keeper.due, RECORD_NOTHING);
	stop();
	assert_int_equal(files("-lost.pcapng"), 1);
	assert_int_equal(files(""), 1);
}

static void the_commander_counts_while_the_machine_is_on(void **state)
{
	(void)state;
	begin(NULL);
	happen(EVENT_COMMANDER, 0, 0, MS);
	assert_int_equal(keeper.due, RECORD_NOTHING);
	happen(EVENT_MACHINE, 1, 0, 2 * MS);
	happen(EVENT_MACHINE, 0, 0, 3 * MS);
	happen(EVENT_COMMANDER, 0, 0, 4 * MS);
	assert_int_equal(keeper.due, RECORD_NOTHING);
	happen(EVENT_MACHINE, 1, 0, 5 * MS);
	happen(EVENT_COMMANDER, 0, 0, 6 * MS);
	assert_int_equal(keeper.due, RECORD_COMMANDER);
}

static void the_ring_is_for_those_who_may_read_the_devices(void **state)
{
	const gid_t group = 65534;
	struct stat file;

	(void)state;
	if (geteuid())
		skip(); /* only root may give it to any group */
	readers = group;
	umask(077);
	begin(NULL);
	umask(022);
	readers = (gid_t)-1;
	assert_int_equal(stat(keeper.ring, &file), 0);
	assert_int_equal(file.st_gid, group);
	assert_int_equal(file.st_mode & 07777, 0640);
}

static void what_a_dead_daemon_left_is_written_at_the_next_start(void **state)
{
	(void)state;
	begin(NULL);
	lose(MS);
	keeper.due = RECORD_NOTHING;
	stop();
	recorder_close(&loop.recorder); /* dies: the file stays */
	begin(NULL);
	stop();
	assert_int_equal(files("-died.pcapng"), 1);
	assert_int_not_equal(access(keeper.died, F_OK), 0);
	assert_int_equal(access(keeper.ring, F_OK), 0);
	keeper_close(&keeper);
	assert_int_not_equal(access(keeper.ring, F_OK), 0);
}

static void one_that_ends_in_its_start_writes_it_too(void **state)
{
	(void)state;
	begin(NULL);
	stop();
	recorder_close(&loop.recorder); /* dies: the file stays */
	keeper_open(&keeper, &config, &loop, NULL, readers);
	stop();
	keeper_close(&keeper);
	assert_int_equal(files("-died.pcapng"), 1);
	assert_int_equal(folder_count(runtime, "recorder"), 0);
}

/* The thread has what the daemon before has left to write; the record is not lost by that. */
static void one_that_is_due_is_written_at_the_end_after_another(void **state)
{
	(void)state;
	begin(NULL);
	stop();
	recorder_close(&loop.recorder); /* dies: the file stays */
	begin(NULL);
	lose(1000 * MS);
	stop();
	assert_int_equal(files("-died.pcapng"), 1);
	assert_int_equal(files("-lost.pcapng"), 1);
}

/* Until the disk has begun with a record. */
static void await_disk(void)
{
	for (int i = 0; i < 30000 && !waiting; i++)
		usleep(1000);
	assert_true(waiting);
}

static void await_none(const char *part)
{
	for (int i = 0; i < 30000 && files(part); i++)
		usleep(1000);
	assert_int_equal(files(part), 0);
}

static void a_disk_that_hangs_does_not_hold_the_end_up(void **state)
{
	const char *said;

	(void)state;
	begin(NULL);
	lose(1000 * MS);
	hangs = true;
	keeper_run(&keeper, 1500 * MS);
	await_disk();
	happen(EVENT_ENGINE, WIRE_ENGINE_STOP_LIMIT, 3, 2000 * MS);
	keeper_stop(&keeper, KEEPER_STOP_MS); /* comes back */
	said = logged();
	assert_non_null(strstr(said, "the record \"lost\" is not written"));
	assert_non_null(strstr(said, "the record \"limit\" is not written"));
	await_none("pcapng"); /* what was begun as well */
	hangs = false;
	pthread_join(keeper.thread, NULL);
	assert_int_equal(files("pcapng"), 0);
}

/* A daemon whose disk hangs: it is killed in the middle of a record, or ends. */
static pid_t another(bool ends)
{
	const pid_t child = fork();

	assert_true(child >= 0);
	if (child)
		return child;
	hangs = true;
	begin(NULL);
	lose(1000 * MS);
	keeper_run(&keeper, 1500 * MS);
	while (!ends)
		pause();
	keeper_stop(&keeper, KEEPER_STOP_MS);
	keeper_close(&keeper);
	_exit(0);
}

static void what_a_killed_daemon_had_begun_is_removed_by_the_next(void **state)
{
	const pid_t child = another(false);

	(void)state;
	for (int i = 0; i < 30000 && !files(".new"); i++)
		usleep(1000);
	assert_int_equal(files("-lost.pcapng.new"), 1);
	kill(child, SIGKILL);
	assert_int_equal(waitpid(child, NULL, 0), child);
	assert_int_equal(files("-lost.pcapng.new"), 1);
	begin(NULL);
	stop();
	assert_int_equal(files(".new"), 0);
	assert_int_equal(files("-died.pcapng"), 1);
}

/* It ended while what the one before it had left was not written: that is not lost. */
static void what_the_disk_did_not_take_is_written_at_the_start_after(void **state)
{
	int status;

	(void)state;
	begin(NULL);
	stop();
	recorder_close(&loop.recorder); /* dies: the file stays */
	assert_int_equal(waitpid(another(true), &status, 0) > 0 && !status, 1);
	/* on a busy machine one is begun as it ends, and goes at the next start */
	assert_int_equal(files("-died.pcapng"), files("-died.pcapng.new"));
	begin(NULL);
	stop();
	assert_int_equal(files("-died.pcapng"), 1);
	assert_int_equal(files(".new"), 0);
	assert_int_not_equal(access(keeper.died, F_OK), 0);
}

static void a_folder_that_is_not_there_is_told(void **state)
{
	(void)state;
	snprintf(config.record_folder, sizeof(config.record_folder), "%s/none", folder);
	begin(NULL);
	lose(MS);
	stop();
	assert_non_null(strstr(logged(), "No such file"));
}

static void it_can_be_off(void **state)
{
	(void)state;
	config.recorder_seconds = 0;
	begin(records);
	assert_null(loop.recorder.head);
	assert_null(loop.events.tap);
	lose(MS);
	keeper_run(&keeper, 1000 * MS);
	keeper_close(&keeper);
	config.recorder_seconds = 1;
	config.record_files = 0;
	begin(records);
	assert_non_null(loop.recorder.head);
	assert_false(keeper.running);
	lose(MS);
	stop();
	assert_int_equal(files(""), 0);
}

/* The realtime thread would wait for the disk at each page that it writes again. */
static void on_a_disk_there_is_none(void **state)
{
	char place[] = "/var/tmp/pokeysd-test-keeper.XXXXXX";
	struct statfs found;

	(void)state;
	assert_non_null(mkdtemp(place));
	assert_int_equal(statfs(place, &found), 0);
	strcpy(config.runtime_directory, place);
	begin(records);
	if (found.f_type == TMPFS_MAGIC || found.f_type == RAMFS_MAGIC) {
		folder_remove(place);
		skip();
	}
	folder_remove(place);
	assert_null(loop.recorder.head);
	assert_null(loop.events.tap);
	assert_non_null(strstr(logged(), "nothing is recorded (runtime-directory in /run"));
}

static void the_service_managers_folder_is_the_default(void **state)
{
	(void)state;
	config.record_folder[0] = '\0';
	begin(records);
	lose(MS);
	stop();
	assert_int_equal(files("-lost.pcapng"), 1);
	keeper_close(&keeper);
	begin(NULL);
	assert_false(keeper.running);
}

static void the_ring_holds_the_seconds_that_are_wanted(void **state)
{
	(void)state;
	config.recorder_seconds = 5;
	loop.options.mode = LOOP_SPIN;
	begin(NULL);
	assert_true(loop.recorder.head->slots >= 5 * 1000 * 9);
	assert_int_equal(loop.recorder.head->spins, 1);
	assert_string_equal(loop.recorder.head->name[0], "mill");
	stop();
	keeper_close(&keeper);
	config.recorder_seconds = 60;
	config.loop.period_ns = 250000;
	config.devices = 4;
	begin(NULL);
	assert_int_equal(loop.recorder.head->slots, RECORDER_SLOTS_MAX);
}

int main(void)
{
#define TEST(name) cmocka_unit_test_setup_teardown(name, setup, teardown)
	const struct CMUnitTest tests[] = {
		TEST(faults_are_reasons_and_other_events_are_not),
		TEST(a_fault_is_written_half_a_second_later),
		TEST(there_is_one_in_a_while),
		TEST(a_mild_fault_does_not_cost_the_record_of_a_grave_one),
		TEST(faults_of_half_a_second_are_one_record_named_after_the_gravest),
		TEST(the_commander_counts_while_the_machine_is_on),
		TEST(the_ring_is_for_those_who_may_read_the_devices),
		TEST(what_a_dead_daemon_left_is_written_at_the_next_start),
		TEST(one_that_ends_in_its_start_writes_it_too),
		TEST(one_that_is_due_is_written_at_the_end_after_another),
		TEST(what_a_killed_daemon_had_begun_is_removed_by_the_next),
		TEST(what_the_disk_did_not_take_is_written_at_the_start_after),
		TEST(a_folder_that_is_not_there_is_told),
		TEST(it_can_be_off),
		TEST(on_a_disk_there_is_none),
		TEST(the_service_managers_folder_is_the_default),
		TEST(the_ring_holds_the_seconds_that_are_wanted),
		cmocka_unit_test_setup_teardown(a_disk_that_hangs_does_not_hold_the_end_up, setup,
						teardown),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
