// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * /proc/net/arp does not say whether an entry is stale or whether asking for it
 * has failed, so this machine is asked by netlink: a dump of the interface's
 * entries, of which one is looked for. A dump comes in several datagrams; an
 * answer that is cut off or an error means that nothing was seen, not that there
 * is no entry.
 */
#include <arpa/inet.h>
#include <linux/neighbour.h>
#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>
#include "tools/neighbour.h"
#include "tools/probe.h"

enum { ARP_COMPLETE = 2, ARP_PERMANENT = 4, ANSWER_SIZE = 1 << 15 };

struct question {
	struct nlmsghdr head;
	struct ndmsg body;
};

static bool ask(int fd, int interface)
{
	struct question question = {
		.head = { .nlmsg_len = sizeof(question),
			  .nlmsg_type = RTM_GETNEIGH,
			  .nlmsg_flags = NLM_F_REQUEST | NLM_F_DUMP },
		.body = { .ndm_family = AF_INET, .ndm_ifindex = interface },
	};
	const struct timeval patience = { .tv_sec = 1 };

	setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
	return send(fd, &question, sizeof(question), 0) == (ssize_t)sizeof(question);
}

/* An attribute of `size` bytes, NULL if it has none. */
static const unsigned char *attribute(struct nlmsghdr *head, unsigned int type, size_t size)
{
	struct ndmsg *body = NLMSG_DATA(head);
	int left = (int)NLMSG_PAYLOAD(head, sizeof(*body));

	for (struct rtattr *a = (struct rtattr *)(body + 1); RTA_OK(a, left);) {
		int length = (int)RTA_ALIGN(a->rta_len);

		if (a->rta_type == type && RTA_PAYLOAD(a) == size)
			return RTA_DATA(a);
		left -= length;
		a = (struct rtattr *)((char *)a + length);
	}
	return NULL;
}

static bool is_of(struct nlmsghdr *head, int interface, uint32_t address)
{
	const unsigned char *at;
	uint32_t found;

	if (head->nlmsg_type != RTM_NEWNEIGH ||
	    ((struct ndmsg *)NLMSG_DATA(head))->ndm_ifindex != interface)
		return false;
	at = attribute(head, NDA_DST, sizeof(found));
	if (at)
		memcpy(&found, at, sizeof(found));
	return at && ntohl(found) == address;
}

static void take_mac(struct nlmsghdr *head, char mac[NEIGHBOUR_MAC])
{
	const unsigned char *m = attribute(head, NDA_LLADDR, 6);

	if (m)
		snprintf(mac, NEIGHBOUR_MAC, "%02x:%02x:%02x:%02x:%02x:%02x", m[0], m[1], m[2],
			 m[3], m[4], m[5]);
}

static enum neighbour named(unsigned int state)
{
	if (state & (NUD_PERMANENT | NUD_NOARP))
		return NEIGHBOUR_PERMANENT;
	if (state & NUD_REACHABLE)
		return NEIGHBOUR_REACHABLE;
	if (state & (NUD_STALE | NUD_DELAY | NUD_PROBE))
		return NEIGHBOUR_STALE;
	return state & NUD_FAILED ? NEIGHBOUR_FAILED : NEIGHBOUR_NONE;
}

/* One datagram of the dump into *found; false when there is nothing to come behind it. */
static bool take_answer(void *answer, ssize_t length, int interface, uint32_t address,
			enum neighbour *found, char mac[NEIGHBOUR_MAC])
{
	for (struct nlmsghdr *head = answer; NLMSG_OK(head, length);) {
		ssize_t size = NLMSG_ALIGN((ssize_t)head->nlmsg_len);

		if (head->nlmsg_type == NLMSG_ERROR)
			*found = NEIGHBOUR_UNSEEN;
		if (head->nlmsg_type == NLMSG_ERROR || head->nlmsg_type == NLMSG_DONE)
			return false;
		if (is_of(head, interface, address)) {
			*found = named(((struct ndmsg *)NLMSG_DATA(head))->ndm_state);
			take_mac(head, mac);
		}
		length -= size;
		head = (struct nlmsghdr *)((char *)head + size);
	}
	return true;
}

static enum neighbour take_answers(int fd, int interface, uint32_t address, char mac[NEIGHBOUR_MAC])
{
	static char answer[ANSWER_SIZE] __attribute__((aligned(8)));
	enum neighbour found = NEIGHBOUR_NONE;
	ssize_t length;

	do {
		length = recv(fd, answer, sizeof(answer), MSG_TRUNC);
		if (length <= 0 || length > (ssize_t)sizeof(answer))
			return NEIGHBOUR_UNSEEN;
	} while (take_answer(answer, length, interface, address, &found, mac));
	return found;
}

struct entry {
	unsigned int flags;
	char mac[NEIGHBOUR_MAC], nic[16];
};

/* The next complete entry of this address in a table of which *at is the rest. */
static bool next_entry(const char **at, uint32_t address, struct entry *entry)
{
	char text[16], wanted[16];

	snprintf(wanted, sizeof(wanted), "%u.%u.%u.%u", address >> 24, address >> 16 & 255,
		 address >> 8 & 255, address & 255);
	while (*at && (*at = strchr(*at, '\n'))) {
		++*at; /* the first line is the heading */
		if (sscanf(*at, "%15s %*s %x %17s %*s %15s", text, &entry->flags, entry->mac,
			   entry->nic) == 4 &&
		    !strcmp(text, wanted) && entry->flags & (ARP_COMPLETE | ARP_PERMANENT))
			return true;
	}
	return false;
}

static enum neighbour read_table(const char *root, const char *nic, uint32_t address,
				 char mac[NEIGHBOUR_MAC])
{
	char table[1 << 14];
	const char *at = table;
	struct entry entry;

	if (!probe_text(root, table, sizeof(table), "/proc/net/arp"))
		return NEIGHBOUR_UNSEEN;
	while (next_entry(&at, address, &entry)) {
		if (strcmp(entry.nic, nic) != 0)
			continue;
		strcpy(mac, entry.mac);
		return entry.flags & ARP_PERMANENT ? NEIGHBOUR_PERMANENT : NEIGHBOUR_REACHABLE;
	}
	return NEIGHBOUR_NONE;
}

bool neighbour_interface(const char *root, uint32_t address, const char *nic, char found[16])
{
	char table[1 << 14];
	const char *at = table;
	struct entry entry;

	*found = '\0';
	if (!probe_text(root, table, sizeof(table), "/proc/net/arp"))
		return false;
	while (next_entry(&at, address, &entry)) {
		if (!*found || !strcmp(entry.nic, nic))
			strcpy(found, entry.nic);
	}
	return *found;
}

enum neighbour neighbour_look(const char *root, const char *nic, uint32_t address,
			      char mac[NEIGHBOUR_MAC])
{
	int interface = *root ? 0 : (int)if_nametoindex(nic), fd;
	enum neighbour found = NEIGHBOUR_UNSEEN;

	*mac = '\0';
	if (*root)
		return read_table(root, nic, address, mac);
	fd = socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE);
	if (fd < 0)
		return NEIGHBOUR_UNSEEN;
	if (interface && ask(fd, interface))
		found = take_answers(fd, interface, address, mac);
	close(fd);
	return found;
}
