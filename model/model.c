// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Rows, their names, and the values behind the names. A look-up formats and compares
 * thousands of names as text, so a program should look up a name once and not in each cycle.
 */
#include "model/model.h"
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <pokeys/shm.h>
#include "halbridge/table.h"
#include "model/rows.h"
#include "wire/io.h"
#include "wire/label.h"
#include "wire/model.h"

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "bit i of a member is bit i % 8 of "
							  "its byte i / 8");

static const struct model_group *const groups[] = {
	&model_link,  &model_io,     &model_motion, &model_drive,   &model_heater,
	&model_servo, &model_device, &model_bus,    &model_latency, &model_command,
};

const struct model_row *model_row(size_t number)
{
	for (size_t i = 0; i < sizeof(groups) / sizeof(groups[0]); i++) {
		if (number < groups[i]->count)
			return &groups[i]->rows[number];
		number -= groups[i]->count;
	}
	return NULL;
}

unsigned int model_names(const struct model_row *row)
{
	return row->count * (row->inner ? row->inner : 1u);
}

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral" /* the names of our own table */
void model_name(const struct model_row *row, unsigned int index, char name[MODEL_NAME_MAX + 1])
{
	const unsigned int inner = row->inner ? row->inner : 1;

	snprintf(name, MODEL_NAME_MAX + 1, row->name, index / inner, index % inner);
}
#pragma GCC diagnostic pop

void model_pattern(const struct model_row *row, char name[MODEL_NAME_MAX + 1])
{
	const char *from = row->name;
	size_t at = 0;

	while (*from && at + 2 < MODEL_NAME_MAX + 1) {
		const bool two = !strncmp(from, "%02u", 4), one = !strncmp(from, "%u", 2);

		name[at++] = two || one ? 'N' : *from;
		if (two)
			name[at++] = 'N';
		from += two ? 4 : one ? 2 : 1;
	}
	name[at] = '\0';
}

const struct table_row *model_hal_row(const struct model_row *row)
{
	for (struct table_cursor at = table_walk(TABLE_LOOPS); table_next_row(&at);)
		if (!strcmp(at.row->name, row->name))
			return at.row;
	return NULL;
}

const char *model_help(const struct model_row *row)
{
	const struct table_row *hal = row->help ? NULL : model_hal_row(row);

	return row->help ? row->help : hal ? hal->help : "";
}

const char *model_type_name(const struct model_row *row)
{
	static const char *const names[MODEL_TYPES] = {
		[MODEL_BIT] = "bit",       [MODEL_FLAG] = "bit",    [MODEL_UNSIGNED] = "unsigned",
		[MODEL_SIGNED] = "signed", [MODEL_FLOAT] = "float", [MODEL_TEXT] = "text",
		[MODEL_ADDRESS] = "text",  [MODEL_AGE] = "float",   [MODEL_QUANTILE] = "float",
	};

	return row->factor != 0 || row->whole ? "float" : names[row->type];
}

bool model_find(const char *name, const struct model_row **found, unsigned int *index)
{
	char each[MODEL_NAME_MAX + 1];
	const struct model_row *row;

	for (size_t number = 0; (row = model_row(number)); number++) {
		for (unsigned int i = 0; i < model_names(row); i++) {
			model_name(row, i, each);
			if (strcmp(each, name))
				continue;
			*found = row;
			*index = i;
			return true;
		}
	}
	return false;
}

static const char *instead_of(const char *hal_name)
{
	const struct model_alone *alone;

	for (size_t i = 0; (alone = model_alone(i)); i++)
		if (!strcmp(alone->name, hal_name))
			return alone->instead;
	return NULL;
}

bool model_is_hal_name(const char *name, const char **instead)
{
	char each[TABLE_NAME_MAX + 1];

	for (struct table_cursor at = table_walk(TABLE_ALL); table_next(&at);) {
		const int length = table_name(at.row, 0, at.index, each);

		if (length < 0 || strcmp(each + strlen("pokeys.0."), name))
			continue;
		*instead = instead_of(at.row->name);
		return true;
	}
	return false;
}

static uint64_t natural(const uint8_t *at, size_t size)
{
	uint64_t value = 0;

	memcpy(&value, at, size);
	return value;
}

static int64_t integer(const uint8_t *at, size_t size)
{
	const uint64_t value = natural(at, size), sign = UINT64_C(1) << (8 * size - 1);

	return (int64_t)((value ^ sign) - sign);
}

static double real(const uint8_t *at, size_t size)
{
	float single;
	double number;

	if (size == sizeof(number)) {
		memcpy(&number, at, sizeof(number));
		return number;
	}
	memcpy(&single, at, sizeof(single));
	return (double)single;
}

