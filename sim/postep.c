// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * PoStep drivers: the device's tables, and the talk between it and the drivers.
 *
 * A request only reads or writes the tables. The talk is the device's own affair: each
 * driver in turn, what its "update config" says, and a counter goes on. A driver without
 * power or at another address is not talked to, and its counter stands.
 *
 * That a write is repeated at each turn until the client says something else is a CHOICE.
 */
#include "sim/engine_part.h"

enum {
	ROW = 6,
	COUNTER = 5,
	MODE = 0xC0,
	MODE_WRITE = 0x80,
	FETCH_ALL = 0x20,
	NUMBER = 0x1F,
	NUMBER_STEP = 6,
	NUMBER_LIMIT = 7,
	NUMBER_CURRENT = 8,
	NUMBER_SAVE = 11,
	FIRST_ADDRESS = 33,
};

void sim_postep_init(struct sim_postep *postep)
{
	for (unsigned int i = 0; i < SIM_AXES; i++)
		postep[i] = (struct sim_postep){
			.powered = 1,
			.address = (uint8_t)(FIRST_ADDRESS + i),
			.supply = 24 * 4,
			.temperature = 40,
			.state = 2,
			.mode = 1,
			.step = 4,
			.limit = 85,
			.current = { 2000, 1000, 500 },
			.version = { 1, 2, 1, 14 },
		};
}

/* Into the tables that the client reads. */
static void fetch_all(struct sim_device *dev, unsigned int axis, const struct sim_postep *driver)
{
	struct sim_engine_config *config = &dev->config.engine;
	uint8_t *mode = config->postep_mode + ROW * axis;

	mode[0] = driver->mode;
	mode[1] = driver->step;
	mode[2] = driver->limit;
	for (unsigned int i = 0; i < 3; i++)
		wire_put_u16(config->postep_current + ROW * axis + 2 * i, driver->current[i]);
	memcpy(dev->engine.postep_version[axis], driver->version, sizeof(driver->version));
}

static void fetch(struct sim_device *dev, unsigned int axis, const struct sim_postep *driver,
		  uint8_t what)
{
	const uint8_t have[COUNTER] = { driver->supply, driver->temperature, driver->inputs,
					driver->state, driver->faults };

	for (unsigned int i = 0; i < COUNTER; i++) {
		if (what >> i & 1)
			dev->engine.postep_status[ROW * axis + i] = have[i];
	}
	if (what & FETCH_ALL)
		fetch_all(dev, axis, driver);
}

static void write_number(struct sim_device *dev, unsigned int axis, struct sim_postep *driver,
			 unsigned int number)
{
	const struct sim_engine_config *config = &dev->config.engine;
	const uint8_t *mode = config->postep_mode + ROW * axis;

	if (number == NUMBER_STEP)
		driver->step = mode[1];
	else if (number == NUMBER_LIMIT)
		driver->limit = mode[2];
	else if (number >= NUMBER_CURRENT && number < NUMBER_SAVE)
		driver->current[number - NUMBER_CURRENT] =
			wire_get_u16(config->postep_current + ROW * axis +
				     2 * (number - NUMBER_CURRENT));
	else if (number == NUMBER_SAVE)
		driver->saved++;
}

void sim_postep_slot(struct sim_device *dev)
{
	const unsigned int turn = (unsigned int)(dev->stats.slots % SIM_POSTEP_TURN_MS);
	const uint8_t *comm = dev->config.engine.postep_comm + 3 * (turn % SIM_AXES);
	struct sim_postep *driver = &dev->bench.postep[turn % SIM_AXES];

	if (turn >= SIM_AXES || !dev->config.engine.postep_enable || !comm[0] || !driver->powered ||
	    driver->address != comm[1])
		return;
	if ((comm[2] & MODE) == MODE_WRITE)
		write_number(dev, turn, driver, comm[2] & NUMBER);
	else if (!(comm[2] & MODE))
		fetch(dev, turn, driver, comm[2]);
	dev->engine.postep_status[ROW * turn + COUNTER]++;
}

SIM_HANDLER(sim_pe_postep_comm)
{
	struct sim_engine_config *config = &dev->config.engine;

	if (rq[P2] == 0x10 && !sim_locked(dev)) {
		config->postep_enable = rq[P3];
		memcpy(config->postep_comm, rq + 8, sizeof(config->postep_comm));
	}
	rp[P2] = rq[P2];
	rp[P3] = config->postep_enable;
	memcpy(rp + 8, config->postep_comm, sizeof(config->postep_comm));
	return SIM_ANSWER;
}

SIM_HANDLER(sim_pe_postep_status)
{
	(void)rq;
	memcpy(rp + 8, dev->engine.postep_status, sizeof(dev->engine.postep_status));
	return SIM_ANSWER;
}

SIM_HANDLER(sim_pe_postep_table)
{
	struct sim_engine_config *config = &dev->config.engine;
	uint8_t *table = rq[P1] == 0x52 ? config->postep_current : config->postep_mode;

	if (rq[P2] == 0x10 && !sim_locked(dev))
		memcpy(table, rq + 8, sizeof(config->postep_current));
	rp[P2] = rq[P2];
	memcpy(rp + 8, table, sizeof(config->postep_current));
	return SIM_ANSWER;
}

SIM_HANDLER(sim_pe_postep_versions)
{
	(void)rq;
	for (unsigned int i = 0; i < SIM_AXES; i++)
		memcpy(rp + 8 + ROW * i, dev->engine.postep_version[i],
		       sizeof(dev->engine.postep_version[i]));
	return SIM_ANSWER;
}
