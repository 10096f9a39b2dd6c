// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Sub-commands of operation 0x85. Every reply repeats the sub-command at @2,
 * but for the fills, which put the number of accepted slots there.
 */
#include "sim/engine_part.h"

static const sim_handler handlers[256] = {
	[0x00] = sim_pe_status,
	[0x01] = sim_pe_setup,
	[0x02] = sim_pe_state,
	[0x03] = sim_pe_positions,
	[0x04] = sim_pe_outputs,
	[0x05] = sim_pe_reboot,
	[0x06] = sim_pe_emergency_pin,
	[0x08] = sim_pe_status2,
	[0x0A] = sim_pe_synced_pwm,
	[0x0B] = sim_pe_synced_outputs,
	[0x10] = sim_pe_axis_get,
	[0x11] = sim_pe_axis_set,
	[0x18] = sim_pe_drivers,
	[0x19] = sim_pe_drivers,
	[0x20] = sim_pe_move,
	[0x21] = sim_pe_home_start,
	[0x22] = sim_pe_home_finish,
	[0x23] = sim_pe_probe_start,
	[0x24] = sim_pe_probe_finish,
	[0x25] = sim_pe_move_pv,
	[0x30] = sim_pe_thread,
	[0x31] = sim_pe_thread,
	[0x32] = sim_pe_thread,
	[0x33] = sim_pe_thread,
	[0x34] = sim_pe_thread,
	[0x35] = sim_pe_thread_status,
	[0x36] = sim_pe_thread_status,
	[0x37] = sim_pe_encoder_test,
	[0x40] = sim_pe_backlash,
	[0x41] = sim_pe_backlash,
	[0x50] = sim_pe_postep_comm,
	[0x51] = sim_pe_postep_status,
	[0x52] = sim_pe_postep_table,
	[0x53] = sim_pe_postep_table,
	[0x54] = sim_pe_postep_versions,
	[0x90] = sim_pe_smart_config,
	[0x91] = sim_pe_smart_config,
	[0x92] = sim_pe_smart_reset,
	[0x95] = sim_pe_smart_status,
	[0x96] = sim_pe_smart_encoders,
	[0xF0] = sim_pe_clear,
	[0xFE] = sim_pe_fill,
	[0xFF] = sim_pe_fill,
};

SIM_HANDLER(sim_do_engine)
{
	uint8_t sub = rq[P1];

	dev->stats.executed_pe[sub]++;
	if (!handlers[sub])
		return SIM_ANSWER_UNKNOWN;
	rp[P1] = sub;
	return handlers[sub](dev, rq, rp);
}
