/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Connection, ages, permission to move, and packet statistics.
 *
 * An image cannot say whether it is still fresh, because its writer may be dead. The reader
 * computes the first rows.
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
	JUDGED("connected", MODEL_FLAG, connected, "",
	       HELP("the device runs and its data are fresh")),
	JUDGED("stale", MODEL_FLAG, stale, "",
	       HELP("the values are old: no data younger than the daemon's stale-after-ms, or "
		    "daemon-alive is false")),
	JUDGED("daemon-alive", MODEL_FLAG, daemon_alive, "",
	       HELP("the daemon has published within the last 100 ms or 20 of its cycles")),
	JUDGED("age-us", MODEL_FLOAT, age_us, "us",
	       HELP("age of the inputs and positions, microseconds")),
	NUMBER("link-state", link, "", WORDS(pokeys_link_name)),
	NUMBER("fault", fault, "", WORDS(pokeys_fault_name)),
	NUMBER("fault-count", fault_count, ""),
	NUMBER("reconnects", statistics.reconnects, ""),
	NUMBER("cycle", cycle, "", HELP("number of the daemon's cycle that published the values")),
	SINCE("publish", t_publish_ns, "time since the daemon published the state, microseconds"),
	SINCE("cycle", t_cycle_ns, "time since the start of the daemon's last cycle, microseconds"),
	SINCE("digital", t_digital_ns, "age of the digital inputs, microseconds"),
	SINCE("analog", t_analog_ns, "age of the analog inputs from 02 on, microseconds"),
	SINCE("analog-slow", t_analog_slow_ns, "age of the analog inputs 00 and 01, microseconds"),
	SINCE("encoder", t_encoder_ns, "age of the encoders' fast counts, microseconds"),
	SINCE("motion", t_motion_ns, "age of the axes' positions, microseconds"),
	SINCE("slow", t_slow_ns, "age of the data that are read less often, microseconds"),
	SINCE("postep", t_postep_ns, "age of the PoStep drivers' status, microseconds"),
	SINCE("link", t_link_ns, "time since link-state changed, microseconds"),
	SINCE("command", command_t_ns, "age of the commander's last command, microseconds"),

	/* false in HAL when the data are old */
	STATUS("machine-on-permitted", MACHINE_ON, "",
	       HELP("the daemon permits motion, as last published")),
	STATUS("needs-edge", NEEDS_EDGE, "",
	       HELP("machine-is-on is high, but must fall and rise again before anything moves; as "
		    "last published")),
	STATUS("edge-unread", EDGE_UNREAD, "",
	       HELP("machine-is-on is high, but its edge was refused: the positions that the "
		    "commander had read were too old; as last published")),
	STATUS("outputs-held", OUTPUTS_HELD, "",
	       HELP("outputs are held in the safe state after a loss or an emergency stop, until "
		    "machine-is-on rises; as last published")),
	STATUS("safe-state", SAFE, ""),
	STATUS("command-refused", BAD_COMMAND, ""),
	STATUS("commander-alive", COMMANDER, "", HELP("the heartbeat of a commander is fresh")),
	STATUS("daemon.realtime", REALTIME, ""),
	STATUS("daemon.fallback", FALLBACK, ""),
	STATUS("daemon.guard", GUARD, ""),
	STATUS("daemon.stopping", STOPPING, "", HELP("the daemon is shutting down")),
	STATUS("daemon.stale", STALE, "", HELP("the daemon has flagged the fast data as old")),
	NUMBER("daemon.epoch", epoch, "", HELP("differs for each start of the daemon")),
	NUMBER("daemon.period-us", period_ns, US, HELP("period of the daemon's cycle")),
	NUMBER("daemon.stale-after-us", stale_after_ns, US, HELP("data older than this are stale")),
	NUMBER("command.heartbeat", command_heartbeat, "",
	       HELP("heartbeat of the command in effect")),
	NUMBER("command-refused-count", statistics.refused_command, ""),
	NUMBER("one-shot-refused-count", statistics.one_shot_refused, "",
	       HELP("one-shot commands that the daemon refused")),

	NUMBER("rtt-us", statistics.rtt_last_ns, US),
	NUMBER("rtt-avg-us", statistics.rtt_smoothed_ns, US),
	NUMBER("rtt-min-us", statistics.rtt_min_ns, US, HELP("shortest round trip, microseconds")),
	NUMBER("rtt-max-us", statistics.rtt_max_ns, US),
	NUMBER("rtt-jitter-us", statistics.rtt_variation_ns, US),
	NUMBER("deadline-us", statistics.deadline_ns, US),
	NUMBER("cycles-late", statistics.cycles_late, ""),
	PACKETS("sent", sent, ""),
	PACKETS("resent", resent, ""),
	PACKETS("received", received, ""),
	PACKETS("accepted", accepted, "", HELP("answers accepted")),
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
		HELP("rises with lost answers, falls with good ones; 0 is normal")),

	NUMBER("phase.state", phase.state, "", WORDS(pokeys_phase_name),
	       HELP("whether the daemon's cycle follows the commander: 0 off, 1 no commander, "
		    "2 the periods do not match, 3 locking, 4 locked")),
	NUMBER("phase.master", phase.master, "",
	       HELP("the daemon's index of the device whose commander it follows; 255 none")),
	NUMBER("phase.losses", phase.losses, "", HELP("times the lock was lost")),
	NUMBER("phase-error-us", phase.error_ns, US),
	NUMBER("phase.lead-us", phase.lead_ns, US,
	       HELP("from the start of the daemon's cycle to the expected read")),
	NUMBER("phase.jitter-us", phase.jitter_ns, US, HELP("mean deviation of the reads")),
	NUMBER("phase.period-us", phase.period_ns, US,
	       HELP("from the start of the last cycle to that of the next")),
};

MODEL_GROUP(model_link, rows);
