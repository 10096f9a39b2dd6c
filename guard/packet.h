/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Reading a frame, for the program in the kernel; judging it is not done here.
 *
 * Tags (802.1Q, 802.1ad) are read over, at most two, whatever VLAN they name: a
 * card that takes them out of the frame hides them from a program of XDP, so a rule
 * that asked for them would depend on a setting of the card (rxvlan). Behind a
 * tag stands what would stand there without.
 *
 * Every pointer is compared with the end before it is read, as the verifier wants
 * it. Lengths out of the frame are compared with what is left and not added to a
 * pointer: the verifier of Linux 6.1 has no bounds for a number whose bytes were
 * turned round, and refuses the program. A frame in several buffers never comes here:
 * the kernel makes it one, or does not let the program into the driver.
 */
#ifndef GUARD_PACKET_H
#define GUARD_PACKET_H

#include <linux/if_ether.h>
#include <linux/in.h>
#include <linux/ip.h>
#include <linux/udp.h>
#include <bpf/bpf_endian.h>
#include <bpf/bpf_helpers.h>

enum { PACKET_TAGS = 2, PACKET_MORE = 0x2000, PACKET_OFFSET = 0x1fff };

enum packet_kind { PACKET_BROKEN, PACKET_LINK, PACKET_ARP, PACKET_IP, PACKET_OTHER };

struct packet {
	const __u8 *payload, *end;
	__u32 source;
	__u16 port, to_port; /* of the sender and ours, big-endian */
	__u16 length;        /* of the payload */
};

struct packet_tag {
	__u16 control, type; /* big-endian */
};

static __always_inline int is_tag(__u16 type)
{
	return type == bpf_htons(ETH_P_8021Q) || type == bpf_htons(ETH_P_8021AD);
}

/*
 * 01:80:c2:00:00:00 to 0f: what two ends of one cable tell each other and no bridge
 * forwards (802.1Q, table 8-1): LACP, without which a bond has no link; 802.1X, spanning
 * tree, LLDP.
 */
static __always_inline int is_link_local(const __u8 *to)
{
	return to[0] == 0x01 && to[1] == 0x80 && to[2] == 0xc2 && to[3] == 0 && to[4] == 0 &&
	       to[5] < 0x10;
}

/* *next = what follows Ethernet's header and tags; *tagged = there were some. */
static __always_inline enum packet_kind read_ethernet(const void *data, const void *end,
						      const void **next, int *tagged)
{
	const struct ethhdr *ethernet = data;
	const struct packet_tag *tag = (const void *)(ethernet + 1);
	__u16 type;

	if ((const void *)tag > end)
		return PACKET_BROKEN;
	if (is_link_local(ethernet->h_dest))
		return PACKET_LINK;
	type = ethernet->h_proto;
	for (int i = 0; i < PACKET_TAGS && is_tag(type); i++) {
		if ((const void *)(tag + 1) > end)
			return PACKET_BROKEN;
		type = tag->type;
		tag++;
		*tagged = 1;
	}
	*next = tag;
	if (type == bpf_htons(ETH_P_ARP))
		return PACKET_ARP;
	return type == bpf_htons(ETH_P_IP) ? PACKET_IP : PACKET_OTHER;
}

static __always_inline int is_first_of_several(const struct iphdr *ip)
{
	return ip->frag_off & bpf_htons(PACKET_MORE) && !(ip->frag_off & bpf_htons(PACKET_OFFSET));
}

/*
 * The header of a datagram, or of the first fragment of one. 0 if it is broken: a whole
 * one has to be there as long as it says, in what IP says, in the frame.
 */
static __always_inline int read_udp(const struct iphdr *ip, struct packet *out)
{
	const struct udphdr *udp = (const void *)ip + ip->ihl * 4;
	__u32 length;

	if ((const void *)(udp + 1) > (const void *)out->end)
		return 0;
	length = bpf_ntohs(udp->len);
	if (length < sizeof(*udp))
		return 0;
	if (!is_first_of_several(ip) && (ip->ihl * 4 + length > bpf_ntohs(ip->tot_len) ||
					 length > out->end - (const __u8 *)udp))
		return 0;
	out->payload = (const void *)(udp + 1);
	out->port = udp->source;
	out->to_port = udp->dest;
	out->length = length - sizeof(*udp);
	return 1;
}

#endif
