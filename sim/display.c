// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Character display (protocol section 3.11). Nothing reads it back over the
 * network, so what it shows is kept as text for whoever looks at the bench.
 * In 0xD0 the option 0 writes and 1 reads, the other way round than elsewhere.
 */
#include "sim/request.h"

void sim_panel_reset(struct sim_device *dev)
{
	memset(&dev->panel, 0, sizeof(dev->panel));
	memset(dev->panel.text, ' ', sizeof(dev->panel.text));
}

SIM_HANDLER(sim_do_lcd_setup)
{
	struct sim_panel_config *panel = &dev->config.panel;

	if (rq[P1] == 0 && !sim_locked(dev)) {
		panel->lcd_on = rq[P2];
		panel->lcd_rows = rq[P3];
		panel->lcd_columns = rq[P4];
	}
	rp[P2] = panel->lcd_on;
	rp[P3] = panel->lcd_rows;
	rp[P4] = panel->lcd_columns;
	return SIM_ANSWER;
}

static void put_char(struct sim_panel *panel, uint8_t c)
{
	if (panel->row < SIM_LCD_ROWS && panel->column < SIM_LCD_COLUMNS)
		panel->text[panel->row][panel->column] = (char)c;
	if (panel->column < SIM_LCD_COLUMNS)
		panel->column++;
}

static void print(struct sim_panel *panel, const uint8_t *text, unsigned int most)
{
	for (unsigned int i = 0; i < most && text[i]; i++)
		put_char(panel, text[i]);
}

static void clear(struct sim_panel *panel)
{
	memset(panel->text, ' ', sizeof(panel->text));
	panel->row = 0;
	panel->column = 0;
}

static void set_cursor(struct sim_panel *panel, uint8_t column, uint8_t row)
{
	panel->column = column ? (uint8_t)(column - 1) : 0;
	panel->row = row ? (uint8_t)(row - 1) : 0;
}

/* A whole row at once, blank where the text ends. */
static void put_row(struct sim_panel *panel, uint8_t row, const uint8_t *text)
{
	if (!row || row > SIM_LCD_ROWS)
		return;
	memset(panel->text[row - 1], ' ', SIM_LCD_COLUMNS);
	for (unsigned int i = 0; i < SIM_LCD_COLUMNS && text[i]; i++)
		panel->text[row - 1][i] = (char)text[i];
}

/* Commands of the display's own controller: clear, home, set address. */
static void command(struct sim_panel *panel, uint8_t byte)
{
	static const uint8_t row_at[SIM_LCD_ROWS] = { 0x00, 0x40, 0x14, 0x54 };

	if (byte == 0x01)
		clear(panel);
	else if (byte == 0x02 || byte == 0x03)
		set_cursor(panel, 1, 1);
	for (uint8_t row = 0; (byte & 0x80) && row < SIM_LCD_ROWS; row++) {
		uint8_t at = (uint8_t)((byte & 0x7F) - row_at[row]);

		if (at < SIM_LCD_COLUMNS)
			set_cursor(panel, (uint8_t)(at + 1), (uint8_t)(row + 1));
	}
}

SIM_HANDLER(sim_do_lcd)
{
	struct sim_panel *panel = &dev->panel;

	(void)rp;
	switch (rq[P1]) {
	case 0x00:
		sim_panel_reset(dev);
		break;
	case 0x10:
		clear(panel);
		break;
	case 0x20:
		set_cursor(panel, rq[P2], rq[P3]);
		break;
	case 0x30:
		print(panel, rq + 8, SIM_LCD_COLUMNS);
		break;
	case 0x31:
		put_char(panel, rq[8]);
		break;
	case 0x40:
		memcpy(panel->custom[rq[8] % 8], rq + 9, 8);
		break;
	case 0x50:
		memcpy(panel->entry_mode, rq + 8, sizeof(panel->entry_mode));
		break;
	case 0x60:
		memcpy(panel->display, rq + 8, sizeof(panel->display));
		break;
	case 0x61:
		command(panel, rq[P2]);
		break;
	case 0x62:
		put_char(panel, rq[P2]);
		break;
	case 0x80:
		panel->buffered = rq[P2];
		break;
	case 0x85:
		put_row(panel, rq[P2], rq + 8);
		break;
	default:
		return SIM_ANSWER_UNKNOWN;
	}
	return SIM_ANSWER;
}
