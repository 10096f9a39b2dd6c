/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * One-shots: taken in order, one at a time, each executed at most once, each
 * with an outcome (invariant I4).
 *
 * They are read from the ring in the command image, which holds all that were
 * not taken yet; so there is no second queue here, and what a dead commander
 * had still queued is never taken. A session is joined at its head: what was
 * queued before may have been executed by the daemon before this one, and
 * nobody knows.
 *
 * An outcome is never a guess. Not sent at all is "refused" or "failed"; sent
 * without an answer is read back where the device has something to read, and
 * "unknown" otherwise. While the link is not running a one-shot is refused at
 * once: it would be another moment when it is back. The answer to one that was
 * aborted may come while the next is at work, and ends nothing.
 */

#include <errno.h>
#include <string.h>
#include "daemon/device/internal.h"

#define READ_BACKS 3	/* more, if one is not answered */

static const struct refusal not_said;

/* `why`: not_said, unless it was refused and nothing else says why. */
static void record(struct device *device, uint32_t id, uint8_t operation,
		   enum pokeys_outcome outcome, struct refusal why)
{
	if (!device->one_shots.ordered)
		device->image.one_shot[id % POKEYS_ONE_SHOT_RESULTS] =
			(struct pokeys_one_shot_result){
				.id = id,
				.operation = operation,
				.outcome = (uint8_t)outcome,
			};
	device->one_shots.refused += outcome == POKEYS_OUTCOME_REFUSED;
	if (operation == POKEYS_ONE_SHOT_MOVE && moving_is_usual(device))
		return; /* hundreds a second */
	device_say(device, EVENT_ONE_SHOT,
		   outcome == POKEYS_OUTCOME_DONE ? EVENT_INFO : EVENT_WARNING, operation,
		   device->one_shots.ordered ? EVENT_ORDERED : (int64_t)id,
		   outcome | (unsigned int)why.reason << 8 | (unsigned int)why.part << 16);
}

static void taken(struct device *device, uint32_t tail)
{
	device->one_shots.tail = tail;
	device->image.one_shot_ack = tail;
}

void one_shot_session(struct device *device, uint32_t head)
{
	const uint32_t known = head < POKEYS_ONE_SHOT_RESULTS ? head : POKEYS_ONE_SHOT_RESULTS;

	if (device->one_shots.phase != ONE_SHOT_IDLE)
		one_shot_abort(device);
	memset(device->image.one_shot, 0, sizeof(device->image.one_shot));
	device->image.one_shot_session = device->intake.session;
	for (uint32_t id = head - known; id != head; id++)
		record(device, id, POKEYS_ONE_SHOT_NOP, POKEYS_OUTCOME_UNKNOWN, not_said);
	taken(device, head);
}

uint8_t one_shot_axes(const struct device *device)
{
	const struct one_shots *shots = &device->one_shots;

	return shots->phase != ONE_SHOT_IDLE &&
			       shots->now.operation == POKEYS_ONE_SHOT_SET_POSITION ?
		       shots->now.mask :
		       0;
}

static void end(struct device *device, enum pokeys_outcome outcome, struct refusal why)
{
	const uint8_t axes = one_shot_axes(device);

	if (axes) {
		motion_displaced(device);
		if (outcome == POKEYS_OUTCOME_UNKNOWN)
			place_lost(device, axes, PLACE_NOT_HOMED);
		else if (outcome != POKEYS_OUTCOME_DONE && device->one_shots.acted)
			place_told(device, axes);
	}
	device->one_shots.phase = ONE_SHOT_IDLE;
	record(device, device->one_shots.now.id, device->one_shots.now.operation, outcome, why);
	device->one_shots.ordered = false;
}

void one_shot_end(struct device *device, enum pokeys_outcome outcome)
{
	end(device, outcome, not_said);
}

void one_shot_refuse(struct device *device, struct refusal why)
{
	end(device, POKEYS_OUTCOME_REFUSED, why);
}

void one_shot_release(struct device *device)
{
	device->one_shots.phase = ONE_SHOT_IDLE;
	device->one_shots.ordered = false;
}

void device_one_shot_outcome(struct device *device, uint32_t id, uint8_t operation,
			     enum pokeys_outcome outcome)
{
	const bool ordered = device->one_shots.ordered;

	device->one_shots.ordered = false; /* that is the one at work */
	record(device, id, operation, outcome, not_said);
	device->one_shots.ordered = ordered;
}

static struct refusal why_not(const struct device *device, const struct operation *operation,
			      const struct pokeys_one_shot *shot)
{
	if (!operation)
		return refusal(REFUSAL_NOT_OFFERED, 0);
	if (operation->send && !running(device))
		return refusal(REFUSAL_NOT_RUNNING, 0);
	return operation->why_not ? operation->why_not(device, shot) : refusal(REFUSAL_NONE, 0);
}

