// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Whatever is written comes back, from RAM at once, from flash after a reboot
 * if it was saved, and not otherwise. One row for each setting of the device.
 */
#include "tests/sim/talk.h"

struct row {
	const char *name;
	uint8_t op;
	uint8_t write[4];    /* parameters of the request which writes */
	uint8_t read[4];     /* and of the one which reads */
	uint8_t read_op;     /* when it is another operation; 0: the same */
	uint8_t first, last; /* payload bytes which are the setting, 0 none */
	uint8_t params;      /* parameter bytes compared, bit n = parameter n + 1 */
};

static const struct row rows[] = {
	{ "device name", 0x06, { 1, 1 }, { 0 }, 0, 8, 17, 0 },
	{ "long name", 0x06, { 1, 1 }, { 0 }, 0, 35, 54, 0 },
	{ "joystick name", 0x06, { 2 }, { 0 }, 0, 18, 33, 0 },
	{ "product offset", 0x06, { 8 }, { 4 }, 0, 34, 34, 0 },
	{ "misc usb", 0x0B, { 0x10 }, { 0 }, 0, 8, 14, 0 },
	{ "startup outputs", 0x1E, { 1, 1, 1 }, { 0 }, 0, 8, 14, 0 },
	{ "pin functions", 0xC0, { 1, 0 }, { 0, 0 }, 0, 8, 62, 0 },
	{ "pin options", 0xC0, { 0, 2 }, { 0, 1 }, 0, 8, 62, 0 },
	{ "key mapping", 0xC1, { 1 }, { 0 }, 0, 8, 62, 0 },
	{ "key codes", 0xC2, { 1 }, { 0 }, 0, 8, 62, 0 },
	{ "key modifiers", 0xC3, { 1 }, { 0 }, 0, 8, 62, 0 },
	{ "triggered map 1", 0xD7, { 1 }, { 11 }, 0, 8, 62, 0 },
	{ "triggered map 4", 0xD7, { 4 }, { 14 }, 0, 8, 62, 0 },
	{ "typematic delay", 0x21, { 1 }, { 0 }, 0, 8, 62, 0 },
	{ "counter directions", 0xD9, { 1 }, { 0 }, 0, 8, 62, 0 },
	{ "encoder options", 0xC4, { 1 }, { 0 }, 0, 8, 32, 0 },
	{ "encoder pins A", 0xC5, { 1 }, { 0 }, 0, 8, 32, 0 },
	{ "encoder pins B", 0xC5, { 1 }, { 0 }, 0, 33, 57, 0 },
	{ "encoder keys A", 0xC6, { 1 }, { 0 }, 0, 8, 32, 0 },
	{ "encoder keys B", 0xC7, { 1 }, { 0 }, 0, 33, 57, 0 },
	{ "ultra fast filter", 0x1C, { 1, 4 }, { 0xFF }, 0, 8, 11, 0x03 },
	{ "fast encoders", 0xCE, { 0x3A, 1 }, { 2 }, 0, 0, 0, 0x03 },
	{ "analog filter", 0x39, { 1, 2, 3, 4 }, { 0 }, 0x38, 0, 0, 0x0F },
	{ "pwm", 0xCB, { 1, 0 }, { 0 }, 0, 8, 36, 0 },
	{ "keyboard", 0xCA, { 1 }, { 10 }, 0, 8, 50, 0 },
	{ "key codes of keys 16..31", 0xCA, { 3 }, { 13 }, 0, 8, 41, 0 },
	{ "up codes of keys 112..127", 0xCA, { 29 }, { 39 }, 0, 8, 41, 0 },
	{ "led matrix", 0xD5, { 0, 3, 0x88, 0x44 }, { 1 }, 0, 0, 0, 0x0E },
	{ "display", 0xD0, { 0, 2, 4, 20 }, { 1 }, 0, 0, 0, 0x0E },
	{ "sensor 98", 0x76, { 98, 2, 1 }, { 98, 2, 0 }, 0, 8, 31, 0 },
	{ "failsafe", 0x81, { 1, 200, 0x0F }, { 0 }, 0, 8, 30, 0x06 },
	{ "network", 0xE0, { 10 }, { 0 }, 0, 9, 12, 0 },
	{ "modbus", 0xE4, { 10 }, { 0 }, 0, 8, 19, 0 },
	{ "udp map", 0xA2, { 1 }, { 2 }, 0, 8, 55, 0 },
	{ "server reports", 0xEF, { 10 }, { 0 }, 0, 8, 14, 0 },
	{ "first page of their header", 0xEF, { 11 }, { 1 }, 0, 8, 57, 0 },
	{ "last page of their header", 0xEF, { 15 }, { 5 }, 0, 8, 57, 0 },
	{ "engine emergency pin", 0x85, { 0x06, 1 }, { 0x06, 0 }, 0, 8, 8, 0 },
	{ "synced outputs", 0x85, { 0x0B, 1, 2 }, { 0x0B, 2 }, 0, 8, 15, 0x06 },
	{ "synced pwm", 0x85, { 0x0A, 1, 3, 5 }, { 0x0A, 2 }, 0, 0, 0, 0x0E },
	{ "axis 0", 0x85, { 0x11, 0 }, { 0x10, 0 }, 0, 8, 62, 0 },
	{ "axis 7", 0x85, { 0x11, 7 }, { 0x10, 7 }, 0, 8, 62, 0 },
	{ "internal drivers", 0x85, { 0x19 }, { 0x18 }, 0, 8, 15, 0 },
	{ "backlash", 0x85, { 0x41, 1, 9 }, { 0x40 }, 0, 8, 39, 0x06 },
	{ "postep comm", 0x85, { 0x50, 0x10, 1 }, { 0x50, 0 }, 0, 8, 31, 0x04 },
	{ "postep currents", 0x85, { 0x52, 0x10 }, { 0x52, 0 }, 0, 8, 55, 0 },
	{ "postep modes", 0x85, { 0x53, 0x10 }, { 0x53, 0 }, 0, 8, 55, 0 },
	{ "smart generator", 0x85, { 0x91 }, { 0x90 }, 0, 8, 62, 0 },
	{ "oem parameter 61", 0xFD, { 1, 61, 1 }, { 0, 61, 1 }, 0, 8, 11, 0 },
	{ "servo setup", 0x4A, { 0x01 }, { 0x00 }, 0, 8, 62, 0 },
	{ "servo channel 3", 0x4A, { 0x11, 3 }, { 0x10, 3 }, 0, 8, 62, 0 },
};

