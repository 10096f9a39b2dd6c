/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What is asked in a cycle (protocol section 3.25).
 *
 * Two requests carry everything fast: 0xCC, which also writes the outputs,
 * and the pulse engine's status (fast.c). They and the axes' references go out in
 * every cycle, also while older ones are under way, unless the device is too slow
 * for that (pipeline.c).
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

enum { KEPT = 4 }; /* places for the urgent kinds alone; with PWM of loops one more */

uint64_t plan_answers_ns(const struct device *device, unsigned int count)
{
	return (device->config.period_ns * device->config.fast_divider +
		device->mailbox.statistics.rtt_smoothed_ns) *
	       count;
}

bool plan_doubts(const struct device *device)
{
	return device->plan.doubt_tick || device->plan.doubt_identity || restart_doubted(device);
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

void plan_heard(struct device *device)
{
	look_for_gap(device);
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

static void send_fast(struct device *device)
{
	struct plan *plan = &device->plan;

	plan->next_cycle = device->cycle + device->config.fast_divider;
	device->meter.cycles_late += device->fast.io_open;
	fast_send_io(device);
	if (threading_asks(device)) {
		threading_ask(device);
		pipeline_skip(device);
	} else if (device->image.capability.pulse_engine >= 2) {
		fast_send_status(device);
	}
	fast_measure(device);
}

void plan_begin(struct device *device)
{
	memset(&device->plan, 0, sizeof(device->plan));
	fast_begin(device);
	pipeline_begin(device);
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
	return fast_open(device) || device->motion.stop_open || device->threading.open ||
	       device->threading.cancel_open;
}

void plan_blocked(struct device *device)
{
	struct plan *plan = &device->plan;

	motion_update(device);
	if (motion_send_state(device) || threading_send(device) || output_send(device) ||
	    device->now_ns < plan->blocked_ns)
		return;
	plan->blocked_ns = device->now_ns + BLOCKED_NS;
	fast_send_io(device);
	if (threading_asks(device))
		threading_ask(device);
	else if (device->image.capability.pulse_engine >= 2)
		fast_send_status(device);
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
	uint32_t urgent = fast_open(device) + reference_under_way(device);

	urgent += device->motion.run_open || device->motion.stop_open;
	urgent += device->buffer.open;
	urgent += loops_channels(device) && device->outputs.output[OUTPUT_PWM].open;
	urgent += device->threading.open;
	urgent += device->threading.arm_open || device->threading.cancel_open;
	return device->mailbox.open_count - urgent + kept(device) < device->mailbox.options.window;
}

void plan_cycle(struct device *device)
{
	bool moved;

	device->plan.cycle = device->cycle;
	motion_update(device);
	look_for_gap(device);
	if (device->cycle >= device->plan.next_cycle)
		send_fast(device);
	else if (fast_hides_off(device))
		fast_send_io(device);
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
		device->budget++; /* motion has a place of its own */
	if (buffer_send(device))
		device->budget++; /* likewise */
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
