// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeysctl get: print values by name, like halcmd getp and halcmd show, but without LinuxCNC.
 *
 * For a single name without wildcards only the value is printed, so that a script can use it.
 * Old values are printed too, because they are the last known ones; the exit status is then 2.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "model/model.h"
#include "tools/choose.h"
#include "tools/json.h"
#include "tools/pokeysctl.h"
#include "tools/print.h"
#include "tools/view.h"

enum { VALUE_TEXT = 96 };

/* What is to be printed, and of what. */
struct answer {
	const struct view_device *device;
	struct choice choice;
	struct model_judgement judgement;
	struct model_images images;
	int width; /* of the longest name */
};

static void prepare(struct answer *answer, const struct view_device *device)
{
	answer->device = device;
	answer->judgement = (struct model_judgement){
		.age_us = view_data_age_ns(device) / 1e3,
		.connected = device->freshness == VIEW_FRESH,
		.stale = device->freshness != VIEW_FRESH,
		.daemon_alive = device->freshness > VIEW_DEAD &&
				isfinite(view_age_ns(device->now_ns, device->state.t_publish_ns)),
	};
	answer->images = (struct model_images){
		.image = { [MODEL_STATE] = &device->state,
			   [MODEL_DIAG] = device->has_diag ? &device->diag : NULL,
			   [MODEL_JUDGEMENT] = &answer->judgement },
		.now_ns = device->now_ns,
	};
}

static const char *value_text(const struct model_value *value, char text[VALUE_TEXT])
{
	char clean[32];

	switch (value->kind) {
	case MODEL_BOOLEAN:
		return value->boolean ? "true" : "false";
	case MODEL_NATURAL:
		snprintf(text, VALUE_TEXT, "%llu", (unsigned long long)value->natural);
		return text;
	case MODEL_INTEGER:
		snprintf(text, VALUE_TEXT, "%lld", (long long)value->integer);
		return text;
	case MODEL_REAL:
		snprintf(text, VALUE_TEXT, "%.9g", value->real);
		return text;
	case MODEL_STRING:
		snprintf(text, VALUE_TEXT, "%s",
			 print_clean(value->string, strlen(value->string), clean));
		return text;
	case MODEL_UNKNOWN:
		break;
	}
	return "-";
}

/* The terminal's number and label, as printed on the board. */
static void print_place(const struct answer *answer, const struct model_row *row,
			unsigned int index)
{
	const char *label;
	const unsigned int terminal =
		model_board_terminal(row, index, answer->device->state.identity.hardware, &label);

	if (terminal && label)
		printf("  terminal %u, %s", terminal, label);
	else if (terminal)
		printf("  terminal %u", terminal);
	else if (label)
		printf("  %s", label);
}

static void print_line(const struct answer *answer, const struct model_row *row, unsigned int index,
		       const char *name)
{
	struct model_value value;
	char buffer[VALUE_TEXT], text[2 * VALUE_TEXT];

	model_read(row, index, &answer->images, &value);
	snprintf(text, sizeof(text), "%s%s%s%s%s%s", value_text(&value, buffer),
		 *row->unit && value.kind != MODEL_UNKNOWN ? " " : "",
		 value.kind != MODEL_UNKNOWN ? row->unit : "", value.word ? " (" : "",
		 value.word ? value.word : "", value.word ? ")" : "");
	if (row->terminal == MODEL_NO_TERMINAL) {
		printf("%-*s  %s\n", answer->width, name, text);
		return;
	}
	printf("%-*s  %-14s", answer->width, name, text);
	print_place(answer, row, index);
	putchar('\n');
}

static void print_only(const struct answer *answer, const struct model_row *row, unsigned int index)
{
	struct model_value value;
	char text[VALUE_TEXT];

	model_read(row, index, &answer->images, &value);
	puts(value_text(&value, text));
}

static void put_value(struct json *json, const char *name, const struct model_value *value)
{
	switch (value->kind) {
	case MODEL_BOOLEAN:
		json_bool(json, name, value->boolean);
		break;
	case MODEL_NATURAL:
		json_unsigned(json, name, value->natural);
		break;
	case MODEL_INTEGER:
		json_integer(json, name, value->integer);
		break;
	case MODEL_REAL:
		json_real(json, name, value->real);
		break;
	case MODEL_STRING:
		json_text(json, name, value->string);
		break;
	case MODEL_UNKNOWN:
		json_null(json, name);
		break;
	}
}

static void each_width(void *argument, const struct model_row *row, unsigned int index,
		       const char *name)
{
	struct answer *answer = argument;
	const int length = (int)strlen(name);

	(void)row;
	(void)index;
	if (length > answer->width)
		answer->width = length;
}

static void each_line(void *argument, const struct model_row *row, unsigned int index,
		      const char *name)
{
	print_line(argument, row, index, name);
}

static void print_lines(struct answer *answer)
{
	answer->width = 0;
	choose_each(&answer->choice, each_width, answer);
	choose_each(&answer->choice, each_line, answer);
}

/* Values, or the words that stand for them. */
struct json_answer {
	const struct answer *answer;
	struct json *json;
	bool words;
};

static void each_json(void *argument, const struct model_row *row, unsigned int index,
		      const char *name)
{
	const struct json_answer *to = argument;
	struct model_value value;

	model_read(row, index, &to->answer->images, &value);
	if (!to->words)
		put_value(to->json, name, &value);
	else if (value.word)
		json_text(to->json, name, value.word);
}

static void put_all(const struct answer *answer)
{
	struct json json;
	struct json_answer to = { .answer = answer, .json = &json };

	json_init(&json, stdout);
	json_object(&json, NULL);
	json_unsigned(&json, "format", 1);
	json_text(&json, "device", answer->device->name);
	json_bool(&json, "fresh", answer->device->freshness == VIEW_FRESH);
	json_text(&json, "reason", answer->device->why);
	json_object(&json, "values");
	choose_each(&answer->choice, each_json, &to);
	json_end(&json);
	to.words = true;
	json_object(&json, "words");
	choose_each(&answer->choice, each_json, &to);
	json_end(&json);
	json_end(&json);
}

static int print_answer(struct answer *answer, bool json)
{
	const char *only = choose_only(&answer->choice);
	const struct model_row *row;
	unsigned int index;

	if (json)
		put_all(answer);
	else if (only && model_find(only, &row, &index))
		print_only(answer, row, index);
	else
		print_lines(answer);
	if (answer->device->freshness == VIEW_FRESH)
		return STATUS_OK;
	if (!json)
		complain("%s: %s; these are the last known values", answer->device->name,
			 answer->device->why);
	return STATUS_STALE;
}

int command_get(const struct options *options)
{
	struct view *view = view_only();
	struct answer answer;
	int status;

	if (!options->name_count) {
		complain("get: no device given; usage: pokeysctl get DEVICE [NAME ...]; "
			 "without NAME, all values are printed");
		return STATUS_USAGE;
	}
	answer.choice = (struct choice){ options->names + 1, options->name_count - 1, true };
	status = choose_check(&answer.choice, "get");
	if (!status)
		status = view_open(view, options->runtime_directory, options->names, 1);
	if (!status) {
		view_read(view);
		prepare(&answer, &view->device[0]);
		if (answer.device->freshness == VIEW_NONE) {
			complain("%s: %s", answer.device->name, answer.device->why);
			status = STATUS_FAILED;
		} else {
			status = print_answer(&answer, options->json);
		}
	}
	view_close(view);
	return status;
}
