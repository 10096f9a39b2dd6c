/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Heaters of a device, with the physics of a block and a sensor between its outputs and its analog
 * inputs: one by PWM, one by a digital output. What heats is asked of the simulated device, never
 * of the daemon's own image.
 */

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "sim/heat.h"
#include "tests/device/world.h"
#include "wire/io.h"
#include "wire/system.h"

enum { HOTEND, BED, HEATERS };
enum { LAMP = 20, BED_PIN = 12, HOTEND_PWM = 2, FAN_PWM = 1, PERIOD = 25000 };
static const unsigned int input[HEATERS] = { 2, 0 };	/* by a fast reply, and by a slow one */

/* Of a tenth of a hot end, so that a test needs seconds of virtual time. */
static const struct sim_heat_config block = {
	.watts = 40, .capacity = 3, .loss = 0.1, .room = 22, .delay_s = 0.2, .lag_s = 0.2,
	.noise = 0.1, .pull_up = 4700, .ohm = 100e3, .beta = 3950,
};

static struct world world;
static struct sim_heat heat[HEATERS];

static double power(unsigned int heater)
{
	const struct sim_pwm_config *pwm = &world.rig.device.config.pwm;

	sim_rig_run(&world.rig, world_device_time(&world));
	if (heater == BED)
		return world.rig.device.pins.latch >> BED_PIN & 1 ? 1 : 0;
	return pwm->enabled >> HOTEND_PWM & 1 && pwm->period ?
	       (double)pwm->duty[HOTEND_PWM] / pwm->period : 0;
}

static void warm(double seconds)
{
	for (unsigned int i = 0; i < HEATERS; i++) {
		struct sim_source *source = &world.rig.device.bench.analog[input[i]];

		sim_heat_run(&heat[i], seconds, power(i), 0);
		source->low = sim_heat_reading(&heat[i]);
	}
}

static void cycle(void)
{
	static struct pokeys_report report;

	device_report(world.device, &report);	/* as the loop does */
	world_cycle(&world);
	warm(0.001);
}

static void run(uint64_t for_ns)
{
	const uint64_t end = world.tick + for_ns;

	while (world.tick < end)
		cycle();
}

static void command(unsigned int heater, float target)
{
	world.command.heater_mask |= 1u << heater;
	world.command.heater_target[heater] = target;
}

static void configure(unsigned int heater, enum heating_output kind, uint8_t output)
{
	struct heating_config *config = &world.config.heater[heater];

	*config = (struct heating_config){
		.heater = heater_usual, .sensor = (uint8_t)input[heater], .kind = (uint8_t)kind,
		.output = output, .least_ns = 100 * MS, .within = 3,
	};
	strcpy(config->name, heater == HOTEND ? "hotend" : "bed");
	config->heater.gains = (struct pid_gains){ .p = 0.03, .i = 0.01, .smooth = 0.1 };
	config->heater.lease_ns = HEATER_PERIOD_NS;
	world.config.heaters++;
	world_pin(&world, WIRE_ANALOG_FIRST_PIN - 1 + input[heater], WIRE_PIN_ANALOG_IN);
}

static int prepare(void **state)
{
	(void)state;
	world_init(&world, NULL);
	configure(HOTEND, HEATING_PWM, HOTEND_PWM);
	configure(BED, HEATING_PIN, BED_PIN);
	world_pin(&world, BED_PIN, WIRE_PIN_OUTPUT);
	world_pin(&world, LAMP, WIRE_PIN_OUTPUT);
	world.config.settings.set |= POKEYS_SET_PWM_PERIOD;
	world.config.settings.pwm_period = PERIOD;
	for (unsigned int i = 0; i < HEATERS; i++)
		sim_heat_init(&heat[i], &block, 20055 + i);
	return 0;
}

static void start(void)
{
	world_start(&world);
	world_commander(&world, 5);
	warm(0.001);
	/* left alone first: nobody knows what a daemon before has left on */
	world_until(&world, world_is_running, 2 * SECOND);
	command(HOTEND, 0);
	command(BED, 0);
	run(300 * MS);
}

static int begin(void **state)
{
	prepare(state);
	start();
	return 0;
}

