/* SPDX-License-Identifier: MIT */
#ifndef WIRE_SYSTEM_H
#define WIRE_SYSTEM_H

/*
 * Identification, configuration store, network, security, failsafe, clock
 * and log: protocol sections 1.10 to 1.12, 2.1, 3.1, 3.21, 3.22.
 */

#include "wire/op.h"

/*
 * Text members are one byte longer than their field and always end in a NUL
 * after decoding. Encoding sends every byte of the field as it stands: fill
 * the struct with zeros first, a device compares the bytes behind the NUL too.
 */

/* 0x00 (section 2.1). */
struct wire_device_data_rep {
	uint16_t serial_low;  /* the only serial number on series 55/56 */
	uint8_t firmware_old; /* as firmware; meaningful on every series */
	uint8_t revision_old;
	char magic[4 + 1]; /* "PKEx" or "PK58": what follows is valid */
	uint32_t serial;
	uint8_t firmware; /* coded, see wire_firmware() */
	uint8_t revision;
	uint8_t hardware; /* enum wire_hardware, wire/model.h */
	uint8_t user_id;
	char build_date[11 + 1];
	char name[10 + 1]; /* first ten characters of the long name */
	uint8_t firmware_type;
	uint8_t app_firmware; /* meaningful in the bootloader only */
	uint8_t app_revision;
	uint8_t app_device_id[13]; /* @44..56; overlaps app_* in the documentation */
	uint8_t product_offset;
	uint8_t locked;          /* configuration lock */
	uint8_t config_firmware; /* firmware which wrote the configuration */
	uint8_t config_revision;
	uint8_t bootloader;  /* 1: the device is in its bootloader */
	uint8_t reserved[2]; /* @62..63 */
};

/* 0x02 */
struct wire_set_user_id_req {
	uint8_t user_id;
};
struct wire_set_user_id_rep {
	uint8_t user_id; /* as the device has it now */
};

/* 0x03 */
struct wire_user_id_rep {
	uint8_t user_id;
	uint8_t locked; /* 1: configuration is locked */
};

/* 0x04: part 0..2 are text, 10 is hardware version, revision, architecture. */
struct wire_build_date_req {
	uint8_t part;
};
struct wire_build_date_rep {
	uint8_t bytes[4];
};

/* 0x05 */
struct wire_system_load_rep {
	uint8_t percent;
};

/* 0x06; flags of the request. */
#define WIRE_NAME_WRITE 0x01
#define WIRE_NAME_JOYSTICK 0x02
#define WIRE_NAME_READ_OFFSET 0x04
#define WIRE_NAME_WRITE_OFFSET 0x08

struct wire_device_name_req {
	uint8_t flags;    /* 0: read */
	uint8_t use_long; /* 1: long_name is meant as well */
	char name[10 + 1];
	char joystick[16 + 1];
	uint8_t product_offset;
	char long_name[20 + 1];
};
struct wire_device_name_rep {
	char name[10 + 1];
	char joystick[16 + 1];
	uint8_t product_offset;
	char long_name[20 + 1]; /* counts only if it begins with name */
};

/* 0x07 */
#define WIRE_USB_READ 10	/* as bitmap: read only */
struct wire_usb_interface_req {
	uint8_t bitmap; /* 0 fast USB, 5 HID off, 6 keyboard off, 7 joystick off */
};
struct wire_usb_interface_rep {
	uint8_t bitmap;
};

/* 0x08 */
struct wire_delayed_start_req {
	uint8_t write;
	uint8_t delay; /* 100 ms; 0 or 0xFF: none */
};
struct wire_delayed_start_rep {
	uint8_t write;
	uint8_t delay;
};

/* 0x0A: ten bytes a client may leave in the device's memory. */
#define WIRE_SESSION_READ 0x00
#define WIRE_SESSION_WRITE 0x10
struct wire_session_data_req {
	uint8_t option;
	uint8_t data[10];
};
struct wire_session_data_rep {
	uint8_t data[10];
};

/* 0x0B */
struct wire_misc_usb_req {
	uint8_t option;   /* 0x00 read, 0x10 write */
	uint8_t interval; /* ms */
	uint8_t boot;
	uint32_t timeout;       /* ms */
	uint8_t timeout_action; /* 0..2 */
};
struct wire_misc_usb_rep {
	uint8_t interval;
	uint8_t boot;
	uint32_t timeout;
	uint8_t timeout_action;
};

/* 0x1B: which of pins 48..55 show the connection. */
struct wire_connection_signal_req {
	uint8_t write;
	uint8_t pins; /* bit 0 = pin 48 */
};
struct wire_connection_signal_rep {
	uint8_t pins;
};

/* 0x1E: outputs at power-up. */
struct wire_startup_outputs_req {
	uint8_t write;
	uint8_t automatic; /* initialise outputs at start */
	uint8_t valid;     /* 1: outputs is valid */
	uint64_t outputs;  /* bit = 0-based pin, 55 bits */
};
struct wire_startup_outputs_rep {
	uint8_t automatic;
	uint8_t valid;
	uint64_t outputs;
};

