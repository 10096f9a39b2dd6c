// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Who may pass, from pokeysd.conf.
 *
 * A device known by its serial number only is looked for before the guard is
 * on: a daemon that has found it long ago does not search again, so with an
 * unknown address its running device would be cut off, found again a moment
 * later, and the machine would have stopped for nothing. What an earlier
 * guard has learnt is kept for the same reason.
 *
 * A device that is switched off now is learnt by the program in the kernel,
 * from its answer when the daemon searches.
 */
#include <arpa/inet.h>
#include <bpf/bpf.h>
#include <errno.h>
#include <string.h>
#include "daemon/transport/discovery.h"
#include "guard/kernel.h"
#include "wire/model.h"

enum { SEARCH_MS = 200, SEARCHES = 3 };

_Static_assert((int)GUARD_DEVICES == (int)TRANSPORT_CHANNELS, "a daemon's devices");
_Static_assert((int)GUARD_ANSWER == WIRE_DISCOVERY_LEN &&
		       (int)GUARD_ANSWER_OLD == WIRE_DISCOVERY_OLD_LEN,
	       "lengths of an answer");

static int unknown(const struct guard_table *table)
{
	int count = 0;

	for (int i = 0; i < GUARD_DEVICES; i++)
		count += table->device[i].port && !table->device[i].address;
	return count;
}

/* An answer: the device is where the answer came from. True = nobody is missing any more. */
static bool found(void *context, const uint8_t *data, size_t length,
		  const struct transport_address *from)
{
	struct guard_table *table = context;
	struct wire_discovery answer;

	if (wire_discovery_decode(data, length, &answer) != WIRE_OK || !answer.serial)
		return false;
	for (int i = 0; i < GUARD_DEVICES; i++)
		if (table->device[i].serial == answer.serial && !table->device[i].address)
			table->device[i].address = htonl(from->address);
	return !unknown(table);
}

static void search(const struct config *config, struct guard_table *table)
{
	struct transport_address also[CONFIG_ADDRESSES] = { 0 };
	const struct discovery_options options = {
		.timeout_ms = SEARCH_MS,
		.interface = *config->interface ? config->interface : NULL,
		.also = also,
		.also_count = config->discovery_addresses,
	};

	for (uint32_t i = 0; i < config->discovery_addresses; i++)
		also[i].address = config->discovery_address[i];
	for (int i = 0; i < SEARCHES && unknown(table); i++)
		if (discovery_search(&options, found, table) < 0)
			return; /* no network yet: the daemon will search */
}

static void take_device(const struct device_config *device, const struct guard_table *before,
			struct guard_device *out)
{
	out->port = htons(device->port);
	out->serial = device->serial;
	out->address = htonl(device->address);
	for (int i = 0; device->serial && i < GUARD_DEVICES; i++)
		if (before->device[i].serial == device->serial && before->device[i].address)
			out->address = before->device[i].address;
}

int guard_set_devices(const struct config *config)
{
	struct guard_table before = { 0 }, table = { 0 };
	__u32 zero = 0;

	if (bpf_map_lookup_elem(guard_devices_fd(), &zero, &before))
		return -errno;
	for (uint32_t i = 0; i < config->devices; i++)
		take_device(&config->device[i], &before, &table.device[i]);
	search(config, &table);
	if (bpf_map_update_elem(guard_devices_fd(), &zero, &table, BPF_ANY))
		return -errno;
	return unknown(&table);
}
