// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The loop of pokeys-sim: what comes in goes into the rig, what the rig has
 * ready goes out.
 *
 * A request is answered in the same turn in which it was read when the device
 * takes no time. Otherwise the loop sleeps until the moment the rig names, to
 * the nanosecond (epoll_pwait2), and no longer than a tenth of a second, so
 * that a device nobody talks to keeps up with its own milliseconds and does
 * not have to live through an hour of them when the next request comes.
 */
#include "sim/server.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/signalfd.h>
#include <time.h>
#include <unistd.h>

#define IDLE_NS 100000000u
#define EVENTS 16
#define SPINS_PER_EPOLL 64

uint64_t sim_now(void)
{
	struct timespec ts;

	clock_gettime(CLOCK_MONOTONIC, &ts);
	return (uint64_t)ts.tv_sec * 1000000000u + (uint64_t)ts.tv_nsec;
}

int sim_server_watch(struct sim_server *server, int fd, enum sim_event event, unsigned int index)
{
	struct epoll_event ev = { .events = EPOLLIN };

	ev.data.u64 = (uint64_t)event << 32 | index;
	if (epoll_ctl(server->epoll, EPOLL_CTL_ADD, fd, &ev) < 0)
		return -errno;
	return 0;
}

static int open_signals(struct sim_server *server)
{
	sigset_t set;

	signal(SIGPIPE, SIG_IGN);
	sigemptyset(&set);
	sigaddset(&set, SIGTERM);
	sigaddset(&set, SIGINT);
	sigprocmask(SIG_BLOCK, &set, NULL);
	server->signals = signalfd(-1, &set, SFD_NONBLOCK | SFD_CLOEXEC);
	if (server->signals < 0)
		return -errno;
	return sim_server_watch(server, server->signals, SIM_EVENT_SIGNAL, 0);
}

static void clear(struct sim_server *server)
{
	memset(server, 0, sizeof(*server));
	server->epoll = server->udp = server->search = -1;
	server->listen = server->control_listen = server->signals = -1;
	for (unsigned int i = 0; i < SIM_TCP_CLIENTS; i++)
		server->tcp[i].fd = -1;
	for (unsigned int i = 0; i < SIM_CONTROL_CLIENTS; i++)
		server->controller[i].fd = -1;
}

int sim_server_open(struct sim_server *server, const struct sim_options *options,
		    struct sim_rig *rig, struct sim_script *script)
{
	int (*const steps[])(struct sim_server *) = {
		open_signals, sim_tcp_open, sim_udp_open, sim_search_open, sim_control_open,
	};
	int r;

	clear(server);
	server->options = options;
	server->rig = rig;
	server->control.rig = rig;
	server->script = script;
	server->port = options->port;
	server->epoll = epoll_create1(EPOLL_CLOEXEC);
	if (server->epoll < 0)
		return -errno;
	for (size_t i = 0; i < sizeof(steps) / sizeof(steps[0]); i++) {
		r = steps[i](server);
		if (r < 0) {
			sim_server_close(server);
			return r;
		}
	}
	server->start_ns = sim_now();
	sim_rig_run(rig, server->start_ns);
	return 0;
}

static void close_fd(int *fd)
{
	if (*fd >= 0)
		close(*fd);
	*fd = -1;
}

void sim_server_close(struct sim_server *server)
{
	sim_tcp_close_all(server);
	sim_control_close(server);
	close_fd(&server->udp);
	close_fd(&server->search);
	close_fd(&server->listen);
	close_fd(&server->signals);
	close_fd(&server->epoll);
}

/* Sends everything the rig has ready. */
static void deliver(struct sim_server *server, uint64_t now_ns)
{
	uint8_t bytes[SIM_LINK_BYTES];
	uint64_t peer;
	size_t len;

	while (sim_rig_receive_for(server->rig, now_ns, &peer, bytes, sizeof(bytes), &len)) {
		if (peer & SIM_PEER_RELIABLE)
			sim_tcp_send(server, now_ns, peer, bytes, len);
		else
			sim_udp_send(server, peer, bytes, len);
	}
	sim_udp_flush(server);
}

