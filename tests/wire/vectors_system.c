/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Identification, settings, network, security, clock: protocol sections 1.10,
 * 1.11, 2.1, 3.1, 3.21, 3.22.
 *
 * Offsets are written down from there, independently of the layouts in wire/;
 * see vectors.h for how a wrong one shows.
 */

#include "tests/wire/vectors.h"
#include "wire/system.h"

static void device_data_is_where_section_2_1_says(void **state)
{
	REP(device_data, device_data_rep, d);

	(void)state;
	assert_int_equal(d.serial_low, BE16(2));
	AT(d.firmware_old, 4);
	AT(d.revision_old, 5);
	ATTEXT(d.magic, 8);
	AT32(d.serial, 12);
	AT(d.firmware, 16);
	AT(d.revision, 17);
	AT(d.hardware, 18);
	AT(d.user_id, 19);
	ATTEXT(d.build_date, 20);
	ATTEXT(d.name, 31);
	AT(d.firmware_type, 41);
	AT(d.app_firmware, 42);
	AT(d.app_revision, 43);
	ATBYTES(d.app_device_id, 44);
	AT(d.product_offset, 57);
	AT(d.locked, 58);
	AT(d.config_firmware, 59);
	AT(d.config_revision, 60);
	AT(d.bootloader, 61);
	ATBYTES(d.reserved, 62);
}

static void names_and_marks_are_where_section_2_1_says(void **state)
{
	REQ(set_user_id, set_user_id_req, set);
	REP(set_user_id, set_user_id_rep, is);
	REP(user_id, user_id_rep, user);
	REQ(build_date, build_date_req, ask);
	REP(build_date, build_date_rep, date);
	REQ(device_name, device_name_req, name);
	REP(device_name, device_name_rep, got);
	REQ(session_data, session_data_req, mark);
	REP(session_data, session_data_rep, marked);
	REQ(options, options_req, option);
	REP(options, options_rep, active);

	(void)state;
	AT(set.user_id, 2);
	AT(is.user_id, 2);
	AT(user.user_id, 2);
	AT(user.locked, 3);
	AT(ask.part, 2);
	ATBYTES(date.bytes, 2);
	AT(name.flags, 2);
	AT(name.use_long, 3);
	ATTEXT(name.name, 8);
	ATTEXT(name.joystick, 18);
	AT(name.product_offset, 34);
	ATTEXT(name.long_name, 35);
	ATTEXT(got.name, 8);
	ATTEXT(got.joystick, 18);
	AT(got.product_offset, 34);
	ATTEXT(got.long_name, 35);
	AT(mark.option, 2);
	ATBYTES(mark.data, 8);
	ATBYTES(marked.data, 8);
	AT(option.option, 2);
	ATBYTES(option.code, 8);
	AT(active.active, 8);
}

static void misc_settings_are_where_section_3_1_says(void **state)
{
	REQ(usb_interface, usb_interface_req, usb);
	REP(usb_interface, usb_interface_rep, usb_is);
	REQ(delayed_start, delayed_start_req, delay);
	REP(delayed_start, delayed_start_rep, delay_is);
	REQ(misc_usb, misc_usb_req, misc);
	REP(misc_usb, misc_usb_rep, misc_is);
	REQ(connection_signal, connection_signal_req, sig);
	REP(connection_signal, connection_signal_rep, sig_is);
	REQ(startup_outputs, startup_outputs_req, start);
	REP(startup_outputs, startup_outputs_rep, start_is);

	(void)state;
	AT(usb.bitmap, 2);
	AT(usb_is.bitmap, 2);
	AT(delay.write, 2);
	AT(delay.delay, 3);
	AT(delay_is.write, 2);
	AT(delay_is.delay, 3);
	AT(misc.option, 2);
	AT(misc.interval, 8);
	AT(misc.boot, 9);
	AT32(misc.timeout, 10);
	AT(misc.timeout_action, 14);
	AT(misc_is.interval, 8);
	AT(misc_is.boot, 9);
	AT32(misc_is.timeout, 10);
	AT(misc_is.timeout_action, 14);
	AT(sig.write, 2);
	AT(sig.pins, 3);
	AT(sig_is.pins, 3);
	AT(start.write, 2);
	AT(start.automatic, 3);
	AT(start.valid, 4);
	AT56(start.outputs, 8);
	AT(start_is.automatic, 2);
	AT(start_is.valid, 3);
	AT56(start_is.outputs, 8);
}

static void network_and_security_are_where_sections_1_10_and_1_11_say(void **state)
{
	REQ(network, network_req, set);
	REP(network, network_rep, is);
	REP(security, security_rep, sec);
	REQ(authorise, authorise_req, hash);
	REP(authorise, authorise_rep, result);
	REQ(password, password_req, password);
	REQ(save, confirm_req, keys);

	(void)state;
	AT(set.option, 2);
	AT(set.dhcp, 8);
	ATBYTES(set.fixed_ip, 9);
	ATBYTES(set.current_ip, 13);
	AT16(set.tcp_timeout, 17);
	ATBYTES(set.gateway, 19);
	ATBYTES(set.mask, 23);
	AT(set.gateway_valid, 27);
	AT(set.options, 28);
	AT(is.dhcp, 8);
	ATBYTES(is.fixed_ip, 9);
	ATBYTES(is.current_ip, 13);
	AT16(is.tcp_timeout, 17);
	ATBYTES(is.gateway, 19);
	ATBYTES(is.mask, 23);
	AT(is.options, 27);
	AT(sec.level, 8);
	ATBYTES(sec.seed, 9);
	AT(hash.level, 2);
	ATBYTES(hash.hash, 8);
	AT(result.result, 8);
	AT(password.level, 2);
	ATTEXT(password.password, 8);
	AT(keys.key1, 2);
	AT(keys.key2, 3);
}

static void failsafe_and_clock_are_where_sections_3_21_and_3_22_say(void **state)
{
	REQ(failsafe, failsafe_req, safe);
	REQ(rtc, rtc_req, rtc);
	REQ(system_log, system_log_req, ask);
	REP(system_log, system_log_rep, log);

	(void)state;
	AT(safe.write, 2);
	AT(safe.timeout, 3);
	AT(safe.peripherals, 4);
	AT56(safe.outputs, 8);
	ATBYTES(safe.poextbus, 15);
	ATBYTES(safe.pwm_percent, 25);
	AT(rtc.option, 2);
	AT(rtc.second, 8);
	AT(rtc.minute, 9);
	AT(rtc.hour, 10);
	AT(rtc.weekday, 11);
	AT(rtc.day, 12);
	AT(rtc.month, 13);
	AT16(rtc.yearday, 14);
	AT16(rtc.year, 16);
	AT(rtc.dst, 18);
	AT(rtc.utc_offset, 19);
	AT(ask.option, 2);
	AT(log.count, 2);
	AT16(log.entry[0], 8);
	AT16(log.entry[26], 60);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(device_data_is_where_section_2_1_says),
		cmocka_unit_test(names_and_marks_are_where_section_2_1_says),
		cmocka_unit_test(misc_settings_are_where_section_3_1_says),
		cmocka_unit_test(network_and_security_are_where_sections_1_10_and_1_11_say),
		cmocka_unit_test(failsafe_and_clock_are_where_sections_3_21_and_3_22_say),
	};

	return cmocka_run_group_tests(tests, vectors_count, NULL);
}
