/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The older userspace component's names of the pulse engine as a whole, and
 * what its names never were: legacy.*, the choices.
 *
 * Some names of the old component did nothing, though every machine wires
 * them. They work here; where that would change what a machine does that runs
 * today, a choice has to be made for it first, and its default is what the
 * machine does today. docs/compatibility.md tells each with its reason.
 */
#include "halbridge/table_legacy.h"

#define WANTED(member)	legacy.engine.member

static const struct table_row rows[] = {
	L_OUT("PEv2.deb.out", WANTED(step), "age of the motion data, us"),
	L_OUT("PEv2.deb.estop", WANTED(emergency_step),
	      "reason for the value of Emergency.in: 8 engine's state, 9 pin, 10 pin at rest, 11 "
	      "connection lost, 12 no pin"),
	L_OUT("PEv2.nrOfAxes", WANTED(axes), "axes the device has"),
	L_OUT("PEv2.maxPulseFrequency", WANTED(khz), "kHz"),
	L_OUT("PEv2.bufferDepth", WANTED(slots), "slots of the motion buffer"),
	L_OUT("PEv2.slotTiming", WANTED(slot_time), "time of one slot, in units of 100 us"),
	L_IO("PEv2.params.ApplyIniSettings", WANTED(apply),
	     "true: the device gets the settings below; false: they show what it has"),
	L_SET("PEv2.PulseEngineEnabled", legacy.engine_set.axes,
	      "axes enabled in the engine: those the device has", PARAMETER(0, 0, POKEYS_AXES)),
	L_SET("PEv2.PulseGeneratorType", legacy.engine_set.generator,
	      "0 external 8 axes, 1 internal 3 axes, 2 smart external, 64 swap, 128 extended I/O",
	      PARAMETER(0, 0, 255)),
	L_SET("PEv2.PG-swap-stepdir", legacy.engine_set.swap, "swap step and direction", ANY_BIT),
	L_SET("PEv2.PG-extended-io", legacy.engine_set.extended,
	      "external outputs are there; a 57CNC always has them", ANY_BIT),
	L_SET("PEv2.ChargePumpEnabled", legacy.engine_set.charge_pump,
	      "1 its own output, else 10 + pin; 0 = as the device has it", PARAMETER(0, 0, 65)),
	L_OUT("PEv2.PulseEngineActivated", WANTED(activated), "the engine is activated"),
	L_OUT("PEv2.PulseEngineState", engine.state,
	      "0 stopped, 3 running, 10 jogging, 11 stopping, 20 home, 21 homing, 30 to 32 "
	      "probing, 100 limit, 101 emergency"),
	L_OUT("PEv2.PulseEngineStateSetup", WANTED(wanted_state),
	      "requested state: 0 stopped, 3 running, as machine-is-on"),
	L_OUT("PEv2.MiscInputStatus", WANTED(misc), "misc inputs, bits"),
	LIST("PEv2.digin.Misc-%u.in", PIN, OUT, READ, engine.misc_in, 8, "one misc input", LEGACY),
	LIST("PEv2.digin.Misc-%u.in-not", PIN, OUT, READ, engine.misc_in_not, 8, "its inverse",
	     LEGACY),
	L_IO("PEv2.LimitOverride", WANTED(override), "the device's limits are overridden"),
	L_IO("PEv2.LimitOverrideSetup", WANTED(override_wanted),
	     "not 0: override the limits; has effect with legacy.limit-override-follows"),
	L_OUT("PEv2.digin.Probed.in", WANTED(probed), "probing has ended"),
	L_OUT("PEv2.digin.Emergency.in", WANTED(emergency),
	      "emergency; see legacy.emergency-without-pin and legacy.emergency-when-lost, and "
	      "legacy.old-emergency, which inverts it"),
	L_OUT("PEv2.digin.Emergency.in-not", WANTED(emergency_not), "its inverse"),
	L_IN("PEv2.digout.Emergency.out", WANTED(emergency_out),
	     "level of digout.Emergency.Pin; has effect with legacy.emergency-out-follows"),
	L_IO("PEv2.AxisEnabledMask", WANTED(enabled_mask), "axes that are enabled, bits"),
	L_IO("PEv2.AxisEnabledStatesMask", WANTED(power_mask),
	     "engine states in which the motors have power, bits"),
	L_OUT("PEv2.ExternalRelayOutputs", WANTED(relays), "relays as the device has them"),
	L_OUT("PEv2.ExternalOCOutputs", WANTED(outputs),
	      "open-collector outputs as the device has them"),
	LIST("PEv2.digout.ExternalRelay-%u.out", PIN, IN, WRITE, WANTED(relay), LEGACY_EXTERNAL,
	     "external relay, with PG-extended-io", LEGACY),
	LIST("PEv2.digout.ExternalOC-%u.out", PIN, IN, WRITE, WANTED(output), LEGACY_EXTERNAL,
	     "external open-collector output, with PG-extended-io", LEGACY),
	L_IO("PEv2.HomingStartMaskSetup", WANTED(home_mask),
	     "axes to home now, bits; cleared when the request has been passed on"),
	L_IO("PEv2.ProbeStartMaskSetup", WANTED(probe_mask),
	     "axes to probe with now, bits; cleared when the request has been passed on"),
	L_OUT("PEv2.ProbeStatus", WANTED(probe_status), "axes that have probed, bits"),
	L_IO("PEv2.ProbeSpeed", WANTED(probe_speed), "fraction of MaxSpeed, 0 to 1"),
	L_IO("PEv2.BacklashCompensationEnabled", WANTED(backlash),
	     "the device compensates backlash (ApplyIniSettings); 0 = as the device has it"),
	L_SET("PEv2.digin.Emergency.Pin", legacy.engine_set.emergency_pin,
	      "physical pin; 0 = as the device has it", PARAMETER(0, 0, POKEYS_PINS)),
	L_SET("PEv2.digin.Emergency.invert", legacy.engine_set.emergency_invert,
	      "emergency when the input is 0", PARAMETER(0, 0, 1)),
	L_SET("PEv2.digout.Emergency.Pin", legacy.engine_set.emergency_out_pin,
	      "physical pin of the emergency output; 0 = none", PARAMETER(0, 0, POKEYS_PINS)),
	L_SET("PEv2.digin.Probe.Pin", legacy.engine_set.probe_pin,
	      "physical pin of the probe; 0 = none", PARAMETER(0, 0, POKEYS_PINS)),
	L_SET("PEv2.digin.Probe.invert", legacy.engine_set.probe_invert, "probe polarity",
	      PARAMETER(0, 0, 1)),
};

