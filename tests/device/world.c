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
	const int64_t since = (int64_t)(world->now - world->begin_ns);

	return world->now + world->asleep_ns + (uint64_t)(since * world->device_ppm / 1000000);
}

/* ... and when by ours; never too early. */
static uint64_t host_time(const struct world *world, uint64_t device_ns)
{
	const double since = (double)(int64_t)(device_ns - world->asleep_ns - world->begin_ns);

	if (device_ns == SIM_RIG_NEVER)
		return device_ns;
	if (!world->device_ppm)
		return device_ns - world->asleep_ns;
	return world->begin_ns + (uint64_t)(since * 1e6 / (1e6 + world->device_ppm)) + 2;
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
	world->swallow_as = 0;
	account(world, packet);
	if (world->swallow)
		return world->swallow_as;
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
	world_init_at(world, options, 1000 * SECOND);
}

void world_init_at(struct world *world, const struct sim_rig_options *options, uint64_t begin_ns)
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
	world->begin_ns = world->now = world->tick = begin_ns;
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
		assert_true(s->encoder_t_ns[i] >= world->before.encoder_t_ns[i] ||
			    (s->encoder_epoch != world->before.encoder_epoch &&
			     !s->encoder_t_ns[i]));
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
		0x02, 0x03, 0x20, 0x21, 0x22, 0x23, 0x24, 0x25,
		0x30, 0x31, 0x32, 0x33, 0x34, 0xF0, 0xFE, 0xFF,
	};
	uint64_t sent = world->sent.operation[0xB0];

	for (size_t i = 0; i < sizeof(operations); i++)
		sent += world->sent.pulse[operations[i]];
	return sent;
}

/*
 * New requests of a cycle: three, and one more if one of them was for motion, two
 * if two were (references and a fill, where a device has axes of both kinds), and
 * those of all slow groups where they go together, and the PWM of heaters and servo
 * motors. Resends have a budget of their own.
 */
static void check_budget(struct world *world)
{
	const struct pokeys_link_statistics *now = &world->state.statistics;
	const struct pokeys_link_statistics *before = &world->before.statistics;
	const uint64_t fresh = (now->sent - now->resent) - (before->sent - before->resent);
	const uint64_t motion = sent_for_motion(world);
	const uint64_t more = lesser(motion - world->motion_sent, 2) +
			      (world->config.slow_together ? POKEYS_SLOW_GROUPS : 0) +
			      (world->config.servos || world->config.heaters);

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

void world_deliver(struct world *world, const uint8_t *packet, size_t length)
{
	const struct pokeys_rx rx = { .t_ns = world->now, .address = ADDRESS, .port = PORT };

	device_deliver(world->device, packet, length, &rx, world->now);
}

static void deliver(struct world *world)
{
	uint8_t packet[600];
	size_t length;

	while ((length = sim_rig_receive(&world->rig, world_device_time(world), packet,
					 sizeof(packet))) > 0) {
		if (world->lose_reply && world->lose_reply(world, packet))
			continue;
		world_deliver(world, packet, length);
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
	if (!world->unread)
		world->command.t_thread_ns = world->now;
	world->flags_written = world->command.flags;
}

void world_cycle(struct world *world)
{
	const uint64_t period = world->length_ns ? world->length_ns : world->config.period_ns;
	const bool image = world->attached && world->command.magic && !world->refused;
	const uint64_t begun = world->clock ? world->clock() : 0;

	command(world);
	world->cycle++;
	device_cycle(world->device, world->cycle, world->tick, world->now,
		     image ? &world->command : NULL, world->refused);
	world->work_ns = world->clock ? world->clock() - begun : 0;
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
