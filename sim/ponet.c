// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * PoNET modules, the kbd48CNC above all (protocol section 3.13). Reading a
 * module is started and then fetched; the data are those at the time of the
 * fetch's completion, not of the start.
 *
 * The keyboard's bits are scrambled on its board: byte (x / 2) XOR 1, and bit
 * y in odd columns, 7 - y in even ones, for keys and lamps alike.
 */
#include "sim/request.h"

#define MODULE_US 1500
#define OK 1
#define READING 0xFF
#define ALL_STARTED 0x10
#define FETCH 0x30

static unsigned int key_byte(unsigned int x)
{
	return (x >> 1) ^ 1u;
}

static uint8_t key_bit(unsigned int x, unsigned int y)
{
	return (uint8_t)(1u << (x & 1 ? y : 7 - y));
}

void sim_module_key(struct sim_module *module, unsigned int x, unsigned int y, bool pressed)
{
	uint8_t *byte = &module->in[key_byte(x)];

	if (pressed)
		*byte |= key_bit(x, y);
	else
		*byte &= (uint8_t)~key_bit(x, y);
}

bool sim_module_led(const struct sim_device *dev, unsigned int module, unsigned int x,
		    unsigned int y)
{
	return dev->bus.modules.out[module][key_byte(x)] & key_bit(x, y);
}

static const struct sim_module *find(const struct sim_device *dev, unsigned int id)
{
	const struct sim_module *module;

	if (id >= SIM_MODULES)
		return NULL;
	module = &dev->bench.bus.module[id];
	return module->present ? module : NULL;
}

static void settings(struct sim_device *dev, const uint8_t *rq, uint8_t *rp)
{
	const struct sim_module *module = find(dev, rq[P2]);

	if (!module)
		return;
	rp[P2] = OK;
	rp[8] = module->address;
	rp[9] = module->type;
	rp[10] = module->size;
	rp[11] = (uint8_t)(0xEB | (dev->config.bus.module_options[rq[P2]] & 0x10));
}

/* Start a read of a module, or fetch its outcome: 0x50 data, 0x60 light. */
static void transfer(struct sim_device *dev, struct sim_transfer *t, const uint8_t *rq, uint8_t *rp)
{
	const struct sim_module *module;

	if (rq[P2] == ALL_STARTED) {
		if (!find(dev, rq[P3]))
			return;
		t->data[0] = rq[P3];
		sim_transfer_start(dev, t, MODULE_US, OK);
		rp[P2] = OK;
		rp[8] = READING;
		return;
	}
	module = find(dev, t->data[0]);
	if (rq[P2] != FETCH || !t->started || !module)
		return;
	rp[P2] = OK;
	rp[8] = READING;
	if (sim_transfer_result(dev, t) != OK)
		return;
	rp[8] = module->status;
	if (rq[P1] == 0x50)
		memcpy(rp + 9, module->in, SIM_MODULE_BYTES);
	else
		rp[9] = module->light;
}

/* 0x30 automatic discovery, 0x40 one check; neither finds anything new on this bench. */
static void search(struct sim_device *dev, const uint8_t *rq, uint8_t *rp)
{
	struct sim_modules *modules = &dev->bus.modules;

	rp[P2] = OK;
	if (rq[P1] == 0x30) {
		if (rq[P2] == 0x10 || rq[P2] == 0x20)
			modules->discovery = rq[P2] == 0x10;
		return;
	}
	if (rq[P2] == 0x10)
		sim_transfer_start(dev, &modules->check, MODULE_US, OK);
	else
		rp[P2] = sim_transfer_result(dev, &modules->check);
}

static void set(struct sim_device *dev, const uint8_t *rq, uint8_t *rp)
{
	struct sim_modules *modules = &dev->bus.modules;

	if (!find(dev, rq[P2]))
		return;
	rp[P2] = OK;
	if (rq[P1] == 0x55)
		memcpy(modules->out[rq[P2]], rq + 8, SIM_MODULE_BYTES);
	else if (rq[P1] == 0x70)
		modules->pwm[rq[P2]] = rq[P3];
	else if (!sim_locked(dev))
		dev->config.bus.module_options[rq[P2]] = rq[P3];
}

static void clear(struct sim_device *dev, const uint8_t *rq, uint8_t *rp)
{
	struct sim_modules *modules = &dev->bus.modules;

	rp[P2] = OK;
	if (rq[P1] == 0x20) {
		rp[P2] = find(dev, rq[P2]) ? OK : 0;
		if (rp[P2])
			dev->config.bus.module_options[rq[P2]] = 0;
		return;
	}
	memset(modules->out, 0, sizeof(modules->out));
	memset(modules->pwm, 0, sizeof(modules->pwm));
	if (rq[P1] == 0x25)
		memset(dev->config.bus.module_options, 0, SIM_MODULES);
}

SIM_HANDLER(sim_do_ponet)
{
	struct sim_modules *modules = &dev->bus.modules;

	rp[P1] = rq[P1];
	switch (rq[P1]) {
	case 0x00:
		rp[P2] = OK;
		rp[8] = modules->state;
		break;
	case 0x10:
		settings(dev, rq, rp);
		break;
	case 0x11:
		if (find(dev, rq[P2])) {
			rp[P2] = OK;
			rp[8] = find(dev, rq[P2])->version;
		}
		break;
	case 0x15:
	case 0x55:
	case 0x70:
		set(dev, rq, rp);
		break;
	case 0x20:
	case 0x21:
	case 0x25:
		clear(dev, rq, rp);
		break;
	case 0x30:
	case 0x40:
		search(dev, rq, rp);
		break;
	case 0x50:
		transfer(dev, &modules->data, rq, rp);
		break;
	case 0x60:
		transfer(dev, &modules->light, rq, rp);
		break;
	default:
		return SIM_ANSWER_UNKNOWN;
	}
	return SIM_ANSWER;
}
