/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A network for the AF_XDP transport: interface pk0 here, its other end in a
 * network namespace where the peers are, and a process beside that stands for
 * pokeys-guard: it directs every unfragmented datagram for the daemon's ports
 * to the AF_XDP socket, whatever its length and whoever sent it.
 */
#ifndef TESTS_TRANSPORT_XDP_WORLD_H
#define TESTS_TRANSPORT_XDP_WORLD_H

#include <stdbool.h>
#include <sys/types.h>
#include "daemon/transport/transport.h"

/* Our own address and the network of the peers, host byte order. */
#define XDP_WORLD_HERE 0x0a4ec801u	/* 10.78.200.1 */
#define XDP_WORLD_FAR 0x0a4e0000u	/* 10.78.0.0/17 */

/* Move to it; NULL, or why it is not to be had. */
const char *xdp_world_make(void);

struct transport_options xdp_world_options(void);

/* A UDP socket at the far end; one for whole frames there, and its interface. */
int xdp_world_far_socket(void);
int xdp_world_far_packet_socket(int *index);

/* Whether UDP checksums are whole when they leave the far end; they are, until told. */
void xdp_world_checksums(bool whole);

/* Make pk0 and the far end anew; they are gone. */
void xdp_world_connect(void);

/* Commands for sh, at our end and at the far one; they must succeed. */
void xdp_world_run(const char *command);
void xdp_world_run_far(const char *command);

/* End the process that stands for the guard, and start the next one; pk0 has to be there. */
void xdp_world_guard_end(void);
const char *xdp_world_guard_start(void);

#endif
