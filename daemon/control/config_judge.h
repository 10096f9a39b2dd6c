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

/* Rules about terminals. */
void judge_terminals(const struct judged *j);

/* Rules between the settings of one device, terminals among them. */
void judge_settings(const struct judged *j);

#endif
