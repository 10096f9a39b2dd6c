/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A whole machine in virtual time: the device layer with its real mailbox, a
 * simulated device behind a faulty link, a loop that turns them, a commander,
 * and the invariants of every tick.
 */
#ifndef TESTS_DEVICE_WORLD_H
#define TESTS_DEVICE_WORLD_H

#include <stdbool.h>
#include <stdint.h>
#include "daemon/device/device.h"
#include "sim/bench.h"
#include "sim/rig.h"

#define US UINT64_C(1000)
#define MS UINT64_C(1000000)
#define SECOND (1000 * MS)

/*
 * Where each of many is tried, seed or lost packet: ThreadSanitizer is twenty times
 * slower, and what it looks for, another thread, is not there. One of seven will do.
 */
#ifdef __SANITIZE_THREAD__
#define WORLD_STRIDE 7
#else
#define WORLD_STRIDE 1
#endif

/* What has left for the wire, by operation and (pulse engine) sub-command. */
struct world_sent {
	uint64_t all, operation[256], pulse[256];
};

struct world {
	struct device *device;
	struct device_config config;
	struct event_ring events;
	struct sim_rig rig;
	struct pokeys_command command;
	struct pokeys_state state;  /* as published last */
	struct pokeys_state before; /* ... and in the cycle before */
	uint64_t now, tick, cycle;
	uint64_t begin_ns;
	uint64_t length_ns; /* of the next cycles; 0 = config.period_ns */
	uint64_t seed;
	bool commanding;          /* a commander writes in each cycle */
	bool attached;            /* the device layer may look at the image */
	int refused;              /* the image cannot be read: this -errno */
	bool flags_are_noise;     /* command.flags may be refused: I7 is not checked */
	uint64_t asleep_ns;       /* the device's clock has gone on by so much alone */
	int device_ppm;           /* how much faster the device's clock goes than ours */
	bool unplugged;           /* the kernel refuses to send */
	uint64_t motion_sent;     /* requests for motion, at the last look */
	unsigned int fresh_high;  /* most new requests in a cycle */
	uint64_t (*clock)(void);  /* for work_ns; NULL = nobody wants to know */
	uint64_t work_ns;         /* real time of the last device_cycle() */
	uint8_t last_request[64]; /* the packet sent last */
	void (*watch)(struct world *world, const uint8_t *packet); /* sees each packet sent */
	bool swallow;   /* set by watch: this packet never arrives */
	int swallow_as; /* ... and 0, or -errno if the kernel does not take it */
	bool (*lose_reply)(struct world *world, const uint8_t *packet);
	/* sees each reply when the device layer has judged it */
	void (*heard)(struct world *world, const uint8_t *packet, size_t length);
	struct world_sent sent;
	uint64_t event_count[EVENT_CODES];
	struct event last_event[EVENT_CODES];
	/* invariant I7, by an account of its own */
	bool unread;            /* the commander leaves its time of reading as it was */
	uint32_t flags_written; /* with the last heartbeat */
	bool low_seen;
	bool machine_was_on;
};

/* A device of default setting at a perfect link of 150 us; NULL = those options. */
void world_init(struct world *world, const struct sim_rig_options *options);
/* ... at this time. */
void world_init_at(struct world *world, const struct sim_rig_options *options, uint64_t begin_ns);

/* Puts the device layer (back) into its first moment, with world->config. */
void world_start(struct world *world);

/* One cycle, with all invariants checked. */
void world_cycle(struct world *world);
void world_run(struct world *world, uint64_t for_ns);

/* Runs until the condition holds; fails after `limit_ns`. Returns how long it took. */
uint64_t world_until(struct world *world, bool (*condition)(struct world *), uint64_t limit_ns);
bool world_is_running(struct world *world);
bool world_is_lost(struct world *world);
bool world_is_safe(struct world *world);
bool world_is_machine_on(struct world *world);
bool world_is_stopped(struct world *world);

/* This computer is suspended while the device goes on, and believes that it slept told_ns. */
void world_sleep(struct world *world, uint64_t for_ns, uint64_t told_ns);

/* The daemon itself stands still. */
void world_stall(struct world *world, uint64_t for_ns);

/* A new commander. */
void world_commander(struct world *world, uint32_t session);

/* Output pin (0-based) in the command image. */
void world_output(struct world *world, unsigned int pin, bool value);
/* What the simulated device has latched. */
bool world_latch(struct world *world, unsigned int pin);

/* Where the simulated device has an axis, in pulses, and its pulse engine's state, now. */
int64_t world_pulses(struct world *world, unsigned int axis);
uint8_t world_engine_state(struct world *world);

/* A reply that the network has kept until now. */
void world_deliver(struct world *world, const uint8_t *packet, size_t length);

/* Queues a one-shot; returns its id. */
uint32_t world_one_shot(struct world *world, const struct pokeys_one_shot *shot);
/* ... and runs until its outcome is there. */
enum pokeys_outcome world_do(struct world *world, const struct pokeys_one_shot *shot,
			     uint64_t limit_ns);
/* It is refused, and the event says why: enum one_shot_refusal, and its axis or encoder. */
void world_refuses(struct world *world, const struct pokeys_one_shot *shot, unsigned int reason,
		   unsigned int part);
enum pokeys_outcome world_outcome(const struct world *world, uint32_t id);

/* Three axes in position mode, set up in the simulated device's flash. */
void world_axes(struct world *world);

/* What pokeysd.conf wants: a pin (0-based), an encoder (pin 255 = leave), fast encoders. */
void world_pin(struct world *world, unsigned int pin, uint8_t function);
void world_encoder(struct world *world, unsigned int encoder, uint8_t options, uint8_t pin_a,
		   uint8_t pin_b);
void world_fast_encoders(struct world *world, bool fast, bool ultra);

/* An axis is enabled and goes there; pulses, pulses/s (0 = as fast as allowed). */
void world_go(struct world *world, unsigned int axis, int32_t position, float velocity);

/* Rising edge of machine-on, and the engine running if any axis is enabled. */
void world_machine_on(struct world *world);

/* As world_init(), with world_axes() and a commander, and the link runs. */
void world_up(struct world *world, const struct sim_rig_options *options);
/* ... and machine-on, with axis 0 driven, at 0. */
void world_moving(struct world *world, const struct sim_rig_options *options);

/* The device layer begins with world->config; machine-on, with axes 0 to 2 driven, at 0. */
void world_all_moving(struct world *world);

/* Ways in which it ends for whoever moves axes. */
void world_machine_off(struct world *world);
void world_commander_dies(struct world *world);
void world_emergency(struct world *world);
void world_link_breaks(struct world *world);
void world_daemon_ends(struct world *world);

/* Another client sets these axes' counts to a position, pulses. */
void world_set_elsewhere(struct world *world, uint8_t mask, int32_t position);

/* Faults on both ways. */
void world_faults(struct world *world, const struct sim_link_faults *faults);
void world_loss(struct world *world, double loss);

/* What the device's clock says now. */
uint64_t world_device_time(const struct world *world);

/* From POKEYS_SEED, or the clock; printed. */
uint64_t world_seed(void);

#endif
