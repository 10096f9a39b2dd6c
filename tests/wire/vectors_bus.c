/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Buses, sensors, keyboard and displays: protocol sections 3.9 to 3.20.
 *
 * Offsets are written down from there, independently of the layouts in wire/;
 * see vectors.h for how a wrong one shows.
 */

#include "tests/wire/vectors.h"
#include "wire/bus.h"
#include "wire/panel.h"

static void sensors_and_can_are_where_sections_3_18_and_3_20_say(void **state)
{
	REQ(sensor_setup, sensor_setup_req, set);
	REP(sensor_setup, sensor_setup_rep, got);
	REQ(sensor_values, sensor_values_req, ask);
	REP(sensor_values, sensor_values_rep, values);
	REQ(can_filter, can_filter_req, filter);
	REQ(can_queue, can_queue_req, confirm);
	REP(can_queue, can_queue_rep, queue);
	REP(can_read, can_read_rep, can);

	(void)state;
	AT(set.index, 2);
	AT(set.count, 3);
	AT(set.write, 4);
	AT(set.sensor[3].type, 44);
	AT(set.sensor[3].reading, 45);
	AT(set.sensor[3].refresh, 46);
	AT(set.sensor[3].failsafe, 47);
	ATBYTES(set.sensor[3].id, 48);
	AT(got.index, 2);
	AT(got.count, 3);
	ATBYTES(got.sensor[3].id, 48);
	AT(ask.index, 2);
	AT(ask.count, 3);
	AT16(values.ok, 4);
	AT32(values.value[12], 56);
	AT(filter.extended, 3);
	AT32(filter.id, 8);
	AT(confirm.confirm, 4);
	AT(queue.status, 3);
	AT(queue.queue_id, 4);
	AT32(queue.message[2].id, 38);
	ATBYTES(queue.message[2].data, 42);
	AT(queue.message[2].extended, 51);
	AT(queue.message[2].remote, 52);
	AT(can.available, 3);
	AT(can.message[0].extended, 21);
	AT(can.message[0].remote, 22);
}

static void buses_are_where_sections_3_12_to_3_17_say(void **state)
{
	REQ(poextbus, poextbus_req, ext);
	REP(poextbus, poextbus_rep, ext_is);
	REQ(i2c_write, i2c_write_req, i2c);
	REQ(i2c_activate, bus_op_req, on);
	REP(i2c_activate, bus_op_rep, on_is);
	REQ(uart_setup, uart_setup_req, uart);
	REQ(spi_setup, spi_setup_req, spi);
	REP(pocan_status, pocan_status_rep, pocan);
	REQ(pocan_enable, pocan_enable_req, enable);
	REQ(pocan_require, pocan_require_req, require);

	(void)state;
	AT(ext.option, 2);
	AT(ext.connector, 3);
	AT(ext.no_crc, 4);
	ATBYTES(ext.data, 8);
	AT(ext_is.status, 2);
	AT(ext_is.connector, 3);
	AT(ext_is.no_crc, 4);
	ATBYTES(ext_is.data, 8);
	AT(i2c.address, 3);
	AT(i2c.write_length, 4);
	AT(i2c.read_length, 5);
	ATBYTES(i2c.data, 8);
	AT(on.op, 2);
	AT(on_is.op, 2);
	AT(on_is.result, 3);
	AT(uart.interface, 3);
	AT(uart.format, 4);
	AT32(uart.baud, 8);
	AT(spi.prescaler, 3);
	AT(spi.format, 4);
	AT(pocan.enabled, 3);
	AT(pocan.available, 4);
	AT(pocan.pendant, 8);
	AT(pocan.kbd48, 9);
	AT(enable.enable, 3);
	AT(require.pendant, 8);
	AT(require.kbd48, 9);
}

