// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The folder of pins: names in a BPF file system, by which the link and the maps outlive a guard
 * that was killed, and by which the next guard finds them.
 */
#include <errno.h>
#include <grp.h>
#include <linux/magic.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>
#include "daemon/control/log.h"
#include "daemon/device/event.h"
#include "guard/kernel.h"

enum { NAME = 16 };

static const char *const names[] = { "link", "counters", "devices", "ports", "sockets" };
static char folder[GUARD_PATH - NAME] = GUARD_PINS;
static bool is_given; /* by --pins: the guard neither creates nor removes it */

bool guard_use_pins(const char *path)
{
	if (strlen(path) >= sizeof(folder))
		return false;
	strcpy(folder, path);
	is_given = true;
	return true;
}

const char *guard_pin(const char *name, char path[GUARD_PATH])
{
	snprintf(path, GUARD_PATH, "%s%s%.*s", folder, *name ? "/" : "", NAME - 2, name);
	return path;
}

int guard_make_pin_folder(void)
{
	const char *place = is_given && !access(folder, F_OK) ? folder : GUARD_BPFFS;
	struct statfs status;

	if (statfs(place, &status))
		return guard_refused(place, errno);
	if ((unsigned long)status.f_type != BPF_FS_MAGIC) {
		log_line(EVENT_WARNING, "%s is no bpf file system%s" GUARD_LOSS, place,
			 place == folder ? "" : " (mount -t bpf -o mode=0700 bpf " GUARD_BPFFS ")");
		return GUARD_UNAVAILABLE;
	}
	if (is_given && place != folder)
		return guard_refused(folder, ENOENT);
	if (!is_given && mkdir(folder, 0750) && errno != EEXIST)
		return guard_refused(folder, errno);
	return 0;
}

void guard_open_pins(void)
{
	const struct group *group = getgrnam("pokeys");
	char path[GUARD_PATH];

	guard_pin("counters", path);
	if (group && (chown(folder, (uid_t)-1, group->gr_gid) ||
		      chown(path, (uid_t)-1, group->gr_gid) || chmod(path, 0640)))
		log_line(EVENT_INFO,
			 "%s: cannot be given to group pokeys: %s; " GUARD_STATUS
			 " has the counters as well",
			 path, strerror(errno));
}

int guard_remove_pins(void)
{
	char path[GUARD_PATH];
	int result = 0;

	for (size_t i = 0; i < sizeof(names) / sizeof(names[0]); i++)
		if (unlink(guard_pin(names[i], path)) && errno != ENOENT)
			result = -errno;
	if (!is_given && rmdir(folder) && errno != ENOENT)
		result = -errno;
	return result;
}
