// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The files of pokeysctl doctor --fix: how they are written, known again and taken back. They
 * begin with the same words, by which --undo tells them from a file of somebody else. What the
 * kernel had before is in their comments, so nothing else has to be kept.
 */
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "daemon/control/config.h"
#include "tools/doctor_fix.h"

#define OURS "# Written by pokeysctl doctor --fix."
#define BEFORE "# before: "
#define MADE "# The folder was made for this file."

void fix_path(const struct doctor *doctor, const struct fix_row *row, char path[FIX_PATH])
{
	if (row->kind == FIX_CONF)	/* with the root */
		snprintf(path, FIX_PATH, "%s" CONFIG_FOLDER_ENDING "/%s", doctor->plan.path,
			 row->path);
	else
		snprintf(path, FIX_PATH, "%s%s", doctor->root, row->path);
}

void fix_print_lines(const struct fix_change *change, const char *indent, FILE *to)
{
	const struct fix_value *value = change->value;

	if (change->row->kind == FIX_CONF)
		fprintf(to, "%s[daemon]\n%s%s\n", indent, indent, change->line);
	else if (change->row->kind == FIX_KERNEL)
		fprintf(to, "%sGRUB_CMDLINE_LINUX=\"$GRUB_CMDLINE_LINUX %s\"\n", indent,
			change->line);
	for (size_t i = 0; i < change->values; i++, value++) {
		if (change->row->kind == FIX_TMPFILES)
			fprintf(to, "%sw %s - - - - %s\n", indent, value->path, value->value);
		else if (change->row->kind == FIX_SYSCTL)
			fprintf(to, "%skernel.%s = %s\n", indent,
				value->path + strlen(FIX_SYSCTLS), value->value);
	}
}

void fix_print_file(const struct fix_plan *plan, const struct fix_change *change, FILE *to)
{
	fprintf(to, OURS " To take it back: sudo pokeysctl doctor --undo\n# %s\n",
		change->row->why);
	for (size_t i = 0; i < FIX_CHECKS && change->row->check[i]; i++)
		for (size_t f = 0; f < plan->report->count; f++) {
			const struct doctor_finding *finding = &plan->report->finding[f];

			if (!strcmp(finding->check, change->row->check[i]) &&
			    fix_is_bad(finding))
				fprintf(to, "# %s: %s\n", finding->check, finding->why);
		}
	for (size_t i = 0; i < change->values; i++)
		fprintf(to, BEFORE "%s %s\n", change->value[i].path, change->value[i].before);
	fix_print_lines(change, "", to);
}

/* The text of a row's file, NULL if there is none or it is not ours. To be freed. */
static char *read_ours(const struct doctor *doctor, const struct fix_row *row)
{
	enum { SIZE = 1 << 16 };
	char path[FIX_PATH], *text = malloc(SIZE);

	fix_path(doctor, row, path);
	if (text && probe_text("", text, SIZE, "%s", path) && !strncmp(text, OURS, strlen(OURS)))
		return text;
	free(text);
	return NULL;
}

bool fix_is_ours(const struct doctor *doctor, const struct fix_row *row)
{
	char *text = read_ours(doctor, row);

	free(text);
	return text;
}

/* A line "# before: PATH VALUE"; false if it is none. */
static bool take_before(const char *line, char path[96], char value[64])
{
	return sscanf(line, BEFORE "%95s %63[^\n]", path, value) == 2;
}

static void keep_before(const char *line, struct fix_change *change)
{
	char path[96], value[64];

	for (size_t i = 0; take_before(line, path, value) && i < change->values; i++)
		if (!strcmp(change->value[i].path, path))
			memcpy(change->value[i].before, value, sizeof(value));
}

/* The lines that are no comments, for comparison. */
static bool says_the_same(const char *text, const struct fix_change *change)
{
	char *lines = NULL, *old = NULL;
	size_t size, old_size;
	FILE *to = open_memstream(&lines, &size), *old_to = open_memstream(&old, &old_size);
	bool same = false;

	if (to && old_to) {
		fix_print_lines(change, "", to);
		for (; *text; text += strcspn(text, "\n"), text += *text == '\n')
			if (*text != '#')
				fprintf(old_to, "%.*s\n", (int)strcspn(text, "\n"), text);
	}
	if (to && old_to && !fflush(to) && !fflush(old_to))
		same = !strcmp(lines, old);
	if (to)
		fclose(to);
	if (old_to)
		fclose(old_to);
	free(lines);
	free(old);
	return same;
}

