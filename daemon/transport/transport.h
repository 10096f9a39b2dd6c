/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * How datagrams leave and arrive: open, send, receive, wait until a packet or
 * a deadline. The same functions for a ring (io_uring), plain sockets, AF_XDP
 * and memory (tests).
 *
 * One transport serves every device of the daemon through one wait; each
 * device has a channel, a connected UDP socket of its own.
 *
 * Threads: open, attach, start and close are cold (they allocate, they make
 * system calls); the others belong to the realtime thread, are bounded and
 * allocate nothing. start is called once, by the realtime thread itself, when
 * every channel is attached: from then on the transport is that thread's.
 */
#ifndef TRANSPORT_TRANSPORT_H
#define TRANSPORT_TRANSPORT_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum {
	TRANSPORT_CHANNELS = 64,     /* devices of one daemon */
	TRANSPORT_PACKET_MAX = 2048, /* larger than any datagram that is legal here */
	TRANSPORT_SEND_MAX = 512,    /* the longest that is sent, protocol section 1.6 */
	TRANSPORT_QUEUE = 256,       /* datagrams until a flush; more flush by themselves */
};

enum transport_wait {
	TRANSPORT_WAIT_PACKET, /* something arrived (or may have: receive says) */
	TRANSPORT_WAIT_DEADLINE,
};

struct transport_address {
	uint32_t address;   /* IPv4, host byte order; 0 = none yet */
	uint16_t port;      /* host byte order */
	uint16_t interface; /* index, of the way to it; 0 = as its route says */
};

/* A received datagram; `data` is valid until the next receive or wait. */
struct transport_packet {
	const uint8_t *data;
	size_t length; /* true length, also if it was longer than the buffer */
	uint32_t channel;
	uint32_t address; /* source, host byte order; 0 = unknown */
	uint16_t port;
	uint64_t t_ns; /* CLOCK_MONOTONIC, kernel's receive stamp converted;
			* 0 = none */
};

/* `sent` counts what send() took, `send_failed` what it refused or the kernel did later. */
struct transport_statistics {
	uint64_t sent, send_failed, received, receive_failed;
	uint64_t rearmed; /* multishot receive armed again */
	uint64_t no_buffers, overflow, truncated;
	uint64_t system_calls;   /* made by the realtime functions */
	uint64_t waits_avoided;  /* a completion was there, no call was made */
	uint64_t stamps_refused; /* receive stamps not usable: the wall clock was set */
};

struct transport_options {
	bool spin;             /* wait polls instead of sleeping */
	uint32_t busy_poll_us; /* NAPI busy polling in a sleeping wait, 0 = off */
	const char *interface; /* bind the sockets to this NIC, NULL = any */
	bool keep_port;        /* a channel's own port stays the same for all aims */
	const char *helper;    /* who hands AF_XDP sockets over, NULL = pokeys-guard */
};

struct transport;

/* What a kind of transport is made of. */
struct transport_ops {
	const char *name;
	/* 0 or -errno; -EPERM, -ENOSYS, -EINVAL from the ring mean "not to be had here". */
	int (*open)(struct transport *t, const struct transport_options *options);
	void (*close)(struct transport *t);
	/*
	 * A socket for channel `channel` (not yet connected). Cold, before start.
	 * 0, -EINVAL (no such channel), -EBUSY (attached, or started), -errno.
	 */
	int (*attach)(struct transport *t, uint32_t channel);
	/*
	 * The calling thread becomes the one that sends, receives and waits; no
	 * other may from now on. Cold, once. 0 or -errno.
	 */
	int (*start)(struct transport *t);
	/*
	 * Connect the channel to a device, or to another one, or (address 0) to
	 * none. Packets of the old peer that are queued already still arrive,
	 * with their true source. 0 or -errno (then the channel is aimed at
	 * nobody; -EADDRNOTAVAIL: we have no address there). Sets error[channel] and
	 * local[channel]. Realtime: two system calls, three if it was aimed before,
	 * four on an interface, one more if `to` names one.
	 */
	int (*aim)(struct transport *t, uint32_t channel, const struct transport_address *to);
	/*
	 * Queue a datagram; the bytes are copied or sent before it returns. 0;
	 * -EMSGSIZE; -ENOBUFS (queue full, try later); or error[channel], the
	 * datagram then certainly does not leave. Realtime.
	 */
	int (*send)(struct transport *t, uint32_t channel, const uint8_t *data, size_t length);
	/* Hand everything queued to the kernel. wait() does so too. 0 or -errno. Realtime. */
	int (*flush)(struct transport *t);
	/*
	 * Next datagram that the last wait or flush found: 1, or 0 if there is
	 * none (a wait tells whether there are more). Makes no system call,
	 * except plain sockets one for each batch. Realtime.
	 */
	int (*receive)(struct transport *t, struct transport_packet *out);
	/*
	 * Until a packet or the deadline (CLOCK_MONOTONIC ns), flushing first.
	 * Never returns DEADLINE before it, unless the transport has `failed`.
	 * Realtime.
	 */
	enum transport_wait (*wait)(struct transport *t, uint64_t deadline_ns);
	/*
	 * Keep fresh what is known of the network around, a few times a second;
	 * NULL if a kind has nothing to keep. Cold, one thread that is not the
	 * realtime one, after start. *news is a static text for the log when
	 * something has changed, else NULL. 0, or -errno while the transport works,
	 * but not in the way that it was opened for, or if the news are a warning.
	 */
	int (*tend)(struct transport *t, const char **news);
};

/* Kinds embed this as their first member. */
struct transport {
	const struct transport_ops *ops;
	/* What people are told that it is: ops->name, with more to it where there is more. */
	const char *_Atomic title;
	struct transport_statistics statistics;
	bool spin;  /* polls instead of sleeping; the thread may change it */
	int failed; /* -errno: it is broken for good, 0 = it is not */
	/*
	 * -errno of an aim that failed or of a send that the kernel cannot carry
	 * out (no route, address gone); -EDESTADDRREQ while aimed at nobody.
	 * Sends are refused with it until the channel is aimed again. Nobody
	 * listening is not among them.
	 */
	int error[TRANSPORT_CHANNELS];
	/* Our end of each channel since it was aimed last; address 0 = not known. */
	struct transport_address local[TRANSPORT_CHANNELS];
};

/*
 * Open by name: "io_uring", "socket", "auto" (the ring, and sockets if the
 * kernel refuses it), or "xdp" (AF_XDP, and if it is not to be had as with
 * "auto"). 0 or -errno. *why is a static text: of the error, or of what was
 * refused before the fallback; NULL if all went as asked for.
 */
int transport_open(struct transport **out, const char *name,
		   const struct transport_options *options, const char **why);
void transport_close(struct transport *t);

/*
 * Whether this process may have a ring: 0 or -errno, and in *napi whether a ring
 * can poll network cards (busy_poll_us): 0 or -errno. Cold.
 */
int transport_probe_ring(int *napi);

#endif
