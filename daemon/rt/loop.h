/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The loop: one thread, every device, one cycle after another.
 *
 *	tick -> read commands -> plan and send -> collect until the fast
 *	replies are in or the window ends -> publish -> serve what is still in
 *	flight until the next tick
 *
 * A missed tick is counted and skipped, never caught up.
 */
#ifndef RT_LOOP_H
#define RT_LOOP_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include "daemon/device/device.h"
#include "daemon/recorder/ring.h"
#include "daemon/transport/transport.h"
#include "shm/host.h"

enum loop_mode { LOOP_SLEEP, LOOP_SPIN };

/* Follow the commander's thread: YES says so aloud where it cannot be done. */
enum loop_phase_lock { LOOP_PHASE_NO, LOOP_PHASE_AUTO, LOOP_PHASE_YES };

struct loop_options {
	uint64_t period_ns; /* 250 us .. 4 ms */
	enum loop_mode mode;
	double collect; /* part of the period to await fast replies, 0.1 .. 0.9 */
	/*
	 * spin: most of a period to spend running, 0.1 .. 0.9; 1 = throttling
	 * is off. Lowered to what the kernel's throttling leaves (realtime.h).
	 */
	double duty;
	enum loop_phase_lock phase_lock;
};

/* How control and loop talk: everything here is atomic, single writer. */
struct loop_shared {
	_Atomic bool stop;       /* control: bring devices to the safe state, then end */
	_Atomic bool ended;      /* loop: it has */
	_Atomic uint64_t cycles; /* loop: cycles done */
	_Atomic uint64_t skipped;
	_Atomic uint64_t address[TRANSPORT_CHANNELS]; /* control: as in finder.h, 0 = none */
	_Atomic uint64_t in_use; /* control: bit = somebody else drives this device */
	_Atomic uint64_t wanted; /* loop: bit = this device wants an address */
	_Atomic uint32_t link[TRANSPORT_CHANNELS]; /* loop: enum pokeys_link */
	_Atomic uint64_t notify; /* loop: bit = news for the listeners of this device */
	_Atomic uint32_t flags;  /* control: POKEYS_STATE_REALTIME, _FALLBACK, _GUARD,
				  * to publish */
	_Atomic int32_t thread;  /* loop: its thread id, 0 = has not begun */
	_Atomic uint64_t guard_passed, guard_dropped; /* control: to publish */
	_Atomic uint64_t minor_faults, major_faults;  /* loop_sample_faults: since it began */
};

struct loop_device {
	struct device *device;
	struct shm_device *shm;
};

/* Where a device's packets leave: context of its struct pokeys_io. */
struct loop_port {
	struct loop *loop;
	uint32_t channel;
};

/* What somebody at a terminal wants of a device. */
struct loop_order {
	uint32_t id;    /* the giver's own */
	uint8_t device; /* index */
	uint8_t what;   /* enum device_order */
	bool replace;   /* first put `settings` in pokeysd.conf's place */
	int result;     /* of device_order() */
	struct pokeys_settings settings;
};

enum { LOOP_ORDERS = 128 }; /* a reload is one for each device; a power of 2 */

struct loop_orders {
	_Atomic uint32_t given; /* control */
	_Atomic uint32_t done;  /* loop */
	uint32_t taken;         /* control's own: results */
	struct loop_order slot[LOOP_ORDERS];
};

struct loop {
	struct loop_options options;
	struct loop_shared shared;
	struct event_ring events;
	struct recorder recorder; /* all zero = nothing is recorded */
	struct loop_orders orders;
	struct transport *transport;
	struct loop_device devices[TRANSPORT_CHANNELS];
	uint32_t count;
	/* the rest is the loop's own */
	struct loop_port port[TRANSPORT_CHANNELS];
	struct loop_private *own;
};

/*
 * Cold. Prepare a loop whose options, transport, devices and count are set
 * (the devices may be initialised later): allocates all it will ever need,
 * attaches channel i for device i. 0, -EINVAL for an option out of its range,
 * or -errno.
 */
int loop_prepare(struct loop *loop);

/*
 * Run until shared.stop; at most 800 ms more to reach the safe state. The
 * calling thread is the realtime thread, all signals blocked. 0, or -errno of
 * the transport.
 */
int loop_run(struct loop *loop);

/*
 * Read the page faults of the realtime thread from /proc into shared, for the
 * diagnostic image. Cold, another thread, a few times a second. 0 or -errno.
 */
int loop_sample_faults(struct loop *loop);

/*
 * Have the loop execute an order, one a cycle, in turn. The control thread, cold.
 * 0; -EAGAIN = LOOP_ORDERS of them wait; -ENODEV = there is no such device.
 */
int loop_order_give(struct loop *loop, const struct loop_order *order);

/* The next order that was executed, with its result; false = none. The same thread. */
bool loop_order_result(struct loop *loop, struct loop_order *out);

void loop_release(struct loop *loop);

/* The mailbox's io for a device on a channel of the loop's transport. Cold. */
void loop_io(struct loop *loop, uint32_t channel, struct pokeys_io *out);

#endif
