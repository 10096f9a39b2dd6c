// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What the choice of a way to wait is made from, looked up on this machine.
 *
 * Everything that cannot be found out counts as not there: the way that is
 * chosen then always works.
 */
#include <net/if.h>
#include <stdio.h>
#include <string.h>
#include "daemon/control/waiting.h"
#include "daemon/transport/napi.h"

#define ISOLATED "/sys/devices/system/cpu/isolated"

static void look_at_core(struct waiting_facts *out)
{
	FILE *from = fopen(ISOLATED, "re");
	char list[512] = "";

	if (!from)
		return;
	if (fgets(list, sizeof(list), from))
		out->isolated = waiting_in_list(list, out->cpu, &out->servo);
	fclose(from);
}

void waiting_look(const struct config *config, struct waiting_facts *out)
{
	memset(out, 0, sizeof(*out));
	out->wanted = config->wait;
	out->transport = config->transport;
	out->interface = config->interface;
	out->busy_poll_us = config->busy_poll_us;
	out->cpu = config->cpu;
	out->ring = transport_probe_ring(&out->ring_napi);
	if (*config->interface)
		out->card_napi = napi_count(if_nametoindex(config->interface));
	look_at_core(out);
}
