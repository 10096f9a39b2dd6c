/* SPDX-License-Identifier: GPL-2.0-or-later */
/* pokeysctl discover: what its parts share. */
#ifndef TOOLS_DISCOVER_H
#define TOOLS_DISCOVER_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include "daemon/transport/transport.h"
#include "tools/pokeysctl.h"
#include "wire/model.h"

struct found {
	struct wire_discovery answer;
	struct transport_address from;
};

/* "PoKeys57CNC" */
const char *discover_type(const struct wire_discovery *answer);

/* "4.7.15" */
void discover_firmware(const struct wire_discovery *answer, char text[16]);

/* "192.168.1.20" */
void discover_address(uint32_t address, char text[16]);

/*
 * A pokeysd.conf for these devices, with their present settings, read from the devices without
 * a daemon. STATUS_FAILED if those of any device are missing; the reason has been printed.
 */
int discover_draft(const struct found *found, size_t count, const struct options *options,
		   FILE *to);

#endif
