/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Keyboards: the matrix at the device's pins, and the kbd48CNC on PoNET.
 *
 * Keys of the kbd48CNC are numbered 4 * column + row, as the older userspace
 * component had them, and under its names. Lamps and brightness stay untouched
 * until somebody asks for something.
 */
#include "halbridge/table_rows.h"

static const struct table_row rows[] = {
	{ ROW_COMMON("matrix.%02u.%02u", PIN, OUT, READ, matrix.key[0]), .stride = SETTINGS_COLUMNS,
	  .count = SETTINGS_ROWS, .inner = SETTINGS_COLUMNS, .inner_stride = 1,
	  .help = "key of the matrix keyboard: row, column" },
	ROW("matrix.enabled", PIN, OUT, READ, matrix.enabled, "the device scans it"),
	ROW("matrix.enable", PARAM, RW, WRITE, set.matrix.enable,
	    "device setting: scan a matrix keyboard", SETTING(0, 1)),
	ROW("matrix.rows", PARAM, RW, WRITE, set.matrix.rows, "device setting: rows",
	    SETTING(1, SETTINGS_ROWS)),
	ROW("matrix.columns", PARAM, RW, WRITE, set.matrix.columns, "device setting: columns",
	    SETTING(1, SETTINGS_COLUMNS)),
	LIST("matrix.row-pin.%02u", PARAM, RW, WRITE, set.matrix.row_pin, SETTINGS_ROWS,
	     "device setting: pin of the row, 0 is pin 1", SETTING(0, POKEYS_PINS - 1), APART),
	LIST("matrix.column-pin.%02u", PARAM, RW, WRITE, set.matrix.column_pin, SETTINGS_COLUMNS,
	     "device setting: pin of the column, 0 is pin 1", SETTING(0, POKEYS_PINS - 1), APART),

	LIST("kbd48CNC.%02u.Button", PIN, OUT, READ, kbd48.button, VALUES_KEYS,
	     "key 4 * column + row is pressed"),
	LIST("kbd48CNC.%02u.LED", PIN, IN, WRITE, kbd48.led, VALUES_KEYS,
	     "its lamp; all are commanded once one has been true"),
	ROW("kbd48CNC.present", PIN, OUT, READ, kbd48.present, "a kbd48CNC is present"),
	ROW("kbd48CNC.module", PIN, OUT, READ, kbd48.module, "which PoNET module it is; 255 none"),
	ROW("kbd48CNC.light", PIN, OUT, READ, kbd48.light, "ambient light, 0..255"),
	ROW("kbd48CNC.brightness", PARAM, RW, WRITE, kbd48.brightness,
	    "brightness of its lamps; -1 leaves it unchanged", PARAMETER(-1, -1, 255)),
	ROW("kbd48CNC.auto-brightness", PARAM, RW, WRITE, kbd48.auto_brightness,
	    "brightness is 255 - light", PARAMETER(0, 0, 1)),
	ROW("kbd48CNC.brightness-sent", PIN, OUT, WRITE, kbd48.brightness_sent,
	    "the brightness that was requested"),
};

TABLE_GROUP(table_keys, rows);
