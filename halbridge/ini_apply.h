/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * [POKEYS] and [JOINT_n] of a machine's INI file to pins and parameters.
 */
#ifndef HALBRIDGE_INI_APPLY_H
#define HALBRIDGE_INI_APPLY_H

#include <stdbool.h>
#include <stdint.h>
#include "halbridge/ini_file.h"
#include "halbridge/instance.h"

/* A key and what it sets; "%u" in both is the index. */
struct ini_key {
	const char *key;
	const char *name; /* behind the prefix, as in the table */
	double low, high;
	uint8_t form; /* enum ini_form */
};

enum ini_form { INI_WHOLE, INI_REAL, INI_WORD }; /* INI_WORD: yes, no, LINEAR ... or whole */

extern const struct ini_key ini_pokeys_keys[], ini_joint_keys[];
extern const size_t ini_pokeys_key_count, ini_joint_key_count;

/* "yes", "OFF", "LINEAR" ...: false if it is no such word. */
bool ini_word(const char *text, double *value);

/* One line about a value that is not used: file, line, key, range. */
typedef void (*ini_complaint)(void *argument, const char *line);

/* A key of [POKEYS] that is a whole number. `otherwise` if it is not there, or bad. */
long ini_whole(const struct ini_file *file, const char *key, long low, long high, long otherwise,
	       ini_complaint complain, void *argument);

/*
 * Set everything the file has. A value that is no number or out of range is
 * told, and what it would have set keeps its value. Returns how many were bad.
 * After the export, before hal_ready. Cold.
 */
unsigned int ini_apply(const struct ini_file *file, struct instance *instance,
		       ini_complaint complain, void *argument);

/*
 * Keys of [POKEYS] that nothing here reads, to `list` as "KEY (line 5), ...", cut where it
 * is full: a HAL file may use them, or they are misspelt. Returns how many. Cold.
 */
unsigned int ini_unknown(const struct ini_file *file, struct instance *instance, char *list,
			 size_t size);

#endif
