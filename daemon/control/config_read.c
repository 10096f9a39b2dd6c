// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The files of a configuration: pokeysd.conf, and those in the folder pokeysd.conf.d beside it
 * that end in .conf, in the order of their names. Programs and packages have files of their own
 * there, so nobody has to edit what somebody else has written.
 */
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <pwd.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "daemon/control/config_key.h"

enum { FILE_MAX = 1 << 18 };

/*
 * A file and nothing else: it is read again while the daemon runs, and a FIFO
 * would hold up the thread that hears SIGTERM and feeds the watchdog.
 */
static int open_file(const char *path)
{
	int fd = open(path, O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
	struct stat status;
	int error = 0;

	if (fd < 0)
		return -errno;
	if (fstat(fd, &status))
		error = errno;
	else if (!S_ISREG(status.st_mode))
		error = S_ISDIR(status.st_mode) ? EISDIR : EPROTO;
	if (!error)
		return fd;
	close(fd);
	return -error;
}

/* A whole file, bounded. Its length, or -errno; -EPROTO = it is no file. */
static ssize_t slurp(const char *path, char *text, size_t size)
{
	int fd = open_file(path);
	size_t length = 0;
	ssize_t got = 1;

	if (fd < 0)
		return fd;
	while (got > 0 && length < size) {
		got = read(fd, text + length, size - length);
		if (got > 0)
			length += (size_t)got;
		else if (got < 0 && errno == EINTR)
			got = 1;
	}
	got = got < 0 ? -errno : (ssize_t)length;
	close(fd);
	return got;
}

/* Root checks as the service's user (service.h), so the message names who lacks permission. */
static const char *own_name(void)
{
	const struct passwd *own = getpwuid(geteuid());

	return own ? own->pw_name : "of this process";
}

static void put_why(struct config_file *file, ssize_t result)
{
	if (result == -ENOENT)
		config_fault(file, 0,
			     "there is no such file; pokeysd.conf(5) says what to write "
			     "into it");
	else if (result == -EPROTO)
		config_fault(file, 0,
			     "is not a file; the daemon reads it again at every "
			     "reload, so it must be a regular file");
	else if (result == -EACCES)
		config_fault(file, 0,
			     "may not be read by user %s, or that user may not enter "
			     "a folder above it",
			     own_name());
	else if (result == -E2BIG)
		config_fault(file, 0, "has too many files, at most %d are allowed",
			     CONFIG_FILES - 1);
	else if (result < 0)
		config_fault(file, 0, "cannot be read: %s", strerror((int)-result));
	else
		config_fault(file, 0, "is too large, at most %d bytes are allowed", FILE_MAX - 1);
}

/* Why a text could not be read. Returns the number of faults: 1. */
static int say_why(const struct config_text *text, ssize_t result, config_complain complain,
		   void *context)
{
	struct config_file *file = calloc(1, sizeof(*file)); /* megabytes: not on the stack */

	if (!file) {
		complain(context, "the configuration was not read: out of memory");
		return 1;
	}
	file->text = text;
	file->complain = complain;
	file->context = context;
	put_why(file, result);
	free(file);
	return 1;
}

/* Nothing that an editor or a package manager has left: a.conf~, a.conf.dpkg-old, .a.conf. */
static int is_read(const struct dirent *entry)
{
	const char *dot = strrchr(entry->d_name, '.');

	return dot && *entry->d_name != '.' && !strcmp(dot, ".conf");
}

/* By their bytes, the same in every language. */
static int by_name(const struct dirent **a, const struct dirent **b)
{
	return strcmp((*a)->d_name, (*b)->d_name);
}

int config_files(const char *path, char *file[CONFIG_FILES])
{
	struct dirent **entry = NULL;
	char *folder;
	int count, files = 1, result = 0;

	file[0] = strdup(path);
	if (!file[0] || asprintf(&folder, "%s" CONFIG_FOLDER_ENDING, path) < 0) {
		free(file[0]);
		return -ENOMEM;
	}
	count = scandir(folder, &entry, is_read, by_name);
	if (count < 0 && errno != ENOENT)
		result = -errno;
	else if (count >= CONFIG_FILES)
		result = -E2BIG;
	for (int i = 0; i < count; i++) {
		if (!result && asprintf(&file[files], "%s/%s", folder, entry[i]->d_name) < 0)
			result = -ENOMEM;
		else if (!result)
			files++;
		free(entry[i]);
	}
	free(entry);
	free(folder);
	if (!result)
		return files;
	config_free_files(file, files);
	return result;
}

void config_free_files(char *file[], int files)
{
	for (int i = 0; i < files; i++)
		free(file[i]);
}

/* A file's content into `text`. Number of faults. */
static int read_file(const char *path, struct config_text *text, config_complain complain,
		     void *context)
{
	char *content = malloc(FILE_MAX);
	const ssize_t length = content ? slurp(path, content, FILE_MAX) : -ENOMEM;

	*text = (struct config_text){ path, content, length > 0 ? (size_t)length : 0 };
	if (length < 0 || length >= FILE_MAX)
		return say_why(text, length, complain, context);
	return 0;
}

static int read_folder_failed(const char *path, int result, config_complain complain, void *context)
{
	char folder[CONFIG_WHERE];
	const struct config_text name = { .name = folder };

	snprintf(folder, sizeof(folder), "%s" CONFIG_FOLDER_ENDING, path);
	return say_why(&name, result, complain, context);
}

static int read_files(const char *path, enum config_reader reader, struct config *out,
		      config_complain complain, void *context)
{
	struct config_text text[CONFIG_FILES];
	char *file[CONFIG_FILES];
	const int files = config_files(path, file);
	int faults = 0, read = 0;

	if (files < 0)
		return read_folder_failed(path, files, complain, context);
	while (!faults && read < files) {
		faults = read_file(file[read], &text[read], complain, context);
		read++;
	}
	if (!faults)
		faults = config_parse_texts(text, (size_t)files, reader, out, complain, context);
	for (int i = 0; i < read; i++)
		free((char *)text[i].text);
	config_free_files(file, files);
	return faults;
}

int config_read(const char *path, struct config *out, config_complain complain, void *context)
{
	return read_files(path, CONFIG_TO_RUN, out, complain, context);
}

int config_check(const char *path, struct config *out, config_complain complain, void *context)
{
	return read_files(path, CONFIG_TO_CHECK, out, complain, context);
}

int config_read_public(const char *path, struct config *out, config_complain complain,
		       void *context)
{
	return read_files(path, CONFIG_PUBLIC, out, complain, context);
}

int config_read_folder(const char *path, struct config *out, config_complain complain,
		       void *context)
{
	return read_files(path, CONFIG_FOLDER, out, complain, context);
}
