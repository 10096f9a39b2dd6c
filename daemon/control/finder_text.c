// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * A device is missing, and whoever reads the log has to know where to look: at the device, at
 * the serial number in pokeysd.conf, at an address of this computer or at its firewall. The line
 * says what was done, so that "check power and cable" is not said where the network is to blame.
 * An answer that a firewall drops can be seen by root only, who is sent to pokeysctl discover.
 */
#include <errno.h>
#include <net/if.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include "daemon/control/finder.h"

enum { MISSING_SHOWN = 4, NETWORKS_SHOWN = 6, ADDRESS_TEXT = 16 };

struct line {
	char *text;
	size_t used;
};

static void put(struct line *line, const char *format, ...) __attribute__((format(printf, 2, 3)));

static void put(struct line *line, const char *format, ...)
{
	const size_t room = FINDER_WHY - line->used;
	va_list arguments;
	int length;

	va_start(arguments, format);
	length = vsnprintf(line->text + line->used, room, format, arguments);
	va_end(arguments);
	line->used += length < 0 ? 0 : (size_t)length < room ? (size_t)length : room - 1;
}

static const char *address_text(uint32_t address, char text[ADDRESS_TEXT])
{
	snprintf(text, ADDRESS_TEXT, "%u.%u.%u.%u", address >> 24, address >> 16 & 255,
		 address >> 8 & 255, address & 255);
	return text;
}

static void put_missing(struct line *line, const struct config *config, uint64_t missing)
{
	uint32_t named = 0, more = 0;

	for (uint32_t i = 0; i < config->devices; i++) {
		if (!(missing >> i & 1))
			continue;
		if (named == MISSING_SHOWN) {
			more++;
			continue;
		}
		put(line, "%s%s (serial %u)", named ? ", " : "", config->device[i].name,
		    config->device[i].serial);
		named++;
	}
	if (more)
		put(line, " and %u more", more);
	put(line, ": not found by a search");
}

static void put_network(struct line *line, const struct discovery_network *network)
{
	char name[IF_NAMESIZE] = "", address[ADDRESS_TEXT];

	if_indextoname(network->own.interface, name);
	put(line, "%s (%s/%u%s%s)", name, address_text(network->own.address, address),
	    network->own.prefix, network->error ? ", not asked: " : "",
	    network->error == -EOPNOTSUPP ? "it cannot send broadcasts" :
	    network->error                ? strerror(-network->error) :
					    "");
}

static void put_networks(struct line *line, const struct config *config,
			 const struct discovery_report *report)
{
	const int shown = report->networks < NETWORKS_SHOWN ? report->networks : NETWORKS_SHOWN;

	for (int i = 0; i < shown; i++) {
		put(line, i ? ", " : " at ");
		put_network(line, &report->network[i]);
	}
	if (report->networks > shown)
		put(line, " and %d more addresses", report->networks - shown);
	if (config->discovery_addresses)
		put(line, "%s discovery-address", shown ? " and" : " at");
	else if (!shown)
		put(line, ": no interface but loopback is up and has an IPv4 address");
}

/* The commonest mistake: a number that was mistyped, or of the device before. */
static void put_others(struct line *line, const struct finder_answers *answers)
{
	for (unsigned int i = 0; i < answers->others; i++)
		put(line, "%s%u", i ? ", " : "; answers came from serial ", answers->other[i]);
	if (answers->more_others)
		put(line, " and others");
}

void finder_why(const struct config *config, uint64_t missing, const struct finder_answers *answers,
		const struct discovery_report *report, char text[FINDER_WHY])
{
	struct line line = { .text = text };

	text[0] = '\0';
	put_missing(&line, config, missing);
	put_networks(&line, config, report);
	put_others(&line, answers);
	if (answers->others)
		put(&line, "; if one of them is meant, correct serial in pokeysd.conf and restart "
			   "pokeysd");
	else if (report->networks || config->discovery_addresses)
		put(&line, "; sudo pokeysctl discover tells whether this computer drops the "
			   "answer");
}
