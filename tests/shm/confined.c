/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A daemon whose unit has RestrictSUIDSGID=: the kernel then refuses every
 * request for a set-group-id bit, whether or not the folder has it already.
 * The filter is the one that systemd makes, written out.
 */
#include <errno.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>
#include "tests/shm/folder.h"

enum { NO_FILTER = 99, REFUSED = 1, WRONG_MODE = 2 };

/* EPERM if argument `mode` of system call `number` has one of the two bits. */
#define FORBID(number, mode)							\
	BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, nr)),	\
	BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, number, 0, 3),			\
	BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, args[mode])),	\
	BPF_JUMP(BPF_JMP | BPF_JSET | BPF_K, S_ISUID | S_ISGID, 0, 1),		\
	BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EPERM)

#ifdef SYS_mkdir /* newer architectures have the *at calls only */
#define FORBID_OLD FORBID(SYS_mkdir, 1), FORBID(SYS_chmod, 1),
#else
#define FORBID_OLD
#endif

static int forbid_set_id(void)
{
	struct sock_filter program[] = {
		FORBID_OLD FORBID(SYS_fchmod, 1),
		FORBID(SYS_fchmodat, 2),
		FORBID(SYS_mkdirat, 2),
		BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
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

/* The umask is the unit's. */
static int open_confined(struct folder *folder, const char *group)
{
	struct shm_device *mill;
	struct shm_host *host;
	const gid_t gid = group ? (gid_t)atoi(group) : getegid();
	struct stat status;
	char path[64];
	int r = 0;

	umask(0007);
	if (forbid_set_id())
		return NO_FILTER;
	if (shm_host_open(&host, folder->path, group, NULL, folder->why, sizeof(folder->why)) ||
	    shm_host_add(host, "mill", &mill, folder->why, sizeof(folder->why)) ||
	    shm_host_publish(host, folder->why, sizeof(folder->why))) {
		fprintf(stderr, "%s\n", folder->why);
		return REFUSED;
	}
	snprintf(path, sizeof(path), "%s/current/.", folder->path);
	if (stat(path, &status) || (status.st_mode & 05777) != 0750 || status.st_gid != gid)
		r = WRONG_MODE;
	shm_host_close(host);
	return r;
}

static void opens(struct folder *folder, const char *group)
{
	int status;
	pid_t pid;

	assert_int_equal(mkdir(folder->path, 0770), 0);
	assert_int_equal(chmod(folder->path, 02751), 0);
	pid = fork();
	if (!pid)
		_exit(open_confined(folder, group));
	assert_int_equal(waitpid(pid, &status, 0), pid);
	assert_true(WIFEXITED(status));
	if (WEXITSTATUS(status) == NO_FILTER) {
		fprintf(stderr, "seccomp filters are not available here\n");
		skip();
	}
	assert_int_equal(WEXITSTATUS(status), 0);
}

static void folder_that_is_right_needs_no_set_group_id_bit_again(void **state)
{
	opens(*state, NULL);
}

/* The service manager makes it for the service's group, and pokeysd.conf names another. */
static void folder_goes_to_another_group_without_asking_for_the_bit(void **state)
{
	struct folder *folder = *state;
	struct stat status;

	if (geteuid()) {
		fprintf(stderr, "only root is in every group\n");
		skip();
	}
	opens(folder, "12345");
	assert_int_equal(stat(folder->path, &status), 0);
	assert_int_equal(status.st_gid, 12345);
	assert_int_equal(status.st_mode & 07777, 02751);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(
			folder_that_is_right_needs_no_set_group_id_bit_again, folder_begin,
			folder_end),
		cmocka_unit_test_setup_teardown(
			folder_goes_to_another_group_without_asking_for_the_bit, folder_begin,
			folder_end),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
