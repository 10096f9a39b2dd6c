/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A machine's files: its INI file, and the HAL files that it names, in their order.
 *
 * Words are taken apart as halcmd does it: a comment from # on and blanks between words, both
 * outside of quotes; a line that ends with \ is continued. In a Tcl file, only commands that are
 * written on one line, as in a HAL file, are read.
 */
#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>
#include "halbridge/ini_apply.h"
#include "tools/migrate.h"
#include "tools/pokeysctl.h"

enum { DEPTH = 8 }; /* of HAL files that load each other */

const char *migrate_ini(const struct migrate *machine, const char *section, const char *key)
{
	const struct ini_entry *entry = ini_file_find(&machine->ini, section, key);

	return entry ? entry->value : NULL;
}

/* Section and key of "[SECTION]KEY", "[SECTION](KEY)" or Tcl's "$::SECTION(KEY)"; where it ends. */
static const char *reference(const char *text, char section[INI_FILE_SECTION],
			     char key[INI_FILE_KEY])
{
	static const char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
				      "0123456789_-.";
	const bool is_tcl = *text == '$';
	size_t length;

	text += is_tcl ? 1 + (text[1] == '{') : 1;
	if (is_tcl && strncmp(text, "::", 2) != 0)
		return NULL;
	text += is_tcl ? 2 : 0;
	length = strspn(text, letters);
	if (!length || length >= INI_FILE_SECTION || text[length] != (is_tcl ? '(' : ']'))
		return NULL;
	snprintf(section, INI_FILE_SECTION, "%.*s", (int)length, text);
	text += length + 1;
	text += !is_tcl && *text == '(';
	length = strspn(text, letters);
	if (!length || length >= INI_FILE_KEY)
		return NULL;
	snprintf(key, INI_FILE_KEY, "%.*s", (int)length, text);
	text += length;
	text += *text == ')';
	return text + (is_tcl && *text == '}');
}

/* A word with the values of the INI file in it; NULL = no memory. */
static char *expand(const struct migrate *machine, const char *word)
{
	char section[INI_FILE_SECTION], key[INI_FILE_KEY], *text = NULL;
	size_t length;
	FILE *to = open_memstream(&text, &length);

	if (!to)
		return NULL;
	while (*word) {
		const char *value = NULL, *end = NULL;

		if (*word == '[' || *word == '$')
			end = reference(word, section, key);
		if (end)
			value = migrate_ini(machine, section, key);
		if (value)
			fputs(value, to);
		else
			fputc(*word, to);
		word = value ? end : word + 1;
	}
	return fclose(to) ? NULL : text;
}

/* The next word of a line, as it is written; NULL at the end or at a comment. */
static const char *next_word(const char **rest, size_t *length)
{
	const char *word = *rest + strspn(*rest, " \t\r\n"), *end = word;
	char quote = '\0';

	for (; *end && (quote || !strchr(" \t\r\n#", *end)); end++) {
		if (quote && *end == quote)
			quote = '\0';
		else if (!quote && strchr("\"'", *end))
			quote = *end;
	}
	*rest = end;
	*length = (size_t)(end - word);
	return *length ? word : NULL;
}

/* Without the quotes in it. */
static char *unquote(const char *raw)
{
	char *text = strdup(raw), *to = text;
	char quote = '\0';

	for (const char *from = raw; text && *from; from++) {
		if (quote ? *from == quote : *from == '"' || *from == '\'')
			quote = quote ? '\0' : *from;
		else
			*to++ = *from;
	}
	if (text)
		*to = '\0';
	return text;
}

static int add_word(const struct migrate *machine, struct migrate_line *line, const char *word,
		    size_t length)
{
	char **words = reallocarray(line->word, line->words + 1, sizeof(*words)), *plain;
	char **raws;

	if (!words)
		return -ENOMEM;
	line->word = words;
	raws = reallocarray(line->raw, line->words + 1, sizeof(*raws));
	if (!raws)
		return -ENOMEM;
	line->raw = raws;
	raws[line->words] = strndup(word, length);
	plain = raws[line->words] ? unquote(raws[line->words]) : NULL;
	words[line->words] = plain ? expand(machine, plain) : NULL;
	free(plain);
	if (!words[line->words]) {
		free(raws[line->words]);
		return -ENOMEM;
	}
	line->words++;
	return 0;
}

static void free_line(struct migrate_line *line)
{
	for (size_t i = 0; i < line->words; i++) {
		free(line->word[i]);
		free(line->raw[i]);
	}
	free(line->word);
	free(line->raw);
}

