// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * A disk that hangs, to be preloaded: opening a file whose name contains $HUNG_NAME to read
 * it, or renaming one to it, tells of itself by a file $HUNG_FOLDER/hung and goes on when
 * $HUNG_FOLDER/go is there.
 */
#include <fcntl.h>
#include <stdarg.h>
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

static void hang_at(const char *path)
{
	const char *name = getenv("HUNG_NAME"), *folder = getenv("HUNG_FOLDER");

	if (name && folder && strstr(path, name))
		hang(folder);
}

static int open_it(const char *path, int flags, mode_t mode)
{
	if ((flags & O_ACCMODE) == O_RDONLY)
		hang_at(path);
	return (int)syscall(SYS_openat, AT_FDCWD, path, flags, mode);
}

/* Files are large here, as in the daemon: the name is open64. */
int open(const char *path, int flags, ...)
{
	va_list arguments;
	mode_t mode;

	va_start(arguments, flags);
	mode = flags & O_CREAT ? va_arg(arguments, mode_t) : 0;
	va_end(arguments);
	return open_it(path, flags, mode);
}

int rename(const char *from, const char *to)
{
	hang_at(to);
	return (int)syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0);
}
