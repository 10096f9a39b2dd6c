/* SPDX-License-Identifier: GPL-2.0-or-later */
/* Three servo motors with the physics of a motor each, and what a test does with them. */

#include "tests/device/servo_rig.h"
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "wire/encoder.h"
#include "wire/io.h"

const uint8_t servo_encoder[MOTORS] = { 4, 5, 6 };
const uint8_t servo_enable_pin[MOTORS] = { 34, 35, SERVOING_NONE };

struct world world;

/* For a screw of 5 mm on the simulator's motor. */
static const struct servo_config loop = {
	.scale = 400,
	.least = -100,
	.most = 100,
	.speed_most = 300,
	.speed_jump = 900,
	.gains = { .p = 1, .i = 10, .d = 0.01, .velocity = 0.00262, .acceleration = 5.2e-5 },
	.integral_most = 0.5,
	.output_most = 1,
	.smooth = 0.001,
	.follow_least = 0.5,
	.follow_most = 2,
	.stall_output = 0.9,
	.stall_move = 0.1,
	.stall_s = 0.2,
	.silent_output = 0.2,
	.silent_s = 0.02,
	.runaway_output = 0.1,
	.runaway_move = 0.2,
	.stale_ns = 10 * MS,
};

double servo_output(unsigned int motor)
{
	return sim_servo_output(&world.rig.device, servo_encoder[motor]);
}

struct sim_motor *servo_motor(unsigned int motor)
{
	return &world.rig.device.bench.servo[servo_encoder[motor]].motor;
}

void servo_cycle(void)
{
	const struct sim_device *device = &world.rig.device;
	const uint64_t before = device->pins.latch;
	const uint32_t duty = device->config.pwm.duty[0], middle = device->config.pwm.duty[1];

	world_cycle(&world);
	sim_rig_run(&world.rig, world_device_time(&world));
	/* the device's failsafe switches everything off at once */
	if ((before ^ device->pins.latch) >> DIRECTION_PIN & 1 &&
	    device->pins.latch >> servo_enable_pin[SIGN] & 1) {
		assert_int_equal(duty, 0);
		assert_int_equal(device->config.pwm.duty[0], 0);
	}
	if ((~before & device->pins.latch) >> servo_enable_pin[ANTIPHASE] & 1)
		assert_int_equal(middle, PWM_PERIOD / 2);
}

void servo_run(uint64_t for_ns)
{
	const uint64_t end = world.tick + for_ns;

	while (world.tick < end)
		servo_cycle();
}

static void configure(unsigned int motor, enum drive_kind kind, uint8_t pwm)
{
	struct servoing_config *config = &world.config.servo[motor];
	const uint8_t encoder = servo_encoder[motor], enable = servo_enable_pin[motor];

	*config = (struct servoing_config){
		.servo = loop,
		.drive = { .kind = kind },
		.encoder = encoder,
		.pwm = pwm,
		.reverse_pwm = kind == DRIVE_TWO_PWM ? REVERSE_PWM : SERVOING_NONE,
		.direction = kind == DRIVE_SIGN ? DIRECTION_PIN : SERVOING_NONE,
		.enable = enable,
		.low = SERVOING_NONE,
		.high = SERVOING_NONE,
	};
	snprintf(config->name, sizeof(config->name), "%c", (int)('x' + motor));
	world.config.servos++;
	world_encoder(&world, encoder, WIRE_ENC_ENABLE | WIRE_ENC_4X, (uint8_t)(2 * motor),
		      (uint8_t)(2 * motor + 1));
	if (enable != SERVOING_NONE)
		world_pin(&world, enable, WIRE_PIN_OUTPUT);
	sim_servo_fit(&world.rig.device, encoder,
		      &(struct sim_servo){
			      .kind = (enum sim_servo_kind)kind,
			      .pwm = pwm,
			      .other = (uint8_t)(kind == DRIVE_TWO_PWM ? REVERSE_PWM :
									 DIRECTION_PIN),
			      .enable = enable == SERVOING_NONE ? SIM_SERVO_NONE : enable,
		      },
		      &sim_motor_small);
}

