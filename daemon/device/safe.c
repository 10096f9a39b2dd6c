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
 * Back again after a loss (of the device, of the heartbeat, of time while this computer was
 * suspended), neither motion nor the outputs go on by themselves: a spindle's relay is as
 * dangerous as an axis. Outputs stay in the safe state until the edge that permits
 * motion, but for those of resume-outputs; by default that is all of a panel, which
 * nobody switches on. A commander that is started after the loss
 * does not command what was before it, unless its machine is on from the first, or it says
 * that it drove the device under an earlier daemon.
 *
 * The commander's own emergency stop is obeyed at once: axes stop, and all outputs are safe,
 * whatever resumes, until it is released and the edge that permits motion follows. So a
 * panel that has an emergency stop needs machine-on as well.
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
	device->safe.lost &= !on;
	device->safe.stopped &= !on;
}

void safe_permit_drop(struct device *device)
{
	permit(device, false);
	device->safe.edge_armed = false;
	device->safe.edge_unread = false;
}

static bool has_axes(const struct device *device)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		if (motion_drivable(device, i))
			return true;
	return false;
}

/*
 * Where the axes stand, of which the references are from now on those of the commander.
 * One that drives outputs only does not have to read.
 */
static bool positions_known(struct device *device)
{
	const struct intake *intake = &device->intake;
	const uint64_t data_ns = pokeys_state_age_ns(&device->image, device->now_ns);
	const uint64_t age_ns = intake->read_age_ns > data_ns ? intake->read_age_ns : data_ns;

	if (!has_axes(device) || (intake->read_recently && data_ns <= POKEYS_READ_OLD_NS))
		return true;
	intake_refuse(device, COMMAND_FAULT_UNREAD,
		      age_ns == POKEYS_NEVER ? -1 : (int64_t)(age_ns / MS));
	return false;
}

void safe_lost(struct device *device)
{
	device->safe.lost = true;
}

void safe_session(struct device *device, bool machine_on, bool resumed)
{
	device->safe.lost = machine_on || resumed;
	device->safe.stopped = false;
	device->safe.switched = machine_on;
}

static bool is_motion_board(uint8_t hardware)
{
	return hardware == WIRE_HW_57CNC || hardware == WIRE_HW_57CNCPRO4X25 ||
	       hardware == WIRE_HW_57CNCDB25;
}

/* Whether it is there to move something, or its commander switches it on and off. */
static bool is_machine(const struct device *device)
{
	return has_axes(device) || device->safe.switched ||
	       is_motion_board(device->image.identity.hardware);
}

bool safe_holds(const struct device *device)
{
	return device->safe.stopped ||
	       (device->safe.lost && (!device->config.resume_auto || is_machine(device)));
}

/* All outputs, whatever resumes. */
static bool all_safe(const struct device *device)
{
	return device->safe.wanted || device->safe.stopped;
}

bool safe_part(const struct device *device, unsigned int part)
{
	const bool resumes = !device->config.resume_auto && device->config.resume_parts & part;

	return all_safe(device) || (safe_holds(device) && !resumes);
}

static uint64_t resumed_pins(const struct device *device)
{
	return device->config.resume_auto ? 0 : pins_load(device->config.resume_outputs);
}

/* Said of one that could be driven if it were not for that. */
static void judge_held(struct device *device)
{
	struct safe *safe = &device->safe;
	const bool held = safe_holds(device) && running(device) && device->intake.fresh &&
			  !safe->wanted;

	if (held != safe->held_said && (held || !safe_holds(device)))
		device_say(device, EVENT_OUTPUTS_HELD, EVENT_NOTICE, held, 0, 0);
	if (held || !safe_holds(device))
		safe->held_said = held;
}

static void judge_emergency(struct device *device)
{
	const bool stop = device->intake.emergency;

	device->safe.stopped |= stop && !device->config.emergency_holds;
	if (stop != device->safe.emergency_said)
		device_say(device, EVENT_EMERGENCY, stop ? EVENT_WARNING : EVENT_NOTICE, stop,
			   device->config.emergency_holds, 0);
	device->safe.emergency_said = stop;
}

bool safe_emergency(const struct device *device)
{
	const struct pokeys_engine *engine = &device->image.engine;

	return device->intake.emergency || (engine->emergency && engine->axes_enabled);
}

