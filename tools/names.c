// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeysctl names: list all values and their meanings; it needs no daemon.
 *
 * The JSON output is the whole model, with the position of each value in its image and the
 * labels on the boards: all that a program in any language needs to read the images. The build
 * installs it as names.json.
 */
#include <stdio.h>
#include <string.h>
#include <pokeys/command.h>
#include "model/model.h"
#include "tools/choose.h"
#include "tools/json.h"
#include "tools/pokeysctl.h"
#include "tools/print.h"
#include "wire/label.h"
#include "wire/model.h"

enum { COLUMNS = 80, WORDS_MOST = 256 };

#define INDENT "        "

static bool is_chosen(const struct choice *choice, const struct model_row *row)
{
	char name[MODEL_NAME_MAX + 1];

	model_pattern(row, name);
	if (choose(choice, name))
		return true;
	for (unsigned int i = 0; i < model_names(row); i++) {
		model_name(row, i, name);
		if (choose(choice, name))
			return true;
	}
	return false;
}

static void print_row(const struct model_row *row)
{
	char name[MODEL_NAME_MAX + 1];

	model_pattern(row, name);
	printf("%s (%s", name, model_type_name(row));
	if (row->image == MODEL_COMMAND)
		printf(", can be commanded");
	if (*row->unit)
		printf(", %s", row->unit);
	if (row->low < row->high)
		printf(", %.10g to %.10g", row->low, row->high);
	if (row->count > 1)
		printf(", 00..%02u", row->count - 1u);
	if (row->inner)
		printf(" and 0..%u", row->inner - 1u);
	puts(")");
	print_wrapped(INDENT, INDENT, COLUMNS, model_help(row), stdout);
	putchar('\n');
}

static void put_words(struct json *json, const struct model_row *row)
{
	char number[8];

	json_object(json, "words");
	for (unsigned int i = 0; i < WORDS_MOST; i++) {
		const char *word = row->word((uint8_t)i);

		if (!strcmp(word, "unknown"))
			continue;
		snprintf(number, sizeof(number), "%u", i);
		json_text(json, number, word);
	}
	json_end(json);
}

/* Its range, and the bit that says that it is commanded. */
static void put_command(struct json *json, const struct model_row *row)
{
	if (row->low < row->high) {
		json_integer(json, "low", (int64_t)row->low);
		json_integer(json, "high", (int64_t)row->high);
	}
	if (!row->mask)
		return;
	json_unsigned(json, "mask_offset", row->mask);
	json_unsigned(json, "mask_bit", row->mask_bit);
	json_unsigned(json, "mask_stride", row->mask_stride);
}

/* Where the value is in its image, and how it is stored. */
static void put_place(struct json *json, const struct model_row *row)
{
	static const char *const images[MODEL_IMAGES] = { "state", "diag", "judgement", "command" };
	static const char *const storages[MODEL_TYPES] = {
		[MODEL_BIT] = "bit",
		[MODEL_FLAG] = "flag",
		[MODEL_UNSIGNED] = "unsigned",
		[MODEL_SIGNED] = "signed",
		[MODEL_FLOAT] = "float",
		[MODEL_TEXT] = "text",
		[MODEL_ADDRESS] = "ipv4",
		[MODEL_AGE] = "timestamp",
		[MODEL_QUANTILE] = "histogram",
	};

	json_text(json, "image", images[row->image]);
	if (row->image == MODEL_JUDGEMENT)
		return;
	json_text(json, "storage", storages[row->type]);
	json_unsigned(json, "offset", row->offset);
	if (row->type == MODEL_BIT)
		json_unsigned(json, "bit", row->first_bit);
	else if (row->type != MODEL_QUANTILE)
		json_unsigned(json, "size", row->size);
	if (row->stride)
		json_unsigned(json, "stride", row->stride);
	if (row->inner)
		json_unsigned(json, "inner_stride", row->inner_stride);
	if (row->factor != 0)
		json_real(json, "factor", row->factor);
	if (row->whole)
		json_unsigned(json, "divisor_offset", row->whole);
	if (row->type == MODEL_QUANTILE)
		json_real(json, "quantile", row->quantile);
	if (row->image == MODEL_COMMAND)
		put_command(json, row);
}

static void put_row(struct json *json, const struct model_row *row)
{
	static const char *const terminals[] = {
		[MODEL_PIN] = "pin",
		[MODEL_ANALOG] = "analog",
		[MODEL_PWM] = "pwm",
		[MODEL_OUTPUT] = "output",
	};

	json_object(json, NULL);
	json_text(json, "name", row->name);
	json_text(json, "type", model_type_name(row));
	json_bool(json, "writable", row->image == MODEL_COMMAND);
	json_text(json, "unit", row->unit);
	json_text(json, "help", model_help(row));
	json_bool(json, "hal", row->image != MODEL_JUDGEMENT && model_hal_row(row));
	json_unsigned(json, "count", row->count);
	if (row->inner)
		json_unsigned(json, "inner", row->inner);
	if (row->terminal != MODEL_NO_TERMINAL)
		json_text(json, "terminal", terminals[row->terminal]);
	put_place(json, row);
	if (row->word)
		put_words(json, row);
	json_end(json);
}

