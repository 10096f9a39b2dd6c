/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Selects the rows of docs/compatibility.md that concern a machine: by the names that it uses,
 * and what it does with them.
 */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include "tools/config_draft.h"
#include "tools/migrate.h"
#include "tools/print.h"

enum { COLUMNS = 96, PLACES = 6 };

#define FASTEST 125000	/* pulses/s of any pulse generator */

const char *migrate_file_name(const struct migrate *machine, size_t file)
{
	const char *path = file == SIZE_MAX ? machine->ini.path : machine->file[file].path;
	const char *slash = strrchr(path, '/');

	return slash ? slash + 1 : path;
}

/* Text behind `head`, which is behind `indent` blanks. */
static void print_text(const char *head, int indent, const char *text, FILE *to)
{
	char first[40], next[40];

	snprintf(first, sizeof(first), "%*s%s ", indent, "", head);
	snprintf(next, sizeof(next), "%*s", indent + 2, "");
	print_wrapped(first, next, COLUMNS, text, to);
}

/* What is set is this number, and it is known. */
static double value_of(const struct migrate_use *use)
{
	return use->how == MIGRATE_SET ? migrate_value(use->other) : (double)NAN;
}

static bool is_driven(const struct migrate *machine, const struct migrate_use *axis)
{
	for (size_t i = 0; i < machine->uses; i++) {
		const struct migrate_use *use = &machine->use[i];

		if (use->how == MIGRATE_LINKED && use->device == axis->device &&
		    use->index == axis->index && migrate_fits("PEv2.N.joint-pos-cmd", use->name))
			return true;
	}
	return false;
}

/* The condition behind the names of a row, as far as the files can say. */
static bool holds(const struct migrate *machine, const struct migrate_note *note,
		  const struct migrate_use *use)
{
	const double value = value_of(use);

	if (!strcmp(note->condition, "negative"))
		return value < 0;
	if (!strcmp(note->condition, "with a fraction"))
		return value != rint(value) && !isnan(value);
	if (!strcmp(note->condition, "true") ||
	    !strcmp(note->condition, "together with other flags"))
		return !isnan(value) && value != 0;
	if (!strcmp(note->condition, "false") || !strcmp(note->condition, "set to 0"))
		return value == 0;
	if (!strcmp(note->condition, "above the maximum of the pulse generator"))
		return value > FASTEST;
	if (!strcmp(note->condition, "of an axis that is driven"))
		return is_driven(machine, use);
	if (!strcmp(note->condition, "linked to a signal"))
		return use->how == MIGRATE_LINKED && use->row && use->row->kind == TABLE_PARAM;
	return true;
}

static bool concerns(const struct migrate *machine, const struct migrate_note *note,
		     const struct migrate_use *use)
{
	return migrate_fits(note->names, use->name) && holds(machine, note, use);
}

/* "PEv2.0.AxesState (mill.hal:33, 35)", of all uses that a note concerns. */
static unsigned int print_uses(const struct migrate *machine, const struct migrate_note *note,
			       FILE *to)
{
	const char *name = NULL;
	size_t file = 0;
	unsigned int count = 0;
	char text[1200] = "";
	size_t at = 0;

	for (size_t i = 0; i < machine->uses; i++) {
		const struct migrate_use *use = &machine->use[i];
		const bool is_new = !name || strcmp(name, use->name) != 0;

		if (!concerns(machine, note, use))
			continue;
		if (count++ >= PLACES)
			continue;
		if (is_new || file != use->line->file)
			at += (size_t)snprintf(text + at, sizeof(text) - at, "%s%s%s%s:%u",
					       at ? "; " : "", is_new ? use->name : "",
					       is_new ? " at " : "",
					       migrate_file_name(machine, use->line->file),
					       use->line->number);
		else
			at += (size_t)snprintf(text + at, sizeof(text) - at, ", %u",
					       use->line->number);
		at = at < sizeof(text) ? at : sizeof(text) - 1;
		name = use->name;
		file = use->line->file;
	}
	if (count > PLACES)
		snprintf(text + at, sizeof(text) - at, "; and %u more", count - PLACES);
	if (count)
		print_text("-", 0, text, to);
	return count;
}

