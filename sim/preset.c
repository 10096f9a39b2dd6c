// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Presets. They set what an owner would have set with the vendor's tools and
 * saved, so a device with a preset comes up configured, and comes up so again
 * after a reboot; after "reboot lose-config" it does not.
 *
 * Only pins are used which the 57CNC and the 57E both have.
 */
#include "sim/preset.h"

#include "sim/bench.h"
#include "sim/parse.h"

#define DEMO_SPEED 25.0f	/* pulses/ms: what the internal generator gives */
#define DEMO_ACCEL 0.1f
#define DEMO_HOME -5000
#define DEMO_MINUS -8000
#define DEMO_PLUS 200000
#define PRINTER_PERIOD 2500000	/* 10 Hz */
#define PRINTER_HOME -4000	/* 50 mm away at 80 pulses per mm */
#define PRINTER_HOME_Z -2000
#define SERVO_PERIOD 1250	/* 20 kHz */

static void set_function(struct sim_device *dev, unsigned int pin, uint8_t function)
{
	dev->config.pins.function[pin - 1] = function;
}

static void analog_inputs(struct sim_device *dev)
{
	for (unsigned int i = 0; i < SIM_ANALOGS; i++) {
		if (wire_pin_can(wire_model(dev->options.hardware), 41 + i, WIRE_USE_ANALOG))
			set_function(dev, 41 + i, SIM_PIN_ANALOG_IN);
		dev->bench.analog[i] = (struct sim_source){ .low = (uint16_t)(500 * (i + 1)) };
	}
}

static void encoder(struct sim_device *dev, unsigned int k, unsigned int a, unsigned int b)
{
	dev->config.encoders.option[k] = SIM_ENC_ENABLE | SIM_ENC_X4;
	dev->config.encoders.pins[k] = (uint8_t)(a - 1);
	dev->config.encoders.pins[SIM_BASIC_ENCODERS + k] = (uint8_t)(b - 1);
}

static void wire_pins(struct sim_device *dev, const uint8_t (*pairs)[2], unsigned int count)
{
	for (unsigned int i = 0; i < count; i++) {
		set_function(dev, pairs[i][0], SIM_PIN_DIGITAL_OUT);
		set_function(dev, pairs[i][1], SIM_PIN_DIGITAL_IN);
		sim_bench_wire(dev, pairs[i][0] - 1u, pairs[i][1] - 1u);
	}
}

static void loopback(struct sim_device *dev)
{
	static const uint8_t pairs[][2] = {
		{ 31, 9 },  { 32, 10 }, { 33, 11 }, { 34, 12 },
		{ 35, 13 }, { 36, 14 }, { 37, 15 }, { 38, 16 },
	};

	wire_pins(dev, pairs, sizeof(pairs) / sizeof(pairs[0]));
	analog_inputs(dev);
	encoder(dev, 0, 1, 2);
	encoder(dev, 1, 5, 6);
}

static void demo_axis(struct sim_device *dev, unsigned int i)
{
	struct sim_mechanics *m = &dev->bench.machine.axis[i];
	uint8_t *block = dev->config.engine.axis[i];
	struct sim_switch sw = { .wired = true, .pin = SIM_DEDICATED };

	block[8 - 8] = SIM_AC_ENABLED | SIM_AC_PLANNER | SIM_AC_POSITION;
	block[9 - 8] = SIM_SW_LIMIT_MINUS | SIM_SW_LIMIT_PLUS | SIM_SW_HOME;
	block[13 - 8] = 40;
	block[14 - 8] = 25;
	wire_put_f32(block + 16 - 8, DEMO_SPEED);
	wire_put_f32(block + 20 - 8, DEMO_ACCEL);
	wire_put_f32(block + 24 - 8, DEMO_ACCEL);

	sw.from = INT32_MIN;
	sw.to = DEMO_MINUS;
	m->minus = sw;
	sw.to = DEMO_HOME;
	m->home = sw;
	sw.from = DEMO_PLUS;
	sw.to = INT32_MAX;
	m->plus = sw;
}

