/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The cycle follows one commander's thread.
 *
 * There is one cycle for all devices, so there is one master: the first device (in
 * the order of pokeysd.conf) whose commander tells when it reads and has a period
 * that fits. It stays the master until it has been silent for SILENT_NS; several
 * devices of one LinuxCNC are read one after another in one thread, so whichever is
 * the master, the others are read within microseconds of it. A commander of another
 * thread finds its data as old as they happen to be, as without a lock.
 *
 * What a cycle costs is the time until the last device that somebody commands was
 * published with all that it was asked for. A cycle in which an answer is missing
 * says nothing about that: the lead is not to grow because a cable is out.
 *
 * The stamps come from another process and are believed as far as they make sense:
 * not from the future, not older than the silence, growing, with a period that can
 * be one.
 */
#include "daemon/rt/internal.h"

#define SILENT_NS	UINT64_C(100000000)
#define SEEKING_NS	UINT64_C(2000000000)	/* then it is said that it takes long */
#define TELL_NS		UINT64_C(10000000000)

enum { NO_MASTER = 255 };

void follow_init(struct loop *loop)
{
	struct loop_follow *follow = &loop->own->follow;

	phase_init(&follow->phase, loop->options.period_ns);
	follow->master = NO_MASTER;
	follow->state = loop->options.phase_lock == LOOP_PHASE_NO ? POKEYS_PHASE_OFF :
								    POKEYS_PHASE_FREE;
	follow->told = follow->state;
}

static bool credible(const struct loop_reads *before, const struct pokeys_command *command,
		     uint64_t now_ns)
{
	return command->t_thread_ns > before->stamp.read_ns && command->t_thread_ns <= now_ns &&
	       now_ns - command->t_thread_ns <= SILENT_NS && command->period_ns <= SILENT_NS &&
	       command->t_ns >= command->t_thread_ns && command->t_ns <= now_ns;
}

void follow_command(struct loop *loop, uint32_t i, const struct pokeys_command *command)
{
	struct loop_reads *reads = &loop->own->member[i].reads;
	uint64_t now = loop->own->now_ns;

	reads->fresh = false;
	if (!command || command->heartbeat == reads->heartbeat)
		return;
	reads->heartbeat = command->heartbeat;
	if (!credible(reads, command, now))
		return;
	reads->fresh = true;
	reads->seen_ns = now;
	reads->stamp = (struct phase_stamp){
		.read_ns = command->t_thread_ns,
		.write_ns = command->t_ns,
		.period_ns = command->period_ns,
	};
}

static bool lives(const struct loop *loop, uint32_t i)
{
	const struct loop_reads *reads = &loop->own->member[i].reads;

	return reads->seen_ns && loop->own->now_ns - reads->seen_ns <= SILENT_NS;
}

static bool can_be_master(const struct loop *loop, uint32_t i)
{
	return lives(loop, i) &&
	       phase_fits(&loop->own->follow.phase, loop->own->member[i].reads.stamp.period_ns);
}

/* The one of before if it still can be; *any tells whether anybody lives. */
static uint8_t choose(const struct loop *loop, bool *any)
{
	uint8_t master = loop->own->follow.master;

	*any = false;
	if (master != NO_MASTER && can_be_master(loop, master))
		return master;
	for (uint32_t i = 0; i < loop->count; i++) {
		*any |= lives(loop, i);
		if (can_be_master(loop, i))
			return (uint8_t)i;
	}
	return NO_MASTER;
}

void follow_published(struct loop *loop, uint32_t i, uint64_t done_ns)
{
	struct loop_private *own = loop->own;

	if (own->member[i].link != POKEYS_LINK_RUNNING || !lives(loop, i))
		return;
	if (device_fast_complete(loop->devices[i].device))
		own->fresh_ns = done_ns;
	else
		own->incomplete = true;
}

static void take_cost(struct loop_private *own)
{
	own->follow.cost_ns = own->fresh_ns && !own->incomplete ? own->fresh_ns - own->began_ns : 0;
	own->follow.last_tick_ns = own->began_ns;
	own->fresh_ns = 0;
	own->incomplete = false;
}

static void take_read(struct loop *loop)
{
	struct loop_follow *follow = &loop->own->follow;
	uint8_t master;
	bool any;

	master = choose(loop, &any);
	if (master != follow->master)
		phase_free(&follow->phase);
	follow->master = master;
	if (master != NO_MASTER && loop->own->member[master].reads.fresh)
		phase_read(&follow->phase, &loop->own->member[master].reads.stamp,
			   follow->last_tick_ns, follow->cost_ns);
	if (master == NO_MASTER)
		follow->state = any ? POKEYS_PHASE_UNFIT : POKEYS_PHASE_FREE;
	else
		follow->state = follow->phase.locked ? POKEYS_PHASE_LOCKED : POKEYS_PHASE_SEEKING;
}

/* Of the master, or of whoever is none because of it. */
static uint64_t period_of_commander(const struct loop *loop)
{
	const struct loop_private *own = loop->own;

	if (own->follow.master != NO_MASTER)
		return own->member[own->follow.master].reads.stamp.period_ns;
	for (uint32_t i = 0; i < loop->count; i++)
		if (lives(loop, i))
			return own->member[i].reads.stamp.period_ns;
	return 0;
}

/* Once in ten seconds at most; a short search is none worth a line. */
static void tell(struct loop *loop, uint8_t before)
{
	struct loop_follow *follow = &loop->own->follow;
	uint64_t now = loop->own->now_ns;
	struct event e = {
		.t_ns = now,
		.code = EVENT_PHASE,
		.device = 255,
		.a = follow->state,
		.b = (int64_t)period_of_commander(loop),
		.c = (int64_t)follow->phase.jitter_ns,
	};

	if (follow->state != before)
		follow->changed_ns = now;
	if (follow->state == follow->told || (follow->told_ns && now - follow->told_ns < TELL_NS) ||
	    (follow->state == POKEYS_PHASE_SEEKING && now - follow->changed_ns < SEEKING_NS))
		return;
	e.level = loop->options.phase_lock == LOOP_PHASE_YES &&
				  (follow->state == POKEYS_PHASE_UNFIT ||
				   follow->state == POKEYS_PHASE_SEEKING) ?
			  EVENT_WARNING :
			  EVENT_INFO;
	event_push(&loop->events, &e);
	follow->told = follow->state;
	follow->told_ns = now;
}

void follow_cycle(struct loop *loop)
{
	struct loop_private *own = loop->own;
	struct loop_follow *follow = &own->follow;
	uint8_t before = follow->state;

	if (before == POKEYS_PHASE_OFF)
		return;
	take_read(loop);
	take_cost(own);
	own->tick_ns = own->began_ns + phase_next(&follow->phase, own->began_ns);
	tell(loop, before);
}

void follow_show(const struct loop *loop, struct pokeys_phase *out)
{
	const struct loop_follow *follow = &loop->own->follow;
	const struct phase *phase = &follow->phase;
	const bool following = follow->master != NO_MASTER;

	*out = (struct pokeys_phase){
		.state = follow->state,
		.master = follow->master,
		.losses = phase->losses,
		.error_ns = phase->error_ns,
		.jitter_ns = (uint32_t)phase->jitter_ns,
		.lead_ns = following ? (uint32_t)phase_lead(phase) : 0,
		.period_ns = (uint32_t)phase->period_ns,
	};
}
