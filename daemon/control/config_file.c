// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * From text to raw sections, every fault with its line. A second text continues the first: its
 * sections may be the same, and its keys of [daemon] take the place of earlier ones. Keys of a
 * device may not be repeated: most are lists, and it would be unclear whether the second list
 * replaces or extends the first.
 *
 * libinih splits "key = value"; what it would swallow is caught before it gets
 * a line, in read_line():
 *  - a line longer than its buffer goes on as a line of its own;
 *  - an indented line continues the value above it;
 *  - only ';' begins a comment after a value, so '#' would become part of it;
 *  - junk behind a ']' vanishes, a section without keys is never reported, and
 *    so neither a misspelt empty section nor a device without an address is;
 *  - a second section of one name is silently merged with the first;
 *  - of several malformed lines only the first has its number told.
 * One line is handed over at a time, so the line number is always ours.
 *
 * All faults are collected: somebody who mends a file wants the whole list.
 */
#include <ini.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "daemon/control/config_key.h"
#include "usage/printable.h"

/* What a name is written to is the section as well. */
_Static_assert(!offsetof(struct config_raw_device, name) &&
		       !offsetof(struct config_raw_heater, name) &&
		       !offsetof(struct config_raw_servo, name),
	       "sections begin with their name");

enum { SHOWN_MAX = 60 };

struct reading {
	struct config_file *file;
	const char *text, *end;
	uint32_t line;             /* place of what inih has now */
	bool awaiting;             /* inih has a line that must become a key */
	char shown[SHOWN_MAX + 4]; /* that line, for a complaint */
	/* the section we are in; raw NULL = keys are skipped, its header was at fault */
	enum config_section section;
	char title[48];
	void *raw;
	struct config_lines *lines;
};

static uint32_t line_of(uint32_t place)
{
	return place & ((1u << CONFIG_LINE_BITS) - 1);
}

static bool same_text(uint32_t place, uint32_t other)
{
	return place && other && place >> CONFIG_LINE_BITS == other >> CONFIG_LINE_BITS;
}

const char *config_where(const struct config_file *file, uint32_t place, uint32_t from,
			 char where[CONFIG_WHERE])
{
	if (same_text(place, from))
		snprintf(where, CONFIG_WHERE, "line %u", line_of(place));
	else
		snprintf(where, CONFIG_WHERE, "%s:%u", file->text[place >> CONFIG_LINE_BITS].name,
			 line_of(place));
	return where;
}

static void tell(const struct config_file *file, uint32_t place, const char *format,
		 va_list arguments) __attribute__((format(printf, 3, 0)));

static void tell(const struct config_file *file, uint32_t place, const char *format,
		 va_list arguments)
{
	const char *name = file->text[place >> CONFIG_LINE_BITS].name;
	const uint32_t line = line_of(place);
	char text[512], whole[1024];

	vsnprintf(text, sizeof(text), format, arguments);
	if (line)
		snprintf(whole, sizeof(whole), "%s:%u: %s", name, line, text);
	else
		snprintf(whole, sizeof(whole), "%s: %s", name, text);
	usage_printable(whole);
	file->complain(file->context, whole);
}

void config_note(const struct config_file *file, uint32_t place, const char *format, ...)
{
	va_list arguments;

	va_start(arguments, format);
	tell(file, place, format, arguments);
	va_end(arguments);
}

void config_fault(struct config_file *file, uint32_t place, const char *format, ...)
{
	va_list arguments;

	if (file->faults++ >= CONFIG_FAULTS_MAX)
		return;
	va_start(arguments, format);
	tell(file, place, format, arguments);
	va_end(arguments);
	if (file->faults == CONFIG_FAULTS_MAX)
		file->complain(file->context, "too many faults, the rest is not shown");
}

static void shorten(char out[SHOWN_MAX + 4], const char *text)
{
	snprintf(out, SHOWN_MAX + 4, "%.*s%s", SHOWN_MAX, text,
		 strlen(text) > SHOWN_MAX ? "..." : "");
}

/* inih has had its line: did a key come of it? */
static void settle(struct reading *r)
{
	if (r->awaiting)
		config_fault(r->file, r->line, "\"%s\" is neither [section] nor key = value",
			     r->shown);
	r->awaiting = false;
}

