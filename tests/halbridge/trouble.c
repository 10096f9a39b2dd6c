/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What is wrong is one number, and is counted once each time it begins.
 */
#include "tests/halbridge/rig.h"
#include <pokeys/settings.h>
#include "halbridge/trouble.h"

static struct rig rig;
static struct values *const values = &rig.values;

static int setup(void **state)
{
	(void)state;
	rig_init(&rig);
	rig_period(&rig);
	return 0;
}

static void shows(enum trouble_code code, uint32_t count)
{
	rig_period(&rig);
	assert_int_equal(values->error_code, code);
	assert_int_equal(values->error_active, code != TROUBLE_NONE);
	assert_int_equal(values->error_count, count);
}

static void all_is_well(void **state)
{
	(void)state;
	shows(TROUBLE_NONE, 0);
}

static void each_has_its_number(void **state)
{
	(void)state;
	rig.daemon.config_state = POKEYS_CONFIG_REFUSED;
	shows(TROUBLE_CONFIGURATION, 1);
	rig.daemon.postep[2].faults = 1;
	shows(TROUBLE_DEVICE, 1);
	rig.daemon.postep[2].faults = 0;
	rig.daemon.engine.axis[1].error = 1;
	shows(TROUBLE_DEVICE, 1);
	rig.daemon.engine.state = 100;
	shows(TROUBLE_LIMIT, 1);
	rig.daemon.heater[0].state = POKEYS_HEATER_HEATING;
	rig.daemon.heater[0].stops_machine = 1;
	rig.daemon.heater[1].state = POKEYS_HEATER_FAULT;
	rig.daemon.heater[1].fault = POKEYS_HEATER_OPEN;
	shows(TROUBLE_LIMIT, 1);
	rig.daemon.heater[1].stops_machine = 1;
	shows(TROUBLE_HEATER, 1);
	rig.daemon.engine.emergency = 1;
	shows(TROUBLE_EMERGENCY, 1);
	rig.daemon.engine.emergency = 0;
	values->emergency_stop = true;
	shows(TROUBLE_EMERGENCY, 1);
	rig.daemon_dead = true;
	rig_periods(&rig, 10);
	shows(TROUBLE_COMMUNICATION, 1);
}

static void each_beginning_is_counted(void **state)
{
	(void)state;
	for (uint32_t i = 1; i <= 3; i++) {
		rig.daemon.engine.state = 100;
		rig_periods(&rig, 5);
		shows(TROUBLE_LIMIT, i);
		rig.daemon.engine.state = 0;
		shows(TROUBLE_NONE, i);
	}
}

static void an_axis_that_is_not_there_has_no_error(void **state)
{
	(void)state;
	rig.daemon.engine.axis[5].error = 1;
	rig.daemon.engine.axis[5].mode = POKEYS_AXIS_OFF;
	shows(TROUBLE_NONE, 0);
}

static void a_device_that_refuses_its_settings_is_not_lost(void **state)
{
	(void)state;
	rig.daemon.link = POKEYS_LINK_CONFIGURING;
	rig.daemon.fault = POKEYS_FAULT_CONFIG_REFUSED;
	shows(TROUBLE_CONFIGURATION, 1);
	rig.daemon.fault = POKEYS_FAULT_LOCKED;
	shows(TROUBLE_CONFIGURATION, 1);
	rig.daemon.fault = POKEYS_FAULT_REBOOTED;
	shows(TROUBLE_COMMUNICATION, 1);
}

/* Neither counts: LinuxCNC is started before the daemon, and that is in order. */
static void before_the_first_connection_nothing_is_counted(void **state)
{
	(void)state;
	rig_init(&rig);
	for (unsigned int i = 0; i < 100; i++) {
		rig.now_ns += RIG_MS;
		exchange_read(&rig.exchange, values, EXCHANGE_NOTHING, rig.now_ns);
		rig_write(&rig);
		assert_int_equal(values->error_code, TROUBLE_COMMUNICATION);
		assert_true(values->error_active);
		assert_int_equal(values->error_count, 0);
		assert_false(values->packet_error || values->packet_error_exceeded);
		assert_int_equal(values->packet_error_level, 0);
	}
	shows(TROUBLE_NONE, 0);
	rig.daemon_dead = true;
	rig_periods(&rig, 10);
	shows(TROUBLE_COMMUNICATION, 1);
	assert_true(values->packet_error_exceeded);
}

static void the_emergency_stop_goes_to_the_daemon_whatever_else(void **state)
{
	(void)state;
	values->emergency_stop = true;
	rig_period(&rig);
	assert_true(rig.exchange.command.flags & POKEYS_COMMAND_EMERGENCY);
	/* also where nobody reads */
	rig.unread = true;
	rig_periods(&rig, 10);
	assert_int_equal(rig.exchange.command.flags, POKEYS_COMMAND_EMERGENCY);
	values->emergency_stop = false;
	rig_period(&rig);
	assert_int_equal(rig.exchange.command.flags, 0);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(all_is_well, setup),
		cmocka_unit_test_setup(each_has_its_number, setup),
		cmocka_unit_test_setup(each_beginning_is_counted, setup),
		cmocka_unit_test_setup(an_axis_that_is_not_there_has_no_error, setup),
		cmocka_unit_test_setup(a_device_that_refuses_its_settings_is_not_lost, setup),
		cmocka_unit_test_setup(before_the_first_connection_nothing_is_counted, setup),
		cmocka_unit_test_setup(the_emergency_stop_goes_to_the_daemon_whatever_else, setup),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