/* `like` says where the line is. Adds nothing if there is no word in it. */
static int add_line(struct migrate *machine, const struct migrate_line *like, const char *text)
{
	struct migrate_line line = *like, *lines;
	const char *word;
	size_t length;
	int result = 0;

	while (!result && (word = next_word(&text, &length))) {
		/* arrows are for people; Tcl ends a command with a semicolon */
		if (*word == '=' || *word == '<') {
			if (length < 4 && word[length - 1] == '>')
				continue;
			if (length == 2 && word[1] == '=')
				continue;
		}
		result = add_word(machine, &line, word,
				  length - (length > 1 && word[length - 1] == ';'));
	}
	lines = result || !line.words ?
			NULL :
			reallocarray(machine->line, machine->lines + 1, sizeof(*lines));
	if (!lines) {
		result = line.words && !result ? -ENOMEM : result;
		free_line(&line);
		return result;
	}
	machine->line = lines;
	lines[machine->lines++] = line;
	return 0;
}

static int read_hal(struct migrate *machine, const struct migrate_line *by, const char *path,
		    unsigned int depth);

/* "source" reads another file in the line's place. */
static int take_line(struct migrate *machine, const struct migrate_line *like, const char *text,
		     unsigned int depth)
{
	const size_t before = machine->lines;
	const int result = add_line(machine, like, text);
	char *path;
	int loaded;

	if (result || machine->lines == before || machine->line[before].words != 2 ||
	    strcmp(machine->line[before].word[0], "source") != 0)
		return result;
	path = strdup(machine->line[before].word[1]);
	if (!path)
		return -ENOMEM;
	loaded = read_hal(machine, like, path, depth + 1);
	free(path);
	return loaded;
}

/* Beside the INI file, as LinuxCNC looks for it. */
static char *whole_path(const struct migrate *machine, const char *path)
{
	const char *home = getenv("HOME");
	char *ini = strdup(machine->ini.path), *text = NULL;
	int made = -1;

	if (*path == '/')
		made = asprintf(&text, "%s", path);
	else if (!strncmp(path, "~/", 2) && home)
		made = asprintf(&text, "%s%s", home, path + 1);
	else if (ini)
		made = asprintf(&text, "%s/%s", dirname(ini), path);
	free(ini);
	return made < 0 ? NULL : text;
}

static int read_stream(struct migrate *machine, size_t file, FILE *stream, unsigned int depth)
{
	struct migrate_line like = { .file = file };
	char *text = NULL, *whole = NULL;
	size_t room = 0, length = 0;
	ssize_t got;
	int result = 0;

	while (!result && (got = getline(&text, &room, stream)) >= 0) {
		char *longer;

		like.last++;
		like.number = whole ? like.number : like.last;
		while (got && strchr("\r\n", text[got - 1]))
			text[--got] = '\0';
		longer = realloc(whole, length + (size_t)got + 2);
		if (!longer) {
			result = -ENOMEM;
			break;
		}
		whole = longer;
		memcpy(whole + length, text, (size_t)got + 1);
		length += (size_t)got;
		if (got && text[got - 1] == '\\') {
			whole[length - 1] = ' ';
			continue;
		}
		result = take_line(machine, &like, whole, depth);
		free(whole);
		whole = NULL;
		length = 0;
	}
	if (!result && whole)
		result = take_line(machine, &like, whole, depth);
	if (!result && ferror(stream))
		result = -EIO;
	free(whole);
	free(text);
	return result;
}

/* A regular file; a pipe would let us wait. */
static FILE *open_file(const char *path)
{
	const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
	struct stat status;
	FILE *stream = NULL;

	if (fd < 0)
		return NULL;
	if (!fstat(fd, &status) && S_ISREG(status.st_mode))
		stream = fdopen(fd, "r");
	if (!stream)
		close(fd);
	return stream;
}

static int add_load(struct migrate *machine, const struct migrate_line *by, const char *path)
{
	struct migrate_load *load = reallocarray(machine->load, machine->loads + 1, sizeof(*load));

	if (!load)
		return -ENOMEM;
	machine->load = load;
	load[machine->loads] = (struct migrate_load){
		.from = by->file,
		.number = by->number,
		.file = machine->files,
		.path = strdup(path),
	};
	return load[machine->loads++].path ? 0 : -ENOMEM;
}

/* `by` is the line that loads it, NULL = the command line names it. */
static int read_hal(struct migrate *machine, const struct migrate_line *by, const char *path,
		    unsigned int depth)
{
	const size_t number = machine->files, length = strlen(path);
	struct migrate_file *file;
	FILE *stream;
	int result;

	if (depth > DEPTH) {
		complain("%s: HAL files load each other without end", path);
		return -ELOOP;
	}
	result = by ? add_load(machine, by, path) : 0;
	file = result ? NULL : reallocarray(machine->file, number + 1, sizeof(*file));
	if (!file)
		return -ENOMEM;
	machine->file = file;
	file[number] = (struct migrate_file){
		.path = whole_path(machine, path),
		.is_tcl = length > 4 && !strcasecmp(path + length - 4, ".tcl"),
	};
	if (!file[number].path)
		return -ENOMEM;
	machine->files++;
	stream = open_file(file[number].path);
	machine->file[number].is_missing = !stream;
	if (!stream)
		return 0;
	result = read_stream(machine, number, stream, depth);
	fclose(stream);
	return result;
}

