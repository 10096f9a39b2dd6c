/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * How the driver itself does: rates, counters, and the device's settings.
 *
 * Counters are the low 32 bits of the daemon's, which begins them anew when it is
 * started.
 */
#include "halbridge/table_rows.h"

#define DIAGNOSTIC(name, member, help)	\
	ROW(name, PIN, OUT, READ, diagnostics.member, help)
#define RATE(name, group, help)								\
	ROW("rate." name, PIN, OUT, READ, diagnostics.rate_hz[POKEYS_SLOW_##group],	\
	    help ", measured, Hz", APART)
#define LATENCY(name, member, help)							\
	DIAGNOSTIC("latency." name "-p99-us", member.p99_us,				\
		   help ": 99 of 100 are shorter, microseconds, since the daemon's start"),	\
	DIAGNOSTIC("latency." name "-max-us", member.max_us, help ": the longest")

static const struct table_row rows[] = {
	DIAGNOSTIC("device.load", load, "the device's processor load, percent"),
	DIAGNOSTIC("device.tick", device_tick_s, "the device's own time, seconds since its start"),
	DIAGNOSTIC("device.locked", locked, "the device's configuration is locked"),
	DIAGNOSTIC("device.access", access, "level of the device's password: 0 all, 255 locked"),

	DIAGNOSTIC("config.state", config_state,
		   "state of the device's settings: 0 not known, 1 differences wait for the "
		   "machine to be off, 2 being written, 3 as requested, 4 some are refused"),
	DIAGNOSTIC("config.refused", config_refused,
		   "the last one refused: 1 pin, 2 encoder, 3 its pins, 4 fast encoders, "
		   "5 ultra-fast, 6 engine, 7 emergency, 8 axis, 9 pwm, 10 analog filter, "
		   "11 failsafe, 12 matrix, 13 name, 14 PoExtBus, 15 backlash, 16 PoStep, "
		   "17 PoStep driver, 18 synced PWM, 19 synced outputs, 20 threading"),
	DIAGNOSTIC("config.refused-index", config_refused_index, "of which pin, encoder or axis"),
	DIAGNOSTIC("config.generation", config_generation,
		   "increments when a device setting is set here"),
	DIAGNOSTIC("config.generation-applied", config_generation_applied,
		   "the one the daemon has in effect"),
	DIAGNOSTIC("config.input-refused", config_input_refused,
		   "device settings that hold a value which is not used (see the log)"),
	DIAGNOSTIC("config.foreign-count", config_foreign,
		   "settings of the device that another program has changed (see the log)"),
	ROW("config.save", PIN, IN, WRITE, diagnostics.config_save,
	    "its rising edge saves the settings to the device's flash: machine off, 2 s apart"),

	RATE("encoders-low", ENCODERS_LOW, "encoders 0..12"),
	RATE("encoders-high", ENCODERS_HIGH, "encoders 13..25"),
	RATE("analog", ANALOG, "analog inputs, all"),
	RATE("counters", COUNTERS, "digital counters"),
	RATE("PoExtBus", POEXTBUS, "PoExtBus"),
	RATE("tick", TICK, "the device's time"),
	RATE("pwm", PWM, "PWM"),
	RATE("load", LOAD, "the device's load"),
	RATE("rtc", CLOCK, "the device's clock"),
	RATE("external", EXTERNAL, "external outputs"),
	RATE("identity", IDENTITY, "identity"),
	RATE("PoNET", PONET, "PoNET modules"),
	RATE("dedicated", DEDICATED, "dedicated inputs of the pulse engine"),
	RATE("matrix", MATRIX, "keys beyond the first 8 x 8"),

	DIAGNOSTIC("packets.sent", sent, "packets sent"),
	DIAGNOSTIC("packets.resent", resent, "of these, repeated"),
	DIAGNOSTIC("packets.received", received, "packets received"),
	DIAGNOSTIC("packets.late", late, "requests answered after their deadline"),
	DIAGNOSTIC("packets.lost", lost, "requests never answered"),
	DIAGNOSTIC("packets.timed-out", timed_out, "requests abandoned"),
	DIAGNOSTIC("packets.stray", stray, "answers that match no request"),
	DIAGNOSTIC("packets.duplicate", duplicate, "answers that arrived twice"),
	DIAGNOSTIC("packets.stale", stale_reply, "answers too old to be accepted"),
	DIAGNOSTIC("packets.corrupt", corrupt, "damaged packets"),
	DIAGNOSTIC("packets.wrong-source", wrong_source, "packets from another sender"),
	DIAGNOSTIC("packets.send-failed", send_failed, "packets that the kernel did not send"),
	DIAGNOSTIC("packets.in-flight", in_flight, "requests currently waiting for an answer"),
	DIAGNOSTIC("deadline-us", deadline_us,
		   "time after which a request is sent again, microseconds"),
	DIAGNOSTIC("cycles-late", cycles_late, "cycles whose fast data did not arrive in time"),
	LATENCY("wakeup", wakeup, "from the start of the cycle until the daemon runs"),
	LATENCY("round-trip", round_trip, "from a request to its answer"),
	LATENCY("data", data, "from the start of the cycle until the fast data are complete"),
	LATENCY("age", age, "age of the fast data when they are read"),
	DIAGNOSTIC("cycles-skipped", cycles_skipped, "ticks that the daemon missed"),
	DIAGNOSTIC("encoder-resyncs", encoder_resyncs,
		   "jumps of encoder counts that were corrected"),
	DIAGNOSTIC("daemon.realtime", realtime, "the daemon runs at realtime priority"),
	DIAGNOSTIC("daemon.fallback", fallback, "the daemon's transport is slower than asked for"),
	DIAGNOSTIC("daemon.guard", guard, "the daemon's packet guard is attached"),
};

TABLE_GROUP(table_diagnostics, rows);
