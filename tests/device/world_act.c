/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What a test does with a world, and asks of it: wishes, commands, faults.
 */

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/encoder.h"
#include "wire/packet.h"
#include "wire/pulse.h"

bool world_is_running(struct world *world)
{
	return world->state.link == POKEYS_LINK_RUNNING &&
	       !(world->state.flags & POKEYS_STATE_STALE);
}

bool world_is_lost(struct world *world)
{
	return world->state.link == POKEYS_LINK_LOST;
}

bool world_is_safe(struct world *world)
{
	return world->state.flags & POKEYS_STATE_SAFE;
}

bool world_is_machine_on(struct world *world)
{
	bool driven = false;

	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		driven = driven || world->command.axis[i].enable;
	return world->state.flags & POKEYS_STATE_MACHINE_ON &&
	       (!driven || world->state.engine.state == WIRE_ENGINE_RUNNING);
}

bool world_is_stopped(struct world *world)
{
	return device_stopped(world->device);
}

void world_stall(struct world *world, uint64_t for_ns)
{
	world->tick += for_ns;
	world->now = world->tick;
	if (world->commanding)
		world->command.heartbeat += for_ns / world->config.period_ns;
}

void world_commander(struct world *world, uint32_t session)
{
	memset(&world->command, 0, sizeof(world->command));
	world->command.magic = POKEYS_COMMAND_MAGIC;
	world->command.version = POKEYS_COMMAND_VERSION;
	world->command.session = session;
	world->commanding = true;
}

void world_output(struct world *world, unsigned int pin, bool value)
{
	const uint8_t bit = (uint8_t)(1u << pin % 8);

	world->command.digital_out_mask[pin / 8] |= bit;
	world->command.digital_out[pin / 8] &= (uint8_t)~bit;
	if (value)
		world->command.digital_out[pin / 8] |= bit;
}

bool world_latch(struct world *world, unsigned int pin)
{
	sim_rig_run(&world->rig, world_device_time(world));
	return world->rig.device.pins.latch >> pin & 1;
}

uint32_t world_one_shot(struct world *world, const struct pokeys_one_shot *shot)
{
	const uint32_t id = world->command.one_shot_head++;
	struct pokeys_one_shot *slot = &world->command.one_shot[id % POKEYS_ONE_SHOTS];

	*slot = *shot;
	slot->id = id;
	return id;
}

int64_t world_pulses(struct world *world, unsigned int axis)
{
	sim_rig_run(&world->rig, world_device_time(world));
	return world->rig.device.engine.axis[axis].pulses;
}

uint8_t world_engine_state(struct world *world)
{
	sim_rig_run(&world->rig, world_device_time(world));
	return world->rig.device.engine.state;
}

enum pokeys_outcome world_outcome(const struct world *world, uint32_t id)
{
	const struct pokeys_one_shot_result *result =
		&world->state.one_shot[id % POKEYS_ONE_SHOT_RESULTS];

	if (world->state.one_shot_session != world->command.session || result->id != id)
		return POKEYS_OUTCOME_NONE;
	return (enum pokeys_outcome)result->outcome;
}

enum pokeys_outcome world_do(struct world *world, const struct pokeys_one_shot *shot,
			     uint64_t limit_ns)
{
	const uint32_t id = world_one_shot(world, shot);
	const uint64_t begin = world->tick;

	while (world_outcome(world, id) == POKEYS_OUTCOME_NONE && world->tick - begin < limit_ns)
		world_cycle(world);
	return world_outcome(world, id);
}

void world_refuses(struct world *world, const struct pokeys_one_shot *shot, unsigned int reason,
		   unsigned int part)
{
	const struct event *said = &world->last_event[EVENT_ONE_SHOT];

	assert_int_equal(world_do(world, shot, 200 * MS), POKEYS_OUTCOME_REFUSED);
	assert_int_equal(said->a, shot->operation);
	assert_int_equal(said->c, POKEYS_OUTCOME_REFUSED | reason << 8 | part << 16);
}

void world_axes(struct world *world)
{
	struct pokeys_settings *settings = &world->config.settings;

	settings->set |= POKEYS_SET_AXES;
	settings->axes = 3;
	for (unsigned int i = 0; i < 3; i++) {
		struct pokeys_axis_settings *axis = &settings->axis[i];

		axis->options = axis->options_mask = WIRE_AXIS_ENABLED |
						     WIRE_AXIS_INTERNAL_PLANNER |
						     WIRE_AXIS_POSITION_MODE;
		axis->set = POKEYS_AXIS_SET_MAX_SPEED | POKEYS_AXIS_SET_MAX_ACCELERATION |
			    POKEYS_AXIS_SET_MAX_DECELERATION;
		axis->max_speed = 20000;
		axis->max_acceleration = axis->max_deceleration = 500000;
	}
}

