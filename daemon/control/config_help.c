// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The table of keys for people: --help-config, and the key list of
 * pokeysd.conf(5), which a test compares with what is printed here. So a key
 * cannot change without its documentation.
 */
#include <string.h>
#include "daemon/control/config_key.h"

enum { WIDTH = 78 };

static const char *const titles[CONFIG_SECTIONS] = {
	[CONFIG_DAEMON] = "[daemon]",
	[CONFIG_DEVICE] = "[device NAME]",
	[CONFIG_HEATER] = "[heater NAME]",
	[CONFIG_SERVO] = "[servo NAME]",
};

/* Words of a text, each line begun with `margin`. */
static void wrap(FILE *to, const char *text, const char *margin, size_t indent)
{
	size_t column = 0;

	while (*text) {
		size_t word = strcspn(text, " ");

		if (!column || column + 1 + word > WIDTH) {
			fprintf(to, "%s%s", column ? "\n" : "", margin);
			column = indent;
		} else {
			fputc(' ', to);
			column++;
		}
		fprintf(to, "%.*s", (int)word, text);
		column += word;
		text += word + strspn(text + word, " ");
	}
	fputc('\n', to);
}

/* What may be written, in which unit, and what holds without it. */
static void describe(const struct config_key *key, char *out, size_t size)
{
	char allowed[256];
	char index[32] = "";

	config_allowed(key, allowed, sizeof(allowed));
	if (key->count)
		snprintf(index, sizeof(index), "; # = 0..%u", key->count - 1);
	snprintf(out, size, "%s%s; %s%s", allowed, index, key->fallback ? "default " : "no default",
		 key->fallback ? key->fallback : "");
}

void config_help(FILE *to)
{
	const struct config_key *key;
	char line[512];

	for (enum config_section section = 0; section < CONFIG_SECTIONS; section++) {
		fprintf(to, "%s%s\n", section ? "\n" : "", titles[section]);
		for (size_t i = 0; (key = config_key_at(i)); i++) {
			if (key->section != section)
				continue;
			describe(key, line, sizeof(line));
			fprintf(to, "  %s\n", key->name);
			wrap(to, line, "      ", 6);
			wrap(to, key->help, "      ", 6);
		}
	}
}

/* To scdoc, '_' and '*' mean something anywhere, '-' and '#' at the start of a line. */
static void print_escaped(FILE *to, const char *text)
{
	if (strchr("-#", *text))
		fputc('\\', to);
	for (; *text; text++) {
		if (strchr("_*\\", *text))
			fputc('\\', to);
		fputc(*text, to);
	}
}

void config_man(FILE *to)
{
	const struct config_key *key;
	char line[512];

	for (enum config_section section = 0; section < CONFIG_SECTIONS; section++) {
		fprintf(to, "%s## %s\n", section ? "\n" : "", titles[section]);
		for (size_t i = 0; (key = config_key_at(i)); i++) {
			if (key->section != section)
				continue;
			describe(key, line, sizeof(line));
			fprintf(to, "\n*%s*\n\t", key->name);
			print_escaped(to, line);
			fputs(".\n\t", to);
			print_escaped(to, key->help);
			fputc('\n', to);
		}
	}
}