static void handle(struct sim_server *server, uint64_t now_ns, const struct epoll_event *event)
{
	unsigned int index = (unsigned int)event->data.u64;

	switch ((enum sim_event)(event->data.u64 >> 32)) {
	case SIM_EVENT_UDP:
		sim_udp_receive(server);
		break;
	case SIM_EVENT_SEARCH:
		sim_search_receive(server, now_ns);
		break;
	case SIM_EVENT_LISTEN:
		sim_tcp_accept(server, now_ns);
		break;
	case SIM_EVENT_TCP:
		if (event->events & (EPOLLERR | EPOLLHUP))
			sim_tcp_broken(server, index);
		else
			sim_tcp_receive(server, now_ns, index);
		break;
	case SIM_EVENT_CONTROL_LISTEN:
		sim_control_accept(server);
		break;
	case SIM_EVENT_CONTROL:
		sim_control_receive(server, now_ns, index);
		break;
	case SIM_EVENT_SIGNAL:
	default:
		server->stop = true;
		break;
	}
}

static uint64_t earlier(uint64_t a, uint64_t b)
{
	return a < b ? a : b;
}

static uint64_t next_event(const struct sim_server *server, uint64_t now_ns)
{
	uint64_t next = earlier(sim_rig_next(server->rig), now_ns + IDLE_NS);

	next = earlier(next, sim_tcp_next(server));
	if (server->script && sim_script_next(server->script) != UINT64_MAX)
		next = earlier(next, server->start_ns + sim_script_next(server->script));
	return next;
}

static int wait_events(struct sim_server *server, struct epoll_event *events, bool poll)
{
	uint64_t now_ns = sim_now();
	uint64_t next = next_event(server, now_ns);
	uint64_t left = next > now_ns && !poll ? next - now_ns : 0;
	struct timespec timeout = {
		.tv_sec = (time_t)(left / 1000000000u),
		.tv_nsec = (long)(left % 1000000000u),
	};

	return epoll_pwait2(server->epoll, events, EVENTS, &timeout, NULL);
}

/* What is due without anybody having asked. */
static int keep_time(struct sim_server *server, uint64_t now_ns)
{
	char reason[512];
	struct sim_text why;

	sim_tcp_keep(server, now_ns);
	if (server->rig->device.stats.reboots != server->reboots) {
		server->reboots = server->rig->device.stats.reboots;
		sim_tcp_close_all(server);
	}
	if (!server->script)
		return 0;
	sim_text_init(&why, reason, sizeof(reason));
	if (sim_script_run(server->script, &server->control, now_ns - server->start_ns, now_ns,
			   &why))
		return 0;
	fprintf(stderr, "pokeys-sim: %s: %s\n", server->options->script, reason);
	return -EINVAL;
}

static int turn(struct sim_server *server, bool poll)
{
	struct epoll_event events[EVENTS];
	int count = wait_events(server, events, poll);
	uint64_t now_ns = sim_now();

	if (count < 0 && errno != EINTR) {
		int r = -errno;

		fprintf(stderr, "pokeys-sim: epoll: %s\n", strerror(-r));
		return r;
	}
	for (int i = 0; i < count; i++)
		handle(server, now_ns, &events[i]);
	now_ns = sim_now();
	deliver(server, now_ns);
	return keep_time(server, now_ns);
}

int sim_server_run(struct sim_server *server)
{
	unsigned int spins = 0;
	int r = 0;

	while (!r && !server->stop && !server->control.exit) {
		if (server->options->spin && ++spins % SPINS_PER_EPOLL) {
			sim_udp_receive(server);
			deliver(server, sim_now());
			continue;
		}
		r = turn(server, server->options->spin);
	}
	return r;
}
