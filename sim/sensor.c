// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * EasySensors (protocol section 3.20): a hundred places, set up in up to four
 * at a time and read in up to thirteen. A place without a type has no value
 * and its OK bit is clear.
 */
#include "sim/request.h"

#define SETUP_LEN 12
#define SETUP_MOST 4
#define VALUES_MOST 13

SIM_HANDLER(sim_do_sensor_setup)
{
	struct sim_bus_config *config = &dev->config.bus;
	unsigned int count = rq[P2] > SETUP_MOST ? SETUP_MOST : rq[P2];

	rp[P1] = rq[P1];
	rp[P2] = rq[P2];
	for (unsigned int i = 0; i < count && rq[P1] + i < SIM_SENSORS; i++) {
		uint8_t *setup = config->sensor[rq[P1] + i];

		if (rq[P3] == 1 && !sim_locked(dev))
			memcpy(setup, rq + 8 + SETUP_LEN * i, SETUP_LEN);
		memcpy(rp + 8 + SETUP_LEN * i, setup, SETUP_LEN);
	}
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_sensor_values)
{
	const struct sim_bus_bench *bench = &dev->bench.bus;
	unsigned int count = rq[P2] > VALUES_MOST ? VALUES_MOST : rq[P2];
	uint16_t good = 0;

	rp[P1] = rq[P1];
	rp[P2] = rq[P2];
	for (unsigned int i = 0; i < count && rq[P1] + i < SIM_SENSORS; i++) {
		unsigned int k = rq[P1] + i;

		if (!dev->config.bus.sensor[k][0] || !bench->sensor_ok[k])
			continue;
		good |= (uint16_t)(1u << i);
		wire_put_i32(rp + 8 + 4 * i, bench->sensor[k]);
	}
	wire_put_u16(rp + 4, good);
	return SIM_ANSWER;
}
