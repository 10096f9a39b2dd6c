/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * pokeysctl migrate: a machine's INI and HAL files of the older userspace component, and what
 * concerns it of docs/compatibility.md. Cold, main thread.
 */
#ifndef TOOLS_MIGRATE_H
#define TOOLS_MIGRATE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <pokeys/settings.h>
#include "halbridge/ini_file.h"
#include "halbridge/table.h"

enum migrate_kind {
	MIGRATE_EARLIER,   /* another meaning in earlier versions: then, now, what to do */
	MIGRATE_CHOICE,    /* a legacy.* parameter: default, if 1, reason */
	MIGRATE_DIFFERENT, /* before, now */
	MIGRATE_NOTHING,   /* why it has no function */
};

/* A row of docs/compatibility.md. */
struct migrate_note {
	enum migrate_kind kind;
	const char *names;     /* patterns, a blank between them */
	const char *condition; /* "negative", "true" ...; "" = always */
	const char *text[3];
};

extern const struct migrate_note migrate_notes[];
extern const size_t migrate_note_count;

/* A command of a HAL file, or of the INI file. */
struct migrate_line {
	size_t file;               /* of migrate.file; SIZE_MAX is the INI file */
	unsigned int number, last; /* lines of the file, where it is continued */
	bool is_key;               /* no command, but a key that the component reads itself */
	size_t words;
	char **word; /* [SECTION]KEY replaced by its value */
	char **raw;  /* as it is written */
};

struct migrate_file {
	char *path;
	bool is_tcl;
	bool is_missing;
};

/* A line that loads a HAL file. */
struct migrate_load {
	size_t from;         /* file of the line */
	unsigned int number; /* of the line */
	size_t file;         /* index of the loaded file */
	char *path;          /* as the line has it */
};

/* What a name of the older component is used for. */
enum migrate_how { MIGRATE_LINKED, MIGRATE_SET };

struct migrate_use {
	const struct migrate_line *line;
	enum migrate_how how;
	unsigned int device;         /* pokeys.N */
	size_t word;                 /* of the line */
	const char *name;            /* after "pokeys.N." */
	const char *other;           /* the signal that it is linked to, or the value */
	const struct table_row *row; /* NULL = there is no such name */
	unsigned int index;
	bool is_computed; /* $i in a Tcl file: any number */
};

struct migrate {
	struct ini_file ini;
	struct migrate_file *file;
	size_t files;
	struct migrate_load *load;
	size_t loads;
	struct migrate_line *line;
	size_t lines;
	bool has_includes; /* #INCLUDE, which is not followed */
	struct migrate_use *use;
	size_t uses;
};

/*
 * Read an INI file and its HAL files, or those named instead. 0, or -errno after a complaint:
 * a HAL file that is missing is only marked.
 */
int migrate_read(struct migrate *machine, const char *ini, char *const *hal, size_t hals);
void migrate_free(struct migrate *machine);

/* A value of the INI file, NULL = it has none. */
const char *migrate_ini(const struct migrate *machine, const char *section, const char *key);

/* Fills in machine->use. 0 or -ENOMEM. */
int migrate_find_uses(struct migrate *machine);

/* A name, or with `computed` one whose numbers are not known, fits one of the patterns. */
bool migrate_fits(const char *patterns, const char *name);

/* A number, or a word that stands for one; NaN = neither. */
double migrate_value(const char *text);

/*
 * What the machine sets up in the device, as the component would. Complains to stderr. 0 or
 * -ENOMEM.
 */
int migrate_settings(const struct migrate *machine, unsigned int device,
		     struct pokeys_settings *settings);

enum { MIGRATE_NAME = 28 };

/* What the device's section is called in pokeysd.conf. */
void migrate_device_name(const struct migrate *machine, unsigned int device,
			 char name[MIGRATE_NAME]);

/* A line of a file that has to be changed, or has a line added before or after it. */
struct migrate_change {
	size_t file; /* as in migrate_line */
	unsigned int number, last;
	enum { MIGRATE_REPLACE, MIGRATE_BEFORE, MIGRATE_AFTER, MIGRATE_REMOVE } what;
	bool is_command; /* of the INI file, behind "HALCMD =" */
	bool by_hand;    /* the line is more than one command */
	char *text;
	const char *why;
};

struct migrate_changes {
	struct migrate_change *change;
	size_t count;
	bool has_no_component; /* no line loads it */
	bool has_no_thread;    /* the place of its functs in the thread is unknown */
};

/* 0 or -ENOMEM. To be freed in any case. */
int migrate_find_changes(const struct migrate *machine, struct migrate_changes *changes);
void migrate_free_changes(struct migrate_changes *changes);

/* A machine's devices: one more than the highest number in its names. */
unsigned int migrate_devices(const struct migrate *machine);

/* "mill.hal" of a file's number, SIZE_MAX is the INI file. */
const char *migrate_file_name(const struct migrate *machine, size_t file);

/* Everything that concerns the machine. 0 or -ENOMEM. */
int migrate_report(const struct migrate *machine, const struct migrate_changes *changes, FILE *to);

/* A pokeysd.conf with the devices of the machine. 0 or -ENOMEM. */
int migrate_conf(const struct migrate *machine, FILE *to);

/* The changed files beside the old ones. 0, or -errno after a complaint. */
int migrate_write(const struct migrate *machine, const struct migrate_changes *changes);

#endif
