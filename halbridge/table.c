/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Every pin and parameter of one device, one row each.
 *
 * The type of a row is taken from its member in struct values by the
 * compiler, so the two cannot differ. Names of info.* and devSerial keep the
 * mixed case of the older userspace component, whose users have them in their
 * HAL files. Index conventions: pin, adc, encoder and joint count from 00;
 * pin.00 is the terminal the device calls pin 1, adc.00 is pin 41.
 *
 * Conventions of LinuxCNC's canonical devices hold where one exists: adc
 * value = volts * scale - offset; encoder scale is counts per unit and
 * index-enable is set by the reader and cleared by us; packet-error-* are
 * those of hm2_eth, but nothing here latches that fresh data could clear.
 */
#include "halbridge/table.h"
#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include "halbridge/values.h"

#define TYPE_OF(member) _Generic(((struct values *)0)->member,	\
	bool: TABLE_BIT, double: TABLE_FLOAT, int32_t: TABLE_S32, uint32_t: TABLE_U32)

#define ROW(name_, kind_, direction_, when_, initial_, member_, help_) {		\
	.name = name_, .kind = TABLE_##kind_, .type = TYPE_OF(member_),			\
	.direction = TABLE_##direction_, .when = TABLE_AT_##when_,			\
	.offset = offsetof(struct values, member_), .count = 1, .initial = initial_,	\
	.help = help_ }

#define ROWS(name_, kind_, direction_, when_, initial_, array_, member_, help_) {	\
	.name = name_, .kind = TABLE_##kind_, .type = TYPE_OF(array_[0].member_),	\
	.direction = TABLE_##direction_, .when = TABLE_AT_##when_,			\
	.offset = offsetof(struct values, array_[0].member_),				\
	.stride = sizeof(((struct values *)0)->array_[0]),				\
	.count = sizeof(((struct values *)0)->array_) /					\
		 sizeof(((struct values *)0)->array_[0]),				\
	.initial = initial_, .help = help_ }

#define STATUS(name, member, help)	ROW(name, PIN, OUT, READ, 0, member, help)
#define OUTCOME(name, member, help)	ROW(name, PIN, OUT, WRITE, 0, member, help)
#define INFO(name, member, help)	ROW("info." name, PIN, OUT, READ, 0, info.member, help)
#define SETTING(name, initial, member, help) ROW(name, PARAM, RW, READ, initial, member, help)
#define FACT(name, member, help)	ROW(name, PARAM, RO, READ, 0, member, help)

_Static_assert(sizeof(struct values) <= UINT16_MAX, "offsets in the table are 16 bits wide");

