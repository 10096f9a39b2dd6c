// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Runs in the kernel for every packet that the guarded interface receives,
 * before the kernel has made anything of it: a flood costs the core some
 * nanoseconds a packet there, and microseconds a packet further up, on the
 * very core that the realtime thread's packets come in at.
 *
 * The rule: ARP passes, a configured device passes, what is not aimed at the
 * daemon passes unless the interface is dedicated. Aimed at the daemon is what
 * comes from a PoKeys port: the daemon's own port is the kernel's choice and
 * changes with each search, while devices answer from theirs only.
 *
 * A device known by its serial number is learnt from its answer to a search,
 * as the daemon learns it. The trap is the other direction: an answer anybody
 * may send must not turn the guard against a device that works, so a device
 * that was heard within half a second stays where it is. Answers to searches
 * have no known sender, so they are few per while instead.
 *
 * A reply for one of the ports that the daemon has asked for goes into its
 * AF_XDP socket, past the kernel's network stack, with the time before it; one
 * that came in at a queue which has no such socket, or in a VLAN, goes the usual way. Loaded
 * for another transport, these lines and their map are not there: a kernel may
 * have XDP and not AF_XDP.
 *
 * Only structures that are part of the kernel's interface to programs are
 * touched, so the object runs on any kernel with XDP, with BTF or without.
 */
#include <linux/bpf.h>
#include <bpf/bpf_helpers.h>
#include "daemon/transport/handover.h"
#include "guard/packet.h"
#include "guard/rules.h"

#define MS 1000000ull

struct while_ {
	__u64 since_ns;
	__u64 passed;
};

struct {
	__uint(type, BPF_MAP_TYPE_PERCPU_ARRAY);
	__uint(max_entries, GUARD_VERDICTS);
	__type(key, __u32);
	__type(value, __u64);
	__uint(pinning, LIBBPF_PIN_BY_NAME);
} counters SEC(".maps");

struct {
	__uint(type, BPF_MAP_TYPE_ARRAY);
	__uint(max_entries, 1);
	__type(key, __u32);
	__type(value, struct guard_table);
	__uint(pinning, LIBBPF_PIN_BY_NAME);
} devices SEC(".maps");

struct {
	__uint(type, BPF_MAP_TYPE_PERCPU_ARRAY);
	__uint(max_entries, 1);
	__type(key, __u32);
	__type(value, struct while_);
} searches SEC(".maps");

struct {
	__uint(type, BPF_MAP_TYPE_ARRAY);
	__uint(max_entries, 1);
	__type(key, __u32);
	__type(value, struct guard_ports);
	__uint(pinning, LIBBPF_PIN_BY_NAME);
} ports SEC(".maps");

struct {
	__uint(type, BPF_MAP_TYPE_XSKMAP);
	__uint(max_entries, GUARD_QUEUES);
	__type(key, __u32);
	__type(value, __u32);
	__uint(pinning, LIBBPF_PIN_BY_NAME);
} sockets SEC(".maps");

/* Set before the program is loaded. */
const volatile __u32 dedicated = 0, have_sockets = 0;

static __always_inline enum guard_verdict of_others(void)
{
	return dedicated ? GUARD_DEDICATED : GUARD_ELSE;
}

/*
 * The device that this comes from; *known = some device has this address. One that was
 * not found yet has 0.0.0.0, as has whoever asks for an address.
 */
static __always_inline struct guard_device *find(struct guard_table *table, __u32 source,
						 __u16 port, int *known)
{
	for (int i = 0; i < GUARD_DEVICES; i++) {
		struct guard_device *device = &table->device[i];

		if (!device->port)
			break;
		if (!device->address || device->address != source)
			continue;
		*known = 1;
		if (device->port == port)
			return device;
	}
	return 0;
}

static __always_inline int is_pokeys_port(const struct guard_table *table, __u16 port)
{
	if (port == bpf_htons(GUARD_PORT))
		return 1;
	for (int i = 0; i < GUARD_DEVICES && table->device[i].port; i++)
		if (table->device[i].port == port)
			return 1;
	return 0;
}

static __always_inline int is_answer(__u16 length)
{
	return length == GUARD_ANSWER || length == GUARD_ANSWER_OLD;
}

/* A few in each while. */
static __always_inline int may_pass(__u64 now)
{
	__u32 zero = 0;
	struct while_ *search = bpf_map_lookup_elem(&searches, &zero);

	if (!search)
		return 0;
	if (now - search->since_ns >= GUARD_ANSWERS_MS * MS) {
		search->since_ns = now;
		search->passed = 0;
	}
	if (search->passed >= GUARD_ANSWERS)
		return 0;
	search->passed++;
	return 1;
}

/* Protocol section 1.9; 0 if the packet is cut off. */
static __always_inline __u32 serial_in(const struct packet *p)
{
	const __u8 *at = p->payload;

	if (p->length == GUARD_ANSWER_OLD)
		return at + 3 > p->end ? 0 : (__u32)at[1] << 8 | at[2];
	if (at + 18 > p->end)
		return 0;
	return at[14] | (__u32)at[15] << 8 | (__u32)at[16] << 16 | (__u32)at[17] << 24;
}

