// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Settings which are only kept: key maps, servos, decoder, parameters of
 * manufacturers (protocol sections 3.2, 3.8 and 3.23). A HAL driver needs
 * none of them, but the vendor's library reads and writes the key maps with
 * every pin configuration, and a device which answered it with nothing would
 * hide a driver which overwrites them.
 */
#include "sim/request.h"

static void keep(struct sim_device *dev, uint8_t *store, size_t len, bool write, const uint8_t *rq,
		 uint8_t *rp)
{
	if (write && !sim_locked(dev))
		memcpy(store, rq + 8, len);
	memcpy(rp + 8, store, len);
}

SIM_HANDLER(sim_do_key_map)
{
	keep(dev, dev->config.store.key_map[rq[WIRE_AT_OP] - 0xC1], SIM_PINS, rq[P1] == 1, rq, rp);
	return SIM_ANSWER;
}

/* 1..4 write, 11..14 read. */
SIM_HANDLER(sim_do_key_triggered)
{
	unsigned int block = rq[P1] % 10;

	if (block < 1 || block > 4 || rq[P1] > 14)
		return SIM_ANSWER_UNKNOWN;
	rp[P1] = rq[P1];
	keep(dev, dev->config.store.key_triggered[block - 1], SIM_PINS, rq[P1] < 10, rq, rp);
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_encoder_keys)
{
	uint8_t *store = dev->config.store.encoder_keys[rq[WIRE_AT_OP] - 0xC6];

	if (rq[P1] == 1 && !sim_locked(dev)) {
		memcpy(store, rq + 8, 25);
		memcpy(store + 25, rq + 33, 25);
	}
	memcpy(rp + 8, store, 25);
	memcpy(rp + 33, store + 25, 25);
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_typematic)
{
	rp[P1] = rq[P1];
	keep(dev, dev->config.store.typematic[rq[WIRE_AT_OP] - 0x21], SIM_PINS, rq[P1] == 1, rq,
	     rp);
	return SIM_ANSWER;
}

/* Even sub-commands read, odd ones write: setup, one channel's, positions. */
SIM_HANDLER(sim_do_servo)
{
	bool write = rq[P1] & 1;
	uint8_t *store;

	switch (rq[P1] & 0xFE) {
	case 0x00:
		store = dev->config.store.servo_setup;
		break;
	case 0x10:
		store = dev->config.store.servo_channel[rq[P2] & 7];
		break;
	case 0x20:
		store = dev->run.servo_position;
		break;
	default:
		return SIM_ANSWER_UNKNOWN;
	}
	rp[P1] = rq[P1];
	keep(dev, store, SIM_PINS, write, rq, rp);
	return SIM_ANSWER;
}

/* No signal ever comes to this decoder: its age stands at the most. */
SIM_HANDLER(sim_do_decoder)
{
	uint8_t *decoder = dev->config.store.decoder;

	if (rq[P1] == 1 && !sim_locked(dev))
		memcpy(decoder, rq + P2, sizeof(dev->config.store.decoder));
	rp[P1] = rq[P1];
	memcpy(rp + P2, decoder, sizeof(dev->config.store.decoder));
	wire_put_u16(rp + 8, UINT16_MAX);
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_oem)
{
	struct sim_store_config *store = &dev->config.store;
	unsigned int index = rq[P2];
	unsigned int count = rq[P1] == 0 ? rq[P3] : 1;

	if (rq[P1] > 2)
		return SIM_ANSWER_UNKNOWN;
	for (unsigned int i = 0; i < count && i < 8 && index + i < 62; i++) {
		unsigned int k = index + i;

		if (rq[P1] == 1 && !sim_locked(dev)) {
			store->oem[k] = wire_get_u32(rq + 8);
			store->oem_set |= UINT64_C(1) << k;
		} else if (rq[P1] == 2 && !sim_locked(dev)) {
			store->oem[k] = 0;
			store->oem_set &= ~(UINT64_C(1) << k);
		}
		wire_put_u32(rp + 8 + 4 * i, store->oem[k]);
		if (store->oem_set >> k & 1)
			rp[P4] |= (uint8_t)(1u << i);
	}
	rp[P1] = rq[P1];
	return SIM_ANSWER;
}
