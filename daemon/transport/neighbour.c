// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Route and neighbour as the kernel has them.
 *
 * There is no ARP of our own: the kernel resolves addresses for its sockets,
 * keeps the entries fresh, knows routers and what an administrator has fixed
 * (nud permanent), and two that answer for one address would quarrel. Here it
 * is only asked, by netlink (RTM_GETROUTE, RTM_GETNEIGH; Linux 5.0 for a
 * single entry), which any user may.
 *
 * The route is asked for with the socket's own address as the source: the
 * kernel refuses that when the address was taken off the interface, and then
 * frames with it must not leave.
 */
#include <arpa/inet.h>
#include <errno.h>
#include <linux/if_vlan.h>
#include <linux/neighbour.h>
#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <linux/sockios.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>
#include "daemon/transport/neighbour.h"

enum {
	ANSWER = 4096,
	VALID = NUD_PERMANENT | NUD_NOARP | NUD_REACHABLE | NUD_PROBE | NUD_STALE | NUD_DELAY
};

struct question {
	struct nlmsghdr head;
	union {
		struct rtmsg route;
		struct ndmsg neighbour;
	};
	uint8_t attributes[64];
};

int neighbour_open(void)
{
	const struct timeval limit = { .tv_usec = 200000 };
	int fd = socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE);

	if (fd >= 0)
		setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof(limit));
	return fd < 0 ? -errno : fd;
}

static void begin(struct question *q, uint16_t type, size_t size)
{
	static uint32_t sequence;

	memset(q, 0, sizeof(*q));
	q->head.nlmsg_len = (uint32_t)NLMSG_LENGTH(size);
	q->head.nlmsg_type = type;
	q->head.nlmsg_flags = NLM_F_REQUEST;
	q->head.nlmsg_seq = __atomic_add_fetch(&sequence, 1, __ATOMIC_RELAXED);
}

static void attach(struct question *q, uint16_t type, uint32_t value)
{
	struct rtattr *a = (void *)((char *)q + NLMSG_ALIGN(q->head.nlmsg_len));

	a->rta_type = type;
	a->rta_len = RTA_LENGTH(sizeof(value));
	memcpy(RTA_DATA(a), &value, sizeof(value));
	q->head.nlmsg_len = NLMSG_ALIGN(q->head.nlmsg_len) + RTA_SPACE(sizeof(value));
}

/* The answer to this question in `answer`; 0 or -errno, also the kernel's. */
static int ask(int fd, struct question *q, void *answer)
{
	struct nlmsghdr *head = answer;
	ssize_t length;

	if (send(fd, q, q->head.nlmsg_len, 0) < 0)
		return -errno;
	do { /* an answer to an earlier one that came too late is passed over */
		length = recv(fd, answer, ANSWER, 0);
		if (length < 0)
			return -errno;
	} while ((size_t)length < sizeof(*head) || head->nlmsg_seq != q->head.nlmsg_seq);
	if (!NLMSG_OK(head, (size_t)length))
		return -EBADMSG;
	if (head->nlmsg_type == NLMSG_ERROR) {
		const struct nlmsgerr *error = NLMSG_DATA(head);

		return error->error ? error->error : -EBADMSG;
	}
	return 0;
}

/* An attribute of at least `size` bytes, NULL if there is none. */
static const void *find(struct nlmsghdr *head, size_t fixed, uint16_t type, size_t size)
{
	struct rtattr *a = (void *)((char *)NLMSG_DATA(head) + NLMSG_ALIGN(fixed));
	size_t left = head->nlmsg_len - NLMSG_LENGTH(fixed);

	for (; RTA_OK(a, left); a = RTA_NEXT(a, left))
		if (a->rta_type == type && RTA_PAYLOAD(a) >= size)
			return RTA_DATA(a);
	return NULL;
}

/* Who the packet is handed to, network byte order. */
static int next_hop(int fd, uint32_t index, uint32_t from, uint32_t to, uint32_t *hop)
{
	_Alignas(8) uint8_t answer[ANSWER];
	struct nlmsghdr *head = (void *)answer;
	const struct rtmsg *route = NLMSG_DATA(head);
	const void *found;
	struct question q;
	int rc;

	begin(&q, RTM_GETROUTE, sizeof(q.route));
	q.route.rtm_family = AF_INET;
	q.route.rtm_dst_len = q.route.rtm_src_len = 32;
	attach(&q, RTA_DST, htonl(to));
	attach(&q, RTA_SRC, htonl(from));
	attach(&q, RTA_OIF, index);
	rc = ask(fd, &q, answer);
	if (rc < 0)
		return rc == -EAGAIN ? rc : -EHOSTUNREACH;
	if (head->nlmsg_type != RTM_NEWROUTE || route->rtm_type != RTN_UNICAST)
		return -EHOSTUNREACH;
	found = find(head, sizeof(*route), RTA_GATEWAY, sizeof(*hop));
	*hop = htonl(to);
	if (found)
		memcpy(hop, found, sizeof(*hop));
	return 0;
}

int neighbour_find(int fd, uint32_t index, uint32_t from, uint32_t to, struct neighbour *out)
{
	_Alignas(8) uint8_t answer[ANSWER];
	struct nlmsghdr *head = (void *)answer;
	const struct ndmsg *entry = NLMSG_DATA(head);
	const void *mac;
	struct question q;
	uint32_t hop;
	int rc = next_hop(fd, index, from, to, &hop);

	if (rc < 0)
		return rc;
	begin(&q, RTM_GETNEIGH, sizeof(q.neighbour));
	q.neighbour.ndm_family = AF_INET;
	q.neighbour.ndm_ifindex = (int)index;
	attach(&q, NDA_DST, hop);
	rc = ask(fd, &q, answer);
	if (rc < 0)
		return rc;
	mac = find(head, sizeof(*entry), NDA_LLADDR, FRAME_MAC);
	if (head->nlmsg_type != RTM_NEWNEIGH || !(entry->ndm_state & VALID) || !mac)
		return -ENOENT;
	memcpy(out->mac, mac, FRAME_MAC);
	out->stale = entry->ndm_state & NUD_STALE;
	return 0;
}

/* An ioctl that any socket takes. 0 or -errno. */
static int ask_driver(unsigned long what, void *request)
{
	int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
	int rc;

	if (fd < 0)
		return -errno;
	rc = ioctl(fd, what, request) < 0 ? -errno : 0;
	close(fd);
	return rc;
}

int neighbour_own(const char *interface, uint8_t mac[FRAME_MAC])
{
	struct ifreq request = { 0 };
	int rc;

	snprintf(request.ifr_name, sizeof(request.ifr_name), "%s", interface);
	rc = ask_driver(SIOCGIFHWADDR, &request);
	if (rc < 0)
		return rc;
	if (request.ifr_hwaddr.sa_family != ARPHRD_ETHER)
		return -EPROTONOSUPPORT;
	memcpy(mac, request.ifr_hwaddr.sa_data, FRAME_MAC);
	return 0;
}

bool neighbour_is_upper(const char *interface)
{
	struct vlan_ioctl_args vlan = { .cmd = GET_VLAN_VID_CMD };
	struct ifreq request = { 0 };

	snprintf(vlan.device1, sizeof(vlan.device1), "%s", interface);
	if (!ask_driver(SIOCGIFVLAN, &vlan))
		return true;
	snprintf(request.ifr_name, sizeof(request.ifr_name), "%s", interface);
	return !ask_driver(SIOCGIFFLAGS, &request) && request.ifr_flags & IFF_MASTER;
}
