// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * One record into its folder.
 *
 * It is written beside and renamed, so that a file of that name is a whole one.
 * Names begin with the time in UTC, so that their order is that of time also in
 * the night in which the clock is set back; the oldest are removed by it. Nothing
 * else in the folder is touched.
 */
#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>
#include "daemon/control/keeper.h"
#include "daemon/recorder/export.h"

#define PREFIX "pokeysd-"
#define SUFFIX ".pcapng"

static const char *const reasons[RECORD_REASONS] = {
	[RECORD_LOST] = "lost",
	[RECORD_COMMANDER] = "commander",
	[RECORD_EMERGENCY] = "emergency",
	[RECORD_LIMIT] = "limit",
	[RECORD_LATE] = "late",
	[RECORD_TRANSPORT] = "transport",
	[RECORD_DIED] = "died",
};

const char *keeper_word(enum record_reason reason)
{
	return reasons[reason];
}

static int is_record(const struct dirent *entry)
{
	size_t length = strlen(entry->d_name);

	return !strncmp(entry->d_name, PREFIX, strlen(PREFIX)) && length > strlen(SUFFIX) &&
	       !strcmp(entry->d_name + length - strlen(SUFFIX), SUFFIX);
}

/* Leave the newest `files`. */
static void remove_oldest(const char *folder, uint32_t files)
{
	struct dirent **entry;
	int count = scandir(folder, &entry, is_record, alphasort);
	char path[KEEPER_PATH + 256];

	for (int i = 0; i < count; i++) {
		snprintf(path, sizeof(path), "%s/%s", folder, entry[i]->d_name);
		if (count - i > (int)files)
			unlink(path);
		free(entry[i]);
	}
	if (count >= 0)
		free(entry);
}

static int name_file(const char *folder, enum record_reason reason, char path[KEEPER_PATH])
{
	const time_t now = time(NULL);
	struct tm parts;
	char when[32];
	int length;

	gmtime_r(&now, &parts);
	strftime(when, sizeof(when), "%Y%m%dT%H%M%SZ", &parts);
	length = snprintf(path, KEEPER_PATH, "%s/" PREFIX "%s-%s" SUFFIX, folder, when,
			  reasons[reason]);
	return length < KEEPER_PATH - 4 ? 0 : -ENAMETOOLONG;
}

static int write_beside(const struct recorder_file *ring, const char *beside,
			enum record_reason reason, uint64_t *packets)
{
	static struct stations stations;
	const struct export_options options = {
		.device = EXPORT_ALL, .application = "pokeysd " POKEYSD_VERSION,
		.comment = reasons[reason], .wall_ns = export_wall(), .stations = &stations,
	};
	struct export_summary summary;
	FILE *to = fopen(beside, "wex");
	int result;

	if (!to && errno == EEXIST && !unlink(beside))
		to = fopen(beside, "wex");
	if (!to)
		return -errno;
	stations_read(&stations, "/proc/net/arp");
	result = export_record(ring, &options, to, &summary);
	if (fclose(to) && !result)
		result = -errno;
	*packets = summary.packets;
	return result;
}

int keeper_write(const char *ring, const char *folder, uint32_t files, enum record_reason reason,
		 char path[KEEPER_PATH], uint64_t *packets)
{
	struct recorder_file file;
	char beside[KEEPER_PATH], why[KEEPER_PATH];
	int result = name_file(folder, reason, path);

	result = result ? result : recorder_open(&file, ring, why, sizeof(why));
	if (result)
		return result;
	snprintf(beside, sizeof(beside), "%.*s.new", KEEPER_PATH - 5, path);
	result = write_beside(&file, beside, reason, packets);
	recorder_release(&file);
	if (!result && rename(beside, path))
		result = -errno;
	if (result)
		unlink(beside);
	else
		remove_oldest(folder, files);
	return result;
}
