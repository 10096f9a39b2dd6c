// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * States of the engine, and one slot of it (protocol section 5.3).
 *
 * The order in a slot is the sheet's: read switches, emergency, limits, then
 * homing or probing, then motion. The states 100 and 101 are left by an
 * explicit "stopped" only; the engine never recovers by itself when a switch
 * opens again. "Run" while a reason to stop persists is refused before the
 * reply, because clients read the status straight after and test it.
 *
 * Entering "running" forgets every reference. An old one must never start a
 * motion by itself.
 */
#include "sim/engine_part.h"

static void stop_all(struct sim_device *dev, uint8_t axis_state)
{
	struct sim_engine *pe = &dev->engine;

	for (unsigned int i = 0; i < SIM_AXES; i++) {
		sim_axis_halt(&pe->axis[i]);
		pe->axis[i].state = axis_state;
	}
	sim_ring_clear(&pe->ring);
	pe->probe_hybrid = false;
	pe->thread.state = SIM_THREAD_OFF;
}

void sim_engine_trip(struct sim_device *dev, uint8_t state)
{
	struct sim_engine *pe = &dev->engine;
	uint8_t tripped = pe->minus | pe->plus;

	dev->dirty = true;
	stop_all(dev, SIM_AX_STOPPED);
	for (unsigned int i = 0; state == SIM_PE_STOP_LIMIT && i < SIM_AXES; i++) {
		if ((tripped >> i & 1) && sim_axis_usable(dev, i))
			pe->axis[i].state = SIM_AX_LIMIT;
	}
	pe->state = state;
	sim_device_log(dev, state);
}

bool sim_engine_may_start(struct sim_device *dev)
{
	sim_engine_read_switches(dev);
	if (sim_engine_emergency(dev)) {
		sim_engine_trip(dev, SIM_PE_STOP_EMERGENCY);
		return false;
	}
	if (sim_engine_limit(dev)) {
		sim_engine_trip(dev, SIM_PE_STOP_LIMIT);
		return false;
	}
	return true;
}

static bool can_run_from(uint8_t state)
{
	switch (state) {
	case SIM_PE_STOPPED:
	case SIM_PE_RUNNING:
	case SIM_PE_JOGGING:
	case SIM_PE_HOME:
	case SIM_PE_PROBE_COMPLETE:
	case SIM_PE_PROBE_ERROR:
	case SIM_PE_HYBRID_COMPLETE:
		return true;
	default:
		return false;
	}
}

static void start_jogging(struct sim_device *dev)
{
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		struct sim_axis *ax = &dev->engine.axis[i];
		unsigned int encoder = ax->setup.mpg_encoder;

		ax->mpg_target = ax->planner.position;
		if (encoder && encoder <= SIM_ENCODERS)
			ax->mpg_last = dev->encoders.raw[encoder - 1];
	}
}

static void start(struct sim_device *dev, uint8_t state)
{
	struct sim_engine *pe = &dev->engine;

	dev->dirty = true;
	if (!can_run_from(pe->state) || pe->state == state || !sim_engine_may_start(dev))
		return;
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		struct sim_axis *ax = &pe->axis[i];

		sim_axis_rest(ax);
		ax->state = SIM_AX_STOPPED;
		if (sim_axis_usable(dev, i))
			ax->state = ax->setup.options & SIM_AC_PLANNER ? SIM_AX_READY :
									 SIM_AX_BUFFER;
	}
	if (state == SIM_PE_JOGGING)
		start_jogging(dev);
	pe->state = state;
}

/* Axes on the ring stop at once, they have no ramp; the others ramp down. */
static void stop(struct sim_device *dev)
{
	struct sim_engine *pe = &dev->engine;

	dev->dirty = true;
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		if (!(pe->axis[i].setup.options & SIM_AC_PLANNER))
			sim_axis_halt(&pe->axis[i]);
		pe->axis[i].state = SIM_AX_STOPPED;
	}
	sim_ring_clear(&pe->ring);
	pe->probe_hybrid = false;
	pe->thread.state = SIM_THREAD_OFF;
	pe->state = SIM_PE_STOPPING;
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		if (pe->axis[i].planner.speed != 0)
			return;
	}
	pe->state = SIM_PE_STOPPED;
}

void sim_engine_set_state(struct sim_device *dev, uint8_t state)
{
	if (state == SIM_PE_STOPPED)
		stop(dev);
	else if (state == SIM_PE_RUNNING || state == SIM_PE_JOGGING)
		start(dev, state);
}