static void ponet_is_where_section_3_13_says(void **state)
{
	REQ(ponet_settings, ponet_module_req, module);
	REP(ponet_version, ponet_version_rep, version);
	REQ(ponet_map, ponet_map_req, map);
	REQ(ponet_discovery, ponet_option_req, option);
	REP(ponet_discovery, ponet_found_rep, found);
	REP(ponet_data, ponet_data_rep, data);
	REQ(ponet_set_data, ponet_set_data_req, set);
	REQ(ponet_pwm, ponet_pwm_req, pwm);
	REP(ponet_light, ponet_light_rep, light);

	(void)state;
	AT(module.module, 3);
	AT(version.result, 3);
	AT(version.version, 8);
	AT(map.module, 3);
	AT(map.options, 4);
	AT(option.option, 3);
	AT(option.module, 4);
	AT(found.result, 3);
	AT(found.found, 8);
	AT(data.result, 3);
	AT(data.status, 8);
	ATBYTES(data.data, 9);
	AT(set.module, 3);
	ATBYTES(set.data, 8);
	AT(pwm.module, 3);
	AT(pwm.brightness, 4);
	AT(light.result, 3);
	AT(light.status, 8);
	AT(light.value, 9);
}

static void keyboard_is_where_section_3_9_says(void **state)
{
	REQ(kb_config_get, kb_option_req, ask);
	REQ(kb_status, kb_status_req, status);
	REP(kb_status, kb_status_rep, keys);
	REQ(kb_config_set, kb_config_set_req, set);
	REP(kb_config_get, kb_config_rep, got);
	REQ(kb_codes_set, kb_codes_set_req, codes);
	REP(kb_codes_get, kb_codes_rep, codes_are);
	REQ(kb_scan, kb_scan_req, scan);
	REP(kb_scan, kb_scan_rep, scan_is);

	(void)state;
	AT(ask.option, 2);
	AT(ask.keyboard, 3);
	AT(status.keyboard, 3);
	AT(keys.keyboard, 2);
	ATBYTES(keys.key, 8);
	AT(set.keyboard, 3);
	AT(set.config.enable, 8);
	AT(set.config.size, 9);
	ATBYTES(set.config.row_pin, 10);
	ATBYTES(set.config.column_pin, 18);
	ATBYTES(set.config.macros, 26);
	ATBYTES(set.config.row_pin_high, 42);
	AT(set.config.alternate_pin, 50);
	AT(got.keyboard, 2);
	AT(got.config.alternate_pin, 50);
	AT(got.scan, 51);
	AT(codes.option, 2);
	AT(codes.keyboard, 3);
	ATBYTES(codes.code, 8);
	ATBYTES(codes.modifier, 24);
	AT16(codes.triggered, 40);
	AT(codes_are.keyboard, 2);
	ATBYTES(codes_are.code, 8);
	ATBYTES(codes_are.modifier, 24);
	AT16(codes_are.triggered, 40);
	AT(scan.keyboard, 3);
	AT(scan.scan, 8);
	AT(scan_is.keyboard, 2);
}

static void displays_are_where_sections_3_10_and_3_11_say(void **state)
{
	REQ(lcd_char, lcd_char_req, one);
	REQ(lcd_custom, lcd_custom_req, custom);
	REQ(lcd_entry, lcd_entry_req, entry);
	REQ(lcd_display, lcd_display_req, display);
	REQ(lcd_command, lcd_byte_req, command);
	REQ(lcd_row, lcd_row_req, row);
	REQ(led_config, led_config_req, leds);
	REP(led_config, led_config_rep, leds_are);
	REQ(led_update, led_update_req, update);
	REQ(strip_data, strip_data_req, data);

	(void)state;
	AT(one.code, 8);
	AT(custom.code, 8);
	ATBYTES(custom.row, 9);
	AT(entry.right, 8);
	AT(entry.shift, 9);
	AT(display.display, 8);
	AT(display.cursor, 9);
	AT(display.blink, 10);
	AT(command.value, 3);
	AT(row.row, 3);
	ATTEXT(row.text, 8);
	AT(leds.option, 2);
	AT(leds.enable, 3);
	ATBYTES(leds.size, 4);
	AT(leds_are.enable, 3);
	ATBYTES(leds_are.size, 4);
	AT(update.option, 2);
	AT(update.row, 3);
	AT(update.column, 4);
	ATBYTES(update.rows, 8);
	AT16(data.first, 3);
	AT(data.count, 5);
	ATBYTES(data.data, 8);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(sensors_and_can_are_where_sections_3_18_and_3_20_say),
		cmocka_unit_test(buses_are_where_sections_3_12_to_3_17_say),
		cmocka_unit_test(ponet_is_where_section_3_13_says),
		cmocka_unit_test(keyboard_is_where_section_3_9_says),
		cmocka_unit_test(displays_are_where_sections_3_10_and_3_11_say),
	};

	return cmocka_run_group_tests(tests, vectors_count, NULL);
}