#define ROWS (sizeof(rows) / sizeof(rows[0]))

/* A value for payload byte i which differs from byte to byte and from `salt` to `salt`. */
static uint8_t pattern(unsigned int i, unsigned int salt)
{
	return (uint8_t)(i * 7 + salt * 31 + 1);
}

static void write_row(struct talk *t, const struct row *row, unsigned int salt)
{
	talk_begin(t, row->op, row->write[0], row->write[1], row->write[2], row->write[3]);
	for (unsigned int i = row->first; row->first && i <= row->last; i++)
		t->rq[i] = pattern(i, salt);
	talk_send(t);
}

static void read_row(struct talk *t, const struct row *row)
{
	talk_begin(t, row->read_op ? row->read_op : row->op, row->read[0], row->read[1],
		   row->read[2], row->read[3]);
	talk_send(t);
}

static int is_as_written(struct talk *t, const struct row *row, unsigned int salt)
{
	read_row(t, row);
	for (unsigned int i = row->first; row->first && i <= row->last; i++) {
		if (t->rp[i] != pattern(i, salt))
			return 0;
	}
	for (unsigned int i = 0; i < 4; i++) {
		if ((row->params >> i & 1) && t->rp[2 + i] != row->write[i])
			return 0;
	}
	return 1;
}

static void check(int good, const char *name)
{
	if (!good)
		fail_msg("%s", name);
}

static struct talk t;

static void what_is_written_is_read_back(void **state)
{
	(void)state;
	talk_start(&t, 0);
	for (unsigned int i = 0; i < ROWS; i++) {
		check(!is_as_written(&t, &rows[i], i), rows[i].name);
		write_row(&t, &rows[i], i);
		check(is_as_written(&t, &rows[i], i), rows[i].name);
	}
}

static void what_was_not_saved_is_lost_in_a_reboot(void **state)
{
	(void)state;
	for (unsigned int i = 0; i < ROWS; i++) {
		if (rows[i].op == 0xE0)
			continue;
		talk_start(&t, 0);
		write_row(&t, &rows[i], i);
		talk_ask(&t, 0xF3, 0, 0);
		check(!is_as_written(&t, &rows[i], i), rows[i].name);
	}
}

