/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The lines of a machine's files that have to be others: the component is loaded into the
 * servo thread, names that are parameters now are removed from nets, and joints are unhomed
 * after an emergency.
 */
#include <errno.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include "tools/migrate.h"

/* False for a Tcl line with more than one command; it is left for the user. */
static bool is_plain(const struct migrate *machine, const struct migrate_line *line)
{
	if (line->file == SIZE_MAX || !machine->file[line->file].is_tcl)
		return true;
	for (size_t i = 0; i < line->words; i++)
		if (strpbrk(line->raw[i], "{}[];$\""))
			return false;
	return true;
}

/* `text` is freed with the changes; NULL is no memory, where one is needed. */
static int add(const struct migrate *machine, struct migrate_changes *to,
	       const struct migrate_line *line, int what, char *text, const char *why)
{
	struct migrate_change *all;

	all = what != MIGRATE_REMOVE && !text ?
		      NULL :
		      reallocarray(to->change, to->count + 1, sizeof(*all));
	if (!all) {
		free(text);
		return -ENOMEM;
	}
	to->change = all;
	all[to->count++] = (struct migrate_change){
		.file = line->file,
		.number = line->number,
		.last = line->last,
		.what = what,
		.is_command = line->file == SIZE_MAX && line->words,
		.text = text,
		.why = why,
		.by_hand = !is_plain(machine, line),
	};
	return 0;
}

static char *text_of(const char *format, ...) __attribute__((format(printf, 1, 2)));

static char *text_of(const char *format, ...)
{
	va_list arguments;
	char *text;
	int length;

	va_start(arguments, format);
	length = vasprintf(&text, format, arguments);
	va_end(arguments);
	return length < 0 ? NULL : text;
}

static bool is_pokeys(const char *word)
{
	const char *slash = strrchr(word, '/');

	return !strcmp(slash ? slash + 1 : word, "pokeys");
}

/* "loadusr -Wn NAME pokeys": the program follows the options. */
static bool loads_component(const struct migrate_line *line)
{
	size_t i = 1;

	if (strcmp(line->word[0], "loadusr") != 0)
		return false;
	for (; i < line->words && *line->word[i] == '-'; i++)
		i += strchr(line->word[i], 'n') != NULL;
	return i < line->words && is_pokeys(line->word[i]);
}

/* Whether a command waits for or stops the old process. */
static bool needs_component(const struct migrate_line *line)
{
	static const char *const commands[] = { "waitusr", "unloadusr", "unload" };

	for (size_t i = 0; line->words == 2 && i < sizeof(commands) / sizeof(commands[0]); i++)
		if (!strcmp(line->word[0], commands[i]))
			return is_pokeys(line->word[1]);
	return false;
}

/* The first line of two words, NULL = there is none. */
static const struct migrate_line *find(const struct migrate *machine, const char *first,
				       const char *second)
{
	for (size_t i = 0; i < machine->lines; i++) {
		const struct migrate_line *line = &machine->line[i];

		if (line->words > 1 && !strcmp(line->word[0], first) &&
		    !strcmp(line->word[1], second))
			return line;
	}
	return NULL;
}

/* "addf pokeys.0.read servo-thread", a line for each device. */
static char *functs(const struct migrate *machine, const char *before, const char *funct,
		    const char *thread)
{
	char *text = strdup(before);

	for (unsigned int i = 0; text && i < migrate_devices(machine); i++) {
		char *longer = text_of("%s%saddf pokeys.%u.%s %s", text, *text ? "\n" : "", i,
				       funct, thread);

		free(text);
		text = longer;
	}
	return text;
}

/* "loadrt pokeys_shm ini=auto", and the names of the devices if there are several. */
static char *load_line(const struct migrate *machine)
{
	char *text = strdup("loadrt pokeys_shm ini=auto");

	const unsigned int devices = migrate_devices(machine);

	for (unsigned int i = 0; devices > 1 && text && i < devices; i++) {
		char name[MIGRATE_NAME], *longer;

		migrate_device_name(machine, i, name);
		longer = text_of("%s%s%s", text, i ? "," : " devices=", name);
		free(text);
		text = longer;
	}
	return text;
}

static const char realtime[] = "the realtime module replaces the userspace component";

/* In the same thread, one after the other, and without a position argument. */
static bool is_in_order(const struct migrate_line *reads, const struct migrate_line *writes)
{
	return reads && writes && reads < writes && reads->words == 3 && writes->words == 3 &&
	       !strcmp(reads->word[2], writes->word[2]);
}

static int add_functs(const struct migrate *machine, const struct migrate_line *reads,
		      const struct migrate_line *writes, const char *load,
		      struct migrate_changes *changes)
{
	int result = add(machine, changes, reads, MIGRATE_BEFORE,
			 functs(machine, load, "read", reads->word[2]),
			 "reads inputs and positions before motion");

	return result ? result :
			add(machine, changes, writes, MIGRATE_AFTER,
			    functs(machine, "", "write", writes->word[2]),
			    "sends outputs and commands after motion");
}

