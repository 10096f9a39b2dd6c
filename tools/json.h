/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * JSON, written as it goes: objects and arrays may nest JSON_DEPTH deep. `key`
 * is NULL inside an array and at the top.
 */
#ifndef TOOLS_JSON_H
#define TOOLS_JSON_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

enum { JSON_DEPTH = 16 };

struct json {
	FILE *to;
	unsigned int depth;
	bool filled[JSON_DEPTH]; /* something stands at this depth already */
	char closing[JSON_DEPTH];
};

void json_init(struct json *json, FILE *to);
void json_object(struct json *json, const char *key);
void json_array(struct json *json, const char *key);
void json_end(struct json *json); /* of the innermost; of the outermost: and a newline */

void json_integer(struct json *json, const char *key, int64_t value);
void json_unsigned(struct json *json, const char *key, uint64_t value);
void json_real(struct json *json, const char *key, double value); /* null if not finite */
void json_bool(struct json *json, const char *key, bool value);
void json_null(struct json *json, const char *key);

/* Any bytes; the output is ASCII. Bytes above 127 are taken as Latin-1. */
void json_text(struct json *json, const char *key, const char *value);

#endif
