/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What the realtime functions must not do: make a system call, allocate, fault.
 *
 * System calls: a child forbids itself all of them but its end, and then runs
 * the functions 10^5 times; the kernel kills it at the first one. Allocations:
 * this program's malloc counts. Faults: the kernel's count for the thread.
 */
#include <errno.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>
#include "tests/shm/folder.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define INSTRUMENTED 1	/* the sanitizer allocates, faults and calls for itself */
#else
#define INSTRUMENTED 0
#endif

enum { TIMES = 100000, WARM_UP = 100 };

#if !INSTRUMENTED
struct both_sides {
	struct shm_host *host;
	struct shm_device *mill;
	pokeys_client *client, *monitor;
	struct pokeys_state state;
	struct pokeys_diag diag;
	struct pokeys_command command;
	struct pokeys_report report;
	struct pokeys_wish wish;
};

/* Everything that shm.h and host.h call realtime. */
static int run_realtime_functions(struct both_sides *both, unsigned int times)
{
	int wrong = 0;

	for (unsigned int i = 0; i < times; i++) {
		both->state.cycle = i;
		shm_device_write(both->mill, &both->state);
		memcpy(shm_device_loan(both->mill), &both->state, sizeof(both->state));
		shm_device_commit(both->mill);
		shm_device_write_diag(both->mill, &both->diag);
		wrong += pokeys_client_read(both->client, &both->state) != 0;
		wrong += pokeys_client_read_diag(both->client, &both->diag) != 0;
		wrong += pokeys_client_read(both->monitor, &both->state) != 0;
		wrong += pokeys_client_read_diag(both->monitor, &both->diag) != 0;
		wrong += pokeys_client_read_report(both->monitor, &both->report) != 0;
		wrong += pokeys_client_write(both->client, &both->command) != 0;
		wrong += shm_device_read_command(both->mill, &both->command) != 1;
		shm_device_write_report(both->mill, &both->report);
		wrong += pokeys_client_read_report(both->client, &both->report) != 0;
		wrong += pokeys_client_write_wish(both->client, &both->wish) != 0;
		wrong += shm_device_read_wish(both->mill, &both->wish) != 1;
		wrong += shm_device_read_wish(both->mill, &both->wish) != 0;
		wrong += pokeys_histogram_lower(pokeys_histogram_bucket(i)) > i;
	}
	return wrong;
}

static void attach_both(struct folder *folder, struct both_sides *both)
{
	memset(both, 0, sizeof(*both));
	both->host = folder_host_mill(folder, &both->mill);
	both->client = folder_client(folder, POKEYS_CLIENT_COMMANDER);
	both->monitor = folder_client(folder, 0);
	assert_int_equal(pokeys_client_poll(both->client), POKEYS_CLIENT_ATTACHED);
	assert_int_equal(pokeys_client_poll(both->monitor), POKEYS_CLIENT_ATTACHED);
}

static void begin_both(struct folder *folder, struct both_sides *both)
{
	attach_both(folder, both);
	assert_int_equal(run_realtime_functions(both, WARM_UP), 0);
}

static void end_both(struct both_sides *both)
{
	pokeys_client_close(both->client);
	pokeys_client_close(both->monitor);
	shm_host_close(both->host);
}

static _Atomic long allocations;

extern void *__libc_malloc(size_t size);
extern void *__libc_calloc(size_t count, size_t size);
extern void *__libc_realloc(void *old, size_t size);
extern void __libc_free(void *old);

void *malloc(size_t size)
{
	allocations++;
	return __libc_malloc(size);
}

void *calloc(size_t count, size_t size)
{
	allocations++;
	return __libc_calloc(count, size);
}

void *realloc(void *old, size_t size)
{
	allocations++;
	return __libc_realloc(old, size);
}

void free(void *old)
{
	allocations++;
	__libc_free(old);
}

static void realtime_functions_do_not_allocate(void **state)
{
	struct both_sides both;
	long before;

	begin_both(*state, &both);
	before = allocations;
	assert_int_equal(run_realtime_functions(&both, TIMES), 0);
	assert_int_equal(allocations, before);
	/* and it does count: an attach allocates */
	pokeys_client_close(folder_client(*state, 0));
	assert_true(allocations > before);
	end_both(&both);
}

/* Allow the end and nothing else. */
static int forbid_system_calls(void)
{
	struct sock_filter program[] = {
		BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, nr)),
		BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_exit_group, 0, 1),
		BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
		BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS),
	};
	const struct sock_fprog filter = {
		.len = sizeof(program) / sizeof(program[0]),
		.filter = program,
	};

	return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) ||
			       prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter, 0, 0) ?
		       -1 :
		       0;
}

/* In a child; the handles are its own, nothing of iceoryx2 was there before. */
static int run_forbidden(struct folder *folder, bool one_call)
{
	struct both_sides both;
	int status;
	pid_t pid = fork();

	if (!pid) {
		begin_both(folder, &both);
		if (forbid_system_calls())
			_exit(99);
		if (run_realtime_functions(&both, TIMES))
			syscall(SYS_exit_group, 1);
		if (one_call)
			syscall(SYS_getppid);
		syscall(SYS_exit_group, 0);
	}
	assert_int_equal(waitpid(pid, &status, 0), pid);
	return status;
}

static void realtime_functions_make_no_system_call(void **state)
{
	struct folder *folder = *state;
	struct shm_device *mill;
	int status = run_forbidden(folder, false);

	if (WIFEXITED(status) && WEXITSTATUS(status) == 99) {
		fprintf(stderr, "seccomp filters are not available here\n");
		skip();
	}
	assert_true(WIFEXITED(status));
	assert_int_equal(WEXITSTATUS(status), 0);
	/* and it would have been noticed */
	status = run_forbidden(folder, true);
	assert_true(WIFSIGNALED(status) && WTERMSIG(status) == SIGSYS);
	shm_host_close(folder_host_mill(folder, &mill));
}

