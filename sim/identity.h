/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_IDENTITY_H
#define SIM_IDENTITY_H

#include <stdbool.h>
#include <stdint.h>

/* Who the device is, how it is reached and who may change it (protocol sections 1.9 to 2.1). */

struct sim_identity_config {
	uint8_t user_id;
	uint8_t locked;
	uint8_t product_offset;
	uint8_t activated; /* 0x8F bitmap */
	char name[10];     /* not terminated */
	char joystick_name[16];
	char long_name[20];
	uint8_t usb;
	uint8_t delayed_start;
	uint8_t misc_usb[7]; /* 0x0B @8..14 */
};

struct sim_network_config {
	uint8_t dhcp;
	uint8_t fixed_ip[4];
	uint8_t gateway[4];
	uint8_t mask[4];
	uint8_t options;           /* low three bits, see 0xE0 @28 */
	uint16_t tcp_timeout;      /* x100 ms */
	uint8_t modbus[12];        /* 0xE4 @8..19 */
	uint8_t udp_map[48];       /* 0xA2 @8..55 */
	uint8_t report[7];         /* 0xEF @8..14: rate, server, type */
	uint8_t report_format[48]; /* 0xEF, set at @15..62: port, description */
	uint8_t report_header[5][50];
};

struct sim_security_config {
	uint8_t level;
	uint8_t password[32];
};

struct sim_device;

/* Length of the reply to a search: 19, 14 for a device of series 56, 0 when switched off. */
#define SIM_DISCOVERY_MAX 19

void sim_identity_defaults(struct sim_device *dev);
void sim_network_defaults(struct sim_network_config *config, const uint8_t ip[4]);

#endif
