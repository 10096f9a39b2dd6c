/* SPDX-License-Identifier: MIT */
#ifndef WIRE_BUS_H
#define WIRE_BUS_H

/*
 * What hangs on the device: PoExtBus, PoNET, I2C, 1-Wire, SPI, UART, CAN,
 * PoCAN and EasySensors; protocol sections 3.12 to 3.20.
 *
 * Results of I2C, 1-Wire and PoNET are asynchronous: start, then poll until
 * the result is not WIRE_BUS_BUSY.
 */

#include "wire/op.h"

#define WIRE_BUS_FAIL 0
#define WIRE_BUS_OK 1
#define WIRE_BUS_BUSY 0x10

/* The reply of many bus operations: a result only. */
struct wire_bus_result_rep {
	uint8_t result; /* WIRE_BUS_ */
};

/* I2C and 1-Wire: 0 off, 1 on, 2 status. */
struct wire_bus_op_req {
	uint8_t op;
};
struct wire_bus_op_rep {
	uint8_t op;
	uint8_t result;
};

/* 0x76 (section 3.20) */
#define WIRE_SENSOR_BLOCKS 4
struct wire_sensor {
	uint8_t type;
	uint8_t reading;  /* reading id */
	uint8_t refresh;  /* 0.1 s */
	uint8_t failsafe; /* bits 0..5 timeout s, 6 -> 0, 7 -> 0x7FFFFFFF */
	uint8_t id[8];
};
struct wire_sensor_setup_req {
	uint8_t index; /* first sensor, 0..99 */
	uint8_t count; /* 1..4, limited to 4 */
	uint8_t write;
	struct wire_sensor sensor[WIRE_SENSOR_BLOCKS];
};
struct wire_sensor_setup_rep {
	uint8_t index;
	uint8_t count;
	struct wire_sensor sensor[WIRE_SENSOR_BLOCKS];
};

/* 0x77 */
#define WIRE_SENSOR_VALUES 13
struct wire_sensor_values_req {
	uint8_t index;
	uint8_t count; /* 1..13, limited to 13 */
};
struct wire_sensor_values_rep {
	uint8_t index; /* @2, @3: repeated by the device, not documented */
	uint8_t count;
	uint16_t ok;                       /* bit t: value[t] is good */
	int32_t value[WIRE_SENSOR_VALUES]; /* mostly 1/100 of the unit */
};

/* 0x86 (section 3.18) */
struct wire_can_message {
	uint32_t id;
	uint8_t data[8];
	uint8_t length;   /* 0..8, limited to 8 */
	uint8_t extended; /* 1: 29-bit id */
	uint8_t remote;
};
struct wire_can_setup_req {
	uint32_t bitrate; /* bit/s, 0 off */
};
struct wire_can_filter_req {
	uint8_t extended;
	uint32_t id;
};
struct wire_can_send_req {
	struct wire_can_message message[1];
};
#define WIRE_CAN_QUEUE 3
#define WIRE_CAN_CONFIRM_NONE 0xFF
struct wire_can_queue_req {
	uint8_t confirm; /* queue id of the last reply, WIRE_CAN_CONFIRM_NONE */
};
struct wire_can_queue_rep {
	uint8_t status;
	uint8_t queue_id;
	/* blocks of 15 bytes; the documentation does not say so for several */
	struct wire_can_message message[WIRE_CAN_QUEUE];
};
struct wire_can_read_rep {
	uint8_t available; /* 1: message is one */
	struct wire_can_message message[1];
};

