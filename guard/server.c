// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * AF_XDP sockets for a daemon that may not make any.
 *
 * One client at a time, for one queue has one socket: the next one waits until
 * the first has gone. To be directed to it, it can have what this guard has judged
 * to be a device's reply to one of its ports, nothing of anybody else's. But the
 * socket sends as well, any frame, which is otherwise for those with CAP_NET_RAW. So
 * the group, whose members command devices, is not enough: the client is root, or
 * the user that the daemon's service has. Whoever else connects is sent away.
 *
 * A client that does not ask, or asks and never joins, has its place only as long as
 * nobody else wants it, or a little longer: it hangs.
 *
 * A client that has gone is forgotten: its ports are cleared, so that its
 * successor's replies are not looked for in a map where nobody is. Its socket
 * leaves the map by itself. When we are killed, map and ports stay as they are
 * and the daemon goes on; it connects anew to the next guard.
 */
#include <arpa/inet.h>
#include <bpf/bpf.h>
#include <dirent.h>
#include <errno.h>
#include <grp.h>
#include <net/if.h>
#include <pwd.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>
#include "daemon/control/log.h"
#include "daemon/device/event.h"
#include "daemon/transport/handover.h"
#include "guard/rules.h"
#include "guard/server.h"

/* Less than a client waits for its first answer, so that the next one is still there. */
#define SILENT_NS UINT64_C(400000000)
#define JOIN_NS UINT64_C(10000000000)	/* a daemon prepares itself between the two */

_Static_assert((int)HANDOVER_PORTS == (int)GUARD_DEVICES, "a port for each device");

static int listen_at(const char *path)
{
	const struct group *group = getgrnam("pokeys");
	struct sockaddr_un at = { .sun_family = AF_UNIX };
	int fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
	mode_t before;
	int rc;

	if (fd < 0)
		return -errno;
	snprintf(at.sun_path, sizeof(at.sun_path), "%s", path);
	unlink(path);
	before = umask(0177);
	rc = bind(fd, (struct sockaddr *)&at, sizeof(at)) < 0 ? -errno : 0;
	umask(before);
	if (rc == 0 && group && (chown(path, (uid_t)-1, group->gr_gid) || chmod(path, 0660)))
		log_line(EVENT_WARNING, "%s: cannot be given to group pokeys: %s", path,
			 strerror(errno));
	if (rc == 0 && listen(fd, 4) < 0)
		rc = -errno;
	if (rc < 0)
		close(fd);
	return rc < 0 ? rc : fd;
}

int guard_server_open(struct guard_server *server, const char *path, int sockets, int ports)
{
	server->path = path;
	server->sockets = sockets;
	server->ports = ports;
	server->client = -1;
	server->listener = listen_at(path);
	return server->listener < 0 ? server->listener : 0;
}

static int set_ports(const struct guard_server *server, const uint16_t port[HANDOVER_PORTS])
{
	struct guard_ports ports;
	uint32_t zero = 0;

	for (int i = 0; i < GUARD_DEVICES; i++)
		ports.port[i] = htons(port[i]);
	return bpf_map_update_elem(server->ports, &zero, &ports, BPF_ANY) ? -errno : 0;
}

static void forget(struct guard_server *server)
{
	static const uint16_t none[HANDOVER_PORTS];

	if (server->client < 0)
		return;
	set_ports(server, none);
	close(server->client);
	server->client = -1;
}

static bool may_ask(int client)
{
	const struct passwd *daemon = getpwnam("pokeys");
	struct ucred who;
	socklen_t size = sizeof(who);

	if (getsockopt(client, SOL_SOCKET, SO_PEERCRED, &who, &size))
		return false;
	return who.uid == 0 || (daemon && who.uid == daemon->pw_uid);
}

static void let_in(struct guard_server *server, uint64_t now_ns)
{
	int client = accept4(server->listener, NULL, NULL, SOCK_CLOEXEC | SOCK_NONBLOCK);

	if (client >= 0 && !may_ask(client)) {
		close(client);
		client = -1;
	}
	server->client = client;
	server->joined = false;
	server->patient_until_ns = now_ns + SILENT_NS;
}

