/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Pulse engine v2. The replies come from a responder simpler than a device
 * (protocol section 7): they hold for the layout, not for the behaviour.
 */

#include "tests/wire/golden.h"

#define OF_57CNC \
	.axes_supported = 8, .max_khz = 125, .buffer_slots = 128, .slot_time = 10, \
	.misc_inputs = WIRE_MISC_INPUT5 | WIRE_MISC_INPUT7

/* Three axes running; the answer to every fill. */
#define FILL_REPLY(accepted_) \
	V(pulse_fill_rep, .accepted = (accepted_), .status = { \
	  .power_states = 1, .axes_enabled = 3, .activated = 1, .engine_state = 3, \
	  .limit_neg = 1, .home = 2, .generator = 0x80, .axis_state = { X8(1) }, \
	  .position = { 0, 2000, -200, 4000, 5000, 6000, 7000, 8000 }, OF_57CNC })

#define COUNT8(n) n, n + 1, n + 2, n + 3, n + 4, n + 5, n + 6, n + 7
#define COUNTING \
	{ COUNT8(0), COUNT8(8), COUNT8(16), COUNT8(24), COUNT8(32), COUNT8(40), COUNT8(48) }

/* 25 kHz, 50000 pulses/s^2, all three switches present, soft limits. */
#define AXIS_GET { \
	.options = WIRE_AXIS_ENABLED | WIRE_AXIS_INTERNAL_PLANNER, \
	.switches = WIRE_SWITCH_LIMIT_N | WIRE_SWITCH_LIMIT_P | WIRE_SWITCH_HOME, \
	.homing_speed = 50, .homing_return = 25, .max_speed = 25.0f, .max_accel = 0.05f, \
	.max_decel = 0.05f, .soft_min = -100000, .soft_max = 100000, \
	.homing_algorithm = 0x83, .back_off = 200, .mpg_divider = 1 }
#define AXIS_SET { \
	.options = WIRE_AXIS_ENABLED | WIRE_AXIS_INTERNAL_PLANNER | WIRE_AXIS_POSITION_MODE, \
	.switches = WIRE_SWITCH_LIMIT_N | WIRE_SWITCH_LIMIT_P | WIRE_SWITCH_HOME, \
	.homing_speed = 50, .homing_return = 25, .mpg_encoder = 1, \
	.max_speed = 15.0f, .max_accel = 0.03f, \
	.max_decel = 0.06f, .soft_min = -100000, .soft_max = 100000, \
	.mpg_multiplier = 10, .pin_enable = 18, .filter_limit_n = 5, \
	.homing_algorithm = 0x83, .back_off = 500, .mpg_divider = 4 }

#define PROBED { -1000, -1001, -1002, -1003, -1004, -1005, -1006, -1007 }
#define MOVE { 9000, -5000, 9000, -5000, 9000, -5000, 9000, -5000 }
#define POSTEP { 96, 35, 2, 2, 0, 1 }	/* 24 V, 35 degrees, asleep no, active */
#define DRIVER { 5, 128 }		/* 1/16 step, 1.25 A */

