/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The INI file's keys are looked up one by one in the list of ini_keys.c, not
 * the other way round: most of a machine's INI file is somebody else's, and
 * the order of the list decides where two keys mean one parameter.
 *
 * A joint's section is read for an axis that says which joint it is
 * (PEv2_linked_joint_N). The old component read the section with the number of
 * the axis instead.
 *
 * A key may set a pin; nobody drives it yet, so its own storage is set. From
 * encoder 10 on a name is one of both schemes, and stands in both.
 */
#include "halbridge/ini_apply.h"
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

enum { LINE = 512, INDICES = 64, SHARED_FROM = 10 };

struct applying {
	const struct ini_file *file;
	struct instance *instance;
	ini_complaint complain;
	void *argument;
	unsigned int bad;
};

static void complain(struct applying *to, const struct ini_entry *entry, const struct ini_key *key)
{
	char line[LINE];

	snprintf(line, sizeof(line),
		 "%s:%u: [%s]%s = %s: must be a %snumber from %.10g to %.10g; "
		 "it is not used",
		 to->file->path, entry->line, entry->section, entry->key, entry->value,
		 key->form == INI_REAL ? "" : "whole ", key->low, key->high);
	to->complain(to->argument, line);
	to->bad++;
}

bool ini_word(const char *text, double *value)
{
	static const struct {
		const char *word;
		double value;
	} words[] = {
		{ "yes", 1 }, { "no", 0 },  { "true", 1 },   { "false", 0 },
		{ "on", 1 },  { "off", 0 }, { "linear", 0 }, { "angular", 1 },
	};

	for (size_t i = 0; i < sizeof(words) / sizeof(words[0]); i++) {
		if (strcasecmp(text, words[i].word))
			continue;
		*value = words[i].value;
		return true;
	}
	return false;
}

/* Whole text, within the range. */
static bool parse(const struct ini_key *key, const char *text, double *value)
{
	char *end;

	if (key->form == INI_WORD && ini_word(text, value))
		return true;
	errno = 0;
	*value = strtod(text, &end);
	return end != text && !*end && !errno && isfinite(*value) && *value >= key->low &&
	       *value <= key->high && (key->form == INI_REAL || *value == rint(*value));
}

/* The storage of a pin that HAL has made. */
static void *pin_of(const struct instance *instance, const struct table_row *row,
		    unsigned int index)
{
	size_t pin = 0;

	for (struct table_cursor at = table_walk(instance->schemes); table_next(&at);) {
		if (at.row == row && at.index == index)
			return at.row->kind == TABLE_PIN ? instance->pointers[pin] : NULL;
		pin += at.row->kind == TABLE_PIN;
	}
	return NULL;
}

/* Does a row make the name `pattern` has for this index? */
static bool makes(const struct table_row *row, const char *pattern, unsigned int index)
{
	const char *padded = strstr(row->name, "%02u"), *plain = strstr(pattern, "%u");

	if (index < row->first || index - row->first >= row->count || row->inner)
		return false;
	if (!strcmp(row->name, pattern))
		return true;
	return padded && plain && index >= SHARED_FROM && padded - row->name == plain - pattern &&
	       !strncmp(row->name, pattern, (size_t)(plain - pattern)) &&
	       !strcmp(padded + 4, plain + 2);
}

static void set(struct applying *to, const struct ini_key *key, unsigned int index, double value)
{
	for (struct table_cursor at = table_walk(to->instance->schemes); table_next_row(&at);) {
		unsigned int number = index - at.row->first;
		char *values = (char *)to->instance->values;
		void *pin;

		if (!makes(at.row, key->name, index))
			continue;
		if (at.row->type == TABLE_BIT)
			value = value != 0;
		table_put(at.row, values + table_offset(at.row, number), value);
		pin = at.row->kind == TABLE_PIN ? pin_of(to->instance, at.row, number) : NULL;
		if (pin)
			table_put(at.row, pin, value);
	}
}

/* How many indices a name has; 1 without. */
static unsigned int indices_of(const struct applying *to, const char *pattern)
{
	unsigned int most = 1;

	for (struct table_cursor at = table_walk(to->instance->schemes); table_next_row(&at);) {
		if (!strcmp(at.row->name, pattern) && at.row->first + at.row->count > most)
			most = at.row->first + at.row->count;
	}
	return most;
}

static void apply_key(struct applying *to, const char *section, const struct ini_key *key,
		      const char *name, unsigned int index)
{
	const struct ini_entry *entry = ini_file_find(to->file, section, name);
	double value;

	if (!entry)
		return;
	if (parse(key, entry->value, &value))
		set(to, key, index, value);
	else
		complain(to, entry, key);
}

