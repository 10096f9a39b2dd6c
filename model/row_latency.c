/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Of the diagnostic image: how late the daemon was, and what its transport met. It is
 * published about ten times a second, so it may be a little older than the rest.
 */
#include "model/rows.h"

#define DIAG(name_, member_, help_) {							\
	.name = name_, .image = MODEL_DIAG, .type = MODEL_UNSIGNED, .count = 1,		\
	.offset = offsetof(struct pokeys_diag, member_),				\
	.size = sizeof(((struct pokeys_diag *)0)->member_), .unit = "", .help = help_ }
#define DIAG_US(name_, member_, help_) {						\
	.name = name_, .image = MODEL_DIAG, .type = MODEL_UNSIGNED, .count = 1,		\
	.offset = offsetof(struct pokeys_diag, member_),				\
	.size = sizeof(((struct pokeys_diag *)0)->member_), .unit = US, .help = help_ }
#define QUANTILE(name_, member_, quantile_, help_) {					\
	.name = name_, .image = MODEL_DIAG, .type = MODEL_QUANTILE, .count = 1,		\
	.offset = offsetof(struct pokeys_diag, member_), .quantile = quantile_,		\
	.unit = US, .help = help_ }
#define LATENCY(name_, member_, help_)							\
	QUANTILE("latency." name_ "-p50-us", member_, 0.5,				\
		 help_ ": half of them are shorter, microseconds"),			\
	QUANTILE("latency." name_ "-p99-us", member_, 0.99,				\
		 help_ ": 99 of 100 are shorter, microseconds"),			\
	QUANTILE("latency." name_ "-p999-us", member_, 0.999,				\
		 help_ ": 999 of 1000 are shorter, microseconds"),			\
	DIAG_US("latency." name_ "-max-us", member_.max_ns, help_ ": the longest"),	\
	DIAG("latency." name_ "-count", member_.count, help_ ": how many were measured")

static const struct model_row rows[] = {
	LATENCY("wakeup", wakeup, "from the start of the cycle until the daemon runs"),
	LATENCY("round-trip", round_trip, "from a request to its answer"),
	LATENCY("fast-round-trip", fast_round_trip, "the same for the two fast requests"),
	LATENCY("read-round-trip", read_round_trip, "the same for requests that only read"),
	LATENCY("write-round-trip", write_round_trip, "the same for those that write"),
	LATENCY("one-shot-round-trip", one_shot_round_trip, "the same for one-shots"),
	LATENCY("receive", receive, "from the packet's arrival at the NIC's driver to the daemon"),
	LATENCY("data", fresh, "from the start of the cycle until the fast data are complete"),
	LATENCY("publish", publish, "time that publishing the state takes"),
	LATENCY("cycle-work", cycle_work, "from the start of the cycle to the end of its work"),
	LATENCY("age", age_at_read, "age of the fast data when the commander reads them"),

	DIAG("cycles-skipped", cycles_skipped, NULL),
	DIAG("daemon.minor-faults", minor_faults,
	     "page faults of the realtime thread since it began its loop"),
	DIAG("daemon.major-faults", major_faults, "of these, with a read from a disk"),
	DIAG("daemon.events-dropped", events_dropped, "log events for which there was no room"),
	DIAG("daemon.events-high-water", event_high_water, "most log events that ever waited"),
	{ .name = "transport.kind", .image = MODEL_DIAG, .type = MODEL_TEXT, .count = 1,
	  .offset = offsetof(struct pokeys_diag, transport),
	  .size = sizeof(((struct pokeys_diag *)0)->transport), .unit = "",
	  .help = "how packets travel: io_uring, socket, xdp" },
	DIAG("transport.system-calls", transport_system_calls, "system calls of the transport"),
	DIAG("transport.waits-avoided", transport_waits_avoided,
	     "times an answer was there already when it was to be waited for"),
	DIAG("transport.rearmed", transport_rearmed, "times the reception was set up again"),
	DIAG("transport.no-buffers", transport_no_buffers, "times all reception buffers were full"),
	DIAG("transport.overflow", transport_overflow, "times the ring of results was full"),
	DIAG("transport.truncated", transport_truncated, "packets that were too long"),
	DIAG("guard.passed", guard_passed, "packets that the guard let in, of everybody"),
	DIAG("guard.dropped", guard_dropped, "packets that the guard dropped, of everybody"),
};

MODEL_GROUP(model_latency, rows);
