/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Homing, probing, jogging and threading: phases that each have a time limit, and from each of
 * them the same way out.
 *
 *	preparing --> starting --> working --> complete --> finishing
 *	    |             |           |            |            |
 *	    +-------------+-----------+-- stopping +------------+--> idle
 *
 * Preparing brings the engine to stand, for the vendor starts both from there.
 * Starting asks the device once. Without an answer it is read back: a status
 * asked afterwards says whether the device has begun, and only if it stands it
 * is asked again, for as long as the phase may last. Working, complete and
 * finishing watch the engine's state.
 *
 * Every end goes through stopping, where motion.c sends stop until a status
 * shows the engine standing, and looks on as long as nobody drives it. So it
 * does not matter which packet is lost, or whether a start arrives late: what
 * begins after the stop is stopped again. What aborts (machine off, a trip, the
 * commander gone, a one-shot) only changes the result.
 *
 * Coordinates have changed under whatever commanded the axes. They are parked
 * until their enable was seen low, or their command has come to where they
 * are; no reference from before makes them jump (invariant I7).
 */

#include <string.h>
#include "daemon/device/internal.h"

#define STAND_NS (5 * SECOND)		/* an axis may need that long to slow down */
#define REQUEST_NS (1 * SECOND)
#define COMPLETE_NS (10 * SECOND)	/* for the commander to finish it */
#define MEETS 2				/* pulses: that near is the same place */

static const struct task_kind *kind_of(const struct device *device)
{
	static const struct task_kind *const kinds[] = {
		[POKEYS_TASK_HOMING] = &task_homing,         [POKEYS_TASK_PROBING] = &task_probing,
		[POKEYS_TASK_HYBRID_PROBING] = &task_hybrid, [POKEYS_TASK_JOGGING] = &task_jogging,
		[POKEYS_TASK_THREADING] = &task_threading,
	};

	return kinds[device->image.engine.task];
}

static uint8_t phase_of(const struct device *device)
{
	return device->image.engine.task_phase;
}

static bool tripped(const struct device *device)
{
	const uint8_t state = device->image.engine.state;

	return state == WIRE_ENGINE_STOP_LIMIT || state == WIRE_ENGINE_STOP_EMERGENCY;
}

static void enter(struct device *device, enum pokeys_task_phase phase)
{
	device->image.engine.task_phase = (uint8_t)phase;
	device->task.since_ns = device->now_ns;
	device->task.asked = false;
	device->task.answered = false;
}

static void set_result(struct device *device, uint8_t result)
{
	device->image.engine.task_result = result;
	if (kind_of(device)->scrap && result != POKEYS_TASK_RESULT_NONE &&
	    result != POKEYS_TASK_DONE && result != POKEYS_TASK_CANCELLED)
		safe_permit_drop(device);
}

void task_tell(struct device *device, enum pokeys_outcome outcome)
{
	struct task *task = &device->task;

	if (task->told)
		return;
	task->told = true;
	if (task->session == device->intake.session)
		device_one_shot_outcome(device, task->shot.id, task->shot.operation, outcome);
}

static void end_homing(struct device *device, bool done)
{
	struct pokeys_engine *engine = &device->image.engine;

	if (done) {
		place_homed(device, engine->task_axes);
		return;
	}
	place_not_homed(device, engine->task_axes);
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		if (engine->task_axes >> i & 1)
			engine->axis[i].homed = 0;
}

static void end(struct device *device)
{
	struct pokeys_engine *engine = &device->image.engine;
	const bool done = engine->task_result == POKEYS_TASK_DONE;

	task_tell(device, done ? POKEYS_OUTCOME_DONE : POKEYS_OUTCOME_FAILED);
	if (engine->task == POKEYS_TASK_HOMING)
		end_homing(device, done);
	enter(device, POKEYS_TASK_IDLE);
	if (kind_of(device)->ended)
		kind_of(device)->ended(device);
	engine->task_count++;
	device_say(device, EVENT_TASK, done ? EVENT_NOTICE : EVENT_WARNING, engine->task,
		   engine->task_result, engine->task_axes);
}

