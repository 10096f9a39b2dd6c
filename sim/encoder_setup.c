// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Encoder commands (protocol section 3.8). 0xCD writes thirteen counters at
 * once or none: a single one cannot be set, only 0x1A resets one, and does so
 * to all its 32 bits.
 */
#include "sim/request.h"

#define VALUES_PER_REQUEST 13

SIM_HANDLER(sim_do_encoder_set)
{
	struct sim_encoders_config *config = &dev->config.encoders;
	unsigned int k = rq[P1];

	if (k >= SIM_BASIC_ENCODERS || sim_locked(dev)) {
		rp[P1] = 1;
		return SIM_ANSWER;
	}
	config->option[k] = rq[P2];
	config->pins[k] = rq[P3];
	config->pins[SIM_BASIC_ENCODERS + k] = rq[P4];
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_encoder_get)
{
	const struct sim_encoders_config *config = &dev->config.encoders;
	unsigned int k = rq[P1];

	rp[P1] = rq[P1];
	if (k >= SIM_BASIC_ENCODERS)
		return SIM_ANSWER;
	rp[P2] = config->option[k];
	rp[P3] = config->pins[k];
	rp[P4] = config->pins[SIM_BASIC_ENCODERS + k];
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_encoder_raw)
{
	unsigned int k = rq[P1];

	rp[P1] = rq[P1];
	if (k >= SIM_ENCODERS)
		return SIM_ANSWER;
	if (rq[WIRE_AT_OP] == 0x1A)
		dev->encoders.raw[k] = 0;
	rp[P2] = (uint8_t)dev->encoders.raw[k];
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_encoder_options)
{
	uint8_t *option = dev->config.encoders.option;

	if (rq[P1] == 1 && !sim_locked(dev))
		memcpy(option, rq + 8, SIM_BASIC_ENCODERS);
	memcpy(rp + 8, option, SIM_BASIC_ENCODERS);
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_encoder_pins)
{
	uint8_t *pins = dev->config.encoders.pins;

	if (rq[P1] == 1 && !sim_locked(dev)) {
		memcpy(pins, rq + 8, SIM_BASIC_ENCODERS);
		memcpy(pins + SIM_BASIC_ENCODERS, rq + 33, SIM_BASIC_ENCODERS);
	}
	memcpy(rp + 8, pins, SIM_BASIC_ENCODERS);
	memcpy(rp + 33, pins + SIM_BASIC_ENCODERS, SIM_BASIC_ENCODERS);
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_encoder_values)
{
	unsigned int option = rq[P1];
	uint32_t *raw = dev->encoders.raw + (option % 10 == 1 ? VALUES_PER_REQUEST : 0);

	if (option > 1 && option != 10 && option != 11)
		return SIM_ANSWER;
	for (unsigned int i = 0; i < VALUES_PER_REQUEST; i++) {
		if (option >= 10)
			raw[i] = wire_get_u32(rq + 8 + 4 * i);
		else
			wire_put_u32(rp + 8 + 4 * i, raw[i]);
	}
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_fast_encoders)
{
	struct sim_encoders_config *config = &dev->config.encoders;

	if ((rq[P1] & 0x0F) != 2 && !sim_locked(dev)) {
		config->fast = rq[P1];
		config->fast_index = rq[P2] & 1;
	}
	rp[P1] = config->fast;
	rp[P2] = config->fast_index;
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_ultra_encoder)
{
	struct sim_encoders_config *config = &dev->config.encoders;

	if (rq[P1] != 0xFF && !sim_locked(dev)) {
		config->ultra_on = rq[P1];
		config->ultra_options = rq[P2];
		config->ultra_filter = wire_get_u32(rq + 8);
		dev->encoders.ultra_armed = rq[P3] == 1;
	}
	rp[P1] = config->ultra_on;
	rp[P2] = config->ultra_options;
	wire_put_u32(rp + 8, config->ultra_filter);
	rp[12] = rp[P1];
	rp[13] = rp[P2];
	return SIM_ANSWER;
}