static bool all_still(const struct sim_engine *pe)
{
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		if (pe->axis[i].planner.speed != 0)
			return false;
	}
	return true;
}

/* One slot of an axis in "running": position, speed; those on the ring are elsewhere. */
static void run_axis(struct sim_device *dev, unsigned int i)
{
	struct sim_axis *ax = &dev->engine.axis[i];

	if (!(ax->setup.options & SIM_AC_PLANNER)) {
		ax->state = SIM_AX_BUFFER;
		return;
	}
	if (ax->setup.options & SIM_AC_POSITION)
		sim_axis_go(dev, i, ax->reference, ax->speed_ratio);
	else
		sim_axis_run(dev, i, ax->reference / 1000.0);
	ax->state = ax->planner.speed != 0 ? SIM_AX_RUNNING : SIM_AX_READY;
}

static void jog_axis(struct sim_device *dev, unsigned int i)
{
	struct sim_axis *ax = &dev->engine.axis[i];
	unsigned int encoder = ax->setup.mpg_encoder;

	if (!encoder || encoder > SIM_ENCODERS)
		return;
	ax->mpg_target += (int32_t)(dev->encoders.raw[encoder - 1] - ax->mpg_last) *
			  ax->setup.mpg_ratio;
	ax->mpg_last = dev->encoders.raw[encoder - 1];
	sim_axis_go(dev, i, ax->mpg_target, 1);
	ax->state = ax->planner.speed != 0 ? SIM_AX_RUNNING : SIM_AX_READY;
}

/* In "home" only axes which were homed and finished (0x22) move. */
static bool is_free(const struct sim_engine *pe, const struct sim_axis *ax)
{
	return pe->state == SIM_PE_RUNNING ||
	       (pe->state == SIM_PE_HOME &&
		(ax->state == SIM_AX_READY || ax->state == SIM_AX_RUNNING));
}

static void move_axis(struct sim_device *dev, unsigned int i)
{
	struct sim_axis *ax = &dev->engine.axis[i];
	uint8_t state = dev->engine.state;

	if (!sim_axis_usable(dev, i)) {
		sim_axis_halt(ax);
		ax->state = SIM_AX_STOPPED;
		return;
	}
	if (is_free(&dev->engine, ax))
		run_axis(dev, i);
	else if (state == SIM_PE_JOGGING)
		jog_axis(dev, i);
	else if (state == SIM_PE_HOMING && (dev->engine.home_mask >> i & 1))
		return;
	else if (state == SIM_PE_PROBING && (dev->engine.probe_mask >> i & 1))
		return;
	else
		sim_axis_run(dev, i, 0);
}

static bool reboot_slot(struct sim_device *dev)
{
	struct sim_engine *pe = &dev->engine;
	uint32_t left = pe->reboot_ms;

	if (!left)
		return false;
	if (left == 1)
		sim_engine_start(dev);
	else
		pe->reboot_ms = left - 1;
	return true;
}

static bool is_tripped(uint8_t state)
{
	return state == SIM_PE_STOP_LIMIT || state == SIM_PE_STOP_EMERGENCY;
}

void sim_engine_slot(struct sim_device *dev)
{
	struct sim_engine *pe = &dev->engine;

	if (reboot_slot(dev) || pe->state == SIM_PE_STOPPED)
		return;
	sim_engine_read_switches(dev);
	if (pe->state != SIM_PE_STOP_EMERGENCY && sim_engine_emergency(dev))
		sim_engine_trip(dev, SIM_PE_STOP_EMERGENCY);
	else if (!is_tripped(pe->state) && sim_engine_limit(dev))
		sim_engine_trip(dev, SIM_PE_STOP_LIMIT);
	if (is_tripped(pe->state))
		return;
	if (pe->state == SIM_PE_HOMING)
		sim_homing_slot(dev);
	else if (pe->state == SIM_PE_PROBING)
		sim_probing_slot(dev);
	else if (pe->probe_hybrid)
		sim_hybrid_slot(dev);
	if (pe->state == SIM_PE_RUNNING) {
		sim_ring_slot(dev);
		sim_thread_slot(dev);
	}
	for (unsigned int i = 0; i < SIM_AXES; i++)
		move_axis(dev, i);
	if (pe->state == SIM_PE_STOPPING && all_still(pe)) {
		pe->state = SIM_PE_STOPPED;
		dev->dirty = true;
	}
	if (pe->state == SIM_PE_HYBRID_STOPPING && all_still(pe))
		pe->state = SIM_PE_HYBRID_COMPLETE;
}
