// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * In place of xdp_world.c where the build has no AF_XDP or no clang: no test is
 * called with "xdp" then.
 */
#include "tests/transport/xdp_world.h"

const char *xdp_world_make(void)
{
	return "this build has no AF_XDP transport, or no clang for XDP programs";
}

struct transport_options xdp_world_options(void)
{
	return (struct transport_options){ 0 };
}

int xdp_world_far_socket(void)
{
	return -1;
}
