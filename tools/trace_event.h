/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What the tracer's program in the kernel and pokeysctl have in common. */
#ifndef TOOLS_TRACE_EVENT_H
#define TOOLS_TRACE_EVENT_H

#include <linux/types.h>

/* Of the realtime thread, or of the core that it is on. */
enum trace_event_kind {
	TRACE_WAKING = 1, /* the thread is made runnable; name: by whom */
	TRACE_ON,         /* the thread runs */
	TRACE_OFF,        /* it does not any more; name: who runs instead */
	TRACE_PREEMPTED,  /* the same, but it would go on */
	TRACE_OTHER,      /* somebody else takes its core; name: who */
	TRACE_IRQ_BEGIN,  /* name: of the interrupt, or of its kind */
	TRACE_IRQ_END,
	TRACE_SOFTIRQ_BEGIN, /* number: which */
	TRACE_SOFTIRQ_END,
};

struct trace_event {
	__u64 t_ns; /* CLOCK_MONOTONIC */
	__u32 kind;
	__u32 number;
	__u32 idle; /* who takes the core is nobody */
	__u32 cpu;
	char name[16];
};

#endif
