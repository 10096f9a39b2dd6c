/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Whatever stands in the command image: nothing crashes, nothing out of range
 * reaches the wire, and what is refused is counted, flagged and said once.
 */

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/io.h"
#include "wire/bus.h"
#include "wire/pulse.h"

#define OWNED ((UINT64_C(1) << 3) | (UINT64_C(1) << 12))
#define PLANNER (INT32_C(1) << 24)

static struct world world;

/* Nothing that no sane commander could have asked for. */
static void sane(struct world *w, const uint8_t *p)
{
	struct wire_pulse_probe_start_req probe;
	struct wire_pulse_move_pv_req pv;
	struct wire_pulse_state_req run;
	struct wire_io_req io;
	struct wire_pwm_req pwm;
	const int32_t low = -PLANNER;

	(void)w;
	if (p[1] == 0xCC && p[2]) {
		wire_io_decode_req(p, &io);
		assert_int_equal(~io.ignore & WIRE_PIN_MASK & ~OWNED, 0);
		assert_int_equal(io.outputs & io.ignore, 0);
	}
	if (p[1] == 0xCB && p[2]) {
		wire_pwm_decode_req(p, &pwm);
		assert_int_equal(pwm.enabled >> WIRE_PWMS, 0);
		for (unsigned int i = 0; i < WIRE_PWMS; i++)
			assert_true(pwm.duty[i] <= pwm.period);
	}
	if (p[1] == 0xDD)
		assert_true(p[p[2] == 0x50 || p[2] == 0x60 ? 4 : 3] < WIRE_PONET_MODULES);
	/* only reads: all settings are, again, when a commander restarts the device */
	if (p[1] != 0x85 || wire_request_class(wire_op_find(p[1], p[2]), p) == WIRE_READ)
		return;
	switch (p[2]) {
	case 0x02:
		wire_pulse_state_decode_req(p, &run);
		assert_true(run.state == WIRE_ENGINE_STOPPED || run.state == WIRE_ENGINE_RUNNING);
		assert_true(run.limit_override <= 1 && !(run.enable_mask & 0xF8));
		break;
	case 0x25:
		wire_pulse_move_pv_decode_req(p, &pv);
		assert_int_equal(pv.mask & 0xF8, 0);
		for (unsigned int i = 0; i < WIRE_AXES; i++)
			assert_true(pv.position[i] >= low && pv.position[i] <= PLANNER);
		break;
	case 0x21:
		assert_int_equal(p[3] & 0xF8, 0);
		break;
	case 0x23:
		wire_pulse_probe_start_decode_req(p, &probe);
		assert_int_equal(probe.mask & 0xF8, 0);
		for (unsigned int i = 0; i < WIRE_AXES && !probe.hybrid; i++)
			assert_true(!(probe.mask >> i & 1) ||
				    (probe.limit[i] >= low && probe.limit[i] <= PLANNER));
		assert_true(probe.hybrid || (probe.speed > 0 && probe.speed <= 1));
		break;
	case 0x03:
		for (unsigned int i = 0; i < WIRE_AXES; i++)
			assert_true(!(p[3] >> i & 1) || (wire_get_i32(p + 8 + 4 * i) >= low &&
							 wire_get_i32(p + 8 + 4 * i) <= PLANNER));
		break;
	case 0x01:
	case 0x04:
	case 0x06:
	case 0x11:
	case 0x22:
	case 0x24:
		break;
	default:
		fail_msg("pulse engine sub-command 0x%02x was sent", p[2]);
	}
}

static int begin(void **state)
{
	(void)state;
	world_init(&world, NULL);
	world_axes(&world);
	world_pin(&world, 3, WIRE_PIN_OUTPUT);
	world_pin(&world, 12, WIRE_PIN_OUTPUT);
	world_start(&world);
	world_commander(&world, 5);
	world_until(&world, world_is_running, 500 * MS);
	world.watch = sane;
	return 0;
}

