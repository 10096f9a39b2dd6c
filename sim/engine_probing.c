// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Probing (protocol section 5.3, "Probing"). The positions of all axes are
 * latched in the slot in which the input has the wanted level, before the
 * motion of that slot; the axes then ramp down, so they end a braking
 * distance further than what was latched. The level counts, not an edge: a
 * probe which already touches at the start latches at once.
 *
 * In hybrid mode the host streams the motion through the ring and the device
 * only watches, latches and stops.
 */
#include "sim/engine_part.h"

#include <math.h>

static void latch(struct sim_engine *pe, uint8_t status)
{
	for (unsigned int i = 0; i < SIM_AXES; i++)
		pe->probe_position[i] = sim_axis_position(&pe->axis[i]);
	pe->probe_status = status;
}

static void touched(struct sim_engine *pe)
{
	latch(pe, pe->probe_mask);
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		if (pe->probe_mask >> i & 1)
			pe->axis[i].state = SIM_AX_PROBED;
	}
}

/* One slot of a masked axis; true while there is still something to do. */
static bool probe_axis(struct sim_device *dev, unsigned int i)
{
	struct sim_axis *ax = &dev->engine.axis[i];

	if (ax->state == SIM_AX_PROBED) {
		sim_axis_run(dev, i, 0);
		return ax->planner.speed != 0;
	}
	if (ax->state == SIM_AX_PROBE_START) {
		ax->state = SIM_AX_PROBE_SEARCH;
		return true;
	}
	sim_axis_go(dev, i, ax->target, dev->engine.probe_speed);
	return ax->planner.speed != 0 || ax->planner.position != (double)ax->target;
}

static void finished(struct sim_engine *pe)
{
	if (pe->probe_status) {
		pe->state = SIM_PE_PROBE_COMPLETE;
		return;
	}
	pe->state = SIM_PE_PROBE_ERROR;
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		if (pe->probe_mask >> i & 1)
			pe->axis[i].state = SIM_AX_READY;
	}
}

void sim_probing_slot(struct sim_device *dev)
{
	struct sim_engine *pe = &dev->engine;
	bool busy = false;

	if (!pe->probe_status && sim_engine_probe_active(dev))
		touched(pe);
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		if (pe->probe_mask >> i & 1)
			busy |= probe_axis(dev, i);
	}
	if (!busy)
		finished(pe);
}

void sim_hybrid_slot(struct sim_device *dev)
{
	struct sim_engine *pe = &dev->engine;

	if (pe->state != SIM_PE_RUNNING || !sim_engine_probe_active(dev))
		return;
	latch(pe, 0xFF);
	pe->probe_hybrid = false;
	sim_ring_clear(&pe->ring);
	pe->state = SIM_PE_HYBRID_STOPPING;
}

static bool can_probe_from(uint8_t state)
{
	return state == SIM_PE_STOPPED || state == SIM_PE_RUNNING || state == SIM_PE_JOGGING ||
	       state == SIM_PE_HOME || state == SIM_PE_PROBE_COMPLETE ||
	       state == SIM_PE_PROBE_ERROR;
}

static uint8_t usable_mask(const struct sim_device *dev, uint8_t wanted)
{
	uint8_t mask = 0;

	for (unsigned int i = 0; i < SIM_AXES; i++) {
		if ((wanted >> i & 1) && sim_axis_usable(dev, i))
			mask |= (uint8_t)(1u << i);
	}
	return mask;
}

static double sane_ratio(float ratio)
{
	return isfinite(ratio) && ratio > 0 ? fmin(ratio, 1) : 0;
}

static void start_probing(struct sim_device *dev, uint8_t mask, const uint8_t *rq)
{
	struct sim_engine *pe = &dev->engine;

	dev->dirty = true;
	pe->probe_mask = mask;
	pe->probe_speed = sane_ratio(wire_get_f32(rq + 40));
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		if (!(mask >> i & 1))
			continue;
		pe->axis[i].state = SIM_AX_PROBE_START;
		pe->axis[i].target = wire_get_i32(rq + 8 + 4 * i);
	}
	pe->state = SIM_PE_PROBING;
}

SIM_HANDLER(sim_pe_probe_start)
{
	struct sim_engine *pe = &dev->engine;
	uint8_t mask = usable_mask(dev, rq[P2]);
	bool hybrid = rq[P3] == 1;

	(void)rp;
	if (pe->reboot_ms || !can_probe_from(pe->state) || (!hybrid && !mask))
		return SIM_ANSWER;
	if (hybrid && pe->state != SIM_PE_RUNNING)
		return SIM_ANSWER;
	if (sim_engine_emergency(dev)) {
		sim_engine_trip(dev, SIM_PE_STOP_EMERGENCY);
		return SIM_ANSWER;
	}
	pe->probe_status = 0;
	memset(pe->probe_position, 0, sizeof(pe->probe_position));
	pe->probe_input = rq[44];
	pe->probe_level = rq[45];
	pe->probe_hybrid = hybrid;
	if (!hybrid)
		start_probing(dev, mask, rq);
	return SIM_ANSWER;
}

SIM_HANDLER(sim_pe_probe_finish)
{
	struct sim_engine *pe = &dev->engine;

	for (unsigned int i = 0; i < SIM_AXES; i++)
		wire_put_i32(rp + 8 + 4 * i, pe->probe_position[i]);
	rp[40] = pe->probe_status;
	rp[P2] = rq[P2];
	pe->probe_hybrid = false;
	if (rq[P2] == 0)
		sim_engine_set_state(dev, SIM_PE_STOPPED);
	return SIM_ANSWER;
}
