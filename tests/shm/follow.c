/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The follower thread: finds daemons by itself, inherits nothing that would
 * hurt a realtime process, and is gone after close.
 */
#include <dirent.h>
#include <errno.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <unistd.h>
#include "tests/shm/folder.h"

/* A line of /proc/self/task/<id>/status. */
static void thread_fact(pid_t id, const char *name, char fact[128])
{
	char path[64], line[256];
	FILE *file;

	fact[0] = '\0';
	snprintf(path, sizeof(path), "/proc/self/task/%d/status", (int)id);
	file = fopen(path, "r");
	if (!file)
		return;
	while (fgets(line, sizeof(line), file)) {
		if (!strncmp(line, name, strlen(name)))
			sscanf(line + strlen(name), " %127s", fact);
	}
	fclose(file);
}

/* How many followers this process has (a sanitizer has threads of its own), and one of them. */
static int count_followers(pid_t *follower)
{
	DIR *tasks = opendir("/proc/self/task");
	struct dirent *entry;
	char name[128];
	int count = 0;
	pid_t id;

	while ((entry = readdir(tasks))) {
		id = (pid_t)strtol(entry->d_name, NULL, 10);
		thread_fact(id, "Name:", name);
		if (strcmp(name, "pokeys-follow"))
			continue;
		count++;
		if (follower)
			*follower = id;
	}
	closedir(tasks);
	return count;
}

/* It names itself when it begins to run. */
static pid_t wait_for_follower(void)
{
	pid_t follower = 0;

	for (int i = 0; i < 60000 && !count_followers(&follower); i++)
		folder_sleep_ms(1);
	assert_true(follower > 0);
	return follower;
}

static bool reaches(pokeys_client *client, enum pokeys_client_state wanted)
{
	for (int i = 0; i < 60000; i++) {
		if (pokeys_client_status(client, NULL, 0) == wanted)
			return true;
		folder_sleep_ms(1);
	}
	return false;
}

static void daemon_is_found_lost_and_found_again(void **state)
{
	struct folder *folder = *state;
	pokeys_client *client = folder_client(folder, 0);
	struct pokeys_state image;
	struct shm_device *mill;
	struct shm_host *host;

	assert_int_equal(pokeys_client_follow(client, 5), 0);
	for (int i = 0; i < 5; i++) {
		assert_true(reaches(client, POKEYS_CLIENT_DETACHED));
		assert_int_equal(pokeys_client_read(client, &image), -ENOTCONN);
		host = folder_host_mill(folder, &mill);
		assert_true(reaches(client, POKEYS_CLIENT_ATTACHED));
		assert_int_equal(pokeys_client_read(client, &image), 0);
		assert_int_equal(image.epoch, shm_host_epoch(host));
		shm_host_close(host);
	}
	pokeys_client_close(client);
}

static void refused_commander_gets_its_turn(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	pokeys_client *first = folder_client(folder, POKEYS_CLIENT_COMMANDER);
	pokeys_client *second = folder_client(folder, POKEYS_CLIENT_COMMANDER);

	assert_int_equal(pokeys_client_poll(first), POKEYS_CLIENT_ATTACHED);
	assert_int_equal(pokeys_client_follow(second, 5), 0);
	assert_true(reaches(second, POKEYS_CLIENT_REFUSED));
	pokeys_client_close(first);
	assert_true(reaches(second, POKEYS_CLIENT_ATTACHED));
	pokeys_client_close(second);
	shm_host_close(host);
}

static void thread_is_gone_after_close(void **state)
{
	pokeys_client *client;
	uint64_t began;

	for (int i = 0; i < 20; i++) {
		client = folder_client(*state, 0);
		assert_int_equal(pokeys_client_follow(client, 10000), 0);
		wait_for_follower();
		pokeys_client_close(client); /* at once, not after ten seconds */
		/* the kernel lists it a little longer than it runs */
		began = folder_now_ns();
		while (count_followers(NULL) && folder_now_ns() - began < UINT64_C(5000000000))
			folder_sleep_ms(1);
		assert_int_equal(count_followers(NULL), 0);
	}
}

static void thread_takes_no_signal(void **state)
{
	pokeys_client *client = folder_client(*state, 0);
	char blocked[128];

	assert_int_equal(pokeys_client_follow(client, 1000), 0);
	thread_fact(wait_for_follower(), "SigBlk:", blocked);
	/* all but SIGKILL and SIGSTOP, and the two that belong to the C library */
	assert_int_equal(strtoull(blocked, NULL, 16) | 1ull << 31 | 1ull << 32,
			 ~(1ull << (SIGKILL - 1) | 1ull << (SIGSTOP - 1)));
	pokeys_client_close(client);
}

struct pinned {
	pokeys_client *client;
	cpu_set_t cpus;
	int policy, r;
};