/* HALFILE may have arguments, and LIB: files are LinuxCNC's own. */
static int read_named(struct migrate *machine, const struct migrate_line *like, const char *value)
{
	size_t length;
	const char *word = next_word(&value, &length);
	char *path = word ? strndup(word, length) : NULL;
	int result = 0;

	if (path && strncmp(path, "LIB:", 4) != 0)
		result = read_hal(machine, like, path, 0);
	free(path);
	return result;
}

static int read_all_hal(struct migrate *machine)
{
	static const char *const order[] = { "HALFILE", "HALCMD", "POSTGUI_HALFILE", "SHUTDOWN" };
	int result = 0;

	for (size_t k = 0; k < sizeof(order) / sizeof(order[0]); k++) {
		for (size_t i = 0; !result && i < machine->ini.count; i++) {
			const struct ini_entry *entry = &machine->ini.entry[i];
			const struct migrate_line like = {
				.file = SIZE_MAX,
				.number = entry->line,
				.last = entry->line,
			};

			if (strcmp(entry->section, "HAL") != 0 || strcmp(entry->key, order[k]) != 0)
				continue;
			result = k == 1 ? take_line(machine, &like, entry->value, 0) :
					  read_named(machine, &like, entry->value);
		}
	}
	return result;
}

/*
 * The component reads these keys itself. As lines, before those of the HAL files, which come
 * later and change what these have set.
 */
static int take_keys(struct migrate *machine)
{
	int result = 0;

	for (size_t i = 0; i < ini_pokeys_key_count; i++) {
		const struct ini_key *key = &ini_pokeys_keys[i];
		const unsigned int most = strstr(key->key, "%u") ? POKEYS_PINS + 1 : 1;

		for (unsigned int n = 0; !result && n < most; n++) {
			struct migrate_line like = { .file = SIZE_MAX, .is_key = true };
			char name[INI_FILE_KEY], pin[INI_FILE_KEY], *text = NULL;
			const struct ini_entry *entry;

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
			snprintf(name, sizeof(name), key->key, n);
			snprintf(pin, sizeof(pin), key->name, n);
#pragma GCC diagnostic pop
			entry = ini_file_find(&machine->ini, "POKEYS", name);
			if (!entry)
				continue;
			like.number = like.last = entry->line;
			if (asprintf(&text, "setp pokeys.0.%s %s", pin, entry->value) < 0)
				return -ENOMEM;
			result = add_line(machine, &like, text);
			free(text);
		}
	}
	return result;
}

/* LinuxCNC follows these lines, and for everybody else they are comments. */
static bool has_includes(const char *path)
{
	FILE *stream = open_file(path);
	char *text = NULL;
	size_t room = 0;
	bool found = false;

	while (stream && !found && getline(&text, &room, stream) >= 0)
		found = !strncmp(text + strspn(text, " \t"), "#INCLUDE", 8);
	free(text);
	if (stream)
		fclose(stream);
	return found;
}

/* Files of the command line are named from the current folder. */
static int read_given(struct migrate *machine, const char *path)
{
	char *here = getcwd(NULL, 0), *whole = NULL;
	int result = -ENOMEM;

	if (*path == '/')
		result = read_hal(machine, NULL, path, 0);
	else if (here && asprintf(&whole, "%s/%s", here, path) >= 0)
		result = read_hal(machine, NULL, whole, 0);
	free(whole);
	free(here);
	return result;
}

int migrate_read(struct migrate *machine, const char *ini, char *const *hal, size_t hals)
{
	struct stat status;
	int result;

	*machine = (struct migrate){ 0 };
	result = !stat(ini, &status) && !S_ISREG(status.st_mode) ?
			 -EINVAL :
			 ini_file_read_all(&machine->ini, ini);
	if (result) {
		complain("%s: %s", ini, result == -EINVAL ? "it is no file" : strerror(-result));
		return result;
	}
	machine->has_includes = has_includes(ini);
	result = take_keys(machine);
	for (size_t i = 0; !result && i < hals; i++)
		result = read_given(machine, hal[i]);
	if (!result && !hals)
		result = read_all_hal(machine);
	if (!result)
		result = migrate_find_uses(machine);
	if (result && result != -ELOOP)
		complain("%s: %s", ini, strerror(-result));
	return result;
}

void migrate_free(struct migrate *machine)
{
	for (size_t i = 0; i < machine->lines; i++)
		free_line(&machine->line[i]);
	for (size_t i = 0; i < machine->files; i++)
		free(machine->file[i].path);
	for (size_t i = 0; i < machine->loads; i++)
		free(machine->load[i].path);
	free(machine->line);
	free(machine->file);
	free(machine->load);
	free(machine->use);
	ini_file_free(&machine->ini);
}