static bool name_is_good(const char *name)
{
	size_t length = strlen(name);

	return length && length < POKEYS_SHM_NAME_MAX &&
	       length == strspn(name, "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
				      "0123456789_-");
}

static void enter_daemon(struct reading *r)
{
	struct config_file *file = r->file;
	struct config_lines *lines = &file->daemon_lines;

	if (same_text(lines->last, r->line)) {
		config_fault(file, r->line, "[daemon] was there before, at line %u",
			     line_of(lines->last));
		return;
	}
	r->section = CONFIG_DAEMON;
	r->raw = &file->daemon;
	r->lines = lines;
	lines->last = r->line;
	if (!lines->section)
		lines->section = r->line;
	snprintf(r->title, sizeof(r->title), "[daemon]");
}

/* Sections of a kind, each with a name of its own; `raw` begins with the name of the first one. */
struct kind {
	enum config_section section;
	const char *word;
	char *raw;
	size_t stride;
	struct config_lines *lines;
	uint32_t *count, most;
};

/* An earlier text's section, or a new one. UINT32_MAX: it was complained about. */
static uint32_t number_of(struct reading *r, const struct kind *kind, const char *name)
{
	if (!name_is_good(name)) {
		config_fault(r->file, r->line,
			     "[%s %s]: a %s's name has 1 to %d of the "
			     "characters A-Z a-z 0-9 _ -",
			     kind->word, name, kind->word, POKEYS_SHM_NAME_MAX - 1);
		return UINT32_MAX;
	}
	for (uint32_t i = 0; i < *kind->count; i++) {
		if (strcmp(kind->raw + i * kind->stride, name) != 0)
			continue;
		if (!same_text(kind->lines[i].last, r->line))
			return i;
		config_fault(r->file, r->line, "[%s %s] was there before, at line %u", kind->word,
			     name, line_of(kind->lines[i].last));
		return UINT32_MAX;
	}
	if (*kind->count < kind->most)
		return *kind->count;
	config_fault(r->file, r->line, "[%s %s]: too many %ss, at most %u are allowed", kind->word,
		     name, kind->word, kind->most);
	return UINT32_MAX;
}

static void enter_kind(struct reading *r, const struct kind *kind, const char *name)
{
	const uint32_t number = number_of(r, kind, name);
	char *raw;

	if (number == UINT32_MAX)
		return;
	raw = kind->raw + number * kind->stride;
	r->section = kind->section;
	r->raw = raw;
	r->lines = &kind->lines[number];
	r->lines->last = r->line;
	snprintf(r->title, sizeof(r->title), "[%s %s]", kind->word, name);
	if (number < *kind->count)
		return;
	++*kind->count;
	r->lines->section = r->line;
	config_defaults(kind->section, raw);
	snprintf(raw, POKEYS_SHM_NAME_MAX, "%s", name);
}

static void enter_device(struct reading *r, const char *name)
{
	struct config_file *file = r->file;

	enter_kind(r,
		   &(struct kind){
			   .section = CONFIG_DEVICE,
			   .word = "device",
			   .raw = (char *)file->device,
			   .stride = sizeof(file->device[0]),
			   .lines = file->device_lines,
			   .count = &file->devices,
			   .most = TRANSPORT_CHANNELS,
		   },
		   name);
}

static void enter_heater(struct reading *r, const char *name)
{
	struct config_file *file = r->file;

	enter_kind(r,
		   &(struct kind){
			   .section = CONFIG_HEATER,
			   .word = "heater",
			   .raw = (char *)file->heater,
			   .stride = sizeof(file->heater[0]),
			   .lines = file->heater_lines,
			   .count = &file->heaters,
			   .most = CONFIG_HEATERS,
		   },
		   name);
}

static void enter_servo(struct reading *r, const char *name)
{
	struct config_file *file = r->file;

	enter_kind(r,
		   &(struct kind){
			   .section = CONFIG_SERVO,
			   .word = "servo",
			   .raw = (char *)file->servo,
			   .stride = sizeof(file->servo[0]),
			   .lines = file->servo_lines,
			   .count = &file->servos,
			   .most = CONFIG_SERVOS,
		   },
		   name);
}

