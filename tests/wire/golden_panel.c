/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A 4 x 8 keyboard without key codes, an 8 x 8 LED display, a 4 x 20 LCD on
 * the secondary pins, and one LED of a strip.
 */

#include "tests/wire/golden.h"

#define KB_GET(name, OP, option_) \
	G(name, OP, V(kb_option_req, .option = (option_)), V(kb_codes_rep, .keyboard = 0))

#define KB(enable_) { \
	.enable = (enable_), .size = 0x73, \
	.row_pin = { 22, 23, 24, 25, 26, 27, 28, 29 }, \
	.column_pin = { 30, 31, 32, 33, 34, 35, 36, 37 }, \
	.row_pin_high = { X8(0xFF) } }
#define KB_SET(name, enable) \
	G(name, KB_CONFIG_SET, V(kb_config_set_req, .config = KB(enable)), \
	  V(kb_config_rep, .config = KB(enable)))

const struct golden golden_panel[] = {
	G("MatrixKBConfigurationGet/1:0xCA/0x0A", KB_CONFIG_GET, V(kb_option_req, .option = 10),
	  V(kb_config_rep, .keyboard = 0)),
	KB_GET("MatrixKBConfigurationGet/2:0xCA/0x0C", KB_CODES_GET, 12),
	KB_GET("MatrixKBConfigurationGet/3:0xCA/0x20", KB_UP_CODES_GET, 32),
	KB_GET("MatrixKBConfigurationGet/4:0xCA/0x0D", KB_CODES_GET, 13),
	KB_GET("MatrixKBConfigurationGet/5:0xCA/0x21", KB_UP_CODES_GET, 33),
	KB_GET("MatrixKBConfigurationGet/6:0xCA/0x0E", KB_CODES_GET, 14),
	KB_GET("MatrixKBConfigurationGet/7:0xCA/0x22", KB_UP_CODES_GET, 34),
	KB_GET("MatrixKBConfigurationGet/8:0xCA/0x0F", KB_CODES_GET, 15),
	KB_GET("MatrixKBConfigurationGet/9:0xCA/0x23", KB_UP_CODES_GET, 35),
	KB_GET("MatrixKBConfigurationGet/10:0xCA/0x10", KB_CODES_GET, 16),
	KB_GET("MatrixKBConfigurationGet/11:0xCA/0x24", KB_UP_CODES_GET, 36),
	KB_GET("MatrixKBConfigurationGet/12:0xCA/0x11", KB_CODES_GET, 17),
	KB_GET("MatrixKBConfigurationGet/13:0xCA/0x25", KB_UP_CODES_GET, 37),
	KB_GET("MatrixKBConfigurationGet/14:0xCA/0x12", KB_CODES_GET, 18),
	KB_GET("MatrixKBConfigurationGet/15:0xCA/0x26", KB_UP_CODES_GET, 38),
	KB_GET("MatrixKBConfigurationGet/16:0xCA/0x13", KB_CODES_GET, 19),
	KB_GET("MatrixKBConfigurationGet/17:0xCA/0x27", KB_UP_CODES_GET, 39),
	KB_SET("MatrixKBConfigurationSet/1:0xCA/0x01", 0),
	G("MatrixKBConfigurationSet/2:0xCA/0x32", KB_SCAN, V(kb_scan_req, .scan = 0),
	  V(kb_scan_rep, .keyboard = 0)),
	KB_SET("MatrixKBConfigurationSet/3:0xCA/0x01", 1),
	KB_SET("ref2020:MatrixKBConfigurationSet/1:0xCA/0x01", 0),
	KB_SET("ref2020:MatrixKBConfigurationSet/2:0xCA/0x01", 1),
	/* keys 0 and 39 are down */
	G("MatrixKBStatusGet/1:0xCA/0x14", KB_STATUS, V(kb_status_req, .keyboard = 0),
	  V(kb_status_rep, .key = { [0] = 0x01, [4] = 0x80 })),
	G("MatrixLEDConfigurationGet/1:0xD5", LED_CONFIG,
	  V(led_config_req, .option = WIRE_LED_CONFIG_READ), V(led_config_rep, .enable = 0)),
	G("MatrixLEDConfigurationSet/1:0xD5", LED_CONFIG,
	  V(led_config_req, .option = WIRE_LED_CONFIG_WRITE, .enable = 1, .size = { 0x88, 0 }),
	  V(led_config_rep, .enable = 1, .size = { 0x88, 0 })),
	/* a diagonal */
	G("MatrixLEDUpdate/1:0xD6", LED_UPDATE,
	  V(led_update_req, .option = WIRE_LED_ALL,
	    .rows = { 0x01, 0x02, 0x04, 0x08, 0x10, 0x20, 0x40, 0x80 }),
	  NULL),
	G("LCDConfigurationGet/1:0xD0", LCD_CONFIG, V(lcd_config_req, .option = 1),
	  V(lcd_config_rep, .mode = 0)),
	G("LCDConfigurationSet/1:0xD0", LCD_CONFIG,
	  V(lcd_config_req, .option = 0, .mode = 2, .rows = 4, .columns = 20),
	  V(lcd_config_rep, .mode = 2, .rows = 4, .columns = 20)),
	G("LCDConfigurationSet/2:0xD1/0x00", LCD_INIT, NULL, NULL),
	G("LCDConfigurationSet/3:0xD1/0x10", LCD_CLEAR, NULL, NULL),
	G("LCDChangeMode/1:0xD1/0x80", LCD_MODE, V(lcd_byte_req, .value = WIRE_LCD_BUFFERED), NULL),
	G("LCDUpdate/1:0xD1/0x85", LCD_ROW,
	  V(lcd_row_req, .row = 1, .text = "Hello PoKeys line 1 "), NULL),
	G("LCDMoveCursor/1:0xD1/0x20", LCD_CURSOR, V(lcd_cursor_req, .column = 5, .row = 2), NULL),
	G("LCDPrint/1:0xD1/0x30", LCD_PRINT, V(lcd_print_req, .text = "abc"), NULL),
	/* LED 0: three bytes, no reply */
	G("WS2812_SendLEDdata(noresp)/1:0x4B", STRIP_DATA,
	  V(strip_data_req, .first = 0, .count = 1, .data = { 0x33, 0x22, 0x11 }), NULL),
	{ .name = NULL },
};
