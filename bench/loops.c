// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What heaters and servo motors cost: the device layer's work in a cycle (device_cycle(), which
 * judges the command and encodes what is sent), of four machines that differ in their loops only.
 * Time is virtual, and the machines go on in turns, so the figures differ by the loops and not by
 * what this computer does meanwhile.
 *
 *	bench-loops CYCLES
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <cmocka.h>
#include "bench/samples.h"
#include "sim/heat.h"
#include "sim/servo.h"
#include "tests/device/world.h"
#include "wire/encoder.h"
#include "wire/io.h"

enum { HEATERS = 4, MOTORS = 6, TURN = 100, CYCLES_MAX = 10000000, PWM_PERIOD = 1250 };
enum { FIRST_HEATER_PIN = 9, FIRST_ENABLE_PIN = 30, FIRST_ENCODER = 4 };

struct machine {
	const char *name;
	unsigned int heaters, motors;
	struct world world;
	struct sim_heat heat[HEATERS];
	struct samples samples;
	unsigned int cycles;
};

static struct machine machines[] = {
	{ .name = "none" },
	{ .name = "heaters", .heaters = HEATERS },
	{ .name = "motors", .motors = MOTORS },
	{ .name = "both", .heaters = HEATERS, .motors = MOTORS },
};

static uint64_t clock_ns(void)
{
	struct timespec t;

	clock_gettime(CLOCK_MONOTONIC, &t);
	return (uint64_t)t.tv_sec * UINT64_C(1000000000) + (uint64_t)t.tv_nsec;
}

/* Inputs 0 and 1 are slower ones, so the last of seven. */
static unsigned int input_of(unsigned int heater)
{
	return 6 - heater;
}

static void add_heater(struct machine *machine, unsigned int i)
{
	struct world *world = &machine->world;
	struct heating_config *config = &world->config.heater[i];

	*config = (struct heating_config){
		.heater = heater_usual,
		.sensor = (uint8_t)input_of(i),
		.kind = HEATING_PIN,
		.output = (uint8_t)(FIRST_HEATER_PIN + i),
		.least_ns = 1 * SECOND,
		.within = 3,
	};
	snprintf(config->name, sizeof(config->name), "%u", i);
	world->config.heaters = (uint8_t)(i + 1);
	world_pin(world, WIRE_ANALOG_FIRST_PIN - 1 + input_of(i), WIRE_PIN_ANALOG_IN);
	world_pin(world, config->output, WIRE_PIN_OUTPUT);
	sim_heat_init(&machine->heat[i], &sim_heat_bed, 20055 + i);
}

/* Each with an output of its own: this board has terminals for four of the channels only. */
static void add_motor(struct machine *machine, unsigned int i)
{
	static const struct servo_config loop = {
		.scale = 400,
		.least = -INFINITY,
		.most = INFINITY,
		.speed_most = 300,
		.speed_jump = 900,
		.gains = { .p = 1,
			   .i = 10,
			   .d = 0.01,
			   .velocity = 0.00262,
			   .acceleration = 5.2e-5 },
		.integral_most = 0.5,
		.output_most = 1,
		.smooth = 0.001,
		.follow_least = 20,
		.follow_most = 20,
		.stall_output = 0.9,
		.stall_move = 0.1,
		.stall_s = 5,
		.silent_output = 0.2,
		.silent_s = 1,
		.runaway_output = 0.9,
		.runaway_move = 50,
		.stale_ns = 10 * MS,
	};
	struct world *world = &machine->world;
	struct servoing_config *config = &world->config.servo[i];
	const unsigned int encoder = FIRST_ENCODER + i;

	*config = (struct servoing_config){
		.servo = loop,
		.drive = { .kind = DRIVE_ANTIPHASE },
		.encoder = (uint8_t)encoder,
		.pwm = (uint8_t)i,
		.reverse_pwm = SERVOING_NONE,
		.direction = SERVOING_NONE,
		.enable = (uint8_t)(FIRST_ENABLE_PIN + i),
		.low = SERVOING_NONE,
		.high = SERVOING_NONE,
	};
	snprintf(config->name, sizeof(config->name), "%u", i);
	world->config.servos = (uint8_t)(i + 1);
	world_encoder(world, encoder, WIRE_ENC_ENABLE | WIRE_ENC_4X, 255, 255);
	world_pin(world, config->enable, WIRE_PIN_OUTPUT);
	sim_servo_fit(&world->rig.device, encoder,
		      &(struct sim_servo){
			      .kind = SIM_SERVO_ANTIPHASE,
			      .pwm = (uint8_t)i,
			      .enable = config->enable,
		      },
		      &sim_motor_small);
}

