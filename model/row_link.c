/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Connection, ages, what the machine may do, and how packets fare.
 *
 * Whether data are fresh is nothing that an image can say of itself: the first rows are
 * decided by who reads it.
 */
#include "model/rows.h"

#define JUDGED(name_, type_, member_, ...) {						\
	.name = name_, .image = MODEL_JUDGEMENT, .type = type_, .count = 1,		\
	.offset = offsetof(struct model_judgement, member_),				\
	.size = sizeof(((struct model_judgement *)0)->member_), .unit = __VA_ARGS__ }
#define STATUS(name_, bit_, ...)	BIT(name_, flags, POKEYS_STATE_##bit_, __VA_ARGS__)
#define PACKETS(name_, member_, ...)	\
	NUMBER("packets." name_, statistics.member_, __VA_ARGS__)
#define SINCE(name_, member_, help_)	AGE("age." name_ "-us", member_, US, HELP(help_))

static const struct model_row rows[] = {
	JUDGED("connected", MODEL_FLAG, connected, ""),
	JUDGED("stale", MODEL_FLAG, stale, "",
	       HELP("the values are old: no data younger than the daemon's stale-after-ms, or "
		    "daemon-alive is false")),
	JUDGED("daemon-alive", MODEL_FLAG, daemon_alive, "",
	       HELP("the daemon has published within the last 100 ms or 20 of its cycles")),
	JUDGED("age-us", MODEL_FLOAT, age_us, "us"),
	NUMBER("link-state", link, "", WORDS(pokeys_link_name)),
	NUMBER("fault", fault, "", WORDS(pokeys_fault_name)),
	NUMBER("fault-count", fault_count, ""),
	NUMBER("reconnects", statistics.reconnects, ""),
	NUMBER("cycle", cycle, "", HELP("the daemon's cycle that the values are from")),
	SINCE("publish", t_publish_ns, "time since the daemon published the state, microseconds"),
	SINCE("cycle", t_cycle_ns, "time since the tick of that cycle, microseconds"),
	SINCE("digital", t_digital_ns, "age of the digital inputs, microseconds"),
	SINCE("analog", t_analog_ns, "age of the analog inputs but 00 and 01, microseconds"),
	SINCE("analog-slow", t_analog_slow_ns, "age of the analog inputs 00 and 01, microseconds"),
	SINCE("encoder", t_encoder_ns, "age of the encoders' fast counts, microseconds"),
	SINCE("motion", t_motion_ns, "age of the axes' positions, microseconds"),
	SINCE("slow", t_slow_ns, "age of what was asked for beside the fast data, microseconds"),
	SINCE("postep", t_postep_ns, "age of the PoStep drivers' status, microseconds"),
	SINCE("link", t_link_ns, "time since link-state changed, microseconds"),
	SINCE("command", command_t_ns, "age of the commander's last command, microseconds"),

	STATUS("machine-on-permitted", MACHINE_ON, ""),
	STATUS("needs-edge", NEEDS_EDGE, ""),
	STATUS("outputs-held", OUTPUTS_HELD, ""),
	STATUS("safe-state", SAFE, ""),
	STATUS("command-refused", BAD_COMMAND, ""),
	STATUS("commander-alive", COMMANDER, "", HELP("the heartbeat of a commander is fresh")),
	STATUS("daemon.realtime", REALTIME, ""),
	STATUS("daemon.fallback", FALLBACK, ""),
	STATUS("daemon.guard", GUARD, ""),
	STATUS("daemon.stopping", STOPPING, "", HELP("the daemon is about to end")),
	STATUS("daemon.stale", STALE, "", HELP("the daemon itself calls the fast data too old")),
	NUMBER("daemon.epoch", epoch, "", HELP("differs for each start of the daemon")),
	NUMBER("daemon.period-us", period_ns, US, HELP("period of the daemon's cycle")),
	NUMBER("daemon.stale-after-us", stale_after_ns, US, HELP("data older than this are stale")),
	NUMBER("command.heartbeat", command_heartbeat, "", HELP("of the command in effect")),
	NUMBER("command-refused-count", statistics.refused_command, ""),
	NUMBER("one-shot-refused-count", statistics.one_shot_refused, "",
	       HELP("one-shot commands that the daemon refused")),

	NUMBER("rtt-us", statistics.rtt_last_ns, US),
	NUMBER("rtt-avg-us", statistics.rtt_smoothed_ns, US),
	NUMBER("rtt-min-us", statistics.rtt_min_ns, US,
	       HELP("shortest round trip, microseconds")),
	NUMBER("rtt-max-us", statistics.rtt_max_ns, US),
	NUMBER("rtt-jitter-us", statistics.rtt_variation_ns, US),
	NUMBER("deadline-us", statistics.deadline_ns, US),
	NUMBER("cycles-late", statistics.cycles_late, ""),
	PACKETS("sent", sent, ""),
	PACKETS("resent", resent, ""),
	PACKETS("received", received, ""),
	PACKETS("accepted", accepted, "", HELP("answers that were taken")),
	PACKETS("missed", missed, "", HELP("requests without an answer by their deadline")),
	PACKETS("late", late, ""),
	PACKETS("lost", lost, ""),
	PACKETS("timed-out", timed_out, ""),
	PACKETS("stray", stray, ""),
	PACKETS("duplicate", duplicate, ""),
	PACKETS("stale", stale, ""),
	PACKETS("corrupt", corrupt, ""),
	PACKETS("wrong-source", wrong_source, ""),
	PACKETS("send-failed", send_failed, ""),
	PACKETS("in-flight", in_flight, ""),
	PACKETS("error-level", packet_error_level, "",
		HELP("rises with lost answers, falls with good ones; 0 is well")),

	NUMBER("phase.state", phase.state, "", WORDS(pokeys_phase_name),
	       HELP("whether the daemon's cycle follows the commander: 0 off, 1 nobody to follow, "
		    "2 no period fits, 3 on the way, 4 locked")),
	NUMBER("phase.master", phase.master, "",
	       HELP("the daemon's index of the device whose commander it follows; 255 none")),
	NUMBER("phase.losses", phase.losses, "", HELP("times the lock was lost")),
	NUMBER("phase-error-us", phase.error_ns, US),
	NUMBER("phase.lead-us", phase.lead_ns, US,
	       HELP("from the daemon's tick to the read that it is scheduled for")),
	NUMBER("phase.jitter-us", phase.jitter_ns, US, HELP("mean deviation of the reads")),
	NUMBER("phase.period-us", phase.period_ns, US,
	       HELP("from the last tick to the next one")),
};

MODEL_GROUP(model_link, rows);
