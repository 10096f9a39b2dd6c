/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef SIM_BUS_H
#define SIM_BUS_H

#include <stdbool.h>
#include <stdint.h>

/*
 * The buses behind the device (protocol sections 3.12 to 3.20) and what hangs
 * on them on this bench: memory and a thermometer, plugs which return what
 * was sent, a pendant keyboard. So every read has a real answer.
 */

#define SIM_POEXT_BYTES 10
#define SIM_MODULES 16
#define SIM_MODULE_BYTES 16
#define SIM_MODULE_KBD48 0x10	/* type code of kbd48CNC */
#define SIM_I2C_MEMORY 0x50	/* address of the memory, 256 bytes */
#define SIM_I2C_MAX 32
#define SIM_UARTS 3
#define SIM_UART_BYTES 256
#define SIM_CAN_MESSAGES 32
#define SIM_CAN_BYTES 15
#define SIM_CAN_FILTERS 8
#define SIM_SENSORS 100
#define SIM_STRIP_LEDS 256

struct sim_bus_config {
	uint8_t poext_on;
	uint8_t poext_connector;
	uint8_t poext_no_crc;
	uint8_t module_options[SIM_MODULES];
	uint8_t pocan_on;
	uint8_t pocan_require[2];
	uint8_t sensor[SIM_SENSORS][12];
};

/* One operation which is started, takes its time, and is then fetched. */
struct sim_transfer {
	uint64_t ready_ns;
	uint8_t result; /* 1 done, 0 failed; what stands here until then is "busy" */
	bool started;
	uint8_t length;
	uint8_t data[SIM_I2C_MAX];
};

struct sim_modules {
	uint8_t state;
	uint8_t discovery;
	struct sim_transfer data;
	struct sim_transfer light;
	struct sim_transfer check;
	uint8_t out[SIM_MODULES][SIM_MODULE_BYTES]; /* last 0x55: LEDs */
	uint8_t pwm[SIM_MODULES];
};

struct sim_uart {
	uint32_t baud;
	uint8_t format;
	uint16_t head;
	uint16_t used;
	uint8_t bytes[SIM_UART_BYTES];
};

struct sim_can {
	uint32_t bitrate;
	uint8_t filters;
	uint8_t filter_format[SIM_CAN_FILTERS];
	uint32_t filter_id[SIM_CAN_FILTERS];
	uint8_t head;
	uint8_t used;
	uint8_t queue_id; /* of the message at head */
	uint8_t message[SIM_CAN_MESSAGES][SIM_CAN_BYTES];
};

struct sim_onewire {
	bool on;
	struct sim_transfer transfer;
	struct sim_transfer scan;
};

struct sim_bus {
	uint8_t poext[SIM_POEXT_BYTES];
	bool poext_paused;
	struct sim_modules modules;
	struct sim_transfer i2c_write, i2c_read, i2c_scan;
	uint8_t i2c_pointer;
	struct sim_onewire onewire;
	uint8_t spi_mode, spi_prescaler;
	uint8_t spi_length;
	uint8_t spi_data[55];
	struct sim_uart uart[SIM_UARTS];
	struct sim_can can;
	uint16_t strip_count; /* 0x4B; no command reads it back */
	uint8_t strip_refresh;
	uint8_t strip[SIM_STRIP_LEDS][3];
};

/* Devices hung on the buses. */
struct sim_module {
	bool present;
	uint8_t type;
	uint8_t address;
	uint8_t size;
	uint8_t version;
	uint8_t light;
	uint8_t status; /* of its data, 0 good */
	uint8_t in[SIM_MODULE_BYTES];
};

struct sim_bus_bench {
	struct sim_module module[SIM_MODULES];
	uint8_t memory[256]; /* I2C, at SIM_I2C_MEMORY */
	bool memory_present;
	uint8_t rom[8]; /* 1-Wire thermometer */
	bool thermometer_present;
	int16_t temperature; /* in 1/16 degree */
	int32_t sensor[SIM_SENSORS];
	bool sensor_ok[SIM_SENSORS];
};

struct sim_device;

void sim_bus_bench_init(struct sim_bus_bench *bench);
void sim_bus_reset(struct sim_device *dev);

/* Starts an operation which takes `us` microseconds and will end with `result`. */
void sim_transfer_start(struct sim_device *dev, struct sim_transfer *transfer, unsigned int us,
			uint8_t result);

/* 0x10 busy, else the result; 0 when nothing was started. */
uint8_t sim_transfer_result(const struct sim_device *dev, const struct sim_transfer *transfer);

/* A key of the kbd48CNC in a module: column x 0..11, row y 0..3 (section 3.13). */
void sim_module_key(struct sim_module *module, unsigned int x, unsigned int y, bool pressed);

/* Whether the module's LED under that key is lit. */
bool sim_module_led(const struct sim_device *dev, unsigned int module, unsigned int x,
		    unsigned int y);

#endif
