/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Who has which hardware address, for the headers of a record. Cold. */
#ifndef RECORDER_STATION_H
#define RECORDER_STATION_H

#include <stddef.h>
#include <stdint.h>

enum { STATIONS = 256 };

struct stations {
	size_t count;
	struct station {
		uint32_t address; /* IPv4, host byte order */
		uint8_t mac[6];
	} station[STATIONS];
};

/* This machine's interfaces, and the neighbours in the file `arp` (/proc/net/arp). */
void stations_read(struct stations *stations, const char *arp);

/* Six bytes; zeros if it is not known (a loopback interface has those as well). */
const uint8_t *stations_mac(const struct stations *stations, uint32_t address);

#endif
