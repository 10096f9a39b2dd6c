/* SPDX-License-Identifier: GPL-2.0-or-later */
/* An AF_XDP socket: its memory and its four rings; see xdp_socket.c. */
#ifndef TRANSPORT_XDP_SOCKET_H
#define TRANSPORT_XDP_SOCKET_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <xdp/xsk.h>

enum {
	XDP_FRAME = 2048, /* bytes of a frame's place */
	XDP_RX_FRAMES = 512,
	XDP_TX_FRAMES = 256,
};

struct xdp_socket {
	int fd; /* -1 = not open */
	bool zero_copy;
	uint8_t *frames; /* first those for receiving, then those for sending */
	struct xsk_ring_prod fill, tx;
	struct xsk_ring_cons done, rx;
	struct {
		void *at;
		size_t size;
	} map[4];
	uint32_t idle[XDP_TX_FRAMES], idles; /* frames for sending that nobody has */
	uint32_t queued;                     /* put since the last kick */
};

/*
 * Give a fresh AF_XDP socket its memory and bind it to a queue of an interface,
 * zero-copy where the driver has it, waiting at most so long for a socket that
 * was there before to be cleared away. The descriptor is ours from then on, also
 * after an error. 0, -EBUSY (somebody has that queue), -ENOBUFS (RLIMIT_MEMLOCK),
 * or -errno. Cold.
 */
int xdp_socket_open(struct xdp_socket *s, int fd, uint32_t index, uint32_t queue,
		    uint32_t patience_ms);
void xdp_socket_close(struct xdp_socket *s);

/* The rest is realtime; kick is a system call, the others are none. */

/* Room for a frame to be sent, NULL if all are on their way. */
uint8_t *xdp_socket_room(struct xdp_socket *s);
/* Queue what was written into the room that was given last. */
void xdp_socket_put(struct xdp_socket *s, size_t length);
/*
 * Have the kernel send what is queued. 0, or -errno: the socket is of no use
 * any more (interface down or gone). Counts its system calls.
 */
int xdp_socket_kick(struct xdp_socket *s, uint64_t *calls);

/* The next received frame, NULL if there is none; it stays ours until given back. */
uint8_t *xdp_socket_take(struct xdp_socket *s, size_t *length);
void xdp_socket_give_back(struct xdp_socket *s, const uint8_t *frame);
/* Number of the place that a received frame is in, 0 .. XDP_RX_FRAMES - 1. */
uint32_t xdp_socket_place(const struct xdp_socket *s, const uint8_t *frame);

#endif