static void *follow_from_there(void *argument)
{
	struct pinned *pinned = argument;
	const struct sched_param fifo = { .sched_priority = 1 };

	pinned->r = sched_setaffinity(0, sizeof(pinned->cpus), &pinned->cpus);
	if (!pinned->r && pinned->policy == SCHED_FIFO)
		pinned->r = pthread_setschedparam(pthread_self(), SCHED_FIFO, &fifo);
	if (!pinned->r)
		pinned->r = pokeys_client_follow(pinned->client, 1000);
	return NULL;
}

static void assert_follows_elsewhere(void **state, int policy)
{
	struct pinned pinned = { .client = folder_client(*state, 0), .policy = policy };
	cpu_set_t all, there;
	pthread_t caller;
	pid_t thread;

	sched_getaffinity(0, sizeof(all), &all);
	if (CPU_COUNT(&all) < 2) {
		fprintf(stderr, "one processor only\n");
		skip();
	}
	for (size_t cpu = 0; !CPU_COUNT(&pinned.cpus); cpu++) {
		if (CPU_ISSET(cpu, &all))
			CPU_SET(cpu, &pinned.cpus);
	}
	assert_int_equal(pthread_create(&caller, NULL, follow_from_there, &pinned), 0);
	pthread_join(caller, NULL);
	if (pinned.r) {
		fprintf(stderr, "no right to SCHED_FIFO\n");
		skip();
	}
	thread = wait_for_follower();
	assert_int_equal(sched_getscheduler(thread), SCHED_OTHER);
	assert_int_equal(sched_getaffinity(thread, sizeof(there), &there), 0);
	CPU_AND(&there, &there, &pinned.cpus);
	assert_int_equal(CPU_COUNT(&there), 0);
	pokeys_client_close(pinned.client);
}

static void caller_that_is_pinned_does_not_keep_the_thread(void **state)
{
	assert_follows_elsewhere(state, SCHED_OTHER);
}

static void caller_that_is_realtime_does_not_pass_it_on(void **state)
{
	assert_follows_elsewhere(state, SCHED_FIFO);
}

static void caller_with_several_processors_passes_them_on(void **state)
{
	pokeys_client *client = folder_client(*state, 0);
	cpu_set_t ours, there;

	sched_getaffinity(0, sizeof(ours), &ours);
	assert_int_equal(pokeys_client_follow(client, 1000), 0);
	sched_getaffinity(wait_for_follower(), sizeof(there), &there);
	CPU_AND(&there, &there, &ours);
	assert_true(CPU_COUNT(&there) > 0);
	pokeys_client_close(client);
}

static void wrong_use_is_refused(void **state)
{
	pokeys_client *client = folder_client(*state, POKEYS_CLIENT_EVENTS);

	assert_int_equal(pokeys_client_follow(client, 0), -EINVAL);
	assert_int_equal(pokeys_client_follow(client, 10001), -EINVAL);
	assert_int_equal(pokeys_client_follow(client, 10), 0);
	assert_int_equal(pokeys_client_follow(client, 10), -EALREADY);
	assert_int_equal(pokeys_client_wait(client, 1), -EBUSY);
	pokeys_client_close(client);
	pokeys_client_close(NULL);
}

static void two_clients_of_one_process_do_not_disturb_each_other(void **state)
{
	static const char *const names[] = { "mill", "lathe", NULL };
	struct folder *folder = *state;
	struct shm_device *devices[2];
	pokeys_client *mill = folder_client(folder, POKEYS_CLIENT_COMMANDER);
	pokeys_client *lathe;
	struct shm_host *host;

	assert_int_equal(pokeys_client_open(&lathe, folder->path, "lathe", "test",
					    POKEYS_CLIENT_COMMANDER),
			 0);
	assert_int_equal(pokeys_client_follow(mill, 1), 0);
	assert_int_equal(pokeys_client_follow(lathe, 1), 0);
	for (int i = 0; i < 50; i++) {
		host = folder_host(folder, devices, names);
		assert_true(reaches(mill, POKEYS_CLIENT_ATTACHED));
		assert_true(reaches(lathe, POKEYS_CLIENT_ATTACHED));
		assert_int_equal(shm_host_maintain(host), 0);
		shm_host_close(host);
		assert_true(reaches(mill, POKEYS_CLIENT_DETACHED));
		assert_true(reaches(lathe, POKEYS_CLIENT_DETACHED));
	}
	pokeys_client_close(mill);
	pokeys_client_close(lathe);
}

int main(void)
{
#define BOTH(name) cmocka_unit_test_setup_teardown(name, folder_begin, folder_end)
	const struct CMUnitTest tests[] = {
		BOTH(daemon_is_found_lost_and_found_again),
		BOTH(refused_commander_gets_its_turn),
		BOTH(thread_is_gone_after_close),
		BOTH(thread_takes_no_signal),
		BOTH(caller_that_is_pinned_does_not_keep_the_thread),
		BOTH(caller_that_is_realtime_does_not_pass_it_on),
		BOTH(caller_with_several_processors_passes_them_on),
		BOTH(wrong_use_is_refused),
		BOTH(two_clients_of_one_process_do_not_disturb_each_other),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
