/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Opening by name, and what becomes of "auto" where the ring is refused. The
 * refusal is a real one: a seccomp filter in a child process.
 */
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>
#include "daemon/transport/transport.h"

static const struct transport_options options;

/* From now on the system call `number` of this process answers `error`. */
static int refuse_call(long number, int error)
{
	struct sock_filter code[] = {
		BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, nr)),
		BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, (uint32_t)number, 0, 1),
		BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | (uint32_t)error),
		BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
	};
	struct sock_fprog program = { sizeof code / sizeof code[0], code };

	if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) < 0)
		return -errno;
	return prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) < 0 ? -errno : 0;
}

static int open_descriptors(void)
{
	int n = 0;

	for (int fd = 0; fd < 256; fd++)
		n += fcntl(fd, F_GETFD) >= 0;
	return n;
}

/* In a child without `number`: 0 if "auto" gives sockets that work and says why. */
static int child_auto(long number, int error, const char *reason)
{
	struct transport *t = NULL;
	const char *why;

	if (refuse_call(number, error) < 0)
		return 77;
	if (transport_open(&t, "io_uring", &options, &why) != -error)
		return 1;
	if (!strstr(why, reason))
		return 2;
	if (transport_open(&t, "auto", &options, &why) != 0)
		return 3;
	if (strcmp(t->ops->name, "socket") || !strstr(why, reason))
		return 4;
	if (t->ops->attach(t, 0) || t->ops->start(t))
		return 5;
	transport_close(t);
	return open_descriptors() == 3 ? 0 : 6;
}

static int in_child(long number, int error, const char *reason)
{
	pid_t child = fork();
	int status;

	if (child == 0) {
		for (int fd = 3; fd < 256; fd++)
			close(fd);
		_exit(child_auto(number, error, reason));
	}
	assert_int_equal(waitpid(child, &status, 0), child);
	assert_true(WIFEXITED(status));
	if (WEXITSTATUS(status) == 77)
		skip();
	return WEXITSTATUS(status);
}

static void auto_falls_back_when_the_ring_is_not_permitted(void **state)
{
	(void)state;
	assert_int_equal(in_child(__NR_io_uring_setup, EPERM, "not permitted"), 0);
}

static void auto_falls_back_when_the_kernel_has_no_ring(void **state)
{
	(void)state;
	assert_int_equal(in_child(__NR_io_uring_setup, ENOSYS, "no io_uring"), 0);
}

static void auto_falls_back_when_the_ring_is_too_old(void **state)
{
	(void)state;
	assert_int_equal(in_child(__NR_io_uring_setup, EINVAL, "too old"), 0);
}

static void auto_falls_back_when_only_registering_is_refused(void **state)
{
	(void)state;
	assert_int_equal(in_child(__NR_io_uring_register, EPERM, "not permitted"), 0);
}

static void unknown_name_is_refused(void **state)
{
	struct transport *t = NULL;
	const char *why;

	(void)state;
	assert_int_equal(transport_open(&t, "carrier-pigeon", &options, &why), -EINVAL);
	assert_non_null(strstr(why, "io_uring, socket, auto"));
	assert_int_equal(transport_open(&t, "", &options, &why), -EINVAL);
}

static void socket_is_taken_by_name(void **state)
{
	struct transport *t;
	const char *why;

	(void)state;
	assert_int_equal(transport_open(&t, "socket", &options, &why), 0);
	assert_string_equal(t->ops->name, "socket");
	assert_null(why);
	transport_close(t);
	transport_close(NULL);
}

static void interface_that_is_not_there_is_an_error_of_attach(void **state)
{
	const struct transport_options elsewhere = { .interface = "nosuchif0" };
	const struct transport_options too_long = { .interface = "a-name-of-more-than-15-bytes" };
	struct transport *t;
	const char *why;

	(void)state;
	assert_int_equal(transport_open(&t, "auto", &elsewhere, &why), 0);
	assert_int_equal(t->ops->attach(t, 0), -ENODEV);
	transport_close(t);
	assert_int_equal(transport_open(&t, "auto", &too_long, &why), 0);
	assert_int_equal(t->ops->attach(t, 0), -ENODEV);
	transport_close(t);
}

/* Busy polling is a wish: where it is not to be had all the rest works. */
static void busy_polling_may_be_wished_for(void **state)
{
	const struct transport_options busy = { .busy_poll_us = 50 };
	const char *names[] = { "auto", "socket" }, *why;
	struct transport *t;

	(void)state;
	for (int i = 0; i < 2; i++) {
		assert_int_equal(transport_open(&t, names[i], &busy, &why), 0);
		assert_int_equal(t->ops->attach(t, 0), 0);
		assert_int_equal(t->ops->start(t), 0);
		transport_close(t);
	}
}

static void channel_is_attached_once(void **state)
{
	struct transport *t;
	const char *why;

	(void)state;
	assert_int_equal(transport_open(&t, "auto", &options, &why), 0);
	assert_int_equal(t->ops->attach(t, 3), 0);
	assert_int_equal(t->ops->attach(t, 3), -EBUSY);
	transport_close(t);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(auto_falls_back_when_the_ring_is_not_permitted),
		cmocka_unit_test(auto_falls_back_when_the_kernel_has_no_ring),
		cmocka_unit_test(auto_falls_back_when_the_ring_is_too_old),
		cmocka_unit_test(auto_falls_back_when_only_registering_is_refused),
		cmocka_unit_test(unknown_name_is_refused),
		cmocka_unit_test(socket_is_taken_by_name),
		cmocka_unit_test(interface_that_is_not_there_is_an_error_of_attach),
		cmocka_unit_test(busy_polling_may_be_wished_for),
		cmocka_unit_test(channel_is_attached_once),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
