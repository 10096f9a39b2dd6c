/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The ring's inside, for its own files and its tests. */
#ifndef TRANSPORT_URING_H
#define TRANSPORT_URING_H

#include <liburing.h>
#include "daemon/transport/kind.h"
#include "daemon/transport/stamp.h"
#include "daemon/transport/udp.h"

enum {
	URING_SUBMISSIONS = TRANSPORT_QUEUE,
	URING_BUFFERS = 512,
	/*
	 * Each packet's completion holds a buffer, each channel can end once
	 * before it is armed again, each send can fail: with this many entries
	 * the completion queue cannot overflow.
	 */
	URING_COMPLETIONS = 1024,
	/* io_uring_recvmsg_out, source, control data, payload; a multiple of 64 */
	URING_BUFFER = 2176,
};

_Static_assert(URING_BUFFERS + TRANSPORT_CHANNELS + URING_SUBMISSIONS <= URING_COMPLETIONS,
	       "completions of everything outstanding fit");
_Static_assert(sizeof(struct io_uring_recvmsg_out) + sizeof(struct sockaddr_in) + UDP_CONTROL +
			       TRANSPORT_PACKET_MAX <=
		       URING_BUFFER,
	       "the longest packet fits");

/* What a completion belongs to: user_data = kind << 32 | channel. */
enum uring_kind { URING_RECEIVE = 1, URING_SEND = 2 };

/* Powers of two; submissions <= completions and <= URING_SUBMISSIONS. */
struct uring_sizes {
	unsigned int submissions, completions, buffers;
};

struct uring_channel {
	struct udp udp;
	struct msghdr shape; /* how much of a buffer is for source and control data */
	bool armed, armed_before;
	uint64_t armed_in; /* number of the wait */
};

struct uring {
	struct transport base;
	struct transport_options options;
	struct uring_sizes sizes;
	struct io_uring ring;
	bool ring_open, started;
	int enter_fd;             /* index of the registered ring, or the ring's fd */
	unsigned int enter_flags; /* IORING_ENTER_REGISTERED_RING, _ABS_TIMER where had */
	struct io_uring_buf_ring *pool;
	uint8_t *buffers;
	int lent; /* buffer of the packet handed out last, -1 = none */
	uint64_t waits;
	uint32_t channels; /* the attached ones and those before them */
	struct stamp stamp;
	struct uring_channel channel[TRANSPORT_CHANNELS];
	uint8_t slot[URING_SUBMISSIONS][TRANSPORT_SEND_MAX];
};

/* IORING_ENTER_ABS_TIMER, Linux 6.12; not in liburing 2.3 */
#define URING_ABS_TIMER (1u << 5)

/* uring_setup.c, all cold */
int uring_open(struct transport *t, const struct transport_options *options);
int uring_open_sized(struct uring *u, const struct transport_options *options,
		     const struct uring_sizes *sizes);
void uring_close(struct transport *t);
int uring_attach(struct transport *t, uint32_t channel);
int uring_start(struct transport *t);

/* uring.c, realtime */

/*
 * One io_uring_enter: submit what is queued, run what the kernel has
 * deferred, wait for `min` completions (0 or 1, never more) until the
 * deadline (NULL = for ever). The kernel's result or -errno.
 */
int uring_enter(struct uring *u, unsigned int min, const uint64_t *deadline_ns);

/* Queue the multishot receive of every attached channel that lacks one. */
void uring_arm(struct uring *u);

/* Give a buffer back to the kernel. */
void uring_recycle(struct uring *u, int id);

extern const struct transport_ops uring_ops;

#endif
