/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What a device was left with: nothing is called off that may heat, and silence, in which no off is
 * sent, is for what the device's own failsafe switches off soon.
 */

#include <string.h>
#include "sim/prng.h"
#include "tests/device/heat_rig.h"
#include "wire/io.h"
#include "wire/system.h"

/* Nothing is shown as off that heats, whoever cannot switch it off. */
static void while_nobody_hears_it_it_is_not_called_off(void **state)
{
	unsigned int heated = 0;

	(void)state;
	heat_begin(NULL);
	heat_up();
	sim_rig_silence(&world.rig, world.now, 5 * SECOND);
	for (unsigned int k = 0; k < 5000; k++) {
		heat_cycle();
		for (unsigned int i = 0; i < HEATERS; i++) {
			const uint8_t shown = heat_shown(i)->state;

			if (heat_power(i) <= 0)
				continue;
			heated += shown == POKEYS_HEATER_STOPPING;
			assert_true(shown == POKEYS_HEATER_HEATING ||
				    shown == POKEYS_HEATER_STOPPING);
		}
	}
	assert_true(heated > 500);
	heat_expect_fault(HOTEND, POKEYS_HEATER_DEVICE);
	assert_int_equal(heat_shown(HOTEND)->state, POKEYS_HEATER_FAULT);
}

/* The device's failsafe leaves PWM as it is. */
static void prepare_without_failsafe(void)
{
	heat_prepare(NULL);
	world.config.settings.failsafe_peripherals = WIRE_FAILSAFE_DIGITAL;
	world.config.heater[HOTEND].without_failsafe = true;
}

/* Nor that which the failsafe does not switch off. */
static void one_without_failsafe_is_off_when_it_says_so(void **state)
{
	(void)state;
	prepare_without_failsafe();
	heat_start();
	heat_up();
	heat_silence(3 * SECOND);
	assert_true(heat_power(HOTEND) > 0 && heat_power(BED) <= 0);
	assert_int_equal(heat_shown(HOTEND)->state, POKEYS_HEATER_STOPPING);
	assert_int_equal(heat_shown(BED)->state, POKEYS_HEATER_FAULT);
	world_until(&world, world_is_running, 5 * SECOND);
	heat_expect_off(20 * MS);
	assert_int_equal(heat_shown(HOTEND)->state, POKEYS_HEATER_FAULT);
}

/* Written ones: what the device has is read. */
static void swallow_duties(struct world *w, const uint8_t *packet)
{
	w->swallow = packet[1] == 0xCB && packet[2];
}

static void expect_stopping(uint64_t for_ns)
{
	while (for_ns) {
		heat_run(100 * MS);
		for_ns -= 100 * MS;
		assert_true(heat_power(HOTEND) > 0);
		assert_int_equal(heat_shown(HOTEND)->state, POKEYS_HEATER_STOPPING);
		assert_int_equal(world.state.link, POKEYS_LINK_RUNNING);
	}
}

/* Silence would not help: it is said once, and off goes on being sent. */
static void one_that_the_failsafe_leaves_on_is_not_left_alone(void **state)
{
	(void)state;
	prepare_without_failsafe();
	heat_start();
	heat_up();
	world.watch = swallow_duties;
	heat_command(HOTEND, 0);
	expect_stopping(3 * SECOND);
	assert_int_equal(world.event_count[EVENT_HEATER_UNHEARD], 1);
	assert_int_equal(world.last_event[EVENT_HEATER_UNHEARD].a, 0);
	world.watch = NULL;
	heat_run(20 * MS);
	assert_true(heat_power(HOTEND) <= 0);
	assert_int_equal(heat_shown(HOTEND)->state, POKEYS_HEATER_OFF);
}

/* A commander's failsafe: it leaves PWM on. */
static void wish_failsafe(uint8_t timeout)
{
	struct pokeys_wish wish = {
		.session = 5, .generation = 9, .settings = {
			.set = POKEYS_SET_FAILSAFE, .failsafe_timeout = timeout,
			.failsafe_peripherals = WIRE_FAILSAFE_DIGITAL,
		},
	};

	device_wish(world.device, &wish);
}

/* What pokeysd.conf says of a failsafe is not what the device has. */
static void what_another_failsafe_leaves_on_is_not_called_off(void **state)
{
	(void)state;
	heat_begin(NULL);
	heat_up();
	wish_failsafe(250);
	while (heat_power(HOTEND) <= 0)
		heat_cycle();
	world.watch = swallow_duties;
	heat_run(200 * MS);
	expect_stopping(3 * SECOND);
	assert_int_equal(heat_shown(HOTEND)->fault, POKEYS_HEATER_DEVICE);
	/* nor after a loss, in which silence would not help either */
	heat_silence(1 * SECOND);
	assert_true(heat_power(HOTEND) > 0);
	assert_int_equal(heat_shown(HOTEND)->state, POKEYS_HEATER_STOPPING);
	world.watch = NULL;
	world_until(&world, world_is_running, 1 * SECOND);
	heat_expect_off(20 * MS);
	assert_int_equal(heat_shown(HOTEND)->state, POKEYS_HEATER_FAULT);
}

