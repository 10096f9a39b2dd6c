// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The ring is a file of the runtime folder, and there even when the daemon is dead: who
 * does not find it is told what else may be the reason.
 */
#include <errno.h>
#include <stdio.h>
#include "tools/ring.h"

int ring_open(const struct options *options, struct recorder_file *ring)
{
	char path[256], why[384];
	int rc;

	snprintf(path, sizeof(path), "%s/" RECORDER_FILE, options->runtime_directory);
	rc = recorder_open(ring, path, why, sizeof(why));
	if (rc == -ENOENT)
		complain("no recorder in %s: no daemon runs there, or it has recorder-seconds = 0, "
			 "without which its cycles cannot be seen (another folder: "
			 "--runtime-directory)", options->runtime_directory);
	else if (rc == -EACCES)
		complain("%s; this user must be in the folder's group", why);
	else if (rc)
		complain("%s", why);
	return rc;
}
