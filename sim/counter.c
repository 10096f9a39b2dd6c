// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Digital counters (protocol section 3.5). They are counted in pins.c, where
 * levels change. The reply to 0xD9 is not described; it mirrors the request.
 */
#include "sim/request.h"

#define COUNTERS_PER_REQUEST 13

SIM_HANDLER(sim_do_counters)
{
	for (unsigned int i = 0; i < COUNTERS_PER_REQUEST; i++) {
		unsigned int pin = rq[8 + i];

		if (pin < SIM_PINS)
			wire_put_u32(rp + 8 + 4 * i, dev->pins.counter[pin]);
	}
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_counter_dirs)
{
	if (rq[P1] == 1 && !sim_locked(dev))
		memcpy(dev->config.pins.direction, rq + 8, SIM_PINS);
	rp[P1] = rq[P1];
	memcpy(rp + 8, dev->config.pins.direction, SIM_PINS);
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_counter_reset)
{
	(void)rq;
	(void)rp;
	memset(dev->pins.counter, 0, sizeof(dev->pins.counter));
	return SIM_ANSWER;
}
