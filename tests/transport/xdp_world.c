// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Two network namespaces and a cable. The far one is held open by a descriptor;
 * sockets there are made by moving over for a moment. Everything goes when this
 * process ends: the namespaces with their last user, the process that stands
 * for the guard by PR_SET_PDEATHSIG, the files with the tmpfs on /run that only
 * we see.
 *
 * The kernel leaves the checksums of what goes into a veth to a card that is not
 * there, and a frame without checksum is refused, so that is switched off.
 */
#include <arpa/inet.h>
#include <bpf/bpf.h>
#include <bpf/libbpf.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/ethtool.h>
#include <linux/if_link.h>
#include <linux/sockios.h>
#include <net/if.h>
#include <sched.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/mount.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>
#include "daemon/control/log.h"
#include "daemon/device/event.h"
#include "guard/server.h"
#include "redirect.skel.h"
#include "tests/transport/fixture.h"
#include "tests/transport/xdp_world.h"

#define HELPER "/run/xdp"

static int here = -1, far = -1, launcher = -1;

static void must(int ok, const char *what)
{
	if (ok)
		return;
	fprintf(stderr, "%s: %s\n", what, strerror(errno));
	abort();
}

void xdp_world_run(const char *command)
{
	int status = system(command);

	must(WIFEXITED(status) && WEXITSTATUS(status) == 0, command);
}

void xdp_world_run_far(const char *command)
{
	must(setns(far, CLONE_NEWNET) == 0, "setns");
	xdp_world_run(command);
	must(setns(here, CLONE_NEWNET) == 0, "setns");
}

int xdp_world_far_socket(void)
{
	int fd;

	must(setns(far, CLONE_NEWNET) == 0, "setns");
	fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
	must(setns(here, CLONE_NEWNET) == 0, "setns");
	return fd;
}

int xdp_world_far_packet_socket(int *index)
{
	int fd;

	must(setns(far, CLONE_NEWNET) == 0, "setns");
	fd = socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC, 0);
	*index = (int)if_nametoindex("pk1");
	must(setns(here, CLONE_NEWNET) == 0, "setns");
	return fd;
}