static void refused(enum command_fault fault, int64_t index)
{
	const uint64_t before = world.state.statistics.refused_command;

	memset(&world.last_event[EVENT_BAD_COMMAND], 0, sizeof(struct event));
	world_run(&world, 20 * MS);
	assert_true(world.state.flags & POKEYS_STATE_BAD_COMMAND);
	assert_true(world.state.statistics.refused_command >= before + 10);
	assert_int_equal(world.last_event[EVENT_BAD_COMMAND].a, fault);
	assert_int_equal(world.last_event[EVENT_BAD_COMMAND].b, index);
	/* good again, and the flag is gone */
	world_commander(&world, 5);
	world_run(&world, 3 * MS);
	assert_false(world.state.flags & POKEYS_STATE_BAD_COMMAND);
}

static void each_bad_field_is_refused_by_name(void **state)
{
	(void)state;
	world.command.flags = 0x80;
	refused(COMMAND_FAULT_FLAGS, 0x80);
	world.command.digital_out_mask[6] = 0x80;
	refused(COMMAND_FAULT_OUTPUT, 6);
	world.command.axis[2].mode = 9;
	refused(COMMAND_FAULT_AXIS_MODE, 2);
	world.command.axis[3].enable = 2;
	refused(COMMAND_FAULT_AXIS_ENABLE, 3);
	world.command.axis[0].mode = POKEYS_AXIS_POSITION;
	world.command.axis[0].position = PLANNER + 1;
	refused(COMMAND_FAULT_AXIS_POSITION, 0);
	world.command.axis[1].mode = POKEYS_AXIS_POSITION;
	world.command.axis[1].velocity = NAN;
	refused(COMMAND_FAULT_AXIS_VELOCITY, 1);
	world.command.axis[5].mode = POKEYS_AXIS_POSITION;
	world.command.axis[5].enable = 1;
	refused(COMMAND_FAULT_AXIS_SETUP, 5);
	world.command.pwm_enable = 0x40;
	refused(COMMAND_FAULT_PWM_CHANNEL, 0x40);
	world.command.pwm_period = 1000;
	world.command.pwm_duty[4] = 1001;
	refused(COMMAND_FAULT_PWM_DUTY, 4);
	world.command.poextbus_mask[10] = 1;
	refused(COMMAND_FAULT_POEXTBUS, 10);
	world_run(&world, 500 * MS); /* until all modules were looked for */
	world.command.ponet_mask = 1u << 7;
	refused(COMMAND_FAULT_PONET, 7);
	world.command.kbd48_flags = 0x08;
	refused(COMMAND_FAULT_KBD48, 0x08);
	world.command.kbd48_leds = UINT64_C(1) << 48;
	world_run(&world, 3 * MS);
	assert_true(world.state.flags & POKEYS_STATE_BAD_COMMAND);
	world_commander(&world, 5);
	world.command.session = 0;
	refused(COMMAND_FAULT_SESSION, 0);
}

static void good_fields_beside_a_bad_one_count(void **state)
{
	(void)state;
	world_output(&world, 3, true);
	world.command.axis[0].mode = 77;
	world_run(&world, 5 * MS);
	assert_true(world_latch(&world, 3));
	world.command.digital_out_mask[7] = 0xFF;
	world_output(&world, 3, false);
	world_run(&world, 5 * MS);
	assert_true(world_latch(&world, 3)); /* the last good outputs stay */
}

static void foreign_layout_is_refused_as_a_whole(void **state)
{
	(void)state;
	world_output(&world, 3, true);
	world_run(&world, 5 * MS);
	world.command.version++;
	world_output(&world, 3, false);
	world_run(&world, 50 * MS);
	assert_true(world_latch(&world, 3));
	assert_int_equal(world.event_count[EVENT_FOREIGN_IMAGE], 1);
	assert_int_equal(world.last_event[EVENT_FOREIGN_IMAGE].b, POKEYS_COMMAND_VERSION + 1);
	world_run(&world, 100 * MS);
	assert_true(world_is_safe(&world));
}

static void complaints_are_few(void **state)
{
	(void)state;
	world.command.flags = 0x80;
	world_run(&world, 25 * SECOND);
	assert_in_range(world.event_count[EVENT_BAD_COMMAND], 2, 3);
}

