// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Positions and references: 0x03, 0x20 and 0x25 (protocol sections 3.24.3 and
 * 5.3).
 *
 * References are only taken in states which execute them, and by axes which
 * have a planner. In any other state a move is acknowledged and forgotten, so
 * that it cannot start when the state changes later.
 */
#include "sim/engine_part.h"

static bool takes_moves(const struct sim_device *dev, unsigned int i)
{
	const struct sim_engine *pe = &dev->engine;
	const struct sim_axis *ax = &pe->axis[i];

	if (!sim_axis_usable(dev, i) || !(ax->setup.options & SIM_AC_PLANNER))
		return false;
	if (pe->state == SIM_PE_RUNNING)
		return true;
	return pe->state == SIM_PE_HOME &&
	       (ax->state == SIM_AX_READY || ax->state == SIM_AX_RUNNING);
}

SIM_HANDLER(sim_pe_positions)
{
	(void)rp;
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		struct sim_axis *ax = &dev->engine.axis[i];
		int32_t position = wire_get_i32(rq + 8 + 4 * i);

		if (!(rq[P2] >> i & 1))
			continue;
		sim_axis_set_position(ax, position);
		ax->mpg_target = position;
		if (ax->setup.options & SIM_AC_POSITION)
			ax->reference = position;
	}
	return SIM_ANSWER;
}

SIM_HANDLER(sim_pe_move)
{
	(void)rp;
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		struct sim_axis *ax = &dev->engine.axis[i];

		if (!takes_moves(dev, i))
			continue;
		ax->reference = wire_get_i32(rq + 8 + 4 * i);
		ax->speed_ratio = 1;
	}
	return SIM_ANSWER;
}

SIM_HANDLER(sim_pe_move_pv)
{
	(void)rp;
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		struct sim_axis *ax = &dev->engine.axis[i];

		if (!(rq[P2] >> i & 1) || !takes_moves(dev, i) ||
		    !(ax->setup.options & SIM_AC_POSITION))
			continue;
		ax->reference = wire_get_i32(rq + 8 + 4 * i);
		ax->speed_ratio = wire_get_u16(rq + 40 + 2 * i) / 65535.0;
	}
	return SIM_ANSWER;
}