static const struct pokeys_heater *shown(unsigned int heater)
{
	return &world.state.heater[heater];
}

static void heat_up(void)
{
	command(HOTEND, 150);
	command(BED, 60);
	run(30 * SECOND);
	assert_int_equal(shown(HOTEND)->state, POKEYS_HEATER_HEATING);
	assert_int_equal(shown(BED)->state, POKEYS_HEATER_HEATING);
	assert_true(shown(HOTEND)->at_temperature);
}

/* No power reaches either of them any more, at most so much later. */
static void expect_off(uint64_t within_ns)
{
	const uint64_t end = world.tick + within_ns;

	while (world.tick <= end && (power(HOTEND) > 0 || power(BED) > 0))
		cycle();
	assert_true(power(HOTEND) <= 0 && power(BED) <= 0);
	for (unsigned int i = 0; i < 1000; i++) {
		cycle();
		assert_true(power(HOTEND) <= 0 && power(BED) <= 0);
	}
}

static void expect_fault(unsigned int heater, enum pokeys_heater_fault fault)
{
	assert_int_equal(shown(heater)->state, POKEYS_HEATER_FAULT);
	assert_int_equal(shown(heater)->fault, fault);
	assert_true(shown(heater)->target == 0 && shown(heater)->power == 0);
}

static enum pokeys_outcome reset(unsigned int heater)
{
	const struct pokeys_one_shot shot = {
		.operation = POKEYS_ONE_SHOT_HEATER_RESET, .index = (uint8_t)heater,
	};

	return world_do(&world, &shot, 1 * SECOND);
}

static enum pokeys_outcome tune(unsigned int heater, float target)
{
	const struct pokeys_one_shot shot = {
		.operation = POKEYS_ONE_SHOT_HEATER_TUNE, .index = (uint8_t)heater,
		.parameter = { target },
	};

	return world_do(&world, &shot, 1 * SECOND);
}

static void they_reach_their_targets_and_say_so(void **state)
{
	(void)state;
	assert_string_equal(shown(HOTEND)->name, "hotend");
	assert_int_equal(shown(HOTEND)->state, POKEYS_HEATER_OFF);
	assert_in_range(shown(BED)->temperature, 21, 23);
	heat_up();
	for (unsigned int i = 0; i < 5000; i++) {
		cycle();
		assert_true(fabs(heat[HOTEND].sensor - 150) < 3);
		assert_true(fabs(heat[BED].sensor - 60) < 8);
	}
	assert_true(fabs((double)shown(HOTEND)->power - power(HOTEND)) < 0.05);
	assert_true(fabs((double)shown(HOTEND)->temperature - heat[HOTEND].sensor) < 1);
	assert_true(world.state.t_publish_ns - shown(HOTEND)->t_ns < 150 * MS);
	assert_int_equal(shown(HOTEND)->refused, POKEYS_HEATER_TAKEN);
	assert_int_equal(shown(2)->state, POKEYS_HEATER_NONE);
	command(HOTEND, 0);
	command(BED, 0);
	world_cycle(&world);
	assert_true(power(HOTEND) <= 0 && power(BED) <= 0);
	assert_int_equal(world.event_count[EVENT_HEATER], 0);
}

static void a_target_out_of_range_is_refused_and_the_old_one_stays(void **state)
{
	(void)state;
	command(HOTEND, 100);
	run(200 * MS);
	command(HOTEND, 266);
	run(200 * MS);
	assert_true(shown(HOTEND)->target == 100);
	assert_int_equal(shown(HOTEND)->refused, POKEYS_HEATER_OUT_OF_RANGE);
	assert_int_equal(world.event_count[EVENT_HEATER_REFUSED], 1);
	command(HOTEND, NAN);
	run(200 * MS);
	assert_true(shown(HOTEND)->target == 0 && power(HOTEND) <= 0);
	assert_true(world.state.flags & POKEYS_STATE_BAD_COMMAND);
	assert_int_equal(world.last_event[EVENT_BAD_COMMAND].a, COMMAND_FAULT_HEATER_TARGET);
	command(HOTEND, 90);
	world.command.heater_mask |= 1u << HEATERS;
	run(200 * MS);
	assert_true(shown(HOTEND)->target == 90);
	assert_int_equal(world.last_event[EVENT_BAD_COMMAND].a, COMMAND_FAULT_HEATER);
	/* what is not commanded is off */
	world.command.heater_mask = 1u << BED;
	run(5 * MS);
	assert_true(power(HOTEND) <= 0 && shown(HOTEND)->target == 0);
}

