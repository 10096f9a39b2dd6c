// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Saving, locking, resetting and rebooting (protocol section 1.12). The magic
 * 0xAA 0x55 must be there: a frame with another parameter does nothing.
 *
 * 0x52 puts the factory configuration into RAM and flash both; a device which
 * came back from a power cycle with what was reset would be no reset.
 */
#include "sim/request.h"

SIM_HANDLER(sim_do_save)
{
	(void)rp;
	if (rq[P1] != 0xAA || rq[P2] != 0x55)
		return SIM_ANSWER;
	switch (rq[WIRE_AT_OP]) {
	case 0x51:
		dev->config.identity.locked = 1;
		break;
	case 0x52:
		dev->config = dev->factory;
		for (unsigned int i = 0; i < SIM_AXES; i++)
			sim_axis_load(dev, i);
		dev->dirty = true;
		break;
	default:
		break;
	}
	sim_device_save(dev);
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_reboot)
{
	(void)rq;
	(void)rp;
	sim_device_reboot(dev, dev->now_ns, false);
	return SIM_ANSWER;
}
