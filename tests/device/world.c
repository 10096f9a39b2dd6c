/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The loop of daemon/rt in miniature, in virtual time: a tick, a cycle, then
 * packets and deadlines as they come until the next tick, publishing when the
 * fast answers are in or 60 % of the period are over.
 *
 * The invariants are checked from outside, on what is published and on what
 * leaves for the wire, by accounts of this file's own. They hold in every
 * test, whatever it is about.
 */

#include <errno.h>
#include <inttypes.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <cmocka.h>
#include "tests/device/world.h"
#include "wire/encoder.h"
#include "wire/pulse.h"

#define ADDRESS UINT32_C(0x7f000001)
#define BEGIN (1000 * SECOND)
#define PORT 20055

uint64_t world_seed(void)
{
	const char *given = getenv("POKEYS_SEED");
	struct timespec t;
	uint64_t seed;

	clock_gettime(CLOCK_MONOTONIC, &t);
	seed = given ? strtoull(given, NULL, 0) :
		       (uint64_t)t.tv_sec * 1000000007u + (uint64_t)t.tv_nsec;
	printf("POKEYS_SEED=%" PRIu64 "\n", seed);
	return seed;
}

uint64_t world_device_time(const struct world *world)
{
	const int64_t since = (int64_t)(world->now - BEGIN);

	return world->now + (uint64_t)(since * world->device_ppm / 1000000);
}

/* ... and when by ours; never too early. */
static uint64_t host_time(const struct world *world, uint64_t device_ns)
{
	const double since = (double)(int64_t)(device_ns - BEGIN);

	if (device_ns == SIM_RIG_NEVER || !world->device_ppm)
		return device_ns;
	return BEGIN + (uint64_t)(since * 1e6 / (1e6 + world->device_ppm)) + 2;
}

static void account(struct world *world, const uint8_t *packet)
{
	world->sent.all++;
	world->sent.operation[packet[1]]++;
	if (packet[1] == 0x85)
		world->sent.pulse[packet[2]]++;
	memcpy(world->last_request, packet, 64);
	if (world->watch)
		world->watch(world, packet);
}

static int send(void *context, const uint8_t *packet, size_t length)
{
	struct world *world = context;
	struct wire_multi fill;
	uint8_t data[WIRE_MULTI_DATA];

	/* a multi-part fill is eight packets in one datagram, for its last one's answer */
	if (length == WIRE_MULTI_BYTES)
		assert_true(wire_multi_parse(packet, &fill, data));
	else
		assert_int_equal(length, 64);
	assert_int_equal(wire_check_request(packet, 64), WIRE_OK);
	if (world->unplugged)
		return -ENETUNREACH;
	world->swallow = false;
	account(world, packet);
	if (world->swallow)
		return 0;
	sim_rig_send(&world->rig, world_device_time(world), packet, length);
	return 0;
}

void world_start(struct world *world)
{
	const struct pokeys_io io = { .send = send, .context = world };

	memset(world->device, 0, device_size());
	memset(&world->state, 0, sizeof(world->state));
	memset(&world->before, 0, sizeof(world->before));
	world->low_seen = world->machine_was_on = false;
	device_init(world->device, &world->config, &io, &world->events);
	device_set_address(world->device, world->config.address, PORT, world->now);
}

void world_init(struct world *world, const struct sim_rig_options *options)
{
	static const struct sim_rig_options plain = {
		.service_ns = 100 * US,
		.link.faults = {
			{ .delay = { .low_ns = 25 * US } }, { .delay = { .low_ns = 25 * US } },
		},
	};

	free(world->device);
	memset(world, 0, sizeof(*world));
	world->device = aligned_alloc(64, device_size());
	assert_non_null(world->device);
	sim_rig_init(&world->rig, options ? options : &plain);
	device_config_defaults(&world->config);
	strcpy(world->config.name, "mill");
	world->config.address = ADDRESS;
	/* as the daemon's configuration has it if nobody says otherwise */
	world->config.settings.set = POKEYS_SET_FAILSAFE;
	world->config.settings.failsafe_timeout = 10;
	world->config.settings.failsafe_peripherals = 15;
	world->now = BEGIN;
	world->tick = world->now;
	world->attached = true;
	world_start(world);
}

