/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Whether an interface's queues can be polled; see napi.c. */
#ifndef TRANSPORT_NAPI_H
#define TRANSPORT_NAPI_H

#include <stdint.h>

/*
 * How many NAPI instances the interface has, 0 = none; or -errno (-ENOENT: the
 * kernel does not tell, it is older than 6.8; -ENODEV: no such interface). Cold.
 */
int napi_count(uint32_t index);

#endif