/* Somebody has switched off its PWM altogether, while nobody heard it. */
static void a_device_without_pwm_heats_nothing(void **state)
{
	(void)state;
	prepare_without_failsafe();
	world.config.settings.set &= ~(uint32_t)POKEYS_SET_PWM_PERIOD;
	world.rig.device.config.pwm.period = PERIOD;
	heat_start();
	heat_up();
	heat_silence(3 * SECOND);
	memset(&world.rig.device.config.pwm, 0, sizeof(world.rig.device.config.pwm));
	assert_int_equal(heat_shown(HOTEND)->state, POKEYS_HEATER_STOPPING);
	world_until(&world, world_is_running, 5 * SECOND);
	heat_expect_off(0);
	assert_int_equal(heat_shown(HOTEND)->state, POKEYS_HEATER_FAULT);
	/* it was said while nobody knew */
	assert_int_equal(world.event_count[EVENT_HEATER_UNHEARD], 1);
	assert_int_equal(world.last_event[EVENT_HEATER_UNHEARD].a, 0);
}

static bool swallow_now;

static void swallow_after_failsafe(struct world *w, const uint8_t *packet)
{
	w->swallow = swallow_now;
	swallow_now = swallow_now || (packet[1] == 0x81 && packet[2]);
}

static bool lose_after_failsafe(struct world *w, const uint8_t *packet)
{
	(void)w;
	(void)packet;
	return swallow_now;
}

/* It was written, and nothing was heard after that. */
static void a_failsafe_that_was_not_read_back_is_not_relied_on(void **state)
{
	(void)state;
	heat_begin(NULL);
	heat_up();
	swallow_now = false;
	world.watch = swallow_after_failsafe;
	world.lose_reply = lose_after_failsafe;
	wish_failsafe(10);
	while (!swallow_now)
		heat_cycle();
	for (unsigned int i = 0; i < 40; i++) {
		heat_run(100 * MS);
		assert_true(heat_power(HOTEND) > 0);
		assert_true(heat_shown(HOTEND)->state == POKEYS_HEATER_HEATING ||
			    heat_shown(HOTEND)->state == POKEYS_HEATER_STOPPING);
	}
	/* whoever reads the log can do something, also if it never comes back */
	assert_int_equal(world.event_count[EVENT_HEATER_UNHEARD], 1);
	assert_int_equal(world.last_event[EVENT_HEATER_UNHEARD].a, 0);
	world.watch = NULL;
	world.lose_reply = NULL;
	world_until(&world, world_is_running, 5 * SECOND);
	heat_expect_off(20 * MS);
}

static bool swallow_duty_now;

static void swallow_failsafe(struct world *w, const uint8_t *packet)
{
	w->swallow = packet[1] == 0x81 || (swallow_duty_now && packet[1] == 0xCB && packet[2]);
}

/* It has begun again without the one that it had, and says nothing of it. */
static void a_failsafe_of_before_a_restart_is_not_relied_on(void **state)
{
	(void)state;
	heat_prepare(NULL);
	world.config.heater[HOTEND].without_failsafe = true;
	heat_start();
	swallow_duty_now = false;
	world.watch = swallow_failsafe;
	sim_device_reboot(&world.rig.device, world_device_time(&world), true);
	heat_run(1 * SECOND);
	world_until(&world, world_is_running, 10 * SECOND);
	heat_command(HOTEND, 0);
	heat_run(300 * MS);
	heat_command(HOTEND, 150);
	heat_run(2 * SECOND);
	assert_true(heat_power(HOTEND) > 0);
	swallow_duty_now = true;
	heat_command(HOTEND, 0);
	expect_stopping(3 * SECOND);
	assert_int_equal(world.event_count[EVENT_HEATER_UNHEARD], 1);
	assert_int_equal(world.last_event[EVENT_HEATER_UNHEARD].a, 0);
	assert_int_equal(world.last_event[EVENT_HEATER_UNHEARD].b, HOTEND);
}

