// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * From a key's name to its row in the table.
 *
 * '#' in the table stands for an index in the file: axis.#.max-speed is found
 * for axis.0.max-speed to axis.7.max-speed. A name that is nearly one of ours
 * is answered with the one that was probably meant: most unknown keys are
 * typing errors, and a key in the wrong section is the next most common fault.
 * After that, names that belong to LinuxCNC and names that lack a word of ours
 * are recognized.
 */
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include "daemon/control/config_key.h"

enum { NAME_MAX_LENGTH = 40, INDEX_BAD = 1000 };

/* Does `name` fit `pattern`? *index = the number at '#', INDEX_BAD if it is none of ours. */
static bool fits(const char *pattern, const char *name, uint32_t *index)
{
	const char *hash = strchr(pattern, '#');
	size_t before, digits;

	*index = 0;
	if (!hash)
		return !strcmp(pattern, name);
	before = (size_t)(hash - pattern);
	if (strncmp(pattern, name, before))
		return false;
	digits = strspn(name + before, "0123456789");
	if (!digits || strcmp(name + before + digits, hash + 1))
		return false;
	*index = digits > 2 ? INDEX_BAD : (uint32_t)atoi(name + before);
	/* one spelling only: axis.01 would be another name for axis.1 */
	if (digits > 1 && name[before] == '0')
		*index = INDEX_BAD;
	return true;
}

/* Edits between two names, digits taken as '#', without regard to capital letters in b. */
static size_t distance(const char *a, const char *b)
{
	size_t row[NAME_MAX_LENGTH + 1], m = strlen(b);

	if (m > NAME_MAX_LENGTH || strlen(a) > NAME_MAX_LENGTH)
		return NAME_MAX_LENGTH;
	for (size_t j = 0; j <= m; j++)
		row[j] = j;
	for (size_t i = 1; a[i - 1]; i++) {
		size_t diagonal = row[0];

		row[0] = i;
		for (size_t j = 1; j <= m; j++) {
			size_t least = row[j] < row[j - 1] ? row[j] + 1 : row[j - 1] + 1;
			bool same = a[i - 1] == tolower((unsigned char)b[j - 1]) ||
				    (a[i - 1] == '#' && b[j - 1] >= '0' && b[j - 1] <= '9');

			if (diagonal + !same < least)
				least = diagonal + !same;
			diagonal = row[j];
			row[j] = least;
		}
	}
	return row[m];
}

static const char *nearest(enum config_section section, const char *name)
{
	const struct config_key *key;
	const char *found = NULL;
	size_t best = 3; /* more than two wrong letters is another word */

	for (size_t i = 0; (key = config_key_at(i)); i++) {
		size_t far = distance(key->name, name);

		if (key->section == section && far < best) {
			best = far;
			found = key->name;
		}
	}
	return found;
}

/* What follows the last dot of a name: max-speed of axis.#.max-speed. */
static const char *last_part(const char *name)
{
	const char *dot = strrchr(name, '.');

	return dot ? dot + 1 : name;
}

/* Are the parts before the last the same, as in axis.#.max-speed and axis.0.speed? */
static bool same_place(const char *pattern, const char *name)
{
	char ours[NAME_MAX_LENGTH + 1], theirs[NAME_MAX_LENGTH + 1];
	uint32_t index;

	snprintf(ours, sizeof(ours), "%.*s", (int)(last_part(pattern) - pattern), pattern);
	snprintf(theirs, sizeof(theirs), "%.*s", (int)(last_part(name) - name), name);
	return fits(ours, theirs, &index);
}

/* Is `name` a key without some of its words, as axis.0.acceleration is without "max"? */
static bool is_part(const char *pattern, const char *name)
{
	const char *first = last_part(pattern), *word = last_part(name);

	if (!*word || strlen(name) > NAME_MAX_LENGTH || !same_place(pattern, name))
		return false;
	for (const char *at = strstr(first, word); at; at = strstr(at + 1, word))
		if ((at == first || at[-1] == '-') &&
		    (!at[strlen(word)] || at[strlen(word)] == '-'))
			return true;
	return false;
}

/* "NAME or NAME", the keys that `name` may be a part of; empty = none. */
static void list_containing(enum config_section section, const char *name, char *list, size_t size)
{
	const struct config_key *key;
	size_t length = 0;

	*list = '\0';
	for (size_t i = 0; (key = config_key_at(i)); i++) {
		if (key->section != section || !is_part(key->name, name))
			continue;
		if (length + strlen(key->name) + strlen(" or ") >= size)
			return;
		length += (size_t)snprintf(list + length, size - length, "%s%s",
					   length ? " or " : "", key->name);
	}
}

/* Where a setting is that the daemon does not have; NULL = unknown. */
static const char *elsewhere(const char *name)
{
	static const char *const scales[] = { "scale", "steps-per-mm", "steps-per-unit",
					      "pulses-per-mm" };

	for (size_t i = 0; i < sizeof(scales) / sizeof(scales[0]); i++)
		if (!strcasecmp(last_part(name), scales[i]))
			return "the scale is set in LinuxCNC: SCALE in its INI file, "
			       "pokeys.N.joint.NN.scale in HAL";
	return NULL;
}

/* Where a key belongs, for a person. */
static const char *section_name(enum config_section section)
{
	static const char *const names[CONFIG_SECTIONS] = {
		[CONFIG_DAEMON] = "[daemon]",
		[CONFIG_DEVICE] = "a [device NAME] section",
		[CONFIG_HEATER] = "a [heater NAME] section",
		[CONFIG_SERVO] = "a [servo NAME] section",
	};

	return names[section];
}

static void explain(enum config_section section, const char *name, char *why, size_t size)
{
	const char *meant = nearest(section, name), *instead = elsewhere(name);
	const struct config_key *key;
	char parts[3 * NAME_MAX_LENGTH];
	uint32_t index;

	for (size_t i = 0; (key = config_key_at(i)); i++) {
		if (key->section != section && fits(key->name, name, &index)) {
			snprintf(why, size, "%s belongs in %s", name, section_name(key->section));
			return;
		}
	}
	if (!meant && !instead) {
		list_containing(section, name, parts, sizeof(parts));
		meant = *parts ? parts : NULL;
	}
	if (!meant && instead) {
		snprintf(why, size, "there is no key %.40s; %s", name, instead);
		return;
	}
	snprintf(why, size, "there is no key %.40s; %s%s%s", name, meant ? "did you mean " : "",
		 meant ? meant : "pokeysd --help-config lists all keys", meant ? "?" : "");
}

const struct config_key *config_find(enum config_section section, const char *name, uint32_t *index,
				     char *why, size_t size)
{
	const struct config_key *key;

	for (size_t i = 0; (key = config_key_at(i)); i++) {
		if (key->section != section || !fits(key->name, name, index))
			continue;
		if (!key->count || *index < key->count)
			return key;
		snprintf(why, size, "%s: there is no such index; allowed: %s with # = 0..%u", name,
			 key->name, key->count - 1);
		return NULL;
	}
	explain(section, name, why, size);
	return NULL;
}