int servo_prepare(void **state)
{
	(void)state;
	world_init(&world, NULL);
	configure(SIGN, DRIVE_SIGN, 0);
	configure(ANTIPHASE, DRIVE_ANTIPHASE, 1);
	configure(TWO_PWM, DRIVE_TWO_PWM, 2);
	world.config.servo[SIGN].low = LOW_PIN;
	world.config.servo[SIGN].high = HIGH_PIN;
	world.config.servo[SIGN].low_inverted = world.config.servo[SIGN].high_inverted = true;
	world_pin(&world, DIRECTION_PIN, WIRE_PIN_OUTPUT);
	world_pin(&world, LAMP, WIRE_PIN_OUTPUT);
	world_pin(&world, LOW_PIN, WIRE_PIN_INPUT);
	world_pin(&world, HIGH_PIN, WIRE_PIN_INPUT);
	world.config.settings.set |= POKEYS_SET_PWM_PERIOD;
	world.config.settings.pwm_period = PWM_PERIOD;
	return 0;
}

void servo_start(void)
{
	world_start(&world);
	world_commander(&world, 5);
	for (unsigned int i = 0; i < MOTORS; i++)
		world.command.servo[i].velocity = NAN;
	/* left alone first: nobody knows what a daemon before has left running */
	world_until(&world, world_is_running, 2 * SECOND);
	servo_run(100 * MS);
}

int servo_begin(void **state)
{
	servo_prepare(state);
	servo_start();
	return 0;
}

const struct pokeys_servo *servo_shown(unsigned int motor)
{
	return &world.state.servo[motor];
}

void servo_enable(unsigned int motor)
{
	world.command.servo[motor].enable = 0;
	servo_run(10 * MS);
	world.command.servo[motor].position = servo_shown(motor)->position;
	world.command.servo[motor].enable = 1;
	servo_run(10 * MS);
	assert_int_equal(servo_shown(motor)->state, POKEYS_SERVO_ENABLED);
}

void servo_enable_all(void)
{
	for (unsigned int i = 0; i < MOTORS; i++)
		servo_enable(i);
}

void servo_push_all(void)
{
	for (unsigned int i = 0; i < MOTORS; i++)
		servo_motor(i)->torque = 0.1;
	servo_run(200 * MS);
	for (unsigned int i = 0; i < MOTORS; i++) {
		assert_true(fabs(servo_output(i)) > 0.02);
		servo_motor(i)->torque = 0;
	}
}

/* As fast as is wanted with 2 m/s^2. */
void servo_move(double to, double speed)
{
	const double step = 0.001, most = 2000;
	double now = 0, left = fabs(to - world.command.servo[0].position);
	const double direction = to < world.command.servo[0].position ? -1 : 1;

	while (left > 0) {
		const double stop = sqrt(2 * most * left) - most * step;

		now = fmin(fmin(now + most * step, speed), fmax(stop, most * step));
		left -= now * step;
		if (left <= 0)
			now = left = 0;
		for (unsigned int i = 0; i < MOTORS; i++)
			world.command.servo[i].position = to - direction * left;
		servo_cycle();
	}
}

void servo_expect_off(uint64_t within_ns)
{
	const uint64_t end = world.tick + within_ns;
	double most;

	do {
		most = 0;
		for (unsigned int i = 0; i < MOTORS; i++)
			most = fmax(most, fabs(servo_output(i)));
		if (most > 0)
			servo_cycle();
	} while (most > 0 && world.tick <= end);
	for (unsigned int k = 0; k < 500; k++) {
		for (unsigned int i = 0; i < MOTORS; i++)
			assert_true(fabs(servo_output(i)) <= 0);
		servo_cycle();
	}
}

void servo_expect_fault(unsigned int motor, enum pokeys_servo_fault fault, uint64_t within_ns)
{
	const uint64_t end = world.tick + within_ns;

	while (world.tick <= end && !servo_shown(motor)->fault)
		servo_cycle();
	assert_true(servo_shown(motor)->state == POKEYS_SERVO_FAULT ||
		    servo_shown(motor)->state == POKEYS_SERVO_STOPPING);
	assert_int_equal(servo_shown(motor)->fault, fault);
	assert_true(servo_shown(motor)->output == 0);
	servo_cycle();
	assert_true(fabs(servo_output(motor)) <= 0);
}

enum pokeys_outcome servo_do(enum pokeys_one_shot_operation operation, unsigned int index,
			     int32_t value, uint8_t flags)
{
	const struct pokeys_one_shot shot = {
		.operation = (uint8_t)operation,
		.index = (uint8_t)index,
		.flags = flags,
		.value = { value },
	};

	return world_do(&world, &shot, 1 * SECOND);
}