const struct golden golden_pulse[] = {
	G("PEv2_StatusGet/1:0x85/0x00", PULSE_STATUS, V(pulse_status_req, .check = 0x8B),
	  V(pulse_status_rep, .axes_enabled = 8, .activated = 1, .engine_state = 0, .limit_neg = 1,
	    .home = 2, .generator = 0x80,
	    .position = { 1000, 2000, 3000, 4000, 5000, 6000, 7000, 8000 }, OF_57CNC,
	    .check = 0xE5)),
	G("PEv2_Status2Get/1:0x85/0x08", PULSE_STATUS2, V(pulse_status_req, .check = 0),
	  V(pulse_status2_rep, .limit_neg = 1, .limit_pos = 0, .home = 2, .check = 0x5A)),
	G("PEv2_PulseEngineSetup/1:0x85/0x01", PULSE_SETUP,
	  V(pulse_setup_req, .axes = 3, .generator = WIRE_GENERATOR_EXTENDED_IO,
	    .power_states = WIRE_POWER_STOPPED),
	  V(pulse_result_rep, .result = 0)),
	G("PEv2_AdditionalParametersGet/1:0x85/0x06", PULSE_EMERGENCY,
	  V(pulse_emergency_req, .write = 0, .read_mark = 1),
	  V(pulse_emergency_rep, .pin = 52 + WIRE_EMERGENCY_PIN_BASE)),
	G("PEv2_AdditionalParametersSet/1:0x85/0x06", PULSE_EMERGENCY,
	  V(pulse_emergency_req, .write = 1, .pin = 62), V(pulse_emergency_rep, .pin = 62)),
	G("PEv2_AxisConfigurationGet/1:0x85/0x10", PULSE_AXIS_GET, V(pulse_axis_get_req, .axis = 1),
	  V(pulse_axis_get_rep, .config = AXIS_GET)),
	G("PEv2_AxisConfigurationSet/1:0x85/0x11", PULSE_AXIS_SET,
	  V(pulse_axis_set_req, .axis = 1, .config = AXIS_SET), NULL),
	G("ref2020:PEv2_AxisConfigurationSet/1:0x85/0x11", PULSE_AXIS_SET,
	  V(pulse_axis_set_req, .axis = 1, .config = AXIS_SET), NULL),
	G("PEv2_PositionSet/1:0x85/0x03", PULSE_POSITIONS,
	  V(pulse_positions_req, .mask = 0x05,
	    .position = { 0, -100, -200, -300, -400, -500, -600, -700 }),
	  NULL),
	G("PEv2_PulseEngineStateSet/1:0x85/0x02", PULSE_STATE,
	  V(pulse_state_req, .state = WIRE_ENGINE_RUNNING, .enable_mask = 7), NULL),
	G("PEv2_PulseEngineMove/1:0x85/0x20", PULSE_MOVE, V(pulse_move_req, .reference = MOVE),
	  NULL),
	/* k eighths of full speed */
	G("PEv2_PulseEngineMovePV/1:0x85/0x25", PULSE_MOVE_PV,
	  V(pulse_move_pv_req, .mask = 0xFF, .position = MOVE,
	    .velocity = { 0, 8191, 16383, 24575, 32767, 40959, 49151, 57343 }),
	  NULL),
	G("PEv2_ExternalOutputsGet/1:0x85/0x04", PULSE_OUTPUTS,
	  V(pulse_outputs_req, .read_only = 1), V(pulse_outputs_rep, .relays = 0)),
	G("PEv2_ExternalOutputsSet/1:0x85/0x04", PULSE_OUTPUTS,
	  V(pulse_outputs_req, .relays = 1, .oc = 0x88),
	  V(pulse_outputs_rep, .relays = 1, .oc = 0x88)),
	G("PEv2_BufferFill/1:0x85/0xFF", PULSE_FILL8,
	  V(pulse_fill_req, .slots = 18, .axes = 3, .data = COUNTING), FILL_REPLY(18)),
	G("ref2020:PEv2_BufferFill/1:0x85/0xFF", PULSE_FILL8,
	  V(pulse_fill_req, .slots = 18, .axes = 3, .data = COUNTING), FILL_REPLY(18)),
	G("PEv2_BufferFill_16/1:0x85/0xFE", PULSE_FILL16,
	  V(pulse_fill_req, .slots = 9, .axes = 3, .data = COUNTING), FILL_REPLY(9)),
	{ .name = "PEv2_BufferFillLarge/1:0xB0",
	  .kind = GOLDEN_MULTI,
	  .op = WIRE_OP_PULSE_FILL_PART,
	  .req = &(const struct golden_multi){ { WIRE_SLOTS_8BIT, 149, 3 }, 448 },
	  .rep = FILL_REPLY(149) },
	{ .name = "PEv2_BufferFillLarge_16/1:0xB0",
	  .kind = GOLDEN_MULTI,
	  .op = WIRE_OP_PULSE_FILL_PART,
	  .req = &(const struct golden_multi){ { WIRE_SLOTS_16BIT, 74, 3 }, 448 },
	  .rep = FILL_REPLY(74) },
	G("PEv2_BufferClear/1:0x85/0xF0", PULSE_BUFFER_CLEAR, NULL, NULL),
	G("PEv2_HomingStart/1:0x85/0x21", PULSE_HOME_START,
	  V(pulse_home_start_req, .mask = 3, .offset = { 0, 10, 20, 30, 40, 50, 60, 70 }), NULL),
	G("PEv2_HomingFinish/1:0x85/0x22", PULSE_HOME_FINISH,
	  V(pulse_home_finish_req, .state = 0, .keep_state = 1), NULL),
	/* axis 2 to -20000 at a tenth of full speed until pin 3 is high */
	G("PEv2_ProbingStart/1:0x85/0x23", PULSE_PROBE_START,
	  V(pulse_probe_start_req, .mask = 4, .limit = { 0, 0, -20000 }, .speed = 0.1f,
	    .input = 3 + 8, .polarity = 1),
	  NULL),
	G("PEv2_ProbingHybridStart/1:0x85/0x23", PULSE_PROBE_START,
	  V(pulse_probe_start_req, .hybrid = 1, .input = 3 + 8, .polarity = 1), NULL),
	G("PEv2_ProbingFinish/1:0x85/0x24", PULSE_PROBE_FINISH,
	  V(pulse_probe_finish_req, .keep_state = 0),
	  V(pulse_probe_finish_rep, .position = PROBED, .status = 1)),
	G("PEv2_ProbingFinishSimple/1:0x85/0x24", PULSE_PROBE_FINISH,
	  V(pulse_probe_finish_req, .keep_state = 1),
	  V(pulse_probe_finish_rep, .position = PROBED, .status = 1)),
	G("PEv2_ThreadingStatusGet/1:0x85/0x35", THREAD_STATUS, NULL,
	  V(thread_status_rep, .prepared = 1, .velocity = 1500, .position_error = -3, .rpm = 1200,
	    .ignore_axes = 0x4D)),
	G("PEv2_ThreadingSetup/1:0x85/0x36", THREAD_PARAMS,
	  V(thread_params_req, .mode = 1, .ticks = 4000, .target_rpm = 1200, .speed_gain = 10,
	    .position_gain = 20, .ignore_axes = 0x4D),
	  V(thread_status_rep, .preparing = 0)),
	G("PEv2_ThreadingPrepareForTrigger/1:0x85/0x30", THREAD_PREPARE, NULL, NULL),
	G("PEv2_BacklashGet/1:0x85/0x40", PULSE_BACKLASH_GET, NULL,
	  V(pulse_backlash_rep, .enable = 0)),
	G("PEv2_BacklashSet/1:0x85/0x41", PULSE_BACKLASH_SET,
	  V(pulse_backlash_set_req, .enable = 1, .axis = { { 25, 2, 0 } }),
	  V(pulse_backlash_rep, .enable = 1, .axis = { { 25, 2, 0 } })),
	G("ref2020:PEv2_BacklashSet/1:0x85/0x41", PULSE_BACKLASH_SET,
	  V(pulse_backlash_set_req, .enable = 1, .axis = { { 25, 2, 0 } }),
	  V(pulse_backlash_rep, .enable = 1, .axis = { { 25, 2, 0 } })),
	G("PEv2_SyncedPWMSetup/1:0x85/0x0A", PULSE_SYNC_PWM,
	  V(pulse_sync_pwm_req, .option = WIRE_SYNC_ON, .axis = 1, .channel = 2),
	  V(pulse_sync_pwm_req, .option = 0)),
	G("PoStep_ConfigurationGet/1:0x85/0x50", POSTEP_COMM, V(postep_comm_req, .option = 0),
	  V(postep_comm_req, .option = 0)),
	G("PoStep_ConfigurationSet/1:0x85/0x50", POSTEP_COMM,
	  V(postep_comm_req, .option = 0x10, .enable = 1, .axis = { { 1, 0x21, 0x3F } }),
	  V(postep_comm_req, .option = 0x10, .enable = 1, .axis = { { 1, 0x21, 0x3F } })),
	G("PoStep_StatusGet/1:0x85/0x51", POSTEP_STATUS, NULL,
	  V(postep_status_rep,
	    .axis = { POSTEP, POSTEP, POSTEP, POSTEP, POSTEP, POSTEP, POSTEP, POSTEP })),
	G("PoStep_DriverConfigurationSet/1:0x85/0x52", POSTEP_CURRENTS,
	  V(postep_currents_req, .option = 0x10, .axis = { { 2000, 0, 0 } }),
	  V(postep_currents_req, .option = 0x10, .axis = { { 2000, 0, 0 } })),
	G("PoStep_DriverConfigurationSet/2:0x85/0x53", POSTEP_MODES,
	  V(postep_modes_req, .option = 0x10), V(postep_modes_req, .option = 0x10)),
	G("PoStep_DriverConfigurationGet/1:0x85/0x52", POSTEP_CURRENTS,
	  V(postep_currents_req, .option = 0),
	  V(postep_currents_req, .option = 0, .axis = { { 2000, 0, 0 } })),
	G("PoStep_DriverConfigurationGet/2:0x85/0x53", POSTEP_MODES,
	  V(postep_modes_req, .option = 0), V(postep_modes_req, .option = 0)),
	G("PEv2_PulseEngineReboot/1:0x85/0x05", PULSE_REBOOT, NULL, NULL),
	G("PEv2_SyncOutputsSetup/1:0x85/0x0B", PULSE_SYNC_OUTPUTS,
	  V(pulse_sync_outputs_req, .option = WIRE_SYNC_ON, .axis = 3,
	    .pin = { 92, 93, 94, 95, 96, 97, 98, 99 }),
	  V(pulse_sync_outputs_req, .option = 0)),
	G("PEv2_InternalDriversConfigurationGet/1:0x85/0x18", PULSE_DRIVERS_GET, NULL,
	  V(pulse_drivers, .driver = { DRIVER, DRIVER, DRIVER, DRIVER })),
	G("PEv2_InternalDriversConfigurationSet/1:0x85/0x19", PULSE_DRIVERS_SET,
	  V(pulse_drivers, .driver = { DRIVER, DRIVER, DRIVER, DRIVER }), NULL),
	{ .name = NULL },
};