static void judge_permission(struct device *device)
{
	struct safe *safe = &device->safe;
	const bool tripped = engine_tripped(device->image.engine.state);

	if (!running(device) || !device->intake.fresh || safe->stopping ||
	    device->intake.emergency || device->now_ns < device->life.patient_until_ns) {
		safe_permit_drop(device);
		return;
	}
	if (!device->intake.machine_on) {
		permit(device, false);
		safe->edge_armed = true;
		safe->edge_unread = false;
		return;
	}
	/* an engine that stands is not tripped by its emergency button */
	if ((tripped && safe->permitted) ||
	    (safe->edge_unread && (tripped || safe_emergency(device)))) {
		safe_permit_drop(device);
		return;
	}
	if (!safe->edge_armed)
		return;
	safe->edge_armed = false;
	safe->edge_unread = !tripped && !positions_known(device);
	permit(device, !tripped && !safe->edge_unread && postep_permits(device));
}

static void judge_safe(struct device *device)
{
	struct safe *safe = &device->safe;
	const struct intake *intake = &device->intake;
	const uint64_t since = intake->seen_ns > safe->started_ns ? intake->seen_ns :
								    safe->started_ns;
	const bool silent = !intake->fresh &&
			    device->now_ns - since >= device->config.heartbeat_timeout_ns;

	if (silent && intake->seen_ns)
		safe_lost(device);
	safe->wanted = safe->stopping || device->life.blocked || silent;
}

bool safe_pins_settled(const struct device *device, uint64_t pins, uint64_t on)
{
	const struct safe *safe = &device->safe;

	return (safe->acked_mask & pins) == pins && (safe->acked & pins) == on &&
	       (!pins || fast_pins_settled(device, pins, on));
}

static bool outputs_safe(const struct device *device)
{
	uint64_t outputs, mask;

	safe_outputs(device, &outputs, &mask);
	return safe_pins_settled(device, mask, outputs) && output_settled(device);
}

static void judge_reached(struct device *device)
{
	struct safe *safe = &device->safe;
	const bool there = running(device) ||
			   (device->life.blocked && device->access.phase == ACCESS_OPEN);
	const bool reached = safe->wanted && there && loops_off(device) && outputs_safe(device) &&
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
	safe->switched |= device->intake.machine_on;
	/* on before there is a device: what connects then is not to be energised by that */
	if (!running(device) && device->intake.machine_on)
		safe_lost(device);
	judge_safe(device);
	if (!safe->wanted)
		safe->commanded |= device->intake.outputs_mask;
	judge_emergency(device);
	judge_permission(device);
	judge_held(device);
	judge_reached(device);
}

void safe_outputs(const struct device *device, uint64_t *outputs, uint64_t *mask)
{
	const struct safe *safe = &device->safe;
	const struct intake *intake = &device->intake;
	const uint64_t owned = pins_load(device->image.digital_out_owned) & OUTPUT_PINS;
	const uint64_t safe_mask = (pins_load(device->config.safe_mask) | safe->commanded) & owned &
				   ~pins_load(device->config.safe_hold);
	const uint64_t safe_values = pins_load(device->config.safe_outputs);
	const uint64_t follow = all_safe(device)   ? 0 :
				safe_holds(device) ? resumed_pins(device) :
						     UINT64_MAX;
	/* what the safe state leaves as it is may still be switched off */
	const uint64_t off = safe->wanted ? 0 :
					    pins_load(device->config.safe_hold) & ~intake->outputs;
	const uint64_t commanded = intake->fresh ? intake->outputs_mask & owned & (follow | off) :
						   0;
	const uint64_t kept = safe_mask & ~follow;
	const uint64_t loops = loops_pins(device);

	*mask = kept | commanded | loops;
	*outputs = (safe_values & kept) | (intake->outputs & commanded) | loops_pins_on(device);
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
	judge_reached(device); /* the last answers came after the last cycle began */
	if (safe->reached || !(safe->stopping ? safe->ran : running(device)))
		return;
	if (failsafe)
		acts_ms = failsafe->peripherals ? failsafe->timeout * 100 : 0;
	device_say(device, EVENT_NOT_SAFE, EVENT_WARNING, acts_ms,
		   failsafe ? failsafe->peripherals : 0, 0);
}