void world_pin(struct world *world, unsigned int pin, uint8_t function)
{
	world->config.settings.pin_set[pin / 8] |= (uint8_t)(1u << pin % 8);
	world->config.settings.pin_function[pin] = function;
}

void world_encoder(struct world *world, unsigned int encoder, uint8_t options, uint8_t pin_a,
		   uint8_t pin_b)
{
	world->config.settings.encoder[encoder] = (struct pokeys_encoder_settings){
		.options = options,
		.options_mask = WIRE_ENC_ENABLE | WIRE_ENC_4X | WIRE_ENC_2X,
		.pins_set = pin_a < POKEYS_PINS,
		.pin_a = pin_a,
		.pin_b = pin_b,
	};
}

void world_fast_encoders(struct world *world, bool fast, bool ultra)
{
	struct pokeys_settings *settings = &world->config.settings;

	settings->set |= POKEYS_SET_FAST_ENCODERS | POKEYS_SET_ULTRA_FAST;
	settings->fast_configuration = fast ? WIRE_FAST_ON : WIRE_FAST_OFF;
	settings->ultra_enable = ultra;
}

void world_go(struct world *world, unsigned int axis, int32_t position, float velocity)
{
	world->command.axis[axis] = (struct pokeys_axis_command){
		.position = position,
		.velocity = velocity,
		.mode = POKEYS_AXIS_POSITION,
		.enable = 1,
	};
}

void world_machine_on(struct world *world)
{
	world->command.flags &= ~(uint32_t)POKEYS_COMMAND_MACHINE_ON;
	world_run(world, 5 * MS);
	world->command.flags |= POKEYS_COMMAND_MACHINE_ON;
	world_until(world, world_is_machine_on, 1 * SECOND);
}

void world_machine_off(struct world *world)
{
	world->command.flags = 0;
}

void world_commander_dies(struct world *world)
{
	world->commanding = false;
}

void world_emergency(struct world *world)
{
	sim_bench_emergency(&world->rig.device, true);
}

void world_link_breaks(struct world *world)
{
	sim_rig_silence(&world->rig, world_device_time(world), 300 * MS);
}

void world_daemon_ends(struct world *world)
{
	device_stop(world->device, world->now);
}

void world_faults(struct world *world, const struct sim_link_faults *faults)
{
	sim_link_set_faults(&world->rig.link, SIM_LINK_REQUEST, faults);
	sim_link_set_faults(&world->rig.link, SIM_LINK_REPLY, faults);
}

void world_loss(struct world *world, double loss)
{
	const struct sim_link_faults faults = { .delay = { .low_ns = 25 * US }, .loss = loss };

	world_faults(world, &faults);
}

void world_up(struct world *world, const struct sim_rig_options *options)
{
	world_init(world, options);
	world_axes(world);
	world_start(world);
	world_commander(world, 5);
	world_until(world, world_is_running, 1 * SECOND);
}

void world_moving(struct world *world, const struct sim_rig_options *options)
{
	world_up(world, options);
	world_go(world, 0, 0, 0);
	world_machine_on(world);
}

void world_all_moving(struct world *world)
{
	world_start(world);
	world_commander(world, 5);
	world_until(world, world_is_running, 500 * MS);
	for (unsigned int i = 0; i < 3; i++)
		world_go(world, i, 0, 0);
	world_machine_on(world);
}

void world_set_elsewhere(struct world *world, uint8_t mask, int32_t position)
{
	struct wire_pulse_positions_req set = { .mask = mask };
	uint8_t request[WIRE_PK], reply[WIRE_PK];

	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		set.position[i] = position;
	wire_encode_req(WIRE_OP_PULSE_POSITIONS, request, &set);
	wire_finish(request, 1);
	sim_rig_run(&world->rig, world_device_time(world));
	assert_int_equal(sim_device_request(&world->rig.device, world_device_time(world), request,
					    sizeof(request), reply),
			 sizeof(reply));
}

void world_sleep(struct world *world, uint64_t for_ns, uint64_t told_ns)
{
	world->asleep_ns += for_ns;
	device_suspended(world->device, world->now, told_ns);
}
