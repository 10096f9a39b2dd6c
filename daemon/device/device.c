/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The room's door: what the loop calls, in the order in which it matters.
 *
 * A cycle first lets the mailbox look at the clock if nothing is in flight: its
 * ids rest for a time after use, and nobody else would tell it then that the time
 * is over. Deadlines are not its business, for the answer may have come and wait
 * in the socket: the loop looks at them when it has taken all that came. Then it
 * looks at the command, decides what is safe and what
 * is permitted, and only then lets the life cycle send. So outputs and
 * references of this cycle come from this cycle's command, and a heartbeat
 * that became late just now is already acted upon.
 *
 * All state is in one struct that the caller provides; nothing is allocated.
 */

#include <string.h>
#include "daemon/device/internal.h"

size_t device_size(void)
{
	return (sizeof(struct device) + 63) & ~(size_t)63;
}

/* Values that would divide by zero or never end. */
static void sane(struct device_config *config)
{
	if (!config->period_ns)
		config->period_ns = 1 * MS;
	if (!config->fast_divider)
		config->fast_divider = 1;
	if (!config->lost_after_ns)
		config->lost_after_ns = 200 * MS;
}

/* A fill of eight parts is one entry of the mailbox and one datagram of eight packets. */
static int transmit(void *context, const uint8_t *packet, size_t length)
{
	const struct device *device = context;
	uint8_t all[WIRE_MULTI_BYTES];

	if (buffer_in_parts(device, packet, all))
		return device->io.send(device->io.context, all, sizeof(all));
	return device->io.send(device->io.context, packet, length);
}

static int receive(void *context, uint8_t *packet, size_t size, struct pokeys_rx *rx)
{
	const struct device *device = context;

	return device->io.receive(device->io.context, packet, size, rx);
}

void device_init(struct device *device, const struct device_config *config,
		 const struct pokeys_io *io, struct event_ring *events)
{
	const struct pokeys_io own = {
		.send = transmit,
		.receive = io->receive ? receive : NULL,
		.context = device,
	};

	memset(device, 0, sizeof(*device));
	device->config = *config;
	sane(&device->config);
	device->events = events;
	device->io = *io;
	if (pokeys_device_init(&device->mailbox, &own, &device->config.mailbox) < 0)
		pokeys_device_init(&device->mailbox, &own, NULL);
	decode_init(device);
	device_wish_init(device);
	loops_init(device);
}

void device_cycle(struct device *device, uint64_t cycle, uint64_t tick_ns, uint64_t now_ns,
		  const struct pokeys_command *command, int refused)
{
	device->now_ns = now_ns;
	device->cycle = cycle;
	device->tick_ns = tick_ns;
	device->budget = BUDGET;
	if (!device->mailbox.in_flight_count)
		pokeys_device_check(&device->mailbox, now_ns);
	intake_cycle(device, command, refused);
	one_shot_cycle(device);
	loops_cycle(device);
	safe_cycle(device);
	life_cycle(device);
}

void device_spare(struct device *device)
{
	plan_spare(device);
	meter_cycle(device);
	device->cycle_ns = device->now_ns;
}

void device_deliver(struct device *device, const uint8_t *data, size_t length,
		    const struct pokeys_rx *rx, uint64_t now_ns)
{
	device->now_ns = now_ns;
	if (pokeys_device_deliver(&device->mailbox, data, length, rx, now_ns) > 0)
		life_heard(device, rx && rx->t_ns && rx->t_ns <= now_ns ? rx->t_ns : now_ns);
}

const pokeys_device_t *device_mailbox(const struct device *device)
{
	return &device->mailbox;
}

void device_check(struct device *device, uint64_t now_ns)
{
	device->now_ns = now_ns;
	pokeys_device_check(&device->mailbox, now_ns);
}

uint64_t device_next_deadline(const struct device *device)
{
	return pokeys_device_next_deadline(&device->mailbox);
}
