/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Every system call of a transport's life fails once: the first, the second,
 * and so on, each with several errors. Whatever fails, nothing hangs, no
 * descriptor and no mapping is left, and after an error that passes by itself
 * the exchange goes on. Run for each kind.
 *
 * The calls are caught by the linker (--wrap), so that the code under test is
 * the one that is shipped.
 */
#include "tests/transport/fixture.h"
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>
#include "daemon/transport/uring.h"

static int calls, fail_at, fail_with, failures;
static const char *failed_call;
static bool no_absolute_waits; /* as before Linux 6.12 */
static int absolute_waits_refused;

/* True if this call is the one to fail. */
static bool fails(const char *name)
{
	if (++calls != fail_at)
		return false;
	failures++;
	failed_call = name;
	errno = fail_with;
	return true;
}

int __real_bind(int fd, const struct sockaddr *at, socklen_t length);
int __wrap_bind(int fd, const struct sockaddr *at, socklen_t length);
int __wrap_bind(int fd, const struct sockaddr *at, socklen_t length)
{
	return fails("bind") ? -1 : __real_bind(fd, at, length);
}

int __real_getsockname(int fd, struct sockaddr *at, socklen_t *length);
int __wrap_getsockname(int fd, struct sockaddr *at, socklen_t *length);
int __wrap_getsockname(int fd, struct sockaddr *at, socklen_t *length)
{
	return fails("getsockname") ? -1 : __real_getsockname(fd, at, length);
}

int __real_getsockopt(int fd, int level, int name, void *value, socklen_t *length);
int __wrap_getsockopt(int fd, int level, int name, void *value, socklen_t *length);
int __wrap_getsockopt(int fd, int level, int name, void *value, socklen_t *length)
{
	return fails("getsockopt") ? -1 : __real_getsockopt(fd, level, name, value, length);
}

int __real_ioctl(int fd, unsigned long what, void *argument);
int __wrap_ioctl(int fd, unsigned long what, void *argument);
int __wrap_ioctl(int fd, unsigned long what, void *argument)
{
	return fails("ioctl") ? -1 : __real_ioctl(fd, what, argument);
}

ssize_t __real_sendto(int fd, const void *data, size_t length, int flags, const struct sockaddr *to,
		      socklen_t size);
ssize_t __wrap_sendto(int fd, const void *data, size_t length, int flags, const struct sockaddr *to,
		      socklen_t size);
ssize_t __wrap_sendto(int fd, const void *data, size_t length, int flags, const struct sockaddr *to,
		      socklen_t size)
{
	/* the peers' own calls are not the transport's */
	if (!length && fails("sendto"))
		return -1;
	return __real_sendto(fd, data, length, flags, to, size);
}

ssize_t __real_sendmsg(int fd, const struct msghdr *m, int flags);
ssize_t __wrap_sendmsg(int fd, const struct msghdr *m, int flags);
ssize_t __wrap_sendmsg(int fd, const struct msghdr *m, int flags)
{
	return fails("sendmsg") ? -1 : __real_sendmsg(fd, m, flags);
}

ssize_t __real_recvmsg(int fd, struct msghdr *m, int flags);
ssize_t __wrap_recvmsg(int fd, struct msghdr *m, int flags);
ssize_t __wrap_recvmsg(int fd, struct msghdr *m, int flags)
{
	return fails("recvmsg") ? -1 : __real_recvmsg(fd, m, flags);
}

long __real_syscall(long number, long a, long b, long c, long d, long e, long f);
long __wrap_syscall(long number, long a, long b, long c, long d, long e, long f);
long __wrap_syscall(long number, long a, long b, long c, long d, long e, long f)
{
	if (no_absolute_waits && number == SYS_io_uring_enter && d & URING_ABS_TIMER) {
		absolute_waits_refused++;
		errno = EINVAL;
		return -1;
	}
	return fails("syscall") ? -1 : __real_syscall(number, a, b, c, d, e, f);
}

int __real_socket(int domain, int type, int protocol);
int __wrap_socket(int domain, int type, int protocol);
int __wrap_socket(int domain, int type, int protocol)
{
	return fails("socket") ? -1 : __real_socket(domain, type, protocol);
}

