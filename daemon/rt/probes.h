/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Static probes (USDT) of the realtime thread, provider "pokeysd": a nop each until
 * perf, bpftrace or another tracer arms it. docs/tracing.md lists them with their
 * arguments; a test compares the list with the program.
 *
 * Where <sys/sdt.h> was not to be had at build time they are nothing at all.
 */
#ifndef RT_PROBES_H
#define RT_PROBES_H

#ifdef POKEYSD_PROBES
#include <sys/sdt.h>
#define PROBE3(name, a, b, c) DTRACE_PROBE3(pokeysd, name, a, b, c)
#define PROBE4(name, a, b, c, d) DTRACE_PROBE4(pokeysd, name, a, b, c, d)
#define PROBE5(name, a, b, c, d, e) DTRACE_PROBE5(pokeysd, name, a, b, c, d, e)
#else
#define PROBE3(name, a, b, c) ((void)(a), (void)(b), (void)(c))
#define PROBE4(name, a, b, c, d) ((void)(a), (void)(b), (void)(c), (void)(d))
#define PROBE5(name, a, b, c, d, e) ((void)(a), (void)(b), (void)(c), (void)(d), (void)(e))
#endif

#endif
