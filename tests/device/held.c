/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * After a loss nothing is energised by itself: outputs stay in the safe state until the
 * edge of machine-on that permits motion as well, but for those that pokeysd.conf names.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/io.h"

enum { SPINDLE = 0, LAMP = 1, BRAKE = 12 };

static struct world world;
static struct sim_device *const sim = &world.rig.device;

static void start(const struct sim_rig_options *options)
{
	world_init(&world, options);
	sim->config.pwm.period = 2500;
	world_pin(&world, SPINDLE, 4);
	world_pin(&world, LAMP, 4);
	world_pin(&world, BRAKE, 4);
	world.config.safe_mask[BRAKE / 8] = 1u << BRAKE % 8;
	world.config.safe_outputs[BRAKE / 8] = 1u << BRAKE % 8;
}

/* All that there is, on. */
static void command_all(void)
{
	world_output(&world, SPINDLE, true);
	world_output(&world, LAMP, true);
	world.command.pwm_enable = 2;
	world.command.pwm_period = 2500;
	world.command.pwm_duty[1] = 1500;
	world.command.poextbus_mask[0] = 0xff;
	world.command.poextbus[0] = 0x21;
	world.command.relays_mask = world.command.external_outputs_mask = 0xff;
	world.command.relays = 0x40;
	world.command.external_outputs = 0x80;
}

/* A commander, the link runs, and all is commanded. */
static void begin_commanding(void)
{
	world_start(&world);
	world_commander(&world, 5);
	world_until(&world, world_is_running, 500 * MS);
	command_all();
}

static void begin_machine(void)
{
	begin_commanding();
	world_machine_on(&world);
	world_run(&world, 100 * MS);
}

static int begin(void **state)
{
	(void)state;
	start(NULL);
	begin_machine();
	assert_true(world_latch(&world, SPINDLE));
	return 0;
}

struct on {
	bool spindle, lamp, pwm, poextbus, external;
};

static void shows(struct on on)
{
	sim_rig_run(&world.rig, world.now);
	assert_int_equal(world_latch(&world, SPINDLE), on.spindle);
	assert_int_equal(world_latch(&world, LAMP), on.lamp);
	assert_int_equal(sim->config.pwm.enabled, on.pwm ? 2 : 0);
	assert_int_equal(sim->bus.poext[0], on.poextbus ? 0x21 : 0);
	assert_int_equal(sim->engine.relays, on.external ? 0x40 : 0);
	assert_int_equal(sim->engine.outputs, on.external ? 0x80 : 0);
}

static const struct on all_on = { true, true, true, true, true }, all_off = { 0 };

static void is_held(void)
{
	world_run(&world, 1 * SECOND);
	assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
	assert_true(world.state.flags & POKEYS_STATE_COMMANDER);
	assert_true(world.state.flags & POKEYS_STATE_OUTPUTS_HELD);
	assert_false(world.state.flags & POKEYS_STATE_SAFE);
	assert_true(world.last_event[EVENT_OUTPUTS_HELD].a);
	assert_true(world_latch(&world, BRAKE));
	shows(all_off);
}

/* What has to be done, and does it. */
static void edge_brings_them_back(void)
{
	world_machine_on(&world);
	world_run(&world, 100 * MS);
	assert_false(world.state.flags & POKEYS_STATE_OUTPUTS_HELD);
	assert_int_equal(world.last_event[EVENT_OUTPUTS_HELD].a, 0);
	shows(all_on);
}

static void cable(void)
{
	sim_rig_silence(&world.rig, world.now, 3 * SECOND);
	world_until(&world, world_is_lost, 1 * SECOND);
	world_until(&world, world_is_running, 5 * SECOND);
}

static void they_wait_after_a_lost_cable(void **state)
{
	(void)state;
	cable();
	is_held();
	edge_brings_them_back();
}

