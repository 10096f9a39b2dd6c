// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * In place of client_xdp.c where there is no clang, bpftool or libbpf: the ways
 * are there and say what is missing.
 */
#include "bench/client.h"

static const char *missing(struct client *c)
{
	(void)c;
	return "built without libbpf, clang or bpftool";
}

const char *client_make_polled(const struct client *c)
{
	(void)c;
	return "built without libbpf, clang or bpftool";
}

static void nothing(struct client *c)
{
	(void)c;
}

const struct client_way client_xdp_ways[] = {
	{ "xdp", true, missing, nothing },
	{ 0 },
};
