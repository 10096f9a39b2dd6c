// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Homing (protocol section 5.3, "Homing"). Every masked axis goes through its
 * states by itself: search for the switch, back off it, reset the counter on
 * the edge, ramp to rest, back off further, done.
 *
 * What happens on the two edges of the home switch is configured in nibbles:
 * bits 1 slow down, 2 reverse, 4 arm the encoder index, or the code 8: reset
 * the position and stop. The axis does not go back to zero afterwards; it
 * ends a braking distance past the edge, as the manual says.
 */
#include "sim/engine_part.h"

#include <math.h>

#define ACT_SLOW 1
#define ACT_REVERSE 2
#define ACT_INDEX 4
#define ACT_RESET 8

static double search_speed(const struct sim_axis *ax)
{
	return ax->setup.limits.speed * ax->setup.home_percent / 100.0;
}

static double return_speed(const struct sim_axis *ax)
{
	return search_speed(ax) * ax->setup.return_percent / 100.0;
}

/* The edge is here: the counter takes the offset, the axis runs out. */
static void reset(struct sim_axis *ax)
{
	sim_axis_set_position(ax, ax->home_offset);
	ax->state = SIM_AX_HOMING_RESETTING;
}

static void act(struct sim_axis *ax, uint8_t action)
{
	if (action & ACT_RESET) {
		reset(ax);
		return;
	}
	if (action & ACT_SLOW)
		ax->homing_speed = return_speed(ax);
	if (action & ACT_REVERSE)
		ax->homing_way = -ax->homing_way;
	if (action & ACT_INDEX) {
		ax->index_armed = true;
		ax->index_seen = false;
	}
	ax->state = SIM_AX_HOMING_BACK;
}

/* Events of this slot: the index when armed, else an edge of the home switch. */
static void watch(struct sim_axis *ax, bool active)
{
	bool was_active = ax->homing_was_active;

	ax->homing_was_active = active;
	if (ax->index_armed && ax->index_seen) {
		ax->index_armed = false;
		reset(ax);
	} else if (active && !was_active) {
		act(ax, ax->setup.home_on_active);
	} else if (!active && was_active && ax->state == SIM_AX_HOMING_BACK) {
		act(ax, ax->setup.home_on_release);
	}
}

static void run_out(struct sim_device *dev, unsigned int i)
{
	struct sim_axis *ax = &dev->engine.axis[i];

	sim_axis_run(dev, i, 0);
	if (ax->planner.speed != 0)
		return;
	ax->state = SIM_AX_HOME;
	if (ax->setup.back_off <= 0)
		return;
	ax->state = SIM_AX_HOMING_BACKING_OFF;
	ax->target = (int32_t)lrint(ax->planner.position) + ax->homing_way * ax->setup.back_off;
}

static void back_off(struct sim_device *dev, unsigned int i)
{
	struct sim_axis *ax = &dev->engine.axis[i];
	double speed = ax->setup.limits.speed;

	sim_axis_go(dev, i, ax->target, speed > 0 ? return_speed(ax) / speed : 0);
	if (ax->planner.speed == 0 && ax->planner.position == (double)ax->target)
		ax->state = SIM_AX_HOME;
}

static void home_axis(struct sim_device *dev, unsigned int i)
{
	struct sim_axis *ax = &dev->engine.axis[i];
	bool active = dev->engine.home >> i & 1;

	switch (ax->state) {
	case SIM_AX_HOMING_START:
		ax->state = SIM_AX_HOMING_SEARCH;
		watch(ax, active);
		break;
	case SIM_AX_HOMING_SEARCH:
	case SIM_AX_HOMING_BACK:
		watch(ax, active);
		break;
	case SIM_AX_HOMING_RESETTING:
		run_out(dev, i);
		return;
	case SIM_AX_HOMING_BACKING_OFF:
		back_off(dev, i);
		return;
	default:
		return;
	}
	if (ax->state == SIM_AX_HOMING_RESETTING)
		run_out(dev, i);
	else
		sim_axis_run(dev, i, ax->homing_way * ax->homing_speed);
}

void sim_homing_slot(struct sim_device *dev)
{
	struct sim_engine *pe = &dev->engine;
	bool done = true;

	for (unsigned int i = 0; i < SIM_AXES; i++) {
		if (!(pe->home_mask >> i & 1))
			continue;
		home_axis(dev, i);
		done = done && pe->axis[i].state == SIM_AX_HOME;
	}
	if (done)
		pe->state = SIM_PE_HOME;
}

static bool can_home_from(uint8_t state)
{
	return state == SIM_PE_STOPPED || state == SIM_PE_RUNNING || state == SIM_PE_JOGGING ||
	       state == SIM_PE_HOME || state == SIM_PE_PROBE_COMPLETE ||
	       state == SIM_PE_PROBE_ERROR;
}

static void start_axis(struct sim_axis *ax, int32_t offset)
{
	ax->state = SIM_AX_HOMING_START;
	ax->home_offset = offset;
	ax->homing_way = ax->setup.options & SIM_AC_INVERTED_HOME ? 1 : -1;
	ax->homing_speed = search_speed(ax);
	ax->homing_was_active = false;
	ax->index_armed = false;
	ax->index_seen = false;
}

SIM_HANDLER(sim_pe_home_start)
{
	struct sim_engine *pe = &dev->engine;
	uint8_t mask = 0;

	(void)rp;
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		if ((rq[P2] >> i & 1) && sim_axis_usable(dev, i))
			mask |= (uint8_t)(1u << i);
	}
	if (!mask || pe->reboot_ms || !can_home_from(pe->state))
		return SIM_ANSWER;
	if (sim_engine_emergency(dev)) {
		sim_engine_trip(dev, SIM_PE_STOP_EMERGENCY);
		return SIM_ANSWER;
	}
	dev->dirty = true;
	pe->home_mask = mask;
	pe->state = SIM_PE_HOMING;
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		if (mask >> i & 1)
			start_axis(&pe->axis[i], wire_get_i32(rq + 8 + 4 * i));
		else
			pe->axis[i].state = SIM_AX_STOPPED;
	}
	return SIM_ANSWER;
}

/* Axes become ready in any case; the engine changes its state only if asked to (D15). */
SIM_HANDLER(sim_pe_home_finish)
{
	struct sim_engine *pe = &dev->engine;

	(void)rp;
	if (pe->state != SIM_PE_HOME)
		return SIM_ANSWER;
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		struct sim_axis *ax = &pe->axis[i];

		if (ax->state != SIM_AX_HOME)
			continue;
		sim_axis_rest(ax);
		ax->state = ax->setup.options & SIM_AC_PLANNER ? SIM_AX_READY : SIM_AX_BUFFER;
	}
	if (!rq[P3])
		sim_engine_set_state(dev, rq[P2]);
	return SIM_ANSWER;
}
