/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Locked memory, priority and pinning: granted where we have the right, and
 * refused in words that help where we have not. What is refused is refused by
 * the kernel itself, in a child process that gave its rights away.
 */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <errno.h>
#include <fcntl.h>
#include <grp.h>
#include <pthread.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include "daemon/rt/cgroup.h"
#include "daemon/rt/realtime.h"

enum { NO_RIGHT = 100 }; /* the child could not get into the state to be tested */

/* In a child: its status, or a skipped test. */
static int in_child(int (*f)(void))
{
	pid_t child = fork();
	int status;

	if (child == 0)
		_exit(f());
	assert_int_equal(waitpid(child, &status, 0), child);
	assert_true(WIFEXITED(status));
	if (WEXITSTATUS(status) == NO_RIGHT)
		skip();
	return WEXITSTATUS(status);
}

/* Become somebody without rights, with this much memory to lock and no realtime priority. */
static bool powerless(rlim_t memory)
{
	const struct rlimit lock = { memory, memory }, none = { 0, 0 };

	if (setrlimit(RLIMIT_MEMLOCK, &lock) < 0 || setrlimit(RLIMIT_RTPRIO, &none) < 0)
		return false;
	if (geteuid() != 0)
		return true;
	return setgroups(0, NULL) == 0 && setgid(65534) == 0 && setuid(65534) == 0;
}

static unsigned long locked_kib(void)
{
	FILE *f = fopen("/proc/self/status", "r");
	unsigned long locked = 0;
	char line[256];

	while (f && fgets(line, sizeof line, f))
		sscanf(line, "VmLck: %lu", &locked);
	if (f)
		fclose(f);
	return locked;
}

/* Sanitizers make mlockall() a function that does nothing, and succeeds. */
static bool locking_is_faked(void)
{
	bool faked = mlockall(MCL_CURRENT) == 0 && !locked_kib();

	munlockall();
	return faked;
}

static int little_to_lock(void)
{
	char why[256] = "";
	int rc;

	if (locking_is_faked() || !powerless(64 * 1024))
		return NO_RIGHT;
	rc = realtime_lock_memory(why, sizeof why);
	if (rc >= 0)
		return 1;
	if (!strstr(why, "64 KiB") || !strstr(why, "LimitMEMLOCK=infinity"))
		return 2;
	/* and going on without is possible: nothing is locked, memory can be had */
	return mmap(NULL, 64 << 20, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) ==
			       MAP_FAILED ?
		       3 :
		       0;
}

static void small_limit_is_refused_with_the_limit(void **state)
{
	(void)state;
	assert_int_equal(in_child(little_to_lock), 0);
}

/* Enough for the process as it is, so that mlockall() alone succeeds. */
static int enough_for_now(void)
{
	char why[256] = "";
	int rc;

	if (locking_is_faked() || !powerless(7 << 20))
		return NO_RIGHT;
	if (mlockall(MCL_CURRENT | MCL_FUTURE) < 0)
		return NO_RIGHT;
	munlockall();
	rc = realtime_lock_memory(why, sizeof why);
	if (rc != -EAGAIN)
		return 1;
	if (!strstr(why, "7168 KiB"))
		return 2;
	return mmap(NULL, 64 << 20, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) ==
			       MAP_FAILED ?
		       3 :
		       0;
}

static void limit_that_is_enough_only_for_now_is_refused(void **state)
{
	(void)state;
	assert_int_equal(in_child(enough_for_now), 0);
}

static int lock_and_look(void)
{
	char why[256] = "";

	if (locking_is_faked() || realtime_lock_memory(why, sizeof why) < 0)
		return NO_RIGHT;
	if (!locked_kib())
		return 1;
	return why[0] ? 2 : 0;
}

static void memory_is_locked_where_permitted(void **state)
{
	(void)state;
	assert_int_equal(in_child(lock_and_look), 0);
}

static int no_priority(void)
{
	const struct realtime_options options = { .priority = 80, .cpu = -1, .required = true };
	char why[256] = "";

	if (!powerless(64 * 1024))
		return NO_RIGHT;
	if (realtime_enter(&options, why, sizeof why) != -EPERM)
		return 1;
	if (!strstr(why, "CAP_SYS_NICE") || !strstr(why, "LimitRTPRIO=80"))
		return 2;
	return prctl(PR_GET_TIMERSLACK) == 1 ? 0 : 3;
}

static void missing_right_is_told_with_its_name(void **state)
{
	(void)state;
	assert_int_equal(in_child(no_priority), 0);
}

static int take_priority(void)
{
	const struct realtime_options options = { .priority = 10, .cpu = 0, .required = true };
	struct sched_param parameter;
	char why[256] = "";
	cpu_set_t set;

	if (realtime_enter(&options, why, sizeof why) == -EPERM)
		return NO_RIGHT;
	if (why[0] || (sched_getscheduler(0) & ~SCHED_RESET_ON_FORK) != SCHED_FIFO)
		return 1;
	if (sched_getparam(0, &parameter) < 0 || parameter.sched_priority != 10)
		return 2;
	if (sched_getaffinity(0, sizeof set, &set) < 0 || CPU_COUNT(&set) != 1 ||
	    !CPU_ISSET(0, &set))
		return 3;
	return prctl(PR_GET_TIMERSLACK) <= 1 ? 0 : 4; /* newer kernels: 0 */
}

