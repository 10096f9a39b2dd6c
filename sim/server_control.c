// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The control socket: lines in, replies out, for tests and for people. Only
 * its owner may open it (mode 0600). A socket left over by a simulator which
 * was killed is replaced; one somebody listens on is not.
 *
 * It has another name until it listens: whoever waits for the path may connect
 * as soon as it is there.
 */
#include "sim/server.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

/* True when the path is a socket nobody answers on. */
static bool is_left_over(const struct sockaddr_un *sa)
{
	struct stat st;
	bool dead;
	int fd;

	if (lstat(sa->sun_path, &st) < 0 || !S_ISSOCK(st.st_mode))
		return false;
	fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
	if (fd < 0)
		return false;
	dead = connect(fd, (const struct sockaddr *)sa, sizeof(*sa)) < 0 && errno == ECONNREFUSED;
	close(fd);
	return dead;
}

#define UNHEARD ".new"

static int bind_private(int fd, const struct sockaddr_un *sa)
{
	mode_t mask = umask(0177);
	int r = bind(fd, (const struct sockaddr *)sa, sizeof(*sa)) < 0 ? -errno : 0;

	umask(mask);
	return r;
}

/* sa's path has room for UNHEARD. */
static int listen_at(int fd, const struct sockaddr_un *sa)
{
	struct sockaddr_un before = *sa;
	int r;

	memcpy(before.sun_path + strlen(sa->sun_path), UNHEARD, sizeof(UNHEARD));
	if (is_left_over(&before))
		unlink(before.sun_path);
	r = bind_private(fd, &before);
	if (r < 0)
		return r;
	if (listen(fd, SIM_CONTROL_CLIENTS) < 0 || link(before.sun_path, sa->sun_path) < 0)
		r = errno == EEXIST ? -EADDRINUSE : -errno;
	unlink(before.sun_path);
	return r;
}

static int open_at(const struct sockaddr_un *sa)
{
	int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
	int r;

	if (fd < 0)
		return -errno;
	if (is_left_over(sa))
		unlink(sa->sun_path);
	r = listen_at(fd, sa);
	if (r < 0) {
		close(fd);
		return r;
	}
	return fd;
}

int sim_control_open(struct sim_server *server)
{
	struct sockaddr_un sa = { .sun_family = AF_UNIX };
	const char *path = server->options->control;
	int fd;

	if (!path)
		return 0;
	if (strlen(path) > sizeof(sa.sun_path) - sizeof(UNHEARD)) {
		fprintf(stderr, "pokeys-sim: --control: '%s' is longer than %zu characters\n", path,
			sizeof(sa.sun_path) - sizeof(UNHEARD));
		return -ENAMETOOLONG;
	}
	memcpy(sa.sun_path, path, strlen(path) + 1);
	fd = open_at(&sa);
	if (fd < 0) {
		fprintf(stderr, "pokeys-sim: --control %s: %s%s\n", path, strerror(-fd),
			fd == -EADDRINUSE ? ": it is no socket, or another simulator's; give "
					    "another path" :
					    "");
		return fd;
	}
	server->control_listen = fd;
	return sim_server_watch(server, fd, SIM_EVENT_CONTROL_LISTEN, 0);
}

static void drop(struct sim_control_client *client)
{
	if (client->fd >= 0)
		close(client->fd);
	client->fd = -1;
}

void sim_control_close(struct sim_server *server)
{
	for (unsigned int i = 0; i < SIM_CONTROL_CLIENTS; i++)
		drop(&server->controller[i]);
	if (server->control_listen < 0)
		return;
	close(server->control_listen);
	server->control_listen = -1;
	unlink(server->options->control);
}

void sim_control_accept(struct sim_server *server)
{
	int fd = accept4(server->control_listen, NULL, NULL, SOCK_NONBLOCK | SOCK_CLOEXEC);

	if (fd < 0)
		return;
	for (unsigned int i = 0; i < SIM_CONTROL_CLIENTS; i++) {
		struct sim_control_client *client = &server->controller[i];

		if (client->fd >= 0)
			continue;
		if (sim_server_watch(server, fd, SIM_EVENT_CONTROL, i) < 0)
			break;
		client->fd = fd;
		client->received = 0;
		return;
	}
	close(fd);
}

static void run_line(struct sim_server *server, struct sim_control_client *client, uint64_t now_ns,
		     char *line)
{
	static char reply[SIM_CONTROL_REPLY];
	struct sim_text out;

	sim_text_init(&out, reply, sizeof(reply));
	sim_control_run(&server->control, now_ns, line, &out);
	if (send(client->fd, reply, out.used, MSG_NOSIGNAL) != (ssize_t)out.used)
		drop(client);
}

static void run_lines(struct sim_server *server, struct sim_control_client *client, uint64_t now_ns)
{
	char *end;

	while (client->fd >= 0 && (end = memchr(client->line, '\n', client->received)) != NULL) {
		size_t used = (size_t)(end - client->line) + 1;

		*end = '\0';
		run_line(server, client, now_ns, client->line);
		client->received -= used;
		memmove(client->line, client->line + used, client->received);
	}
}

void sim_control_receive(struct sim_server *server, uint64_t now_ns, unsigned int index)
{
	static const char too_long[] = "error: line too long\n";
	struct sim_control_client *client = &server->controller[index];

	while (client->fd >= 0) {
		ssize_t len = recv(client->fd, client->line + client->received,
				   sizeof(client->line) - client->received, 0);

		if (len < 0 && errno == EAGAIN)
			return;
		if (len <= 0) {
			drop(client);
			return;
		}
		client->received += (size_t)len;
		run_lines(server, client, now_ns);
		if (client->fd >= 0 && client->received == sizeof(client->line)) {
			send(client->fd, too_long, sizeof(too_long) - 1, MSG_NOSIGNAL);
			drop(client);
		}
	}
}