/* A line that begins with '['; it stays as it is for inih. */
static void enter_section(struct reading *r, const char *line)
{
	char name[64];
	size_t length = strcspn(line, "]");

	r->raw = NULL;
	snprintf(r->title, sizeof(r->title), "[?]");
	if (line[length] != ']' || line[length + 1] || length >= sizeof(name)) {
		config_fault(r->file, r->line,
			     "\"%s\" is not a section; [daemon], "
			     "[device NAME], [heater NAME] and [servo NAME] are",
			     r->shown);
		return;
	}
	memcpy(name, line + 1, length - 1);
	name[length - 1] = '\0';
	if (!strcmp(name, "daemon"))
		enter_daemon(r);
	else if (!strncmp(name, "device ", 7))
		enter_device(r, name + 7 + strspn(name + 7, " "));
	else if (!strncmp(name, "heater ", 7))
		enter_heater(r, name + 7 + strspn(name + 7, " "));
	else if (!strncmp(name, "servo ", 6))
		enter_servo(r, name + 6 + strspn(name + 6, " "));
	else
		config_fault(r->file, r->line,
			     "there is no section [%s]; sections are [daemon], "
			     "[device NAME], [heater NAME] and [servo NAME]",
			     name);
}

/* Cut comment and blanks off a line of the file; NULL and a complaint if it cannot be one. */
static char *trim(struct reading *r, char *line, size_t length)
{
	for (size_t i = 0; i < length; i++) {
		bool starts = !i || line[i - 1] == ' ' || line[i - 1] == '\t';

		if (starts && (line[i] == ';' || line[i] == '#'))
			length = i;
	}
	while (length && strchr(" \t\r", line[length - 1]) && line[length - 1])
		length--;
	line[length] = '\0';
	for (size_t i = 0; i < length; i++) {
		if (((unsigned char)line[i] < 0x20 && line[i] != '\t') || line[i] == 0x7f) {
			config_fault(r->file, r->line, "there is a control character in the line");
			return NULL;
		}
	}
	return line + strspn(line, " \t");
}

/* The next line of the text into `buffer`: 1, or 0 at the end. Too long ones are cut and told. */
static int take_line(struct reading *r, char *buffer, size_t size, size_t *length)
{
	const char *end;

	if (r->text >= r->end)
		return 0;
	end = memchr(r->text, '\n', (size_t)(r->end - r->text));
	if (!end)
		end = r->end;
	*length = (size_t)(end - r->text);
	if (*length < size)
		memcpy(buffer, r->text, *length);
	r->text = end < r->end ? end + 1 : end;
	r->line++;
	return 1;
}

/* inih's reader: one useful line at a time, ended by a newline. */
static char *read_line(char *out, int size, void *stream)
{
	struct reading *r = stream;
	char buffer[4096];
	size_t length, limit = (size_t)size - 3;

	settle(r);
	while (take_line(r, buffer, sizeof(buffer) - 1, &length)) {
		char *line = NULL;

		if (length < sizeof(buffer) - 1) {
			line = trim(r, buffer, length);
			if (!line || !*line)
				continue;
		}
		if (!line || strlen(line) > limit) {
			config_fault(r->file, r->line,
				     "the line is too long, at most %zu "
				     "characters are allowed",
				     limit);
			continue;
		}
		shorten(r->shown, line);
		if (*line == '[')
			enter_section(r, line);
		else
			r->awaiting = true;
		snprintf(out, (size_t)size, "%s\n", line);
		return out;
	}
	return NULL;
}

