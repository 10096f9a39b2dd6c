/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * PoStep motor drivers: set up by way of the device, and only believed when the driver
 * itself has it; their status; devices that do not have them.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/model.h"
#include "wire/pulse.h"

enum { ADDRESS = 33, TYPE = 1, STEP = 5, LIMIT = 70 }; /* of axis 0; the others follow */

static struct world world;

/* Neither currents nor a driver's own memory are ever written, nor anything while it moves. */
static void look(struct world *w, const uint8_t *p)
{
	if (p[1] != 0x85 || p[2] < 0x50 || p[2] > 0x53 || p[3] != WIRE_POSTEP_WRITE)
		return;
	assert_int_not_equal(p[2], 0x52);
	for (unsigned int i = 0; p[2] == 0x50 && i < POKEYS_AXES; i++)
		assert_true((p[10 + 3 * i] & 0xC0) == 0 || p[10 + 3 * i] == (0x80 | 6) ||
			    p[10 + 3 * i] == (0x80 | 7));
	sim_rig_run(&w->rig, w->now);
	assert_int_equal(w->rig.device.engine.state, SIM_PE_STOPPED);
}

static void begin_with(const struct sim_rig_options *options, bool modes)
{
	struct pokeys_settings *wants;

	world_init(&world, options);
	world_axes(&world);
	wants = &world.config.settings;
	wants->set |= POKEYS_SET_POSTEP;
	wants->postep_enable = 1;
	for (unsigned int i = 0; i < 2; i++) {
		wants->axis[i].set |= POKEYS_AXIS_SET_POSTEP_TYPE | POKEYS_AXIS_SET_POSTEP_ADDRESS;
		wants->axis[i].postep_type = TYPE;
		wants->axis[i].postep_address = (uint8_t)(ADDRESS + i);
	}
	if (modes) {
		wants->axis[0].set |= POKEYS_AXIS_SET_POSTEP_STEP |
				      POKEYS_AXIS_SET_POSTEP_TEMPERATURE;
		wants->axis[0].postep_step = STEP;
		wants->axis[0].postep_temperature = LIMIT;
	}
	world.watch = look;
	world_commander(&world, 5);
	world_start(&world);
}

static int begin(void **state)
{
	(void)state;
	begin_with(NULL, true);
	world_until(&world, world_is_running, 2 * SECOND);
	return 0;
}

static void the_driver_itself_has_what_is_wanted(void **state)
{
	const struct sim_device *sim = &world.rig.device;

	(void)state;
	assert_memory_equal(sim->config.engine.postep_comm, "\1\x21\x3f\1\x22\x3f\0\0\0", 9);
	assert_int_equal(sim->bench.postep[0].step, STEP);
	assert_int_equal(sim->bench.postep[0].limit, LIMIT);
	assert_int_equal(sim->bench.postep[0].mode, 1);
	assert_int_equal(sim->bench.postep[1].step, 4);
	assert_int_equal(sim->bench.postep[0].saved, 0);
	assert_int_equal(sim->bench.postep[0].current[0], 2000);
	assert_int_equal(sim->stats.saves, 0);
	assert_int_equal(world.state.config_state, POKEYS_CONFIG_APPLIED);
}

static void what_it_has_already_is_not_written_again(void **state)
{
	struct pokeys_report report;
	uint64_t written;

	(void)state;
	written = world.sent.pulse[0x53];
	world_start(&world);
	world_until(&world, world_is_running, 2 * SECOND);
	assert_int_equal(world.sent.pulse[0x53], written + 1);
	device_report(world.device, &report);
	assert_int_equal(report.device.axis[0].postep_step, STEP);
	assert_int_equal(report.device.axis[1].postep_step, 4);
	assert_int_equal(report.device.axis[1].postep_address, ADDRESS + 1);
}

static void what_a_driver_has_itself_counts_not_the_device_s_table(void **state)
{
	(void)state;
	/* it lost its power meanwhile, and the device does not know */
	world.rig.device.bench.postep[0].step = 0;
	world_start(&world);
	world_until(&world, world_is_running, 2 * SECOND);
	assert_int_equal(world.rig.device.bench.postep[0].step, STEP);
}

static bool has_status(struct world *w)
{
	return w->state.postep[1].faults == 0x24 && w->state.postep[1].hardware_minor == 2 &&
	       w->state.postep[1].full_scale == 2000;
}

