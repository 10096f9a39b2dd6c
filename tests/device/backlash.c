/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Backlash that the device takes up, and what follows the slots of an axis: set up like
 * everything else, and seen in the steps that the simulated device makes.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/io.h"
#include "wire/pulse.h"

enum { HALF = 12, CHANNEL = 2, LASER = 20 };

static struct world world;
static struct pokeys_report report;

static void begin_with(const struct sim_rig_options *options)
{
	struct pokeys_settings *wants;

	world_init(&world, options);
	world_axes(&world);
	wants = &world.config.settings;
	wants->set |= POKEYS_SET_BACKLASH | POKEYS_SET_BACKLASH_SPEED;
	wants->backlash_enable = 1;
	wants->backlash_speed = 20;
	wants->axis[0].set |= POKEYS_AXIS_SET_BACKLASH_WIDTH |
			      POKEYS_AXIS_SET_BACKLASH_ACCELERATION;
	wants->axis[0].backlash_half = HALF;
	wants->axis[0].backlash_acceleration = 3;
	world_commander(&world, 5);
	/* of axis 1, which nobody sets up, and a byte that no document names */
	memcpy(world.rig.device.config.engine.backlash, "\0\0\0\xA5\x07\0\x01\x5A", 8);
	world_start(&world);
}

static int begin(void **state)
{
	(void)state;
	begin_with(NULL);
	world_until(&world, world_is_running, 500 * MS);
	return 0;
}

static void it_is_written_and_what_nobody_wants_stays(void **state)
{
	const struct sim_engine_config *engine = &world.rig.device.config.engine;

	(void)state;
	assert_int_equal(engine->backlash_enable, 1);
	assert_int_equal(engine->backlash_speed, 20);
	assert_memory_equal(engine->backlash, "\x0C\0\x03\xA5\x07\0\x01\x5A", 8);
	assert_int_equal(world.sent.pulse[0x41], 1);
	assert_int_equal(world.rig.device.stats.saves, 0);
	assert_int_equal(world.last_event[EVENT_CONFIG_REFUSED].code, 0);
	device_report(world.device, &report);
	assert_int_equal(report.device.axis[0].backlash_half, HALF);
	assert_int_equal(report.device.axis[1].backlash_half, 7);
	assert_int_equal(report.device.backlash_enable, 1);
	/* and the next start finds it so */
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	assert_int_equal(world.sent.pulse[0x41], 1);
}

static bool has_come_back(struct world *w)
{
	return world_pulses(w, 0) == 0 && w->state.backlash[0] == -HALF;
}

static bool has_gone(struct world *w)
{
	return world_pulses(w, 0) == 1000 && w->state.backlash[0] == HALF;
}

static void play_is_taken_up_both_ways_beyond_the_position(void **state)
{
	const struct sim_mechanics *motor = &world.rig.device.bench.machine.axis[0];

	(void)state;
	world_go(&world, 0, 1000, 0);
	world_machine_on(&world);
	world_until(&world, has_gone, 2 * SECOND);
	assert_int_equal(motor->position, 1000 + HALF);
	assert_int_equal(world.state.engine.axis[0].position, 1000);
	world_go(&world, 0, 0, 0);
	world_until(&world, has_come_back, 2 * SECOND);
	assert_int_equal(motor->position, -HALF);
	assert_true(world.state.engine.axis[0].in_position);
}

static bool is_applied(struct world *w)
{
	return w->state.config_state == POKEYS_CONFIG_APPLIED;
}

static void a_wish_waits_for_the_machine_to_be_off(void **state)
{
	const struct sim_engine_config *engine = &world.rig.device.config.engine;
	struct pokeys_wish wish = { .session = 5, .generation = 1 };

	(void)state;
	world_go(&world, 0, 0, 0);
	world_machine_on(&world);
	wish.settings.axis[1].set = POKEYS_AXIS_SET_BACKLASH_WIDTH;
	wish.settings.axis[1].backlash_half = 300;
	device_wish(world.device, &wish);
	world_run(&world, 500 * MS);
	assert_int_equal(world.state.config_state, POKEYS_CONFIG_WAITING);
	assert_int_equal(engine->backlash[4], 7);
	world.command.flags &= ~(uint32_t)POKEYS_COMMAND_MACHINE_ON;
	world_until(&world, is_applied, SECOND);
	assert_memory_equal(engine->backlash, "\x0C\0\x03\xA5\x2C\x01\x01\x5A", 8);
}

