/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Packets that reach this computer, whether or not its firewall lets them through to a
 * socket. Cold: for the search.
 */
#ifndef TRANSPORT_OVERHEAR_H
#define TRANSPORT_OVERHEAR_H

#include <stdbool.h>
#include <stdint.h>

/*
 * A descriptor that becomes readable when UDP from one port to another has come in at any
 * interface. -EPERM without CAP_NET_RAW; -errno. close() ends it.
 */
int overhear_open(uint16_t from_port, uint16_t to_port);

/* The source of the next one, host byte order; false = there is none. */
bool overhear_take(int fd, uint32_t *from);

#endif
