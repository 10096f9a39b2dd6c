// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * In place of the guard's program, which lets only a device's replies in: here
 * every whole datagram for a port of the transport goes into its AF_XDP socket,
 * so that the same tests run as over sockets.
 */
#include <linux/bpf.h>
#include <linux/if_ether.h>
#include <linux/in.h>
#include <linux/ip.h>
#include <linux/udp.h>
#include <bpf/bpf_endian.h>
#include <bpf/bpf_helpers.h>
#include "daemon/transport/handover.h"
#include "guard/rules.h"

struct {
	__uint(type, BPF_MAP_TYPE_ARRAY);
	__uint(max_entries, 1);
	__type(key, __u32);
	__type(value, struct guard_ports);
} ports SEC(".maps");

struct {
	__uint(type, BPF_MAP_TYPE_XSKMAP);
	__uint(max_entries, GUARD_QUEUES);
	__type(key, __u32);
	__type(value, __u32);
} sockets SEC(".maps");

static __always_inline int is_ours(const void *data, const void *end)
{
	const struct ethhdr *ethernet = data;
	const struct iphdr *ip = (const void *)(ethernet + 1);
	const struct udphdr *udp = (const void *)(ip + 1);
	struct guard_ports *wanted;
	__u32 zero = 0;

	if ((const void *)(udp + 1) > end || ethernet->h_proto != bpf_htons(ETH_P_IP))
		return 0;
	if (ip->protocol != IPPROTO_UDP || ip->ihl != 5 || ip->frag_off & bpf_htons(0x3fff))
		return 0;
	wanted = bpf_map_lookup_elem(&ports, &zero);
	for (int i = 0; wanted && i < GUARD_DEVICES && wanted->port[i]; i++)
		if (wanted->port[i] == udp->dest)
			return 1;
	return 0;
}

SEC("xdp")
int redirect(struct xdp_md *context)
{
	__u32 queue = context->rx_queue_index;
	struct handover_note *note;

	if (!is_ours((void *)(long)context->data, (void *)(long)context->data_end) ||
	    bpf_xdp_adjust_meta(context, -(int)sizeof(*note)))
		return XDP_PASS;
	note = (void *)(long)context->data_meta;
	if ((void *)(note + 1) > (void *)(long)context->data)
		return XDP_PASS;
	note->t_ns = bpf_ktime_get_ns();
	note->magic = HANDOVER_NOTE;
	return bpf_redirect_map(&sockets, queue, XDP_PASS);
}

char licence[] SEC("license") = "GPL";
