/* SPDX-License-Identifier: GPL-2.0-or-later */
/* The loop's inside, for its own files and its tests. */
#ifndef RT_INTERNAL_H
#define RT_INTERNAL_H

#include "daemon/rt/loop.h"
#include "daemon/rt/phase.h"

/* The clock as the loop uses it; tests put another one in its place. */
struct loop_clock {
	uint64_t (*now)(void *context);
	uint64_t (*boot)(void *context); /* goes on while the machine is suspended */
	void (*sleep_until)(void *context, uint64_t until_ns);
	void *context;
};

/* See suspend.c. */
struct loop_suspend {
	bool begun;
	int64_t gained_ns; /* CLOCK_BOOTTIME over CLOCK_MONOTONIC, or a little more */
};

/* When a device's commander has read, as it says. */
struct loop_reads {
	uint64_t heartbeat; /* of the image that was looked at */
	uint64_t seen_ns;   /* when that was new; 0 = none was */
	struct phase_stamp stamp;
	bool fresh; /* new in this cycle */
};

/* Whom the cycle follows: see follow.c. */
struct loop_follow {
	struct phase phase;
	uint8_t state;         /* enum pokeys_phase_state */
	uint8_t master;        /* device, 255 none */
	uint64_t cost_ns;      /* tick to published, of the cycle before; 0 = not known */
	uint64_t last_tick_ns; /* ... and its tick */
	uint64_t changed_ns;   /* when state changed */
	uint8_t told;          /* state of the last event */
	uint64_t told_ns;
};

/* What the loop keeps of each device. */
struct loop_member {
	uint64_t address;      /* as in shared.address when it was last looked at */
	uint64_t aim_after_ns; /* a failed aim is not repeated before */
	int aim_error;         /* told in an event */
	bool aimed;
	uint8_t link, fault;                    /* as published last */
	uint32_t wish_session, wish_generation; /* of the wish that the device has */
	struct loop_reads reads;
	struct pokeys_command command;
	struct pokeys_wish wish;
	struct pokeys_report report;
	struct pokeys_diag diag;
};

struct loop_private {
	struct loop_clock clock;
	uint64_t window_ns;        /* part of the period for collecting */
	uint64_t spin_ns, lead_ns; /* spin mode: spin so long after a tick, and before it */
	uint64_t diag_cycles;      /* cycles between two diagnostic images of a device */

	uint64_t tick_ns;  /* of the running cycle, while serving of the next one */
	uint64_t began_ns; /* tick of the running cycle */
	uint64_t cycle;
	uint64_t now_ns; /* as it was read last */
	uint64_t checked_ns;
	uint64_t pending; /* bit = not published yet in this cycle */
	bool stopping;
	uint64_t stop_ns;
	uint64_t minor_before, major_before; /* page faults before the first cycle */
	uint64_t sleeps;                     /* system calls of the loop itself */
	uint64_t skipped, skipped_told, skipped_told_ns;
	struct pokeys_histogram wakeup, publish, work;
	uint64_t fresh_ns; /* when the last commanded device was published whole */
	bool incomplete;   /* ... one of them was not */
	struct loop_follow follow;
	struct loop_suspend suspend;
	struct recorder_cycle points; /* of the running cycle */
	struct loop_member member[TRANSPORT_CHANNELS];
};

static inline uint64_t loop_now(const struct loop *loop)
{
	return loop->own->now_ns = loop->own->clock.now(loop->own->clock.context);
}

static inline uint64_t loop_all(const struct loop *loop)
{
	return UINT64_MAX >> (TRANSPORT_CHANNELS - loop->count);
}

/* pace.c: when the thread runs and when it does not. */

/* The clock of this machine, and what the options mean in ns. Cold. */
void pace_init(struct loop *loop);
/* The first tick lies one period ahead. */
void pace_begin(struct loop *loop);
/* Serve until the next tick; skips the missed ones. Returns the time. */
uint64_t pace_await_tick(struct loop *loop);
/* One wait for a packet, at most until then. */
void pace_wait(struct loop *loop, uint64_t until_ns);

/* exchange.c: packets in and out. */

/* Put into the transport what the control thread has found out. */
void exchange_aim(struct loop *loop, uint64_t now_ns);
/*
 * Deliver what has arrived, but stop at `limit_ns`; publishes what became complete.
 * True if nothing is left.
 */
bool exchange_take(struct loop *loop, uint64_t limit_ns);
/* When a device wants to be checked next, UINT64_MAX = nothing is in flight. */
uint64_t exchange_deadline(const struct loop *loop);
/* Wait, deliver and check once; at most until then. */
void exchange_once(struct loop *loop, uint64_t until_ns);

/* suspend.c */
/* Tell all devices if the machine was suspended since the last look. now_ns: read just now. */
void suspend_look(struct loop *loop, uint64_t now_ns);

/* publish.c: images out. */

/* Publish the image of device `i`, which is no longer pending. */
void publish_state(struct loop *loop, uint32_t i);
/* Publish every device whose bit is set. */
void publish_states(struct loop *loop, uint64_t mask);
/* Publish those that are still pending and complete. */
void publish_complete(struct loop *loop);
/* Take back from the readers what the images of this cycle are written into. */
void publish_prepare(struct loop *loop);
/* Diagnostic image of device `i`. */
void publish_diag(struct loop *loop, uint32_t i);
/* Diagnostic images whose turn it is. */
void publish_diags(struct loop *loop);

/* follow.c: the phase lock. */

/* What the options mean. Cold. */
void follow_init(struct loop *loop);
/* The newest command of device `i`, NULL = there is none. */
void follow_command(struct loop *loop, uint32_t i, const struct pokeys_command *command);
/* Device `i` was published; does the next read find what it asked for? */
void follow_published(struct loop *loop, uint32_t i, uint64_t done_ns);
/* The cycle's work is done: lay the next tick. */
void follow_cycle(struct loop *loop);
/* As the image has it. */
void follow_show(const struct loop *loop, struct pokeys_phase *out);

/* cycle.c: one cycle after its tick came. */
void cycle_run(struct loop *loop);

/* points.c: for the recorder, and for whoever traces. */
void point_woke(struct loop *loop, uint64_t tick_ns, uint64_t woke_ns, uint64_t skipped);
void point_sent(struct loop *loop, uint32_t channel, const uint8_t *packet, size_t length);
/* After it was delivered. */
void point_received(struct loop *loop, const struct transport_packet *p, uint64_t now_ns);
void point_published(struct loop *loop, uint32_t i, uint64_t began_ns, uint64_t ended_ns);
void point_ended(struct loop *loop, uint64_t end_ns);

/* order.c: execute the next order of the control thread, if there is one. */
void orders_run(struct loop *loop);

/* faults.c: note who the thread is and what faults it had until now. Cold. */
void faults_begin(struct loop *loop);

#endif
