/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The AF_XDP kind's inside, for its own files and its tests. */
#ifndef TRANSPORT_XDP_H
#define TRANSPORT_XDP_H

#include <net/if.h>
#include <stdatomic.h>
#include "daemon/transport/frame.h"
#include "daemon/transport/handover.h"
#include "daemon/transport/kind.h"
#include "daemon/transport/xdp_socket.h"

/*
 * Who may touch the AF_XDP socket. Only tend() goes from NONE to READY and from
 * BROKEN to NONE, only the realtime thread from READY to BROKEN.
 */
enum xdp_link {
	XDP_NONE,   /* tend's */
	XDP_READY,  /* the realtime thread's */
	XDP_BROKEN, /* it has let go of it: tend's */
};

/* The two ends of a channel's datagrams; address 0 = none, own 0 = unknown. Host byte order. */
struct xdp_ends {
	uint32_t address, own;
	uint16_t port;
};

/*
 * What aim() tells tend() and tend() finds out for send(), in words that each
 * carry the number of the aim: words of different aims do not fit together.
 */
struct xdp_way {
	_Atomic uint64_t target; /* of the aim: address, port */
	_Atomic uint64_t own;    /* our address */
	_Atomic uint64_t to_mac, from_mac;
};

struct xdp_channel {
	bool attached;
	uint16_t port; /* our own, the same for as long as it is attached */
	uint16_t aims; /* number of the present aim, never 0 */
	struct xdp_ends now, before;
	int first, last; /* received places, a list; -1 = empty */
	uint32_t waiting;
	struct xdp_way way;
};

struct xdp_place {
	uint8_t *frame;
	struct frame_datagram datagram;
	int next;
};

struct xdp {
	struct transport base;
	struct transport *under; /* plain sockets: the kernel's way */
	char interface[IFNAMSIZ], helper[108];
	bool started;

	/* the realtime thread's, while link is READY */
	_Atomic int link;
	struct xdp_socket socket;
	bool lost;         /* the socket is of no use; let go of it in the next wait */
	bool under_more;   /* the kernel's way has packets to hand out */
	uint32_t channels; /* the attached ones and those before them */
	uint32_t turn;     /* the channel that was served last */
	uint8_t *lent;     /* frame of the packet handed out last */
	struct xdp_channel channel[TRANSPORT_CHANNELS];
	struct xdp_place place[XDP_RX_FRAMES];
	_Atomic bool half_summed;    /* a frame was refused for that, see frame.h */
	_Atomic uint64_t ask_kernel; /* bit = the next datagram goes the kernel's way */

	/* tend's */
	uint32_t index;
	int connection, netlink;
	bool joined, told_past, told_apart, told_half_summed;
	uint32_t passed_over; /* calls until a guard that hung is asked again */
};

/* The number that a way's words end with. */
#define XDP_AIM(word) ((uint16_t)(word))

/* Two values and the number of an aim in a word: 48 bits and 16. */
static inline uint64_t xdp_word(uint64_t value, uint16_t aim)
{
	return value << 16 | aim;
}

/* xdp_setup.c, all cold */
int xdp_open(struct transport *t, const struct transport_options *options);
void xdp_close(struct transport *t);
int xdp_attach(struct transport *t, uint32_t channel);
int xdp_start(struct transport *t);
int xdp_tend(struct transport *t, const char **news);

extern const struct transport_ops xdp_ops;

#endif
