/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A packet socket sees what comes in before the firewall does. Its filter, which the kernel
 * runs, lets pass nothing but UDP over IPv4 between two ports, so that a busy network
 * costs nothing, and what a device says to others is not taken for a reply.
 */
#include <arpa/inet.h>
#include <errno.h>
#include <linux/filter.h>
#include <linux/if_ether.h>
#include <linux/if_packet.h>
#include <netinet/in.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>
#include "daemon/transport/overhear.h"

enum {
	AT_FRAGMENT = 6,
	AT_PROTOCOL = 9,
	AT_SOURCE = 12, /* in the IPv4 header */
	LATER_FRAGMENT = 0x1fff,
};

static int set_filter(int fd, uint16_t from_port, uint16_t to_port)
{
	struct sock_filter code[] = {
		BPF_STMT(BPF_LD | BPF_B | BPF_ABS, AT_PROTOCOL),
		BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, IPPROTO_UDP, 0, 8),
		BPF_STMT(BPF_LD | BPF_H | BPF_ABS, AT_FRAGMENT),
		BPF_JUMP(BPF_JMP | BPF_JSET | BPF_K, LATER_FRAGMENT, 6, 0),
		BPF_STMT(BPF_LDX | BPF_B | BPF_MSH, 0), /* the header's length */
		BPF_STMT(BPF_LD | BPF_H | BPF_IND, 0),  /* both ports are behind it */
		BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, from_port, 0, 3),
		BPF_STMT(BPF_LD | BPF_H | BPF_IND, 2),
		BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, to_port, 0, 1),
		BPF_STMT(BPF_RET | BPF_K, 64),
		BPF_STMT(BPF_RET | BPF_K, 0),
	};
	const struct sock_fprog program = { .len = sizeof(code) / sizeof(code[0]), .filter = code };

	return setsockopt(fd, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof(program)) < 0 ?
		       -errno :
		       0;
}

int overhear_open(uint16_t from_port, uint16_t to_port)
{
	/* of no protocol until the filter is there */
	int fd = socket(AF_PACKET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
	const struct sockaddr_ll all = { .sll_family = AF_PACKET, .sll_protocol = htons(ETH_P_IP) };
	int rc;

	if (fd < 0)
		return -errno;
	rc = set_filter(fd, from_port, to_port);
	if (rc == 0 && bind(fd, (const struct sockaddr *)&all, sizeof(all)) < 0)
		rc = -errno;
	if (rc == 0)
		return fd;
	close(fd);
	return rc;
}

bool overhear_take(int fd, uint32_t *from)
{
	struct sockaddr_ll link = { 0 };
	socklen_t length = sizeof(link);
	uint8_t head[64];
	ssize_t n;

	do { /* our own are seen as well */
		n = recvfrom(fd, head, sizeof(head), 0, (struct sockaddr *)&link, &length);
		if (n < 0)
			return false;
	} while (n < AT_SOURCE + 4 || link.sll_pkttype == PACKET_OUTGOING);
	memcpy(from, head + AT_SOURCE, sizeof(*from));
	*from = ntohl(*from);
	return true;
}
