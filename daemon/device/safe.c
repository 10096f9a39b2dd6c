/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The safe state, and the permission to move.
 *
 * Safe state (invariant I6): when the commander's heartbeat is late, or the
 * daemon ends, the outputs take their configured safe values: those of the
 * configuration's mask and every output that a commander ever drove, for an
 * output that nobody thought of is the one that hurts; only those that were
 * named to be held are left as they are. They are sent with
 * every 0xCC and count when a 0xCC that carried nothing else was answered;
 * the axes count when a status says that the engine stands, and one that it is in
 * threading no more. A daemon that
 * has just started waits as long for a commander as for a late one.
 *
 * A device that is found again but may not run, because a setting is refused or
 * it is locked, is brought into the safe state as well, whoever commands.
 *
 * Back again, the outputs follow the commander at once. Motion does not.
 *
 * Permission (invariant I7): motion needs a rising edge of machine-on, seen
 * low and then high while the link runs and the heartbeat is fresh. The
 * commander must know then where the axes stand: it has read that lately, and what there
 * was to read was fresh. Every
 * loss of link, heartbeat or session, a trip of the engine and the daemon's
 * end take the permission away and forget the low; what was commanded before
 * is not taken up again by itself. So does a motor driver with another step mode than
 * wanted, for each distance would be another one. Nor is there any permission while flash
 * is written, for then silence is not taken for a loss.
 *
 * There is a last word to the device at the daemon's end. It is not waited
 * for longer than a device that answers can need; of one that ran and has not
 * acknowledged it by then it is said what has the outputs now: its own failsafe,
 * or nobody.
 */

#include "daemon/device/internal.h"

#define STOP_NS (400 * MS)

static void permit(struct device *device, bool on)
{
	if (device->safe.permitted != on)
		device_say(device, EVENT_MACHINE, EVENT_NOTICE, on, 0, 0);
	device->safe.permitted = on;
}

void safe_permit_drop(struct device *device)
{
	permit(device, false);
	device->safe.edge_armed = false;
}

/* Where the axes stand, of which the references are from now on those of the commander. */
static bool positions_known(struct device *device)
{
	const struct intake *intake = &device->intake;
	const uint64_t data_ns = pokeys_state_age_ns(&device->image, device->now_ns);
	const uint64_t age_ns = intake->read_age_ns > data_ns ? intake->read_age_ns : data_ns;

	if (intake->read_recently && data_ns <= POKEYS_READ_OLD_NS)
		return true;
	intake_refuse(device, COMMAND_FAULT_UNREAD,
		      age_ns == POKEYS_NEVER ? -1 : (int64_t)(age_ns / MS));
	return false;
}

static void judge_permission(struct device *device)
{
	struct safe *safe = &device->safe;

	if (!running(device) || !device->intake.fresh || safe->stopping ||
	    device->now_ns < device->life.patient_until_ns) {
		safe_permit_drop(device);
		return;
	}
	if (!device->intake.machine_on) {
		permit(device, false);
		safe->edge_armed = true;
		return;
	}
	if (safe->permitted && engine_tripped(device->image.engine.state)) {
		safe_permit_drop(device);
		return;
	}
	if (!safe->edge_armed)
		return;
	safe->edge_armed = false;
	permit(device, positions_known(device) &&
		       !engine_tripped(device->image.engine.state) && postep_permits(device));
}

static void judge_safe(struct device *device)
{
	struct safe *safe = &device->safe;
	const struct intake *intake = &device->intake;
	const uint64_t since = intake->seen_ns > safe->started_ns ? intake->seen_ns :
								    safe->started_ns;

	safe->wanted = safe->stopping || device->life.blocked ||
		       (!intake->fresh &&
			device->now_ns - since >= device->config.heartbeat_timeout_ns);
}

static bool outputs_safe(const struct device *device)
{
	const struct safe *safe = &device->safe;
	uint64_t outputs, mask;

	safe_outputs(device, &outputs, &mask);
	return (safe->acked_mask & mask) == mask && (safe->acked & mask) == outputs &&
	       output_settled(device);
}

static void judge_reached(struct device *device)
{
	struct safe *safe = &device->safe;
	const bool there = running(device) ||
			   (device->life.blocked && device->access.phase == ACCESS_OPEN);
	const bool reached = safe->wanted && there && outputs_safe(device) &&
			     motion_standing(device) && !threading_dirty(device);

	if (reached != safe->reached)
		device_say(device, EVENT_SAFE, EVENT_NOTICE, reached, there, 0);
	safe->reached = reached;
}

/* Running (again): what it acknowledged before says nothing any more. */
void safe_begin(struct device *device)
{
	device->safe.acked = 0;
	device->safe.acked_mask = 0;
	pins_store(device->image.digital_out, 0);
}

void safe_cycle(struct device *device)
{
	struct safe *safe = &device->safe;

	if (!safe->started_ns)
		safe->started_ns = device->now_ns;
	judge_safe(device);
	if (!safe->wanted)
		safe->commanded |= device->intake.outputs_mask;
	judge_permission(device);
	judge_reached(device);
}

void safe_outputs(const struct device *device, uint64_t *outputs, uint64_t *mask)
{
	const struct safe *safe = &device->safe;
	const struct intake *intake = &device->intake;
	const uint64_t owned = pins_load(device->image.digital_out_owned) & OUTPUT_PINS;

	if (safe->wanted) {
		*mask = (pins_load(device->config.safe_mask) | safe->commanded) & owned &
			~pins_load(device->config.safe_hold);
		*outputs = pins_load(device->config.safe_outputs) & *mask;
	} else {
		*mask = intake->fresh ? intake->outputs_mask & owned : 0;
		*outputs = intake->outputs & *mask;
	}
}

void safe_outputs_acked(struct device *device, uint64_t outputs, uint64_t mask)
{
	struct safe *safe = &device->safe;

	safe->acked = (safe->acked & ~mask) | outputs;
	safe->acked_mask |= mask;
	pins_store(device->image.digital_out, safe->acked);
}

void device_stop(struct device *device, uint64_t now_ns)
{
	device->now_ns = now_ns;
	if (device->safe.stopping)
		return;
	device->safe.stopping = true;
	device->safe.stopping_ns = now_ns;
	device->safe.ran = running(device);
}

bool device_stopped(const struct device *device)
{
	const struct safe *safe = &device->safe;

	if (!safe->stopping)
		return false;
	return safe->reached || device->image.link == POKEYS_LINK_SEARCHING ||
	       device->image.link == POKEYS_LINK_LOST ||
	       device->now_ns - safe->stopping_ns >= STOP_NS;
}

void device_ended(struct device *device, uint64_t now_ns)
{
	const struct wire_failsafe_req *failsafe = failsafe_known(device);
	const struct safe *safe = &device->safe;
	int64_t acts_ms = -1;

	device->now_ns = now_ns;
	judge_reached(device);	/* the last answers came after the last cycle began */
	if (safe->reached || !(safe->stopping ? safe->ran : running(device)))
		return;
	if (failsafe)
		acts_ms = failsafe->peripherals ? failsafe->timeout * 100 : 0;
	device_say(device, EVENT_NOT_SAFE, EVENT_WARNING, acts_ms,
		   failsafe ? failsafe->peripherals : 0, 0);
}