static void what_was_saved_survives_a_reboot(void **state)
{
	(void)state;
	for (unsigned int i = 0; i < ROWS; i++) {
		talk_start(&t, 0);
		write_row(&t, &rows[i], i);
		talk_ask(&t, 0x50, 0xAA, 0x55);
		talk_ask(&t, 0xF3, 0, 0);
		check(is_as_written(&t, &rows[i], i), rows[i].name);
		sim_device_reboot(&t.dev, t.now_ns, true);
		check(!is_as_written(&t, &rows[i], i), rows[i].name);
	}
}

static void a_locked_device_takes_no_setting(void **state)
{
	(void)state;
	talk_start(&t, 0);
	talk_ask(&t, 0x51, 0xAA, 0x55);
	assert_int_equal(talk_ask(&t, 0x03, 0, 0)[3], 1);
	assert_int_equal(talk_ask(&t, 0x00, 0, 0)[58], 1);
	for (unsigned int i = 0; i < ROWS; i++) {
		if (rows[i].op == 0xCB)
			continue; /* duties are set while running */
		write_row(&t, &rows[i], i);
		check(!is_as_written(&t, &rows[i], i), rows[i].name);
	}
	talk_ask(&t, 0x52, 0xAA, 0x55);
	assert_int_equal(talk_ask(&t, 0x03, 0, 0)[3], 0);
	for (unsigned int i = 0; i < ROWS; i++) {
		write_row(&t, &rows[i], i);
		check(is_as_written(&t, &rows[i], i), rows[i].name);
	}
}

static void a_save_needs_its_two_magic_bytes(void **state)
{
	(void)state;
	talk_start(&t, 0);
	talk_ask(&t, 0x50, 0xAA, 0x54);
	talk_ask(&t, 0x50, 0, 0);
	assert_int_equal(t.dev.stats.saves, 0);
	talk_ask(&t, 0x50, 0xAA, 0x55);
	assert_int_equal(t.dev.stats.saves, 1);
	talk_ask(&t, 0x51, 0, 0);
	assert_int_equal(talk_ask(&t, 0x03, 0, 0)[3], 0);
}

static void a_network_write_saves_by_itself(void **state)
{
	(void)state;
	talk_start(&t, 0);
	talk_begin(&t, 0xE0, 10, 0, 0, 0);
	wire_put_u16(t.rq + 17, 55);
	t.rq[27] = 1;
	t.rq[28] = 0xA3;
	assert_int_equal(talk_send(&t)[27], 0xA3);
	assert_int_equal(t.dev.stats.saves, 1);
	talk_ask(&t, 0xF3, 0, 0);
	assert_int_equal(wire_get_u16(talk_ask(&t, 0xE0, 0, 0) + 17), 55);
	assert_int_equal(t.rp[27], 0xA3);
}

static void network_options_need_their_mark(void **state)
{
	(void)state;
	talk_start(&t, 0);
	talk_begin(&t, 0xE0, 10, 0, 0, 0);
	t.rq[28] = 0x03;
	assert_int_equal(talk_send(&t)[27], 0xA0);
}

/* Set at 15, read at 17: the last answer of the server stands in between. */
static void the_port_of_server_reports_has_two_places(void **state)
{
	(void)state;
	talk_start(&t, 0);
	talk_begin(&t, 0xEF, 10, 0, 0, 0);
	wire_put_u16(t.rq + 15, 8080);
	talk_send(&t);
	talk_ask(&t, 0xEF, 0, 0);
	assert_int_equal(wire_get_u16(t.rp + 15), 0);
	assert_int_equal(wire_get_u16(t.rp + 17), 8080);
	talk_ask(&t, 0xEF, 6, 0);
	assert_int_equal(t.dev.stats.unknown, 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(what_is_written_is_read_back),
		cmocka_unit_test(what_was_not_saved_is_lost_in_a_reboot),
		cmocka_unit_test(what_was_saved_survives_a_reboot),
		cmocka_unit_test(a_locked_device_takes_no_setting),
		cmocka_unit_test(a_save_needs_its_two_magic_bytes),
		cmocka_unit_test(a_network_write_saves_by_itself),
		cmocka_unit_test(network_options_need_their_mark),
		cmocka_unit_test(the_port_of_server_reports_has_two_places),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