/* Whatever a commander does with the state, it fills no journal and hides no other event. */
static void flicker_makes_few_lines(void **state)
{
	(void)state;
	for (unsigned int i = 0; i < 10000; i++) {
		const struct pokeys_one_shot nop = { .operation = POKEYS_ONE_SHOT_NOP };

		world.command.flags ^= POKEYS_COMMAND_MACHINE_ON;
		if (world.command.one_shot_head - world.state.one_shot_ack < 60)
			world_one_shot(&world, &nop);
		world_cycle(&world);
	}
	assert_in_range(world.event_count[EVENT_MACHINE], 20, 240);
	assert_in_range(world.event_count[EVENT_ONE_SHOT], 20, 240);
}

static void scramble(struct sim_prng *prng, void *bytes, size_t count)
{
	for (size_t i = 0; i < count; i++)
		((uint8_t *)bytes)[i] = (uint8_t)sim_prng_next(prng);
}

/* Everything random but what makes the image readable. */
static void random_image(struct sim_prng *prng)
{
	const struct pokeys_command old = world.command;

	scramble(prng, &world.command, sizeof(world.command));
	world.command.magic = old.magic;
	world.command.version = old.version;
	world.command.session = old.session;
	world.command.one_shot_head = old.one_shot_head + (uint32_t)sim_prng_below(prng, 3);
	if (sim_prng_below(prng, 50) == 0)
		world.command.one_shot_head = (uint32_t)sim_prng_next(prng);
}

/* A good image of before with a few bytes of it changed. */
static void damaged_image(struct sim_prng *prng)
{
	for (unsigned int i = 0; i < 1 + sim_prng_below(prng, 5); i++)
		((uint8_t *)&world.command)[sim_prng_below(prng, sizeof(world.command))] =
			(uint8_t)sim_prng_next(prng);
}

static void good_image(struct sim_prng *prng)
{
	world_commander(&world, 1 + (uint32_t)sim_prng_below(prng, 3));
	world.command.flags = (uint32_t)sim_prng_below(prng, 4);
	world_output(&world, 3, sim_prng_below(prng, 2));
	for (unsigned int i = 0; i < 3; i++) {
		world.command.axis[i] = (struct pokeys_axis_command){
			.position = (int32_t)sim_prng_below(prng, 2000),
			.velocity = (float)sim_prng_below(prng, 30000),
			.mode = POKEYS_AXIS_POSITION,
			.enable = (uint8_t)sim_prng_below(prng, 2),
		};
	}
}

/* Valid numbers of operations with random values. */
static void random_one_shot(struct sim_prng *prng)
{
	struct pokeys_one_shot shot;

	scramble(prng, &shot, sizeof(shot));
	shot.operation = (uint8_t)sim_prng_below(prng, POKEYS_ONE_SHOT_SET_RTC + 1);
	shot.mask &= (uint8_t)sim_prng_next(prng);
	if (sim_prng_below(prng, 2))
		shot.index %= 26;
	world_one_shot(&world, &shot);
}

static void no_image_reaches_the_wire_unjudged(void **state)
{
	struct sim_prng prng;
	unsigned int on = 0;

	(void)state;
	sim_prng_init(&prng, world_seed());
	world.flags_are_noise = true;
	for (unsigned int i = 0; i < 40000; i++) {
		switch (sim_prng_below(&prng, 6)) {
		case 0:
			random_image(&prng);
			break;
		case 1:
			damaged_image(&prng);
			break;
		case 2:
		case 3:
			random_one_shot(&prng);
			break;
		default:
			/* only these release an emergency stop */
			if (sim_prng_below(&prng, 8) == 0)
				good_image(&prng);
		}
		for (uint64_t n = sim_prng_below(&prng, 4); n > 0; n--)
			world_cycle(&world);
		on += !!(world.state.flags & POKEYS_STATE_MACHINE_ON);
	}
	assert_true(world.state.statistics.refused_command > 10000);
	assert_true(on > 100);
	assert_true(world.sent.pulse[0x25] > 20);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup(each_bad_field_is_refused_by_name, begin),
		cmocka_unit_test_setup(good_fields_beside_a_bad_one_count, begin),
		cmocka_unit_test_setup(foreign_layout_is_refused_as_a_whole, begin),
		cmocka_unit_test_setup(complaints_are_few, begin),
		cmocka_unit_test_setup(flicker_makes_few_lines, begin),
		cmocka_unit_test_setup(no_image_reaches_the_wire_unjudged, begin),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
