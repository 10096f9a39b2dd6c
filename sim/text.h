/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_TEXT_H
#define SIM_TEXT_H

#include <stdarg.h>
#include <stddef.h>

/* Text built up in a buffer of fixed size; what does not fit is left out, whole lines remain. */
struct sim_text {
	char *at;
	size_t size;
	size_t used;
};

/* An empty text in that buffer, which must have room for one byte at least. */
void sim_text_init(struct sim_text *text, char *buffer, size_t size);

/* Appends; a piece which does not fit wholly is not appended. */
void sim_text_add(struct sim_text *text, const char *format, ...)
	__attribute__((format(printf, 2, 3)));
void sim_text_vadd(struct sim_text *text, const char *format, va_list args);

#endif