/* 0xDA (section 3.12) */
#define WIRE_POEXTBUS_BYTES 10
#define WIRE_POEXTBUS_OFF 0
#define WIRE_POEXTBUS_WRITE 1	/* enable and write */
#define WIRE_POEXTBUS_READ 2
#define WIRE_POEXTBUS_STOP_REFRESH 10
#define WIRE_POEXTBUS_REFRESH 11
struct wire_poextbus_req {
	uint8_t option;
	uint8_t connector; /* 0 dedicated, 1 pins 35 to 37 */
	uint8_t no_crc;    /* not 0: no CRC byte on the bus */
	uint8_t data[WIRE_POEXTBUS_BYTES];
};
struct wire_poextbus_rep {
	uint8_t status;
	uint8_t connector;
	uint8_t no_crc;
	uint8_t data[WIRE_POEXTBUS_BYTES]; /* as written */
};

/* 0xDB (section 3.14) */
#define WIRE_I2C_DATA 32
struct wire_i2c_write_req {
	uint8_t address;      /* 7 bits */
	uint8_t write_length; /* limited to 32 */
	uint8_t read_length;  /* limited to 32 */
	uint8_t data[WIRE_I2C_DATA];
};
struct wire_i2c_read_req {
	uint8_t address;
	uint8_t length; /* limited to 32 */
};
struct wire_i2c_read_result_rep {
	uint8_t result;
	uint8_t result_copy;
	uint8_t length; /* limited to 32 */
	uint8_t data[WIRE_I2C_DATA];
};
struct wire_i2c_scan_result_rep {
	uint8_t result;
	uint8_t result_copy;
	uint8_t present[16]; /* address a: byte a/8 bit a%8 */
};

/* 0xDC (section 3.15) */
#define WIRE_ONEWIRE_DATA 16
#define WIRE_ONEWIRE_STAGE_DONE 0x01
#define WIRE_ONEWIRE_ALL_FOUND 0x02
struct wire_onewire_start_req {
	uint8_t write_length; /* limited to 16 */
	uint8_t read_length;  /* limited to 16 */
	uint8_t pin;          /* 0-based */
	uint8_t data[WIRE_ONEWIRE_DATA];
};
struct wire_onewire_result_rep {
	uint8_t status;
	uint8_t result;
	uint8_t length; /* limited to 16 */
	uint8_t data[WIRE_ONEWIRE_DATA];
};
struct wire_onewire_scan_req {
	uint8_t pin; /* 0-based */
};
struct wire_onewire_scan_result_rep {
	uint8_t status;
	uint8_t result;
	uint8_t flags; /* WIRE_ONEWIRE_ */
	uint8_t rom[8];
};

/* 0xDD (section 3.13) */
#define WIRE_PONET_MODULES 16
#define WIRE_PONET_DATA 16
#define WIRE_PONET_START 0x10	/* option of 0x50 and 0x60; "on" of 0x30, 0x40 */
#define WIRE_PONET_STOP 0x20	/* "off" of 0x30 */
#define WIRE_PONET_FETCH 0x30	/* "status" of 0x30, 0x40 */
#define WIRE_PONET_STILL_BUSY 0xFF
#define WIRE_PONET_READY 10	/* bus state */
#define WIRE_PONET_KBD48 0x10	/* type of a kbd48CNC */
struct wire_ponet_status_rep {
	uint8_t result;
	uint8_t state; /* 0 inactive, 1 init, 2 scan, 10 ready, .. 255 error */
};
struct wire_ponet_module_req {
	uint8_t module; /* 0..15 */
};
struct wire_ponet_settings_rep {
	uint8_t result;
	uint8_t address; /* I2C */
	uint8_t type;    /* WIRE_PONET_KBD48 */
	uint8_t size;
	uint8_t options; /* WIRE_PONET_OPT_ */
};
#define WIRE_PONET_OPT_INPUTS 0x01
#define WIRE_PONET_OPT_OUTPUTS 0x02
#define WIRE_PONET_OPT_ROTATED 0x04
#define WIRE_PONET_OPT_LIGHT 0x08
#define WIRE_PONET_OPT_MAPPED 0x10
#define WIRE_PONET_OPT_CONFIG_READ 0x20
#define WIRE_PONET_OPT_CONFIGURED 0x40
#define WIRE_PONET_OPT_PRESENT 0x80
struct wire_ponet_version_rep {
	uint8_t result;
	uint8_t version;
};
struct wire_ponet_map_req {
	uint8_t module;
	uint8_t options;
};
struct wire_ponet_option_req {
	uint8_t option; /* WIRE_PONET_START, _STOP, _FETCH */
	uint8_t module; /* with _START of 0x50 and 0x60 */
};
struct wire_ponet_found_rep {
	uint8_t result;
	uint8_t found; /* 1: a device was configured (0x30) or seen (0x40) */
};
struct wire_ponet_data_rep {
	uint8_t result;
	uint8_t status; /* 0 OK, WIRE_PONET_STILL_BUSY */
	uint8_t data[WIRE_PONET_DATA];
};
struct wire_ponet_set_data_req {
	uint8_t module;
	uint8_t data[WIRE_PONET_DATA];
};
struct wire_ponet_light_rep {
	uint8_t result;
	uint8_t status; /* 0 OK, WIRE_PONET_STILL_BUSY */
	uint8_t value;
};
struct wire_ponet_pwm_req {
	uint8_t module;
	uint8_t brightness; /* 0..255 */
};

