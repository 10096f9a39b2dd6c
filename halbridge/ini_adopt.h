/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A machine's INI file for an instance of either shell.
 */
#ifndef HALBRIDGE_INI_ADOPT_H
#define HALBRIDGE_INI_ADOPT_H

#include "halbridge/ini_apply.h"

/*
 * The serial number it looks for, and everything that [POKEYS] and [JOINT_n] set, in the
 * older component's sense; what cannot be and what nobody knows is told in the log.
 * After the export, before hal_ready. Cold.
 */
void ini_adopt(const struct ini_file *file, struct instance *instance);

/*
 * The daemon's runtime folder, if [POKEYS]RUNTIME_DIRECTORY names one; else *folder stays
 * as it is. The text is the file's. 0, or -EINVAL with one line in `why`. Cold.
 */
int ini_runtime(const struct ini_file *file, const char **folder, char *why, size_t size);

#endif
