/* SPDX-License-Identifier: MIT */
/*
 * Where the fields of wire/bus.h stand in the packet: protocol sections 3.12
 * to 3.20.
 *
 * Every length here comes from outside and is limited to the data which the
 * packet holds. Documentation and vendor library disagree on I2C (30 against
 * 32 bytes); the larger one is accepted.
 */

#include "wire/bus.h"
#include "wire/layout.h"

WIRE_LAYOUT(bus_result_rep,
	WIRE_F(bus_result_rep, result, 3));
WIRE_LAYOUT(bus_op_req,
	WIRE_F(bus_op_req, op, 2));
WIRE_LAYOUT(bus_op_rep,
	WIRE_F(bus_op_rep, op, 2),
	WIRE_F(bus_op_rep, result, 3));

#define SENSORS(tag) \
	WIRE_EACH(tag, sensor, type, 8, 12), \
	WIRE_EACH(tag, sensor, reading, 9, 12), \
	WIRE_EACH(tag, sensor, refresh, 10, 12), \
	WIRE_EACH(tag, sensor, failsafe, 11, 12), \
	WIRE_EACH(tag, sensor, id, 12, 12)

WIRE_LAYOUT(sensor_setup_req,
	WIRE_F(sensor_setup_req, index, 2),
	WIRE_N(sensor_setup_req, count, 3, WIRE_SENSOR_BLOCKS),
	WIRE_F(sensor_setup_req, write, 4),
	SENSORS(sensor_setup_req));
WIRE_LAYOUT(sensor_setup_rep,
	WIRE_F(sensor_setup_rep, index, 2),
	WIRE_N(sensor_setup_rep, count, 3, WIRE_SENSOR_BLOCKS),
	SENSORS(sensor_setup_rep));
WIRE_LAYOUT(sensor_values_req,
	WIRE_F(sensor_values_req, index, 2),
	WIRE_N(sensor_values_req, count, 3, WIRE_SENSOR_VALUES));
WIRE_LAYOUT(sensor_values_rep,
	WIRE_F(sensor_values_rep, index, 2),
	WIRE_N(sensor_values_rep, count, 3, WIRE_SENSOR_VALUES),
	WIRE_F(sensor_values_rep, ok, 4),
	WIRE_F(sensor_values_rep, value, 8));

#define CAN_MESSAGE(tag, stride) \
	WIRE_EACH(tag, message, id, 8, stride), \
	WIRE_EACH(tag, message, data, 12, stride), \
	WIRE_EACH_N(tag, message, length, 20, stride, 8), \
	WIRE_EACH(tag, message, extended, 21, stride), \
	WIRE_EACH(tag, message, remote, 22, stride)

WIRE_LAYOUT(can_setup_req,
	WIRE_F(can_setup_req, bitrate, 8));
WIRE_LAYOUT(can_filter_req,
	WIRE_F(can_filter_req, extended, 3),
	WIRE_F(can_filter_req, id, 8));
WIRE_LAYOUT(can_send_req,
	CAN_MESSAGE(can_send_req, 15));
WIRE_LAYOUT(can_queue_req,
	WIRE_F(can_queue_req, confirm, 4));
WIRE_LAYOUT(can_queue_rep,
	WIRE_F(can_queue_rep, status, 3),
	WIRE_F(can_queue_rep, queue_id, 4),
	CAN_MESSAGE(can_queue_rep, 15));
WIRE_LAYOUT(can_read_rep,
	WIRE_F(can_read_rep, available, 3),
	CAN_MESSAGE(can_read_rep, 15));

WIRE_LAYOUT(poextbus_req,
	WIRE_F(poextbus_req, option, 2),
	WIRE_F(poextbus_req, connector, 3),
	WIRE_F(poextbus_req, no_crc, 4),
	WIRE_F(poextbus_req, data, 8));
WIRE_LAYOUT(poextbus_rep,
	WIRE_F(poextbus_rep, status, 2),
	WIRE_F(poextbus_rep, connector, 3),
	WIRE_F(poextbus_rep, no_crc, 4),
	WIRE_F(poextbus_rep, data, 8));

WIRE_LAYOUT(i2c_write_req,
	WIRE_F(i2c_write_req, address, 3),
	WIRE_N(i2c_write_req, write_length, 4, WIRE_I2C_DATA),
	WIRE_N(i2c_write_req, read_length, 5, WIRE_I2C_DATA),
	WIRE_F(i2c_write_req, data, 8));
WIRE_LAYOUT(i2c_read_req,
	WIRE_F(i2c_read_req, address, 3),
	WIRE_N(i2c_read_req, length, 4, WIRE_I2C_DATA));
WIRE_LAYOUT(i2c_read_result_rep,
	WIRE_F(i2c_read_result_rep, result, 3),
	WIRE_F(i2c_read_result_rep, result_copy, 8),
	WIRE_N(i2c_read_result_rep, length, 9, WIRE_I2C_DATA),
	WIRE_F(i2c_read_result_rep, data, 10));
WIRE_LAYOUT(i2c_scan_result_rep,
	WIRE_F(i2c_scan_result_rep, result, 3),
	WIRE_F(i2c_scan_result_rep, result_copy, 8),
	WIRE_F(i2c_scan_result_rep, present, 9));

