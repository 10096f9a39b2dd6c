// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Every nanosecond between the tick and the data belongs to somebody.
 *
 * The line of marks is walked once. What is known between two marks (does the
 * thread run, does it sleep, who has its core, does an interrupt hold it up, is a
 * reply awaited, has the kernel got one) decides whose the time between them was.
 * An interrupt on the core counts before anything that it holds up, but not while
 * the thread sleeps and waits for a device: then it is nobody's loss.
 *
 * The sum is the whole by construction, so nothing can be forgotten, only be
 * called by a wrong name; and where the kernel's witness is missing that is said
 * (`whole`) instead of guessed: also where the kernel has the thread asleep at a moment
 * at which it noted the time.
 */
#include <string.h>
#include "tools/trace.h"

enum { HELD_MAX = 8 };

struct walk {
	struct trace_cycle *cycle;
	bool known; /* a switch of the thread was seen */
	bool runs, runnable;
	bool other;           /* somebody has the core, and it is not the idle task */
	bool got;             /* the kernel has a reply since the thread went to sleep */
	bool slept;           /* in this cycle, after asking */
	bool gap;             /* the recorder says that it ran, the kernel does not */
	unsigned int awaited; /* requests of this cycle without a reply in the kernel */
	uint64_t asked[TRACE_REQUESTS / 64]; /* a bit for each of them */
	unsigned int irqs, softirqs;         /* that hold the core, one in the other */
	char who[16];                        /* has the core */
	char irq[16], softirq[16];
};

/* The softirqs of the kernel by number, include/linux/interrupt.h. */
static void name_softirq(char name[16], uint32_t number)
{
	static const char *const names[] = {
		"HI",       "TIMER",   "NET_TX", "NET_RX",  "BLOCK",
		"IRQ_POLL", "TASKLET", "SCHED",  "HRTIMER", "RCU",
	};
	const char *text = number < sizeof(names) / sizeof(*names) ? names[number] : "unknown";

	memset(name, 0, 16);
	memcpy(name, text, strlen(text));
}

static void add_part(struct trace_cycle *cycle, enum trace_where where, const char *who,
		     uint64_t ns)
{
	size_t i = 0;

	while (i < cycle->parts &&
	       (cycle->part[i].where != where || strncmp(cycle->part[i].who, who, 16)))
		i++;
	if (i == TRACE_PARTS) { /* no room: together with the last of its kind */
		while (i && cycle->part[i - 1].where != where)
			i--;
		if (!i--)
			return;
		memcpy(cycle->part[i].who, "others\0\0\0\0\0\0\0\0\0", 16);
	}
	if (i == cycle->parts) {
		cycle->parts++;
		cycle->part[i] = (struct trace_part){ .where = where };
		memcpy(cycle->part[i].who, who, sizeof(cycle->part[i].who));
	}
	cycle->part[i].ns += ns;
}

static enum trace_where while_running(const struct walk *w, uint64_t t_ns)
{
	const struct trace_cycle *cycle = w->cycle;

	if (t_ns < cycle->woke_ns)
		return TRACE_RUN; /* still at the cycle before */
	if (t_ns < cycle->asked_ns)
		return TRACE_PLAN;
	if (cycle->spins)
		return w->awaited > 0 ? TRACE_DEVICE : TRACE_RUN;
	return w->slept || w->got ? TRACE_RUN : TRACE_SEND;
}

static enum trace_where while_asleep(const struct walk *w, uint64_t t_ns)
{
	if (t_ns < w->cycle->asked_ns)
		return TRACE_TIMER;
	return w->got ? TRACE_RECEIVE : TRACE_DEVICE;
}

/* Whose the time from `t_ns` on is, until the next mark. */
static enum trace_where whose(const struct walk *w, uint64_t t_ns)
{
	enum trace_where where = TRACE_WAKE_UP;

	if (w->runs)
		where = while_running(w, t_ns);
	else if (!w->runnable)
		where = while_asleep(w, t_ns);
	else if (w->other)
		where = TRACE_BEHIND;
	if (where == TRACE_DEVICE)
		return where;
	return w->irqs ? TRACE_INTERRUPT : w->softirqs ? TRACE_SOFTIRQ : where;
}

/* The thread itself has taken these times. */
static bool ran_at(const struct trace_cycle *cycle, uint64_t t_ns)
{
	return t_ns == cycle->woke_ns || t_ns == cycle->asked_ns;
}

static void count(struct walk *w, uint64_t from_ns, uint64_t to_ns)
{
	const enum trace_where where = whose(w, from_ns);

	w->gap |= !w->runs && (ran_at(w->cycle, from_ns) || to_ns == w->cycle->published_ns);

	w->cycle->ns[where] += to_ns - from_ns;
	if (where == TRACE_INTERRUPT)
		add_part(w->cycle, where, w->irq, to_ns - from_ns);
	else if (where == TRACE_SOFTIRQ)
		add_part(w->cycle, where, w->softirq, to_ns - from_ns);
	else if (where == TRACE_BEHIND)
		add_part(w->cycle, where, w->who, to_ns - from_ns);
}