static void status_comes_without_being_asked_for(void **state)
{
	struct sim_postep *driver = &world.rig.device.bench.postep[1];
	const struct pokeys_postep *seen = &world.state.postep[1];
	char line[256];
	uint32_t count;

	(void)state;
	driver->supply = 97;
	driver->temperature = 61;
	driver->state = 4;
	driver->faults = 0x24;
	driver->inputs = 0x41;
	world_until(&world, has_status, 5 * SECOND);
	assert_int_equal(world.event_count[EVENT_POSTEP], 1);
	event_format(&world.last_event[EVENT_POSTEP], "mill", line, sizeof(line));
	assert_string_equal(line, "mill: PoStep driver of axis 1: overcurrent B, undervoltage");
	assert_int_equal(seen->supply, 97);
	assert_int_equal(seen->temperature, 61);
	assert_int_equal(seen->state, 4);
	assert_int_equal(seen->inputs, 0x41);
	assert_int_equal(seen->firmware_minor, 14);
	assert_int_equal(seen->idle, 1000);
	assert_int_equal(seen->temperature_limit, 85);
	assert_int_equal(world.state.postep[0].step_mode, STEP);
	/* one that is silent is seen to be so */
	world_run(&world, SECOND);
	assert_true(world.state.t_postep_ns - seen->t_update_ns < 300 * MS);
	driver->powered = 0;
	world_run(&world, SECOND);
	count = seen->update_count;
	world_run(&world, 2 * SECOND);
	assert_int_equal(seen->update_count, count);
	assert_true(world.state.t_postep_ns - seen->t_update_ns > 2 * SECOND);
	assert_true(world.state.postep[0].update_count > count);
}

static bool is_refused(struct world *w)
{
	return w->state.fault == POKEYS_FAULT_CONFIG_REFUSED;
}

static void a_driver_without_power_keeps_the_link_from_running(void **state)
{
	char line[256];

	(void)state;
	begin_with(NULL, true);
	world.rig.device.bench.postep[0].powered = 0;
	world.rig.device.bench.postep[1].faults = 1;
	world_until(&world, is_refused, 10 * SECOND);
	event_format(&world.last_event[EVENT_CONFIG_REFUSED], "mill", line, sizeof(line));
	assert_string_equal(line,
			    "mill: PoStep driver of axis 0 did not take its step mode or "
			    "temperature limit; check that it has power, and its type and I2C "
			    "address");
	world_run(&world, 10 * SECOND);
	assert_int_equal(world.state.link, POKEYS_LINK_CONFIGURING);
	assert_int_equal(world.event_count[EVENT_CONFIG_REFUSED], 1);
	assert_int_equal(world.event_count[EVENT_POSTEP], 1);
	world.rig.device.bench.postep[0].powered = 1;
	world_until(&world, world_is_running, 20 * SECOND);
	assert_int_equal(world.rig.device.bench.postep[0].step, STEP);
}

static void without_modes_a_driver_may_be_switched_off(void **state)
{
	(void)state;
	begin_with(NULL, false);
	world.rig.device.bench.postep[0].powered = 0;
	world_until(&world, world_is_running, SECOND);
	world_run(&world, SECOND);
	assert_int_equal(world.state.postep[0].supply, 0);
	assert_int_equal(world.state.postep[0].update_count, 0);
	assert_int_equal(world.state.postep[1].supply, 96);
}

static bool is_applied(struct world *w)
{
	return w->state.config_state == POKEYS_CONFIG_APPLIED &&
	       w->rig.device.bench.postep[1].step == 8;
}

static void a_wish_is_passed_on_beside_the_fast_requests(void **state)
{
	struct pokeys_wish wish = { .session = 5, .generation = 1 };
	uint64_t late;

	(void)state;
	late = world.state.statistics.cycles_late;
	wish.settings.axis[1].set = POKEYS_AXIS_SET_POSTEP_STEP;
	wish.settings.axis[1].postep_step = 8;
	device_wish(world.device, &wish);
	world_until(&world, is_applied, 5 * SECOND);
	assert_int_equal(world.state.statistics.cycles_late, late);
	assert_int_equal(world.rig.device.bench.postep[1].limit, 85);
	assert_int_equal(world.rig.device.bench.postep[0].step, STEP);
	/* beyond 1/256 there is nothing */
	wish.generation++;
	wish.settings.axis[1].postep_step = 9;
	device_wish(world.device, &wish);
	world_run(&world, SECOND);
	assert_int_equal(world.event_count[EVENT_WISH_REFUSED], 1);
	assert_int_equal(world.rig.device.bench.postep[1].step, 8);
}