WIRE_LAYOUT(onewire_start_req,
	WIRE_N(onewire_start_req, write_length, 3, WIRE_ONEWIRE_DATA),
	WIRE_N(onewire_start_req, read_length, 4, WIRE_ONEWIRE_DATA),
	WIRE_F(onewire_start_req, pin, 5),
	WIRE_F(onewire_start_req, data, 8));
WIRE_LAYOUT(onewire_result_rep,
	WIRE_F(onewire_result_rep, status, 3),
	WIRE_F(onewire_result_rep, result, 8),
	WIRE_N(onewire_result_rep, length, 9, WIRE_ONEWIRE_DATA),
	WIRE_F(onewire_result_rep, data, 10));
WIRE_LAYOUT(onewire_scan_req,
	WIRE_F(onewire_scan_req, pin, 3));
WIRE_LAYOUT(onewire_scan_result_rep,
	WIRE_F(onewire_scan_result_rep, status, 3),
	WIRE_F(onewire_scan_result_rep, result, 8),
	WIRE_F(onewire_scan_result_rep, flags, 9),
	WIRE_F(onewire_scan_result_rep, rom, 10));

WIRE_LAYOUT(ponet_status_rep,
	WIRE_F(ponet_status_rep, result, 3),
	WIRE_F(ponet_status_rep, state, 8));
WIRE_LAYOUT(ponet_module_req,
	WIRE_F(ponet_module_req, module, 3));
WIRE_LAYOUT(ponet_settings_rep,
	WIRE_F(ponet_settings_rep, result, 3),
	WIRE_F(ponet_settings_rep, address, 8),
	WIRE_F(ponet_settings_rep, type, 9),
	WIRE_F(ponet_settings_rep, size, 10),
	WIRE_F(ponet_settings_rep, options, 11));
WIRE_LAYOUT(ponet_version_rep,
	WIRE_F(ponet_version_rep, result, 3),
	WIRE_F(ponet_version_rep, version, 8));
WIRE_LAYOUT(ponet_map_req,
	WIRE_F(ponet_map_req, module, 3),
	WIRE_F(ponet_map_req, options, 4));
WIRE_LAYOUT(ponet_option_req,
	WIRE_F(ponet_option_req, option, 3),
	WIRE_F(ponet_option_req, module, 4));
WIRE_LAYOUT(ponet_found_rep,
	WIRE_F(ponet_found_rep, result, 3),
	WIRE_F(ponet_found_rep, found, 8));
WIRE_LAYOUT(ponet_data_rep,
	WIRE_F(ponet_data_rep, result, 3),
	WIRE_F(ponet_data_rep, status, 8),
	WIRE_F(ponet_data_rep, data, 9));
WIRE_LAYOUT(ponet_set_data_req,
	WIRE_F(ponet_set_data_req, module, 3),
	WIRE_F(ponet_set_data_req, data, 8));
WIRE_LAYOUT(ponet_light_rep,
	WIRE_F(ponet_light_rep, result, 3),
	WIRE_F(ponet_light_rep, status, 8),
	WIRE_F(ponet_light_rep, value, 9));
WIRE_LAYOUT(ponet_pwm_req,
	WIRE_F(ponet_pwm_req, module, 3),
	WIRE_F(ponet_pwm_req, brightness, 4));

WIRE_LAYOUT(uart_setup_req,
	WIRE_F(uart_setup_req, interface, 3),
	WIRE_F(uart_setup_req, format, 4),
	WIRE_F(uart_setup_req, baud, 8));
WIRE_LAYOUT(uart_send_req,
	WIRE_F(uart_send_req, interface, 3),
	WIRE_N(uart_send_req, count, 4, WIRE_UART_DATA),
	WIRE_F(uart_send_req, data, 8));
WIRE_LAYOUT(uart_send_rep,
	WIRE_F(uart_send_rep, queued, 3));
WIRE_LAYOUT(uart_read_req,
	WIRE_F(uart_read_req, interface, 3));
WIRE_LAYOUT(uart_read_rep,
	WIRE_N(uart_read_rep, count, 3, WIRE_UART_DATA),
	WIRE_F(uart_read_rep, data, 8));

WIRE_LAYOUT(spi_setup_req,
	WIRE_F(spi_setup_req, prescaler, 3),
	WIRE_F(spi_setup_req, format, 4));
WIRE_LAYOUT(spi_write_req,
	WIRE_N(spi_write_req, length, 3, WIRE_SPI_DATA),
	WIRE_F(spi_write_req, select_pin, 4),
	WIRE_F(spi_write_req, data, 8));
WIRE_LAYOUT(spi_read_req,
	WIRE_N(spi_read_req, length, 3, WIRE_SPI_DATA));
WIRE_LAYOUT(spi_read_rep,
	WIRE_F(spi_read_rep, result, 3),
	WIRE_F(spi_read_rep, data, 8));

WIRE_LAYOUT(pocan_status_rep,
	WIRE_F(pocan_status_rep, enabled, 3),
	WIRE_F(pocan_status_rep, available, 4),
	WIRE_F(pocan_status_rep, pendant, 8),
	WIRE_F(pocan_status_rep, kbd48, 9));
WIRE_LAYOUT(pocan_enable_req,
	WIRE_F(pocan_enable_req, enable, 3));
WIRE_LAYOUT(pocan_require_req,
	WIRE_F(pocan_require_req, pendant, 8),
	WIRE_F(pocan_require_req, kbd48, 9));
