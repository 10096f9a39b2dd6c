/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_FAILSAFE_H
#define SIM_FAILSAFE_H

struct sim_device;

/* Once a millisecond: takes the stored state when nobody has spoken for the timeout (0x81). */
void sim_failsafe_slot(struct sim_device *dev);

#endif