static __always_inline void learn(struct guard_table *table, const struct packet *p, __u64 now)
{
	__u32 serial = serial_in(p);

	for (int i = 0; serial && i < GUARD_DEVICES; i++) {
		struct guard_device *device = &table->device[i];

		if (!device->port)
			break;
		if (device->serial != serial || device->address == p->source)
			continue;
		if (device->address && now - device->heard_ns < GUARD_SILENT_MS * MS)
			continue;
		device->address = p->source;
		device->heard_ns = now;
	}
}

static __always_inline enum guard_verdict judge_answer(struct guard_table *table,
						       const struct packet *p)
{
	__u64 now = bpf_ktime_get_ns();

	if (!may_pass(now))
		return GUARD_EXCESS;
	learn(table, p, now);
	return GUARD_FOUND;
}

static __always_inline int for_socket(__u16 port)
{
	__u32 zero = 0;
	struct guard_ports *wanted = have_sockets ? bpf_map_lookup_elem(&ports, &zero) : 0;

	for (int i = 0; wanted && i < GUARD_DEVICES && wanted->port[i]; i++)
		if (wanted->port[i] == port)
			return 1;
	return 0;
}

static __always_inline enum guard_verdict judge_udp(struct guard_table *table,
						    const struct packet *p)
{
	int known = 0;
	struct guard_device *device = find(table, p->source, p->port, &known);

	if (!device && !is_pokeys_port(table, p->port))
		return known ? GUARD_DEVICE_ELSE : of_others();
	if (is_answer(p->length))
		return judge_answer(table, p);
	if (!device)
		return GUARD_FOREIGN;
	if (p->length != GUARD_REPLY)
		return GUARD_LENGTH;
	device->heard_ns = bpf_ktime_get_ns();
	return for_socket(p->to_port) ? GUARD_SOCKET : GUARD_DEVICE;
}

static __always_inline enum guard_verdict judge_ip(struct guard_table *table,
						   const struct iphdr *ip, const void *end)
{
	struct packet p = { .end = end, .source = ip->saddr };
	int known = 0;

	if (ip->version != 4 || ip->ihl < 5)
		return GUARD_MALFORMED;
	find(table, ip->saddr, 0, &known);
	if ((ip->frag_off & bpf_htons(PACKET_MORE | PACKET_OFFSET)) && (known || dedicated))
		return GUARD_FRAGMENT;
	if (ip->protocol == IPPROTO_ICMP)
		return GUARD_ICMP;
	if (ip->protocol != IPPROTO_UDP || (ip->frag_off & bpf_htons(PACKET_OFFSET)))
		return known ? GUARD_DEVICE_ELSE : of_others();
	return read_udp(ip, &p) ? judge_udp(table, &p) : GUARD_MALFORMED;
}

static __always_inline enum guard_verdict judge(const void *data, const void *end, int *tagged)
{
	struct guard_table *table;
	const void *next = data;
	__u32 zero = 0;

	switch (read_ethernet(data, end, &next, tagged)) {
	case PACKET_LINK:
		return GUARD_LINK;
	case PACKET_ARP:
		return GUARD_ARP;
	case PACKET_OTHER:
		return of_others();
	case PACKET_BROKEN:
		return GUARD_MALFORMED;
	case PACKET_IP:
		break;
	}
	table = bpf_map_lookup_elem(&devices, &zero);
	if (!table || next + sizeof(struct iphdr) > end)
		return GUARD_MALFORMED;
	return judge_ip(table, next, end);
}

/* The time before the packet, where the driver leaves room for it. */
static __always_inline void note_time(struct xdp_md *context)
{
	struct handover_note *note;

	if (bpf_xdp_adjust_meta(context, -(int)sizeof(*note)))
		return;
	note = (void *)(long)context->data_meta;
	if ((void *)(note + 1) > (void *)(long)context->data)
		return;
	note->t_ns = bpf_ktime_get_ns();
	note->magic = HANDOVER_NOTE;
}

SEC("xdp")
int pokeys_guard(struct xdp_md *context)
{
	__u32 queue = context->rx_queue_index, verdict;
	__u64 *count;
	int tagged = 0;

	verdict = judge((void *)(long)context->data, (void *)(long)context->data_end, &tagged);
	if (have_sockets && verdict == GUARD_SOCKET &&
	    (tagged || !bpf_map_lookup_elem(&sockets, &queue)))
		verdict = GUARD_DEVICE;
	count = bpf_map_lookup_elem(&counters, &verdict);
	if (count)
		++*count;
	if (have_sockets && verdict == GUARD_SOCKET) {
		note_time(context);
		return bpf_redirect_map(&sockets, queue, XDP_PASS);
	}
	return verdict < GUARD_FIRST_DROP ? XDP_PASS : XDP_DROP;
}

char licence[] SEC("license") = "GPL";
