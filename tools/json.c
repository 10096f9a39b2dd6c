// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Whatever a device calls itself, the output is valid JSON: names come from
 * the network, so quotes, control characters and bytes that are no UTF-8 are
 * escaped, and a number that JSON cannot write is null.
 */
#include <assert.h>
#include <math.h>
#include "tools/json.h"

void json_init(struct json *json, FILE *to)
{
	*json = (struct json){ .to = to };
}

static void quote(FILE *to, const char *text)
{
	fputc('"', to);
	for (; *text; text++) {
		unsigned char c = (unsigned char)*text;

		if (c == '"' || c == '\\')
			fprintf(to, "\\%c", c);
		else if (c < 0x20 || c >= 0x7f)
			fprintf(to, "\\u%04x", c);
		else
			fputc(c, to);
	}
	fputc('"', to);
}

/* What comes before a value. */
static void begin(struct json *json, const char *key)
{
	if (json->filled[json->depth])
		fputc(',', json->to);
	json->filled[json->depth] = true;
	if (!key)
		return;
	quote(json->to, key);
	fputc(':', json->to);
}

static void nest(struct json *json, const char *key, char opening, char closing)
{
	begin(json, key);
	fputc(opening, json->to);
	json->depth++;
	assert(json->depth < JSON_DEPTH);
	json->filled[json->depth] = false;
	json->closing[json->depth] = closing;
}

void json_object(struct json *json, const char *key)
{
	nest(json, key, '{', '}');
}

void json_array(struct json *json, const char *key)
{
	nest(json, key, '[', ']');
}

void json_end(struct json *json)
{
	assert(json->depth > 0);
	fputc(json->closing[json->depth--], json->to);
	if (json->depth)
		return;
	fputc('\n', json->to);
	json->filled[0] = false;
}

void json_integer(struct json *json, const char *key, int64_t value)
{
	begin(json, key);
	fprintf(json->to, "%lld", (long long)value);
}

void json_unsigned(struct json *json, const char *key, uint64_t value)
{
	begin(json, key);
	fprintf(json->to, "%llu", (unsigned long long)value);
}

void json_real(struct json *json, const char *key, double value)
{
	if (!isfinite(value)) {
		json_null(json, key);
		return;
	}
	begin(json, key);
	fprintf(json->to, "%.9g", value);
}

void json_bool(struct json *json, const char *key, bool value)
{
	begin(json, key);
	fputs(value ? "true" : "false", json->to);
}

void json_null(struct json *json, const char *key)
{
	begin(json, key);
	fputs("null", json->to);
}

void json_text(struct json *json, const char *key, const char *value)
{
	begin(json, key);
	quote(json->to, value);
}
