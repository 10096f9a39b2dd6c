/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The device's own failsafe: set up before the link runs, read back, and there
 * when this daemon is killed without a last word.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/io.h"
#include "wire/system.h"

enum { RELAY = 12, HEATER = 13 };

static struct world world;

static int begin(void **state)
{
	struct pokeys_settings *wants = &world.config.settings;

	(void)state;
	world_init(&world, NULL);
	world_axes(&world);
	world_pin(&world, RELAY, WIRE_PIN_OUTPUT);
	world_pin(&world, HEATER, WIRE_PIN_OUTPUT);
	memset(world.config.safe_mask, 0xff, sizeof(world.config.safe_mask));
	wants->set |= POKEYS_SET_FAILSAFE;
	wants->failsafe_timeout = 5;
	wants->failsafe_peripherals = WIRE_FAILSAFE_DIGITAL | WIRE_FAILSAFE_PWM |
				      WIRE_FAILSAFE_POEXTBUS | WIRE_FAILSAFE_PULSE;
	wants->failsafe_outputs[HEATER / 8] = 1 << HEATER % 8;
	wants->failsafe_pwm[1] = 10;
	world_commander(&world, 5);
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	return 0;
}

static void it_is_armed_before_the_link_runs_and_read_back(void **state)
{
	const struct sim_failsafe_config *failsafe = &world.rig.device.config.failsafe;

	(void)state;
	assert_int_equal(world.state.failsafe, POKEYS_FAILSAFE_ARMED);
	assert_int_equal(failsafe->timeout, 5);
	assert_int_equal(failsafe->peripherals, 0x0F);
	assert_int_equal(failsafe->outputs[HEATER / 8], 1 << HEATER % 8);
	assert_int_equal(failsafe->pwm[1], 10);
	assert_int_equal(world.rig.device.stats.saves, 0);
}

/* kill -9: nothing leaves any more. */
static void outputs_and_axes_are_safe_when_the_daemon_is_killed(void **state)
{
	(void)state;
	world_output(&world, RELAY, true);
	world_go(&world, 0, 1000000, 0);
	world_machine_on(&world);
	world_run(&world, 100 * MS);
	assert_true(world_latch(&world, RELAY));
	world.now += 450 * MS;
	assert_true(world_latch(&world, RELAY));
	world.now += 100 * MS;
	assert_false(world_latch(&world, RELAY));
	assert_true(world_latch(&world, HEATER));
	world.now += 500 * MS;
	sim_rig_run(&world.rig, world.now);
	assert_int_equal(world.rig.device.engine.state, SIM_PE_STOPPED);
	/* and the next daemon finds it, and takes over */
	world.tick = world.now;
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	world_run(&world, 50 * MS);
	assert_true(world_latch(&world, RELAY));
	assert_int_equal(world.state.failsafe, POKEYS_FAILSAFE_ARMED);
}

static void it_never_acts_while_the_daemon_talks_however_bad_the_cable(void **state)
{
	(void)state;
	world_output(&world, RELAY, true);
	world_loss(&world, 0.33);
	world_run(&world, 10 * SECOND);
	assert_int_equal(world.rig.device.stats.failsafes, 0);
}

static void another_one_or_none_is_shown(void **state)
{
	(void)state;
	world.config.settings.set &= ~(uint32_t)POKEYS_SET_FAILSAFE;
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	assert_int_equal(world.state.failsafe, POKEYS_FAILSAFE_OTHER);
	world.rig.device.config.failsafe.timeout = 0;
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	assert_int_equal(world.state.failsafe, POKEYS_FAILSAFE_OFF);
}

static void deaf(struct world *w, const uint8_t *p)
{
	w->swallow = p[1] == 0x81;
}

static void firmware_without_it_runs_and_says_so(void **state)
{
	(void)state;
	world.watch = deaf;
	world_start(&world);
	world_until(&world, world_is_running, 3 * SECOND);
	assert_int_equal(world.state.failsafe, POKEYS_FAILSAFE_UNKNOWN);
	assert_int_equal(world.state.config_state, POKEYS_CONFIG_REFUSED);
	assert_int_equal(world.last_event[EVENT_CONFIG_REFUSED].a, WIRE_OP_FAILSAFE);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(it_is_armed_before_the_link_runs_and_read_back, begin),
		cmocka_unit_test_setup(outputs_and_axes_are_safe_when_the_daemon_is_killed, begin),
		cmocka_unit_test_setup(it_never_acts_while_the_daemon_talks_however_bad_the_cable,
				       begin),
		cmocka_unit_test_setup(another_one_or_none_is_shown, begin),
		cmocka_unit_test_setup(firmware_without_it_runs_and_says_so, begin),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
