/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The changed files beside the old ones: mill.hal becomes mill.pokeysd.hal, and what loads it
 * loads that. No file is written over, so nothing is lost, and the old machine still runs. All
 * files are made in memory first. An existing file with the same text is accepted, because
 * several INI files of a machine may share HAL files.
 */
#include <errno.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "tools/migrate.h"
#include "tools/pokeysctl.h"

struct output {
	char *path, *text;
	size_t length;
	bool is_there, is_ours; /* with the same text; made by this run */
};

struct outputs {
	const struct migrate *machine;
	const struct migrate_changes *changes;
	struct output *output;
	size_t count;
};

/* With ".pokeysd" before its ending; NULL = no memory. */
static char *new_name(const char *path, const char *ending)
{
	const char *slash = strrchr(path, '/'), *dot = strrchr(slash ? slash : path, '.');
	const size_t length = dot ? (size_t)(dot - path) : strlen(path);
	char *name;
	const int made = asprintf(&name, "%.*s.pokeysd%s", (int)length, path,
				  ending ? ending : path + length);

	return made < 0 ? NULL : name;
}

static const char *path_of(const struct outputs *outputs, size_t file)
{
	return file == SIZE_MAX ? outputs->machine->ini.path : outputs->machine->file[file].path;
}

/* The file's own lines change, or it loads one whose lines do. */
static bool is_changed(const struct outputs *outputs, size_t file, unsigned int depth)
{
	const struct migrate *machine = outputs->machine;

	for (size_t i = 0; i < outputs->changes->count; i++) {
		const struct migrate_change *change = &outputs->changes->change[i];

		if (!change->by_hand &&
		    (change->file == file ||
		     (change->file != SIZE_MAX && file != SIZE_MAX &&
		      !strcmp(path_of(outputs, change->file), path_of(outputs, file)))))
			return true;
	}
	for (size_t i = 0; depth < 8 && i < machine->loads; i++)
		if (machine->load[i].from == file &&
		    is_changed(outputs, machine->load[i].file, depth + 1))
			return true;
	return false;
}

/* A line as it was, but with the new name of the file that it loads. 0 or -errno. */
static int put_line(const struct outputs *outputs, size_t file, unsigned int number,
		    const char *text, FILE *to)
{
	const struct migrate_load *load = NULL;
	const char *at;
	char *name;

	for (size_t i = 0; !load && i < outputs->machine->loads; i++)
		if (outputs->machine->load[i].from == file &&
		    outputs->machine->load[i].number == number &&
		    is_changed(outputs, outputs->machine->load[i].file, 0))
			load = &outputs->machine->load[i];
	if (!load) {
		fputs(text, to);
		return 0;
	}
	at = strstr(text, load->path);
	name = new_name(load->path, NULL);
	if (!name)
		return -ENOMEM;
	if (at)
		fprintf(to, "%.*s%s%s", (int)(at - text), text, name, at + strlen(load->path));
	else /* the name came from the INI file */
		fprintf(to, "# %s%ssource %s\n", text, strchr(text, '\n') ? "" : "\n", name);
	free(name);
	return 0;
}

static void put_changes(const struct outputs *outputs, size_t file, unsigned int number, int what,
			FILE *to)
{
	for (size_t i = 0; i < outputs->changes->count; i++) {
		const struct migrate_change *change = &outputs->changes->change[i];
		const unsigned int at = what == MIGRATE_AFTER ? change->last : change->number;
		const char *rest = change->text;

		if (change->file != file || at != number || (int)change->what != what ||
		    change->by_hand)
			continue;
		fprintf(to, "# pokeysctl migrate: %s\n", change->why);
		while (*rest) {
			const int length = (int)strcspn(rest, "\n");

			fprintf(to, "%s%.*s\n", change->is_command ? "HALCMD = " : "", length,
				rest);
			rest += length + (rest[length] == '\n');
		}
	}
}

/* The line belongs to a command that goes, or is replaced. */
static bool goes(const struct outputs *outputs, size_t file, unsigned int number)
{
	for (size_t i = 0; i < outputs->changes->count; i++) {
		const struct migrate_change *change = &outputs->changes->change[i];

		if (change->file == file && number >= change->number && number <= change->last &&
		    !change->by_hand &&
		    (change->what == MIGRATE_REMOVE || change->what == MIGRATE_REPLACE))
			return true;
	}
	return false;
}

