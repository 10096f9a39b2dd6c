// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What pokeysd.conf plans and which way its packets will go. Only the few keys
 * that matter are read, and a wrong one is left alone: to find faults in the
 * file is the work of pokeysd --check-config, whose words are the better ones.
 */
#include <arpa/inet.h>
#include <ini.h>
#include <stdlib.h>
#include <string.h>
#include "tools/doctor.h"

static struct doctor_device *device_named(struct doctor *doctor, const char *name)
{
	struct doctor_device *device;

	for (size_t i = 0; i < doctor->devices; i++)
		if (!strcmp(doctor->device[i].name, name))
			return &doctor->device[i];
	if (doctor->devices == DOCTOR_DEVICES)
		return NULL;
	device = &doctor->device[doctor->devices++];
	snprintf(device->name, sizeof(device->name), "%s", name);
	return device;
}

static void take_daemon(struct doctor_plan *plan, const char *name, const char *value)
{
	if (!strcmp(name, "cpu"))
		plan->cpu = strcmp(value, "any") ? atoi(value) : -1;
	else if (!strcmp(name, "mode"))
		plan->spin = !strcmp(value, "spin");
	else if (!strcmp(name, "duty"))
		plan->duty = atof(value);
}

static int take(void *context, const char *section, const char *name, const char *value)
{
	struct doctor *doctor = context;
	struct in_addr address;

	if (!strcmp(section, "daemon")) {
		take_daemon(&doctor->plan, name, value);
	} else if (!strncmp(section, "device ", 7)) {
		struct doctor_device *device = device_named(doctor, section + 7);

		if (device && !strcmp(name, "address") && inet_pton(AF_INET, value, &address) == 1)
			device->address = ntohl(address.s_addr);
	}
	return 1;
}

void doctor_read_plan(struct doctor *doctor, const char *path)
{
	struct doctor_plan *plan = &doctor->plan;

	*plan = (struct doctor_plan){ .cpu = -1, .duty = 0.9 };
	snprintf(plan->path, sizeof(plan->path), "%s%s", doctor->root, path);
	plan->read = ini_parse(plan->path, take, doctor) >= 0;
}

/* The most exact of the routes that fit; /proc/net/route has addresses as the network does. */
static void find_route(const char *table, struct doctor_device *device)
{
	uint32_t best = 0;
	char nic[16];
	unsigned int destination, gateway, flags, mask;

	for (; table; table = strchr(table, '\n')) {
		table += *table == '\n';
		if (sscanf(table, "%15s %x %x %x %*s %*s %*s %x", nic, &destination, &gateway,
			   &flags, &mask) != 5 || !(flags & 1))
			continue;
		mask = ntohl(mask);
		if ((device->address & mask) != ntohl(destination) || (*device->nic && mask < best))
			continue;
		best = mask;
		device->through_router = gateway != 0;
		snprintf(device->nic, sizeof(device->nic), "%s", nic);
	}
}

void doctor_find_routes(struct doctor *doctor)
{
	char table[1 << 14];

	doctor->routes_read = probe_text(doctor->root, table, sizeof(table), "/proc/net/route");
	for (size_t i = 0; i < doctor->devices; i++) {
		struct doctor_device *device = &doctor->device[i];

		if (device->address >> 24 == 127)
			strcpy(device->nic, "lo");
		else if (device->address && doctor->routes_read)
			find_route(table, device);
	}
}
