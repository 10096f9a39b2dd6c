/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Matrix keyboard: what is read, what is wanted, what is written (protocol
 * section 3.9).
 *
 * Rows above the eighth have their pins elsewhere in the block, sizes are one
 * less than what people count. The key macros and the pins of rows and columns
 * that are not in use go back as they came.
 */

#include <string.h>
#include "daemon/device/internal.h"

enum { LOW_ROWS = 8 };

static bool has_matrix(const struct device *device, unsigned int index)
{
	(void)index;
	return device->image.capability.matrix_keyboard > 0;
}

static bool matrix_wanted(const struct pokeys_settings *want, unsigned int index)
{
	(void)index;
	return want->set & POKEYS_SET_MATRIX;
}

static void matrix_ask(unsigned int index, union setting_request *request)
{
	setting_ask_zeros(index, request);
	request->matrix_get.option = WIRE_KB_READ_CONFIG;
}

static uint64_t matrix_merge(const struct pokeys_settings *want, unsigned int index,
			     const union setting_value *value, union setting_request *request)
{
	struct wire_kb_config *config = &request->matrix_set.config;

	memset(request, 0, sizeof(*request));
	*config = value->matrix.config;
	if (!matrix_wanted(want, index))
		return 0;
	config->enable = want->matrix_enable;
	config->size = (uint8_t)((want->matrix_rows - 1) | (want->matrix_columns - 1) << 4);
	for (unsigned int i = 0; i < want->matrix_rows && i < LOW_ROWS; i++)
		config->row_pin[i] = want->matrix_row_pin[i];
	for (unsigned int i = LOW_ROWS; i < want->matrix_rows; i++)
		config->row_pin_high[i - LOW_ROWS] = want->matrix_row_pin[i];
	for (unsigned int i = 0; i < want->matrix_columns; i++)
		config->column_pin[i] = want->matrix_column_pin[i];
	return memcmp(config, &value->matrix.config, sizeof(*config)) != 0;
}

static void matrix_learn(struct device *device, unsigned int index,
			 const union setting_value *value)
{
	(void)index;
	device->image.matrix_enabled = value->matrix.config.enable;
}

static void matrix_report(struct pokeys_settings *known, unsigned int index,
			  const union setting_value *value)
{
	const struct wire_kb_config *config = &value->matrix.config;

	(void)index;
	known->set |= POKEYS_SET_MATRIX;
	known->matrix_enable = config->enable;
	known->matrix_rows = (uint8_t)((config->size & 0x0F) + 1);
	known->matrix_columns = (uint8_t)((config->size >> 4) + 1);
	memcpy(known->matrix_row_pin, config->row_pin, LOW_ROWS);
	memcpy(known->matrix_row_pin + LOW_ROWS, config->row_pin_high, LOW_ROWS);
	memcpy(known->matrix_column_pin, config->column_pin, sizeof(config->column_pin));
}

static int64_t matrix_written(const union setting_value *value, unsigned int which)
{
	(void)which;
	return value->matrix.config.enable | value->matrix.config.size << 8;
}

const struct setting_kind setting_matrix = {
	.read = WIRE_OP_KB_CONFIG_GET,
	.write = WIRE_OP_KB_CONFIG_SET,
	.name = POKEYS_SETTING_MATRIX,
	.has = has_matrix,
	.wanted = matrix_wanted,
	.ask = matrix_ask,
	.merge = matrix_merge,
	.learn = matrix_learn,
	.report = matrix_report,
	.written = matrix_written,
};
