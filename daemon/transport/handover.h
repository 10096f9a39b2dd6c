/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * How an AF_XDP socket gets from somebody who may make one to the daemon, who
 * may not.
 *
 * Making one wants CAP_NET_RAW, and having packets directed to it wants a
 * capability for BPF; the daemon has neither. So pokeys-guard makes the
 * socket and hands it over a unix socket (SOCK_SEQPACKET); the daemon gives it
 * memory and binds it, which nobody needs a right for, and hands it back to be
 * entered into the XDP program's map. Whom it is given to is the other side's
 * business: it may send any frame with it.
 *
 * As long as the connection is open the daemon's ports are directed to it. A
 * server that comes anew is told again (HANDOVER_JOIN with the same socket).
 */
#ifndef TRANSPORT_HANDOVER_H
#define TRANSPORT_HANDOVER_H

#include <linux/types.h>

#define HANDOVER_PATH "/run/pokeys-guard/xdp"

enum { HANDOVER_VERSION = 2, HANDOVER_PORTS = 64 };

enum handover_what {
	HANDOVER_ASK = 1, /* a socket, please; the answer carries it */
	HANDOVER_JOIN,    /* carries it back, bound: direct `port` to it */
};

struct handover_request {
	__u32 version, what;
	__u32 index;                /* the interface that it is for */
	__u32 queue;                /* JOIN: that it is bound to */
	__u16 port[HANDOVER_PORTS]; /* JOIN: host byte order, 0 = none from here on */
};

struct handover_answer {
	__u32 version;
	__s32 result; /* 0 or -errno */
};

/*
 * What the XDP program puts before each frame that it directs to the socket:
 * when the driver had it. The magic word tells it from what was there before.
 */
#define HANDOVER_NOTE 0x504b78647073746dull

struct handover_note {
	__u64 magic;
	__u64 t_ns; /* CLOCK_MONOTONIC */
};

/*
 * The client's side, cold. Connect, wait at most limit_ms for that and for each answer.
 * The descriptor or -errno (-ENOENT, -ECONNREFUSED: nobody is there).
 */
int handover_connect(const char *path, unsigned int limit_ms);

/* Ask for a socket. 0 and *fd, or -errno of either side. */
int handover_ask(int connection, __u32 index, int *fd);

/* Have packets for these ports directed to it. 0 or -errno of either side. */
int handover_join(int connection, __u32 index, __u32 queue, const __u16 port[HANDOVER_PORTS],
		  int fd);

/* False = the server has gone. Never waits. */
_Bool handover_alive(int connection);

/*
 * One message, with a descriptor if *fd >= 0; receiving sets it to what came,
 * or -1. Both sides. The length, 0 = the other side has gone, or -errno.
 */
long handover_send(int connection, const void *message, unsigned long length, int fd);
long handover_receive(int connection, void *message, unsigned long length, int *fd);

#endif