static void thread_becomes_realtime_where_permitted(void **state)
{
	(void)state;
	assert_int_equal(in_child(take_priority), 0);
}

static int missing_core(void)
{
	const struct realtime_options options = { .priority = 10, .cpu = 999, .required = false };
	char why[256] = "";

	if (realtime_enter(&options, why, sizeof why) == -EPERM)
		return NO_RIGHT;
	return strstr(why, "core 999") ? 0 : 1;
}

static void core_that_does_not_exist_is_told(void **state)
{
	(void)state;
	assert_int_equal(in_child(missing_core), 0);
}

static int bad_priority(void)
{
	const struct realtime_options options = { .priority = 1000, .cpu = -1, .required = true };
	char why[256] = "";

	return realtime_enter(&options, why, sizeof why) == -EINVAL && strstr(why, "1000") ? 0 : 1;
}

static void priority_that_does_not_exist_is_told(void **state)
{
	(void)state;
	assert_int_equal(in_child(bad_priority), 0);
}

static void write_file(const char *path, const char *text)
{
	FILE *f = fopen(path, "w");

	assert_non_null(f);
	fputs(text, f);
	fclose(f);
}

static void cgroup_without_time_is_recognised(void **state)
{
	char folder[] = "pokeysd-test-XXXXXX", membership[64], path[256], file[128];

	(void)state;
	assert_non_null(mkdtemp(folder));
	snprintf(membership, sizeof membership, "%s/membership", folder);
	snprintf(file, sizeof file, "%s/cpu,cpuacct", folder);
	assert_int_equal(mkdir(file, 0700), 0);
	snprintf(file, sizeof file, "%s/cpu,cpuacct/job", folder);
	assert_int_equal(mkdir(file, 0700), 0);
	snprintf(file, sizeof file, "%s/cpu,cpuacct/job/cpu.rt_runtime_us", folder);
	write_file(file, "0\n");
	write_file(membership, "9:cpuset:/x\n4:cpu,cpuacct:/job\n0::/job\n");
	assert_true(cgroup_forbids_realtime(membership, folder, path, sizeof path));
	assert_string_equal(path, file);
	write_file(file, "950000\n");
	assert_false(cgroup_forbids_realtime(membership, folder, path, sizeof path));
	/* version 2 has no such thing; cpuset is not cpu; a broken file is no reason */
	write_file(file, "0\n");
	write_file(membership, "0::/job\n");
	assert_false(cgroup_forbids_realtime(membership, folder, path, sizeof path));
	write_file(membership, "4:cpuset:/job\nnonsense\n\n:\n::\n5:cpu,cpuacct:\n");
	assert_false(cgroup_forbids_realtime(membership, folder, path, sizeof path));
	unlink(file);
	snprintf(file, sizeof file, "rm -r %s", folder);
	assert_int_equal(system(file), 0);
	assert_false(cgroup_forbids_realtime(membership, folder, path, sizeof path));
}

/* The real thing: a new version 1 group, made and left again. */
static int in_new_cgroup(void)
{
	const struct realtime_options options = { .priority = 10, .cpu = -1, .required = true };
	char folder[64], file[96], why[512] = "";
	FILE *f;
	int rc;

	snprintf(folder, sizeof folder, "/sys/fs/cgroup/cpu/pokeysd-test-%d", getpid());
	if (access("/sys/fs/cgroup/cpu/cpu.rt_runtime_us", R_OK) < 0 || mkdir(folder, 0700) < 0)
		return NO_RIGHT;
	snprintf(file, sizeof file, "%s/cgroup.procs", folder);
	f = fopen(file, "w");
	rc = f && fprintf(f, "%d\n", getpid()) > 0 && fflush(f) == 0 ? 0 : NO_RIGHT;
	if (f)
		fclose(f);
	if (rc == 0 && realtime_enter(&options, why, sizeof why) != -EPERM)
		rc = 1;
	if (rc == 0 && (!strstr(why, "cgroup") || !strstr(why, folder)))
		rc = 2;
	f = fopen("/sys/fs/cgroup/cpu/cgroup.procs", "w");
	if (f) {
		fprintf(f, "%d\n", getpid());
		fclose(f);
	}
	rmdir(folder);
	return rc;
}

static void new_cgroup_is_named_as_the_reason(void **state)
{
	(void)state;
	assert_int_equal(in_child(in_new_cgroup), 0);
}

static void core_is_held_awake_or_the_reason_is_given(void **state)
{
	int fd = realtime_hold_cpu_awake();

	(void)state;
	if (fd >= 0) {
		assert_int_equal(fcntl(fd, F_GETFD), FD_CLOEXEC);
		close(fd);
	} else {
		assert_true(access("/dev/cpu_dma_latency", R_OK | W_OK) < 0);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(small_limit_is_refused_with_the_limit),
		cmocka_unit_test(limit_that_is_enough_only_for_now_is_refused),
		cmocka_unit_test(memory_is_locked_where_permitted),
		cmocka_unit_test(missing_right_is_told_with_its_name),
		cmocka_unit_test(thread_becomes_realtime_where_permitted),
		cmocka_unit_test(core_that_does_not_exist_is_told),
		cmocka_unit_test(priority_that_does_not_exist_is_told),
		cmocka_unit_test(cgroup_without_time_is_recognised),
		cmocka_unit_test(new_cgroup_is_named_as_the_reason),
		cmocka_unit_test(core_is_held_awake_or_the_reason_is_given),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
