// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The two status replies of the pulse engine (protocol section 3.24.2).
 *
 * Limit plus comes before limit minus in 0x00 and after it in 0x08, which
 * also reports raw levels of the dedicated inputs and not what was made of
 * them (6-D8). @58 is the size of the ring, or by choice what is free in it.
 */
#include "sim/engine_part.h"

void sim_engine_status(struct sim_device *dev, uint8_t *rp)
{
	const struct sim_engine_config *config = &dev->config.engine;
	const struct sim_engine *pe = &dev->engine;

	sim_engine_read_switches(dev);
	rp[3] = pe->soft_limited;
	rp[4] = pe->power_states;
	rp[5] = pe->override;
	rp[8] = config->axes;
	rp[9] = pe->reboot_ms ? 0 : 1;
	rp[10] = pe->state;
	rp[11] = config->charge_pump;
	rp[12] = pe->plus;
	rp[13] = pe->minus;
	rp[14] = pe->home;
	rp[15] = pe->generator;
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		rp[16 + i] = pe->axis[i].state;
		wire_put_i32(rp + 24 + 4 * i, sim_axis_position(&pe->axis[i]));
	}
	rp[56] = (uint8_t)sim_engine_axes_supported(dev);
	rp[57] = (uint8_t)sim_engine_kilohertz(dev);
	rp[58] = (uint8_t)(dev->bench.machine.told_slots -
			   (dev->options.choices.count_free ? pe->ring.used : 0));
	rp[59] = dev->bench.machine.told_slot_time;
	rp[60] = config->emergency_invert;
	rp[61] = dev->bench.machine.driver_error;
	rp[62] = sim_machine_misc(&dev->bench.machine);
}

SIM_HANDLER(sim_pe_status)
{
	sim_engine_status(dev, rp);
	rp[63] = (uint8_t)(SIM_STATUS_CHECK + rq[P2]);
	return SIM_ANSWER;
}

SIM_HANDLER(sim_pe_status2)
{
	rp[8] = sim_machine_minus(&dev->bench.machine);
	rp[9] = sim_machine_plus(&dev->bench.machine);
	rp[10] = sim_machine_home(&dev->bench.machine);
	rp[63] = (uint8_t)(SIM_STATUS_CHECK + rq[P2]);
	return SIM_ANSWER;
}