static void take_key(struct reading *r, const char *name, const char *value)
{
	char allowed[256], why[256], shown[SHOWN_MAX + 4], where[CONFIG_WHERE];
	const struct config_key *key;
	const char *wrong;
	uint32_t index, *seen;
	size_t number;

	shorten(shown, value);
	key = config_find(r->section, name, &index, why, sizeof(why));
	if (!key) {
		config_fault(r->file, r->line, "%s: %s", r->title, why);
		return;
	}
	number = config_key_number(key);
	seen = &r->lines->key[number][index];
	if (same_text(*seen, r->line) || (*seen && r->section != CONFIG_DAEMON)) {
		config_fault(r->file, r->line, "%s: %s was there before, at %s", r->title, name,
			     config_where(r->file, *seen, r->line, where));
		return;
	}
	*seen = r->line;
	if (r->section == CONFIG_DAEMON)
		r->lines->faulty[number] = false;
	wrong = *value ? config_store(key, index, value, r->raw) : "has no value";
	if (!wrong)
		return;
	r->lines->faulty[number] = true;
	config_allowed(key, allowed, sizeof(allowed));
	if (*value)
		config_fault(r->file, r->line, "%s: %s: \"%s\" %s; allowed: %s", r->title, name,
			     shown, wrong, allowed);
	else
		config_fault(r->file, r->line, "%s: %s %s; allowed: %s", r->title, name, wrong,
			     allowed);
}

/* inih's handler. */
static int handle(void *user, const char *section, const char *name, const char *value)
{
	struct reading *r = user;

	(void)section; /* it would be cut off at 50 characters; ours is not */
	r->awaiting = false;
	if (!*name)
		config_fault(r->file, r->line, "there is no key before the \"=\"");
	else if (!*r->title)
		config_fault(r->file, r->line,
			     "%s stands before any section; [daemon] or "
			     "[device NAME] comes first",
			     name);
	else if (r->raw)
		take_key(r, name, value);
	return 1;
}

static void no_complaint(void *context, const char *line)
{
	(void)context;
	(void)line;
}

/* Of a file with faults in it nobody knows what was meant; of this one key, it is known. */
static void judge_folder(struct config_file *file, struct config *out, config_complain complain,
			 void *context)
{
	uint32_t index;
	const struct config_key *key = config_find(CONFIG_DAEMON, "runtime-directory", &index, NULL,
						   0);
	const bool faulty = file->daemon_lines.faulty[config_key_number(key)];

	file->complain = complain;
	file->context = context;
	file->faults = 0;
	if (faulty)
		config_fault(file, file->daemon_lines.key[config_key_number(key)][index],
			     "[daemon]: no folder can be read from runtime-directory; pokeysd "
			     "--check-config says why");
	else
		memcpy(out->runtime_directory, file->daemon.runtime_directory,
		       sizeof(out->runtime_directory));
}

/* One text, into what earlier ones have left. */
static void read_text(struct config_file *file, uint32_t number)
{
	const struct config_text *text = &file->text[number];
	struct reading reading = {
		.file = file,
		.text = text->text,
		.end = text->text + text->length,
		.line = number << CONFIG_LINE_BITS,
	};

	if (text->length >= 3 && !memcmp(text->text, "\xef\xbb\xbf", 3))
		reading.text += 3;
	if (ini_parse_stream(read_line, &reading, handle, &reading) < 0)
		config_fault(file, number << CONFIG_LINE_BITS,
			     "no memory to read the configuration");
	settle(&reading);
}

int config_parse_texts(const struct config_text *text, size_t texts, enum config_reader reader,
		       struct config *out, config_complain complain, void *context)
{
	struct config_file *file = calloc(1, sizeof(*file));
	int faults;

	if (!file) {
		complain(context, "no memory to read the configuration");
		return 1;
	}
	file->text = text;
	file->complain = reader == CONFIG_FOLDER ? no_complaint : complain;
	file->context = context;
	file->here = reader == CONFIG_TO_CHECK;
	file->public = reader == CONFIG_PUBLIC;
	config_defaults(CONFIG_DAEMON, &file->daemon);
	for (uint32_t i = 0; i < texts; i++)
		read_text(file, i);
	if (reader == CONFIG_FOLDER)
		judge_folder(file, out, complain, context);
	else
		config_judge(file, out);
	faults = file->faults;
	explicit_bzero(file, sizeof(*file)); /* passwords */
	free(file);
	return faults;
}

int config_parse(const char *name, const char *text, size_t length, struct config *out,
		 config_complain complain, void *context)
{
	const struct config_text only = { name, text, length };

	return config_parse_texts(&only, 1, CONFIG_TO_RUN, out, complain, context);
}
