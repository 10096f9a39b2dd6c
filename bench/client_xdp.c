// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The way past the kernel's network stack: an AF_XDP socket in copy mode, bare,
 * with frames written by hand. All questions are put into the ring and sent with
 * one call; answers show in memory.
 *
 * Everything of the machine's network stays as it is: the program in the kernel
 * takes the device's answers to our port and nothing else, and is gone with this
 * process, for its link is not pinned.
 */
#include <arpa/inet.h>
#include <bpf/bpf.h>
#include <bpf/libbpf.h>
#include <errno.h>
#include <linux/if_ether.h>
#include <linux/if_link.h>
#include <linux/if_xdp.h>
#include <linux/ip.h>
#include <linux/udp.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>
#include "bench/client.h"
#include "redirect.skel.h"

enum { SLOTS = 64, FRAME = 2048, HEAD = 42 }; /* frames 0..63 go out, 64..127 come in */

struct ring {
	uint32_t *producer, *consumer;
	void *entry;
};

static struct redirect_bpf *program;
static struct ring fill, completion, in, out;
static uint8_t *frames, head[HEAD];
static int xdp = -1;

static const char *attach(const struct client *c, bool redirecting)
{
	struct sockaddr_in own;
	char name[16];
	const char *why = client_interface(c, &own, name);
	const uint32_t modes[] = { XDP_FLAGS_DRV_MODE, XDP_FLAGS_SKB_MODE };
	struct sockaddr_in device;
	socklen_t size = sizeof(device);

	if (why)
		return why;
	libbpf_set_print(NULL);
	program = redirect_bpf__open();
	if (!program || getpeername(c->fd, (struct sockaddr *)&device, &size) < 0)
		return "the XDP program cannot be opened";
	program->rodata->device_port = redirecting ? device.sin_port : 0;
	program->rodata->own_port = own.sin_port;
	if (redirect_bpf__load(program))
		return "the kernel refuses XDP programs (CAP_BPF, CAP_NET_ADMIN)";
	for (int i = 0; i < 2; i++) {
		LIBBPF_OPTS(bpf_link_create_opts, options, .flags = modes[i]);

		if (bpf_link_create(bpf_program__fd(program->progs.redirect),
				    (int)if_nametoindex(name), BPF_XDP, &options) >= 0)
			return NULL;
	}
	return "the interface takes no XDP program";
}

const char *client_make_polled(const struct client *c)
{
	return attach(c, false);
}

/* One of the four rings, into our memory. */
static bool map_ring(struct ring *ring, const struct xdp_ring_offset *at, uint64_t page,
		     size_t entry)
{
	uint8_t *memory = mmap(NULL, at->desc + SLOTS * entry, PROT_READ | PROT_WRITE,
			       MAP_SHARED | MAP_POPULATE, xdp, (off_t)page);

	if (memory == MAP_FAILED)
		return false;
	ring->producer = (uint32_t *)(void *)(memory + at->producer);
	ring->consumer = (uint32_t *)(void *)(memory + at->consumer);
	ring->entry = memory + at->desc;
	return true;
}

static bool make_rings(void)
{
	const struct xdp_umem_reg area = { .addr = (uintptr_t)frames,
					   .len = 2 * SLOTS * FRAME,
					   .chunk_size = FRAME };
	const int names[] = { XDP_UMEM_FILL_RING, XDP_UMEM_COMPLETION_RING, XDP_RX_RING,
			      XDP_TX_RING };
	const int slots = SLOTS;
	struct xdp_mmap_offsets at;
	socklen_t size = sizeof(at);

	if (setsockopt(xdp, SOL_XDP, XDP_UMEM_REG, &area, sizeof(area)) < 0)
		return false;
	for (int i = 0; i < 4; i++)
		if (setsockopt(xdp, SOL_XDP, names[i], &slots, sizeof(slots)) < 0)
			return false;
	return !getsockopt(xdp, SOL_XDP, XDP_MMAP_OFFSETS, &at, &size) &&
	       map_ring(&fill, &at.fr, XDP_UMEM_PGOFF_FILL_RING, sizeof(uint64_t)) &&
	       map_ring(&completion, &at.cr, XDP_UMEM_PGOFF_COMPLETION_RING, sizeof(uint64_t)) &&
	       map_ring(&in, &at.rx, XDP_PGOFF_RX_RING, sizeof(struct xdp_desc)) &&
	       map_ring(&out, &at.tx, XDP_PGOFF_TX_RING, sizeof(struct xdp_desc));
}

static void give_frame(uint64_t address)
{
	uint32_t at = *fill.producer;

	((uint64_t *)fill.entry)[at % SLOTS] = address & ~(uint64_t)(FRAME - 1);
	__atomic_store_n(fill.producer, at + 1, __ATOMIC_RELEASE);
}

