// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Configuring the pulse engine: 0x01, 0x05, 0x06, 0x0A, 0x0B, 0x10 and 0x11
 * (protocol sections 3.24.3 and 3.24.4).
 *
 * Axis blocks are kept byte for byte as they came, so that a client which
 * reads, changes one field and writes back finds every other field as it was,
 * those it does not know included.
 */
#include "sim/engine_part.h"

SIM_HANDLER(sim_pe_setup)
{
	struct sim_engine_config *config = &dev->config.engine;

	if (sim_locked(dev) || rq[8] > SIM_AXES) {
		rp[P2] = 1;
		return SIM_ANSWER;
	}
	config->axes = rq[8];
	config->charge_pump = rq[9];
	config->generator = rq[10];
	config->buffer_size = rq[11];
	config->emergency_invert = rq[12];
	config->power_states = rq[13];
	return SIM_ANSWER;
}

SIM_HANDLER(sim_pe_state)
{
	struct sim_engine *pe = &dev->engine;

	rp[P2] = 0;
	if (pe->reboot_ms)
		return SIM_ANSWER;
	dev->dirty = true;
	pe->override = rq[P3];
	pe->output_mask = rq[P4];
	sim_engine_set_state(dev, rq[P2]);
	return SIM_ANSWER;
}

SIM_HANDLER(sim_pe_reboot)
{
	struct sim_engine *pe = &dev->engine;

	(void)rq;
	(void)rp;
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		sim_axis_halt(&pe->axis[i]);
		pe->axis[i].state = SIM_AX_STOPPED;
	}
	sim_ring_clear(&pe->ring);
	/* nobody can read these, so nothing says that they outlast it */
	memset(dev->config.engine.thread, 0, sizeof(dev->config.engine.thread));
	pe->state = SIM_PE_STOPPED;
	pe->reboot_ms = SIM_ENGINE_REBOOT_MS;
	return SIM_ANSWER;
}

SIM_HANDLER(sim_pe_emergency_pin)
{
	if (rq[P2] == 1 && !sim_locked(dev))
		dev->config.engine.emergency_pin = rq[8];
	dev->dirty = true;
	rp[8] = dev->config.engine.emergency_pin;
	return SIM_ANSWER;
}

static bool echoes(const struct sim_device *dev, const uint8_t *rq)
{
	return rq[P2] == 2 && dev->options.choices.echo_synced;
}

SIM_HANDLER(sim_pe_synced_pwm)
{
	uint8_t *synced = dev->config.engine.synced_pwm;

	if (rq[P2] != 2 && !sim_locked(dev))
		memcpy(synced, rq + P2, 3);
	memcpy(rp + P2, echoes(dev, rq) ? rq + P2 : synced, 3);
	return SIM_ANSWER;
}

SIM_HANDLER(sim_pe_synced_outputs)
{
	struct sim_engine_config *config = &dev->config.engine;

	if (rq[P2] != 2 && !sim_locked(dev)) {
		memcpy(config->synced_out, rq + P2, sizeof(config->synced_out));
		memcpy(config->synced_pins, rq + 8, sizeof(config->synced_pins));
	}
	memcpy(rp + P2, echoes(dev, rq) ? rq + P2 : config->synced_out, sizeof(config->synced_out));
	memcpy(rp + 8, echoes(dev, rq) ? rq + 8 : config->synced_pins, sizeof(config->synced_pins));
	return SIM_ANSWER;
}

/* The replies to both do not say which axis they are about. */
SIM_HANDLER(sim_pe_axis_get)
{
	if (rq[P2] < SIM_AXES)
		memcpy(rp + 8, dev->config.engine.axis[rq[P2]], SIM_AXIS_BLOCK);
	return SIM_ANSWER;
}

SIM_HANDLER(sim_pe_axis_set)
{
	(void)rp;
	if (rq[P2] >= SIM_AXES || sim_locked(dev))
		return SIM_ANSWER;
	memcpy(dev->config.engine.axis[rq[P2]], rq + 8, SIM_AXIS_BLOCK);
	sim_axis_load(dev, rq[P2]);
	return SIM_ANSWER;
}
