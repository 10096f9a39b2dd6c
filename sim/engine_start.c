// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Starting the pulse engine, and taking axis settings into use.
 *
 * The generator and the power-enable mask set by 0x01 only work after the
 * engine was rebooted (0x05), as the vendor's example insists. That reboot
 * starts from the configuration in RAM: the example does not save before it,
 * so a reload from flash would undo what it has just set. Rebooting the
 * device (0xF3) is what goes back to flash.
 *
 * Speeds arrive as floats from the network. Anything that is not a positive
 * finite number is taken as 0, an axis which does not move.
 */
#include "sim/engine_part.h"

#include <math.h>

#define AXIS_FIELD(block, at) ((block) + (at) - 8)

static double sane(float value)
{
	return isfinite(value) && value > 0 ? (double)value : 0;
}

static void load_homing(struct sim_axis_setup *setup, const uint8_t *block)
{
	uint8_t algorithm = *AXIS_FIELD(block, 43);

	if (algorithm == 0 || algorithm == 0xFF)
		algorithm = SIM_HOMING_DEFAULT;
	setup->home_on_active = algorithm & 0x0F;
	setup->home_on_release = algorithm >> 4;
	setup->home_percent = *AXIS_FIELD(block, 13);
	setup->return_percent = *AXIS_FIELD(block, 14);
	setup->back_off = wire_get_i32(AXIS_FIELD(block, 45));
}

static void load_mpg(struct sim_axis_setup *setup, const uint8_t *block)
{
	int16_t multiplier = (int16_t)wire_get_u16(AXIS_FIELD(block, 36));
	uint16_t divider = wire_get_u16(AXIS_FIELD(block, 49));

	setup->mpg_encoder = *AXIS_FIELD(block, 15);
	setup->mpg_ratio = (double)multiplier / (divider ? divider : 1);
}

static void load_setup(struct sim_axis_setup *setup, const uint8_t *block)
{
	setup->options = *AXIS_FIELD(block, 8);
	setup->switches = *AXIS_FIELD(block, 9);
	setup->home_pin = *AXIS_FIELD(block, 10);
	setup->minus_pin = *AXIS_FIELD(block, 11);
	setup->plus_pin = *AXIS_FIELD(block, 12);
	setup->limits.speed = sane(wire_get_f32(AXIS_FIELD(block, 16)));
	setup->limits.accel = sane(wire_get_f32(AXIS_FIELD(block, 20)));
	setup->limits.decel = sane(wire_get_f32(AXIS_FIELD(block, 24)));
	setup->soft_min = wire_get_i32(AXIS_FIELD(block, 28));
	setup->soft_max = wire_get_i32(AXIS_FIELD(block, 32));
	setup->enable_pin = *AXIS_FIELD(block, 38);
	setup->enable_invert = *AXIS_FIELD(block, 39);
	setup->signals = *AXIS_FIELD(block, 51);
	load_homing(setup, block);
	load_mpg(setup, block);
}

unsigned int sim_engine_axes_supported(const struct sim_device *dev)
{
	if ((dev->engine.generator & SIM_GENERATOR_TYPE) == SIM_GENERATOR_INTERNAL)
		return 3;
	return dev->options.hardware == WIRE_HW_57CNCPRO4X25 ? 4 : SIM_AXES;
}

unsigned int sim_engine_kilohertz(const struct sim_device *dev)
{
	bool internal = (dev->engine.generator & SIM_GENERATOR_TYPE) == SIM_GENERATOR_INTERNAL;

	if (dev->options.choices.axis_khz)
		return dev->options.choices.axis_khz;
	return internal ? 25 : 125;
}

bool sim_axis_usable(const struct sim_device *dev, unsigned int axis)
{
	uint8_t options = dev->engine.axis[axis].setup.options;

	return axis < dev->config.engine.axes && axis < sim_engine_axes_supported(dev) &&
	       (options & SIM_AC_ENABLED) && !(options & SIM_AC_FAST_OUTPUT);
}

/* A standing axis gives up its fraction of a pulse, or it would creep onto the whole one. */
void sim_axis_rest(struct sim_axis *axis)
{
	if (axis->planner.speed == 0)
		axis->planner.position = (double)axis->pulses;
	axis->reference = axis->setup.options & SIM_AC_POSITION ? sim_axis_position(axis) : 0;
	axis->speed_ratio = 1;
}

void sim_axis_load(struct sim_device *dev, unsigned int axis)
{
	struct sim_axis *ax = &dev->engine.axis[axis];
	uint8_t before = ax->setup.options;
	double ceiling = sim_engine_kilohertz(dev);

	load_setup(&ax->setup, dev->config.engine.axis[axis]);
	ax->setup.limits.speed = fmin(ax->setup.limits.speed, ceiling);
	if ((before ^ ax->setup.options) & (SIM_AC_PLANNER | SIM_AC_POSITION))
		sim_axis_rest(ax);
	dev->dirty = true;
}

void sim_engine_start(struct sim_device *dev)
{
	struct sim_engine *pe = &dev->engine;

	memset(pe, 0, sizeof(*pe));
	pe->generator = dev->config.engine.generator;
	pe->power_states = dev->config.engine.power_states;
	pe->output_mask = 0xFF;
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		sim_axis_load(dev, i);
		pe->axis[i].speed_ratio = 1;
	}
	sim_engine_read_switches(dev);
	dev->dirty = true;
}

void sim_engine_defaults(struct sim_engine_config *config, uint8_t hardware)
{
	bool cnc = hardware == WIRE_HW_57CNC || hardware == WIRE_HW_57CNCPRO4X25;

	config->generator = cnc ? SIM_GENERATOR_IO : SIM_GENERATOR_INTERNAL;
	config->emergency_pin = 1;
	for (unsigned int i = 0; i < SIM_AXES; i++) {
		uint8_t *block = config->axis[i];

		*AXIS_FIELD(block, 8) = SIM_AC_PLANNER | SIM_AC_POSITION;
		*AXIS_FIELD(block, 13) = 10;
		*AXIS_FIELD(block, 14) = 50;
		wire_put_f32(AXIS_FIELD(block, 16), 20.0f);
		wire_put_f32(AXIS_FIELD(block, 20), 0.1f);
		wire_put_f32(AXIS_FIELD(block, 24), 0.1f);
		*AXIS_FIELD(block, 43) = SIM_HOMING_DEFAULT;
	}
}
