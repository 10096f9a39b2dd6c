// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * PoExtBus, ten bytes of outputs in a shift register (protocol section 3.12).
 * The reply carries what was written: newer vendor libraries compare, and
 * take anything else for a failure (6-D30).
 */
#include "sim/request.h"

SIM_HANDLER(sim_do_poext)
{
	struct sim_bus_config *config = &dev->config.bus;

	switch (rq[P1]) {
	case 0:
		if (!sim_locked(dev))
			config->poext_on = 0;
		break;
	case 1:
		if (!sim_locked(dev)) {
			config->poext_on = 1;
			config->poext_connector = rq[P2];
			config->poext_no_crc = rq[P3] > 0;
		}
		memcpy(dev->bus.poext, rq + 8, SIM_POEXT_BYTES);
		break;
	case 2:
		break;
	case 10:
	case 11:
		dev->bus.poext_paused = rq[P1] == 10;
		break;
	default:
		return SIM_ANSWER_UNKNOWN;
	}
	rp[P1] = config->poext_on;
	rp[P2] = config->poext_connector;
	rp[P3] = config->poext_no_crc;
	memcpy(rp + 8, dev->bus.poext, SIM_POEXT_BYTES);
	return SIM_ANSWER;
}