/* 0xDE (section 3.17) */
#define WIRE_UART_DATA 55
struct wire_uart_setup_req {
	uint8_t interface; /* 1..3 */
	uint8_t format;
	uint32_t baud;
};
struct wire_uart_send_req {
	uint8_t interface;
	uint8_t count; /* limited to 55 */
	uint8_t data[WIRE_UART_DATA];
};
struct wire_uart_send_rep {
	uint8_t queued; /* bytes taken */
};
struct wire_uart_read_req {
	uint8_t interface;
};
struct wire_uart_read_rep {
	uint8_t count; /* limited to 55 */
	uint8_t data[WIRE_UART_DATA];
};

/* 0xE5 (section 3.16) */
#define WIRE_SPI_DATA 55
#define WIRE_SPI_CPOL 0x01
#define WIRE_SPI_CPHA 0x02
struct wire_spi_setup_req {
	uint8_t prescaler; /* 2..254, even */
	uint8_t format;    /* WIRE_SPI_ */
};
struct wire_spi_write_req {
	uint8_t length;     /* limited to 55 */
	uint8_t select_pin; /* 0-based */
	uint8_t data[WIRE_SPI_DATA];
};
struct wire_spi_read_req {
	uint8_t length; /* limited to 55 */
};
struct wire_spi_read_rep {
	uint8_t result;
	uint8_t data[WIRE_SPI_DATA];
};

/* 0xE6 (section 3.19) */
struct wire_pocan_status_rep {
	uint8_t enabled;
	uint8_t available;
	uint8_t pendant; /* PoPendant seen */
	uint8_t kbd48;   /* kbd48CNC seen */
};
struct wire_pocan_enable_req {
	uint8_t enable; /* 0 or 0xFF: off */
};
struct wire_pocan_require_req {
	uint8_t pendant;
	uint8_t kbd48;
};

WIRE_OPS_BUS(WIRE_TYPED)

/*
 * kbd48CNC: 12 columns (x, left to right) and 4 rows (y, top to bottom), the
 * same map for keys (0x50) and lights (0x55). A key's number is 4*x + y.
 */
#define WIRE_KBD48_COLUMNS 12
#define WIRE_KBD48_ROWS 4
#define WIRE_KBD48_KEYS 48

/* Bit of the module data for a key, 0..47: byte bit/8, bit bit%8; -1 when key > 47. */
int wire_kbd48_bit(unsigned int key);

/* Module data -> keys, bit n = key n; and back (bytes 6.. of data become zero). */
uint64_t wire_kbd48_keys(const uint8_t data[WIRE_PONET_DATA]);
void wire_kbd48_data(uint64_t keys, uint8_t data[WIRE_PONET_DATA]);

#endif
