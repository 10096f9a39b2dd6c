/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * read and write make no system call and touch no heap.
 *
 * The module as LinuxCNC loads it is loaded here, and its functs run in a
 * thread that the kernel has sealed: whatever system call it tries is trapped
 * and noted with its number, and each call of the allocator is counted. They
 * run through everything that happens in a machine's day: no daemon, daemon
 * comes, daemon killed in mid-sentence, another daemon, bad values on pins,
 * packets lost, an index asked for.
 *
 *	quiet MODULE.so HOST-PROGRAM
 *
 * The clock must be in the vDSO; where it is not, the test cannot tell and
 * says so (77).
 */
#include <errno.h>
#include <fcntl.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <math.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>
#include "tests/halbridge/fake_hal.h"

/* ---- the interposer ------------------------------------------------------- */

void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *old, size_t size);
void __libc_free(void *memory);

static _Thread_local bool sealed;
static _Atomic unsigned int heap_calls, system_calls;
static _Atomic long first_call = -1;

void *malloc(size_t size)
{
	heap_calls += sealed;
	return __libc_malloc(size);
}

void *calloc(size_t count, size_t size)
{
	heap_calls += sealed;
	return __libc_calloc(count, size);
}

void *realloc(void *old, size_t size)
{
	heap_calls += sealed;
	return __libc_realloc(old, size);
}

void free(void *memory)
{
	heap_calls += sealed;
	__libc_free(memory);
}

static void trapped(int signal, siginfo_t *info, void *context)
{
	long expected = -1;

	(void)signal;
	(void)context;
	atomic_compare_exchange_strong(&first_call, &expected, info->si_syscall);
	system_calls++;
}

/* From now on this thread can make no system call at all, but be returned from a signal. */
static int seal(void)
{
	struct sock_filter filter[] = {
		BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, nr)),
		BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, __NR_rt_sigreturn, 0, 1),
		BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
		BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_TRAP),
	};
	const struct sock_fprog program = { .len = sizeof(filter) / sizeof(filter[0]),
					    .filter = filter };

	if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0))
		return -errno;
	return syscall(__NR_seccomp, SECCOMP_SET_MODE_FILTER, 0, &program) ? -errno : 0;
}

/* ---- the servo thread ----------------------------------------------------- */

static struct fake_funct read_funct, write_funct;
static _Atomic unsigned long periods;
static _Atomic bool run, unfit, stopped;

/* It can never end, having no system call to do so: it stops, and dies with the process. */
static void *servo_thread(void *argument)
{
	struct timespec time;

	(void)argument;
	if (seal())
		unfit = true;
	clock_gettime(CLOCK_MONOTONIC, &time);
	if (system_calls)
		unfit = true;
	sealed = true;
	while (run && !unfit) {
		read_funct.run(read_funct.argument, 1000000);
		write_funct.run(write_funct.argument, 1000000);
		periods++;
		for (volatile int i = 0; i < 2000; i++)
			;
	}
	sealed = false;
	stopped = true;
	for (;;)
		__asm__ volatile("" ::: "memory");
	return NULL;
}

static int failures;

static void check(bool good, const char *what)
{
	printf("%s: %s\n", good ? "ok" : "FAILED", what);
	failures += !good;
}

static void sleep_ms(unsigned int ms)
{
	const struct timespec time = { .tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000L };

	nanosleep(&time, NULL);
}

/* Wait until the bit pin has this value, at most 60 s. */
static bool pin_becomes(const char *name, bool value)
{
	const volatile bool *pin = fake_hal_value(name);

	for (int i = 0; i < 6000 && *pin != value; i++)
		sleep_ms(10);
	return *pin == value;
}

static void let_run(unsigned long count)
{
	unsigned long until = periods + count;

	while (periods < until && !stopped)
		sleep_ms(1);
}

/* ---- the daemon ----------------------------------------------------------- */

struct daemon {
	pid_t pid;
	int to;
};

static struct daemon start_daemon(const char *program, const char *runtime)
{
	struct daemon daemon;
	int ends[2];

