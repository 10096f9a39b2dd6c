/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What is asked in a cycle (protocol section 3.25).
 *
 * Two requests carry everything fast: 0xCC, which also writes the outputs,
 * and the pulse engine's status. Each of them has one place: while its answer
 * is awaited no second one is sent, so a slow device or a lossy cable makes
 * the data older but never a heap of requests. Outputs that change meanwhile
 * are put into the resend, or go out with the next one. Only for a heater or a motor
 * that is to be off the request is sent again at once.
 *
 * After a silence of some cycles only questions are asked until the device has said
 * that it is the same start of the same device: until then a patient lost-after may
 * hide that another one was put in its place, and nothing of ours is its business. But
 * what a heater or a motor was left with is switched off all the same: if it is still
 * the same device, that cannot wait.
 *
 * The third place of a cycle goes to the engine's state or the axes' references,
 * the fourth to one of: a step of a one-shot, a setting, and in turns the other
 * outputs and the slow groups. What begins and ends threading has a place of its own,
 * for an axis in position mode may move beside a thread all the time. References change
 * in every cycle of a move; with one place for both, either the slow groups would starve
 * or a reference, or a position, would be late by a cycle, and each of these is a
 * following error.
 * PWM is among the other outputs, but with heaters or servo motors: theirs have a place
 * of their own, because a motor that is to stop cannot wait for its turn.
 * With slow_together the slow groups that are due follow in the same cycle, as many
 * as the window takes.
 */

#include <string.h>
#include "daemon/device/internal.h"

enum { KEPT = 4 };	/* places for the urgent kinds alone; with PWM of loops one more */

uint64_t plan_answers_ns(const struct device *device, unsigned int count)
{
	return (device->config.period_ns * device->config.fast_divider +
		device->mailbox.statistics.rtt_smoothed_ns) * count;
}

bool plan_doubts(const struct device *device)
{
	return device->plan.doubt_tick || device->plan.doubt_identity || restart_doubted(device);
}

static void io_request(const struct device *device, struct wire_io_req *io)
{
	uint64_t outputs, mask;

	memset(io, 0, sizeof(*io));
	safe_outputs(device, &outputs, &mask);
	if (plan_doubts(device)) {
		mask = loops_pins_stopping(device);
		outputs &= mask;
	}
	/* always one that can be sent again with an off in it: a read keeps what it asks */
	io->write = mask != 0 || loops_pins(device) != 0;
	io->outputs = outputs;
	io->ignore = ~mask & ((UINT64_C(1) << 56) - 1);
}

static uint64_t mask_of(const struct wire_io_req *io)
{
	return ~io->ignore & OUTPUT_PINS;
}

/* Sent again: with the newest outputs. */
static void io_refresh(pokeys_device_t *mailbox, mailbox_entry_t *entry, void *context)
{
	struct device *device = device_of(mailbox);
	struct wire_io_req io;

	(void)context;
	io_request(device, &io);
	if (io.outputs == device->plan.io_outputs && mask_of(&io) == device->plan.io_mask &&
	    !device->plan.io_mixed)
		return;
	device->plan.io_mixed = true;
	device->plan.io_outputs = io.outputs;
	device->plan.io_mask = mask_of(&io);
	io.write = 1;
	wire_io_encode_req(entry->request_buffer, &io);
}

/* Both fast answers of this cycle are in. */
static void measure(struct device *device)
{
	if (!device->plan.measuring || !device_fast_complete(device))
		return;
	device->plan.measuring = false;
	histogram_add(&device->meter.fresh, device->now_ns - device->plan.measured_tick_ns);
}

/* From now on only questions, until it has said who it is. */
static void begin_doubt(struct device *device)
{
	struct plan *plan = &device->plan;

	plan->doubt_tick = plan->slow[SLOW_TICK].answered;
	plan->doubt_identity = true;
	loops_doubt(device);
}