static void nobody_asks_where_it_is_switched_off(void **state)
{
	uint64_t asked;

	(void)state;
	world.config.settings.backlash_enable = 0;
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	asked = world.sent.pulse[0x40];
	world_run(&world, 2 * SECOND);
	assert_int_equal(world.sent.pulse[0x40], asked);
	assert_int_equal(world.state.slow_millihertz[POKEYS_SLOW_BACKLASH], 0);
}

/* Firmware 4.1.25 has the operation not: it says so, once, and runs. */
static void old_firmware_is_told_of_in_one_line(void **state)
{
	const struct sim_rig_options old = {
		.service_ns = 100 * US,
		.device.firmware_major = 0x31,
		.device.firmware_revision = 25,
	};
	const struct event *said = &world.last_event[EVENT_CONFIG_MISSING];
	char line[256];

	(void)state;
	begin_with(&old);
	world_until(&world, world_is_running, SECOND);
	world_run(&world, SECOND);
	assert_int_equal(world.event_count[EVENT_CONFIG_MISSING], 1);
	event_format(said, "mill", line, sizeof(line));
	assert_string_equal(line, "mill: backlash is configured, but this firmware does not have "
				  "it (4.1.26 does); update the device or remove those settings");
	assert_int_equal(world.sent.pulse[0x40] + world.sent.pulse[0x41], 0);
	assert_int_equal(world.state.config_state, POKEYS_CONFIG_REFUSED);
	device_report(world.device, &report);
	assert_int_equal(report.refused, POKEYS_SETTING_BACKLASH);
}

static void begin_synced_on(const struct sim_rig_options *options)
{
	struct pokeys_settings *wants;

	world_init(&world, options);
	world_axes(&world);
	world_pin(&world, LASER, WIRE_PIN_OUTPUT);
	wants = &world.config.settings;
	wants->axis[2].options = WIRE_AXIS_ENABLED;
	wants->axis[2].max_speed = 125000;
	wants->axis[2].max_acceleration = 1e8f;
	wants->set |= POKEYS_SET_SYNC_PWM | POKEYS_SET_SYNC_OUTPUTS | POKEYS_SET_PWM_PERIOD;
	wants->pwm_period = 1000;
	wants->sync_pwm_enable = wants->sync_out_enable = 1;
	wants->sync_pwm_axis = wants->sync_out_axis = 2;
	wants->sync_pwm_channel = CHANNEL;
	wants->sync_out_pin[1] = LASER + 1;
	wants->sync_out_pin[5] = WIRE_SYNC_EXTERNAL_FIRST + 3;
	world_start(&world);
	world_commander(&world, 5);
	world_until(&world, world_is_running, 500 * MS);
}

static void begin_synced(void)
{
	begin_synced_on(NULL);
}

static bool is_synced(struct world *w)
{
	return w->state.engine.state == WIRE_ENGINE_RUNNING && w->state.engine.axis[2].in_position;
}

static void pwm_and_outputs_follow_the_slots_of_an_axis(void **state)
{
	const struct sim_device *sim = &world.rig.device;
	uint64_t writes;

	(void)state;
	begin_synced();
	assert_memory_equal(sim->config.engine.synced_pwm, "\1\2\2", 3);
	assert_memory_equal(sim->config.engine.synced_out, "\1\2", 2);
	assert_int_equal(sim->config.engine.synced_pins[5], 95);
	/* a commander who has PWM outputs of his own does not disturb the one that follows */
	world.command.pwm_enable = 1 | 1 << CHANNEL;
	world.command.pwm_duty[0] = 250;
	world.command.axis[2] = (struct pokeys_axis_command){
		.mode = POKEYS_AXIS_BUFFERED,
		.enable = 1,
	};
	world_machine_on(&world);
	world_until(&world, is_synced, 500 * MS);
	world_run(&world, 500 * MS);
	writes = world.sent.operation[0xCB];
	/* 34 pulses each millisecond: 34 %, and bits 1 and 5 */
	for (int32_t i = 1; i <= 1000; i++) {
		world.command.axis[2].position = i * 34;
		world_cycle(&world);
	}
	sim_rig_run(&world.rig, world.now);
	assert_int_equal(sim->config.pwm.duty[CHANNEL], 340);
	assert_int_equal(sim->config.pwm.duty[0], 250);
	assert_true(world_latch(&world, LASER));
	assert_int_equal(sim->engine.outputs, 1 << 3);
	/* all of them readings, five a second */
	assert_in_range(world.sent.operation[0xCB] - writes, 4, 6);
}