	if (pipe2(ends, O_CLOEXEC))
		abort();
	daemon.pid = fork();
	if (!daemon.pid) {
		dup2(ends[0], 0);
		dup2(open("/dev/null", O_WRONLY), 1);
		prctl(PR_SET_PDEATHSIG, SIGKILL);
		execl(program, program, runtime, "mill", (char *)NULL);
		_exit(127);
	}
	close(ends[0]);
	daemon.to = ends[1];
	return daemon;
}

static void tell(const struct daemon *daemon, const char *line)
{
	if (write(daemon->to, line, strlen(line)) < 0)
		abort();
}

static void kill_daemon(struct daemon *daemon)
{
	kill(daemon->pid, SIGKILL);
	waitpid(daemon->pid, NULL, 0);
	close(daemon->to);
}

/* ---- a machine's day ------------------------------------------------------ */

static void live_a_day(const char *program, const char *runtime)
{
	struct daemon daemon;
	volatile double *command = fake_hal_value("pokeys.0.joint.00.pos-cmd");
	volatile double *scale = fake_hal_value("pokeys.0.encoder.00.scale");
	volatile bool *index = fake_hal_value("pokeys.0.encoder.25.index-enable");

	let_run(1000);
	check(pin_becomes("pokeys.0.stale", true), "stale without daemon");
	daemon = start_daemon(program, runtime);
	check(pin_becomes("pokeys.0.connected", true), "connected when the daemon comes");
	let_run(1000);
	*command = NAN;
	*scale = 0;
	*index = true;
	check(pin_becomes("pokeys.0.input-refused", true), "bad values are refused");
	tell(&daemon, "set missed 7\nset encoder 3 4000\nset fault 7\nset fault-count 1\n");
	let_run(1000);
	tell(&daemon, "silent 1\n");
	check(pin_becomes("pokeys.0.stale", true), "stale when the device is silent");
	tell(&daemon, "silent 0\n");
	check(pin_becomes("pokeys.0.connected", true), "connected again");
	for (int i = 0; i < 3; i++) {
		kill_daemon(&daemon);
		check(pin_becomes("pokeys.0.stale", true), "stale when the daemon is killed");
		daemon = start_daemon(program, runtime);
		check(pin_becomes("pokeys.0.connected", true), "connected to the next one");
	}
	let_run(1000);
	kill_daemon(&daemon);
}

static int skip(const char *why)
{
	fprintf(stderr, "skipped: %s\n", why);
	return 77;
}

static void remove_folder(const char *folder)
{
	char line[256];

	snprintf(line, sizeof(line), "rm -rf '%s'", folder);
	if (system(line))
		fprintf(stderr, "%s stays\n", folder);
}

int main(int argc, char **argv)
{
	struct sigaction action = { .sa_sigaction = trapped, .sa_flags = SA_SIGINFO };
	char runtime[] = "/tmp/pokeys-quiet-XXXXXX";
	struct fake_module module;
	pthread_t thread;

	if (argc != 3 || !mkdtemp(runtime))
		return 2;
	sigaction(SIGSYS, &action, NULL);
	if (fake_hal_load(&module, argv[1], NULL, NULL, runtime)) {
		fprintf(stderr, "the module does not load: %s\n", fake_hal_said());
		return 1;
	}
	read_funct = fake_hal_funct("pokeys.0.read");
	write_funct = fake_hal_funct("pokeys.0.write");
	run = true;
	pthread_create(&thread, NULL, servo_thread, NULL);
	live_a_day(argv[2], runtime);
	run = false;
	while (!stopped)
		sleep_ms(1);
	fake_hal_unload(&module);
	remove_folder(runtime);
	if (unfit)
		return skip("a thread cannot be sealed, or its clock is not in the vDSO");
	printf("%lu periods\n", (unsigned long)periods);
	check(periods > 1000, "the functs ran");
	if (system_calls)
		printf("first system call: number %ld\n", (long)first_call);
	check(system_calls == 0, "no system call");
	check(heap_calls == 0, "no allocation");
	check(!fake_hal_complaints("different threads"), "one thread is nothing to complain of");
	return failures ? 1 : 0;
}
