// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Whoever asks whether a configuration is in order is mostly root, and root may read a
 * password file that the service may not. So root asks as the service's user; who can not
 * become that user is told for whom the answer is.
 */
#include <grp.h>
#include <pwd.h>
#include <stdbool.h>
#include <stdio.h>
#include <unistd.h>
#include "daemon/control/service.h"

void service_become(char *note, size_t size)
{
	const struct passwd *service = getpwnam(SERVICE_USER), *own;
	const bool known = service;

	*note = '\0';
	if (known && geteuid() == service->pw_uid)
		return;
	if (known && !geteuid() && !initgroups(SERVICE_USER, service->pw_gid) &&
	    !setgid(service->pw_gid) && !setuid(service->pw_uid))
		return;
	own = getpwuid(geteuid());
	snprintf(note, size, "; judged for user %s, for %s", own ? own->pw_name : "of this shell",
		 known ? "only root can become " SERVICE_USER ", whom the service runs as" :
			 "there is no user " SERVICE_USER ", whom the service runs as");
}
