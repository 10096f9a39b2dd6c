/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Connection, errors, and what the machine may do.
 *
 * packet-error-* are those of hm2_eth, but nothing here latches that fresh data
 * could clear. connected and machine-is-on are names of the older userspace
 * component as well, with the same meaning.
 */
#include "halbridge/table_rows.h"

#define STATUS(name, member, ...)	ROW(name, PIN, OUT, READ, member, __VA_ARGS__)
#define OUTCOME(name, member, ...)	ROW(name, PIN, OUT, WRITE, member, __VA_ARGS__)
#define TIME(name, initial, member, help)	\
	ROW(name, PARAM, RW, READ, member, help, PARAMETER(initial, 0, 0))
#define COUNT(name, initial, member) \
	ROW(name, PARAM, RW, READ, member, "1 or more", PARAMETER(initial, 1, INT32_MAX))

static const struct table_row rows[] = {
	STATUS("connected", connected, "the device runs and its data are fresh", BOTH_SCHEMES),
	STATUS("stale", stale,
	       "the pins below hold old values: no data younger than the daemon's stale-after-ms, "
	       "or daemon-alive is false"),
	STATUS("daemon-alive", daemon_alive,
	       "the daemon has published within the last 5 ms or 5 of its cycles"),
	STATUS("attach-state", attach_state,
	       "0 no daemon, 1 attached to its shared memory, 2 refused (the log says why)"),
	STATUS("link-state", link_state,
	       "0 searching, 1 identifying, 2 configuring, 3 running, 4 lost; as last reported by "
	       "the daemon"),
	STATUS("fault", fault,
	       "why the link does not run, or did not the last time: 0 none, 1 no address, "
	       "2 no answer, 3 wrong serial number, 4 unsupported device, 5 setting refused, "
	       "6 locked, 7 rebooted, 8 network, 9 driven by another daemon or section, "
	       "10 the daemon's computer was suspended"),
	STATUS("fault-count", fault_count, "link faults since the daemon's start"),
	STATUS("reconnects", reconnects, "times the device was found again"),
	STATUS("cycle", cycle, "the daemon's cycle that the pin values are from (low 32 bits)"),
	STATUS("age-us", age_us, "age of the oldest fast data, microseconds; grows while stale"),
	STATUS("rtt-us", rtt_us, "last round trip, microseconds"),
	STATUS("rtt-avg-us", rtt_avg_us, "smoothed round trip, microseconds"),
	STATUS("rtt-max-us", rtt_max_us, "longest round trip, microseconds"),
	STATUS("rtt-jitter-us", rtt_jitter_us, "mean deviation of the round trip, microseconds"),
	STATUS("phase-locked", phase_locked,
	       "the daemon publishes fresh data just before each read of the servo thread"),
	STATUS("phase-error-us", phase_error_us,
	       "how much later the last read came than the daemon's cycle was scheduled for, "
	       "microseconds"),
	STATUS("packet-error", packet_error,
	       "a request missed its deadline since the previous read, or there is no fresh data"),
	STATUS("packet-error-level", packet_error_level,
	       "rises by packet-error-increment at each read with packet-error, falls by "
	       "packet-error-decrement at each without; between 0 and packet-error-limit"),
	STATUS("packet-error-total", packet_error_total,
	       "requests without a reply by their deadline since the module was loaded"),
	STATUS("packet-error-exceeded", packet_error_exceeded,
	       "the level is at its limit; clears itself when the level falls"),
	COUNT("packet-error-limit", 10, packet_error_limit),
	COUNT("packet-error-increment", 2, packet_error_increment),
	COUNT("packet-error-decrement", 1, packet_error_decrement),

	TIME("read-time-max", 0, read_time_max,
	     "longest time that pokeys.N.read took, microseconds; set it to 0 to start a new "
	     "measurement"),
	TIME("write-time-max", 0, write_time_max,
	     "longest time that pokeys.N.write took, microseconds; set it to 0 to start a new "
	     "measurement"),
	TIME("time-threshold", 200, time_threshold,
	     "longest permitted time of read and write together in one period, microseconds; "
	     "0: no check"),
	STATUS("time-exceeded-count", time_exceeded_count,
	       "periods in which read and write together took longer than time-threshold"),

	ROW("machine-is-on", PIN, IN, WRITE, machine_is_on,
	    "the machine is on: motion is requested; each rising edge requests it again",
	    BOTH_SCHEMES),
	ROW("motion-type", PIN, IN, READ, motion_type,
	    "connect it to motion.motion-type. Along a path of LinuxCNC, pos-fb of joints in "
	    "buffered mode then leaves out the delay of the device's buffer, so the delay is not a "
	    "following error. For probing, homing and jogging, and if this pin is not connected, "
	    "pos-fb is the reported position"),
	ROW("emergency-stop", PIN, IN, WRITE, emergency_stop,
	    "emergency stop: axes stop and outputs go to the safe state at once (see "
	    "on-emergency in pokeysd.conf), until this pin is false and machine-is-on rises"),
	STATUS("machine-on-permitted", machine_on_permitted,
	       "the daemon permits motion (machine-is-on rose while the link ran)"),
	STATUS("needs-edge", needs_edge,
	       "machine-is-on is high, but must fall and rise again before anything moves"),
	STATUS("outputs-held", outputs_held,
	       "outputs are held in the safe state after a loss or an emergency stop, until "
	       "machine-is-on rises (exceptions after a loss: resume-outputs in pokeysd.conf)"),
	STATUS("position-lost", position_lost, "position-lost of at least one joint", BOTH_SCHEMES),
	STATUS("unhome", unhome,
	       "a joint with a lost position is still homed in LinuxCNC: use this pin to switch "
	       "the machine off and to unhome the joints; true for 250 ms in every 500 ms"),
	STATUS("safe-state", safe_state, "the daemon holds outputs and axes in the safe state"),
	STATUS("commander", commander, "the daemon follows this component's commands"),
	STATUS("command-refused", command_refused, "the daemon refused values of the last command"),
	STATUS("command-refused-count", command_refused_count, "values the daemon refused"),
	OUTCOME("read-missing", read_missing,
		"pokeys.N.write runs without pokeys.N.read: machine-is-on and the joints' enable "
		"are not passed on until pokeys.N.read runs again and machine-is-on has risen"),
	OUTCOME("input-refused", input_refused,
		"a pin or parameter holds a value that is not used (see the log)"),
	OUTCOME("input-refused-count", input_refused_count,
		"times a pin or parameter came to hold such a value"),
	OUTCOME("one-shot-full", one_shot_full,
		"64 one-shot commands are already waiting; the newest was not accepted"),
	STATUS("error-active", error_active, "error-code is not 0"),
	STATUS("error-code", error_code,
	       "0 none, 1 communication, 2 device fault (a motor driver reports an error), "
	       "3 limit switch, 4 emergency stop, 5 configuration, 6 a heater with on-fault = "
	       "machine has a fault; if there are several, the order of priority is 1, 4, 6, 3, "
	       "2, 5"),
	STATUS("error-count", error_count,
	       "number of errors since the first connection to the device"),
	STATUS("one-shot-failed-count", one_shot_failed_count,
	       "one-shot commands that the daemon or the device refused or lost"),
};

TABLE_GROUP(table_link, rows);