/* True if this process, in the namespaces that it now has, may do what follows. */
static bool allowed(const char *command)
{
	int status = system(command);

	return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

void xdp_world_checksums(bool whole)
{
	struct ethtool_value by_card = { .cmd = ETHTOOL_STXCSUM, .data = !whole };
	struct ifreq request = { .ifr_name = "pk1", .ifr_data = (void *)&by_card };
	int fd = xdp_world_far_socket();

	must(ioctl(fd, SIOCETHTOOL, &request) == 0, "ETHTOOL_STXCSUM");
	close(fd);
}

/* A child that has the far namespace until we have opened it. */
static const char *make_far(void)
{
	int ready[2], go[2], status;
	char name[64], byte = 0;
	const char *why = NULL;
	pid_t child;

	must(pipe(ready) == 0 && pipe(go) == 0, "pipe");
	child = fork();
	if (child == 0) {
		if (unshare(CLONE_NEWNET) == 0)
			byte = 1;
		if (write(ready[1], &byte, 1) == 1 && read(go[0], &byte, 1) == 1)
			_exit(0);
		_exit(1);
	}
	must(child > 0 && read(ready[0], &byte, 1) == 1, "fork");
	if (byte) {
		snprintf(name, sizeof name, "/proc/%d/ns/net", child);
		far = open(name, O_RDONLY | O_CLOEXEC);
	}
	if (!byte || far < 0)
		why = "no network namespace may be made here";
	must(write(go[1], &byte, 1) == 1 && waitpid(child, &status, 0) == child, "far");
	for (int i = 0; i < 2; i++) {
		close(ready[i]);
		close(go[i]);
	}
	return why;
}

void xdp_world_connect(void)
{
	char command[96];

	snprintf(command, sizeof command,
		 "ip link add pk0 type veth peer name pk1 netns /proc/%d/fd/%d", getpid(), far);
	xdp_world_run(command);
	xdp_world_run_far("ip link set lo up && ip link set pk1 up && "
			  "ip address add 10.78.127.1/16 dev pk1 && "
			  "ip route add local 10.78.0.0/17 dev pk1");
	xdp_world_run("ip link set lo up && ip link set pk0 up && "
		      "ip address add 10.78.200.1/16 dev pk0");
	xdp_world_checksums(true);
}

static int quiet(enum libbpf_print_level level, const char *format, va_list arguments)
{
	(void)level;
	(void)format;
	(void)arguments;
	return 0;
}

/* The process that stands for the guard; writes a byte when it is at work. */
static void serve(int ready)
{
	LIBBPF_OPTS(bpf_link_create_opts, options, .flags = XDP_FLAGS_DRV_MODE);
	struct pollfd fds[GUARD_SERVER_FDS] = { 0 };
	struct guard_server server = GUARD_SERVER_CLOSED;
	struct redirect_bpf *program;
	int index = (int)if_nametoindex("pk0");

	prctl(PR_SET_PDEATHSIG, SIGKILL);
	log_open(STDERR_FILENO, EVENT_WARNING);
	libbpf_set_print(quiet);
	program = redirect_bpf__open_and_load();
	if (!program ||
	    bpf_link_create(bpf_program__fd(program->progs.redirect), index, BPF_XDP, &options) < 0)
		_exit(77);
	if (guard_server_open(&server, HELPER, bpf_map__fd(program->maps.sockets),
			      bpf_map__fd(program->maps.ports)))
		_exit(78);
	server.index = (uint32_t)index;
	server.native = true;
	if (write(ready, "", 1) != 1)
		_exit(1);
	for (;;) {
		guard_server_run(&server, fds, fixture_now());
		poll(fds, GUARD_SERVER_FDS, 100);
	}
}

/* A guard at work; 1, or 0 if it could not begin. */
static char launch(pid_t *guard)
{
	int ready[2];
	char byte;

	must(pipe2(ready, O_CLOEXEC) == 0, "pipe");
	*guard = fork();
	if (*guard == 0)
		serve(ready[1]);
	close(ready[1]);
	byte = read(ready[0], &byte, 1) == 1;
	close(ready[0]);
	return byte;
}

/*
 * Starts guards and ends them as it is told. A process of its own, made before
 * there is any AF_XDP socket: a child of a later moment would have its rings
 * mapped, and so would keep it open.
 */
static void run_launcher(int order)
{
	pid_t guard = 0;
	char byte;

	prctl(PR_SET_PDEATHSIG, SIGKILL);
	while (read(order, &byte, 1) == 1) {
		if (byte == 's') {
			byte = launch(&guard);
		} else {
			kill(guard, SIGKILL);
			must(waitpid(guard, NULL, 0) == guard, "guard");
		}
		must(write(order, &byte, 1) == 1, "order");
	}
	_exit(0);
}

static char give_order(char byte)
{
	must(write(launcher, &byte, 1) == 1 && read(launcher, &byte, 1) == 1, "launcher");
	return byte;
}

const char *xdp_world_guard_start(void)
{
	return give_order('s') == 1 ? NULL : "no XDP program may be loaded or attached here";
}

void xdp_world_guard_end(void)
{
	give_order('e');
}

static void make_launcher(void)
{
	int pair[2];
	pid_t child;

	must(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, pair) == 0, "socketpair");
	child = fork();
	if (child == 0)
		run_launcher(pair[1]);
	must(child > 0, "fork");
	close(pair[1]);
	launcher = pair[0];
}

const char *xdp_world_make(void)
{
	const char *why;

	if (unshare(CLONE_NEWNET | CLONE_NEWNS) < 0)
		return "namespaces for network and mounts may not be made here (root may)";
	if (mount(NULL, "/", NULL, MS_REC | MS_PRIVATE, NULL) ||
	    mount("run", "/run", "tmpfs", 0, NULL))
		return "nothing may be mounted here";
	if (setenv("PATH", "/usr/sbin:/usr/bin:/sbin:/bin", 1) || !allowed("ip -V >/dev/null 2>&1"))
		return "there is no ip (iproute2)";
	here = open("/proc/self/ns/net", O_RDONLY | O_CLOEXEC);
	must(here >= 0, "/proc/self/ns/net");
	why = make_far();
	if (why)
		return why;
	if (!allowed("ip link add pkx type veth peer name pky 2>/dev/null && ip link del pkx"))
		return "no veth interface may be made here";
	xdp_world_connect();
	make_launcher();
	return xdp_world_guard_start();
}

struct transport_options xdp_world_options(void)
{
	return (struct transport_options){ .interface = "pk0", .helper = HELPER };
}