static void print_notes(const struct migrate *machine, enum migrate_kind kind, const char *title,
			const char *const heads[3], FILE *to)
{
	bool any = false;

	for (size_t i = 0; i < migrate_note_count; i++) {
		const struct migrate_note *note = &migrate_notes[i];
		bool concerned = false;

		for (size_t k = 0; note->kind == kind && k < machine->uses; k++)
			concerned = concerned || concerns(machine, note, &machine->use[k]);
		if (!concerned)
			continue;
		if (!any)
			fprintf(to, "\n%s\n", title);
		any = true;
		print_uses(machine, note, to);
		if (*note->condition)
			print_text("when:", 4, note->condition, to);
		for (int n = 0; n < 3; n++)
			if (heads[n] && *note->text[n])
				print_text(heads[n], 4, note->text[n], to);
	}
}

/* Which machines a choice concerns. */
enum when { LINKED, FRACTION, WITHOUT_PIN, HIGH_ENCODER };

static const struct choice {
	const char *name, *names;
	enum when when;
} choices[] = {
	{ "axis-enable-follows", "PEv2.N.digout.AxisEnable.out PEv2.N.digout.AxisEnabled.out",
	  LINKED },
	{ "emergency-without-pin", "PEv2.digin.Emergency.in PEv2.digin.Emergency.in-not",
	  WITHOUT_PIN },
	{ "emergency-when-lost", "PEv2.digin.Emergency.in PEv2.digin.Emergency.in-not", LINKED },
	{ "emergency-out-follows", "PEv2.digout.Emergency.out", LINKED },
	{ "adcout-follows", "adcout.N.value adcout.N.enable", LINKED },
	{ "limit-override-follows", "PEv2.LimitOverrideSetup", LINKED },
	{ "ponet-out-follows", "PoNET.N.digout.N.out", LINKED },
	{ "whole-scale", "PEv2.N.stepgen.STEP-SCALE", FRACTION },
	{ "pressed-key-lights", "kbd48CNC.N.*", LINKED },
	{ "key-brightness", "kbd48CNC.*", LINKED },
	{ "old-switches",
	  "PEv2.N.digin.LimitN.in PEv2.N.digin.LimitN.in-not "
	  "PEv2.N.digin.LimitP.in PEv2.N.digin.LimitP.in-not "
	  "PEv2.N.digin.Home.in PEv2.N.digin.Home.in-not",
	  LINKED },
	{ "old-emergency", "PEv2.digin.Emergency.in", LINKED },
	{ "encoder-factor", "encoder.N.scale", HIGH_ENCODER },
};

static bool sets_emergency_pin(const struct migrate *machine)
{
	for (size_t i = 0; i < machine->uses; i++)
		if (machine->use[i].how == MIGRATE_SET &&
		    !strcmp(machine->use[i].name, "PEv2.digin.Emergency.Pin") &&
		    value_of(&machine->use[i]) > 0)
			return true;
	return false;
}

static bool matters(const struct migrate *machine, const struct choice *choice,
		    const struct migrate_use *use)
{
	const bool sets = use->how == MIGRATE_SET;

	if (!migrate_fits(choice->names, use->name))
		return false;
	switch (choice->when) {
	case LINKED:
		return !sets;
	case FRACTION:
		return !isnan(value_of(use)) && value_of(use) != rint(value_of(use));
	case WITHOUT_PIN:
		return !sets && !sets_emergency_pin(machine);
	case HIGH_ENCODER:
		return sets && strtoul(use->name + strlen("encoder."), NULL, 10) >= 10;
	}
	return false;
}

