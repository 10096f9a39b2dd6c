/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * getifaddrs() would do, if it told the index of the interface. It tells the label of an
 * address instead, and our own address as the broadcast address where none was set.
 */
#include <arpa/inet.h>
#include <errno.h>
#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>
#include "daemon/transport/addresses.h"

enum { ANSWER = 32768, TRIES = 5 };

struct list {
	struct own_address *out;
	size_t room, count;
	unsigned int only;
	int flags_fd; /* any socket: asks for an interface's flags */
};

static int ask(int fd)
{
	struct {
		struct nlmsghdr head;
		struct ifaddrmsg which;
	} question = {
		.head.nlmsg_len = NLMSG_LENGTH(sizeof(struct ifaddrmsg)),
		.head.nlmsg_type = RTM_GETADDR,
		.head.nlmsg_flags = NLM_F_REQUEST | NLM_F_DUMP,
		.which.ifa_family = AF_INET,
	};

	return send(fd, &question, question.head.nlmsg_len, 0) < 0 ? -errno : 0;
}

/* IFF_ flags; 0 for an interface that has gone meanwhile. */
static unsigned int flags_of(const struct list *list, unsigned int index)
{
	struct ifreq request = { 0 };

	if (!if_indextoname(index, request.ifr_name) ||
	    ioctl(list->flags_fd, SIOCGIFFLAGS, &request) < 0)
		return 0;
	return (unsigned short)request.ifr_flags;
}

/* `network` is any address of it: for a point-to-point interface, the other end's. */
static void add(struct list *list, const struct ifaddrmsg *from, uint32_t address, uint32_t network)
{
	const unsigned int flags = flags_of(list, from->ifa_index);
	const uint32_t hosts = from->ifa_prefixlen < 32 ? UINT32_MAX >> from->ifa_prefixlen : 0;
	struct own_address *own = &list->out[list->count];

	if (!address || !(flags & IFF_UP) || list->count == list->room ||
	    (list->only && from->ifa_index != list->only))
		return;
	own->address = address;
	own->broadcasts = flags & IFF_BROADCAST;
	own->broadcast = hosts > 1 ? network | hosts : 0;
	own->interface = from->ifa_index;
	own->prefix = from->ifa_prefixlen;
	own->loopback = flags & IFF_LOOPBACK;
	list->count++;
}

/* Ours is IFA_LOCAL; IFA_ADDRESS is the same, or the other end's. */
static void take(struct list *list, struct nlmsghdr *head)
{
	const struct ifaddrmsg *from = NLMSG_DATA(head);
	uint32_t local = 0, address = 0;
	size_t left = head->nlmsg_len - NLMSG_LENGTH(sizeof(*from));

	for (struct rtattr *a = IFA_RTA(from); RTA_OK(a, left); a = RTA_NEXT(a, left)) {
		if (RTA_PAYLOAD(a) < sizeof(uint32_t))
			continue;
		if (a->rta_type == IFA_LOCAL)
			memcpy(&local, RTA_DATA(a), sizeof(local));
		else if (a->rta_type == IFA_ADDRESS)
			memcpy(&address, RTA_DATA(a), sizeof(address));
	}
	add(list, from, ntohl(local ? local : address), ntohl(address ? address : local));
}

/* One datagram of the answer: 0 = more will come, 1 = that was all, -errno. */
static int read_some(int fd, struct list *list)
{
	_Alignas(8) char answer[ANSWER];
	ssize_t length = recv(fd, answer, sizeof(answer), 0);
	struct nlmsghdr *head = (void *)answer;

	if (length < 0)
		return -errno;
	for (size_t left = (size_t)length; NLMSG_OK(head, left); head = NLMSG_NEXT(head, left)) {
		if (head->nlmsg_flags & NLM_F_DUMP_INTR)
			return -EINTR; /* the list has changed while it was read */
		if (head->nlmsg_type == NLMSG_DONE)
			return 1;
		if (head->nlmsg_type == NLMSG_ERROR)
			return ((const struct nlmsgerr *)NLMSG_DATA(head))->error;
		if (head->nlmsg_type == RTM_NEWADDR)
			take(list, head);
	}
	return 0;
}

static int read_once(struct list *list)
{
	const struct timeval limit = { .tv_sec = 1 };
	int fd = socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE);
	int rc;

	if (fd < 0)
		return -errno;
	setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof(limit));
	list->count = 0;
	rc = ask(fd);
	while (rc == 0)
		rc = read_some(fd, list);
	close(fd);
	return rc;
}

int addresses_own(struct own_address *out, size_t room, unsigned int only)
{
	struct list list = { .out = out, .room = room, .only = only };
	int rc = -EINTR;

	list.flags_fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
	if (list.flags_fd < 0)
		return -errno;
	for (int i = 0; i < TRIES && rc == -EINTR; i++)
		rc = read_once(&list);
	close(list.flags_fd);
	return rc < 0 ? rc : (int)list.count;
}
