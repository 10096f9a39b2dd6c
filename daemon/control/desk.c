// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The socket and those who stand at it.
 *
 * Whoever may write to the socket may order: it is the group that may
 * command the device as well. Nobody can hold the daemon up: a request is one
 * packet of bounded size, answers are sent without waiting, whoever says
 * nothing for two seconds is sent away, and a ninth at a time is told to come
 * again. What is no request is answered with what would be one, and counted.
 */
#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>
#include "daemon/control/desk.h"

#define SECOND		UINT64_C(1000000000)
#define ASKING_NS	(2 * SECOND)

void desk_init(struct desk *desk, const struct config *config, const char *config_path,
	       struct loop *loop, desk_read read, void *context)
{
	*desk = (struct desk){
		.config = config,
		.config_path = config_path,
		.loop = loop,
		.read = read,
		.context = context,
		.listen_fd = -1,
		.next_id = 1,
	};
}

/*
 * With its mode from the first moment: changed by name afterwards, it could be
 * that of whatever somebody of the group has put there meanwhile.
 */
static int bind_for_group(int fd, const struct sockaddr_un *address)
{
	mode_t before = umask(0117);
	int result = bind(fd, (const struct sockaddr *)address, sizeof(*address));

	umask(before);
	return result;
}

int desk_open(struct desk *desk)
{
	struct sockaddr_un address = { .sun_family = AF_UNIX };
	int fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);

	if (fd < 0)
		return -errno;
	snprintf(desk->socket, sizeof(desk->socket), "%s/control", desk->config->runtime_directory);
	strncpy(address.sun_path, desk->socket, sizeof(address.sun_path) - 1);
	if (bind_for_group(fd, &address) || listen(fd, DESK_CLIENTS)) {
		int error = errno;

		close(fd);
		desk->socket[0] = '\0';
		return -error;
	}
	desk->listen_fd = fd;
	return 0;
}

void desk_answer(struct desk *desk, struct desk_client *client, bool ok, const char *format, ...)
{
	char text[DESK_ANSWER_MAX];
	size_t at = (size_t)snprintf(text, sizeof(text), ok ? "ok " : "refused ");
	va_list arguments;

	va_start(arguments, format);
	vsnprintf(text + at, sizeof(text) - at, format, arguments);
	va_end(arguments);
	desk->refused += !ok;
	send(client->fd, text, strlen(text), MSG_NOSIGNAL | MSG_DONTWAIT);
	close(client->fd);
	*client = (struct desk_client){ .fd = -1 };
}

/* A place, or NULL: all are taken. */
static struct desk_client *free_place(struct desk *desk)
{
	for (size_t i = 0; i < DESK_CLIENTS; i++)
		if (desk->client[i].phase == DESK_FREE)
			return &desk->client[i];
	return NULL;
}

static void take_clients(struct desk *desk, uint64_t now_ns)
{
	struct desk_client turned_away, *client;
	char request[DESK_REQUEST_MAX];
	int fd;

	/* bounded: others wait until the next round */
	for (int i = 0; i < DESK_CLIENTS; i++) {
		fd = accept4(desk->listen_fd, NULL, NULL, SOCK_CLOEXEC | SOCK_NONBLOCK);
		if (fd < 0)
			return;
		client = free_place(desk);
		if (!client) {
			/* closing on what was not read would throw the answer away as well */
			turned_away = (struct desk_client){ .fd = fd };
			recv(fd, request, sizeof(request), MSG_DONTWAIT);
			desk_answer(desk, &turned_away, false, "%d orders are at work; try again",
				    DESK_CLIENTS);
			continue;
		}
		*client =
			(struct desk_client){ .fd = fd, .phase = DESK_ASKING, .since_ns = now_ns };
	}
}

static void leave(struct desk *desk, struct desk_client *client)
{
	desk->refused++;
	close(client->fd);
	*client = (struct desk_client){ .fd = -1 };
}

/* Its one request, if it has come. */
static void hear(struct desk *desk, struct desk_client *client, uint64_t now_ns)
{
	char request[DESK_REQUEST_MAX + 1];
	ssize_t length = recv(client->fd, request, sizeof(request), MSG_DONTWAIT);

	if (length < 0 && (errno == EAGAIN || errno == EINTR)) {
		if (now_ns - client->since_ns > ASKING_NS)
			leave(desk, client);
		return;
	}
	if (length <= 0) {
		leave(desk, client);
		return;
	}
	if (length > DESK_REQUEST_MAX || memchr(request, '\0', (size_t)length)) {
		desk_answer(desk, client, false, "a request has at most %d characters",
			    DESK_REQUEST_MAX);
		return;
	}
	request[length] = '\0';
	desk_begin(desk, client, request, now_ns);
}

void desk_take_results(struct desk *desk, uint64_t now_ns)
{
	struct loop_order order;

	while (loop_order_result(desk->loop, &order))
		for (size_t i = 0; i < DESK_CLIENTS; i++)
			if (desk->client[i].phase == DESK_ORDERED && desk->client[i].id == order.id)
				desk_executed(desk, &desk->client[i], order.result, now_ns);
}

void desk_run(struct desk *desk, uint64_t now_ns)
{
	desk_take_results(desk, now_ns);
	if (desk->listen_fd < 0)
		return;
	take_clients(desk, now_ns);
	for (size_t i = 0; i < DESK_CLIENTS; i++) {
		struct desk_client *client = &desk->client[i];

		if (client->phase == DESK_ASKING)
			hear(desk, client, now_ns);
		else if (client->phase != DESK_FREE)
			desk_watch(desk, client, now_ns);
	}
}

void desk_close(struct desk *desk)
{
	for (size_t i = 0; i < DESK_CLIENTS; i++)
		if (desk->client[i].phase != DESK_FREE)
			desk_answer(desk, &desk->client[i], false, "the daemon is ending");
	if (desk->listen_fd >= 0)
		close(desk->listen_fd);
	if (*desk->socket)
		unlink(desk->socket);
	desk->listen_fd = -1;
	desk->socket[0] = '\0';
}
