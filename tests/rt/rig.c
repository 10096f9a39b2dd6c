/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Starting and ending the whole realtime side in one process, in the order in
 * which the daemon does it. Every run has a loopback address, a runtime
 * folder and a control socket of its own, so that many run beside one
 * another, and takes all of it away again.
 *
 * Commands are given with posix_spawn(), which shares memory with its child:
 * after a fork() every page of this process would be faulted in anew when it
 * is next written, also by the realtime thread.
 *
 * The runtime folder is on a tmpfs, as /run is. On a disk the kernel writes the
 * images back from time to time and protects their pages for that, which costs
 * the realtime thread a page fault a page, every half minute.
 *
 * Loop and simulator stay on cores of their own where there are two: a
 * polling realtime thread keeps everybody else off its core.
 */
#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>
#include "daemon/rt/realtime.h"
#include "tests/rt/rig.h"

enum { ARGUMENTS = 16 };

void rig_sleep_ms(unsigned int ms)
{
	const struct timespec t = { ms / 1000, (long)(ms % 1000) * 1000000 };

	nanosleep(&t, NULL);
}

static int failed(const char *what, int rc)
{
	fprintf(stderr, "rig: %s: %s\n", what, strerror(-rc));
	return rc;
}

/* "ready A.B.C.D PORT" */
static int read_ready(struct rig *rig, int fd)
{
	FILE *f = fdopen(fd, "r");
	unsigned int ip[4], port;
	int n = f ? fscanf(f, "ready %u.%u.%u.%u %u", ip, ip + 1, ip + 2, ip + 3, &port) : 0;

	if (f)
		fclose(f);
	if (n != 5)
		return -EPROTO;
	rig->address = ip[0] << 24 | ip[1] << 16 | ip[2] << 8 | ip[3];
	rig->port = (uint16_t)port;
	return 0;
}

static int start_simulator(struct rig *rig)
{
	char address[32], ready[8];
	uint8_t any[3] = { 1, 2, 3 };
	int fds[2];

	if (getrandom(any, sizeof any, 0) < 0 || pipe(fds) < 0)
		return -errno;
	snprintf(address, sizeof address, "127.%u.%u.%u", 1 + any[0] % 250, any[1],
		 1 + any[2] % 250);
	snprintf(ready, sizeof ready, "%d", fds[1]);
	rig->simulator = fork();
	if (rig->simulator == 0) {
		close(fds[0]);
		execl(rig->options.simulator, "pokeys-sim", "--address", address, "--port", "0",
		      "--no-tcp", "--no-discovery", "--quiet", "--preset", "loopback", "--control",
		      rig->control, "--ready-fd", ready, "--cpu", "0", (char *)NULL);
		_exit(127);
	}
	close(fds[1]);
	return read_ready(rig, fds[0]);
}