/* 0x50 save, 0x51 save and lock, 0x52 reset configuration (section 1.12). */
struct wire_confirm_req {
	uint8_t key1, key2; /* must be WIRE_KEY_1, WIRE_KEY_2 */
};
#define WIRE_KEY_1 0xAA
#define WIRE_KEY_2 0x55
#define WIRE_CONFIRMED { WIRE_KEY_1, WIRE_KEY_2 }

/* 0x81, request and reply (section 3.21). */
#define WIRE_FAILSAFE_DIGITAL 0x01
#define WIRE_FAILSAFE_POEXTBUS 0x02
#define WIRE_FAILSAFE_PWM 0x04
#define WIRE_FAILSAFE_PULSE 0x08
#define WIRE_FAILSAFE_ALL 0x0f
struct wire_failsafe_req {
	uint8_t write;
	uint8_t timeout;     /* 100 ms, 0 off */
	uint8_t peripherals; /* WIRE_FAILSAFE_ */
	uint64_t outputs;    /* bit = 0-based pin, 55 bits */
	uint8_t poextbus[10];
	uint8_t pwm_percent[6]; /* channel 1..6 */
};

/* 0x83, request and reply (section 3.22). */
#define WIRE_RTC_READ 0x00
#define WIRE_RTC_SET 0x10
#define WIRE_RTC_SET_DST 0x11
struct wire_rtc_req {
	uint8_t option; /* WIRE_RTC_ */
	uint8_t second, minute, hour;
	uint8_t weekday;    /* 0..6 */
	uint8_t day, month; /* from 1 */
	uint16_t yearday;
	uint16_t year;
	uint8_t dst;       /* 0, 1, 10 EU, 20 US, 30 AU */
	int8_t utc_offset; /* hours, used by the EU rule */
};

/* 0x84 */
#define WIRE_LOG_READ 0x00
#define WIRE_LOG_CLEAR 0x10
#define WIRE_LOG_MAX 27
struct wire_system_log_req {
	uint8_t option;
};
struct wire_system_log_rep {
	uint8_t count; /* limited to WIRE_LOG_MAX */
	uint16_t entry[WIRE_LOG_MAX];
};

/* 0x8F: options bought for the device. */
#define WIRE_OPTIONS_READ 0x00
#define WIRE_OPTIONS_ACTIVATE 0x01
#define WIRE_OPTIONS_CLEAR 0xFF
struct wire_options_req {
	uint8_t option;
	uint8_t code[8];
};
struct wire_options_rep {
	uint8_t active; /* bitmap */
};

/* 0xCF */
struct wire_tick_rep {
	uint32_t ms; /* since the device started */
};

/* 0xE0 (section 1.10). The write saves to flash at once. */
#define WIRE_NETWORK_READ 0
#define WIRE_NETWORK_WRITE 10
#define WIRE_NETOPT_MARK 0xA0		/* high nibble of valid options */
#define WIRE_NETOPT_NO_DISCOVERY 0x01
#define WIRE_NETOPT_NO_AUTO_ADDRESS 0x02
#define WIRE_NETOPT_NO_BROADCAST_SETUP 0x04
struct wire_network_req {
	uint8_t option;
	uint8_t dhcp;          /* 1: DHCP */
	uint8_t fixed_ip[4];   /* a.b.c.d in order */
	uint8_t current_ip[4]; /* ignored by the device */
	uint16_t tcp_timeout;  /* 100 ms */
	uint8_t gateway[4];
	uint8_t mask[4];
	uint8_t gateway_valid; /* 1: gateway and mask are valid */
	uint8_t options;       /* WIRE_NETOPT_MARK | ... */
};
struct wire_network_rep {
	uint8_t dhcp;
	uint8_t fixed_ip[4];
	uint8_t current_ip[4];
	uint16_t tcp_timeout;
	uint8_t gateway[4];
	uint8_t mask[4];
	uint8_t options; /* one byte earlier than in the request */
};

/* 0xE1 .. 0xE3 (section 1.11). */
#define WIRE_LEVEL_UNLOCKED 0x00
#define WIRE_LEVEL_LOCKED 0xFF
#define WIRE_AUTHORISED 0xAA
struct wire_security_rep {
	uint8_t level; /* 0 unlocked .. 0xFF fully locked */
	uint8_t seed[32];
};
struct wire_authorise_req {
	uint8_t level;    /* wanted, 0 = full access */
	uint8_t hash[20]; /* SHA-1 over password XOR seed */
};
struct wire_authorise_rep {
	uint8_t result; /* WIRE_AUTHORISED or 0 */
};
struct wire_password_req {
	uint8_t level; /* level without a password */
	char password[32 + 1];
};

WIRE_OPS_SYSTEM(WIRE_TYPED)

#endif