static void a_broken_sensor_is_a_fault_until_it_is_reset(void **state)
{
	(void)state;
	heat_up();
	sim_heat_break(&heat[HOTEND], SIM_HEAT_OPEN);
	sim_heat_break(&heat[BED], SIM_HEAT_SHORT);
	expect_off(120 * MS + 2 * 20 * MS);	/* a period, and two readings of the slow one */
	expect_fault(HOTEND, POKEYS_HEATER_OPEN);
	expect_fault(BED, POKEYS_HEATER_SHORTED);
	assert_int_equal(world.event_count[EVENT_HEATER], 2);
	assert_int_equal(reset(HOTEND), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(reset(HEATERS), POKEYS_OUTCOME_REFUSED);
	sim_heat_break(&heat[HOTEND], SIM_HEAT_GOOD);
	expect_off(0);
	expect_fault(HOTEND, POKEYS_HEATER_OPEN);
	assert_int_equal(reset(HOTEND), POKEYS_OUTCOME_DONE);
	expect_off(0);
	assert_int_equal(shown(HOTEND)->state, POKEYS_HEATER_OFF);
	assert_int_equal(shown(HOTEND)->fault_count, 1);
	/* the target that was commanded all the time does not count */
	command(HOTEND, 151);
	run(300 * MS);
	assert_int_equal(shown(HOTEND)->refused, POKEYS_HEATER_AFTER_FAULT);
	command(HOTEND, 0);
	run(300 * MS);
	command(HOTEND, 151);
	run(300 * MS);
	assert_int_equal(shown(HOTEND)->state, POKEYS_HEATER_HEATING);
	assert_true(power(HOTEND) > 0);
}

/* Silent for so long: nothing is asked of the physics meanwhile but to go on. */
static void silence(uint64_t for_ns)
{
	sim_rig_silence(&world.rig, world.now, for_ns);
	run(for_ns);
}

static void a_lost_device_switches_them_off_itself_and_they_stay_off(void **state)
{
	(void)state;
	heat_up();
	silence(1500 * MS);	/* its failsafe waits for 1 s */
	assert_int_equal(world.state.link, POKEYS_LINK_LOST);
	run(20 * MS);
	world_until(&world, world_is_running, 3 * SECOND);
	expect_off(5 * MS);
	expect_fault(HOTEND, POKEYS_HEATER_DEVICE);
	expect_fault(BED, POKEYS_HEATER_DEVICE);
}

/* Found again before its failsafe has acted: the questions must not keep that quiet. */
static void a_short_loss_does_not_leave_them_on(void **state)
{
	const uint64_t losses_ms[] = { 250, 400, 700, 950 };

	for (unsigned int i = 0; i < 4; i++) {
		begin(state);
		heat_up();
		silence(losses_ms[i] * MS);
		expect_off(1300 * MS);
		world_until(&world, world_is_running, 3 * SECOND);
		expect_off(0);
		expect_fault(HOTEND, POKEYS_HEATER_DEVICE);
	}
}

static void a_device_that_was_restarted_keeps_them_off(void **state)
{
	(void)state;
	heat_up();
	sim_device_reboot(&world.rig.device, world_device_time(&world), false);
	run(1 * SECOND);
	world_until(&world, world_is_running, 3 * SECOND);
	expect_off(5 * MS);
	assert_int_equal(shown(HOTEND)->state, POKEYS_HEATER_FAULT);
	assert_int_equal(shown(BED)->state, POKEYS_HEATER_FAULT);
}

static void without_a_commander_they_are_off_at_once(void **state)
{
	(void)state;
	heat_up();
	world.commanding = false;
	expect_off(100 * MS + 220 * MS);	/* heartbeat-timeout-ms, and the shortest hold-s */
	assert_int_equal(shown(HOTEND)->state, POKEYS_HEATER_OFF);
	assert_int_equal(world.event_count[EVENT_HEATER_LEFT], 2);
	world_until(&world, world_is_safe, 1 * SECOND);
	world.commanding = true;
	expect_off(0);
	command(HOTEND, 0);
	run(200 * MS);
	command(HOTEND, 160);
	run(300 * MS);
	assert_true(power(HOTEND) > 0);
}

static void one_that_holds_goes_on_while_all_else_is_safe(void **state)
{
	prepare(state);
	world.config.heater[HOTEND].heater.lease_ns = UINT64_MAX;
	start();
	heat_up();
	world_output(&world, LAMP, true);
	world.command.pwm_enable = 1u << FAN_PWM;
	world.command.pwm_duty[FAN_PWM] = PERIOD;
	run(100 * MS);
	assert_true(world_latch(&world, LAMP));
	assert_int_equal(world.rig.device.config.pwm.duty[FAN_PWM], PERIOD);
	world.commanding = false;
	run(1 * SECOND);
	assert_false(world_latch(&world, LAMP));
	assert_int_equal(world.rig.device.config.pwm.duty[FAN_PWM], 0);
	for (unsigned int i = 0; i < 20000; i++) {
		cycle();
		assert_true(fabs(heat[HOTEND].sensor - 150) < 3);
		assert_false(world.state.flags & POKEYS_STATE_SAFE);	/* for it heats */
	}
	assert_true(power(BED) <= 0);
	sim_heat_break(&heat[HOTEND], SIM_HEAT_OPEN);
	expect_off(120 * MS);
	world_until(&world, world_is_safe, 100 * MS);
}

static void an_emergency_stop_switches_them_off(void **state)
{
	(void)state;
	heat_up();
	while (power(HOTEND) <= 0 || power(BED) <= 0)
		cycle();
	world.command.flags |= POKEYS_COMMAND_EMERGENCY;
	world_cycle(&world);
	assert_true(power(BED) <= 0);
	expect_off(1 * MS);	/* PWM may wait for its turn */
	world.command.flags = 0;
	expect_off(0);
	assert_int_equal(shown(HOTEND)->state, POKEYS_HEATER_OFF);
}

static void the_end_of_the_daemon_switches_them_off(void **state)
{
	(void)state;
	heat_up();
	device_stop(world.device, world.now);
	world_until(&world, world_is_stopped, 100 * MS);
	assert_true(power(HOTEND) <= 0 && power(BED) <= 0);
	assert_true(world_is_safe(&world));
}

/* By a daemon that is killed and begins again at once. */
static void a_daemon_that_begins_again_at_once_switches_them_off(void **state)
{
	(void)state;
	heat_up();
	while (power(HOTEND) <= 0 || power(BED) <= 0)
		cycle();
	world.now += 300 * MS;
	world.tick = world.now;
	world_start(&world);
	expect_off(1300 * MS);
	world_until(&world, world_is_running, 3 * SECOND);
	expect_off(0);
}

static void a_killed_daemon_leaves_them_to_the_device(void **state)
{
	(void)state;
	heat_up();
	while (power(HOTEND) <= 0 || power(BED) <= 0)
		cycle();
	world.now += 900 * MS;
	assert_true(power(HOTEND) > 0 && power(BED) > 0);
	world.now += 200 * MS;
	assert_true(power(HOTEND) <= 0 && power(BED) <= 0);
	/* and the next daemon does not go on heating, whatever is commanded still */
	world.tick = world.now;
	world_start(&world);
	world_until(&world, world_is_running, 3 * SECOND);
	expect_off(0);
}

static bool is_about_pwm(const uint8_t *packet)
{
	return packet[1] == 0xCB;
}

static void swallow_pwm(struct world *w, const uint8_t *packet)
{
	w->swallow = is_about_pwm(packet);
}

/* Everything else is answered, which keeps the device's failsafe quiet. */
static void an_off_that_never_arrives_is_left_to_the_device(void **state)
{
	(void)state;
	heat_up();
	while (power(HOTEND) <= 0)
		cycle();
	world.watch = swallow_pwm;
	command(HOTEND, 0);
	command(BED, 0);
	run(400 * MS);
	assert_true(power(HOTEND) > 0);
	expect_off(1500 * MS);
	assert_int_equal(world.event_count[EVENT_HEATER_UNHEARD], 1);
	world.watch = NULL;
	world_until(&world, world_is_running, 5 * SECOND);
	expect_off(0);
}

static void another_commander_has_to_switch_them_off_first(void **state)
{
	(void)state;
	/* the one before has commanded off, and is gone for long */
	world.commanding = false;
	run(2 * SECOND);
	world_commander(&world, 6);
	command(HOTEND, 100);
	expect_off(0);
	assert_int_equal(shown(HOTEND)->refused, POKEYS_HEATER_AFTER_FAULT);
	/* one that knows nothing of heaters has not commanded off */
	world_commander(&world, 7);
	run(1 * SECOND);
	command(HOTEND, 100);
	expect_off(0);
	command(HOTEND, 0);
	run(200 * MS);
	command(HOTEND, 100);
	run(500 * MS);
	assert_true(power(HOTEND) > 0);
	/* the next one comes at once, and commands the same */
	world_commander(&world, 8);
	command(HOTEND, 100);
	expect_off(5 * MS);
}

static void wish_of(void (*change)(struct pokeys_settings *settings))
{
	struct pokeys_wish wish = { .session = 5, .generation = 9 };

	begin(NULL);
	heat_up();
	change(&wish.settings);
	device_wish(world.device, &wish);
}

static void invert_the_output(struct pokeys_settings *settings)
{
	settings->pin_set[BED_PIN / 8] = 1u << BED_PIN % 8;
	settings->pin_function[BED_PIN] = WIRE_PIN_OUTPUT | WIRE_PIN_INVERT;
}

static void give_it_to_an_axis(struct pokeys_settings *settings)
{
	settings->set = POKEYS_SET_SYNC_OUTPUTS;
	settings->sync_out_enable = 1;
	settings->sync_out_pin[0] = BED_PIN + 1;
}

static void freeze_the_sensors(struct pokeys_settings *settings)
{
	settings->set = POKEYS_SET_ANALOG_FILTER;
	settings->analog_filter = 100000;
}

static void keep_it_on(struct pokeys_settings *settings)
{
	settings->set = POKEYS_SET_FAILSAFE;
	settings->failsafe_timeout = 10;
	settings->failsafe_peripherals = 15;
	settings->failsafe_outputs[BED_PIN / 8] = 1u << BED_PIN % 8;
}

static void a_commander_that_changes_the_device_under_them_switches_them_off(void **state)
{
	void (*const changes[])(struct pokeys_settings *settings) = {
		invert_the_output, give_it_to_an_axis, freeze_the_sensors, keep_it_on,
	};

	(void)state;
	for (size_t i = 0; i < sizeof(changes) / sizeof(changes[0]); i++) {
		wish_of(changes[i]);
		run(3 * SECOND);
		expect_fault(BED, POKEYS_HEATER_DEVICE);
	}
}

static void shorten_the_period(struct pokeys_settings *settings)
{
	settings->set = POKEYS_SET_PWM_PERIOD;
	settings->pwm_period = PERIOD / 10;
}

static void another_period_is_no_other_power(void **state)
{
	(void)state;
	wish_of(shorten_the_period);
	for (unsigned int i = 0; i < 3000; i++) {
		cycle();
		assert_true(power(HOTEND) < 0.6);
	}
	assert_int_equal(world.rig.device.config.pwm.period, PERIOD / 10);
	assert_int_equal(shown(HOTEND)->state, POKEYS_HEATER_HEATING);
	assert_true(fabs(heat[HOTEND].sensor - 150) < 3);
}

/* What the device would do with the output if nobody talked to it. */
static void try_failsafe(void (*change)(struct device_config *config), bool ready)
{
	prepare(NULL);
	change(&world.config);
	start();
	command(HOTEND, 100);
	command(BED, 60);
	run(500 * MS);
	assert_int_equal(power(HOTEND) > 0, ready);
	assert_int_equal(power(BED) > 0, ready);
	if (ready)
		return;
	assert_int_equal(shown(HOTEND)->refused, POKEYS_HEATER_NOT_READY);
	assert_int_equal(shown(HOTEND)->condition, POKEYS_HEATER_DEVICE);
}

static void change_nothing(struct device_config *config)
{
	(void)config;
}

static void switch_it_off(struct device_config *config)
{
	config->settings.failsafe_timeout = 0;
}

static void leave_outputs_out(struct device_config *config)
{
	config->settings.failsafe_peripherals = WIRE_FAILSAFE_POEXTBUS | WIRE_FAILSAFE_PULSE;
}

static void have_them_on(struct device_config *config)
{
	config->settings.failsafe_pwm[HOTEND_PWM] = 1;
	config->settings.failsafe_outputs[BED_PIN / 8] = 1u << BED_PIN % 8;
}

static void have_another_one_on(struct device_config *config)
{
	config->settings.failsafe_pwm[FAN_PWM] = 100;
	config->settings.failsafe_outputs[LAMP / 8] = 1u << LAMP % 8;
}

static void do_without(struct device_config *config)
{
	switch_it_off(config);
	config->heater[HOTEND].without_failsafe = config->heater[BED].without_failsafe = true;
}

static void no_output_is_used_that_the_device_would_leave_on(void **state)
{
	(void)state;
	try_failsafe(change_nothing, true);
	try_failsafe(switch_it_off, false);
	try_failsafe(leave_outputs_out, false);
	try_failsafe(have_them_on, false);
	try_failsafe(have_another_one_on, true);
	try_failsafe(do_without, true);
}

static void nobody_else_commands_their_outputs(void **state)
{
	(void)state;
	world_output(&world, BED_PIN, true);
	world_output(&world, LAMP, true);
	world.command.pwm_enable = 1u << HOTEND_PWM | 1u << FAN_PWM;
	world.command.pwm_duty[HOTEND_PWM] = PERIOD;
	world.command.pwm_duty[FAN_PWM] = PERIOD / 2;
	expect_off(0);
	assert_true(world_latch(&world, LAMP));
	assert_int_equal(world.rig.device.config.pwm.duty[FAN_PWM], PERIOD / 2);
	assert_int_equal(world.last_event[EVENT_BAD_COMMAND].a, COMMAND_FAULT_PWM_HEATER);
	assert_int_equal(world.last_event[EVENT_BAD_COMMAND].b, HOTEND_PWM);
	assert_int_equal(world.state.digital_out_owned[BED_PIN / 8] >> BED_PIN % 8 & 1, 0);
	assert_int_equal(world.state.digital_out_owned[LAMP / 8] >> LAMP % 8 & 1, 1);
	/* nor does the loss of machine-on hold them off */
	world.command.pwm_enable = 1u << FAN_PWM;
	command(HOTEND, 100);
	run(500 * MS);
	assert_true(power(HOTEND) > 0);
	assert_int_equal(world.rig.device.config.pwm.duty[FAN_PWM], PERIOD / 2);
}

static void channels_that_nobody_commands_stay_as_they_are(void **state)
{
	(void)state;
	prepare(state);
	world.rig.device.config.pwm.enabled = 1u << FAN_PWM;
	world.rig.device.config.pwm.period = PERIOD;
	world.rig.device.config.pwm.duty[FAN_PWM] = 777;
	world.config.resume_auto = false;
	world.config.resume_parts = DEVICE_RESUME_PWM;
	start();
	command(HOTEND, 100);
	run(2 * SECOND);
	assert_true(power(HOTEND) > 0);
	assert_int_equal(world.rig.device.config.pwm.duty[FAN_PWM], 777);
	assert_true(world.rig.device.config.pwm.enabled >> FAN_PWM & 1);
}

static void gains_are_found_on_request(void **state)
{
	(void)state;
	assert_int_equal(tune(HOTEND, 300), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(tune(HOTEND, NAN), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(tune(HEATERS, 100), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(tune(HOTEND, 100), POKEYS_OUTCOME_DONE);
	run(200 * MS);
	assert_int_equal(shown(HOTEND)->state, POKEYS_HEATER_TUNING);
	assert_int_equal(tune(HOTEND, 0), POKEYS_OUTCOME_DONE);
	run(200 * MS);
	assert_int_equal(shown(HOTEND)->tuning, POKEYS_HEATER_TUNING_FAILED);
	assert_true(power(HOTEND) <= 0);
	assert_int_equal(tune(HOTEND, 100), POKEYS_OUTCOME_DONE);
	run(100 * SECOND);
	assert_int_equal(shown(HOTEND)->tuning, POKEYS_HEATER_TUNING_DONE);
	assert_true(power(HOTEND) <= 0);
	assert_true(shown(HOTEND)->tuned_p > 0 && shown(HOTEND)->tuned_i > 0);
	assert_int_equal(world.last_event[EVENT_HEATER_TUNED].b, POKEYS_HEATER_TUNING_DONE);
}

/* What a broken sensor, a lost device or a dead commander leaves on, for how long at most? */
static void nothing_stays_on_whatever_the_network_loses(void **state)
{
	struct sim_prng prng;
	uint64_t off_ns;

	(void)state;
	sim_prng_init(&prng, world_seed());
	for (unsigned int round = 0; round < 20; round++) {
		begin(NULL);
		heat_up();
		world_loss(&world, 0.05 * (double)(round % 5));
		run(sim_prng_below(&prng, 500) * MS);
		if (round % 3 == 0)
			sim_heat_break(&heat[HOTEND], SIM_HEAT_OPEN);
		else if (round % 3 == 1)
			world.commanding = false;
		else
			world.command.flags |= POKEYS_COMMAND_EMERGENCY;
		off_ns = world.tick;
		while (power(HOTEND) > 0)
			cycle();
		/* The daemon decides in 220 ms, and retries until the write arrives. If that is
		 * not acknowledged in 500 ms, the device's failsafe has its turn. */
		assert_in_range((world.tick - off_ns) / MS, 0, 2000);
		run(100 * MS);
		for (unsigned int i = 0; i < 3000; i++) {
			cycle();
			assert_true(power(HOTEND) <= 0);
		}
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(they_reach_their_targets_and_say_so, begin),
		cmocka_unit_test_setup(a_target_out_of_range_is_refused_and_the_old_one_stays,
				       begin),
		cmocka_unit_test_setup(a_broken_sensor_is_a_fault_until_it_is_reset, begin),
		cmocka_unit_test_setup(a_lost_device_switches_them_off_itself_and_they_stay_off,
				       begin),
		cmocka_unit_test(a_short_loss_does_not_leave_them_on),
		cmocka_unit_test_setup(a_device_that_was_restarted_keeps_them_off, begin),
		cmocka_unit_test_setup(without_a_commander_they_are_off_at_once, begin),
		cmocka_unit_test(one_that_holds_goes_on_while_all_else_is_safe),
		cmocka_unit_test_setup(an_emergency_stop_switches_them_off, begin),
		cmocka_unit_test_setup(the_end_of_the_daemon_switches_them_off, begin),
		cmocka_unit_test_setup(a_killed_daemon_leaves_them_to_the_device, begin),
		cmocka_unit_test_setup(a_daemon_that_begins_again_at_once_switches_them_off, begin),
		cmocka_unit_test_setup(an_off_that_never_arrives_is_left_to_the_device, begin),
		cmocka_unit_test_setup(another_commander_has_to_switch_them_off_first, begin),
		cmocka_unit_test(a_commander_that_changes_the_device_under_them_switches_them_off),
		cmocka_unit_test(another_period_is_no_other_power),
		cmocka_unit_test(no_output_is_used_that_the_device_would_leave_on),
		cmocka_unit_test_setup(nobody_else_commands_their_outputs, begin),
		cmocka_unit_test(channels_that_nobody_commands_stay_as_they_are),
		cmocka_unit_test_setup(gains_are_found_on_request, begin),
		cmocka_unit_test(nothing_stays_on_whatever_the_network_loses),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