/* The pause would be much longer than it takes until off arrives. */
static void nothing_waits_for_a_failsafe_that_takes_long(void **state)
{
	(void)state;
	for (unsigned int covers = 0; covers < 2; covers++) {
		heat_prepare(NULL);
		world.config.settings.failsafe_timeout = 250;
		world.config.settings.failsafe_peripherals = WIRE_FAILSAFE_DIGITAL |
							     (covers ? WIRE_FAILSAFE_PWM : 0);
		world.config.heater[HOTEND].without_failsafe = true;
		world.config.heater[BED].without_failsafe = true;
		heat_start();
		heat_up();
		world.watch = swallow_duties;
		heat_command(HOTEND, 0);
		heat_command(BED, 0);
		expect_stopping(3 * SECOND);
		assert_int_equal(world.event_count[EVENT_HEATER_UNHEARD], 1);
		/* nor after a short loss, nor again and again */
		for (unsigned int i = 0; i < 3; i++) {
			sim_rig_silence(&world.rig, world.now, 400 * MS);
			heat_run(400 * MS);
			assert_int_equal(heat_shown(HOTEND)->state, POKEYS_HEATER_STOPPING);
			world_until(&world, world_is_running, 1 * SECOND);
		}
		world.watch = NULL;
		heat_expect_off(20 * MS);
	}
}

static struct sim_prng dice;

static bool lose_most_outputs(struct world *w, const uint8_t *packet)
{
	(void)w;
	return packet[1] == 0xCC && sim_prng_chance(&dice, 0.7);
}

static void swallow_outputs(struct world *w, const uint8_t *packet)
{
	w->swallow = packet[1] == 0xCC;
}

/* An output that is switched on again and again, and to be off in the next moment. */
static void an_older_acknowledgement_is_none(void **state)
{
	(void)state;
	sim_prng_init(&dice, 32041);
	heat_begin(NULL);
	for (unsigned int i = 0; i < 60; i++) {
		heat_command(BED, 0);
		heat_run(50 * MS);
		heat_command(BED, 60);
		world.lose_reply = lose_most_outputs;
		for (unsigned int k = 0; heat_power(BED) <= 0 && k < 2000; k++)
			heat_cycle();
		for (uint64_t k = sim_prng_below(&dice, 4); k; k--)
			heat_cycle();
		heat_command(BED, 0);
		world.watch = swallow_outputs;
		for (unsigned int k = 0; k < 6; k++) {
			heat_cycle();
			assert_true(heat_power(BED) <= 0 ||
				    heat_shown(BED)->state == POKEYS_HEATER_STOPPING);
		}
		world.watch = NULL;
		world.lose_reply = NULL;
		heat_run(300 * MS);
	}
}

/* Whatever is lost and whenever it is switched: what heats is shown as what may heat. */
static void what_heats_is_never_called_off(void **state)
{
	struct sim_prng prng;
	unsigned int heated = 0;

	(void)state;
	sim_prng_init(&prng, 32040);
	for (unsigned int round = 0; round < 12; round++) {
		const double lost = 0.1 + 0.06 * round;
		struct sim_link_faults faults = {
			.loss = lost,
			.delay = { .low_ns = round * MS / 3 },
		};

		heat_begin(NULL);
		heat_up();
		for (unsigned int i = 0; i < 6000; i++) {
			if (sim_prng_chance(&prng, 0.01))
				heat_command(HOTEND, sim_prng_chance(&prng, 0.5) ? 150 : 0);
			if (sim_prng_chance(&prng, 0.01))
				heat_command(BED, sim_prng_chance(&prng, 0.5) ? 60 : 0);
			if (i % 100 == 0) {
				faults.loss = i % 200 ? lost : 0;
				sim_link_set_faults(&world.rig.link, 0, &faults);
				faults.loss = i % 300 ? lost : 0;
				sim_link_set_faults(&world.rig.link, 1, &faults);
			}
			heat_cycle();
			for (unsigned int k = 0; k < HEATERS; k++) {
				const uint8_t shown = heat_shown(k)->state;

				heated += heat_power(k) > 0;
				assert_true(heat_power(k) <= 0 || shown == POKEYS_HEATER_HEATING ||
					    shown == POKEYS_HEATER_STOPPING);
			}
		}
	}
	assert_true(heated > 5000);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(while_nobody_hears_it_it_is_not_called_off),
		cmocka_unit_test(one_without_failsafe_is_off_when_it_says_so),
		cmocka_unit_test(one_that_the_failsafe_leaves_on_is_not_left_alone),
		cmocka_unit_test(what_another_failsafe_leaves_on_is_not_called_off),
		cmocka_unit_test(a_device_without_pwm_heats_nothing),
		cmocka_unit_test(a_failsafe_that_was_not_read_back_is_not_relied_on),
		cmocka_unit_test(nothing_waits_for_a_failsafe_that_takes_long),
		cmocka_unit_test(a_failsafe_of_before_a_restart_is_not_relied_on),
		cmocka_unit_test(an_older_acknowledgement_is_none),
		cmocka_unit_test(what_heats_is_never_called_off),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
