// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * NAPI instances of an interface, by generic netlink (family "netdev", Linux
 * 6.8; any user may ask). A socket only knows the one that its last packet came
 * through, and at the start there was no packet yet.
 *
 * The numbers are the kernel's (linux/netdev.h), which Debian 12's headers do
 * not have. Only answers are counted that carry a NAPI id: one without cannot be
 * polled.
 */
#include <errno.h>
#include <linux/genetlink.h>
#include <linux/netlink.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>
#include "daemon/transport/napi.h"

enum {
	NAPI_GET = 11, /* NETDEV_CMD_NAPI_GET */
	NAPI_IFINDEX = 1,
	NAPI_ID = 2, /* NETDEV_A_NAPI_... */
	ANSWER = 16384,
	HEAD = 4, /* of an attribute: length and type */
};

struct question {
	struct nlmsghdr head;
	struct genlmsghdr command;
	uint8_t attributes[32];
};

static void begin(struct question *q, uint16_t family, uint16_t flags, uint8_t command)
{
	memset(q, 0, sizeof(*q));
	q->head.nlmsg_len = NLMSG_LENGTH(GENL_HDRLEN);
	q->head.nlmsg_type = family;
	q->head.nlmsg_flags = (uint16_t)(NLM_F_REQUEST | flags);
	q->command.cmd = command;
	q->command.version = 1;
}

static void attach(struct question *q, uint16_t type, const void *value, uint16_t size)
{
	struct nlattr *a = (void *)((char *)q + q->head.nlmsg_len);

	a->nla_type = type;
	a->nla_len = (uint16_t)(HEAD + size);
	memcpy((char *)a + HEAD, value, size);
	q->head.nlmsg_len += (uint32_t)NLA_ALIGN(a->nla_len);
}

/* An attribute of at least `size` bytes, NULL if there is none. */
static const void *find(const struct nlmsghdr *head, uint16_t type, size_t size)
{
	const char *at = (const char *)NLMSG_DATA(head) + GENL_HDRLEN;
	const char *end = (const char *)head + head->nlmsg_len;

	while (end - at >= HEAD) {
		const struct nlattr *a = (const void *)at;

		if (a->nla_len < HEAD || a->nla_len > end - at)
			return NULL;
		if ((a->nla_type & NLA_TYPE_MASK) == type && a->nla_len - HEAD >= (int)size)
			return at + HEAD;
		at += NLA_ALIGN(a->nla_len);
	}
	return NULL;
}

static int error_in(const struct nlmsghdr *head)
{
	const struct nlmsgerr *error = NLMSG_DATA(head);

	return error->error ? error->error : -EBADMSG;
}

static int find_family(int fd, uint16_t *out)
{
	_Alignas(8) char answer[ANSWER];
	const struct nlmsghdr *head = (void *)answer;
	struct question q;
	const void *id;
	ssize_t length;

	begin(&q, GENL_ID_CTRL, 0, CTRL_CMD_GETFAMILY);
	attach(&q, CTRL_ATTR_FAMILY_NAME, "netdev", sizeof("netdev"));
	if (send(fd, &q, q.head.nlmsg_len, 0) < 0)
		return -errno;
	length = recv(fd, answer, sizeof(answer), 0);
	if (length < 0)
		return -errno;
	if (!NLMSG_OK(head, (size_t)length))
		return -EBADMSG;
	if (head->nlmsg_type == NLMSG_ERROR)
		return error_in(head);
	id = find(head, CTRL_ATTR_FAMILY_ID, sizeof(*out));
	if (!id)
		return -EBADMSG;
	memcpy(out, id, sizeof(*out));
	return 0;
}

/* The instances in one part of the answer. 1 = there are more to come, 0 or -errno = not. */
static int count_part(const char *answer, size_t length, int *count)
{
	const struct nlmsghdr *head = (const void *)answer;

	for (; NLMSG_OK(head, length); head = NLMSG_NEXT(head, length)) {
		uint32_t id = 0;
		const void *found;

		if (head->nlmsg_type == NLMSG_DONE)
			return 0;
		if (head->nlmsg_type == NLMSG_ERROR)
			return error_in(head);
		found = find(head, NAPI_ID, sizeof(id));
		if (found)
			memcpy(&id, found, sizeof(id));
		*count += id != 0;
	}
	return 1;
}

static int count(int fd, uint32_t index)
{
	_Alignas(8) char answer[ANSWER];
	uint16_t family = 0;
	struct question q;
	int n = 0, rc = find_family(fd, &family);

	if (rc < 0)
		return rc;
	begin(&q, family, NLM_F_DUMP, NAPI_GET);
	attach(&q, NAPI_IFINDEX, &index, sizeof(index));
	if (send(fd, &q, q.head.nlmsg_len, 0) < 0)
		return -errno;
	do {
		ssize_t length = recv(fd, answer, sizeof(answer), 0);

		if (length < 0)
			return -errno;
		rc = count_part(answer, (size_t)length, &n);
	} while (rc > 0);
	return rc < 0 ? rc : n;
}

int napi_count(uint32_t index)
{
	const struct timeval limit = { .tv_sec = 1 };
	int fd, rc;

	if (!index)
		return -ENODEV;
	fd = socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_GENERIC);
	if (fd < 0)
		return -errno;
	setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof(limit));
	rc = count(fd, index);
	close(fd);
	return rc;
}
