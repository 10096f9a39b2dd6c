// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Runs in the kernel at the scheduler's and the interrupts' tracepoints, and passes
 * on what concerns one thread: its own switches, and what happens on its core.
 *
 * The thread is known by its number in the caller's name space of processes; the
 * kernel's tracepoints speak of the number in the first one. So it is learnt when
 * the thread gives up its core for the first time: only then is it the current
 * one, whose number in any name space can be asked for.
 *
 * Nobody is woken up for an event: the reader would be, by an interrupt, on the very core
 * that is watched, and its coming and going would be the next events. It looks by itself.
 *
 * Only the fields that are read are declared here, and the loader finds out where
 * this kernel has them (CO-RE); so it is built without the headers of a kernel.
 */
#include <linux/bpf.h>
#include <bpf/bpf_helpers.h>
#include <bpf/bpf_tracing.h>
#include "tools/trace_event.h"

#define KERNEL __attribute__((preserve_access_index))

struct task_struct {
	int pid;
	char comm[16];
} KERNEL;

struct irqaction {
	const char *name;
} KERNEL;

struct {
	__uint(type, BPF_MAP_TYPE_RINGBUF);
	__uint(max_entries, 4 << 20);
} events SEC(".maps");

/* Set before the program is loaded. */
const volatile __u64 space_device = 0, space_inode = 0;
const volatile __u32 thread_in_space = 0;

int thread = 0;   /* as the kernel numbers it; 0 = not learnt yet */
__u32 core = ~0u; /* that the thread was on last */
__u64 dropped = 0;

static __always_inline struct trace_event *begin(__u32 kind)
{
	struct trace_event *event = bpf_ringbuf_reserve(&events, sizeof(*event), 0);

	if (!event) {
		__sync_fetch_and_add(&dropped, 1);
		return 0;
	}
	event->t_ns = bpf_ktime_get_ns();
	event->kind = kind;
	event->number = 0;
	event->idle = 0;
	event->cpu = bpf_get_smp_processor_id();
	__builtin_memset(event->name, 0, sizeof(event->name));
	return event;
}

static __always_inline int on_core(void)
{
	return thread && bpf_get_smp_processor_id() == core;
}

static __always_inline void learn(const struct task_struct *previous)
{
	struct bpf_pidns_info numbers;

	if (!bpf_get_ns_current_pid_tgid(space_device, space_inode, &numbers, sizeof(numbers)) &&
	    numbers.pid == thread_in_space)
		thread = previous->pid;
}

SEC("tp_btf/sched_switch")
int BPF_PROG(on_switch, _Bool preempt, struct task_struct *previous, struct task_struct *next,
	     unsigned int state)
{
	struct trace_event *event;
	__u32 kind = TRACE_OTHER;

	if (!thread)
		learn(previous);
	if (!thread)
		return 0;
	if (next->pid == thread) {
		kind = TRACE_ON;
		core = bpf_get_smp_processor_id();
	} else if (previous->pid == thread) {
		kind = preempt || !state ? TRACE_PREEMPTED : TRACE_OFF;
		core = bpf_get_smp_processor_id();
	} else if (!on_core()) {
		return 0;
	}
	event = begin(kind);
	if (!event)
		return 0;
	event->idle = !next->pid;
	bpf_probe_read_kernel_str(event->name, sizeof(event->name), next->comm);
	bpf_ringbuf_submit(event, BPF_RB_NO_WAKEUP);
	return 0;
}

SEC("tp_btf/sched_waking")
int BPF_PROG(on_waking, struct task_struct *task)
{
	struct trace_event *event;

	if (!thread || task->pid != thread)
		return 0;
	event = begin(TRACE_WAKING);
	if (!event)
		return 0;
	bpf_get_current_comm(event->name, sizeof(event->name));
	bpf_ringbuf_submit(event, BPF_RB_NO_WAKEUP);
	return 0;
}

static __always_inline int pass_on(__u32 kind, __u32 number, const char *name)
{
	struct trace_event *event;

	if (!on_core())
		return 0;
	event = begin(kind);
	if (!event)
		return 0;
	event->number = number;
	if (name)
		bpf_probe_read_kernel_str(event->name, sizeof(event->name), name);
	bpf_ringbuf_submit(event, BPF_RB_NO_WAKEUP);
	return 0;
}

SEC("tp_btf/irq_handler_entry")
int BPF_PROG(on_irq_entry, int number, struct irqaction *action)
{
	return pass_on(TRACE_IRQ_BEGIN, (__u32)number, action->name);
}

SEC("tp_btf/irq_handler_exit")
int BPF_PROG(on_irq_exit, int number)
{
	return pass_on(TRACE_IRQ_END, (__u32)number, 0);
}

SEC("tp_btf/softirq_entry")
int BPF_PROG(on_softirq_entry, unsigned int number)
{
	return pass_on(TRACE_SOFTIRQ_BEGIN, number, 0);
}

SEC("tp_btf/softirq_exit")
int BPF_PROG(on_softirq_exit, unsigned int number)
{
	return pass_on(TRACE_SOFTIRQ_END, number, 0);
}

/* Interrupts that x86 has beside those with a handler; elsewhere they are not there. */
#define VECTOR(vector, text) \
	static const char text_of_##vector[] = text; \
	SEC("?tp_btf/" #vector "_entry") \
	int BPF_PROG(on_##vector##_entry, int number) \
	{ \
		return pass_on(TRACE_IRQ_BEGIN, (__u32)number, text_of_##vector); \
	} \
	SEC("?tp_btf/" #vector "_exit") \
	int BPF_PROG(on_##vector##_exit, int number) \
	{ \
		return pass_on(TRACE_IRQ_END, (__u32)number, 0); \
	}

VECTOR(local_timer, "timer")
VECTOR(reschedule, "reschedule")
VECTOR(call_function, "call function")
VECTOR(call_function_single, "call function")
VECTOR(irq_work, "irq work")

char licence[] SEC("license") = "GPL";
