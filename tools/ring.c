// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The ring is a file of the runtime folder, and there even when the daemon is dead: who
 * does not find it is told what else may be the reason.
 */
#include <errno.h>
#include <stdio.h>
#include <unistd.h>
#include "shm/runtime.h"
#include "tools/ring.h"

int ring_open(const struct options *options, struct recorder_file *ring)
{
	char path[256], why[384];
	int rc;

	snprintf(path, sizeof(path), "%s/" RECORDER_FILE, options->runtime_directory);
	rc = recorder_open(ring, path, why, sizeof(why));
	if (rc == -ENOENT)
		complain("no recorder in %s: no daemon runs there (systemctl start pokeysd; "
			 "another folder: --runtime-directory), its folder is on a disk, or it has "
			 "recorder-seconds = 0",
			 options->runtime_directory);
	else if (rc == -EACCES &&
		 runtime_denied(access(path, F_OK) ? options->runtime_directory : path, why,
				sizeof(why)))
		complain("%s", why);
	else if (rc)
		complain("%s", why);
	return rc;
}
