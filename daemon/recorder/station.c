/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A UDP socket does not tell hardware addresses. The kernel's tables do, and
 * they are looked at when a record is written, not when a packet comes: a device
 * keeps its address for longer than a record lasts.
 */
#include <arpa/inet.h>
#include <ifaddrs.h>
#include <netpacket/packet.h>
#include <stdio.h>
#include <string.h>
#include "daemon/recorder/station.h"
#include "daemon/transport/addresses.h"

static void add(struct stations *stations, uint32_t address, const uint8_t *mac)
{
	struct station *station = &stations->station[stations->count];

	if (stations->count == STATIONS)
		return;
	station->address = address;
	memcpy(station->mac, mac, 6);
	stations->count++;
}

/* The hardware address of an interface, NULL if it has none. */
static const uint8_t *link_of(const struct ifaddrs *all, unsigned int index)
{
	for (const struct ifaddrs *i = all; i; i = i->ifa_next) {
		const struct sockaddr_ll *link = (const void *)i->ifa_addr;

		if (link && link->sll_family == AF_PACKET && link->sll_halen == 6 &&
		    (unsigned int)link->sll_ifindex == index)
			return link->sll_addr;
	}
	return NULL;
}

static void read_own(struct stations *stations)
{
	struct own_address own[ADDRESSES_OWN_MAX];
	const int count = addresses_own(own, ADDRESSES_OWN_MAX, 0);
	struct ifaddrs *all;

	if (getifaddrs(&all))
		return;
	for (int i = 0; i < count; i++) {
		const uint8_t *mac = link_of(all, own[i].interface);

		if (mac)
			add(stations, own[i].address, mac);
	}
	freeifaddrs(all);
}

static void read_neighbours(struct stations *stations, const char *arp)
{
	FILE *f = fopen(arp, "re");
	char line[256];

	while (f && fgets(line, sizeof(line), f)) {
		unsigned int m[6];
		char address[INET_ADDRSTRLEN];
		struct in_addr in;
		uint8_t mac[6];

		if (sscanf(line, "%15s 0x%*x 0x%*x %2x:%2x:%2x:%2x:%2x:%2x", address, &m[0], &m[1],
			   &m[2], &m[3], &m[4], &m[5]) != 7 ||
		    inet_pton(AF_INET, address, &in) != 1)
			continue;
		for (int i = 0; i < 6; i++)
			mac[i] = (uint8_t)m[i];
		add(stations, ntohl(in.s_addr), mac);
	}
	if (f)
		fclose(f);
}

void stations_read(struct stations *stations, const char *arp)
{
	stations->count = 0;
	read_neighbours(stations, arp);
	read_own(stations);
}

const uint8_t *stations_mac(const struct stations *stations, uint32_t address)
{
	static const uint8_t unknown[6];

	for (size_t i = 0; i < stations->count; i++)
		if (stations->station[i].address == address)
			return stations->station[i].mac;
	return unknown;
}