static const struct table_row choices[] = {
	L_SET("legacy.axis-enable-follows", legacy.choice.axis_enable,
	      "an axis moves only while its digout.AxisEnable.out or digout.AxisEnabled.out is "
	      "true; false: as long as the machine is on",
	      PARAMETER(0, 0, 1)),
	L_SET("legacy.emergency-without-pin", legacy.choice.emergency_unset,
	      "Emergency.in is true if no emergency pin is set", PARAMETER(1, 0, 1)),
	L_SET("legacy.emergency-when-lost", legacy.choice.emergency_lost,
	      "Emergency.in is true while there are no fresh data", PARAMETER(1, 0, 1)),
	L_SET("legacy.emergency-out-follows", legacy.choice.emergency_out,
	      "digout.Emergency.out drives its pin", PARAMETER(0, 0, 1)),
	L_SET("legacy.adcout-follows", legacy.choice.adcout,
	      "adcout.N.value and enable drive the PWM outputs", PARAMETER(0, 0, 1)),
	L_SET("legacy.limit-override-follows", legacy.choice.limit_override,
	      "LimitOverrideSetup overrides the device's limits", PARAMETER(0, 0, 1)),
	L_SET("legacy.ponet-out-follows", legacy.choice.ponet_out,
	      "PoNET.N.digout.M.out are sent to the modules", PARAMETER(0, 0, 1)),
	L_SET("legacy.whole-scale", legacy.choice.whole_scale,
	      "use the whole part of STEP-SCALE only, as the old component did",
	      PARAMETER(0, 0, 1)),
	L_SET("legacy.pressed-key-lights", legacy.choice.pressed_key,
	      "a key of the kbd48CNC is lit while it is pressed, if its lamps are commanded",
	      PARAMETER(1, 0, 1)),
	L_SET("legacy.key-brightness", legacy.choice.key_brightness,
	      "the brightness of the kbd48CNC's lamps is 255 - lightValue, if they are commanded",
	      PARAMETER(1, 0, 1)),
	L_SET("legacy.old-switches", legacy.choice.old_switches,
	      "LimitN.in, LimitP.in and Home.in of switches at pins are inverted as in the old "
	      "component, while the engine runs",
	      PARAMETER(0, 0, 1)),
	L_SET("legacy.old-emergency", legacy.choice.old_emergency,
	      "Emergency.in is true while there is no emergency, as it was until March 2025",
	      PARAMETER(0, 0, 1)),
	L_SET("legacy.encoder-factor", legacy.choice.encoder_factor,
	      "with names=both: scale of encoder.10 to encoder.25, whose names belong to both "
	      "schemes, is units per count",
	      PARAMETER(0, 0, 1)),
};

TABLE_GROUP(table_legacy_engine, rows);
TABLE_GROUP(table_legacy_choice, choices);
