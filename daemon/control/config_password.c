// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * A password does not stand in a file that people copy into mails and bug
 * reports; it has one of its own, and one that others may read is refused: a
 * password that everybody knows shall not look as if nobody did. What is in the
 * file is never told, not even its length.
 *
 * Opening must not hang (a FIFO) and must not follow a link to somewhere else;
 * what was opened is what is looked at.
 */
#include <errno.h>
#include <fcntl.h>
#include <pwd.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "daemon/control/config_key.h"
#include "daemon/control/service.h"

enum { PASSWORD_MAX = 32, TEXT_MAX = PASSWORD_MAX + 2 };

/* Root, whoever runs this, or the user whom the service runs as. */
static bool owner_is_good(uid_t owner)
{
	const struct passwd *service = getpwnam(SERVICE_USER);

	return owner == 0 || owner == geteuid() || (service && owner == service->pw_uid);
}

static const char *judge_file(const struct stat *status)
{
	if (!S_ISREG(status->st_mode))
		return "is not a file";
	if (!owner_is_good(status->st_uid))
		return "belongs neither to root nor to the daemon's user";
	if (status->st_mode & 077)
		return "may be read by others than its owner; make it chmod 600";
	return NULL;
}

static const char *take_line(char *text, ssize_t length, char out[33])
{
	if (length < 0)
		return "cannot be read";
	if (length && text[length - 1] == '\n')
		length--;
	if (length < 1 || length > PASSWORD_MAX)
		return "has to hold one line of 1 to 32 characters";
	if (memchr(text, '\n', (size_t)length) || memchr(text, '\0', (size_t)length))
		return "has to hold one line of 1 to 32 characters";
	memcpy(out, text, (size_t)length);
	out[length] = '\0';
	return NULL;
}

bool config_password_hidden(const char *path)
{
	const struct passwd *service = getpwnam(SERVICE_USER);
	struct stat status;

	if (!service || service->pw_uid == geteuid() ||
	    !faccessat(AT_FDCWD, path, R_OK, AT_EACCESS) || errno != EACCES)
		return false;
	return stat(path, &status) || status.st_uid == service->pw_uid;
}

const char *config_read_password(const char *path, char out[33])
{
	int fd = open(path, O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
	char text[TEXT_MAX];
	struct stat status;
	const char *wrong;

	memset(out, 0, 33);
	if (fd < 0)
		return errno == ENOENT ?
			       "is not there" :
		       errno == ELOOP ?
			       "is a link, not a file" :
			       "cannot be opened by this user; make it the daemon's (chown pokeys)";
	wrong = fstat(fd, &status) ? "cannot be read" : judge_file(&status);
	if (!wrong)
		wrong = take_line(text, read(fd, text, sizeof(text)), out);
	explicit_bzero(text, sizeof(text));
	close(fd);
	return wrong;
}
