// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The files of pokeysctl doctor --fix: how they are written, recognized and removed. All
 * begin with the same words, so --undo never removes another program's file. Their comments keep
 * the kernel's previous values, so nothing else has to be stored.
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
#define BOOT "# boot: "
#define MADE "# The folder was made for this file."

void fix_path(const struct doctor *doctor, const struct fix_row *row, char path[FIX_PATH])
{
	if (row->kind == FIX_CONF) /* with the root */
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
			fprintf(to, "%skernel.%s = %s\n", indent, value->path + strlen(FIX_SYSCTLS),
				value->value);
	}
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

/* Only what a row may have written. */
static bool is_path_of_ours(const char *path)
{
	static const char *const roots[] = {
		"/sys/devices/system/cpu/cpu",
		"/proc/irq/",
		FIX_SYSCTLS,
	};

	for (size_t i = 0; i < sizeof(roots) / sizeof(roots[0]); i++)
		if (!strncmp(path, roots[i], strlen(roots[i])))
			return !strstr(path, "..");
	return false;
}

/* A line "# before: PATH VALUE", of which the value may have blanks; false if it is none. */
static bool take_before(const char *line, struct fix_value *old)
{
	const size_t length = strcspn(line, "\n");
	const char *path = line + strlen(BEFORE), *value;

	if (strncmp(line, BEFORE, strlen(BEFORE)) != 0)
		return false;
	value = memchr(path, ' ', (size_t)(line + length - path));
	if (!value || ++value == line + length || value - path > FIX_VALUE_PATH ||
	    line + length - value >= FIX_BEFORE)
		return false;
	snprintf(old->path, sizeof(old->path), "%.*s", (int)(value - 1 - path), path);
	snprintf(old->before, sizeof(old->before), "%.*s", (int)(line + length - value), value);
	return is_path_of_ours(old->path);
}

/* The next line of a text that has a value from before, from *at on. */
static bool next_before(const char **at, struct fix_value *old)
{
	while (**at) {
		const char *line = *at;

		*at += strcspn(line, "\n");
		*at += **at == '\n';
		if (take_before(line, old))
			return true;
	}
	return false;
}

/* The number of its value for this path; as many as it has: none. */
static size_t find_value(const struct fix_change *change, const char *path)
{
	size_t i = 0;

	while (i < change->values && strcmp(change->value[i].path, path) != 0)
		i++;
	return i;
}

static bool boot_of(const char *root, char id[64])
{
	return probe_text(root, id, 64, "/proc/sys/kernel/random/boot_id");
}

/* The numbers of interrupts are those of one boot. */
static void put_boot(const char *root, FILE *to)
{
	char id[64];

	if (boot_of(root, id))
		fprintf(to, BOOT "%s\n", id);
}

static bool is_of_this_boot(const char *root, const char *text)
{
	char id[64];
	const char *boot = strstr(text, BOOT);

	return !boot || (boot_of(root, id) && !strncmp(boot + strlen(BOOT), id, strlen(id)));
}

/* Values of an existing file that this change does not have: these interrupts stay elsewhere. */
static void put_earlier(const struct doctor *doctor, const struct fix_change *change, FILE *to)
{
	char *text = read_ours(doctor, change->row);
	const char *at = text;
	struct fix_value old;

	while (text && is_of_this_boot(doctor->root, text) && next_before(&at, &old))
		if (find_value(change, old.path) == change->values)
			fprintf(to, BEFORE "%s %s\n", old.path, old.before);
	free(text);
}

/* The file as it will be, with comments. */
static void print_file(const struct fix_plan *plan, const struct fix_change *change, FILE *to)
{
	const char *config = plan->doctor->config;

	fprintf(to, OURS " To undo it: sudo pokeysctl doctor --undo%s%s\n# %s\n",
		config ? " --config " : "", config ? config : "", change->row->why);
	for (size_t i = 0; i < FIX_CHECKS && change->row->check[i]; i++)
		for (size_t f = 0; f < plan->report->count; f++) {
			const struct doctor_finding *finding = &plan->report->finding[f];

			if (!strcmp(finding->check, change->row->check[i]) && fix_is_bad(finding))
				fprintf(to, "# %s: %s\n", finding->check, finding->why);
		}
	if (change->row->kind == FIX_KERNEL) {
		put_boot(plan->doctor->root, to);
		put_earlier(plan->doctor, change, to);
	}
	for (size_t i = 0; i < change->values; i++)
		fprintf(to, BEFORE "%s %s\n", change->value[i].path, change->value[i].before);
	fix_print_lines(change, "", to);
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
	const char *at = text;
	struct fix_value old;

	if (!text)
		return;
	while (is_of_this_boot(doctor->root, text) && next_before(&at, &old)) {
		const size_t i = find_value(change, old.path);

		if (i < change->values)
			memcpy(change->value[i].before, old.before, sizeof(old.before));
	}
	change->made_folder = strstr(text, MADE);
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

static void restore(const struct doctor *doctor, const struct fix_value *old)
{
	const int error = put_value(doctor->root, old->path, old->before);

	if (error)
		printf("  %s: cannot be set back to %s now (%s); the old value returns at the next "
		       "boot\n",
		       old->path, old->before, strerror(-error));
}

/* The folder of a file, if there is none. 1 = it was made, 0, or -errno. */
static int make_folder(const char *path)
{
	char folder[FIX_PATH];

	snprintf(folder, sizeof(folder), "%.*s", (int)(strrchr(path, '/') - path), path);
	if (!mkdir(folder, 0755))
		return chmod(folder, 0755) ? -errno : 1; /* whatever the umask is */
	return errno == EEXIST ? 0 : -errno;
}

/* Write a new file beside the old one and rename it, so the path never holds half a file. */
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
	print_file(plan, change, to);
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

/* What the kernel gets back that the new file does not set any more: of another core, say. */
static void put_back_others(const struct doctor *doctor, const struct fix_change *change)
{
	char *text = change->row->kind == FIX_KERNEL ? NULL : read_ours(doctor, change->row);
	const char *at = text;
	struct fix_value old;

	while (text && next_before(&at, &old))
		if (find_value(change, old.path) == change->values)
			restore(doctor, &old);
	free(text);
}

int fix_write(const struct fix_plan *plan, const struct fix_change *change)
{
	char path[FIX_PATH];
	int result;

	fix_path(plan->doctor, change->row, path);
	if (!change->is_there) {
		put_back_others(plan->doctor, change);
		result = put_file(plan, change, path);
		if (result) {
			complain("%s: %s", path, strerror(-result));
			return result;
		}
		printf("written: %s\n", path);
	}
	for (size_t i = 0; i < change->values; i++) {
		const struct fix_value *value = &change->value[i];
		const int error = put_value(plan->doctor->root, value->path, value->value);

		/* an interrupt that the kernel does not let go is moved at the next boot */
		if (error)
			printf("  %s: cannot be set to %s now (%s); it takes effect at the next "
			       "boot\n",
			       value->path, value->value, strerror(-error));
	}
	return 0;
}

int fix_take_back(const struct doctor *doctor, const struct fix_row *row)
{
	char path[FIX_PATH], *text = read_ours(doctor, row);
	const char *at = text;
	struct fix_value old;
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
	made = strstr(text, MADE);
	while (is_of_this_boot(doctor->root, text) && next_before(&at, &old))
		restore(doctor, &old);
	free(text);
	*strrchr(path, '/') = '\0';
	if (made)
		rmdir(path); /* unless there is something else in it */
	return 0;
}
