// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Threading, as little of it as a client needs to go through its states
 * (protocol section 5.3, "Threading"): prepare waits for the ring to run
 * empty, arm waits for an index of the ultra-fast encoder, and from there on
 * the ring is taken again. The synchronising itself is not modelled: slots
 * keep their millisecond whatever the spindle does.
 */
#include "sim/engine_part.h"

void sim_thread_slot(struct sim_device *dev)
{
	struct sim_engine *pe = &dev->engine;

	if (pe->thread == SIM_THREAD_PREPARING && !pe->ring.used)
		pe->thread = SIM_THREAD_PREPARED;
}

void sim_thread_index(struct sim_device *dev)
{
	dev->engine.thread_index++;
	if (dev->engine.thread == SIM_THREAD_WAITING)
		dev->engine.thread = SIM_THREAD_ACTIVE;
}

SIM_HANDLER(sim_pe_thread)
{
	struct sim_engine *pe = &dev->engine;

	(void)rp;
	switch (rq[P1]) {
	case 0x30:
		pe->thread = pe->ring.used ? SIM_THREAD_PREPARING : SIM_THREAD_PREPARED;
		break;
	case 0x31:
		pe->thread = SIM_THREAD_PREPARED;
		break;
	case 0x32:
		if (pe->thread == SIM_THREAD_PREPARED)
			pe->thread = SIM_THREAD_WAITING;
		break;
	default:
		pe->thread = SIM_THREAD_OFF;
		break;
	}
	return SIM_ANSWER;
}

/* Revolutions per minute from the time between two indexes of the spindle. */
static uint32_t spindle_rpm(const struct sim_device *dev)
{
	uint32_t ticks = dev->encoders.index_ticks;

	return ticks ? (uint32_t)(UINT64_C(60) * SIM_TICK_HZ / ticks) : 0;
}

SIM_HANDLER(sim_pe_thread_status)
{
	const struct sim_engine *pe = &dev->engine;
	uint8_t *params = dev->config.engine.thread;

	if (rq[P1] == 0x36 && !sim_locked(dev))
		memcpy(params, rq + 8, sizeof(dev->config.engine.thread));
	rp[8] = pe->thread == SIM_THREAD_PREPARING;
	rp[9] = pe->thread == SIM_THREAD_PREPARED;
	rp[10] = pe->thread == SIM_THREAD_WAITING;
	rp[11] = pe->thread == SIM_THREAD_ACTIVE;
	wire_put_i32(rp + 12, dev->encoders.ultra_speed);
	wire_put_u32(rp + 20, spindle_rpm(dev));
	rp[24] = params[12];
	wire_put_u32(rp + 25, pe->thread_index);
	return SIM_ANSWER;
}

SIM_HANDLER(sim_pe_encoder_test)
{
	const struct sim_encoders *enc = &dev->encoders;

	(void)rq;
	wire_put_u32(rp + 8, enc->raw[SIM_ULTRA_FAST]);
	wire_put_u32(rp + 12, enc->index_count);
	wire_put_u32(rp + 16, enc->index_ticks);
	wire_put_u32(rp + 20, (uint32_t)enc->ultra_speed);
	return SIM_ANSWER;
}