/* It is left open, for more keys. */
static void put_image(struct json *json, const char *name, unsigned int version, uint64_t hash,
		      size_t size)
{
	char text[24];

	snprintf(text, sizeof(text), "0x%016llx", (unsigned long long)hash);
	json_object(json, name);
	json_unsigned(json, "version", version);
	json_text(json, "hash", text);
	json_unsigned(json, "size", size);
}

static void put_labels(struct json *json, const struct wire_model *model)
{
	const struct wire_labels *labels = wire_labels(model->hardware);

	json_object(json, "labels");
	for (unsigned int n = 1; labels && n <= model->pins; n++) {
		char number[8];

		if (!labels->terminal[n])
			continue;
		snprintf(number, sizeof(number), "%u", n);
		json_text(json, number, labels->terminal[n]);
	}
	json_end(json);
	json_array(json, "outputs");
	for (unsigned int i = 0; labels && i < WIRE_LABEL_OUTPUTS; i++)
		json_text(json, NULL, labels->output[i]);
	json_end(json);
}

static void put_boards(struct json *json)
{
	const struct wire_model *model;

	json_array(json, "boards");
	for (size_t i = 0; (model = wire_model_at(i)); i++) {
		if (!model->ethernet || !model->pins)
			continue;
		json_object(json, NULL);
		json_text(json, "model", model->name);
		json_unsigned(json, "hardware", model->hardware);
		json_unsigned(json, "terminals", model->pins);
		json_array(json, "pwm");
		for (unsigned int k = 0; k < WIRE_MODEL_PWMS; k++)
			json_unsigned(json, NULL, model->pinmap->pwm_pin[k]);
		json_end(json);
		put_labels(json, model);
		json_end(json);
	}
	json_end(json);
}

static void put_all(const struct choice *choice)
{
	const struct model_row *row;
	struct json json;

	json_init(&json, stdout);
	json_object(&json, NULL);
	json_unsigned(&json, "format", 1);
	json_object(&json, "images");
	put_image(&json, "state", POKEYS_STATE_VERSION, POKEYS_STATE_HASH,
		  sizeof(struct pokeys_state));
	json_unsigned(&json, "session_offset", offsetof(struct pokeys_state, one_shot_session));
	json_unsigned(&json, "one_shot_ack_offset", offsetof(struct pokeys_state, one_shot_ack));
	json_unsigned(&json, "one_shots_offset", offsetof(struct pokeys_state, one_shot));
	json_unsigned(&json, "command_time_offset", offsetof(struct pokeys_state, command_t_ns));
	json_end(&json);
	put_image(&json, "diag", POKEYS_DIAG_VERSION, POKEYS_DIAG_HASH, sizeof(struct pokeys_diag));
	json_end(&json);
	put_image(&json, "command", POKEYS_COMMAND_VERSION, POKEYS_COMMAND_HASH,
		  sizeof(struct pokeys_command));
	json_unsigned(&json, "read_time_offset", offsetof(struct pokeys_command, t_thread_ns));
	json_unsigned(&json, "session_offset", offsetof(struct pokeys_command, session));
	json_unsigned(&json, "one_shot_head_offset",
		      offsetof(struct pokeys_command, one_shot_head));
	json_unsigned(&json, "one_shots_offset", offsetof(struct pokeys_command, one_shot));
	json_unsigned(&json, "axes_offset", offsetof(struct pokeys_command, axis));
	json_unsigned(&json, "servos_offset", offsetof(struct pokeys_command, servo));
	json_end(&json);
	json_end(&json);
	json_array(&json, "names");
	for (size_t number = 0; (row = model_row(number)); number++)
		if (is_chosen(choice, row))
			put_row(&json, row);
	json_end(&json);
	put_boards(&json);
	json_end(&json);
}

/* Here, the pattern of a row (pin.NN.in) is accepted as a name too. */
static int check(const struct choice *choice)
{
	for (size_t i = 0; i < choice->count; i++) {
		const struct choice one = { choice->patterns + i, 1, false };
		const struct model_row *row;
		size_t number = 0;

		while ((row = model_row(number)) && !is_chosen(&one, row))
			number++;
		if (!row)
			return choose_check(&one, "names");
	}
	return STATUS_OK;
}

int command_names(const struct options *options)
{
	const struct choice choice = { options->names, options->name_count, false };
	const struct model_row *row;
	int status = check(&choice);

	if (status)
		return status;
	if (options->json)
		put_all(&choice);
	for (size_t number = 0; !options->json && (row = model_row(number)); number++)
		if (is_chosen(&choice, row))
			print_row(row);
	return STATUS_OK;
}
