// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * 1-Wire (protocol section 3.15), with a DS18B20 thermometer on it: it gives
 * its number (0x33), converts (0x44) and gives its scratchpad (0xBE), with
 * the checksums a driver will look at.
 *
 * The result of what was started stands at @3 and again at @8. Nothing having
 * been started, it is whether the bus is on: clients ask for that with 0x11.
 */
#include "sim/request.h"

#define US_PER_BYTE 600
#define OK 1
#define MOST 16

static uint8_t crc8(const uint8_t *data, unsigned int len)
{
	uint8_t crc = 0;

	for (unsigned int i = 0; i < len; i++) {
		crc ^= data[i];
		for (int bit = 0; bit < 8; bit++)
			crc = (uint8_t)(crc >> 1 ^ (crc & 1 ? 0x8C : 0));
	}
	return crc;
}

static void rom(const struct sim_device *dev, uint8_t out[8])
{
	memcpy(out, dev->bench.bus.rom, 7);
	out[7] = crc8(out, 7);
}

static void scratchpad(const struct sim_device *dev, uint8_t out[9])
{
	static const uint8_t rest[] = { 0x4B, 0x46, 0x7F, 0xFF, 0x0C, 0x10 };

	wire_put_u16(out, (uint16_t)dev->bench.bus.temperature);
	memcpy(out + 2, rest, sizeof(rest));
	out[8] = crc8(out, 8);
}

/* An empty bus reads all ones. */
static void start(struct sim_device *dev, const uint8_t *rq)
{
	struct sim_transfer *t = &dev->bus.onewire.transfer;
	unsigned int written = rq[P2] > MOST ? MOST : rq[P2];
	uint8_t command = written ? rq[8 + written - 1] : 0;

	t->length = rq[P3] > MOST ? MOST : rq[P3];
	memset(t->data, 0xFF, sizeof(t->data));
	if (command == 0x33 && dev->bench.bus.thermometer_present)
		rom(dev, t->data);
	else if (command == 0xBE && dev->bench.bus.thermometer_present)
		scratchpad(dev, t->data);
	sim_transfer_start(dev, t, US_PER_BYTE * (written + t->length + 2),
			   dev->bench.bus.thermometer_present);
}

static void fetch(const struct sim_device *dev, uint8_t *rp)
{
	const struct sim_transfer *t = &dev->bus.onewire.transfer;

	rp[P2] = t->started ? sim_transfer_result(dev, t) : dev->bus.onewire.on;
	rp[8] = rp[P2];
	if (!t->started || rp[8] != OK)
		return;
	rp[9] = t->length;
	memcpy(rp + 10, t->data, t->length);
}

static void fetch_scan(const struct sim_device *dev, uint8_t *rp)
{
	rp[P2] = sim_transfer_result(dev, &dev->bus.onewire.scan);
	rp[8] = rp[P2];
	if (rp[8] != OK)
		return;
	rp[9] = 0x03;
	if (dev->bench.bus.thermometer_present)
		rom(dev, rp + 10);
}

SIM_HANDLER(sim_do_onewire)
{
	struct sim_onewire *bus = &dev->bus.onewire;

	rp[P1] = rq[P1];
	rp[P2] = OK;
	switch (rq[P1]) {
	case 0x00:
		memset(bus, 0, sizeof(*bus));
		break;
	case 0x01:
		bus->on = true;
		break;
	case 0x02:
		rp[P2] = bus->on;
		break;
	case 0x10:
		start(dev, rq);
		break;
	case 0x11:
		fetch(dev, rp);
		break;
	case 0x20:
	case 0x22:
		sim_transfer_start(dev, &bus->scan, 64 * US_PER_BYTE / 8,
				   dev->bench.bus.thermometer_present);
		break;
	case 0x21:
		fetch_scan(dev, rp);
		break;
	case 0x23:
		bus->scan.started = false;
		break;
	default:
		return SIM_ANSWER_UNKNOWN;
	}
	return SIM_ANSWER;
}