static void they_wait_after_a_restart_of_the_device(void **state)
{
	static const unsigned int boot_ms[] = { 15, 100, 1000 };

	for (size_t i = 0; i < sizeof(boot_ms) / sizeof(boot_ms[0]); i++) {
		begin(state);
		sim->options.boot_ms = boot_ms[i];
		sim_rig_reboot(&world.rig, world.now, false);
		for (unsigned int k = 0; k < 2000; k++) {
			world_cycle(&world);
			assert_false(world_latch(&world, SPINDLE));
		}
		is_held();
		edge_brings_them_back();
	}
}

static void they_wait_after_a_late_heartbeat(void **state)
{
	(void)state;
	world.commanding = false;
	world_until(&world, world_is_safe, 1 * SECOND);
	world.commanding = true;
	is_held();
	edge_brings_them_back();
}

/* The machine was off, and so it is held no less: it was switched off, or the power was gone. */
static void they_wait_though_the_machine_was_off(void **state)
{
	(void)state;
	world.command.flags = 0;
	world_run(&world, 100 * MS);
	shows(all_on);
	cable();
	is_held();
	edge_brings_them_back();
}

static void an_edge_that_is_refused_brings_nothing_back(void **state)
{
	(void)state;
	start(NULL);
	world_axes(&world);
	begin_machine();
	cable();
	world.command.flags = 0;
	world_run(&world, 50 * MS);
	world.unread = true;
	world.command.t_thread_ns = 0;
	world.command.flags = POKEYS_COMMAND_MACHINE_ON;
	is_held();
	world.unread = false;
	edge_brings_them_back();
}

/* One minute of suspend, of which no clock of the daemon's tells. */
static void they_wait_after_a_suspend(void **state)
{
	(void)state;
	sim_pins_write(sim, 1u << SPINDLE | 1u << LAMP, 0); /* its failsafe has acted */
	device_suspended(world.device, world.now, 60 * SECOND);
	world_cycle(&world);
	assert_int_equal(world.state.link, POKEYS_LINK_LOST);
	assert_int_equal(world.state.fault, POKEYS_FAULT_SUSPENDED);
	assert_false(world.state.flags & POKEYS_STATE_MACHINE_ON);
	is_held();
	assert_true(world.state.flags & POKEYS_STATE_NEEDS_EDGE);
	edge_brings_them_back();
}

/* A device that is not there, or not yet, is no other after it. */
static void suspend_of_a_lost_device_is_none_more(void **state)
{
	(void)state;
	sim_rig_silence(&world.rig, world.now, 1 * SECOND);
	world_until(&world, world_is_lost, 1 * SECOND);
	device_suspended(world.device, world.now, 60 * SECOND);
	world_until(&world, world_is_running, 5 * SECOND);
	is_held();
}

static void a_commander_that_begins_afterwards_is_another(void **state)
{
	(void)state;
	world.commanding = false;
	world_until(&world, world_is_safe, 1 * SECOND);
	memset(&world.command, 0, sizeof(world.command));
	world_commander(&world, 6);
	world_run(&world, 10 * MS);
	command_all();
	world_run(&world, 100 * MS);
	assert_false(world.state.flags & POKEYS_STATE_OUTPUTS_HELD);
	shows(all_on);
}

/* The daemon was killed and started again, and LinuxCNC has gone on. */
static void one_whose_machine_is_on_from_the_first_is_not(void **state)
{
	(void)state;
	world_start(&world);
	world_until(&world, world_is_running, 500 * MS);
	is_held();
	edge_brings_them_back();
}

/* ... and LinuxCNC has switched its machine off, because the daemon was gone. */
static void one_that_says_it_goes_on_is_not(void **state)
{
	(void)state;
	world_start(&world);
	memset(&world.command, 0, sizeof(world.command));
	world_commander(&world, 6);
	world.command.flags = POKEYS_COMMAND_RESUMED;
	command_all();
	world_until(&world, world_is_running, 500 * MS);
	is_held();
	edge_brings_them_back();
}

static bool is_pwm(struct world *w, const uint8_t *reply)
{
	(void)w;
	return reply[1] == 0xcb;
}

