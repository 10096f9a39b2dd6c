// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeysctl record: the ring that the daemon fills, as a file. Nothing is asked of
 * the daemon: its memory is read, so it works while the daemon is busy and when it
 * has died. If the record goes to standard output ("-"), nothing else is printed there.
 */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>
#include "daemon/recorder/export.h"
#include "tools/json.h"
#include "tools/pokeysctl.h"
#include "tools/ring.h"

static int find_device(const struct recorder_file *ring, const char *name)
{
	for (uint32_t i = 0; i < ring->head.devices; i++)
		if (!strcmp(ring->head.name[i], name))
			return (int)i;
	return -ENODEV;
}

static void no_device(const struct recorder_file *ring, const char *name)
{
	char text[RECORDER_DEVICES * (sizeof(ring->head.name[0]) + 2)] = "";
	size_t at = 0;

	for (uint32_t i = 0; i < ring->head.devices && at < sizeof(text); i++)
		at += (size_t)snprintf(text + at, sizeof(text) - at, "%s%s", i ? ", " : "",
				       ring->head.name[i]);
	complain("there is no device \"%s\" in the record; it has: %s", name, text);
}

static void tell(const struct options *options, const char *path,
		 const struct export_summary *summary)
{
	const double seconds = (double)(summary->last_ns - summary->first_ns) / 1e9;
	struct json json;

	if (!options->json) {
		printf("%s: %llu packets and %llu events of %.3f s\n", path,
		       (unsigned long long)summary->packets, (unsigned long long)summary->events,
		       seconds);
		return;
	}
	json_init(&json, stdout);
	json_object(&json, NULL);
	json_integer(&json, "format", 1);
	json_text(&json, "file", path);
	json_unsigned(&json, "packets", summary->packets);
	json_unsigned(&json, "events", summary->events);
	json_real(&json, "seconds", seconds);
	json_end(&json);
}

static bool is_output(const char *path)
{
	return !strcmp(path, "-");
}

static FILE *open_file(const char *path)
{
	int fd;

	if (!is_output(path))
		return fopen(path, "we");
	fd = dup(STDOUT_FILENO);
	return fd < 0 ? NULL : fdopen(fd, "w");
}

static int write_file(const struct recorder_file *ring, int device, const char *path,
		      struct export_summary *summary)
{
	static struct stations stations;
	const struct export_options export = {
		.device = device,
		.application = "pokeysctl " POKEYSD_VERSION,
		.comment = "by command",
		.wall_ns = export_wall(),
		.stations = &stations,
	};
	FILE *to;
	int rc;

	if (is_output(path) && isatty(STDOUT_FILENO)) {
		complain("standard output is a terminal, and a record is not text; name a file, "
			 "or use a pipe");
		return STATUS_USAGE;
	}
	to = open_file(path);
	if (!to) {
		complain("%s: %s", path, strerror(errno));
		return STATUS_FAILED;
	}
	stations_read(&stations, "/proc/self/net/arp");
	rc = export_record(ring, &export, to, summary);
	if (fclose(to) && !rc)
		rc = -errno;
	if (!rc)
		return STATUS_OK;
	complain("%s: %s; what is there is not whole", path, strerror(-rc));
	return STATUS_FAILED;
}

int command_record(const struct options *options)
{
	const char *path = options->name_count ? options->names[options->name_count - 1] : NULL;
	struct export_summary summary;
	struct recorder_file ring;
	int device = EXPORT_ALL, status = STATUS_FAILED;

	if (!path || options->name_count > 2) {
		complain("usage: pokeysctl record [--json] [DEVICE] FILE");
		return STATUS_USAGE;
	}
	if (ring_open(options, &ring))
		return STATUS_FAILED;
	if (options->name_count == 2)
		device = find_device(&ring, options->names[0]);
	if (options->name_count == 1 && find_device(&ring, path) >= 0)
		complain("%s is a device: name a file behind it (a file of that name: ./%s)", path,
			 path);
	else if (device == -ENODEV)
		no_device(&ring, options->names[0]);
	else
		status = write_file(&ring, device, path, &summary);
	if (status == STATUS_OK && !is_output(path))
		tell(options, path, &summary);
	recorder_release(&ring);
	return status;
}