static const struct migrate_note *note_of(const char *choice)
{
	for (size_t i = 0; i < migrate_note_count; i++)
		if (migrate_notes[i].kind == MIGRATE_CHOICE &&
		    !strcmp(migrate_notes[i].names + strlen("legacy."), choice))
			return &migrate_notes[i];
	return NULL;
}

static void print_choices(const struct migrate *machine, FILE *to)
{
	bool any = false;

	for (size_t i = 0; i < sizeof(choices) / sizeof(choices[0]); i++) {
		const struct migrate_note *note = note_of(choices[i].name);
		const struct migrate_use *why = NULL;
		char head[120];

		for (size_t k = 0; !why && k < machine->uses; k++)
			if (matters(machine, &choices[i], &machine->use[k]))
				why = &machine->use[k];
		if (!why || !note)
			continue;
		if (!any)
			fputs("\nChoices. To change one, add to the HAL file, after the component "
			      "is loaded: setp pokeys.0.legacy.NAME 1 (or 0):\n",
			      to);
		any = true;
		snprintf(head, sizeof(head), "- %s, default %s", note->names, note->text[0]);
		fprintf(to, "%s (%s at %s:%u)\n", head, why->name,
			migrate_file_name(machine, why->line->file), why->line->number);
		print_text("if 1:", 4, note->text[1], to);
		print_text("reason for the default:", 4, note->text[2], to);
	}
}

static void print_changes(const struct migrate *machine, const struct migrate_changes *changes,
			  FILE *to)
{
	static const char *const words[] = {
		[MIGRATE_REPLACE] = "becomes",
		[MIGRATE_BEFORE] = "add before it",
		[MIGRATE_AFTER] = "add after it",
		[MIGRATE_REMOVE] = "is removed",
	};
	static const char by_hand[] = "contains more than one command; change it by hand to:";

	if (changes->count || changes->has_no_thread || changes->has_no_component)
		fputs("\nLines to change:\n", to);
	for (size_t i = 0; i < changes->count; i++) {
		const struct migrate_change *change = &changes->change[i];
		const char *rest = change->text ? change->text : "";

		fprintf(to, "- %s:%u %s (%s)\n", migrate_file_name(machine, change->file),
			change->number, change->by_hand ? by_hand : words[change->what],
			change->why);
		while (*rest) {
			const int length = (int)strcspn(rest, "\n");

			fprintf(to, "      %.*s\n", length, rest);
			rest += length + (rest[length] == '\n');
		}
	}
	if (changes->has_no_component)
		print_text("-", 0, "no line that loads the component (loadusr -W pokeys) was found",
			   to);
	if (changes->has_no_thread)
		print_text("-", 0,
			   "the loadusr line is kept, because the addf lines of "
			   "motion-command-handler and motion-controller were not found in one "
			   "thread and in this order. To use the realtime module, replace loadusr "
			   "with \"loadrt pokeys_shm ini=auto\", then add \"addf pokeys.0.read "
			   "servo-thread\" before the first and \"addf pokeys.0.write "
			   "servo-thread\" after the second",
			   to);
}

static void place(const struct migrate *machine, const struct migrate_use *use, FILE *to)
{
	fprintf(to, "- pokeys.%u.%s at %s:%u", use->device, use->name,
		migrate_file_name(machine, use->line->file), use->line->number);
}

static void print_unknown(const struct migrate *machine, FILE *to)
{
	bool any = false;

	for (size_t i = 0; i < machine->uses; i++) {
		if (machine->use[i].row)
			continue;
		if (!any)
			fputs("\nUnknown names (LinuxCNC stops at these lines; correct or remove "
			      "them):\n",
			      to);
		any = true;
		place(machine, &machine->use[i], to);
		fputc('\n', to);
	}
}