/* A text in an image need not be NUL terminated. */
static void take_text(struct model_value *value, const uint8_t *at, size_t size)
{
	const size_t most = size < MODEL_TEXT_MAX ? size : MODEL_TEXT_MAX - 1;

	value->kind = MODEL_STRING;
	memcpy(value->string, at, most);
	value->string[most] = '\0';
}

static void take_address(struct model_value *value, uint64_t address)
{
	value->kind = address ? MODEL_STRING : MODEL_UNKNOWN;
	snprintf(value->string, sizeof(value->string), "%u.%u.%u.%u",
		 (unsigned int)(address >> 24 & 255), (unsigned int)(address >> 16 & 255),
		 (unsigned int)(address >> 8 & 255), (unsigned int)(address & 255));
}

static void take_real(struct model_value *value, double number)
{
	value->kind = isfinite(number) ? MODEL_REAL : MODEL_UNKNOWN;
	value->real = number;
}

static void take_age(struct model_value *value, uint64_t t_ns, uint64_t now_ns)
{
	const uint64_t age = pokeys_age_ns(t_ns, now_ns);

	take_real(value, age == POKEYS_NEVER ? (double)INFINITY : (double)age);
}

static void take_quantile(struct model_value *value, const uint8_t *at, double quantile)
{
	struct pokeys_histogram histogram;

	memcpy(&histogram, at, sizeof(histogram));
	if (histogram.count)
		take_real(value, (double)pokeys_histogram_percentile(&histogram, quantile));
}

static void take(const struct model_row *row, const uint8_t *at, unsigned int bit, uint64_t now_ns,
		 struct model_value *value)
{
	switch ((enum model_type)row->type) {
	case MODEL_BIT:
		value->kind = MODEL_BOOLEAN;
		value->boolean = at[bit / 8] >> bit % 8 & 1;
		break;
	case MODEL_FLAG:
		value->kind = MODEL_BOOLEAN;
		value->boolean = *at;
		break;
	case MODEL_UNSIGNED:
		value->kind = MODEL_NATURAL;
		value->natural = natural(at, row->size);
		break;
	case MODEL_SIGNED:
		value->kind = MODEL_INTEGER;
		value->integer = integer(at, row->size);
		break;
	case MODEL_FLOAT:
		take_real(value, real(at, row->size));
		break;
	case MODEL_TEXT:
		take_text(value, at, row->size);
		break;
	case MODEL_ADDRESS:
		take_address(value, natural(at, row->size));
		break;
	case MODEL_AGE:
		take_age(value, natural(at, row->size), now_ns);
		break;
	case MODEL_QUANTILE:
		take_quantile(value, at, row->quantile);
		break;
	case MODEL_TYPES:
		break;
	}
}

static double as_real(const struct model_value *value)
{
	return value->kind == MODEL_NATURAL ? (double)value->natural :
	       value->kind == MODEL_INTEGER ? (double)value->integer :
					      value->real;
}

void model_read(const struct model_row *row, unsigned int index, const struct model_images *images,
		struct model_value *value)
{
	const unsigned int inner = row->inner ? row->inner : 1;
	const unsigned int place = index / inner * row->stride + index % inner * row->inner_stride;
	const uint8_t *image = images->image[row->image], *at;
	uint64_t whole;

	memset(value, 0, sizeof(*value));
	if (!image)
		return;
	at = image + row->offset + (row->type == MODEL_BIT ? 0 : place);
	take(row, at, row->first_bit + place, images->now_ns, value);
	if (row->word && value->kind == MODEL_NATURAL)
		value->word = row->word((uint8_t)value->natural);
	if (row->factor != 0 && value->kind != MODEL_UNKNOWN)
		take_real(value, as_real(value) * row->factor);
	if (row->whole && value->kind != MODEL_UNKNOWN) {
		whole = natural(image + row->whole, sizeof(uint32_t));
		take_real(value, whole ? as_real(value) / (double)whole : 0);
	}
}

unsigned int model_board_terminal(const struct model_row *row, unsigned int index, uint8_t hardware,
				  const char **label)
{
	const struct wire_labels *labels = wire_labels(hardware);
	const struct wire_model *model = wire_model(hardware);
	unsigned int terminal = 0;

	*label = NULL;
	if (!model->known)
		return 0;
	if (row->terminal == MODEL_PIN)
		terminal = index + 1;
	else if (row->terminal == MODEL_ANALOG)
		terminal = index + WIRE_ANALOG_FIRST_PIN;
	else if (row->terminal == MODEL_PWM)
		terminal = index < WIRE_MODEL_PWMS ? model->pinmap->pwm_pin[index] : 0;
	else if (row->terminal == MODEL_OUTPUT && labels && index < WIRE_LABEL_OUTPUTS)
		*label = labels->output[index];
	if (terminal > model->pins)
		return 0;
	if (terminal && labels)
		*label = labels->terminal[terminal];
	return terminal;
}