static void drain_events(struct world *world)
{
	struct event event;
	char line[256];

	while (event_pop(&world->events, &event)) {
		assert_in_range(event.code, 1, EVENT_CODES - 1);
		assert_true(event_format(&event, "mill", line, sizeof(line)) > 6);
		if (getenv("POKEYS_VERBOSE"))
			printf("%12.6f %s\n", (double)event.t_ns / 1e9 - 1000, line);
		world->event_count[event.code]++;
		world->last_event[event.code] = event;
	}
	assert_int_equal(atomic_load(&world->events.dropped), 0);
}

/* I2: ages and the stale flag, from the published times alone. */
static void check_ages(const struct world *world)
{
	const struct pokeys_state *s = &world->state;
	uint64_t fast = s->t_digital_ns;

	if (s->capability.pulse_engine >= 2 && s->t_motion_ns < fast)
		fast = s->t_motion_ns;
	assert_int_equal(!!(s->flags & POKEYS_STATE_STALE),
			 s->t_publish_ns - fast > s->stale_after_ns);
	assert_true(s->t_digital_ns <= s->t_publish_ns && s->t_motion_ns <= s->t_publish_ns);
	assert_true(s->t_encoder_ns <= s->t_publish_ns && s->t_slow_ns <= s->t_publish_ns);
	assert_true(s->t_digital_ns >= world->before.t_digital_ns);
	assert_true(s->t_motion_ns >= world->before.t_motion_ns);
	for (unsigned int i = 0; i < POKEYS_ENCODERS; i++)
		assert_true(s->encoder_t_ns[i] >= world->before.encoder_t_ns[i]);
}

/* I7: motion is permitted only after machine-on was seen low, then high, while all was well. */
static void check_permission(struct world *world)
{
	const struct pokeys_state *s = &world->state;
	const bool on = s->flags & POKEYS_STATE_MACHINE_ON;
	const bool well = s->link == POKEYS_LINK_RUNNING && (s->flags & POKEYS_STATE_COMMANDER) &&
			  !(s->flags & POKEYS_STATE_STOPPING);
	const bool high = world->flags_written & POKEYS_COMMAND_MACHINE_ON;

	if (on)
		assert_true(well && high && world->low_seen);
	if (!well || (world->machine_was_on && !on))
		world->low_seen = false;
	if (well && !high && world->attached)
		world->low_seen = true;
	world->machine_was_on = on;
}

static uint64_t lesser(uint64_t a, uint64_t b)
{
	return a < b ? a : b;
}

static uint64_t sent_for_motion(const struct world *world)
{
	static const uint8_t operations[] = {
		0x02, 0x03, 0x20, 0x21, 0x22, 0x23, 0x24, 0x25, 0x30, 0x31,
		0x32, 0x33, 0x34, 0xF0, 0xFE, 0xFF,
	};
	uint64_t sent = world->sent.operation[0xB0];

	for (size_t i = 0; i < sizeof(operations); i++)
		sent += world->sent.pulse[operations[i]];
	return sent;
}

/*
 * New requests of a cycle: three, and one more if one of them was for motion, two
 * if two were (references and a fill, where a device has axes of both kinds), and
 * those of all slow groups where they go together. Resends have a budget of their own.
 */
static void check_budget(struct world *world)
{
	const struct pokeys_link_statistics *now = &world->state.statistics;
	const struct pokeys_link_statistics *before = &world->before.statistics;
	const uint64_t fresh = (now->sent - now->resent) - (before->sent - before->resent);
	const uint64_t motion = sent_for_motion(world);
	const uint64_t more = lesser(motion - world->motion_sent, 2) +
			      (world->config.slow_together ? POKEYS_SLOW_GROUPS : 0);

	assert_in_range(fresh, 0, 3 + more);
	world->motion_sent = motion;
	if (fresh > world->fresh_high)
		world->fresh_high = (unsigned int)fresh;
}

