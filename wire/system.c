/* SPDX-License-Identifier: MIT */
/*
 * Where the fields of wire/system.h stand in the packet: protocol sections
 * 1.10 to 1.12, 2.1, 3.1, 3.21, 3.22.
 *
 * Two traps of the documentation: the old serial number of 0x00 is the only
 * big-endian field besides analog values, and the options byte of 0xE0 stands
 * one byte earlier in the reply than in the request.
 */

#include "wire/system.h"
#include "wire/layout.h"

WIRE_LAYOUT(device_data_rep,
	WIRE_BE(device_data_rep, serial_low, 2),
	WIRE_F(device_data_rep, firmware_old, 4),
	WIRE_F(device_data_rep, revision_old, 5),
	WIRE_TEXT(device_data_rep, magic, 8),
	WIRE_F(device_data_rep, serial, 12),
	WIRE_F(device_data_rep, firmware, 16),
	WIRE_F(device_data_rep, revision, 17),
	WIRE_F(device_data_rep, hardware, 18),
	WIRE_F(device_data_rep, user_id, 19),
	WIRE_TEXT(device_data_rep, build_date, 20),
	WIRE_TEXT(device_data_rep, name, 31),
	WIRE_F(device_data_rep, firmware_type, 41),
	WIRE_F(device_data_rep, app_firmware, 42),
	WIRE_F(device_data_rep, app_revision, 43),
	WIRE_F(device_data_rep, app_device_id, 44),
	WIRE_F(device_data_rep, product_offset, 57),
	WIRE_F(device_data_rep, locked, 58),
	WIRE_F(device_data_rep, config_firmware, 59),
	WIRE_F(device_data_rep, config_revision, 60),
	WIRE_F(device_data_rep, bootloader, 61),
	WIRE_F(device_data_rep, reserved, 62));

WIRE_LAYOUT(set_user_id_req,
	WIRE_F(set_user_id_req, user_id, 2));
WIRE_LAYOUT(set_user_id_rep,
	WIRE_F(set_user_id_rep, user_id, 2));

WIRE_LAYOUT(user_id_rep,
	WIRE_F(user_id_rep, user_id, 2),
	WIRE_F(user_id_rep, locked, 3));

WIRE_LAYOUT(build_date_req,
	WIRE_F(build_date_req, part, 2));
WIRE_LAYOUT(build_date_rep,
	WIRE_F(build_date_rep, bytes, 2));

WIRE_LAYOUT(system_load_rep,
	WIRE_F(system_load_rep, percent, 2));

WIRE_LAYOUT(device_name_req,
	WIRE_F(device_name_req, flags, 2),
	WIRE_F(device_name_req, use_long, 3),
	WIRE_TEXT(device_name_req, name, 8),
	WIRE_TEXT(device_name_req, joystick, 18),
	WIRE_F(device_name_req, product_offset, 34),
	WIRE_TEXT(device_name_req, long_name, 35));
WIRE_LAYOUT(device_name_rep,
	WIRE_TEXT(device_name_rep, name, 8),
	WIRE_TEXT(device_name_rep, joystick, 18),
	WIRE_F(device_name_rep, product_offset, 34),
	WIRE_TEXT(device_name_rep, long_name, 35));

WIRE_LAYOUT(usb_interface_req,
	WIRE_F(usb_interface_req, bitmap, 2));
WIRE_LAYOUT(usb_interface_rep,
	WIRE_F(usb_interface_rep, bitmap, 2));

WIRE_LAYOUT(delayed_start_req,
	WIRE_F(delayed_start_req, write, 2),
	WIRE_F(delayed_start_req, delay, 3));
WIRE_LAYOUT(delayed_start_rep,
	WIRE_F(delayed_start_rep, write, 2),
	WIRE_F(delayed_start_rep, delay, 3));

WIRE_LAYOUT(session_data_req,
	WIRE_F(session_data_req, option, 2),
	WIRE_F(session_data_req, data, 8));
WIRE_LAYOUT(session_data_rep,
	WIRE_F(session_data_rep, data, 8));

WIRE_LAYOUT(misc_usb_req,
	WIRE_F(misc_usb_req, option, 2),
	WIRE_F(misc_usb_req, interval, 8),
	WIRE_F(misc_usb_req, boot, 9),
	WIRE_F(misc_usb_req, timeout, 10),
	WIRE_F(misc_usb_req, timeout_action, 14));