static int give(const struct guard_server *server, int *fd)
{
	if (!server->native)
		return -EOPNOTSUPP;
	*fd = socket(AF_XDP, SOCK_RAW | SOCK_CLOEXEC, 0);
	return *fd < 0 ? -errno : 0;
}

static int queues_of(uint32_t index)
{
	char name[IF_NAMESIZE] = "", path[64];
	struct dirent *entry;
	int count = 0;
	DIR *folder;

	if_indextoname(index, name);
	snprintf(path, sizeof(path), "/sys/class/net/%s/queues", name);
	folder = opendir(path);
	while (folder && (entry = readdir(folder)))
		count += !strncmp(entry->d_name, "rx-", 3);
	if (folder)
		closedir(folder);
	return count;
}

static int enter(const struct guard_server *server, const struct handover_request *request, int fd)
{
	int rc, queues;

	if (fd < 0)
		return -EBADF;
	if (request->queue >= GUARD_QUEUES)
		return -EINVAL;
	if (bpf_map_update_elem(server->sockets, &request->queue, &fd, BPF_ANY))
		return -errno;
	rc = set_ports(server, request->port);
	if (rc < 0)
		return rc;
	log_line(EVENT_INFO, "the daemon's replies go into its AF_XDP socket");
	queues = queues_of(server->index);
	if (queues > 1)
		log_line(EVENT_NOTICE,
			 "the interface has %d receive queues; replies that come in "
			 "at another than the first go through the kernel's network stack "
			 "(ethtool -L ... combined 1)",
			 queues);
	return 0;
}

static int answer(struct guard_server *server, const struct handover_request *request, int came,
		  uint64_t now_ns)
{
	struct handover_answer answer = { .version = HANDOVER_VERSION };
	int fd = -1;
	long sent;

	if (request->version != HANDOVER_VERSION)
		answer.result = -EPROTO;
	else if (!server->index)
		answer.result = -ENODEV;
	else if (request->index != server->index)
		answer.result = -EXDEV;
	else if (request->what == HANDOVER_ASK)
		answer.result = give(server, &fd);
	else if (request->what == HANDOVER_JOIN)
		answer.result = enter(server, request, came);
	else
		answer.result = -EINVAL;
	sent = handover_send(server->client, &answer, sizeof(answer), fd);
	if (fd >= 0)
		close(fd);
	server->joined |= request->what == HANDOVER_JOIN && !answer.result;
	server->patient_until_ns = now_ns + JOIN_NS;
	return sent < 0 ? (int)sent : 0;
}

static void attend(struct guard_server *server, uint64_t now_ns)
{
	struct handover_request request = { 0 };
	int came, rc = -EPROTO;
	long length = handover_receive(server->client, &request, sizeof(request), &came);

	if (length == -EAGAIN || length == -EINTR)
		return;
	/* A request of another length comes from a daemon of another version. It is answered
	 * with EPROTO. */
	if (length == (long)sizeof(request) ||
	    (length > 0 && request.version && request.version != HANDOVER_VERSION))
		rc = answer(server, &request, came, now_ns);
	if (came >= 0)
		close(came);
	if (rc < 0)
		forget(server);
}

static bool somebody_waits(const struct guard_server *server)
{
	struct pollfd p = { .fd = server->listener, .events = POLLIN };

	return poll(&p, 1, 0) == 1;
}

/* Its place is wanted, and it does nothing with it. */
static bool hangs(const struct guard_server *server, uint64_t now_ns)
{
	return server->client >= 0 && !server->joined && now_ns >= server->patient_until_ns &&
	       somebody_waits(server);
}

void guard_server_run(struct guard_server *server, struct pollfd fds[GUARD_SERVER_FDS],
		      uint64_t now_ns)
{
	if (server->client >= 0 && fds[1].revents)
		attend(server, now_ns);
	if (hangs(server, now_ns))
		forget(server);
	if (server->listener >= 0 && server->client < 0)
		let_in(server, now_ns);
	fds[0] = (struct pollfd){ .fd = server->client < 0 ? server->listener : -1,
				  .events = POLLIN };
	fds[1] = (struct pollfd){ .fd = server->client, .events = POLLIN };
}

void guard_server_close(struct guard_server *server)
{
	forget(server);
	if (server->listener < 0)
		return;
	close(server->listener);
	server->listener = -1;
	unlink(server->path);
}
