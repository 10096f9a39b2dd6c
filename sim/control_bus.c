// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Commands for what hangs on the buses. They change the devices out there, not
 * what the simulated one knows of them: it learns of a pressed key when it is
 * asked to read the keyboard.
 */
#include "sim/control_part.h"

#include <math.h>

static bool do_poext(struct sim_order *order)
{
	if (!sim_order_no_more(order, 0))
		return false;
	sim_text_add(order->out, "data=");
	for (int i = 0; i < SIM_POEXT_BYTES; i++)
		sim_text_add(order->out, "%02x", order->dev->bus.poext[i]);
	sim_text_add(order->out, "\nenabled=%u\n", order->dev->config.bus.poext_on);
	return true;
}

static bool cell(struct sim_order *order, int64_t *module, int64_t *x, int64_t *y)
{
	return sim_order_integer(order, 0, "module", 0, SIM_MODULES - 1, module) &&
	       sim_order_integer(order, 1, "column", 0, 11, x) &&
	       sim_order_integer(order, 2, "row", 0, 3, y);
}

static bool do_kbd(struct sim_order *order)
{
	unsigned int pressed;
	int64_t module, x, y;

	if (!cell(order, &module, &x, &y) ||
	    !sim_order_choice(order, 3, "state", "0|1", &pressed) || !sim_order_no_more(order, 4))
		return false;
	sim_module_key(&order->dev->bench.bus.module[module], (unsigned int)x, (unsigned int)y,
		       pressed);
	return true;
}

static bool do_lamp(struct sim_order *order)
{
	int64_t module, x, y;

	if (!cell(order, &module, &x, &y) || !sim_order_no_more(order, 3))
		return false;
	sim_text_add(order->out, "lit=%d\n",
		     sim_module_led(order->dev, (unsigned int)module, (unsigned int)x,
				    (unsigned int)y));
	return true;
}

static bool do_module(struct sim_order *order)
{
	struct sim_module *module;
	int64_t number, light = 0;
	unsigned int there;

	if (!sim_order_integer(order, 0, "module", 0, SIM_MODULES - 1, &number) ||
	    !sim_order_choice(order, 1, "state", "off|on", &there))
		return false;
	if (order->word[2] &&
	    (!sim_order_integer(order, 2, "light", 0, 255, &light) || !sim_order_no_more(order, 3)))
		return false;
	module = &order->dev->bench.bus.module[number];
	module->present = there;
	module->type = SIM_MODULE_KBD48;
	module->size = SIM_MODULE_BYTES;
	module->version = 1;
	module->address = (uint8_t)(0x10 + number);
	module->light = (uint8_t)light;
	return true;
}

static bool do_sensor(struct sim_order *order)
{
	struct sim_bus_bench *bench = &order->dev->bench.bus;
	unsigned int good = 1;
	int64_t number, value;

	if (!sim_order_integer(order, 0, "sensor", 0, SIM_SENSORS - 1, &number) ||
	    !sim_order_integer(order, 1, "value", INT32_MIN, INT32_MAX, &value))
		return false;
	if (order->word[2] &&
	    (!sim_order_choice(order, 2, "state", "bad|ok", &good) || !sim_order_no_more(order, 3)))
		return false;
	bench->sensor[number] = (int32_t)value;
	bench->sensor_ok[number] = good;
	return true;
}

static bool do_temperature(struct sim_order *order)
{
	double degrees;

	if (!sim_parse_number(order->why, "degrees", order->word[0], -55, 125, &degrees) ||
	    !sim_order_no_more(order, 1))
		return false;
	order->dev->bench.bus.temperature = (int16_t)lrint(degrees * 16);
	return true;
}

const struct sim_command sim_commands_bus[] = {
	{ "poext", "", "bytes on the PoExtBus", do_poext },
	{ "kbd", "MODULE X Y 0|1", "key of a kbd48CNC, column 0..11, row 0..3", do_kbd },
	{ "lamp", "MODULE X Y", "whether the lamp of that key is lit", do_lamp },
	{ "module", "N off|on [LIGHT]", "plug a kbd48CNC into PoNET place N", do_module },
	{ "sensor", "N VALUE [bad|ok]", "EasySensor 0..99, usually in 1/100", do_sensor },
	{ "temperature", "DEGREES", "1-Wire thermometer", do_temperature },
	{ 0 },
};
