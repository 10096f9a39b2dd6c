/* SPDX-License-Identifier: MIT */
#ifndef WIRE_PANEL_H
#define WIRE_PANEL_H

/*
 * Matrix keyboard, matrix LED, LCD and LED strip: protocol sections 3.9 to
 * 3.11, 0x4B of 3.23. Rows, columns and pins are 0-based unless said.
 */

#include "wire/op.h"

/* 0x4B/10: the one request no device answers. */
#define WIRE_STRIP_DATA 55
struct wire_strip_data_req {
	uint16_t first;                /* LED */
	uint8_t count;                 /* of LEDs in data, limited to 18 */
	uint8_t data[WIRE_STRIP_DATA]; /* three bytes each */
};

/* 0xCA. Reading configuration or codes: */
struct wire_kb_option_req {
	uint8_t option;   /* 10 config, 12..19 codes, 32..39 up codes */
	uint8_t keyboard; /* id */
};
#define WIRE_KB_READ_CONFIG 10
#define WIRE_KB_READ_CODES 12
#define WIRE_KB_READ_UP_CODES 32

struct wire_kb_config {
	uint8_t enable;
	uint8_t size; /* low nibble rows - 1, high nibble columns - 1 */
	uint8_t row_pin[8];
	uint8_t column_pin[8];
	uint8_t macros[16];      /* bitmap of keys */
	uint8_t row_pin_high[8]; /* rows 8..15 */
	uint8_t alternate_pin;   /* pin + 1 */
};
struct wire_kb_config_set_req {
	uint8_t keyboard;
	struct wire_kb_config config;
};
struct wire_kb_config_rep {
	uint8_t keyboard;
	struct wire_kb_config config;
	uint8_t scan; /* decimation */
};

/* Codes of 16 keys, block 0..7: option 2 + block (down) or 22 + block (up). */
#define WIRE_KB_CODES 16
struct wire_kb_codes_set_req {
	uint8_t option; /* 2..9 or 22..29 */
	uint8_t keyboard;
	uint8_t code[WIRE_KB_CODES];
	uint8_t modifier[WIRE_KB_CODES];
	uint16_t triggered; /* bitmap */
};
struct wire_kb_codes_rep {
	uint8_t keyboard;
	uint8_t code[WIRE_KB_CODES];
	uint8_t modifier[WIRE_KB_CODES];
	uint16_t triggered;
};

/* Key k = byte k/8 bit k%8; row r are keys 8r..8r+7 whatever the width. */
struct wire_kb_status_req {
	uint8_t keyboard;
};
struct wire_kb_status_rep {
	uint8_t keyboard;
	uint8_t key[16];
};

struct wire_kb_scan_req {
	uint8_t keyboard;
	uint8_t scan; /* decimation, 0..50 */
};
struct wire_kb_scan_rep {
	uint8_t keyboard;
};

/* 0xD0, 0xD1 (section 3.11) */
#define WIRE_LCD_CONFIG_WRITE 0
#define WIRE_LCD_CONFIG_READ 1
struct wire_lcd_config_req {
	uint8_t option;
	uint8_t mode; /* 0 off, 1 primary pins, 2 secondary pins */
	uint8_t rows, columns;
};
struct wire_lcd_config_rep {
	uint8_t mode;
	uint8_t rows, columns;
};
struct wire_lcd_cursor_req {
	uint8_t column, row; /* from 1 */
};
struct wire_lcd_print_req {
	char text[20 + 1];
};
struct wire_lcd_char_req {
	uint8_t code;
};
struct wire_lcd_custom_req {
	uint8_t code;
	uint8_t row[8];
};
struct wire_lcd_entry_req {
	uint8_t right;
	uint8_t shift;
};
struct wire_lcd_display_req {
	uint8_t display, cursor, blink;
};
/* 0x61 command, 0x62 data, 0x80 mode (0 direct, 1 buffered). */
#define WIRE_LCD_DIRECT 0
#define WIRE_LCD_BUFFERED 1
struct wire_lcd_byte_req {
	uint8_t value;
};
struct wire_lcd_row_req {
	uint8_t row;       /* from 1 */
	char text[24 + 1]; /* the vendor's library uses 20 */
};

/* 0xD5, 0xD6 (section 3.10) */
#define WIRE_LED_CONFIG_WRITE 0
#define WIRE_LED_CONFIG_READ 1
struct wire_led_config_req {
	uint8_t option;
	uint8_t enable;  /* bit 0 display 1, bit 1 display 2 */
	uint8_t size[2]; /* low nibble rows, high nibble columns, 1..8 */
};
struct wire_led_config_rep {
	uint8_t enable;
	uint8_t size[2];
};
#define WIRE_LED_ALL 1		/* + 10 for display 2 */
#define WIRE_LED_SET 5
#define WIRE_LED_RESET 6
#define WIRE_LED_DISPLAY2 10
struct wire_led_update_req {
	uint8_t option;
	uint8_t row, column;
	uint8_t rows[8]; /* bit 0 = left pixel */
};

WIRE_OPS_PANEL(WIRE_TYPED)

#endif
