/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Values of the diagnostic image: latencies of the daemon, and counters of its transport. This
 * image is published about ten times a second, so it can be 0.1 s older than the state.
 */
#include "model/rows.h"

#define DIAG(name_, member_, help_) {							\
	.name = name_, .image = MODEL_DIAG, .type = MODEL_UNSIGNED, .count = 1,		\
	.offset = offsetof(struct pokeys_diag, member_),				\
	.size = sizeof(((struct pokeys_diag *)0)->member_), .unit = "", .help = help_ }
#define QUANTILE(name_, member_, quantile_, help_) {					\
	.name = name_, .image = MODEL_DIAG, .type = MODEL_QUANTILE, .count = 1,		\
	.offset = offsetof(struct pokeys_diag, member_), .quantile = quantile_,		\
	.unit = US, .help = help_ }
#define LATENCY(name_, member_, help_)							\
	QUANTILE("latency." name_ "-p50-us", member_, 0.5, help_ ": median"),		\
	QUANTILE("latency." name_ "-p99-us", member_, 0.99,				\
		 help_ ": 99th percentile"),						\
	QUANTILE("latency." name_ "-p999-us", member_, 0.999,				\
		 help_ ": 99.9th percentile"),						\
	QUANTILE("latency." name_ "-max-us", member_, 1, help_ ": maximum"),		\
	DIAG("latency." name_ "-count", member_.count, help_ ": number of samples")

static const struct model_row rows[] = {
	LATENCY("wakeup", wakeup, "from the start of the cycle until the daemon runs"),
	LATENCY("round-trip", round_trip, "from a request to its answer"),
	LATENCY("fast-round-trip", fast_round_trip, "round trip of the two fast requests"),
	LATENCY("read-round-trip", read_round_trip, "round trip of requests that only read"),
	LATENCY("write-round-trip", write_round_trip, "round trip of requests that write"),
	LATENCY("one-shot-round-trip", one_shot_round_trip, "round trip of one-shot commands"),
	LATENCY("receive", receive, "from a packet's arrival in the NIC's driver to the daemon"),
	LATENCY("data", fresh, "from the start of the cycle until the fast data are complete"),
	LATENCY("publish", publish, "time that publishing the state takes"),
	LATENCY("cycle-work", cycle_work, "from the start of the cycle to the end of its work"),
	LATENCY("age", age_at_read, "age of the fast data when the commander reads them"),

	{ .name = "age.diagnostics-us",
	  .image = MODEL_DIAG,
	  .type = MODEL_AGE,
	  .count = 1,
	  .offset = offsetof(struct pokeys_diag, t_publish_ns),
	  .size = sizeof(((struct pokeys_diag *)0)->t_publish_ns),
	  .unit = US,
	  .help = "time since these diagnostics were published, microseconds" },
	DIAG("diagnostics.cycle", cycle, "number of the cycle that published them"),
	DIAG("diagnostics.epoch", epoch, "differs for each start of the daemon"),
	DIAG("cycles-skipped", cycles_skipped, NULL),
	DIAG("daemon.minor-faults", minor_faults,
	     "page faults of the realtime thread in its loop, without disk access"),
	DIAG("daemon.major-faults", major_faults,
	     "page faults of the realtime thread in its loop, with disk access"),
	DIAG("daemon.events-dropped", events_dropped, "log events dropped, queue full"),
	DIAG("daemon.events-high-water", event_high_water, "most log events waiting at once"),
	{ .name = "transport.kind",
	  .image = MODEL_DIAG,
	  .type = MODEL_TEXT,
	  .count = 1,
	  .offset = offsetof(struct pokeys_diag, transport),
	  .size = sizeof(((struct pokeys_diag *)0)->transport),
	  .unit = "",
	  .help = "how packets travel: io_uring, socket, xdp" },
	DIAG("transport.system-calls", transport_system_calls, "system calls of the transport"),
	DIAG("transport.waits-avoided", transport_waits_avoided,
	     "waits avoided because the answer had already arrived"),
	DIAG("transport.rearmed", transport_rearmed, "times reception was re-armed"),
	DIAG("transport.no-buffers", transport_no_buffers, "times all reception buffers were full"),
	DIAG("transport.overflow", transport_overflow, "times the completion queue was full"),
	DIAG("transport.truncated", transport_truncated, "packets that were too long"),
	DIAG("guard.passed", guard_passed, "packets from any sender that the guard passed"),
	DIAG("guard.dropped", guard_dropped, "packets from any sender that the guard dropped"),
};

MODEL_GROUP(model_latency, rows);