void task_stop(struct device *device, uint8_t result)
{
	if (!device->image.engine.task_result)
		set_result(device, result);
	if (kind_of(device)->beside)
		device->task.parked |= device->motion.driven;
	enter(device, POKEYS_TASK_STOPPING);
}

void task_begin(struct device *device, uint8_t kind, const struct pokeys_one_shot *shot)
{
	struct pokeys_engine *engine = &device->image.engine;
	struct task *task = &device->task;
	const uint8_t parked = task->parked;

	engine->task = kind;
	engine->task_axes = shot->mask;
	set_result(device, POKEYS_TASK_RESULT_NONE);
	*task = (struct task){ .shot = *shot, .session = device->intake.session };
	task->parked = parked | shot->mask;
	task->limit_ns = shot->parameter[0] > 0 ? (uint64_t)((double)shot->parameter[0] * 1e9) :
						  kind_of(device)->limit_ns;
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		if (kind == POKEYS_TASK_HOMING && shot->mask >> i & 1)
			engine->axis[i].homed = 0;
	}
	if (kind == POKEYS_TASK_HOMING)
		place_homing(device, shot->mask);
	enter(device, kind_of(device)->beside ? POKEYS_TASK_STARTING : POKEYS_TASK_PREPARING);
}

bool task_may_begin(const struct device *device, bool beside)
{
	return task_idle(device) && !moving_moves_axes(device) &&
	       !(beside && moving_has_axes(device));
}

struct refusal task_why_not(const struct device *device, bool beside,
			    const struct pokeys_one_shot *shot)
{
	const struct refusal why = operation_needs_engine(device, shot);

	if (why.reason)
		return why;
	if (!device->safe.permitted)
		return refusal(REFUSAL_MACHINE_OFF, 0);
	if (!task_may_begin(device, beside))
		return refusal(REFUSAL_BUSY, 0);
	return refusal(task_limit_good(shot->parameter[0]) ? REFUSAL_NONE : REFUSAL_VALUE, 0);
}

bool task_idle(const struct device *device)
{
	return phase_of(device) == POKEYS_TASK_IDLE;
}

static void begin_finishing(struct device *device)
{
	if (kind_of(device)->beside)
		device->task.parked |= device->motion.driven;
	enter(device, POKEYS_TASK_FINISHING);
}

static void complete(struct device *device)
{
	if (!kind_of(device)->waits) {
		begin_finishing(device);
		return;
	}
	set_result(device, POKEYS_TASK_DONE);
	task_tell(device, POKEYS_OUTCOME_DONE);
	enter(device, POKEYS_TASK_COMPLETE);
}

/* It was asked to begin: has it? */
static void update_starting(struct device *device)
{
	const struct task *task = &device->task;
	const uint8_t state = device->image.engine.state;

	if (task->open || device->motion.verify || !task->asked)
		return;
	if (kind_of(device)->begun && !task->answered ? kind_of(device)->begun(device) :
	    kind_of(device)->beside ? task->answered || task_explains(device, state) :
				      kind_of(device)->is_working(state) ||
					      kind_of(device)->is_complete(state))
		enter(device, POKEYS_TASK_WORKING);
	else if (!kind_of(device)->beside && state != WIRE_ENGINE_STOPPED)
		task_stop(device, POKEYS_TASK_FAILED);
}

static void update_working(struct device *device)
{
	const uint8_t state = device->image.engine.state;

	if (device->motion.verify)
		return;
	if (kind_of(device)->is_complete(state))
		complete(device);
	else if (!kind_of(device)->is_working(state))
		task_stop(device, POKEYS_TASK_FAILED);
	else if (kind_of(device)->work)
		kind_of(device)->work(device);
}

