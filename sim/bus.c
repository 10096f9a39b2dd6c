// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What the buses have in common: an operation is started by one request, takes
 * its time, and is fetched by another, which is told "busy" until then. The
 * time is real, so that a client which fetches too early is found out.
 *
 * On this bench hang a memory at I2C address 0x50, a thermometer on 1-Wire,
 * and a kbd48CNC as PoNET module 0.
 */
#include "sim/request.h"

#define BUSY 0x10

void sim_transfer_start(struct sim_device *dev, struct sim_transfer *transfer, unsigned int us,
			uint8_t result)
{
	transfer->started = true;
	transfer->result = result;
	transfer->ready_ns = dev->now_ns + UINT64_C(1000) * us;
}

uint8_t sim_transfer_result(const struct sim_device *dev, const struct sim_transfer *transfer)
{
	if (!transfer->started)
		return 0;
	return dev->now_ns < transfer->ready_ns ? BUSY : transfer->result;
}

void sim_bus_bench_init(struct sim_bus_bench *bench)
{
	static const uint8_t rom[8] = { 0x28, 0xFF, 0x64, 0x1E, 0x00, 0x15, 0x03, 0x00 };

	memset(bench, 0, sizeof(*bench));
	bench->module[0] = (struct sim_module){
		.present = true,
		.type = SIM_MODULE_KBD48,
		.address = 0x10,
		.size = 16,
		.version = 1,
		.light = 77,
	};
	bench->memory_present = true;
	bench->thermometer_present = true;
	memcpy(bench->rom, rom, sizeof(rom));
	bench->temperature = 21 * 16 + 4;
	for (unsigned int i = 0; i < SIM_SENSORS; i++) {
		bench->sensor_ok[i] = true;
		bench->sensor[i] = 2150 + (int32_t)i;
	}
}

void sim_bus_reset(struct sim_device *dev)
{
	memset(&dev->bus, 0, sizeof(dev->bus));
	dev->bus.modules.state = 10;
	dev->bus.can.queue_id = 1;
}
