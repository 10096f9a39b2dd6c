/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Words and numbers as a person writes them into pokeysd.conf. Cold. */
#ifndef SETTINGS_TEXT_H
#define SETTINGS_TEXT_H

#include <stddef.h>
#include <stdint.h>
#include "settings/key.h"

/* What is wrong, where there is no better word for it. */
extern const char settings_not_allowed[], settings_out_of_range[];

/* Of a list that ends with a NULL name, or none; NULL = it is not in it. */
const struct settings_word *settings_find_word(const struct settings_word *words, const char *text);

/*
 * The whole text as a decimal number of minimum..maximum; without any if maximum < minimum.
 * NULL, or what is wrong (a static text to stand behind what was given).
 */
const char *settings_whole(const char *text, double minimum, double maximum, int64_t *out);
const char *settings_real(const char *text, double minimum, double maximum, double *out);

/* snprintf at an offset; never beyond the end. Returns the offset behind it. */
size_t settings_append(char *text, size_t size, size_t at, const char *format, ...)
	__attribute__((format(printf, 4, 5)));

#endif
