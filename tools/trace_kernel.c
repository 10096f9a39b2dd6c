// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The program into the kernel, and what is refused there into one line.
 *
 * Whether a kernel has a tracepoint is looked up in its type information before
 * the program for it is loaded: those of x86's own interrupts are not there on
 * other machines, and one missing program would fail all of them.
 */
#include <bpf/bpf.h>
#include <bpf/btf.h>
#include <bpf/libbpf.h>
#include <errno.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>
#include "tools/trace.h"
#include "trace.skel.h"

static struct trace_bpf *program;
static struct ring_buffer *ring;
static trace_take taker;
static void *taker_context;

static int refused(const char *what, int error, char *why, size_t size)
{
	if (error == EPERM || error == EACCES) {
		snprintf(why, size, "%s: %s; run it as root (it needs CAP_BPF and CAP_PERFMON)",
			 what, strerror(error));
		return TRACE_NO_RIGHT;
	}
	snprintf(why, size,
		 "%s: %s; this kernel cannot be traced (BPF with CONFIG_DEBUG_INFO_BTF, "
		 "5.18 or newer, is needed); pokeysctl latency shows how late cycles are, but "
		 "not why",
		 what, strerror(error));
	return TRACE_UNAVAILABLE;
}

static int pass(void *context, void *data, size_t length)
{
	(void)context;
	if (length >= sizeof(struct trace_event))
		taker(taker_context, data);
	return 0;
}

/* "tp_btf/NAME": leave it out if this kernel has no such tracepoint. */
static void choose(void)
{
	struct bpf_program *each;

	bpf_object__for_each_program(each, program->obj)
	{
		const char *name = strchr(bpf_program__section_name(each), '/');

		if (name)
			bpf_program__set_autoload(each,
						  libbpf_find_vmlinux_btf_id(name + 1,
									     BPF_TRACE_RAW_TP) > 0);
	}
}

static int prepare(int thread)
{
	struct stat space;

	program = trace_bpf__open();
	if (!program || stat("/proc/self/ns/pid", &space))
		return -errno;
	program->rodata->space_device = space.st_dev;
	program->rodata->space_inode = space.st_ino;
	program->rodata->thread_in_space = (__u32)thread;
	choose();
	return trace_bpf__load(program);
}

static bool has_types(void)
{
	struct btf *types = btf__load_vmlinux_btf();
	bool there = types != NULL;

	btf__free(types);
	return there;
}

int trace_kernel_begin(int thread, trace_take take, void *context, char *why, size_t size)
{
	int rc;

	taker = take;
	taker_context = context;
	if (!getenv("POKEYS_TRACE_DEBUG"))
		libbpf_set_print(NULL);
	if (!has_types())
		return refused("the kernel's types cannot be read", ENOTSUP, why, size);
	rc = prepare(thread);
	if (!rc)
		rc = trace_bpf__attach(program);
	if (!rc) {
		ring = ring_buffer__new(bpf_map__fd(program->maps.events), pass, NULL, NULL);
		rc = ring ? 0 : -errno;
	}
	if (!rc)
		return 0;
	trace_kernel_end();
	return refused("the tracer cannot be loaded", -rc, why, size);
}

uint64_t trace_kernel_poll(int timeout_ms)
{
	poll(NULL, 0, timeout_ms); /* or ^C */
	ring_buffer__consume(ring);
	return program->bss->dropped;
}

void trace_kernel_end(void)
{
	ring_buffer__free(ring);
	trace_bpf__destroy(program);
	ring = NULL;
	program = NULL;
}