static void demo(struct sim_device *dev)
{
	static const uint8_t pairs[][2] = {
		{ 31, 9 },
		{ 32, 10 },
		{ 33, 11 },
		{ 34, 12 },
	};

	wire_pins(dev, pairs, sizeof(pairs) / sizeof(pairs[0]));
	for (unsigned int pin = 13; pin <= 16; pin++)
		set_function(dev, pin, SIM_PIN_DIGITAL_IN);
	set_function(dev, 52, SIM_PIN_DIGITAL_IN);
	sim_bench_blink(dev, 15 - 1, 500);
	sim_bench_blink(dev, 16 - 1, 170);

	analog_inputs(dev);
	dev->bench.analog[0] = (struct sim_source){ .low = 0, .high = 4095, .period_ms = 5000 };
	dev->bench.analog[1] = (struct sim_source){ .low = 1000, .high = 3000, .period_ms = 900 };

	encoder(dev, 0, 1, 2);
	encoder(dev, 1, 3, 4);
	encoder(dev, 2, 5, 6);
	for (unsigned int i = 0; i < 3; i++)
		sim_bench_couple(dev, i, (int)i, 1, 1, 0);
	dev->config.encoders.ultra_on = 1;
	dev->config.encoders.ultra_options = 0x04;
	dev->bench.shaft[SIM_ULTRA_FAST].rate = 40000;
	dev->bench.shaft[SIM_ULTRA_FAST].index_every = 4000;

	dev->config.pwm.enabled = 0x21;
	dev->config.pwm.period = 2500;
	dev->config.engine.axes = 3;
	for (unsigned int i = 0; i < 3; i++)
		demo_axis(dev, i);
}

static void home_switch(struct sim_device *dev, unsigned int axis, int32_t to)
{
	dev->bench.machine.axis[axis].home = (struct sim_switch){
		.wired = true,
		.pin = SIM_DEDICATED,
		.from = INT32_MIN,
		.to = to,
	};
}

static void printer(struct sim_device *dev)
{
	set_function(dev, 43, SIM_PIN_ANALOG_IN);
	set_function(dev, 44, SIM_PIN_ANALOG_IN);
	dev->config.pwm.period = PRINTER_PERIOD;
	sim_oven_fit(dev, 43 - 41, &sim_heat_hotend, true, 0);
	sim_oven_fit(dev, 44 - 41, &sim_heat_bed, true, 1);
	home_switch(dev, 0, PRINTER_HOME);
	home_switch(dev, 1, PRINTER_HOME);
	home_switch(dev, 2, PRINTER_HOME_Z);
}

static void servo_mill(struct sim_device *dev)
{
	for (unsigned int i = 0; i < 3; i++) {
		const unsigned int direction = 31 + i, enable = 35 + i;

		set_function(dev, direction, SIM_PIN_DIGITAL_OUT);
		set_function(dev, enable, SIM_PIN_DIGITAL_OUT);
		encoder(dev, i, 1 + 2 * i, 2 + 2 * i);
		sim_servo_fit(dev, i,
			      &(struct sim_servo){
				      .kind = SIM_SERVO_SIGN,
				      .pwm = (uint8_t)i,
				      .other = (uint8_t)(direction - 1),
				      .enable = (uint8_t)(enable - 1),
			      },
			      &sim_motor_small);
	}
	dev->config.pwm.period = SERVO_PERIOD;
}

bool sim_preset_apply(struct sim_device *dev, const char *name, struct sim_text *why)
{
	unsigned int which;

	if (!sim_parse_choice(why, "preset", name, SIM_PRESETS, &which))
		return false;
	if (which == 1)
		loopback(dev);
	else if (which == 2)
		demo(dev);
	else if (which == 3)
		printer(dev);
	else if (which == 4)
		servo_mill(dev);
	sim_machine_rewired(&dev->bench.machine);
	dev->flash = dev->config;
	for (unsigned int i = 0; i < SIM_AXES; i++)
		sim_axis_load(dev, i);
	sim_pins_settle(dev);
	return true;
}
