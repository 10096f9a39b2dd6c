// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What stands behind an option, taken whole or not at all: half a core is none, and
 * "10s" is not ten.
 */
#include <arpa/inet.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "tools/argument.h"

static bool take(const char *name, const char *text, double minimum, double maximum, bool whole,
		 double *out)
{
	char *end;
	double value = strtod(text, &end);

	if (end == text || *end || !isfinite(value) || value < minimum || value > maximum ||
	    (whole && value != floor(value))) {
		complain("--%s: \"%s\" is not allowed; allowed: %.10g..%.10g", name, text, minimum,
			 maximum);
		return false;
	}
	*out = value;
	return true;
}

bool argument_number(const char *name, const char *text, double minimum, double maximum,
		     double *out)
{
	return take(name, text, minimum, maximum, false, out);
}

bool argument_whole(const char *name, const char *text, double minimum, double maximum, double *out)
{
	return take(name, text, minimum, maximum, true, out);
}

bool argument_addresses(struct options *options, const char *text)
{
	char part[INET_ADDRSTRLEN + 1];
	struct in_addr address;

	while (*text) {
		size_t length = strcspn(text, ",");

		snprintf(part, sizeof(part), "%.*s", (int)length, text);
		if (length >= sizeof(part) || inet_pton(AF_INET, part, &address) != 1) {
			complain("--address: \"%s\" is not an IPv4 address", part);
			return false;
		}
		if (options->addresses == ADDRESSES_MAX) {
			complain("--address: at most %d addresses are allowed", ADDRESSES_MAX);
			return false;
		}
		options->address[options->addresses++] = ntohl(address.s_addr);
		text += length + (text[length] == ',');
	}
	return true;
}

const char *argument_written(const char *text)
{
	return text + (*text == ' ');
}