static long faults(void)
{
	struct rusage usage;

	getrusage(RUSAGE_THREAD, &usage);
	return usage.ru_minflt + usage.ru_majflt;
}

/*
 * A fault of these functions comes each time. One that the kernel causes, because it moves
 * a page or takes it back, does not: so it is enough that one of some tries has none.
 */
enum { TRIES = 10 };

static void realtime_functions_do_not_fault_after_warm_up(void **state)
{
	struct both_sides both;
	long before, faulted = -1;

	begin_both(*state, &both);
	for (int i = 0; i < TRIES && faulted; i++) {
		before = faults();
		assert_int_equal(run_realtime_functions(&both, TIMES), 0);
		faulted = faults() - before;
	}
	assert_int_equal(faulted, 0);
	end_both(&both);
}

static void with_locked_memory_there_is_not_even_a_first_fault(void **state)
{
	struct both_sides both;
	long before;

	if (mlockall(MCL_CURRENT | MCL_FUTURE)) {
		fprintf(stderr, "memory cannot be locked here: %s\n", strerror(errno));
		skip();
	}
	attach_both(*state, &both);
	before = faults();
	run_realtime_functions(&both, 2);
	assert_int_equal(faults(), before);
	munlockall();
	end_both(&both);
}
#endif

/*
 * The handover: a thread reads and writes without a pause while the cold side
 * takes the ground from under it and gives it new one.
 */
struct visitor {
	pokeys_client *client; /* or ... */
	struct shm_device *mill;
	_Atomic bool stop;
	_Atomic uint64_t attached, detached;
	uint64_t wrong;
};

/* Until it counts on: what a test does next is done beside a thread that runs. */
static void await_more(const _Atomic uint64_t *count)
{
	uint64_t before = atomic_load(count);

	for (int i = 0; i < 60000 && atomic_load(count) == before; i++)
		folder_sleep_ms(1);
	assert_true(atomic_load(count) > before);
}

static void *visit(void *argument)
{
	struct visitor *visitor = argument;
	struct pokeys_command command = { .heartbeat = 1 };
	struct pokeys_state image;

	while (!visitor->stop) {
		int r = pokeys_client_read(visitor->client, &image);

		if (!r)
			visitor->attached++;
		else if (r == -ENOTCONN)
			visitor->detached++;
		else
			visitor->wrong++;
		r = pokeys_client_write(visitor->client, &command);
		visitor->wrong += r && r != -ENOTCONN && r != -EPERM;
	}
	return NULL;
}

static void visits_go_on(void **state, unsigned int flags)
{
	struct visitor visitor = { .client = folder_client(*state, flags) };
	struct shm_device *mill;
	struct shm_host *host;
	pthread_t thread;

	assert_int_equal(pthread_create(&thread, NULL, visit, &visitor), 0);
	for (int i = 0; i < 50; i++) {
		host = folder_host_mill(*state, &mill);
		assert_int_equal(pokeys_client_poll(visitor.client), POKEYS_CLIENT_ATTACHED);
		await_more(&visitor.attached);
		shm_host_close(host);
		assert_int_equal(pokeys_client_poll(visitor.client), POKEYS_CLIENT_DETACHED);
		await_more(&visitor.detached);
	}
	visitor.stop = true;
	pthread_join(thread, NULL);
	assert_int_equal(visitor.wrong, 0);
	pokeys_client_close(visitor.client);
}

static void visits_go_on_while_daemons_come_and_go(void **state)
{
	visits_go_on(state, POKEYS_CLIENT_COMMANDER);
	visits_go_on(state, 0);
}

static void *read_commands(void *argument)
{
	struct visitor *visitor = argument;
	struct pokeys_command command;

	while (!visitor->stop) {
		int r = shm_device_read_command(visitor->mill, &command);

		visitor->attached += r == 1;
		visitor->detached += r == 0;
		visitor->wrong += r < 0;
	}
	return NULL;
}

static void commands_are_read_while_their_service_is_made_anew(void **state)
{
	struct folder *folder = *state;
	struct visitor visitor = { 0 };
	struct shm_device *mill;
	struct shm_host *host = folder_host_mill(folder, &mill);
	char said[256];
	pthread_t thread;

	visitor.mill = mill;
	assert_int_equal(pthread_create(&thread, NULL, read_commands, &visitor), 0);
	for (int i = 0; i < 10; i++) {
		folder_end_peer(folder_peer(folder, "commander", said), SIGKILL);
		assert_int_equal(shm_host_maintain(host), 1);
		assert_int_equal(shm_device_commanders(mill), 0);
		await_more(&visitor.detached);
	}
	visitor.stop = true;
	pthread_join(thread, NULL);
	assert_int_equal(visitor.wrong, 0);
	shm_host_close(host);
}

int main(void)
{
#define BOTH(name) cmocka_unit_test_setup_teardown(name, folder_begin, folder_end)
	const struct CMUnitTest tests[] = {
#if !INSTRUMENTED
		/* first: it forks, and iceoryx2 must not have been used before */
		BOTH(realtime_functions_make_no_system_call),
		BOTH(realtime_functions_do_not_allocate),
		BOTH(realtime_functions_do_not_fault_after_warm_up),
		BOTH(with_locked_memory_there_is_not_even_a_first_fault),
#endif
		BOTH(visits_go_on_while_daemons_come_and_go),
		BOTH(commands_are_read_while_their_service_is_made_anew),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
