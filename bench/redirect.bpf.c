// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What the AF_XDP client needs in the kernel: answers from the device's port go
 * to its socket, all else takes its way. With port 0 all takes its way, and the
 * interface is merely polled, for packets of an interface with an XDP program
 * have a NAPI id on veth.
 */
#include <linux/bpf.h>
#include <linux/if_ether.h>
#include <linux/in.h>
#include <linux/ip.h>
#include <linux/udp.h>
#include <bpf/bpf_endian.h>
#include <bpf/bpf_helpers.h>

struct {
	__uint(type, BPF_MAP_TYPE_XSKMAP);
	__uint(max_entries, 1);
	__type(key, __u32);
	__type(value, __u32);
} sockets SEC(".maps");

/* Set before the program is loaded; big-endian. */
const volatile __u16 device_port = 0;
const volatile __u16 own_port = 0;

SEC("xdp")
int redirect(struct xdp_md *context)
{
	const void *data = (void *)(long)context->data, *end = (void *)(long)context->data_end;
	const struct ethhdr *ethernet = data;
	const struct iphdr *ip = data + sizeof(*ethernet);
	const struct udphdr *udp = data + sizeof(*ethernet) + sizeof(*ip);

	if (!device_port || (const void *)(udp + 1) > end ||
	    ethernet->h_proto != bpf_htons(ETH_P_IP) || ip->ihl != 5 ||
	    ip->protocol != IPPROTO_UDP || udp->source != device_port || udp->dest != own_port)
		return XDP_PASS;
	return (int)bpf_redirect_map(&sockets, context->rx_queue_index, XDP_PASS);
}

char LICENSE[] SEC("license") = "GPL";
