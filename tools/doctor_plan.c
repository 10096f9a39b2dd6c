// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What pokeysd.conf plans and which way its packets will go. Only the few keys
 * that matter are read, and a wrong one is left alone: to find faults in the
 * file is the work of pokeysd --check-config, whose words are the better ones.
 */
#include <arpa/inet.h>
#include <ctype.h>
#include <ini.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include "daemon/control/config.h"
#include "tools/doctor.h"
#include "tools/neighbour.h"

enum { CORE_MAX = 1023 };

/* One file of the configuration. */
struct reading {
	struct doctor *doctor;
	const char *path;
};

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

/* inih has cut off comments that begin with ';', the daemon knows '#' as well. */
static void cut_comment(char *out, size_t size, const char *value)
{
	size_t length = 0;

	while (value[length] &&
	       !(value[length] == '#' && (!length || isblank((unsigned char)value[length - 1]))))
		length++;
	while (length && isblank((unsigned char)value[length - 1]))
		length--;
	snprintf(out, size, "%.*s", (int)length, value);
}

/* "any", and what is no number, is none: it is not to be taken for core 0. */
static int core_of(const char *value)
{
	char *end;
	long core = strtol(value, &end, 10);

	return end != value && !*end && core >= 0 && core <= CORE_MAX ? (int)core : -1;
}

static void take_daemon(const struct reading *reading, const char *name, const char *value)
{
	struct doctor_plan *plan = &reading->doctor->plan;

	if (!strcmp(name, "cpu")) {
		plan->cpu = core_of(value);
		snprintf(plan->cpu_from, sizeof(plan->cpu_from), "%s", reading->path);
	} else if (!strcmp(name, "mode")) {
		plan->spin = !strcmp(value, "spin");
		plan->chosen = strcmp(value, "auto") != 0;
	} else if (!strcmp(name, "priority")) {
		plan->priority = atoi(value);
	} else if (!strcmp(name, "duty")) {
		plan->duty = atof(value);
	} else if (!strcmp(name, "interface")) {
		snprintf(plan->interface, sizeof(plan->interface), "%.15s", value);
	} else if (!strcmp(name, "runtime-directory")) {
		snprintf(plan->runtime, sizeof(plan->runtime), "%s", value);
	}
}

static int take(void *context, const char *section, const char *name, const char *text)
{
	const struct reading *reading = context;
	struct doctor *doctor = reading->doctor;
	struct in_addr address;
	char value[256];

	cut_comment(value, sizeof(value), text);
	if (!strcmp(section, "daemon")) {
		take_daemon(reading, name, value);
	} else if (!strncmp(section, "device ", 7)) {
		struct doctor_device *device = device_named(doctor, section + 7);

		if (device && !strcmp(name, "address") && inet_pton(AF_INET, value, &address) == 1)
			device->address = ntohl(address.s_addr);
	}
	return 1;
}

/* A file and nothing else: a FIFO would never end. */
static bool read_file(struct doctor *doctor, const char *path)
{
	struct reading reading = { doctor, path };
	struct stat status;

	return !stat(path, &status) && S_ISREG(status.st_mode) &&
	       ini_parse(path, take, &reading) >= 0;
}

void doctor_read_plan(struct doctor *doctor, const char *path)
{
	struct doctor_plan *plan = &doctor->plan;
	char *file[CONFIG_FILES];
	int files;

	*plan = (struct doctor_plan){ .cpu = -1, .duty = 0.9, .priority = 80 };
	snprintf(plan->path, sizeof(plan->path), "%s%s", doctor->root, path);
	plan->read = read_file(doctor, plan->path);
	files = config_files(plan->path, file);
	if (files < 0)
		plan->unread = "the folder " CONFIG_FOLDER_ENDING " beside pokeysd.conf cannot be "
			       "read";
	for (int i = 1; i < files; i++)
		if (!read_file(doctor, file[i]))
			plan->unread = "a file in the folder " CONFIG_FOLDER_ENDING " beside "
				       "pokeysd.conf cannot be read";
	if (files > 0)
		config_free_files(file, files);
}

/* As the daemon does: mode = auto spins on an isolated core that LinuxCNC does not take. */
void doctor_choose_core(struct doctor *doctor, int asked)
{
	struct doctor_plan *plan = &doctor->plan;
	char list[256];

	doctor->cpu = asked >= 0 ? asked : plan->cpu;
	if (!plan->chosen && doctor->cpu >= 0 &&
	    probe_text(doctor->root, list, sizeof(list), "/sys/devices/system/cpu/isolated"))
		plan->spin = probe_list_has(list, doctor->cpu) &&
			     probe_list_has_above(list, doctor->cpu);
}

bool doctor_core_is_absent(const struct doctor *doctor)
{
	char online[256];

	return doctor->cpu >= 0 &&
	       probe_text(doctor->root, online, sizeof(online), "/sys/devices/system/cpu/online") &&
	       !probe_list_has(online, doctor->cpu);
}

/*
 * The most exact of the routes that fit, of several the one of the least metric;
 * /proc/net/route has addresses as the network does. With `only`, routes of this interface.
 */
static void find_route(const char *table, const char *only, struct doctor_device *device)
{
	uint32_t best = 0;
	char nic[16];
	unsigned int destination, gateway, flags, metric, mask, least = 0;

	for (; table; table = strchr(table, '\n')) {
		table += *table == '\n';
		if (sscanf(table, "%15s %x %x %x %*s %*s %u %x", nic, &destination, &gateway,
			   &flags, &metric, &mask) != 6 ||
		    !(flags & 1) || (*only && strcmp(nic, only) != 0))
			continue;
		mask = ntohl(mask);
		if ((device->address & mask) != ntohl(destination) ||
		    (*device->nic && (mask < best || (mask == best && metric >= least))))
			continue;
		best = mask;
		least = metric;
		device->through_router = gateway != 0;
		snprintf(device->nic, sizeof(device->nic), "%s", nic);
	}
}

/* Of two interfaces in one network, the daemon uses the one at which the device has answered. */
static void look_aside(const char *root, struct doctor_device *device)
{
	char found[16];

	if (!*device->nic || device->through_router ||
	    !neighbour_interface(root, device->address, device->nic, found) ||
	    !strcmp(found, device->nic))
		return;
	strcpy(device->aside, device->nic);
	strcpy(device->nic, found);
}

void doctor_find_routes(struct doctor *doctor)
{
	char table[1 << 14];

	const char *only = doctor->plan.interface;

	doctor->routes_read = probe_text(doctor->root, table, sizeof(table), "/proc/net/route");
	for (size_t i = 0; i < doctor->devices; i++) {
		struct doctor_device *device = &doctor->device[i];

		if (device->address >> 24 == 127)
			strcpy(device->nic, "lo");
		else if (device->address && doctor->routes_read)
			find_route(table, only, device);
		if (*only && device->address)
			strcpy(device->nic, only); /* without a route: straight out of it */
		else
			look_aside(doctor->root, device);
	}
}
