/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The two fast requests: 0xCC with all inputs and outputs, and the pulse engine's status
 * (protocol sections 3.4 and 3.24.2).
 *
 * Several of each may be under way. Outputs that change go out with the next one; for a
 * heater or a motor that is to be off, that is sent at once.
 *
 * An answer acknowledges the outputs of its request. But the device may get an older request
 * after a newer one. So when a request ends that had another value for an output than the
 * one that is acknowledged, or that was sent last, that output is unknown until a request is
 * answered that was made after this.
 */

#include <string.h>
#include "daemon/device/internal.h"

static void io_request(const struct device *device, struct wire_io_req *io)
{
	uint64_t outputs, mask;

	memset(io, 0, sizeof(*io));
	safe_outputs(device, &outputs, &mask);
	if (plan_doubts(device)) {
		mask = loops_pins_stopping(device);
		outputs &= mask;
	}
	io->write = mask != 0;
	io->outputs = outputs;
	io->ignore = ~mask & ((UINT64_C(1) << 56) - 1);
}

static uint64_t mask_of(const struct wire_io_req *io)
{
	return ~io->ignore & OUTPUT_PINS;
}

void fast_measure(struct device *device)
{
	struct fast *fast = &device->fast;

	if (!fast->measuring)
		fast->measured_tick_ns = device->tick_ns;
	fast->measuring = true;
}

/* Both replies of a cycle are in. */
static void measured(struct device *device)
{
	if (!device->fast.measuring || !device_fast_complete(device))
		return;
	device->fast.measuring = false;
	histogram_add(&device->meter.fresh, device->now_ns - device->fast.measured_tick_ns);
}

/* What a locked device answers, nobody knows. */
static bool believable(const struct device *device, const mailbox_entry_t *entry)
{
	return answered(entry) && device->access.phase == ACCESS_OPEN;
}

static void io_ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
		     uint64_t now_ns);

void fast_doubt(struct device *device, uint64_t pins)
{
	struct fast *fast = &device->fast;

	device->safe.acked_mask &= ~pins;
	if (pins)
		fast->clear_high = device->mailbox.serial + 1;
	for (; pins; pins &= pins - 1)
		fast->clear[__builtin_ctzll(pins)] = fast->clear_high;
}

/* Pins of which the reply to a request with this serial says nothing. */
static uint64_t doubted(const struct device *device, uint64_t serial)
{
	const struct fast *fast = &device->fast;
	uint64_t pins = 0;

	if (serial >= fast->clear_high)
		return 0;
	for (unsigned int i = 0; i < POKEYS_PINS; i++)
		pins |= (uint64_t)(fast->clear[i] > serial) << i;
	return pins;
}

static void acknowledge(struct device *device, const mailbox_entry_t *entry,
			const struct wire_io_req *io)
{
	const uint64_t mask = mask_of(io) & ~doubted(device, entry->serial);

	safe_outputs_acked(device, io->outputs & mask, mask);
}

/* It may have been executed, or will be, or not. */
static void lose(struct device *device, const struct wire_io_req *io)
{
	const struct fast *fast = &device->fast;
	const uint64_t mask = mask_of(io);

	device->safe.acked_mask &= ~((io->outputs ^ device->safe.acked) & mask);
	fast_doubt(device, (io->outputs ^ fast->io_outputs) & mask & fast->io_mask);
}

static void io_taken(struct device *device, const mailbox_entry_t *entry)
{
	plan_heard(device);
	device->plan.last_io_ns = entry->timestamp_received;
	decode_io(device, entry);
	pipeline_learn(device, entry, false);
	meter_reply(device, entry, true);
}

static void io_ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
		     uint64_t now_ns)
{
	struct device *device = device_of(mailbox);
	struct fast *fast = &device->fast;
	struct wire_io_req io;

	(void)context;
	device->now_ns = now_ns;
	wire_io_decode_req(entry->request_buffer, &io);
	if (entry->serial == fast->io_sent)
		fast->io_open = false;
	if (!believable(device, entry)) {
		if (entry->tries)
			lose(device, &io);
	} else if (pipeline_take(device, entry, &fast->io_taken)) {
		io_taken(device, entry);
		acknowledge(device, entry, &io);
	} else {
		/* the device may have got it after a newer one */
		lose(device, &io);
	}
	measured(device);
}

