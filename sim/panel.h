/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_PANEL_H
#define SIM_PANEL_H

#include <stdbool.h>
#include <stdint.h>

/* Matrix keyboard, character display, LED matrices (protocol sections 3.9 to 3.11). */

#define SIM_KEYS 128
#define SIM_LCD_ROWS 4
#define SIM_LCD_COLUMNS 20
#define SIM_LEDS 2

struct sim_panel_config {
	uint8_t keyboard[43];     /* 0xCA configuration block @8..50 */
	uint8_t scan;             /* scan decimation */
	uint8_t key_codes[8][34]; /* @8..41 of the blocks of 16 keys */
	uint8_t up_codes[8][34];
	uint8_t lcd_on, lcd_rows, lcd_columns;
	uint8_t led_on; /* bit = display */
	uint8_t led_size[SIM_LEDS];
};

struct sim_panel {
	char text[SIM_LCD_ROWS][SIM_LCD_COLUMNS];
	uint8_t row, column; /* cursor, 0-based */
	uint8_t custom[8][8];
	uint8_t entry_mode[2];
	uint8_t display[3]; /* on, cursor, blink */
	uint8_t buffered;
	uint8_t led[SIM_LEDS][8]; /* row bytes, bit 0 left */
};

struct sim_device;

void sim_panel_reset(struct sim_device *dev);

#endif
