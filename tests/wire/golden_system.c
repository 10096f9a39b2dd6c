/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Identification, clock, log, failsafe, network and discovery. The device of
 * the rows is a PoKeys57CNC with serial number 65432 and firmware 4.7.15 at
 * 127.0.0.1.
 */

#include "tests/wire/golden.h"

#define LOCALHOST { 127, 0, 0, 1 }

const struct golden golden_system[] = {
	G("connect/1:0x00", DEVICE_DATA, NULL,
	  V(device_data_rep, .serial_low = 65432, .firmware_old = 0x37, .revision_old = 15,
	    .magic = "PKEx", .serial = 65432, .firmware = 0x37, .revision = 15, .hardware = 32,
	    .user_id = 7, .build_date = "Mar 14 2025", .name = "SimPoKeys5",
	    .config_firmware = 0x37, .config_revision = 15)),
	G("connect/2:0x03", USER_ID, NULL, V(user_id_rep, .user_id = 7, .locked = 0)),
	G("connect/3:0xE0", NETWORK, V(network_req, .option = 0),
	  V(network_rep, .dhcp = 0, .fixed_ip = LOCALHOST, .current_ip = LOCALHOST,
	    .tcp_timeout = 30, .gateway = LOCALHOST, .mask = { 255, 0, 0, 0 }, .options = 0xA0)),
	G("connect/4:0x06", DEVICE_NAME, V(device_name_req, .flags = 0),
	  V(device_name_rep, .name = "SimPoKeys5", .long_name = "SimPoKeys57CNC-0001")),
	G("connect/5:0x8F", OPTIONS, V(options_req, .option = 0), V(options_rep, .active = 0)),
	G("RTCGet/1:0x83", RTC, V(rtc_req, .option = 0),
	  V(rtc_req, .option = 0, .second = 30, .minute = 45, .hour = 12, .weekday = 2, .day = 18,
	    .month = 11, .yearday = 322, .year = 2025)),
	G("RTCSet/1:0x83", RTC,
	  V(rtc_req, .option = 0x10, .second = 30, .minute = 45, .hour = 12, .weekday = 2,
	    .day = 18, .month = 11, .yearday = 322, .year = 2026),
	  V(rtc_req, .option = 0x10, .second = 30, .minute = 45, .hour = 12, .weekday = 2,
	    .day = 18, .month = 11, .yearday = 322, .year = 2026)),
	G("FailsafeSettingsGet/1:0x81", FAILSAFE, V(failsafe_req, .write = 0),
	  V(failsafe_req, .write = 0)),
	/* 0.5 s, everything, outputs 1..8 on, first PoExtBus byte, channel 6 at half */
	G("FailsafeSettingsSet/1:0x81", FAILSAFE,
	  V(failsafe_req, .write = 1, .timeout = 5, .peripherals = 0x0F, .outputs = 0xFF,
	    .poextbus = { 0x11 }, .pwm_percent = { 0, 0, 0, 0, 0, 50 }),
	  V(failsafe_req, .write = 1, .timeout = 5, .peripherals = 0x0F, .outputs = 0xFF,
	    .poextbus = { 0x11 }, .pwm_percent = { 0, 0, 0, 0, 0, 50 })),
	G("ReadDeviceLog/1:0x84", SYSTEM_LOG, V(system_log_req, .option = 0),
	  V(system_log_rep, .count = 2, .entry = { 0x1234, 0x5678 })),
	/* the library copies the old name's tail along behind the NUL */
	G("DeviceNameSet/1:0x06", DEVICE_NAME,
	  V(device_name_req, .flags = 1, .name = "NewName\0s5"),
	  V(device_name_rep, .name = "NewName\0s5", .long_name = "NewName\0s5")),
	G("NetworkConfigurationSet/1:0xE0", NETWORK,
	  V(network_req, .option = 10, .dhcp = 0, .fixed_ip = LOCALHOST, .current_ip = LOCALHOST,
	    .tcp_timeout = 30, .gateway = LOCALHOST, .mask = { 255, 0, 0, 0 }, .gateway_valid = 1,
	    .options = 0xA0),
	  V(network_rep, .dhcp = 0, .fixed_ip = LOCALHOST, .current_ip = LOCALHOST,
	    .tcp_timeout = 30, .gateway = LOCALHOST, .mask = { 255, 0, 0, 0 }, .options = 0xA0)),
	G("SaveConfiguration/1:0x50", SAVE, V(confirm_req, .key1 = 0xAA, .key2 = 0x55), NULL),
	G("CustomRequest_load(0x05)/1:0x05", SYSTEM_LOAD, NULL, V(system_load_rep, .percent = 23)),
	G("CustomRequest_tick(0xCF)/1:0xCF", TICK, NULL, V(tick_rep, .ms = 123456)),
	{ .name = "discovery-reply-19B",
	  .kind = GOLDEN_DISCOVERY,
	  .rep = V(discovery, .user_id = 7, .firmware = 0x37, .revision = 15, .ip = LOCALHOST,
		   .dhcp = 0, .host_ip = LOCALHOST, .serial = 65432, .hardware = 32) },
	{ .name = "discovery-reply-14B-old",
	  .kind = GOLDEN_DISCOVERY,
	  .rep = V(discovery, .user_id = 7, .firmware = 0x37, .revision = 15, .ip = LOCALHOST,
		   .dhcp = 0, .host_ip = LOCALHOST, .serial = 65432, .old_format = true) },
	{ .name = NULL },
};