int __real_setsockopt(int fd, int level, int name, const void *value, socklen_t length);
int __wrap_setsockopt(int fd, int level, int name, const void *value, socklen_t length);
int __wrap_setsockopt(int fd, int level, int name, const void *value, socklen_t length)
{
	return fails("setsockopt") ? -1 : __real_setsockopt(fd, level, name, value, length);
}

int __real_connect(int fd, const struct sockaddr *to, socklen_t length);
int __wrap_connect(int fd, const struct sockaddr *to, socklen_t length);
int __wrap_connect(int fd, const struct sockaddr *to, socklen_t length)
{
	return fails("connect") ? -1 : __real_connect(fd, to, length);
}

int __real_sendmmsg(int fd, struct mmsghdr *m, unsigned int n, int flags);
int __wrap_sendmmsg(int fd, struct mmsghdr *m, unsigned int n, int flags);
int __wrap_sendmmsg(int fd, struct mmsghdr *m, unsigned int n, int flags)
{
	return fails("sendmmsg") ? -1 : __real_sendmmsg(fd, m, n, flags);
}

int __real_recvmmsg(int fd, struct mmsghdr *m, unsigned int n, int flags, struct timespec *t);
int __wrap_recvmmsg(int fd, struct mmsghdr *m, unsigned int n, int flags, struct timespec *t);
int __wrap_recvmmsg(int fd, struct mmsghdr *m, unsigned int n, int flags, struct timespec *t)
{
	return fails("recvmmsg") ? -1 : __real_recvmmsg(fd, m, n, flags, t);
}

int __real_ppoll(struct pollfd *fds, nfds_t n, const struct timespec *t, const sigset_t *mask);
int __wrap_ppoll(struct pollfd *fds, nfds_t n, const struct timespec *t, const sigset_t *mask);
int __wrap_ppoll(struct pollfd *fds, nfds_t n, const struct timespec *t, const sigset_t *mask)
{
	return fails("ppoll") ? -1 : __real_ppoll(fds, n, t, mask);
}

void *__real_mmap(void *at, size_t size, int protection, int flags, int fd, off_t offset);
void *__wrap_mmap(void *at, size_t size, int protection, int flags, int fd, off_t offset);
void *__wrap_mmap(void *at, size_t size, int protection, int flags, int fd, off_t offset)
{
	return fails("mmap") ? MAP_FAILED : __real_mmap(at, size, protection, flags, fd, offset);
}

int __real_io_uring_queue_init_params(unsigned int n, struct io_uring *r,
				      struct io_uring_params *p);
int __wrap_io_uring_queue_init_params(unsigned int n, struct io_uring *r,
				      struct io_uring_params *p);
int __wrap_io_uring_queue_init_params(unsigned int n, struct io_uring *r, struct io_uring_params *p)
{
	return fails("io_uring_setup") ? -fail_with : __real_io_uring_queue_init_params(n, r, p);
}

/* How often to ask at least; if an answer has to come, ask until the time limit as well. */
enum { TRIES = 20 };
static bool has_to_come;

/* Ask until an answer comes; true if one did. */
static bool exchange(struct transport *t, struct peer *peer)
{
	const uint64_t give_up = fixture_now() + (has_to_come ? FIXTURE_PATIENCE_NS : 0);
	struct transport_packet p;
	uint8_t in[8];

	for (int tries = 0; tries < TRIES || fixture_now() < give_up; tries++) {
		t->ops->send(t, 0, (const uint8_t *)"ask", 3);
		if (t->error[0])
			t->ops->aim(t, 0, &peer->at);
		if (t->ops->flush(t) < 0)
			return false;
		if (peer_look(peer, in, sizeof in) != 3) {
			t->ops->wait(t, fixture_now() + MS / 10);
			continue;
		}
		peer_send(peer, "told", 4);
		if (next_packet(t, 200, &p) && p.length == 4)
			return true;
	}
	return false;
}

