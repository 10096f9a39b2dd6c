/* SPDX-License-Identifier: MIT */
/*
 * Where the fields of wire/panel.h stand in the packet: protocol sections 3.9
 * to 3.11. Replies of these operations do not repeat their option: 0xCA has
 * the keyboard's id there, 0xD1 nothing.
 */

#include "wire/panel.h"
#include "wire/layout.h"

WIRE_LAYOUT(strip_data_req,
	WIRE_F(strip_data_req, first, 3),
	WIRE_N(strip_data_req, count, 5, WIRE_STRIP_DATA / 3),
	WIRE_F(strip_data_req, data, 8));

WIRE_LAYOUT(kb_option_req,
	WIRE_F(kb_option_req, option, 2),
	WIRE_F(kb_option_req, keyboard, 3));

#define KB_CONFIG(tag) \
	WIRE_F(tag, config.enable, 8), \
	WIRE_F(tag, config.size, 9), \
	WIRE_F(tag, config.row_pin, 10), \
	WIRE_F(tag, config.column_pin, 18), \
	WIRE_F(tag, config.macros, 26), \
	WIRE_F(tag, config.row_pin_high, 42), \
	WIRE_F(tag, config.alternate_pin, 50)

WIRE_LAYOUT(kb_config_set_req,
	WIRE_F(kb_config_set_req, keyboard, 3),
	KB_CONFIG(kb_config_set_req));
WIRE_LAYOUT(kb_config_rep,
	WIRE_F(kb_config_rep, keyboard, 2),
	KB_CONFIG(kb_config_rep),
	WIRE_F(kb_config_rep, scan, 51));

WIRE_LAYOUT(kb_codes_set_req,
	WIRE_F(kb_codes_set_req, option, 2),
	WIRE_F(kb_codes_set_req, keyboard, 3),
	WIRE_F(kb_codes_set_req, code, 8),
	WIRE_F(kb_codes_set_req, modifier, 24),
	WIRE_F(kb_codes_set_req, triggered, 40));
WIRE_LAYOUT(kb_codes_rep,
	WIRE_F(kb_codes_rep, keyboard, 2),
	WIRE_F(kb_codes_rep, code, 8),
	WIRE_F(kb_codes_rep, modifier, 24),
	WIRE_F(kb_codes_rep, triggered, 40));

WIRE_LAYOUT(kb_status_req,
	WIRE_F(kb_status_req, keyboard, 3));
WIRE_LAYOUT(kb_status_rep,
	WIRE_F(kb_status_rep, keyboard, 2),
	WIRE_F(kb_status_rep, key, 8));
WIRE_LAYOUT(kb_scan_req,
	WIRE_F(kb_scan_req, keyboard, 3),
	WIRE_F(kb_scan_req, scan, 8));
WIRE_LAYOUT(kb_scan_rep,
	WIRE_F(kb_scan_rep, keyboard, 2));

WIRE_LAYOUT(lcd_config_req,
	WIRE_F(lcd_config_req, option, 2),
	WIRE_F(lcd_config_req, mode, 3),
	WIRE_F(lcd_config_req, rows, 4),
	WIRE_F(lcd_config_req, columns, 5));
WIRE_LAYOUT(lcd_config_rep,
	WIRE_F(lcd_config_rep, mode, 3),
	WIRE_F(lcd_config_rep, rows, 4),
	WIRE_F(lcd_config_rep, columns, 5));
WIRE_LAYOUT(lcd_cursor_req,
	WIRE_F(lcd_cursor_req, column, 3),
	WIRE_F(lcd_cursor_req, row, 4));
WIRE_LAYOUT(lcd_print_req,
	WIRE_TEXT(lcd_print_req, text, 8));
WIRE_LAYOUT(lcd_char_req,
	WIRE_F(lcd_char_req, code, 8));
WIRE_LAYOUT(lcd_custom_req,
	WIRE_F(lcd_custom_req, code, 8),
	WIRE_F(lcd_custom_req, row, 9));
WIRE_LAYOUT(lcd_entry_req,
	WIRE_F(lcd_entry_req, right, 8),
	WIRE_F(lcd_entry_req, shift, 9));
WIRE_LAYOUT(lcd_display_req,
	WIRE_F(lcd_display_req, display, 8),
	WIRE_F(lcd_display_req, cursor, 9),
	WIRE_F(lcd_display_req, blink, 10));
WIRE_LAYOUT(lcd_byte_req,
	WIRE_F(lcd_byte_req, value, 3));
WIRE_LAYOUT(lcd_row_req,
	WIRE_F(lcd_row_req, row, 3),
	WIRE_TEXT(lcd_row_req, text, 8));

WIRE_LAYOUT(led_config_req,
	WIRE_F(led_config_req, option, 2),
	WIRE_F(led_config_req, enable, 3),
	WIRE_F(led_config_req, size, 4));
WIRE_LAYOUT(led_config_rep,
	WIRE_F(led_config_rep, enable, 3),
	WIRE_F(led_config_rep, size, 4));
WIRE_LAYOUT(led_update_req,
	WIRE_F(led_update_req, option, 2),
	WIRE_F(led_update_req, row, 3),
	WIRE_F(led_update_req, column, 4),
	WIRE_F(led_update_req, rows, 8));