static void apply_indices(struct applying *to, const struct ini_key *key)
{
	unsigned int count = strstr(key->key, "%u") ? indices_of(to, key->name) : 1;
	char name[INI_FILE_KEY];

	for (unsigned int i = 0; i < count && i < INDICES; i++) {
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
		snprintf(name, sizeof(name), key->key, i);
#pragma GCC diagnostic pop
		apply_key(to, "POKEYS", key, name, i);
	}
}

long ini_whole(const struct ini_file *file, const char *key, long low, long high, long otherwise,
	       ini_complaint complaint, void *argument)
{
	const struct ini_key wanted = { .low = (double)low,
					.high = (double)high,
					.form = INI_WHOLE };
	const struct ini_entry *entry = ini_file_find(file, "POKEYS", key);
	struct applying to = { .file = file, .complain = complaint, .argument = argument };
	double value;

	if (!entry)
		return otherwise;
	if (parse(&wanted, entry->value, &value))
		return (long)value;
	complain(&to, entry, &wanted);
	return otherwise;
}

static void apply_joint(struct applying *to, unsigned int axis, long joint)
{
	char section[INI_FILE_SECTION];

	snprintf(section, sizeof(section), "JOINT_%ld", joint);
	for (size_t i = 0; i < ini_joint_key_count; i++)
		apply_key(to, section, &ini_joint_keys[i], ini_joint_keys[i].key, axis);
}

/* Is `key` the pattern with an index below `count`? */
static bool is_key(const char *pattern, const char *key, unsigned int count)
{
	const char *at = strstr(pattern, "%u");
	char *rest;

	if (!at)
		return !strcasecmp(pattern, key);
	if (strncasecmp(pattern, key, (size_t)(at - pattern)) || key[at - pattern] < '0' ||
	    key[at - pattern] > '9')
		return false;
	return strtoul(key + (at - pattern), &rest, 10) < count && !strcasecmp(rest, at + 2);
}

static bool is_known(const struct applying *to, const char *key)
{
	/* those that set no parameter; the last ones are of the device's key maps, which stay */
	static const struct {
		const char *pattern;
		unsigned int count;
	} others[] = {
		{ "DEVICE_ID", 1 },
		{ "DEVICE_ID_%u", TABLE_DEVICES },
		{ "COMM_TIMEOUT", 1 },
		{ "RUNTIME_DIRECTORY", 1 },
		{ "PEv2_linked_joint_%u", POKEYS_AXES },
		{ "encoder.%u.keymap_dirA", LEGACY_ENCODERS },
		{ "encoder.%u.keymap_dirB", LEGACY_ENCODERS },
		{ "encoder.%u.macro_dirA", LEGACY_ENCODERS },
		{ "encoder.%u.macro_dirB", LEGACY_ENCODERS },
	};

	for (size_t i = 0; i < sizeof(others) / sizeof(others[0]); i++) {
		if (is_key(others[i].pattern, key, others[i].count))
			return true;
	}
	for (size_t i = 0; i < ini_pokeys_key_count; i++) {
		if (is_key(ini_pokeys_keys[i].key, key, indices_of(to, ini_pokeys_keys[i].name)))
			return true;
	}
	return false;
}

/* Add a whole key to the list, or the sign that there are more; returns the list's length. */
static size_t list_key(char *list, size_t at, size_t size, const struct ini_entry *entry)
{
	static const char more[] = ", ...";
	int length = snprintf(list + at, size - at, "%s%s (line %u)", at ? ", " : "", entry->key,
			      entry->line);

	if (at + (size_t)length + sizeof(more) <= size)
		return at + (size_t)length;
	snprintf(list + at, size - at, "%s", at ? more : more + 2);
	return size;
}

unsigned int ini_unknown(const struct ini_file *file, struct instance *instance, char *list,
			 size_t size)
{
	const struct applying to = { .file = file, .instance = instance };
	unsigned int count = 0;
	size_t at = 0;

	list[0] = '\0';
	for (size_t i = 0; i < file->count; i++) {
		const struct ini_entry *entry = &file->entry[i];

		if (strcmp(entry->section, "POKEYS") || is_known(&to, entry->key))
			continue;
		if (at < size)
			at = list_key(list, at, size, entry);
		count++;
	}
	return count;
}

unsigned int ini_apply(const struct ini_file *file, struct instance *instance,
		       ini_complaint complaint, void *argument)
{
	struct applying to = {
		.file = file, .instance = instance, .complain = complaint, .argument = argument
	};
	char key[INI_FILE_KEY];

	for (size_t i = 0; i < ini_pokeys_key_count; i++)
		apply_indices(&to, &ini_pokeys_keys[i]);
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		long joint;

		snprintf(key, sizeof(key), "PEv2_linked_joint_%u", i);
		joint = ini_whole(file, key, -1, 15, -1, complaint, argument);
		if (joint >= 0)
			apply_joint(&to, i, joint);
	}
	return to.bad;
}