static void another_axis_or_none_is_written_once(void **state)
{
	const uint8_t *pwm = world.rig.device.config.engine.synced_pwm;

	(void)state;
	begin_synced();
	assert_int_equal(world.sent.pulse[0x0A], 3);
	world.config.settings.sync_pwm_enable = 0;
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	assert_int_equal(pwm[0], 0);
	assert_int_equal(world.sent.pulse[0x0A], 6);
	assert_int_equal(world.sent.pulse[0x0B], 4);
}

static bool is_applied_off(struct world *w)
{
	return w->state.config_state == POKEYS_CONFIG_APPLIED &&
	       !w->rig.device.config.engine.synced_pwm[0];
}

/* It answers a read by the read itself, so what it has acknowledged is what it has. */
static void a_device_that_does_not_tell_is_written_to_once(void **state)
{
	const struct sim_rig_options echo = {
		.service_ns = 100 * US,
		.device.choices.echo_synced = true,
	};
	struct pokeys_wish wish = { .session = 5, .generation = 1 };
	const struct sim_engine_config *engine = &world.rig.device.config.engine;

	(void)state;
	begin_synced_on(&echo);
	assert_memory_equal(engine->synced_pwm, "\1\2\2", 3);
	assert_memory_equal(engine->synced_out, "\1\2", 2);
	assert_int_equal(engine->synced_pins[1], LASER + 1);
	assert_int_equal(world.sent.pulse[0x0A], 3);
	assert_int_equal(world.sent.pulse[0x0B], 3);
	device_report(world.device, &report);
	assert_int_equal(report.device.sync_pwm_enable, 1);
	assert_int_equal(report.device.sync_pwm_channel, CHANNEL);
	/* what follows the axis is left alone */
	world.rig.device.config.pwm.duty[CHANNEL] = 340;
	world_run(&world, SECOND);
	world.command.pwm_enable = 1 | 1 << CHANNEL;
	world.command.pwm_duty[0] = 250;
	world_run(&world, SECOND);
	assert_int_equal(world.rig.device.config.pwm.duty[CHANNEL], 340);
	assert_int_equal(world.rig.device.config.pwm.duty[0], 250);
	wish.settings.set = POKEYS_SET_SYNC_PWM;
	device_wish(world.device, &wish);
	world_until(&world, is_applied_off, SECOND);
	world_run(&world, SECOND);
	assert_int_equal(world.sent.pulse[0x0A], 6);
	/* a new start knows nothing of it */
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	assert_memory_equal(engine->synced_pwm, "\1\2\2", 3);
	world.rig.device.config.engine.synced_pwm[1] = 0;
	world.rig.device.config.engine.synced_pwm[2] = 0;
	world.config.settings.sync_pwm_axis = world.config.settings.sync_pwm_channel = 0;
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	assert_memory_equal(engine->synced_pwm, "\1\0\0", 3);
}

static void senseless_ones_are_refused_and_the_old_ones_stay(void **state)
{
	struct pokeys_wish wish = { .session = 5, .generation = 1 };

	(void)state;
	begin_synced();
	wish.settings.set = POKEYS_SET_SYNC_PWM | POKEYS_SET_SYNC_OUTPUTS | POKEYS_SET_BACKLASH;
	wish.settings.sync_pwm_channel = POKEYS_PWM;
	wish.settings.sync_out_pin[0] = 60;
	wish.settings.backlash_enable = 7;
	device_wish(world.device, &wish);
	world_run(&world, 200 * MS);
	assert_int_equal(world.event_count[EVENT_WISH_REFUSED], 3);
	assert_memory_equal(world.rig.device.config.engine.synced_pwm, "\1\2\2", 3);
	assert_int_equal(world.rig.device.config.engine.synced_pins[0], 0);
	assert_int_equal(world.rig.device.config.engine.backlash_enable, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(it_is_written_and_what_nobody_wants_stays, begin),
		cmocka_unit_test_setup(play_is_taken_up_both_ways_beyond_the_position, begin),
		cmocka_unit_test_setup(a_wish_waits_for_the_machine_to_be_off, begin),
		cmocka_unit_test_setup(nobody_asks_where_it_is_switched_off, begin),
		cmocka_unit_test(old_firmware_is_told_of_in_one_line),
		cmocka_unit_test(pwm_and_outputs_follow_the_slots_of_an_axis),
		cmocka_unit_test(another_axis_or_none_is_written_once),
		cmocka_unit_test(a_device_that_does_not_tell_is_written_to_once),
		cmocka_unit_test(senseless_ones_are_refused_and_the_old_ones_stay),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