/* A commander goes on with what comes back by itself, and its answer is lost. */
static void what_came_back_by_itself_is_switched_off_as_well(void **state)
{
	(void)state;
	start(NULL);
	world.config.resume_auto = false;
	world.config.resume_parts = DEVICE_RESUME_PWM;
	world_start(&world);
	world_commander(&world, 5);
	world.command.flags = POKEYS_COMMAND_RESUMED;
	world_until(&world, world_is_running, 500 * MS);
	world.lose_reply = is_pwm;
	command_all();
	world_run(&world, 100 * MS);
	shows((struct on){ .pwm = true });
	world.commanding = false;
	world_run(&world, 3 * SECOND);
	shows(all_off);
}

static bool has_new_period(struct world *w)
{
	sim_rig_run(&w->rig, w->now);
	return sim->config.pwm.period == 5000;
}

static bool is_new_period(struct world *w, const uint8_t *reply)
{
	return is_pwm(w, reply) && has_new_period(w);
}

static unsigned int tries;

static void switches_no_pwm_on(struct world *w, const uint8_t *packet)
{
	struct wire_pwm_req pwm;

	if (!is_pwm(w, packet))
		return;
	wire_pwm_decode_req(packet, &pwm);
	tries += pwm.write;
	assert_int_equal(pwm.enabled, 0);
}

/* The setting of the period carries what is on. */
static void a_setting_that_is_sent_again_switches_nothing_on(void **state)
{
	struct pokeys_settings wanted;

	(void)state;
	start(NULL);
	begin_commanding();
	world_run(&world, 100 * MS);
	shows(all_on);
	wanted = world.config.settings;
	wanted.set |= POKEYS_SET_PWM_PERIOD;
	wanted.pwm_period = 5000;
	device_wanted(world.device, &wanted);
	world.lose_reply = is_new_period;
	world_until(&world, has_new_period, 1 * SECOND);
	assert_int_equal(sim->config.pwm.enabled, 2);
	world.command.flags = POKEYS_COMMAND_EMERGENCY;
	world_cycle(&world);
	tries = 0;
	world.watch = switches_no_pwm_on;
	world_run(&world, 1 * SECOND);
	assert_true(tries > 0);
	assert_int_equal(sim->config.pwm.enabled, 0);
}

static void one_that_is_left_as_it_is_can_be_switched_off(void **state)
{
	(void)state;
	start(NULL);
	world.config.safe_hold[0] = 1u << LAMP;
	begin_machine();
	sim_rig_silence(&world.rig, world.now, 300 * MS);
	world_until(&world, world_is_lost, 1 * SECOND);
	world_until(&world, world_is_running, 1 * SECOND);
	world_run(&world, 100 * MS);
	assert_false(world_latch(&world, SPINDLE));
	assert_true(world_latch(&world, LAMP));
	world_output(&world, LAMP, false);
	world_run(&world, 20 * MS);
	assert_false(world_latch(&world, LAMP));
	world_output(&world, LAMP, true);
	world_run(&world, 20 * MS);
	assert_false(world_latch(&world, LAMP));
}

/* LinuxCNC was switched on before the device had power. */
static void what_was_on_before_the_device_came_waits(void **state)
{
	(void)state;
	start(NULL);
	sim_rig_silence(&world.rig, world.now, 2 * SECOND);
	world_start(&world);
	world_commander(&world, 5);
	world_run(&world, 500 * MS);
	command_all();
	world.command.flags = POKEYS_COMMAND_MACHINE_ON;
	world_until(&world, world_is_running, 5 * SECOND);
	is_held();
	edge_brings_them_back();
}

static void emergency_stop(bool holds)
{
	start(NULL);
	world.config.emergency_holds = holds;
	world.config.resume_auto = false;
	world.config.resume_outputs[0] = 1u << LAMP;
	world_axes(&world);
	begin_commanding();
	world_go(&world, 0, 1000000, 0);
	world_machine_on(&world);
	world_run(&world, 300 * MS);
	shows(all_on);
	world.command.flags |= POKEYS_COMMAND_EMERGENCY;
	world_run(&world, 3 * MS);
	assert_false(world.state.flags & POKEYS_STATE_MACHINE_ON);
	assert_true(world.last_event[EVENT_EMERGENCY].a);
	assert_int_equal(world_latch(&world, SPINDLE), holds);
	world_run(&world, 300 * MS);
	assert_int_equal(world_engine_state(&world), SIM_PE_STOPPED);
}

