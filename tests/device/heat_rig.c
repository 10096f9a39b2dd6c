/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Two heaters with the physics of a block each, and what a test does with them. */

#include "tests/device/heat_rig.h"
#include <math.h>
#include <string.h>
#include "wire/io.h"

static const unsigned int input[HEATERS] = { 2, 0 }; /* by a fast reply, and by a slow one */

/* Of a tenth of a hot end, so that a test needs seconds of virtual time. */
static const struct sim_heat_config block = {
	.watts = 40,
	.capacity = 3,
	.loss = 0.1,
	.room = 22,
	.delay_s = 0.2,
	.lag_s = 0.2,
	.noise = 0.1,
	.pull_up = 4700,
	.ohm = 100e3,
	.beta = 3950,
};

struct world world;
struct sim_heat heat[HEATERS];

double heat_power(unsigned int heater)
{
	const struct sim_pwm_config *pwm = &world.rig.device.config.pwm;
	const struct heating_config *config = &world.config.heater[heater];

	sim_rig_run(&world.rig, world_device_time(&world));
	if (config->kind == HEATING_PIN)
		return world.rig.device.pins.latch >> config->output & 1 ? 1 : 0;
	return pwm->enabled >> config->output & 1 && pwm->period ?
		       (double)sim_pwm_duty(&world.rig.device, config->output) / pwm->period :
		       0;
}

void heat_warm(double seconds)
{
	for (unsigned int i = 0; i < HEATERS; i++) {
		struct sim_source *source = &world.rig.device.bench.analog[input[i]];

		sim_heat_run(&heat[i], seconds, heat_power(i), 0);
		source->low = sim_heat_reading(&heat[i]);
	}
}

void heat_cycle(void)
{
	static struct pokeys_report report;

	device_report(world.device, &report); /* as the loop does */
	world_cycle(&world);
	heat_warm(0.001);
}

void heat_run(uint64_t for_ns)
{
	const uint64_t end = world.tick + for_ns;

	while (world.tick < end)
		heat_cycle();
}

void heat_command(unsigned int heater, float target)
{
	world.command.heater_mask |= 1u << heater;
	world.command.heater_target[heater] = target;
}

static void heat_configure(unsigned int heater, enum heating_output kind, uint8_t output)
{
	struct heating_config *config = &world.config.heater[heater];

	*config = (struct heating_config){
		.heater = heater_usual,
		.sensor = (uint8_t)input[heater],
		.kind = (uint8_t)kind,
		.output = output,
		.least_ns = 100 * MS,
		.within = 3,
	};
	strcpy(config->name, heater == HOTEND ? "hotend" : "bed");
	config->heater.gains = (struct pid_gains){ .p = 0.03, .i = 0.01, .smooth = 0.1 };
	config->heater.lease_ns = HEATER_PERIOD_NS;
	world.config.heaters++;
	world_pin(&world, WIRE_ANALOG_FIRST_PIN - 1 + input[heater], WIRE_PIN_ANALOG_IN);
}

int heat_prepare(void **state)
{
	(void)state;
	world_init(&world, NULL);
	heat_configure(HOTEND, HEATING_PWM, HOTEND_PWM);
	heat_configure(BED, HEATING_PIN, BED_PIN);
	world_pin(&world, BED_PIN, WIRE_PIN_OUTPUT);
	world_pin(&world, LAMP, WIRE_PIN_OUTPUT);
	world.config.settings.set |= POKEYS_SET_PWM_PERIOD;
	world.config.settings.pwm_period = PERIOD;
	for (unsigned int i = 0; i < HEATERS; i++)
		sim_heat_init(&heat[i], &block, 20055 + i);
	return 0;
}

void heat_start(void)
{
	world_start(&world);
	world_commander(&world, 5);
	heat_warm(0.001);
	/* left alone first: nobody knows what a daemon before has left on */
	world_until(&world, world_is_running, 2 * SECOND);
	heat_command(HOTEND, 0);
	heat_command(BED, 0);
	heat_run(300 * MS);
}

int heat_begin(void **state)
{
	heat_prepare(state);
	heat_start();
	return 0;
}

const struct pokeys_heater *heat_shown(unsigned int heater)
{
	return &world.state.heater[heater];
}

void heat_up(void)
{
	heat_command(HOTEND, 150);
	heat_command(BED, 60);
	heat_run(30 * SECOND);
	assert_int_equal(heat_shown(HOTEND)->state, POKEYS_HEATER_HEATING);
	assert_int_equal(heat_shown(BED)->state, POKEYS_HEATER_HEATING);
	assert_true(heat_shown(HOTEND)->at_temperature);
}

/* No power reaches either of them any more, at most so much later. */
void heat_expect_off(uint64_t within_ns)
{
	const uint64_t end = world.tick + within_ns;

	while (world.tick <= end && (heat_power(HOTEND) > 0 || heat_power(BED) > 0))
		heat_cycle();
	assert_true(heat_power(HOTEND) <= 0 && heat_power(BED) <= 0);
	for (unsigned int i = 0; i < 1000; i++) {
		heat_cycle();
		assert_true(heat_power(HOTEND) <= 0 && heat_power(BED) <= 0);
	}
}

void heat_expect_fault(unsigned int heater, enum pokeys_heater_fault fault)
{
	assert_true(heat_shown(heater)->state == POKEYS_HEATER_FAULT ||
		    heat_shown(heater)->state == POKEYS_HEATER_STOPPING);
	assert_int_equal(heat_shown(heater)->fault, fault);
	assert_true(heat_shown(heater)->target == 0 && heat_shown(heater)->power == 0);
}

enum pokeys_outcome heat_reset(unsigned int heater)
{
	const struct pokeys_one_shot shot = {
		.operation = POKEYS_ONE_SHOT_HEATER_RESET,
		.index = (uint8_t)heater,
	};

	return world_do(&world, &shot, 1 * SECOND);
}

enum pokeys_outcome heat_tune(unsigned int heater, float target)
{
	const struct pokeys_one_shot shot = {
		.operation = POKEYS_ONE_SHOT_HEATER_TUNE,
		.index = (uint8_t)heater,
		.parameter = { target },
	};

	return world_do(&world, &shot, 1 * SECOND);
}

/* Silent for so long: nothing is asked of the physics meanwhile but to go on. */
void heat_silence(uint64_t for_ns)
{
	sim_rig_silence(&world.rig, world.now, for_ns);
	heat_run(for_ns);
}