/* Nobody has asked it to: it may have been restarted, and then it is not homed. */
static void fall_from_complete(struct device *device)
{
	plan_doubt(device);
	set_result(device, POKEYS_TASK_RESULT_NONE);
	task_stop(device, POKEYS_TASK_FAILED);
}

static void update_complete(struct device *device)
{
	if (!kind_of(device)->is_complete(device->image.engine.state))
		fall_from_complete(device);
	else if (device->task.finish || device->task.shot.flags & POKEYS_HOME_FINISH_ITSELF)
		begin_finishing(device);
}

static void update_finishing(struct device *device)
{
	const struct task *task = &device->task;

	if (task->open || device->motion.verify)
		return;
	if (kind_of(device)->released && task->asked) {
		if (kind_of(device)->released(device)) {
			set_result(device, POKEYS_TASK_DONE);
			end(device);
		}
	} else if (task->answered && kind_of(device)->beside &&
		   device->image.engine.state == WIRE_ENGINE_RUNNING)
		end(device);
	else if (task->answered)
		task_stop(device, POKEYS_TASK_FAILED);
}

static void update_stopping(struct device *device)
{
	if (motion_standing(device) &&
	    (!kind_of(device)->stopped || kind_of(device)->stopped(device)))
		end(device);
}

/* When this phase ends by itself, and as what. */
static void judge_time(struct device *device)
{
	const uint8_t phase = phase_of(device);
	const uint64_t limit_ns[] = {
		[POKEYS_TASK_IDLE] = UINT64_MAX,
		[POKEYS_TASK_PREPARING] = STAND_NS,
		[POKEYS_TASK_STARTING] = REQUEST_NS,
		[POKEYS_TASK_WORKING] = device->task.limit_ns,
		[POKEYS_TASK_COMPLETE] = COMPLETE_NS,
		[POKEYS_TASK_FINISHING] = kind_of(device)->finish_ns ? kind_of(device)->finish_ns :
								       REQUEST_NS,
		[POKEYS_TASK_STOPPING] = STAND_NS,
	};

	if (device->now_ns - device->task.since_ns < limit_ns[phase])
		return;
	if (phase == POKEYS_TASK_COMPLETE) {
		begin_finishing(device);
		return;
	}
	if (phase != POKEYS_TASK_STOPPING) {
		task_stop(device, POKEYS_TASK_TIMED_OUT);
		return;
	}
	/* motion.c goes on stopping it, but nobody has to wait any more */
	if (device->image.engine.task_result != POKEYS_TASK_DONE)
		set_result(device, POKEYS_TASK_TIMED_OUT);
	end(device);
}

static void update_phase(struct device *device)
{
	switch ((enum pokeys_task_phase)phase_of(device)) {
	case POKEYS_TASK_STARTING:
		update_starting(device);
		break;
	case POKEYS_TASK_WORKING:
		update_working(device);
		break;
	case POKEYS_TASK_COMPLETE:
		update_complete(device);
		break;
	case POKEYS_TASK_FINISHING:
		update_finishing(device);
		break;
	case POKEYS_TASK_STOPPING:
		update_stopping(device);
		break;
	case POKEYS_TASK_IDLE:
	case POKEYS_TASK_PREPARING:
		break;
	}
}

static bool meets(const struct device *device, unsigned int i)
{
	const struct axis_wish *wish = &device->intake.axis[i];
	const int64_t apart = (int64_t)wish->position - device->image.engine.axis[i].position;

	if (!wish->good || device->motion.verify)
		return false;
	if (wish->mode == POKEYS_AXIS_VELOCITY)
		return wish->velocity == 0;
	return apart >= -MEETS && apart <= MEETS;
}

static void unpark(struct device *device)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		if (!device->intake.axis[i].enable || (task_idle(device) && meets(device, i)))
			device->task.parked &= (uint8_t)~(1u << i);
		device->image.engine.axis[i].parked = device->task.parked >> i & 1;
	}
}