static void the_commanders_emergency_stop_makes_all_safe(void **state)
{
	int64_t stood;

	(void)state;
	emergency_stop(false);
	stood = world_pulses(&world, 0);
	assert_true(stood < 1000000);
	shows(all_off);
	assert_true(world_latch(&world, BRAKE));
	/* released, and nothing goes on by itself, not even what comes back after a loss */
	world.command.flags &= ~(uint32_t)POKEYS_COMMAND_EMERGENCY;
	world_run(&world, 300 * MS);
	assert_false(world.last_event[EVENT_EMERGENCY].a);
	assert_true(world.state.flags & POKEYS_STATE_NEEDS_EDGE);
	shows(all_off);
	assert_int_equal(world_pulses(&world, 0), stood);
	world_go(&world, 0, (int32_t)stood, 0);
	edge_brings_them_back();
}

static void or_stops_the_axes_alone(void **state)
{
	(void)state;
	emergency_stop(true);
	shows(all_on);
	world.command.flags = 0;
	world_run(&world, 100 * MS);
	shows(all_on);
	assert_false(world.state.flags & POKEYS_STATE_OUTPUTS_HELD);
}

/* An edge that comes with it, or beside flags that do not exist. */
static void it_is_heard_whatever_stands_beside_it(void **state)
{
	(void)state;
	world.command.flags = POKEYS_COMMAND_EMERGENCY;
	world_run(&world, 50 * MS);
	shows(all_off);
	world.command.flags = POKEYS_COMMAND_EMERGENCY | POKEYS_COMMAND_MACHINE_ON;
	world_run(&world, 50 * MS);
	assert_false(world.state.flags & POKEYS_STATE_MACHINE_ON);
	world.command.flags = POKEYS_COMMAND_MACHINE_ON;
	world_run(&world, 50 * MS);
	assert_false(world.state.flags & POKEYS_STATE_MACHINE_ON);
	edge_brings_them_back();
	world.command.flags = 1u << 20 | POKEYS_COMMAND_EMERGENCY | POKEYS_COMMAND_MACHINE_ON;
	world_run(&world, 50 * MS);
	shows(all_off);
	assert_false(world.state.flags & POKEYS_STATE_MACHINE_ON);
}

static void those_that_are_named_come_back_at_once(void **state)
{
	(void)state;
	start(NULL);
	world.config.resume_auto = false;
	world.config.resume_outputs[0] = 1u << LAMP;
	world.config.resume_parts = DEVICE_RESUME_POEXTBUS;
	begin_machine();
	shows(all_on);
	cable();
	world_run(&world, 1 * SECOND);
	shows((struct on){ .lamp = true, .poextbus = true });
	/* and follow */
	world_output(&world, LAMP, false);
	world_run(&world, 20 * MS);
	shows((struct on){ .poextbus = true });
	world_output(&world, LAMP, true);
	edge_brings_them_back();
}

static void all_can_be_named(void **state)
{
	(void)state;
	start(NULL);
	world.config.resume_auto = false;
	memset(world.config.resume_outputs, 0xff, sizeof(world.config.resume_outputs));
	world.config.resume_parts = 0xff;
	begin_commanding();
	world_run(&world, 100 * MS);
	cable();
	world_run(&world, 1 * SECOND);
	shows(all_on);
}

static void start_panel(bool axes)
{
	const struct sim_rig_options options = { .device.hardware = WIRE_HW_57E };

	start(&options);
	if (axes)
		world_axes(&world);
	world_start(&world);
	world_commander(&world, 5);
	world_until(&world, world_is_running, 500 * MS);
	world_output(&world, SPINDLE, true);
	world_run(&world, 50 * MS);
	assert_true(world_latch(&world, SPINDLE));
}