/* Nothing, if it is loaded into realtime already, or if its place there is not known. */
static int load_module(const struct migrate *machine, struct migrate_changes *changes)
{
	const struct migrate_line *reads = find(machine, "addf", "motion-command-handler");
	const struct migrate_line *writes = find(machine, "addf", "motion-controller");
	const struct migrate_line *first = NULL;
	char *load;
	int result = 0;

	for (size_t i = 0; !first && i < machine->lines; i++)
		first = loads_component(&machine->line[i]) ? &machine->line[i] : NULL;
	changes->has_no_component = !first && !find(machine, "loadrt", "pokeys_shm");
	if (!first || find(machine, "loadrt", "pokeys_shm"))
		return 0;
	changes->has_no_thread = !is_in_order(reads, writes);
	if (changes->has_no_thread)
		return 0;
	load = load_line(machine);
	if (!load)
		return -ENOMEM;
	for (const struct migrate_line *line = machine->line;
	     !result && line < machine->line + machine->lines; line++) {
		/* it has to be loaded before its functs are added */
		const bool stays = line == first && first < reads;

		if (loads_component(line) || needs_component(line))
			result = add(machine, changes, line,
				     stays ? MIGRATE_REPLACE : MIGRATE_REMOVE,
				     stays ? strdup(load) : NULL, realtime);
	}
	if (!result)
		result = add_functs(machine, reads, writes, first < reads ? "" : load, changes);
	free(load);
	return result;
}

/* What ini= exports as a pin besides. */
static bool is_pin_as_well(const struct migrate_use *use)
{
	for (struct table_cursor row = table_walk(TABLE_FORMER); table_next_row(&row);)
		if (!strcmp(row.row->name, use->row->name) && row.row->kind == TABLE_PIN)
			return true;
	return false;
}

static bool is_no_pin(const struct migrate *machine, const struct migrate_line *line, size_t word)
{
	for (size_t i = 0; i < machine->uses; i++) {
		const struct migrate_use *use = &machine->use[i];

		if (use->line == line && use->word == word && use->how == MIGRATE_LINKED &&
		    use->row && use->row->kind == TABLE_PARAM && !is_pin_as_well(use))
			return true;
	}
	return false;
}

/* A net without the names that are parameters now; nothing is left if it has no other pin. */
static int unlink_parameters(const struct migrate *machine, const struct migrate_line *line,
			     struct migrate_changes *changes)
{
	static const char why[] = "a parameter cannot be linked; it was a pin in earlier versions";
	size_t pins = 0, gone = 0;
	char *text;

	for (size_t i = 1; i < line->words; i++)
		gone += is_no_pin(machine, line, i);
	if (!gone)
		return 0;
	text = text_of("net %s", line->raw[1]);
	for (size_t i = 2; text && !strcmp(line->word[0], "net") && i < line->words; i++) {
		char *longer;

		if (is_no_pin(machine, line, i))
			continue;
		longer = text_of("%s %s", text, line->raw[i]);
		free(text);
		text = longer;
		pins++;
	}
	if (text && pins)
		return add(machine, changes, line, MIGRATE_REPLACE, text, why);
	free(text);
	return text ? add(machine, changes, line, MIGRATE_REMOVE, NULL, why) : -ENOMEM;
}

static bool uses_emergency(const struct migrate *machine)
{
	static const char emergency[] = "PEv2.digin.Emergency.in PEv2.digin.Emergency.in-not";

	for (size_t i = 0; i < machine->uses; i++)
		if (machine->use[i].how == MIGRATE_LINKED &&
		    migrate_fits(emergency, machine->use[i].name))
			return true;
	return false;
}

/* A lost device is an emergency (legacy.emergency-when-lost), after which positions are unknown. */
static int unhome_joints(const struct migrate *machine, struct migrate_changes *changes)
{
	const char *section = "";
	int result = 0;

	for (size_t i = 0; !result && uses_emergency(machine) && i < machine->ini.count; i++) {
		const struct ini_entry *entry = &machine->ini.entry[i], *old;
		struct migrate_line line = { .file = SIZE_MAX };

		if (strncmp(entry->section, "JOINT_", 6) != 0 || !strcmp(entry->section, section))
			continue;
		section = entry->section;
		old = ini_file_find(&machine->ini, section, "VOLATILE_HOME");
		if (old && migrate_value(old->value) > 0)
			continue;
		line.number = line.last = old ? old->line : entry->line;
		result = add(machine, changes, &line, old ? MIGRATE_REPLACE : MIGRATE_BEFORE,
			     strdup("VOLATILE_HOME = 1"),
			     "LinuxCNC then unhomes the joint at each emergency stop and "
			     "machine-off: its position is unknown after the device was lost");
	}
	return result;
}

int migrate_find_changes(const struct migrate *machine, struct migrate_changes *changes)
{
	int result;

	*changes = (struct migrate_changes){ 0 };
	result = load_module(machine, changes);
	for (size_t i = 0; !result && i < machine->lines; i++)
		if (!machine->line[i].is_key && machine->line[i].words > 1)
			result = unlink_parameters(machine, &machine->line[i], changes);
	return result ? result : unhome_joints(machine, changes);
}

void migrate_free_changes(struct migrate_changes *changes)
{
	for (size_t i = 0; i < changes->count; i++)
		free(changes->change[i].text);
	free(changes->change);
}