static void begin(struct machine *machine)
{
	/* this one has terminals for all six PWM outputs */
	const struct sim_rig_options options = {
		.service_ns = 100 * US,
		.device.hardware = WIRE_HW_57E,
	};
	struct world *world = &machine->world;

	world_init(world, &options);
	world->config.settings.set |= POKEYS_SET_PWM_PERIOD;
	world->config.settings.pwm_period = PWM_PERIOD;
	for (unsigned int i = 0; i < machine->heaters; i++)
		add_heater(machine, i);
	for (unsigned int i = 0; i < machine->motors; i++)
		add_motor(machine, i);
	world_start(world);
	world_commander(world, 5);
	for (unsigned int i = 0; i < machine->motors; i++)
		world->command.servo[i].velocity = NAN;
	world->command.heater_mask = (1u << machine->heaters) - 1;
	world_until(world, world_is_running, 2 * SECOND);
	world->clock = clock_ns;
}

/* The physics of the heaters go on, and the axes are commanded along a sine. */
static void cycle(struct machine *machine)
{
	struct world *world = &machine->world;
	const double t = machine->cycles++ / 1000.0;

	for (unsigned int i = 0; i < machine->motors; i++)
		world->command.servo[i].position = 20 * sin(2 * t + i);
	world_cycle(world);
	for (unsigned int i = 0; i < machine->heaters; i++) {
		const bool on = world_latch(world, world->config.heater[i].output);

		sim_heat_run(&machine->heat[i], 0.001, on, 0);
		world->rig.device.bench.analog[input_of(i)].low =
			sim_heat_reading(&machine->heat[i]);
	}
}

static void turn(struct machine *machine, bool measured)
{
	for (unsigned int k = 0; k < TURN; k++) {
		cycle(machine);
		if (measured)
			samples_add(&machine->samples, machine->world.work_ns);
	}
}

/* Heaters heat and motors move; otherwise what is measured is not what it is called. */
static bool is_at_work(const struct machine *machine)
{
	const struct pokeys_state *state = &machine->world.state;

	for (unsigned int i = 0; i < machine->heaters; i++)
		if (state->heater[i].state != POKEYS_HEATER_HEATING)
			return false;
	for (unsigned int i = 0; i < machine->motors; i++)
		if (state->servo[i].state != POKEYS_SERVO_ENABLED)
			return false;
	return true;
}

/* Off first, as the daemon asks for; each motor where it is. */
static void set_to_work(struct machine *machine)
{
	struct world *world = &machine->world;

	for (unsigned int k = 0; k < 5; k++)
		turn(machine, false);
	for (unsigned int i = 0; i < machine->heaters; i++)
		world->command.heater_target[i] = 60;
	for (unsigned int i = 0; i < machine->motors; i++)
		world->command.servo[i].enable = 1;
	for (unsigned int k = 0; k < 5; k++)
		turn(machine, false);
}

int main(int argc, char **argv)
{
	const long cycles = argc == 2 ? atol(argv[1]) : 0;
	const size_t count = sizeof(machines) / sizeof(machines[0]);

	if (cycles < TURN || cycles > CYCLES_MAX) {
		fprintf(stderr, "usage: bench-loops CYCLES\n(%d..%d)\n", TURN, CYCLES_MAX);
		return 2;
	}
	for (size_t i = 0; i < count; i++) {
		if (samples_init(&machines[i].samples, (size_t)cycles) < 0)
			return 1;
		begin(&machines[i]);
		set_to_work(&machines[i]);
	}
	for (long done = 0; done < cycles; done += TURN)
		for (size_t i = 0; i < count; i++)
			turn(&machines[i], true);
	printf("{\"heater_count\": %d, \"motor_count\": %d, ", HEATERS, MOTORS);
	for (size_t i = 0; i < count; i++) {
		if (!is_at_work(&machines[i])) {
			fprintf(stderr, "bench-loops: %s: not all of them are on\n",
				machines[i].name);
			return 1;
		}
		samples_print(&machines[i].samples, machines[i].name);
		printf(i + 1 < count ? ", " : "}\n");
	}
	return 0;
}