/* A whole life; -errno of the step that failed, 1 if an answer never came. */
static int life(struct peer *peer, struct transport **out)
{
	const struct transport_options options = fixture_options();
	struct transport *t;
	const char *why;
	int rc = transport_open(&t, fixture_kind, &options, &why);

	if (rc < 0)
		return rc;
	*out = t;
	rc = t->ops->attach(t, 0);
	if (rc == 0)
		rc = t->ops->start(t);
	if (rc == 0)
		rc = t->ops->aim(t, 0, &peer->at);
	if (rc == 0) {
		int armed = fail_at, made = calls;

		/* learn the address to answer to, undisturbed and uncounted */
		fail_at = 0;
		while (recv(peer->fd, &calls, sizeof calls, MSG_DONTWAIT) >= 0)
			; /* left over from the life before */
		introduce(t, 0, peer);
		fail_at = armed;
		calls = made;
	}
	for (int i = 0; rc == 0 && i < 3; i++)
		rc = exchange(t, peer) ? 0 : 1;
	return t->failed ? t->failed : rc;
}

static int resources(void)
{
	int n = 0;
	char line[512];
	FILE *maps = fopen("/proc/self/maps", "re");

	assert_non_null(maps);
	for (int fd = 0; fd < 256; fd++)
		n += fcntl(fd, F_GETFD) >= 0;
	while (fgets(line, sizeof line, maps))
		n++;
	fclose(maps);
	return n;
}

/*
 * Fail call 1, 2, 3 ... with `error` until a life has fewer calls. `passing`:
 * the error passes by itself, so what happens after the start must not end
 * the exchange.
 */
static void sweep(int error, bool passing)
{
	struct peer peer;
	int before, life_calls = 0;

	peer_open(&peer);
	before = resources();
	has_to_come = passing;
	for (int n = 1;; n++) {
		struct transport *t = NULL;
		bool runs;
		int rc;

		calls = failures = 0;
		fail_at = n;
		fail_with = error;
		rc = life(&peer, &t);
		runs = t && calls > n && rc != -error;
		fail_at = 0;
		if (passing && runs && rc != 0)
			fail_msg("call %d (%s) failed with %d: the exchange ended with %d", n,
				 failed_call, error, rc);
		transport_close(t);
		if (!failures)
			break;
		life_calls = n;
	}
	/* mappings merge and split; a sanitizer's own come and go */
#ifdef __SANITIZE_THREAD__
	before = resources();
#endif
	assert_in_range(resources(), before - 2, before + 1);
	assert_true(life_calls > 8);
	peer_close(&peer);
}

static void interrupted_calls(void **state)
{
	(void)state;
	sweep(EINTR, true);
}

static void calls_that_say_try_again(void **state)
{
	(void)state;
	sweep(EAGAIN, true);
}

static void calls_without_buffer_space(void **state)
{
	(void)state;
	sweep(ENOBUFS, true);
}

static void calls_without_memory(void **state)
{
	(void)state;
	sweep(ENOMEM, true);
}

static void calls_that_are_not_permitted(void **state)
{
	(void)state;
	sweep(EPERM, false);
}

static void calls_that_say_bad_descriptor(void **state)
{
	(void)state;
	sweep(EBADF, false);
}

static void kernel_without_absolute_waits_is_noticed_at_the_start(void **state)
{
	struct transport *t = NULL;
	struct peer peer;
	uint64_t deadline;

	(void)state;
	peer_open(&peer);
	no_absolute_waits = true;
	has_to_come = true;
	fail_at = 0;
	assert_int_equal(life(&peer, &t), 0);
	deadline = fixture_now() + MS;
	assert_int_equal(t->ops->wait(t, deadline), TRANSPORT_WAIT_DEADLINE);
	assert_true(fixture_now() >= deadline);
	no_absolute_waits = false;
	/* asked once, not with every wait */
	assert_int_equal(absolute_waits_refused, t->ops->name[0] == 'i');
	transport_close(t);
	peer_close(&peer);
}

int main(int argc, char **argv)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(interrupted_calls),
		cmocka_unit_test(calls_that_say_try_again),
		cmocka_unit_test(calls_without_buffer_space),
		cmocka_unit_test(calls_without_memory),
		cmocka_unit_test(calls_that_are_not_permitted),
		cmocka_unit_test(calls_that_say_bad_descriptor),
		cmocka_unit_test(kernel_without_absolute_waits_is_noticed_at_the_start),
	};

	alarm(600);
	fixture_begin(argc, argv);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