const struct table_row table_rows[] = {
	STATUS("connected", connected,
	       "the device runs and its data are fresh"),
	STATUS("stale", stale,
	       "the pins below hold old values: no data younger than the daemon's stale-after, "
	       "or daemon-alive is false"),
	STATUS("daemon-alive", daemon_alive,
	       "the daemon has published within the last 5 ms or 5 of its cycles"),
	STATUS("attach-state", attach_state,
	       "0 no daemon, 1 attached to its shared memory, 2 refused (the log says why)"),
	STATUS("link-state", link_state,
	       "0 searching, 1 identifying, 2 configuring, 3 running, 4 lost; as the daemon "
	       "last said"),
	STATUS("fault", fault,
	       "why the link does not run, or did not the last time: 0 none, 1 no address, "
	       "2 no answer, 3 wrong serial number, 4 unsupported device, 5 setting refused, "
	       "6 locked, 7 rebooted, 8 network"),
	STATUS("fault-count", fault_count, "link faults since the daemon's start"),
	STATUS("reconnects", reconnects, "times the device was found again"),
	STATUS("cycle", cycle, "the daemon's cycle the pins are of (low 32 bits)"),
	STATUS("age-us", age_us, "age of the oldest fast data, microseconds; grows while stale"),
	STATUS("rtt-us", rtt_us, "last round trip, microseconds"),
	STATUS("rtt-avg-us", rtt_avg_us, "smoothed round trip, microseconds"),
	STATUS("rtt-max-us", rtt_max_us, "longest round trip, microseconds"),
	STATUS("rtt-jitter-us", rtt_jitter_us, "mean deviation of the round trip, microseconds"),
	STATUS("packet-error", packet_error,
	       "since the read before, a packet was lost, or there is no fresh data"),
	STATUS("packet-error-level", packet_error_level,
	       "rises by packet-error-increment at each read with packet-error, falls by "
	       "packet-error-decrement at each without; between 0 and packet-error-limit"),
	STATUS("packet-error-total", packet_error_total,
	       "packets lost since the module was loaded"),
	STATUS("packet-error-exceeded", packet_error_exceeded,
	       "the level is at its limit; clears itself when the level falls"),
	SETTING("packet-error-limit", 10, packet_error_limit, "1 or more"),
	SETTING("packet-error-increment", 2, packet_error_increment, "1 or more"),
	SETTING("packet-error-decrement", 1, packet_error_decrement, "1 or more"),

	ROW("machine-is-on", PIN, IN, WRITE, 0, machine_is_on,
	    "the machine is on: motion is wanted; each rising edge asks for it anew"),
	STATUS("machine-on-permitted", machine_on_permitted,
	       "the daemon permits motion (machine-is-on rose while the link ran)"),
	STATUS("needs-edge", needs_edge,
	       "machine-is-on is high, but must fall and rise again before anything moves"),
	STATUS("safe-state", safe_state, "the daemon holds outputs and axes in the safe state"),
	STATUS("commander", commander, "the daemon follows this component's commands"),
	STATUS("command-refused", command_refused,
	       "the daemon refused values of the last command"),
	STATUS("command-refused-count", command_refused_count, "values the daemon refused"),
	OUTCOME("input-refused", input_refused,
		"a pin or parameter holds a value that is not used (see the log)"),
	OUTCOME("input-refused-count", input_refused_count,
		"times a pin or parameter came to hold such a value"),
	OUTCOME("one-shot-full", one_shot_full,
		"64 one-shot commands wait already, the newest was not taken"),
	STATUS("one-shot-failed-count", one_shot_failed_count,
	       "one-shot commands that the daemon or the device refused or lost"),

	STATUS("engine-state", engine_state,
	       "pulse engine: 0 stopped, 3 running, 10 jogging, 11 stopping, 20 home, 21 homing, "
	       "30 probed, 31 probing, 32 probe error, 100 limit, 101 emergency"),
	STATUS("emergency", emergency, "the pulse engine is in emergency, or its input is active"),

	SETTING("devSerial", 0, device_serial,
		"serial number of the device in use; written when it is identified"),
	FACT("info.SerialNumber", info.serial, "serial number"),
	FACT("info.DeviceTypeID", info.type_id, "hardware id"),
	INFO("PinCount", pins, "digital pins"),
	INFO("PWMCount", pwm, "PWM channels"),
	INFO("BasicEncoderCount", basic_encoders, "basic encoders"),
	INFO("EncodersCount", encoders, "encoders of all kinds"),
	INFO("FastEncoders", fast_encoders, "fast encoders"),
	INFO("UltraFastEncoders", ultra_fast_encoders, "ultra-fast encoders"),
	INFO("PWMinternalFrequency", pwm_hz, "clock of the PWM counter, Hz"),
	INFO("AnalogInputs", analog_inputs, "analog inputs"),
	INFO("KeyMapping", key_mapping, "key mapping"),
	INFO("TriggeredKeyMapping", triggered_key_mapping, "triggered key mapping"),
	INFO("KeyRepeatDelay", key_repeat_delay, "key repeat delay"),
	INFO("DigitalCounters", digital_counters, "digital counters"),
	INFO("JoystickButtonAxisMapping", joystick_button_axis, "joystick button and axis mapping"),
	INFO("JoystickAnalogToDigitalMapping", joystick_analog_digital,
	     "joystick analog to digital mapping"),
	INFO("Macros", macros, "macros"),
	INFO("MatrixKeyboard", matrix_keyboard, "matrix keyboard"),
	INFO("MatrixKeyboardTriggeredMapping", matrix_triggered_mapping,
	     "matrix keyboard with triggered mapping"),
	INFO("LCD", lcd, "LCD"),
	INFO("MatrixLED", matrix_led, "matrix LED displays"),
	INFO("ConnectionSignal", connection_signal, "connection signal"),
	INFO("PoExtBus", poextbus, "PoExtBus, bytes"),
	INFO("PoNET", ponet, "PoNET"),
	INFO("AnalogFiltering", analog_filtering, "filter of the analog inputs"),
	INFO("InitOutputsStart", init_outputs, "start values of outputs"),
	INFO("protI2C", i2c, "I2C"),
	INFO("prot1wire", one_wire, "1-wire"),
	INFO("AdditionalOptions", additional_options, "options that can be activated"),
	INFO("LoadStatus", load_status, "tells its processor load"),
	INFO("CustomDeviceName", custom_name, "a name of its own"),
	INFO("PoTLog27support", potlog27, "PoTLog27"),
	INFO("SensorList", sensor_list, "sensor list"),
	INFO("WebInterface", web_interface, "web interface"),
	INFO("FailSafeSettings", failsafe, "failsafe settings"),
	INFO("JoystickHATswitch", joystick_hat, "joystick hat switch"),
	INFO("PulseEngine", pulse_engine, "pulse engine, version 1"),
	INFO("PulseEnginev2", pulse_engine_v2, "pulse engine, version 2"),
	INFO("EasySensors", easy_sensors, "EasySensor slots"),

	ROWS("pin.%02u.in", PIN, OUT, READ, 0, pin, in, "digital input; pin.00 is pin 1"),
	ROWS("pin.%02u.in-not", PIN, OUT, READ, 0, pin, in_not, "its inverse"),
	ROWS("pin.%02u.out", PIN, IN, WRITE, 0, pin, out,
	     "digital output; followed if the device has the pin configured as an output"),

	ROWS("adc.%02u.value", PIN, OUT, READ, 0, analog, value,
	     "analog input: volts * scale - offset; adc.00 is pin 41"),
	ROWS("adc.%02u.raw", PIN, OUT, READ, 0, analog, raw, "0..4095 = 0..3.3 V at the pin"),
	ROWS("adc.%02u.scale", PARAM, RW, READ, 1, analog, scale, "units per volt"),
	ROWS("adc.%02u.offset", PARAM, RW, READ, 0, analog, offset, "units, subtracted"),

	ROWS("encoder.%02u.count", PIN, OUT, READ, 0, encoder, count,
	     "counts since reset or index; 25 is the ultra-fast encoder"),
	ROWS("encoder.%02u.position", PIN, OUT, READ, 0, encoder, position,
	     "counts / scale; does not wrap with count"),
	ROWS("encoder.%02u.velocity", PIN, OUT, READ, 0, encoder, velocity,
	     "units per second, from the times the counts were sampled"),
	ROWS("encoder.%02u.reset", PIN, IN, READ, 0, encoder, reset,
	     "while true, count and position are held at 0 (the device's counter runs on)"),
	ROWS("encoder.%02u.index-enable", PIN, IO, READ, 0, encoder, index_enable,
	     "set it: at the next index pulse the device zeroes the count and we clear it"),
	ROWS("encoder.%02u.scale", PARAM, RW, READ, 1, encoder, scale, "counts per unit, not 0"),

	ROWS("joint.%02u.enable", PIN, IN, WRITE, 0, joint, enable, "this axis may move"),
	ROWS("joint.%02u.pos-cmd", PIN, IN, WRITE, 0, joint, pos_cmd, "commanded position, units"),
	ROWS("joint.%02u.vel-cmd", PIN, IN, WRITE, 0, joint, vel_cmd,
	     "commanded speed, units per second; 0, or unconnected: as fast as the axis may"),
	ROWS("joint.%02u.pos-fb", PIN, OUT, READ, 0, joint, pos_fb,
	     "position as the device reports, units"),
	ROWS("joint.%02u.in-position", PIN, OUT, READ, 0, joint, in_position,
	     "stands at the position last commanded"),
	ROWS("joint.%02u.enabled", PIN, OUT, READ, 0, joint, enabled,
	     "the daemon drives this axis"),
	ROWS("joint.%02u.homed", PIN, OUT, READ, 0, joint, homed, "homed by the device"),
	ROWS("joint.%02u.error", PIN, OUT, READ, 0, joint, error, "motor driver's error input"),
	ROWS("joint.%02u.limit-neg", PIN, OUT, READ, 0, joint, limit_neg, "negative limit switch"),
	ROWS("joint.%02u.limit-pos", PIN, OUT, READ, 0, joint, limit_pos, "positive limit switch"),
	ROWS("joint.%02u.soft-limit", PIN, OUT, READ, 0, joint, soft_limit, "soft limit reached"),
	ROWS("joint.%02u.home-sw", PIN, OUT, READ, 0, joint, home_switch, "home switch"),
	ROWS("joint.%02u.state", PIN, OUT, READ, 0, joint, state,
	     "0 stopped, 1 ready, 2 running, 8 resetting, 9 backing off, 10 home, "
	     "11 homing starts, 12 homing search, 13 homing back, 14 probed, 15 probe starts, 16 probe search, "
	     "20 error, 30 limit"),
	ROWS("joint.%02u.refused", PIN, OUT, WRITE, 0, joint, refused,
	     "a command or the scale of this joint is not used: not a number, out of range, "
	     "or scale changed while enabled"),
	ROWS("joint.%02u.scale", PARAM, RW, WRITE, 1, joint, scale,
	     "pulses per unit, not 0; taken over while enable is false"),
};

const size_t table_row_count = sizeof(table_rows) / sizeof(table_rows[0]);
