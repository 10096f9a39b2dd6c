// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What hangs on the pulse engine: external outputs, internal drivers,
 * backlash tables, the smart generator (protocol section 3.24.3).
 */
#include "sim/engine_part.h"

SIM_HANDLER(sim_pe_outputs)
{
	struct sim_engine *pe = &dev->engine;

	if (rq[P4] != 1) {
		pe->relays = rq[P2];
		pe->outputs = rq[P3];
	}
	rp[P2] = pe->relays;
	rp[P3] = pe->outputs;
	return SIM_ANSWER;
}

SIM_HANDLER(sim_pe_drivers)
{
	uint8_t *drivers = dev->config.engine.drivers;

	if (rq[P1] == 0x19 && !sim_locked(dev))
		memcpy(drivers, rq + 8, sizeof(dev->config.engine.drivers));
	memcpy(rp + 8, drivers, sizeof(dev->config.engine.drivers));
	return SIM_ANSWER;
}

SIM_HANDLER(sim_pe_backlash)
{
	struct sim_engine_config *config = &dev->config.engine;

	if (rq[P1] == 0x41 && !sim_locked(dev)) {
		config->backlash_enable = rq[P2];
		config->backlash_speed = rq[P3];
		memcpy(config->backlash, rq + 8, sizeof(config->backlash));
	}
	rp[P2] = config->backlash_enable;
	if (rq[P1] == 0x41)
		return SIM_ANSWER;
	rp[P3] = config->backlash_speed;
	memcpy(rp + 8, config->backlash, sizeof(config->backlash));
	for (unsigned int i = 0; i < SIM_AXES; i++)
		wire_put_u16(rp + 40 + 2 * i, (uint16_t)dev->engine.axis[i].back_compensation);
	return SIM_ANSWER;
}

SIM_HANDLER(sim_pe_smart_config)
{
	uint8_t *smart = dev->config.engine.smart;

	if (rq[P1] == 0x91) {
		if (sim_locked(dev))
			rp[P2] = 1;
		else
			memcpy(smart, rq + 8, SIM_AXIS_BLOCK);
		return SIM_ANSWER;
	}
	memcpy(rp + 8, smart, SIM_AXIS_BLOCK);
	return SIM_ANSWER;
}

SIM_HANDLER(sim_pe_smart_reset)
{
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		if (rq[P2] >> i & 1)
			dev->bench.machine.mismatch[i] = 0;
	}
	rp[P2] = 0;
	return SIM_ANSWER;
}

SIM_HANDLER(sim_pe_smart_status)
{
	const struct sim_machine *machine = &dev->bench.machine;
	const uint8_t *most = dev->config.engine.smart + 47 - 8;

	(void)rq;
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		int mismatch = machine->mismatch[i];
		int allowed = wire_get_u16(most + 2 * i);

		if (allowed && (mismatch > allowed || -mismatch > allowed))
			rp[8] |= (uint8_t)(1u << i);
		wire_put_u16(rp + 12 + 2 * i, (uint16_t)mismatch);
		wire_put_i32(rp + 28 + 4 * i, sim_axis_position(&dev->engine.axis[i]));
	}
	rp[11] = sim_machine_misc(machine);
	return SIM_ANSWER;
}

SIM_HANDLER(sim_pe_smart_encoders)
{
	(void)rq;
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		int encoder = dev->bench.machine.axis[i].encoder;

		if (encoder >= 0)
			wire_put_u32(rp + 8 + 4 * i, dev->encoders.raw[encoder]);
	}
	return SIM_ANSWER;
}