int rig_simulator(struct rig *rig, const char *command, ...)
{
	const char *arguments[ARGUMENTS] = { "pokeys-sim", "--ctl", rig->control, command };
	posix_spawn_file_actions_t quiet;
	int n = 4, status = -1;
	va_list rest;
	pid_t child;

	va_start(rest, command);
	while (n < ARGUMENTS - 1 && (arguments[n] = va_arg(rest, char *)))
		n++;
	va_end(rest);
	arguments[n] = NULL;
	posix_spawn_file_actions_init(&quiet);
	posix_spawn_file_actions_addopen(&quiet, 1, "/dev/null", O_WRONLY, 0);
	if (posix_spawn(&child, rig->options.simulator, &quiet, NULL, (char **)arguments,
			environ) == 0)
		waitpid(child, &status, 0);
	posix_spawn_file_actions_destroy(&quiet);
	return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

static int start_memory(struct rig *rig)
{
	char why[256] = "";
	int rc = shm_host_open(&rig->host, rig->runtime, NULL, NULL, why, sizeof why);

	if (rc == 0)
		rc = shm_host_add(rig->host, "dut", &rig->loop.devices[0].shm, why, sizeof why);
	if (rc < 0)
		fprintf(stderr, "rig: %s\n", why);
	return rc;
}

static int start_loop(struct rig *rig)
{
	const struct transport_options options = { .spin = rig->options.mode == LOOP_SPIN };
	struct loop *loop = &rig->loop;
	struct device_config config;
	struct pokeys_io io;
	const char *why;
	int rc = transport_open(&loop->transport, rig->options.transport, &options, &why);

	if (rc < 0)
		return rc;
	loop->options = (struct loop_options){ rig->options.period_ns, rig->options.mode, 0.6, 0.9,
					       LOOP_PHASE_AUTO };
	loop->count = 1;
	rig->device = aligned_alloc(64, (device_size() + 63) / 64 * 64);
	if (!rig->device)
		return -ENOMEM;
	memset(rig->device, 0, device_size());
	loop->devices[0].device = rig->device;
	device_config_defaults(&config);
	strcpy(config.name, "dut");
	config.address = rig->address;
	config.port = rig->port;
	config.period_ns = rig->options.period_ns;
	config.mailbox.deadline_floor_ns = rig->options.deadline_floor_ns;
	if (rig->options.lost_after_ns)
		config.lost_after_ns = rig->options.lost_after_ns;
	loop_io(loop, 0, &io);
	device_init(rig->device, &config, &io, &loop->events);
	atomic_store(&loop->shared.address[0], (uint64_t)rig->address << 16 | rig->port);
	return loop_prepare(loop);
}

int rig_start(struct rig *rig, const struct rig_options *options)
{
	char why[256];
	int rc;

	memset(rig, 0, sizeof *rig);
	rig->options = *options;
	snprintf(rig->folder, sizeof rig->folder, "%s/pokeysd-rt-XXXXXX",
		 access("/dev/shm", W_OK) == 0 ? "/dev/shm" : "/tmp");
	if (!mkdtemp(rig->folder))
		return failed("mkdtemp", -errno);
	snprintf(rig->control, sizeof rig->control, "%s/sim", rig->folder);
	snprintf(rig->runtime, sizeof rig->runtime, "%s/run", rig->folder);
	rc = start_simulator(rig);
	if (rc < 0)
		return failed("simulator", rc);
	if (options->realtime)
		rig->is_realtime = realtime_lock_memory(why, sizeof why) == 0;
	rc = start_memory(rig);
	if (rc < 0)
		return failed("shared memory", rc);
	rc = start_loop(rig);
	return rc < 0 ? failed("loop", rc) : 0;
}

static void *run(void *argument)
{
	const int last = (int)sysconf(_SC_NPROCESSORS_ONLN) - 1;
	const struct realtime_options options = { .priority = 50, .cpu = last > 0 ? last : -1 };
	struct rig *rig = argument;
	char why[256];

	if (rig->options.realtime && realtime_enter(&options, why, sizeof why) < 0)
		rig->is_realtime = false;
	rig->result = loop_run(&rig->loop);
	return NULL;
}

int rig_run(struct rig *rig)
{
	sigset_t all, before;
	char why[256] = "";
	int rc;

	sigfillset(&all);
	pthread_sigmask(SIG_SETMASK, &all, &before);
	rc = -pthread_create(&rig->thread, NULL, run, rig);
	pthread_sigmask(SIG_SETMASK, &before, NULL);
	if (rc < 0)
		return failed("thread", rc);
	rig->running = true;
	rc = shm_host_publish(rig->host, why, sizeof why);
	if (rc < 0)
		return failed(why, rc);
	rc = pokeys_client_open(&rig->client, rig->runtime, "dut", "test", 0);
	if (rc == 0 && pokeys_client_poll(rig->client) != POKEYS_CLIENT_ATTACHED)
		rc = -ENOTCONN;
	return rc < 0 ? failed("client", rc) : 0;
}

void rig_halt(struct rig *rig)
{
	if (!rig->running)
		return;
	atomic_store(&rig->loop.shared.stop, true);
	pthread_join(rig->thread, NULL);
	rig->running = false;
}

void rig_stop(struct rig *rig)
{
	char remove[128];

	rig_halt(rig);
	pokeys_client_close(rig->client);
	loop_release(&rig->loop);
	transport_close(rig->loop.transport);
	shm_host_close(rig->host);
	free(rig->device);
	if (rig->simulator > 0) {
		kill(rig->simulator, SIGTERM);
		waitpid(rig->simulator, NULL, 0);
	}
	snprintf(remove, sizeof remove, "rm -rf '%s'", rig->folder);
	if (rig->folder[0] && system(remove) != 0)
		fprintf(stderr, "rig: %s cannot be removed\n", rig->folder);
}

void rig_state(struct rig *rig, struct pokeys_state *out)
{
	memset(out, 0, sizeof *out);
	pokeys_client_read(rig->client, out);
}

void rig_diag(struct rig *rig, struct pokeys_diag *out)
{
	memset(out, 0, sizeof *out);
	pokeys_client_read_diag(rig->client, out);
}

bool rig_await_link(struct rig *rig, enum pokeys_link link)
{
	struct pokeys_state state;

	for (unsigned int waited = 0; waited < RIG_PATIENCE_MS; waited += 5) {
		rig_state(rig, &state);
		if (state.magic && state.link == link)
			return true;
		rig_sleep_ms(5);
	}
	return false;
}