static void begin(struct device *device, const struct pokeys_one_shot *shot)
{
	const struct operation *operation = operation_find(shot->operation);
	const struct refusal why = why_not(device, operation, shot);
	struct one_shots *shots = &device->one_shots;

	shots->now = *shot;
	shots->step = 0;
	shots->acted = false;
	shots->unread = 0;
	if (why.reason)
		one_shot_refuse(device, why);
	else if (operation->send)
		shots->phase = ONE_SHOT_NEXT;
	else
		one_shot_end(device, !operation->act || operation->act(device, shot) ?
					     POKEYS_OUTCOME_DONE :
					     POKEYS_OUTCOME_REFUSED);
}

static void take_next(struct device *device, const struct pokeys_command *command)
{
	const uint32_t id = device->one_shots.tail;
	const struct pokeys_one_shot *shot = &command->one_shot[id % POKEYS_ONE_SHOTS];

	taken(device, id + 1);
	if (shot->id != id) {
		intake_refuse(device, COMMAND_FAULT_ONE_SHOT_ID, id);
		record(device, id, shot->operation, POKEYS_OUTCOME_REFUSED, not_said);
		return;
	}
	begin(device, shot);
}

void one_shot_intake(struct device *device, const struct pokeys_command *command)
{
	const struct one_shots *shots = &device->one_shots;
	const uint32_t head = command->one_shot_head;

	if (head - shots->tail > POKEYS_ONE_SHOTS) {
		intake_refuse(device, COMMAND_FAULT_ONE_SHOT_RING, head - shots->tail);
		device->one_shots.refused++;
		taken(device, head);
		return;
	}
	while (shots->phase == ONE_SHOT_IDLE && shots->tail != head)
		take_next(device, command);
}

int one_shot_order(struct device *device, enum pokeys_one_shot_operation operation)
{
	struct one_shots *shots = &device->one_shots;

	if (shots->order || shots->ordered)
		return -EALREADY;
	shots->order = (uint8_t)operation;
	return 0;
}

void one_shot_cycle(struct device *device)
{
	struct one_shots *shots = &device->one_shots;
	const struct pokeys_one_shot shot = { .operation = shots->order };

	if (!shots->order || shots->phase != ONE_SHOT_IDLE)
		return;
	shots->order = 0;
	shots->ordered = true;
	begin(device, &shot);
}

bool one_shot_send(struct device *device)
{
	const struct operation *operation;

	if (operation_disarm(device))
		return true;
	if (device->one_shots.phase != ONE_SHOT_NEXT)
		return false;
	operation = operation_find(device->one_shots.now.operation);
	return operation->send(device);
}

void one_shot_abort(struct device *device)
{
	device->one_shots.armed = 0;
	device->one_shots.disarm = false;
	if (device->one_shots.phase != ONE_SHOT_IDLE)
		one_shot_end(device, device->one_shots.acted ? POKEYS_OUTCOME_UNKNOWN :
							       POKEYS_OUTCOME_FAILED);
}

static void ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
		  uint64_t now_ns)
{
	struct device *device = device_of(mailbox);
	struct one_shots *shots = &device->one_shots;
	const struct operation *operation;

	(void)context;
	device->now_ns = now_ns;
	if (shots->phase != ONE_SHOT_OPEN || entry->serial != shots->serial ||
	    entry->state == POKEYS_REQUEST_CANCELLED)
		return; /* one_shot_abort() has the last word */
	operation = operation_find(shots->now.operation);
	if (answered(entry))
		operation->answered(device, entry);
	else if (!shots->acted)
		one_shot_end(device, POKEYS_OUTCOME_FAILED);
	else if (operation->unknown &&
		 (entry->request_class != POKEYS_CLASS_READ || shots->unread++ < READ_BACKS))
		operation->unknown(device);
	else
		one_shot_end(device, POKEYS_OUTCOME_UNKNOWN);
}

static bool sent(struct device *device, enum wire_op op, const void *value, bool ok)
{
	uint8_t packet[WIRE_PK];

	if (!ok)
		return false;
	wire_encode_req(op, packet, value);
	device->one_shots.acted |= wire_request_class(wire_op(op), packet) != WIRE_READ;
	device->one_shots.serial = device->mailbox.serial;
	device->one_shots.phase = ONE_SHOT_OPEN;
	return true;
}

bool one_shot_request(struct device *device, enum wire_op op, const void *value)
{
	return sent(device, op, value, request_send(device, op, value, ended, NULL, NULL));
}

bool one_shot_request_patiently(struct device *device, enum wire_op op, const void *value,
				uint64_t deadline_ns)
{
	return sent(device, op, value,
		    request_send_patiently(device, op, value, ended, deadline_ns));
}