/* Values that these files do not determine. */
static void print_unread(const struct migrate *machine, FILE *to)
{
	bool any = false;

	for (size_t i = 0; i < machine->uses; i++) {
		const struct migrate_use *use = &machine->use[i];

		if (use->how != MIGRATE_SET || (!use->is_computed && !isnan(value_of(use))))
			continue;
		if (!any)
			fputs("\nValues that could not be read, so they are missing in the "
			      "settings below:\n",
			      to);
		any = true;
		place(machine, use, to);
		fprintf(to, ": %s\n", use->other);
	}
}

static void print_troubles(const struct migrate *machine, FILE *to)
{
	for (size_t i = 0; i < machine->files; i++)
		if (machine->file[i].is_missing)
			fprintf(to, "- %s: cannot be read, so its lines are not in this report\n",
				machine->file[i].path);
	if (machine->has_includes)
		fputs("- files that the INI file loads with #INCLUDE were not read; name their "
		      "HAL files on the command line\n",
		      to);
	print_unknown(machine, to);
	print_unread(machine, to);
}

void migrate_device_name(const struct migrate *machine, unsigned int device,
			 char name[MIGRATE_NAME])
{
	const char *ini = migrate_file_name(machine, SIZE_MAX);
	size_t length;

	/* room for the number */
	config_draft_name(ini, strcspn(ini, "."), "mill", name, MIGRATE_NAME - 3);
	length = strlen(name);
	if (device)
		snprintf(name + length, MIGRATE_NAME - length, "-%u", device + 1);
}

/* Behind the names of a device's section, as LinuxCNC's INI file has them. */
static int print_section(const struct migrate *machine, unsigned int device, FILE *to)
{
	static struct pokeys_settings settings;
	char key[24] = "DEVICE_ID", name[MIGRATE_NAME];
	const char *serial;
	int result = migrate_settings(machine, device, &settings);

	if (device)
		snprintf(key, sizeof(key), "DEVICE_ID_%u", device);
	serial = migrate_ini(machine, "POKEYS", key);
	migrate_device_name(machine, device, name);
	fprintf(to, "[device %s]\n", name);
	if (serial && strtoul(serial, NULL, 10))
		fprintf(to, "serial = %s\n", serial);
	else
		fputs("# [POKEYS]DEVICE_ID is missing or 0; pokeysctl discover shows the serial "
		      "number.\n; serial = 12345\n",
		      to);
	return result ? result : config_draft_wish(&settings, to);
}

int migrate_conf(const struct migrate *machine, FILE *to)
{
	int result = 0;

	fprintf(to,
		"# Settings from %s and its HAL files. Add this section to\n"
		"# /etc/pokeysd/pokeysd.conf; pokeysd then applies them before LinuxCNC starts.\n",
		migrate_file_name(machine, SIZE_MAX));
	for (unsigned int i = 0; !result && i < migrate_devices(machine); i++)
		result = print_section(machine, i, to);
	return result;
}

int migrate_report(const struct migrate *machine, const struct migrate_changes *changes, FILE *to)
{
	static const char *const earlier[3] = { "then:", "now:", "to do:" };
	static const char *const different[3] = { "before:", "now:", NULL };
	static const char *const nothing[3] = { "why:", NULL, NULL };

	fprintf(to,
		"Migration of %s (%zu HAL file%s, %u device%s). Names are printed without "
		"\"pokeys.0.\".\n",
		migrate_file_name(machine, SIZE_MAX), machine->files,
		machine->files == 1 ? "" : "s", migrate_devices(machine),
		migrate_devices(machine) > 1 ? "s" : "");
	print_troubles(machine, to);
	print_notes(machine, MIGRATE_EARLIER,
		    "Names with another meaning in earlier versions:", earlier, to);
	print_choices(machine, to);
	print_changes(machine, changes, to);
	print_notes(machine, MIGRATE_DIFFERENT, "Names with a different effect:", different, to);
	print_notes(machine, MIGRATE_NOTHING, "Names without function:", nothing, to);
	fputs("\npokeysd.conf:\n", to);
	return migrate_conf(machine, to);
}