/* Nobody switches it on. */
static void a_panel_goes_on(void **state)
{
	(void)state;
	start_panel(false);
	cable();
	world_run(&world, 50 * MS);
	assert_true(world_latch(&world, SPINDLE));
	assert_false(world.state.flags & POKEYS_STATE_OUTPUTS_HELD);
	assert_int_equal(world.event_count[EVENT_OUTPUTS_HELD], 0);
}

static void a_panel_that_was_switched_on_is_none(void **state)
{
	(void)state;
	start_panel(false);
	world_machine_on(&world);
	world.command.flags = 0;
	world_run(&world, 50 * MS);
	cable();
	is_held();
	world_machine_on(&world);
	world_run(&world, 50 * MS);
	assert_true(world_latch(&world, SPINDLE));
}

/* It moves nothing, so there is nothing that it has to read. */
static void a_panel_is_switched_on_by_one_that_does_not_read(void **state)
{
	(void)state;
	start_panel(false);
	world.unread = true;
	world.command.t_thread_ns = 0;
	world_machine_on(&world);
	world.command.flags = 0;
	world_run(&world, 50 * MS);
	cable();
	world_run(&world, 50 * MS);
	assert_false(world_latch(&world, SPINDLE));
	world_machine_on(&world);
	world_run(&world, 50 * MS);
	assert_true(world_latch(&world, SPINDLE));
}

static void a_panel_waits_after_its_emergency_stop(void **state)
{
	(void)state;
	start_panel(false);
	world.command.flags = POKEYS_COMMAND_EMERGENCY;
	world_run(&world, 50 * MS);
	assert_false(world_latch(&world, SPINDLE));
	world.command.flags = 0;
	is_held();
	world_machine_on(&world);
	world_run(&world, 50 * MS);
	assert_true(world_latch(&world, SPINDLE));
}

static void a_panel_with_axes_is_none(void **state)
{
	(void)state;
	start_panel(true);
	cable();
	is_held();
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(they_wait_after_a_lost_cable, begin),
		cmocka_unit_test(they_wait_after_a_restart_of_the_device),
		cmocka_unit_test_setup(they_wait_after_a_late_heartbeat, begin),
		cmocka_unit_test_setup(they_wait_though_the_machine_was_off, begin),
		cmocka_unit_test(an_edge_that_is_refused_brings_nothing_back),
		cmocka_unit_test_setup(they_wait_after_a_suspend, begin),
		cmocka_unit_test_setup(suspend_of_a_lost_device_is_none_more, begin),
		cmocka_unit_test_setup(a_commander_that_begins_afterwards_is_another, begin),
		cmocka_unit_test_setup(one_whose_machine_is_on_from_the_first_is_not, begin),
		cmocka_unit_test_setup(one_that_says_it_goes_on_is_not, begin),
		cmocka_unit_test(what_came_back_by_itself_is_switched_off_as_well),
		cmocka_unit_test(a_setting_that_is_sent_again_switches_nothing_on),
		cmocka_unit_test(one_that_is_left_as_it_is_can_be_switched_off),
		cmocka_unit_test(what_was_on_before_the_device_came_waits),
		cmocka_unit_test(the_commanders_emergency_stop_makes_all_safe),
		cmocka_unit_test(or_stops_the_axes_alone),
		cmocka_unit_test_setup(it_is_heard_whatever_stands_beside_it, begin),
		cmocka_unit_test(those_that_are_named_come_back_at_once),
		cmocka_unit_test(all_can_be_named),
		cmocka_unit_test(a_panel_goes_on),
		cmocka_unit_test(a_panel_that_was_switched_on_is_none),
		cmocka_unit_test(a_panel_is_switched_on_by_one_that_does_not_read),
		cmocka_unit_test(a_panel_waits_after_its_emergency_stop),
		cmocka_unit_test(a_panel_with_axes_is_none),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