void fix_compare(const struct doctor *doctor, struct fix_change *change)
{
	char *text = read_ours(doctor, change->row);

	if (!text)
		return;
	for (const char *line = text; line; line = strchr(line, '\n')) {
		line += *line == '\n';
		keep_before(line, change);
		if (!strncmp(line, MADE, strlen(MADE)))
			change->made_folder = true;
	}
	change->is_there = says_the_same(text, change);
	free(text);
}

static int put_value(const char *root, const char *path, const char *value)
{
	char whole[FIX_PATH];
	const size_t length = strlen(value);
	ssize_t written;
	int fd, error = 0;

	snprintf(whole, sizeof(whole), "%s%s", root, path);
	fd = open(whole, O_WRONLY | O_TRUNC | O_CLOEXEC);
	if (fd < 0)
		return -errno;
	written = write(fd, value, length);
	if (written < 0 || (size_t)written != length)
		error = written < 0 ? errno : EIO;
	if (close(fd) && !error)
		error = errno;
	return -error;
}

/* The folder of a file, if there is none. 1 = it was made, 0, or -errno. */
static int make_folder(const char *path)
{
	char folder[FIX_PATH];

	snprintf(folder, sizeof(folder), "%.*s", (int)(strrchr(path, '/') - path), path);
	if (!mkdir(folder, 0755))
		return 1;
	return errno == EEXIST ? 0 : -errno;
}

/* Beside it first, then in its place, so there is never half a file. */
static int put_file(const struct fix_plan *plan, const struct fix_change *change, const char *path)
{
	char beside[FIX_PATH + 8];
	const int made = make_folder(path);
	int fd, error;
	FILE *to;

	if (made < 0)
		return made;
	snprintf(beside, sizeof(beside), "%s.new", path);
	fd = open(beside, O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0644);
	to = fd < 0 ? NULL : fdopen(fd, "w");
	if (!to)
		return -errno;
	fchmod(fd, 0644);
	fix_print_file(plan, change, to);
	if (made || change->made_folder)
		fputs(MADE "\n", to);
	error = fflush(to) || fsync(fd) ? errno : 0;
	if (fclose(to) && !error)
		error = errno;
	if (!error && rename(beside, path))
		error = errno;
	if (error)
		unlink(beside);
	return -error;
}

int fix_write(const struct fix_plan *plan, const struct fix_change *change)
{
	char path[FIX_PATH];
	int result;

	fix_path(plan->doctor, change->row, path);
	result = put_file(plan, change, path);
	if (result) {
		complain("%s: %s", path, strerror(-result));
		return result;
	}
	printf("written: %s\n", path);
	for (size_t i = 0; i < change->values; i++) {
		const struct fix_value *value = &change->value[i];
		const int error = put_value(plan->doctor->root, value->path, value->value);

		/* an interrupt that the kernel does not let go is moved at the next boot */
		if (error)
			printf("  not yet in effect, only after the next boot: %s = %s (%s)\n",
			       value->path, value->value, strerror(-error));
	}
	return 0;
}

/* Returns whether the folder was made for it. */
static bool put_back(const struct doctor *doctor, const char *text)
{
	char path[96], value[64];
	bool made = false;

	for (const char *line = text; line; line = strchr(line, '\n')) {
		int error;

		line += *line == '\n';
		made = made || !strncmp(line, MADE, strlen(MADE));
		if (!take_before(line, path, value))
			continue;
		error = put_value(doctor->root, path, value);
		if (error)
			printf("  not yet as before, only after the next boot: %s = %s (%s)\n",
			       path, value, strerror(-error));
	}
	return made;
}

int fix_take_back(const struct doctor *doctor, const struct fix_row *row)
{
	char path[FIX_PATH], *text = read_ours(doctor, row);
	bool made;

	fix_path(doctor, row, path);
	if (!text)
		return 0;
	if (unlink(path)) {
		const int error = errno;

		complain("%s: %s", path, strerror(error));
		free(text);
		return -error;
	}
	printf("removed: %s\n", path);
	made = put_back(doctor, text);
	free(text);
	*strrchr(path, '/') = '\0';
	if (made)
		rmdir(path);		/* unless there is something else in it */
	return 0;
}