/* The part of from..to that lies in the cycle; what is decided by a time splits it. */
static void count_within(struct walk *w, uint64_t from_ns, uint64_t to_ns)
{
	const struct trace_cycle *cycle = w->cycle;
	const uint64_t splits[] = { cycle->tick_ns, cycle->woke_ns, cycle->asked_ns,
				    cycle->published_ns };

	if (from_ns < cycle->tick_ns)
		from_ns = cycle->tick_ns;
	if (to_ns > cycle->published_ns)
		to_ns = cycle->published_ns;
	for (size_t i = 0; i < sizeof(splits) / sizeof(*splits) && from_ns < to_ns; i++) {
		if (splits[i] <= from_ns || splits[i] >= to_ns)
			continue;
		count(w, from_ns, splits[i]);
		from_ns = splits[i];
	}
	if (from_ns < to_ns)
		count(w, from_ns, to_ns);
}

/*
 * Whoever comes onto the core does not inherit an interrupt: the kernel does not switch
 * within one, and on PREEMPT_RT, where a softirq is done by a thread that can be pushed
 * aside, it goes on when that thread does.
 */
static void change(struct walk *w)
{
	w->irqs = 0;
	w->softirqs = 0;
}

static void switch_thread(struct walk *w, const struct trace_event *event, uint64_t t_ns)
{
	change(w);
	w->known = true;
	w->runs = event->kind == TRACE_ON;
	w->runnable = event->kind == TRACE_PREEMPTED;
	w->other = !w->runs && !event->idle;
	memcpy(w->who, event->name, sizeof(w->who));
	if (event->kind != TRACE_OFF)
		return;
	w->got = false;
	w->slept |= t_ns >= w->cycle->asked_ns;
}

static void step_kernel(struct walk *w, const struct trace_event *event, uint64_t t_ns)
{
	switch ((enum trace_event_kind)event->kind) {
	case TRACE_WAKING:
		w->runnable = !w->runs;
		break;
	case TRACE_ON:
	case TRACE_OFF:
	case TRACE_PREEMPTED:
		switch_thread(w, event, t_ns);
		break;
	case TRACE_OTHER:
		change(w);
		w->other = !event->idle;
		memcpy(w->who, event->name, sizeof(w->who));
		break;
	case TRACE_IRQ_BEGIN:
		w->irqs += w->irqs < HELD_MAX;
		memcpy(w->irq, event->name, sizeof(w->irq));
		break;
	case TRACE_IRQ_END:
		w->irqs -= w->irqs > 0;
		break;
	case TRACE_SOFTIRQ_BEGIN:
		w->softirqs += w->softirqs < HELD_MAX;
		name_softirq(w->softirq, event->number);
		break;
	case TRACE_SOFTIRQ_END:
		w->softirqs -= w->softirqs > 0;
		break;
	}
}

/* A request that is sent again is awaited once. */
static void expect(struct walk *w, uint32_t request, bool sent)
{
	uint64_t *word = &w->asked[request % TRACE_REQUESTS / 64];
	const uint64_t bit = UINT64_C(1) << request % 64;

	if (sent && !(*word & bit))
		w->awaited++;
	else if (!sent && *word & bit)
		w->awaited--;
	*word = sent ? *word | bit : *word & ~bit;
}

static void step(struct walk *w, const struct trace_mark *mark)
{
	switch (mark->kind) {
	case MARK_KERNEL:
		step_kernel(w, &mark->event, mark->t_ns);
		break;
	case MARK_SENT:
		if (mark->t_ns >= w->cycle->tick_ns)
			expect(w, mark->request, true);
		w->got = false;
		break;
	case MARK_GOT:
		expect(w, mark->request, false);
		w->got = true;
		break;
	}
}

void trace_attribute(struct trace_cycle *cycle, const struct trace_mark *mark, size_t marks)
{
	struct walk w = { .cycle = cycle, .runs = cycle->spins };
	uint64_t last_ns = cycle->tick_ns;
	bool known = cycle->spins;

	memset(cycle->ns, 0, sizeof(cycle->ns));
	cycle->parts = 0;
	for (size_t i = 0; i < marks && mark[i].t_ns < cycle->published_ns; i++) {
		if (mark[i].t_ns > last_ns) {
			count_within(&w, last_ns, mark[i].t_ns);
			last_ns = mark[i].t_ns;
		}
		step(&w, &mark[i]);
		known |= w.known && mark[i].t_ns <= cycle->tick_ns;
	}
	count_within(&w, last_ns, cycle->published_ns);
	cycle->whole = known && !w.gap;
}

const char *trace_where_name(enum trace_where where)
{
	static const char *const names[TRACE_WHERES] = {
		[TRACE_TIMER] = "timer",     [TRACE_INTERRUPT] = "interrupt",
		[TRACE_SOFTIRQ] = "softirq", [TRACE_WAKE_UP] = "wake-up",
		[TRACE_BEHIND] = "behind",   [TRACE_PLAN] = "plan",
		[TRACE_SEND] = "send",       [TRACE_DEVICE] = "device",
		[TRACE_RECEIVE] = "receive", [TRACE_RUN] = "run",
	};

	return (unsigned int)where < TRACE_WHERES ? names[where] : "unknown";
}
