/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The pulse engine as a whole, its emergency input, and the outputs of its
 * connector.
 *
 * The two bytes of outputs are those of the command image: which bit is which
 * relay depends on the device (protocol section 3.24.3), so they are numbered.
 */
#include "halbridge/table_rows.h"

#define STATUS(name, member, ...)	ROW(name, PIN, OUT, READ, member, __VA_ARGS__)
#define ENGINE(name, member, low, high, help)						\
	ROW("engine." name, PARAM, RW, WRITE, set.engine.member,			\
	    "device setting: " help, SETTING(low, high))

static const struct table_row rows[] = {
	STATUS("engine-state", engine.state,
	       "pulse engine: 0 stopped, 3 running, 10 jogging, 11 stopping, 20 home, 21 homing, "
	       "30 probed, 31 probing, 32 probe error, 100 limit, 101 emergency"),
	STATUS("emergency", engine.emergency,
	       "the pulse engine is in emergency, or its input is active"),
	STATUS("emergency-not", engine.emergency_not, "its inverse"),
	STATUS("engine.axes-enabled", engine.axes_enabled, "axes the engine has enabled"),
	STATUS("engine.activated", engine.activated, "the engine is initialised"),
	STATUS("engine.charge-pump-state", engine.charge_pump,
	       "the charge pump's setting in effect"),
	STATUS("engine.generator-state", engine.generator, "the generator's setting in effect"),
	STATUS("engine.power-states-in-effect", engine.power_states,
	       "in which states the power is enabled, see engine.power-states"),
	STATUS("engine.probe-status", engine.probe_status, "bits of the axes that have probed"),
	STATUS("engine.buffer-slots", engine.buffer_slots, "size of the motion buffer, slots"),
	STATUS("engine.buffer-level", engine.buffer_level, "slots in use, as far as known"),
	STATUS("engine.buffer-underruns", engine.buffer_underruns,
	       "how often the buffer ran dry while axes were moving, since the daemon's start"),
	STATUS("engine.buffer-resyncs", engine.buffer_resyncs,
	       "how often positions were read back to find out what had been executed"),
	ROW("engine.dry-loses-position", PARAM, RW, READ, engine.dry_loses,
	    "a buffer that runs dry, a limit switch and the emergency input stop axes without a "
	    "ramp, and that is a loss of position for those that moved; 0: this machine's motors "
	    "lose no steps in such a stop",
	    PARAMETER(1, 0, 1)),
	STATUS("engine.slot-us", engine.slot_us, "time of a slot, microseconds"),
	ROW("engine.limit-override", PIN, IN, WRITE, engine.limit_override,
	    "axes may leave their limit switches; the device has one override for all axes, so no "
	    "limit switch stops any of them"),
	STATUS("engine.limit-override-active", engine.limit_override_active,
	       "the override is active in the device"),
	ROW("engine.clear-fault", PIN, IN, WRITE, engine.clear_fault,
	    "its rising edge takes the engine out of a limit or emergency stop"),
	ROW("engine.mpg-jog", PIN, IN, WRITE, engine.mpg_jog,
	    "while true, axes with an mpg-encoder follow their hand wheels (engine-state 10) "
	    "instead of their commands"),
	LIST("engine.misc.%02u.in", PIN, OUT, READ, engine.misc_in, 8,
	     "further inputs of the engine's connector: 04..06 inputs 5 to 7, 07 spindle error"),
	LIST("engine.misc.%02u.in-not", PIN, OUT, READ, engine.misc_in_not, 8, "its inverse"),

	ENGINE("axes", axes, 0, POKEYS_AXES, "number of axes"),
	ENGINE("charge-pump", charge_pump, 0, 65, "0 off, 1 default pin, else terminal + 10"),
	ENGINE("generator", generator, 0, 2, "0 external, 1 integrated, 2 external smart"),
	ENGINE("swap-step-dir", swap_step_dir, 0, 1, "swap step and direction outputs"),
	ENGINE("extended-io", extended_io, 0, 1, "the extended I/O is used"),
	ENGINE("emergency-invert", emergency_invert, 0, 1, "1 normally open, 0 normally closed"),
	ENGINE("emergency-pin", emergency_pin, 0, 65, "0 off, 1 default pin, else terminal + 10"),
	ENGINE("power-states", power_states, 0, 255,
	       "power stays on while: sum of 1 stopped, 2 limit, 4 emergency; "
	       "the charge pump: 16, 32, 64"),

	LIST("external.%02u.out", PIN, IN, WRITE, external.output, VALUES_EXTERNAL,
	     "output or relay of the board, see pokeys_terminals(7); all eight are commanded once "
	     "one has been true"),
	LIST("external.%02u.out-fb", PIN, OUT, READ, external.output_fb, VALUES_EXTERNAL,
	     "as the device has it"),
	LIST("external-relay.%02u.out", PIN, IN, WRITE, external.relay, VALUES_EXTERNAL,
	     "relay of the engine's connector, not of the board; all are commanded once one has "
	     "been true"),
	LIST("external-relay.%02u.out-fb", PIN, OUT, READ, external.relay_fb, VALUES_EXTERNAL,
	     "as the device has it"),
};

TABLE_GROUP(table_engine, rows);
