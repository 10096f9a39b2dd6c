// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * I2C (protocol section 3.14), with a memory of 256 bytes as the one slave: the
 * first byte written to it is the address, the rest goes there; a read goes on
 * from where it is. A slave which is not there gives the result 0.
 *
 * The answer to a start is how the transfer stands: there are clients which ask
 * for its result only if it is under way.
 */
#include "sim/request.h"

#define US_PER_BYTE 25
#define OK 1

static bool answers(const struct sim_device *dev, uint8_t address)
{
	return address == SIM_I2C_MEMORY && dev->bench.bus.memory_present;
}

static void write_memory(struct sim_device *dev, const uint8_t *data, unsigned int len)
{
	if (!len)
		return;
	dev->bus.i2c_pointer = data[0];
	for (unsigned int i = 1; i < len; i++)
		dev->bench.bus.memory[dev->bus.i2c_pointer++] = data[i];
}

static void start_read(struct sim_device *dev, uint8_t address, uint8_t len)
{
	struct sim_transfer *read = &dev->bus.i2c_read;

	read->length = len > SIM_I2C_MAX ? SIM_I2C_MAX : len;
	if (answers(dev, address)) {
		for (unsigned int i = 0; i < read->length; i++)
			read->data[i] = dev->bench.bus.memory[dev->bus.i2c_pointer++];
	}
	sim_transfer_start(dev, read, US_PER_BYTE * (read->length + 1u), answers(dev, address));
}

static void start_write(struct sim_device *dev, const uint8_t *rq)
{
	unsigned int len = rq[P3] > SIM_I2C_MAX ? SIM_I2C_MAX : rq[P3];

	if (answers(dev, rq[P2]))
		write_memory(dev, rq + 8, len);
	sim_transfer_start(dev, &dev->bus.i2c_write, US_PER_BYTE * (len + 1), answers(dev, rq[P2]));
	if (rq[P4])
		start_read(dev, rq[P2], rq[P4]);
}

static void fetch_read(const struct sim_device *dev, uint8_t *rp)
{
	const struct sim_transfer *read = &dev->bus.i2c_read;

	rp[P2] = sim_transfer_result(dev, read);
	rp[8] = rp[P2];
	if (rp[P2] != OK)
		return;
	rp[9] = read->length;
	memcpy(rp + 10, read->data, read->length);
}

static void fetch_scan(const struct sim_device *dev, uint8_t *rp)
{
	rp[P2] = sim_transfer_result(dev, &dev->bus.i2c_scan);
	rp[8] = rp[P2];
	if (rp[P2] == OK && dev->bench.bus.memory_present)
		rp[9 + SIM_I2C_MEMORY / 8] |= 1u << (SIM_I2C_MEMORY % 8);
}

SIM_HANDLER(sim_do_i2c)
{
	rp[P1] = rq[P1];
	rp[P2] = OK;
	switch (rq[P1]) {
	case 0x00:
	case 0x01:
	case 0x02:
		break;
	case 0x10:
		start_write(dev, rq);
		rp[P2] = sim_transfer_result(dev, &dev->bus.i2c_write);
		break;
	case 0x11:
		rp[P2] = sim_transfer_result(dev, &dev->bus.i2c_write);
		break;
	case 0x20:
		start_read(dev, rq[P2], rq[P3]);
		rp[P2] = sim_transfer_result(dev, &dev->bus.i2c_read);
		break;
	case 0x21:
		fetch_read(dev, rp);
		break;
	case 0x30:
		sim_transfer_start(dev, &dev->bus.i2c_scan, 128 * US_PER_BYTE, OK);
		rp[P2] = sim_transfer_result(dev, &dev->bus.i2c_scan);
		break;
	case 0x31:
		fetch_scan(dev, rp);
		break;
	default:
		return SIM_ANSWER_UNKNOWN;
	}
	return SIM_ANSWER;
}