void plan_doubt(struct device *device)
{
	if (!running(device))
		return;
	if (!plan_doubts(device))
		begin_doubt(device);
	slow_identity_now(device);
}

static void look_for_gap(struct device *device)
{
	const struct plan *plan = &device->plan;

	if (!running(device) || !plan->last_io_ns ||
	    device->now_ns - plan->last_io_ns <= plan_answers_ns(device, PLAN_GAP) ||
	    plan_doubts(device))
		return;
	begin_doubt(device);
}

static void answered_after_gap(struct device *device)
{
	if (plan_doubts(device))
		slow_identity_now(device);
}

void plan_tick_right(struct device *device)
{
	device->plan.doubt_tick = false;
}

void plan_identity_right(struct device *device)
{
	device->plan.doubt_identity = false;
}

/* What a locked device answers, nobody knows. */
static bool believable(const struct device *device, const mailbox_entry_t *entry)
{
	return answered(entry) && device->access.phase == ACCESS_OPEN;
}

static void io_ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
		     uint64_t now_ns)
{
	struct device *device = device_of(mailbox);
	struct plan *plan = &device->plan;

	(void)context;
	device->now_ns = now_ns;
	plan->io_open = false;
	/* With two versions under way nobody knows which one was executed last, and if any was. */
	if (!believable(device, entry) || plan->io_mixed)
		device->safe.acked_mask &= ~loops_pins(device);
	if (!believable(device, entry))
		return;
	look_for_gap(device);
	answered_after_gap(device);
	plan->last_io_ns = entry->timestamp_received;
	decode_io(device, entry);
	if (plan->io_write && !plan->io_mixed)
		safe_outputs_acked(device, plan->io_outputs, plan->io_mask);
	meter_reply(device, entry, true);
	measure(device);
}

/* A pin of a loop is to be off, and what was sent last, or is acknowledged, has it on. */
static bool hides_off(const struct device *device)
{
	const struct plan *plan = &device->plan;
	const uint64_t pins = loops_pins_stopping(device);
	const uint64_t mask = plan->io_open ? plan->io_mask : device->safe.acked_mask;
	const uint64_t outputs = plan->io_open ? plan->io_outputs : device->safe.acked;

	if (!pins)
		return false;
	return (mask & pins) != pins || (outputs & pins) != (loops_pins_on(device) & pins) ||
	       request_unsent(device, io_ended, NULL);
}

static void send_io_again(struct device *device)
{
	struct plan *plan = &device->plan;
	const uint64_t outputs = plan->io_outputs, mask = plan->io_mask;

	if (request_again(device, io_ended, NULL))
		return;
	/* the transport has not taken it */
	plan->io_outputs = outputs;
	plan->io_mask = mask;
}

static void send_io(struct device *device)
{
	struct plan *plan = &device->plan;
	struct wire_io_req io;

	if (plan->io_open) {
		if (hides_off(device))
			send_io_again(device);
		return;
	}
	io_request(device, &io);
	if (!request_send_first(device, WIRE_OP_IO, &io, io_ended, io_refresh, NULL))
		return;
	plan->io_open = true;
	plan->io_write = io.write;
	plan->io_mixed = false;
	plan->io_outputs = io.outputs;
	plan->io_mask = mask_of(&io);
}

static void status_ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
			 uint64_t now_ns)
{
	struct device *device = device_of(mailbox);

	(void)context;
	device->now_ns = now_ns;
	device->plan.status_open = false;
	if (!believable(device, entry))
		return;
	if (decode_status(device, entry))
		motion_status(device, entry->timestamp_first_sent);
	meter_reply(device, entry, true);
	measure(device);
}

static void send_status(struct device *device)
{
	/* the mailbox picks the check byte */
	static const struct wire_pulse_status_req request;

	if (device->plan.status_open ||
	    !request_send(device, WIRE_OP_PULSE_STATUS, &request, status_ended, NULL, NULL))
		return;
	device->plan.status_open = true;
}

