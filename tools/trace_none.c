// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * In place of trace_kernel.c where clang, bpftool or libbpf were not to be had: the
 * command is there and says what is missing, rather than not being known.
 */
#include "tools/trace.h"

int trace_kernel_begin(int thread, trace_take take, void *context, char *why, size_t size)
{
	(void)thread;
	(void)take;
	(void)context;
	snprintf(why, size,
		 "this pokeysctl was built without the tracer (clang, bpftool and "
		 "libbpf-dev were missing); pokeysctl latency shows how late cycles are, but "
		 "not why");
	return TRACE_UNAVAILABLE;
}

uint64_t trace_kernel_poll(int timeout_ms)
{
	(void)timeout_ms;
	return 0;
}

void trace_kernel_end(void)
{
}