static void publish(struct world *world)
{
	world->before = world->state;
	device_publish(world->device, world->now, &world->state);
	check_budget(world);
	check_ages(world);
	if (!world->flags_are_noise)
		check_permission(world);
	drain_events(world);
}

static void deliver(struct world *world)
{
	uint8_t packet[600];
	size_t length;

	while ((length = sim_rig_receive(&world->rig, world_device_time(world), packet,
					 sizeof(packet))) > 0) {
		const struct pokeys_rx rx = {
			.t_ns = world->now, .address = ADDRESS, .port = PORT,
		};

		if (world->lose_reply && world->lose_reply(world, packet))
			continue;
		device_deliver(world->device, packet, length, &rx, world->now);
		if (world->heard)
			world->heard(world, packet, length);
	}
}

/* Packets and deadlines until then. */
static void serve(struct world *world, uint64_t until_ns, bool until_complete)
{
	while (!until_complete || !device_fast_complete(world->device)) {
		const uint64_t next = lesser(host_time(world, sim_rig_next(&world->rig)),
					     device_next_deadline(world->device));

		if (next >= until_ns)
			break;
		if (next > world->now)
			world->now = next;
		deliver(world);
		/* as the loop does: not whenever something happens, only when it is due */
		if (device_next_deadline(world->device) <= world->now)
			device_check(world->device, world->now);
	}
	if (!until_complete)
		world->now = until_ns;
}

static void command(struct world *world)
{
	if (!world->commanding)
		return;
	world->command.heartbeat++;
	world->command.t_ns = world->now;
	world->flags_written = world->command.flags;
}

void world_cycle(struct world *world)
{
	const uint64_t period = world->length_ns ? world->length_ns : world->config.period_ns;
	const bool image = world->attached && world->command.magic && !world->refused;

	command(world);
	world->cycle++;
	device_cycle(world->device, world->cycle, world->tick, world->now,
		     image ? &world->command : NULL, world->refused);
	device_spare(world->device);
	serve(world, world->tick + period * 6 / 10, true);
	publish(world);
	world->tick += period;
	serve(world, world->tick, false);
}

void world_run(struct world *world, uint64_t for_ns)
{
	const uint64_t end = world->tick + for_ns;

	while (world->tick < end)
		world_cycle(world);
}

uint64_t world_until(struct world *world, bool (*condition)(struct world *), uint64_t limit_ns)
{
	const uint64_t begin = world->tick;

	while (!condition(world)) {
		if (world->tick - begin > limit_ns)
			fail_msg("not within %" PRIu64 " ms; link %u fault %u flags 0x%x",
				 limit_ns / MS, world->state.link, world->state.fault,
				 world->state.flags);
		world_cycle(world);
	}
	return world->tick - begin;
}

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
	sim_rig_run(&world->rig, world->now);
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
	sim_rig_run(&world->rig, world->now);
	return world->rig.device.engine.axis[axis].pulses;
}

uint8_t world_engine_state(struct world *world)
{
	sim_rig_run(&world->rig, world->now);
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

void world_axes(struct world *world)
{
	struct pokeys_settings *settings = &world->config.settings;

	settings->set |= POKEYS_SET_AXES;
	settings->axes = 3;
	for (unsigned int i = 0; i < 3; i++) {
		struct pokeys_axis_settings *axis = &settings->axis[i];

		axis->options = axis->options_mask = WIRE_AXIS_ENABLED |
			WIRE_AXIS_INTERNAL_PLANNER | WIRE_AXIS_POSITION_MODE;
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
		.pins_set = pin_a < POKEYS_PINS, .pin_a = pin_a, .pin_b = pin_b,
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
		.position = position, .velocity = velocity, .mode = POKEYS_AXIS_POSITION,
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
	sim_rig_silence(&world->rig, world->now, 300 * MS);
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