static int put_file(const struct outputs *outputs, size_t file, FILE *to)
{
	FILE *from = fopen(path_of(outputs, file), "re");
	char *text = NULL;
	size_t room = 0;
	int result = from ? 0 : -errno;

	for (unsigned int number = 1; !result && getline(&text, &room, from) >= 0; number++) {
		put_changes(outputs, file, number, MIGRATE_BEFORE, to);
		if (goes(outputs, file, number))
			fprintf(to, "# %s", text);
		else
			result = put_line(outputs, file, number, text, to);
		if (!strchr(text, '\n'))
			fputc('\n', to);
		put_changes(outputs, file, number, MIGRATE_REPLACE, to);
		put_changes(outputs, file, number, MIGRATE_AFTER, to);
	}
	if (!result && ferror(from))
		result = -EIO;
	free(text);
	if (from)
		fclose(from);
	return result;
}

/* The text of a file that is to be, or of pokeysd.conf. 0 or -errno. */
static int make(struct outputs *outputs, size_t file, bool is_conf)
{
	struct output *output = reallocarray(outputs->output, outputs->count + 1, sizeof(*output));
	FILE *to;
	int result;

	if (!output)
		return -ENOMEM;
	outputs->output = output;
	output += outputs->count++;
	*output = (struct output){ 0 };
	output->path = new_name(path_of(outputs, file), is_conf ? ".conf" : NULL);
	to = open_memstream(&output->text, &output->length);
	if (!to || !output->path) {
		if (to)
			fclose(to);
		return -ENOMEM;
	}
	result = is_conf ? migrate_conf(outputs->machine, to) : put_file(outputs, file, to);
	return fclose(to) && !result ? -ENOMEM : result;
}

/* Whether the file may be written: it is not there, or has the same text. */
static bool is_free(struct output *output)
{
	FILE *file = fopen(output->path, "re");
	char *text = malloc(output->length + 1);

	if (!file && errno == ENOENT) {
		free(text);
		return true;
	}
	output->is_there = file && text &&
			   fread(text, 1, output->length + 1, file) == output->length &&
			   !memcmp(text, output->text, output->length);
	if (!output->is_there)
		complain("%s: %s", output->path,
			 file ? "the file exists with other contents, so nothing was written; "
				"move or delete it" :
				strerror(errno));
	if (file)
		fclose(file);
	free(text);
	return output->is_there;
}

static bool write_one(struct output *output)
{
	FILE *to = fopen(output->path, "wxe");
	bool written;

	output->is_ours = to != NULL;
	written = to && fwrite(output->text, 1, output->length, to) == output->length;
	if ((to && fclose(to)) || !written) {
		complain("%s: %s", output->path, strerror(errno));
		return false;
	}
	printf("written: %s\n", output->path);
	return true;
}

static bool is_unchanged(const struct output *output)
{
	printf("unchanged: %s\n", output->path);
	return true;
}

/* All of them or none. */
static int write_all(struct outputs *outputs)
{
	bool good = true;

	for (size_t i = 0; i < outputs->count; i++)
		good = is_free(&outputs->output[i]) && good;
	for (size_t i = 0; good && i < outputs->count; i++)
		good = outputs->output[i].is_there ? is_unchanged(&outputs->output[i]) :
						     write_one(&outputs->output[i]);
	for (size_t i = 0; !good && i < outputs->count; i++)
		if (outputs->output[i].is_ours)
			unlink(outputs->output[i].path);
	return good ? 0 : -EEXIST;
}

static int make_all(struct outputs *outputs)
{
	const struct migrate *machine = outputs->machine;
	int result = make(outputs, SIZE_MAX, true);

	if (!result)
		result = make(outputs, SIZE_MAX, false);
	for (size_t i = 0; !result && i < machine->files; i++) {
		bool is_first = true;

		for (size_t k = 0; k < i && is_first; k++)
			is_first = strcmp(machine->file[i].path, machine->file[k].path) != 0;
		if (is_first && !machine->file[i].is_missing && is_changed(outputs, i, 0))
			result = make(outputs, i, false);
	}
	return result;
}

int migrate_write(const struct migrate *machine, const struct migrate_changes *changes)
{
	struct outputs outputs = { .machine = machine, .changes = changes };
	int result = make_all(&outputs);

	if (result)
		complain("nothing was written: %s", strerror(-result));
	else
		result = write_all(&outputs);
	for (size_t i = 0; i < outputs.count; i++) {
		free(outputs.output[i].path);
		free(outputs.output[i].text);
	}
	free(outputs.output);
	return result;
}
