/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A device while it is judged. For the files that judge. */
#ifndef CONTROL_CONFIG_JUDGE_H
#define CONTROL_CONFIG_JUDGE_H

#include "daemon/control/config_key.h"

struct judged {
	struct config_file *file;
	struct config_raw_device *raw;
	const struct config_lines *lines;
};

/* A complaint about a key of a device, at the key's line. */
void judge_fault(const struct judged *j, const char *key, uint32_t index, const char *format, ...)
	__attribute__((format(printf, 4, 5)));

/* The same of a heater. */
void judge_heater_fault(struct config_file *file, uint32_t heater, const char *key,
			const char *format, ...) __attribute__((format(printf, 4, 5)));

/* Heaters: of which devices they are; before the devices are judged. */
void judge_heaters(struct config_file *file);

/* Apply what the heaters of this device need to its settings; after its terminals were judged. */
void judge_heaters_of(const struct judged *j);

/* A heater of this device: index < file->heaters. */
bool judge_has_heater(const struct judged *j, uint32_t heater);

/* Rules about terminals. */
void judge_terminals(const struct judged *j);

/* Rules between the settings of one device, terminals among them. */
void judge_settings(const struct judged *j);

#endif