/* What was sent last has these pins so, or if nothing is under way, that is acknowledged. */
static bool is_said(const struct device *device, uint64_t pins, uint64_t on)
{
	const struct fast *fast = &device->fast;
	const mailbox_entry_t *newest = pipeline_find(device, fast->io_sent);

	if (!newest)
		return !fast_io_open(device) && (device->safe.acked_mask & pins) == pins &&
		       (device->safe.acked & pins) == on;
	return newest->tries && !(doubted(device, newest->serial) & pins) &&
	       (fast->io_mask & pins) == pins && (fast->io_outputs & pins) == on;
}

bool fast_hides_off(const struct device *device)
{
	const uint64_t pins = loops_pins_stopping(device);

	return pins && !is_said(device, pins, loops_pins_on(device) & pins);
}

/* It is sent again, with the newest outputs: which of both it was answered for is not known. */
static void io_refresh(pokeys_device_t *mailbox, mailbox_entry_t *entry, void *context)
{
	struct device *device = device_of(mailbox);
	struct fast *fast = &device->fast;
	struct wire_io_req io;
	uint64_t mask;

	(void)context;
	io_request(device, &io);
	mask = mask_of(&io);
	if (io.outputs == fast->io_outputs && mask == fast->io_mask)
		return;
	fast_doubt(device, ((io.outputs ^ fast->io_outputs) | (mask ^ fast->io_mask)) &
				   (mask | fast->io_mask));
	fast->io_outputs = io.outputs;
	fast->io_mask = mask;
	io.write = 1;
	wire_io_encode_req(entry->request_buffer, &io);
}

void fast_send_io(struct device *device)
{
	struct fast *fast = &device->fast;
	const uint64_t outputs = fast->io_outputs, mask = fast->io_mask, sent = fast->io_sent;
	const bool open = fast->io_open;
	struct wire_io_req io;

	if (!pipeline_may(device, io_ended, true) && !fast_hides_off(device))
		return;
	io_request(device, &io);
	fast->io_outputs = io.outputs;
	fast->io_mask = mask_of(&io);
	fast->io_sent = device->mailbox.serial + 1;
	fast->io_open = true;
	if (pipeline_send(device, WIRE_OP_IO, &io, io_ended, io_refresh))
		return;
	fast->io_outputs = outputs;
	fast->io_mask = mask;
	fast->io_sent = sent;
	/* it may have ended for want of room */
	fast->io_open = open && pipeline_find(device, sent);
}

bool fast_pins_settled(const struct device *device, uint64_t pins, uint64_t on)
{
	const pokeys_device_t *mailbox = &device->mailbox;

	for (uint32_t i = 0; i < mailbox->in_flight_count; i++) {
		const mailbox_entry_t *entry = &mailbox->mailbox[mailbox->in_flight[i]];
		struct wire_io_req io;

		if (entry->parser != io_ended)
			continue;
		if (doubted(device, entry->serial) & pins)
			return false;
		wire_io_decode_req(entry->request_buffer, &io);
		if ((io.outputs & mask_of(&io) & pins) != (on & mask_of(&io)))
			return false;
	}
	return true;
}

static void status_ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
			 uint64_t now_ns)
{
	struct device *device = device_of(mailbox);
	struct fast *fast = &device->fast;

	(void)context;
	device->now_ns = now_ns;
	if (entry->serial == fast->status_sent)
		fast->status_open = false;
	if (believable(device, entry))
		buffer_learn_order(device, entry->timestamp_first_sent);
	if (believable(device, entry) && pipeline_take(device, entry, &fast->status_taken)) {
		if (decode_status(device, entry))
			motion_status(device, entry->timestamp_first_sent);
		pipeline_learn(device, entry, true);
		meter_reply(device, entry, true);
	}
	measured(device);
}

void fast_send_status(struct device *device)
{
	/* the mailbox picks the check byte */
	static const struct wire_pulse_status_req request;
	struct fast *fast = &device->fast;
	const uint64_t sent = fast->status_sent;
	const bool open = fast->status_open;

	if (!pipeline_may(device, status_ended, false))
		return;
	fast->status_sent = device->mailbox.serial + 1;
	fast->status_open = true;
	if (pipeline_send(device, WIRE_OP_PULSE_STATUS, &request, status_ended, NULL))
		return;
	fast->status_sent = sent;
	fast->status_open = open && pipeline_find(device, sent);
}

unsigned int fast_io_open(const struct device *device)
{
	return pipeline_open(device, io_ended);
}

unsigned int fast_open(const struct device *device)
{
	return fast_io_open(device) + pipeline_open(device, status_ended);
}

bool device_fast_complete(const struct device *device)
{
	return !device->fast.io_open && !device->fast.status_open;
}

void fast_begin(struct device *device)
{
	device->fast = (struct fast){ 0 };
	/* requests of before may still be under way */
	fast_doubt(device, OUTPUT_PINS);
}
