// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * A disk that hangs, to be preloaded: a rename() of a file whose name contains $HUNG_NAME
 * tells of itself by a file $HUNG_FOLDER/hung and goes on when $HUNG_FOLDER/go is there.
 */
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

static void hang(const char *folder)
{
	static const struct timespec nap = { .tv_nsec = 5000000 };
	char path[512];
	int fd;

	snprintf(path, sizeof(path), "%s/hung", folder);
	fd = open(path, O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
	if (fd >= 0)
		close(fd);
	snprintf(path, sizeof(path), "%s/go", folder);
	while (access(path, F_OK))
		nanosleep(&nap, NULL);
}

int rename(const char *from, const char *to)
{
	const char *name = getenv("HUNG_NAME"), *folder = getenv("HUNG_FOLDER");

	if (name && folder && strstr(to, name))
		hang(folder);
	return (int)syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0);
}