static const char *open_rings(unsigned int index)
{
	const struct sockaddr_xdp to = { .sxdp_family = AF_XDP,
					 .sxdp_ifindex = index,
					 .sxdp_flags = XDP_COPY };
	const uint32_t key = 0;

	frames = mmap(NULL, 2 * SLOTS * FRAME, PROT_READ | PROT_WRITE,
		      MAP_PRIVATE | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
	xdp = socket(AF_XDP, SOCK_RAW | SOCK_CLOEXEC, 0);
	if (xdp < 0 || frames == MAP_FAILED)
		return "the kernel has no AF_XDP, or CAP_NET_RAW is missing";
	if (!make_rings() || bind(xdp, (const struct sockaddr *)&to, sizeof(to)) < 0)
		return "the interface takes no AF_XDP socket";
	for (uint64_t i = 0; i < SLOTS - 1; i++)
		give_frame((SLOTS + i) * FRAME);
	if (bpf_map_update_elem(bpf_map__fd(program->maps.sockets), &key, &xdp, 0))
		return "the socket cannot be put into the map";
	return NULL;
}

/* The neighbour's address; the kernel has it, for a question was answered before. */
static bool find_neighbour(const struct client *c, const char *name,
			   const struct sockaddr_in *device, uint8_t address[ETH_ALEN])
{
	struct arpreq request = { 0 };

	memcpy(&request.arp_pa, device, sizeof(*device));
	strcpy(request.arp_dev, name);
	if (ioctl(c->fd, SIOCGARP, &request) < 0)
		return false;
	memcpy(address, request.arp_ha.sa_data, ETH_ALEN);
	return true;
}

static uint16_t sum_of(const struct iphdr *ip)
{
	uint16_t words[10];
	uint32_t sum = 0;

	memcpy(words, ip, sizeof(words));
	for (int i = 0; i < 10; i++)
		sum += words[i];
	while (sum >> 16)
		sum = (sum & 0xffff) + (sum >> 16);
	return (uint16_t)~sum;
}

/* All that stands before a question, the same for each. */
static const char *write_head(const struct client *c, const char *name,
			      const struct sockaddr_in *own)
{
	struct ethhdr ethernet = { .h_proto = htons(ETH_P_IP) };
	struct iphdr ip = { .version = 4,
			    .ihl = 5,
			    .ttl = 64,
			    .protocol = IPPROTO_UDP,
			    .tot_len = htons(sizeof(ip) + sizeof(struct udphdr) + ASK_PACKET) };
	struct udphdr udp = { .source = own->sin_port, .len = htons(sizeof(udp) + ASK_PACKET) };
	struct sockaddr_in device;
	socklen_t size = sizeof(device);
	struct ifreq request = { 0 };

	strcpy(request.ifr_name, name);
	if (getpeername(c->fd, (struct sockaddr *)&device, &size) < 0 ||
	    ioctl(c->fd, SIOCGIFHWADDR, &request) < 0)
		return "the interface has no address";
	if (!find_neighbour(c, name, &device, ethernet.h_dest))
		return "the device is not on this network";
	memcpy(ethernet.h_source, request.ifr_hwaddr.sa_data, ETH_ALEN);
	ip.saddr = own->sin_addr.s_addr;
	ip.daddr = device.sin_addr.s_addr;
	ip.check = sum_of(&ip);
	udp.dest = device.sin_port;
	memcpy(head, &ethernet, sizeof(ethernet));
	memcpy(head + sizeof(ethernet), &ip, sizeof(ip));
	memcpy(head + sizeof(ethernet) + sizeof(ip), &udp, sizeof(udp));
	return NULL;
}

static const char *open_xdp(struct client *c)
{
	struct sockaddr_in own;
	char name[16];
	const char *why = client_interface(c, &own, name);

	if (why)
		return why;
	client_socket_ways[0].cycle(c);
	why = write_head(c, name, &own);
	if (!why)
		why = attach(c, true);
	return why ? why : open_rings(if_nametoindex(name));
}

/* Frames that have left are free again; every cycle begins with all of them. */
static void send_all(struct client *c)
{
	uint32_t at = *out.producer;

	client_stamp_all(c);
	for (int i = 0; i < c->ask.count; i++, at++) {
		const uint64_t address = (uint64_t)(at % SLOTS) * FRAME;

		memcpy(frames + address, head, HEAD);
		memcpy(frames + address + HEAD, c->ask.question[i], ASK_PACKET);
		((struct xdp_desc *)out.entry)[at % SLOTS] =
			(struct xdp_desc){ .addr = address, .len = HEAD + ASK_PACKET };
	}
	__atomic_store_n(out.producer, at, __ATOMIC_RELEASE);
	sendto(xdp, NULL, 0, MSG_DONTWAIT, NULL, 0);
	__atomic_store_n(completion.consumer,
			 __atomic_load_n(completion.producer, __ATOMIC_ACQUIRE), __ATOMIC_RELEASE);
}

static void cycle(struct client *c)
{
	send_all(c);
	while (c->open && !client_late(c)) {
		uint32_t at = *in.consumer;

		for (; at != __atomic_load_n(in.producer, __ATOMIC_ACQUIRE); at++) {
			const struct xdp_desc *d = &((const struct xdp_desc *)in.entry)[at % SLOTS];

			client_take(c, frames + d->addr + HEAD, (ssize_t)d->len - HEAD);
			give_frame(d->addr);
		}
		__atomic_store_n(in.consumer, at, __ATOMIC_RELEASE);
	}
}

const struct client_way client_xdp_ways[] = {
	{ "xdp", true, open_xdp, cycle },
	{ 0 },
};