static void send_fast(struct device *device)
{
	struct plan *plan = &device->plan;

	plan->next_cycle = device->cycle + device->config.fast_divider;
	device->meter.cycles_late += plan->io_open;
	send_io(device);
	if (threading_asks(device))
		threading_ask(device);
	else if (device->image.capability.pulse_engine >= 2)
		send_status(device);
	if (!plan->measuring)
		plan->measured_tick_ns = device->tick_ns;
	plan->measuring = true;
}

void plan_begin(struct device *device)
{
	memset(&device->plan, 0, sizeof(device->plan));
	slow_begin(device);
	ponet_begin(device);
	output_begin(device);
}

#define BLOCKED_NS (20 * MS)	/* from one safe 0xCC to the next while the link cannot run */

bool plan_busy(const struct device *device)
{
	for (unsigned int i = 0; i < OUTPUTS; i++) {
		if (device->outputs.output[i].open)
			return true;
	}
	return device->plan.io_open || device->plan.status_open || device->motion.stop_open ||
	       device->threading.open || device->threading.cancel_open;
}

void plan_blocked(struct device *device)
{
	struct plan *plan = &device->plan;

	motion_update(device);
	if (motion_send_state(device) || threading_send(device) || output_send(device) ||
	    device->now_ns < plan->blocked_ns)
		return;
	plan->blocked_ns = device->now_ns + BLOCKED_NS;
	send_io(device);
	if (threading_asks(device))
		threading_ask(device);
	else if (device->image.capability.pulse_engine >= 2)
		send_status(device);
}

/* Outputs that change in every cycle must not starve the slow groups, nor these them. */
static void send_lesser(struct device *device)
{
	struct plan *plan = &device->plan;

	if (plan->output_sent && slow_overdue(device)) {
		plan->output_sent = !slow_send(device);
		return;
	}
	plan->output_sent = output_send(device);
	if (!plan->output_sent)
		slow_send(device);
}

static uint32_t kept(const struct device *device)
{
	const uint32_t window = device->mailbox.options.window;

	if (loops_channels(device))
		return window > KEPT + 1 ? KEPT + 1 : window - 1;
	return window > 2 * KEPT ? KEPT : window / 2;
}

/*
 * The fast requests, references and the engine's state always find a place in
 * the window; all others may not fill it.
 */
static bool room(const struct device *device)
{
	uint32_t urgent = device->plan.io_open;

	urgent += device->plan.status_open;
	urgent += device->motion.reference_open;
	urgent += device->motion.run_open || device->motion.stop_open;
	urgent += device->buffer.open;
	urgent += loops_channels(device) && device->outputs.output[OUTPUT_PWM].open;
	urgent += device->threading.open;
	urgent += device->threading.arm_open || device->threading.cancel_open;
	return device->mailbox.open_count - urgent + kept(device) <
	       device->mailbox.options.window;
}

void plan_cycle(struct device *device)
{
	bool moved;

	device->plan.cycle = device->cycle;
	motion_update(device);
	look_for_gap(device);
	if (device->cycle >= device->plan.next_cycle)
		send_fast(device);
	else if (hides_off(device))
		send_io(device);
	if ((plan_doubts(device) ? loops_channels_stopping(device) : loops_channels(device)) &&
	    output_send_loops(device))
		device->budget++;
	if (plan_doubts(device))
		return;
	moved = motion_send_state(device);
	if (threading_send(device))
		device->budget++;
	moved = reference_send(device) || moved;
	if (moved)
		device->budget++;	/* motion has a place of its own */
	if (buffer_send(device))
		device->budget++;	/* likewise */
}

void plan_spare(struct device *device)
{
	if (device->plan.cycle != device->cycle)
		return;
	slow_rates(device);
	if (plan_doubts(device)) {
		slow_send(device);
		return;
	}
	if (!room(device))
		return;
	if (!one_shot_send(device) && !configure_send(device))
		send_lesser(device);
	while (room(device) && slow_send_together(device))
		;
}