/* Packets are lost, and still the driver ends with what is wanted. */
static void lost_packets_do_no_harm(void **state)
{
	static const struct sim_link_faults faults = {
		.delay = { SIM_DELAY_UNIFORM, 25 * US, 500 * US, 0 },
		.loss = 0.2,
	};

	(void)state;
	for (unsigned int i = 0; i < 10; i++) {
		begin_with(NULL, true);
		world_faults(&world, &faults);
		world_until(&world, world_is_running, 60 * SECOND);
		assert_int_equal(world.rig.device.bench.postep[0].step, STEP);
		assert_int_equal(world.rig.device.bench.postep[0].limit, LIMIT);
		assert_int_equal(world.rig.device.bench.postep[0].saved, 0);
	}
}

/* What somebody has left there in the mode that writes is not sent back. */
static void a_write_that_was_left_there_is_not_repeated(void **state)
{
	(void)state;
	begin_with(NULL, false);
	memcpy(world.rig.device.config.engine.postep_comm + 6, "\1\x23\x8B", 3);
	world_until(&world, world_is_running, SECOND);
	assert_int_equal(world.rig.device.config.engine.postep_comm[8], 0x3F);
}

/* An axis of which nothing is wanted goes on being asked what it was asked, or nothing. */
static void a_driver_that_nobody_wishes_is_left_alone(void **state)
{
	const uint8_t *comm = world.rig.device.config.engine.postep_comm;

	(void)state;
	begin_with(NULL, false);
	memcpy(world.rig.device.config.engine.postep_comm + 6, "\1\x23\x20", 3);
	world_until(&world, world_is_running, SECOND);
	assert_memory_equal(comm, "\1\x21\x3f\1\x22\x3f\1\x23\x20", 9);
	/* nor is anything asked of any where it is switched off */
	begin_with(NULL, false);
	memcpy(world.rig.device.config.engine.postep_comm, "\1\x21\0\1\x22\0\1\x23\0", 9);
	world.config.settings.postep_enable = 0;
	world_start(&world);
	world_until(&world, world_is_running, SECOND);
	assert_memory_equal(comm, "\1\x21\0\1\x22\0\1\x23\0", 9);
}

static void nobody_asks_where_it_is_switched_off(void **state)
{
	(void)state;
	world_init(&world, NULL);
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	world_run(&world, 2 * SECOND);
	assert_int_equal(world.sent.pulse[0x50], 1);
	assert_int_equal(world.sent.pulse[0x53], 1);
	assert_int_equal(world.sent.pulse[0x51] + world.sent.pulse[0x52], 0);
	assert_int_equal(world.sent.pulse[0x54], 0);
}

static void expect_missing(const struct sim_rig_options *options, const char *text)
{
	char line[256];

	begin_with(options, true);
	world_until(&world, world_is_running, SECOND);
	world_run(&world, SECOND);
	for (unsigned int i = 0x50; i <= 0x54; i++)
		assert_int_equal(world.sent.pulse[i], 0);
	event_format(&world.last_event[EVENT_CONFIG_MISSING], "mill", line, sizeof(line));
	assert_string_equal(line, text);
	assert_int_equal(world.state.config_state, POKEYS_CONFIG_REFUSED);
}

static void devices_without_it_are_told_of_in_one_line(void **state)
{
	const struct sim_rig_options panel = {
		.service_ns = 100 * US,
		.device.hardware = WIRE_HW_57E,
	};
	const struct sim_rig_options old = {
		.service_ns = 100 * US,
		.device.firmware_major = 0x31,
		.device.firmware_revision = 41,
	};

	(void)state;
	expect_missing(&panel, "mill: PoStep driver is configured, but only a PoKeys57CNC has it; "
			       "remove those settings");
	expect_missing(&old, "mill: PoStep driver is configured, but this firmware does not have "
			     "it (4.1.42 does); update the device or remove those settings");
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(the_driver_itself_has_what_is_wanted, begin),
		cmocka_unit_test_setup(what_it_has_already_is_not_written_again, begin),
		cmocka_unit_test_setup(what_a_driver_has_itself_counts_not_the_device_s_table,
				       begin),
		cmocka_unit_test_setup(status_comes_without_being_asked_for, begin),
		cmocka_unit_test(a_driver_without_power_keeps_the_link_from_running),
		cmocka_unit_test(without_modes_a_driver_may_be_switched_off),
		cmocka_unit_test_setup(a_wish_is_passed_on_beside_the_fast_requests, begin),
		cmocka_unit_test(lost_packets_do_no_harm),
		cmocka_unit_test(a_write_that_was_left_there_is_not_repeated),
		cmocka_unit_test(a_driver_that_nobody_wishes_is_left_alone),
		cmocka_unit_test(nobody_asks_where_it_is_switched_off),
		cmocka_unit_test(devices_without_it_are_told_of_in_one_line),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
