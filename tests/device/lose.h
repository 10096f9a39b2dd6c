/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * One packet lost, each in turn, from one moment of a world.
 */
#ifndef TESTS_DEVICE_LOSE_H
#define TESTS_DEVICE_LOSE_H

#include "tests/device/world.h"

/* Count down to the request, or the reply, that is lost; below 0 none. */
extern int lose_request, lose_reply;

/* `world` loses them from now on, none to begin with. */
void lose_begin(struct world *world);

/* Take a picture of it; put it back, with nothing to be lost. */
void lose_keep(const struct world *world);
void lose_put_back(struct world *world);
const struct world *lose_kept(void);

/* The k-th of so many requests is lost, or behind them of as many replies. */
void lose_one(int k, int packets);

/* Give the picture back. */
void lose_end(void);

#endif