void task_update(struct device *device)
{
	const uint8_t phase = phase_of(device);

	if (phase != POKEYS_TASK_IDLE) {
		if (!device->safe.permitted && phase != POKEYS_TASK_STOPPING)
			task_stop(device,
				  tripped(device) ? POKEYS_TASK_TRIPPED : POKEYS_TASK_CANCELLED);
		update_phase(device);
		judge_time(device);
	}
	unpark(device);
}

void task_cancel(struct device *device)
{
	if (!task_idle(device) && phase_of(device) != POKEYS_TASK_STOPPING)
		task_stop(device, POKEYS_TASK_CANCELLED);
}

bool task_finish(struct device *device)
{
	if (phase_of(device) == POKEYS_TASK_COMPLETE) {
		device->task.finish = true;
		return true;
	}
	if (kind_of(device)->endless && phase_of(device) == POKEYS_TASK_WORKING) {
		task_stop(device, POKEYS_TASK_DONE);
		return true;
	}
	if (phase_of(device) != POKEYS_TASK_WORKING || !kind_of(device)->beside)
		return false;
	enter(device, POKEYS_TASK_FINISHING);
	return true;
}

void task_lost(struct device *device)
{
	if (task_idle(device))
		return;
	if (!device->image.engine.task_result)
		set_result(device, POKEYS_TASK_LOST);
	device->task.open = false;
	task_tell(device, POKEYS_OUTCOME_UNKNOWN);
	end(device);
}

bool task_wants_stand(const struct device *device)
{
	return phase_of(device) == POKEYS_TASK_PREPARING ||
	       phase_of(device) == POKEYS_TASK_STOPPING;
}

uint8_t task_powers(const struct device *device)
{
	return phase_of(device) == POKEYS_TASK_PREPARING ? device->task.shot.mask : 0;
}

void task_powered(struct device *device, uint8_t axes)
{
	if (phase_of(device) == POKEYS_TASK_PREPARING && axes)
		device->task.powered = true;
}

bool task_take_engine(struct device *device)
{
	if (phase_of(device) != POKEYS_TASK_PREPARING)
		return false;
	enter(device, POKEYS_TASK_STARTING);
	return true;
}

bool task_explains(const struct device *device, uint8_t state)
{
	return !task_idle(device) && device->image.engine.task == POKEYS_TASK_HYBRID_PROBING &&
	       (state == WIRE_ENGINE_HYBRID_STOPPING || state == WIRE_ENGINE_HYBRID_COMPLETE);
}

static struct device *ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, uint64_t now_ns)
{
	struct device *device = device_of(mailbox);

	device->now_ns = now_ns;
	device->task.open = false;
	device->task.answered = answered(entry);
	motion_displaced(device);
	place_moves(device);
	return device;
}

static void started(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
		    uint64_t now_ns)
{
	(void)context;
	ended(mailbox, entry, now_ns);
}

static void finished(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
		     uint64_t now_ns)
{
	struct device *device = ended(mailbox, entry, now_ns);

	(void)context;
	if (answered(entry) && !device->image.engine.task_result)
		set_result(device, kind_of(device)->take(device, entry));
}

static bool start_due(const struct device *device)
{
	if (phase_of(device) != POKEYS_TASK_STARTING || device->motion.verify)
		return false;
	return device->image.engine.state ==
	       (kind_of(device)->beside ? WIRE_ENGINE_RUNNING : WIRE_ENGINE_STOPPED);
}

/* Either may be said again, and is until it was heard or its time is over. */
bool task_send(struct device *device)
{
	struct task *task = &device->task;

	if (task->open || task->answered)
		return false;
	if (start_due(device))
		task->open = kind_of(device)->start(device, started);
	else if (phase_of(device) == POKEYS_TASK_FINISHING)
		task->open = kind_of(device)->finish(device, finished);
	task->asked |= task->open;
	return task->open;
}
