// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeysctl discover: who answers in the network (protocol section 1.9).
 *
 * A device that hears the question over two networks answers twice, so
 * answers of one serial number from one address are one. The address shown is
 * the one the answer came from: that is the one that can be reached.
 */
#include <errno.h>
#include <net/if.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "daemon/transport/discovery.h"
#include "tools/discover.h"
#include "tools/json.h"
#include "tools/pokeysctl.h"
#include "wire/model.h"

enum { FOUND_MAX = 256 };

struct search {
	size_t count;
	unsigned int strange; /* datagrams that are no answer of a device */
	struct found found[FOUND_MAX];
};

static bool take(void *context, const uint8_t *data, size_t length,
		 const struct transport_address *from)
{
	struct search *search = context;
	struct wire_discovery answer;

	if (wire_discovery_decode(data, length, &answer) != WIRE_OK) {
		search->strange++;
		return false;
	}
	for (size_t i = 0; i < search->count; i++)
		if (search->found[i].from.address == from->address &&
		    search->found[i].answer.serial == answer.serial)
			return false;
	search->found[search->count].answer = answer;
	search->found[search->count++].from = *from;
	return search->count == FOUND_MAX;
}

static int by_serial(const void *a, const void *b)
{
	const struct found *one = a, *other = b;

	if (one->answer.serial != other->answer.serial)
		return one->answer.serial < other->answer.serial ? -1 : 1;
	if (one->from.address != other->from.address)
		return one->from.address < other->from.address ? -1 : 1;
	return 0;
}

void discover_address(uint32_t address, char text[16])
{
	snprintf(text, 16, "%u.%u.%u.%u", address >> 24, address >> 16 & 255, address >> 8 & 255,
		 address & 255);
}

const char *discover_type(const struct wire_discovery *answer)
{
	return answer->old_format ? "PoKeys56E" : wire_model(answer->hardware)->name;
}

void discover_firmware(const struct wire_discovery *answer, char text[16])
{
	struct wire_version version = wire_firmware(answer->firmware, answer->revision);

	snprintf(text, 16, "%u.%u.%u", version.major, version.minor, version.revision);
}

static void print_table(const struct search *search)
{
	if (search->count)
		printf("%-10s  %-20s  %-9s  %-15s  %s\n", "SERIAL", "TYPE", "FIRMWARE", "ADDRESS",
		       "USER ID");
	for (size_t i = 0; i < search->count; i++) {
		const struct found *found = &search->found[i];
		char address[16], firmware[16];

		discover_address(found->from.address, address);
		discover_firmware(&found->answer, firmware);
		printf("%-10u  %-20s  %-9s  %-15s  %u\n", found->answer.serial,
		       discover_type(&found->answer), firmware, address, found->answer.user_id);
	}
}

static void print_json(const struct search *search)
{
	struct json json;

	json_init(&json, stdout);
	json_object(&json, NULL);
	json_unsigned(&json, "format", 1);
	json_array(&json, "devices");
	for (size_t i = 0; i < search->count; i++) {
		const struct found *found = &search->found[i];
		char address[16], firmware[16];

		discover_address(found->from.address, address);
		discover_firmware(&found->answer, firmware);
		json_object(&json, NULL);
		json_unsigned(&json, "serial", found->answer.serial);
		json_text(&json, "type", discover_type(&found->answer));
		json_unsigned(&json, "hardware", found->answer.hardware);
		json_text(&json, "firmware", firmware);
		json_text(&json, "address", address);
		json_bool(&json, "dhcp", found->answer.dhcp);
		json_unsigned(&json, "user_id", found->answer.user_id);
		json_end(&json);
	}
	json_end(&json);
	json_end(&json);
}

static void say_network(const struct discovery_network *network, uint16_t port)
{
	const struct own_address *own = &network->own;
	char name[IF_NAMESIZE] = "", address[16], broadcast[16];

	if_indextoname(own->interface, name);
	discover_address(own->address, address);
	discover_address(own->broadcast, broadcast);
	if (network->error)
		fprintf(stderr, "  not asked at %s (%s/%u): %s\n", name, address, own->prefix,
			network->error == -EOPNOTSUPP ?
				"it cannot send broadcasts; use --address with the "
				"device's address" :
				strerror(-network->error));
	else
		fprintf(stderr,
			"  asked at %s (%s/%u), from UDP port %u to port 20055 of %s%s"
			"255.255.255.255\n",
			name, address, own->prefix, port, own->broadcast ? broadcast : "",
			own->broadcast ? " and " : "");
}

/* Why nobody was found, as far as it can be known here, and what to do. */
static void say_why(const struct discovery_report *report, unsigned int strange,
		    const struct options *options)
{
	complain("no device answered within %u ms", options->timeout_ms);
	for (int i = 0; i < report->networks; i++)
		say_network(&report->network[i], report->port);
	if (strange)
		fprintf(stderr, "  %u datagrams came that are no answer of a PoKeys device\n",
			strange);
	for (int i = 0; i < report->unheard; i++) {
		char address[16];

		discover_address(report->unheard_from[i], address);
		fprintf(stderr,
			"  %s has answered, but this computer dropped the answer: let its "
			"firewall accept UDP from port 20055 (or see rp_filter), or set "
			"address = %s in pokeysd.conf\n",
			address, address);
	}
	if (!report->networks && !options->interface)
		fputs("  no interface but loopback is up and has an IPv4 address: check \"ip "
		      "address\"\n",
		      stderr);
	else if (!report->unheard && report->overheard && !strange)
		fputs("  no answer has reached this computer: check the device's power and cable, "
		      "and whether it is in one of these networks\n",
		      stderr);
	else if (!report->unheard && !report->overheard)
		fputs("  check the device's power and cable, and whether it is in one of these "
		      "networks; or a firewall on this computer drops the answers: run this "
		      "command as root to find out\n",
		      stderr);
}

int command_discover(const struct options *options)
{
	static struct discovery_report report;
	static struct search search;
	struct transport_address also[ADDRESSES_MAX] = { 0 };
	struct discovery_options ask = {
		.timeout_ms = options->timeout_ms,
		.interface = options->interface,
		.also = also,
		.also_count = options->addresses,
		.report = &report,
		.overhear = true,
	};
	int result;

	if (options->draft && options->json) {
		complain("discover: --config and --json cannot be combined");
		return STATUS_USAGE;
	}
	for (size_t i = 0; i < options->addresses; i++)
		also[i].address = options->address[i];
	result = discovery_search(&ask, take, &search);
	if (result < 0) {
		complain("the network cannot be searched%s%s: %s",
			 options->interface ? " at --interface " : "",
			 options->interface ? options->interface : "",
			 result == -ENODEV ? "there is no such interface; ip link lists them" :
					     strerror(-result));
		return STATUS_FAILED;
	}
	qsort(search.found, search.count, sizeof(search.found[0]), by_serial);
	if (options->draft && search.count)
		return discover_draft(search.found, search.count, options, stdout);
	if (options->json)
		print_json(&search);
	else if (!options->draft)
		print_table(&search);
	if (search.count)
		return STATUS_OK;
	say_why(&report, search.strange, options);
	return STATUS_FAILED;
}