WIRE_LAYOUT(misc_usb_rep,
	WIRE_F(misc_usb_rep, interval, 8),
	WIRE_F(misc_usb_rep, boot, 9),
	WIRE_F(misc_usb_rep, timeout, 10),
	WIRE_F(misc_usb_rep, timeout_action, 14));

WIRE_LAYOUT(connection_signal_req,
	WIRE_F(connection_signal_req, write, 2),
	WIRE_F(connection_signal_req, pins, 3));
WIRE_LAYOUT(connection_signal_rep,
	WIRE_F(connection_signal_rep, pins, 3));

WIRE_LAYOUT(startup_outputs_req,
	WIRE_F(startup_outputs_req, write, 2),
	WIRE_F(startup_outputs_req, automatic, 3),
	WIRE_F(startup_outputs_req, valid, 4),
	WIRE_PINS(startup_outputs_req, outputs, 8));
WIRE_LAYOUT(startup_outputs_rep,
	WIRE_F(startup_outputs_rep, automatic, 2),
	WIRE_F(startup_outputs_rep, valid, 3),
	WIRE_PINS(startup_outputs_rep, outputs, 8));

WIRE_LAYOUT(confirm_req,
	WIRE_F(confirm_req, key1, 2),
	WIRE_F(confirm_req, key2, 3));

WIRE_LAYOUT(failsafe_req,
	WIRE_F(failsafe_req, write, 2),
	WIRE_F(failsafe_req, timeout, 3),
	WIRE_F(failsafe_req, peripherals, 4),
	WIRE_PINS(failsafe_req, outputs, 8),
	WIRE_F(failsafe_req, poextbus, 15),
	WIRE_F(failsafe_req, pwm_percent, 25));

WIRE_LAYOUT(rtc_req,
	WIRE_F(rtc_req, option, 2),
	WIRE_F(rtc_req, second, 8),
	WIRE_F(rtc_req, minute, 9),
	WIRE_F(rtc_req, hour, 10),
	WIRE_F(rtc_req, weekday, 11),
	WIRE_F(rtc_req, day, 12),
	WIRE_F(rtc_req, month, 13),
	WIRE_F(rtc_req, yearday, 14),
	WIRE_F(rtc_req, year, 16),
	WIRE_F(rtc_req, dst, 18),
	WIRE_F(rtc_req, utc_offset, 19));

WIRE_LAYOUT(system_log_req,
	WIRE_F(system_log_req, option, 2));
WIRE_LAYOUT(system_log_rep,
	WIRE_N(system_log_rep, count, 2, WIRE_LOG_MAX),
	WIRE_F(system_log_rep, entry, 8));

WIRE_LAYOUT(options_req,
	WIRE_F(options_req, option, 2),
	WIRE_F(options_req, code, 8));
WIRE_LAYOUT(options_rep,
	WIRE_F(options_rep, active, 8));

WIRE_LAYOUT(tick_rep,
	WIRE_F(tick_rep, ms, 2));

WIRE_LAYOUT(network_req,
	WIRE_F(network_req, option, 2),
	WIRE_F(network_req, dhcp, 8),
	WIRE_F(network_req, fixed_ip, 9),
	WIRE_F(network_req, current_ip, 13),
	WIRE_F(network_req, tcp_timeout, 17),
	WIRE_F(network_req, gateway, 19),
	WIRE_F(network_req, mask, 23),
	WIRE_F(network_req, gateway_valid, 27),
	WIRE_F(network_req, options, 28));
WIRE_LAYOUT(network_rep,
	WIRE_F(network_rep, dhcp, 8),
	WIRE_F(network_rep, fixed_ip, 9),
	WIRE_F(network_rep, current_ip, 13),
	WIRE_F(network_rep, tcp_timeout, 17),
	WIRE_F(network_rep, gateway, 19),
	WIRE_F(network_rep, mask, 23),
	WIRE_F(network_rep, options, 27));

WIRE_LAYOUT(security_rep,
	WIRE_F(security_rep, level, 8),
	WIRE_F(security_rep, seed, 9));
WIRE_LAYOUT(authorise_req,
	WIRE_F(authorise_req, level, 2),
	WIRE_F(authorise_req, hash, 8));
WIRE_LAYOUT(authorise_rep,
	WIRE_F(authorise_rep, result, 8));
WIRE_LAYOUT(password_req,
	WIRE_F(password_req, level, 2),
	WIRE_TEXT(password_req, password, 8));
