/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A conversation between two programs that poll each other: the homing module
 * sets AxesCommand and waits for AxesState to become what it expects. Each
 * command is a one-shot here, and the state it waits for is shown only when
 * the one-shot has ended well. One that was refused shows 20 (error), upon
 * which the homing module gives up; it would wait for ever otherwise.
 *
 * Axes of one home-sequence are homed by one request, because the device
 * numbers the axes of a request, not the requests; who gets the command in the
 * same period goes into the same mask. Who gets it later waits until that
 * group is finalized or cancelled: the device has one homing at a time.
 *
 * While an axis is being homed its joint's command is not sent: motion lets
 * it follow the feedback meanwhile, and a reference would end the homing. That
 * holds while data are stale as well; new commands wait until they are fresh.
 */
#include "halbridge/legacy_home.h"
#include <math.h>
#include "halbridge/exchange.h"

enum {
	STATE_READY_TO_FINALIZE = 3,
	STATE_READY_TO_ARM = 4,
	STATE_DEVICE_HOME = 10,
	STATE_ARMING = 17,
	STATE_WAIT = 18,
	STATE_FINAL = 19,
	STATE_ERROR = 20
};

uint32_t legacy_home_state(const struct legacy_home *home, const struct pokeys_axis *axis)
{
	switch ((enum legacy_home_phase)home->phase) {
	case LEGACY_PHASE_HOMING:
		return axis->state == STATE_DEVICE_HOME ? STATE_READY_TO_FINALIZE : axis->state;
	case LEGACY_PHASE_FINISHING:
		return STATE_READY_TO_FINALIZE;
	case LEGACY_PHASE_FINISHED:
		return STATE_READY_TO_ARM;
	case LEGACY_PHASE_ARMING:
		return STATE_ARMING;
	case LEGACY_PHASE_ARMED:
		return STATE_WAIT;
	case LEGACY_PHASE_MOVING:
		return STATE_FINAL;
	case LEGACY_PHASE_FAILED:
		return STATE_ERROR;
	case LEGACY_PHASE_IDLE:
		break;
	}
	return axis->state;
}

uint32_t legacy_home_status(const struct legacy_home *home)
{
	static const uint8_t status[] = {
		[LEGACY_PHASE_IDLE] = LEGACY_HOME_IDLE,
		[LEGACY_PHASE_HOMING] = LEGACY_HOME_START,
		[LEGACY_PHASE_FINISHING] = LEGACY_HOME_FINALIZE,
		[LEGACY_PHASE_FINISHED] = LEGACY_HOME_FINALIZE,
		[LEGACY_PHASE_ARMING] = LEGACY_HOME_ARM,
		[LEGACY_PHASE_ARMED] = LEGACY_HOME_WAIT,
		[LEGACY_PHASE_MOVING] = LEGACY_HOME_FINAL,
		[LEGACY_PHASE_FAILED] = LEGACY_HOME_CANCEL,
	};

	return status[home->phase];
}

/*
 * The one-shot of this phase has ended. A position that is known not to have been set
 * is set again, because AxesCommand still stands there: a lost packet is no reason to
 * give a good homing up.
 */
static void settle(struct legacy_home *home, struct legacy_axis *value, enum pokeys_outcome outcome)
{
	home->open = false;
	if (outcome == POKEYS_OUTCOME_FAILED && home->phase == LEGACY_PHASE_ARMING) {
		home->phase = LEGACY_PHASE_FINISHED;
		home->command = LEGACY_HOME_FINALIZE;
	} else if (outcome != POKEYS_OUTCOME_DONE) {
		home->phase = LEGACY_PHASE_FAILED;
	} else if (home->phase == LEGACY_PHASE_FINISHING) {
		home->phase = LEGACY_PHASE_FINISHED;
	} else if (home->phase == LEGACY_PHASE_ARMING) {
		home->phase = LEGACY_PHASE_ARMED;
		value->index_enable = false;
	}
}

void legacy_home_read(struct exchange *exchange, struct values *values)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		struct legacy_home *home = &exchange->legacy.home[i];
		const struct pokeys_axis *axis = &exchange->state->engine.axis[i];
		enum pokeys_outcome outcome = POKEYS_OUTCOME_UNKNOWN; /* another daemon */

		if (home->open && home->session == exchange->queue.session)
			outcome = one_shot_outcome(&exchange->queue, exchange->state, home->id);
		if (home->open && outcome != POKEYS_OUTCOME_NONE)
			settle(home, &values->legacy.axis[i], outcome);
		if (home->phase == LEGACY_PHASE_MOVING &&
		    axis->position == values->legacy.axis_set[i].home_position)
			home->phase = LEGACY_PHASE_IDLE;
	}
}

/* May this command begin in this phase? */
static bool permitted(const struct legacy_home *home, uint32_t command)
{
	switch (command) {
	case LEGACY_HOME_START:
		return home->phase == LEGACY_PHASE_IDLE || home->phase == LEGACY_PHASE_FAILED;
	case LEGACY_HOME_FINALIZE:
		return home->phase == LEGACY_PHASE_HOMING && !home->open;
	case LEGACY_HOME_ARM:
		return home->phase == LEGACY_PHASE_FINISHED;
	case LEGACY_HOME_CANCEL:
		return home->phase != LEGACY_PHASE_IDLE;
	default:
		return false;
	}
}

struct step {
	uint8_t operation, phase;
	bool open; /* the phase waits for the outcome */
};

static const struct step steps[] = {
	[LEGACY_HOME_START] = { POKEYS_ONE_SHOT_HOME, LEGACY_PHASE_HOMING, true },
	[LEGACY_HOME_ARM] = { POKEYS_ONE_SHOT_SET_POSITION, LEGACY_PHASE_ARMING, true },
	[LEGACY_HOME_CANCEL] = { POKEYS_ONE_SHOT_HOME_CANCEL, LEGACY_PHASE_IDLE, false },
	[LEGACY_HOME_FINALIZE] = { POKEYS_ONE_SHOT_HOME_FINISH, LEGACY_PHASE_FINISHING, true },
};

/* One axis more, if it has got this command and nothing speaks against it. */
static void add_axis(struct exchange *exchange, const struct values *values, unsigned int i,
		     uint32_t command, struct pokeys_one_shot *shot)
{
	const struct legacy_axis_settings *set = &values->legacy.axis_set[i];

	if (values->legacy.axis[i].command != command ||
	    exchange->legacy.home[i].command == command ||
	    !permitted(&exchange->legacy.home[i], command))
		return;
	shot->mask |= (uint8_t)(1u << i);
	if (command == LEGACY_HOME_START)
		shot->value[i] = (int32_t)set->home_offsets;
	else if (command == LEGACY_HOME_ARM)
		shot->value[i] = set->zero_position;
}

static void begin(struct exchange *exchange, const struct pokeys_one_shot *shot, uint32_t command,
		  uint32_t id)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		if (shot->mask >> i & 1)
			exchange->legacy.home[i] = (struct legacy_home){
				.phase = steps[command].phase,
				.open = steps[command].open,
				.id = id,
				.session = exchange->queue.session,
				.command = command,
			};
	}
}

static bool same_sequence(const struct values *values, unsigned int a, unsigned int b)
{
	int64_t first = values->legacy.axis_set[a].sequence;
	int64_t second = values->legacy.axis_set[b].sequence;

	return first == second || first == -second;
}

/* The device homes one group at a time; until it is finalized another has to wait. */
static bool another_is_homed(const struct exchange *exchange)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		uint8_t phase = exchange->legacy.home[i].phase;

		if (phase == LEGACY_PHASE_HOMING || phase == LEGACY_PHASE_FINISHING)
			return true;
	}
	return false;
}

/* All axes of one sequence that have got this command; `from` is the first of them. */
static void obey_group(struct exchange *exchange, const struct values *values, unsigned int from,
		       uint32_t command)
{
	struct pokeys_one_shot shot = { .operation = steps[command].operation };
	uint32_t id;

	/* the command stands there still when that one has ended */
	if (command == LEGACY_HOME_START && another_is_homed(exchange))
		return;
	for (unsigned int i = from; i < POKEYS_AXES; i++) {
		if (same_sequence(values, from, i))
			add_axis(exchange, values, i, command, &shot);
	}
	/* a full ring: the command stands there still in the next period */
	if (shot.mask && legacy_ask(exchange, &shot, &id))
		begin(exchange, &shot, command, id);
}

/* Commands that need nobody else. */
static void obey_alone(struct legacy_home *home, uint32_t command)
{
	if (command == home->command)
		return;
	if (command == LEGACY_HOME_IDLE)
		home->phase = LEGACY_PHASE_IDLE;
	else if (command == LEGACY_HOME_FINAL && home->phase == LEGACY_PHASE_ARMED)
		home->phase = LEGACY_PHASE_MOVING;
	else if (command != LEGACY_HOME_WAIT)
		return;
	home->open = home->open && command != LEGACY_HOME_IDLE;
	home->command = command;
}

/* Over what the joint has made: nothing while homing, HomePosition in the final move. */
static void drive(struct exchange *exchange, const struct values *values, unsigned int i)
{
	struct pokeys_axis_command *command = &exchange->command.axis[i];
	const struct legacy_home *home = &exchange->legacy.home[i];
	double speed = fabs(values->legacy.axis[i].final_velocity * exchange->joint[i].scale);

	if (home->phase == LEGACY_PHASE_IDLE || home->phase == LEGACY_PHASE_FAILED)
		return;
	if (home->phase != LEGACY_PHASE_MOVING) {
		command->mode = POKEYS_AXIS_OFF;
		return;
	}
	command->position = values->legacy.axis_set[i].home_position;
	command->velocity = speed <= 1e7 ? (float)speed : 0;
}

/* No axis has a new command, and none is on its way. */
static bool is_idle(const struct exchange *exchange, const struct values *values)
{
	bool idle = true;

	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		const struct legacy_home *home = &exchange->legacy.home[i];

		idle &= home->phase == LEGACY_PHASE_IDLE &&
			values->legacy.axis[i].command == home->command;
	}
	return idle;
}

void legacy_home_write(struct exchange *exchange, struct values *values)
{
	static const uint8_t commands[] = {
		LEGACY_HOME_CANCEL,
		LEGACY_HOME_START,
		LEGACY_HOME_FINALIZE,
		LEGACY_HOME_ARM,
	};

	if (is_idle(exchange, values))
		return;
	for (unsigned int i = 0; i < POKEYS_AXES && exchange->fresh; i++) {
		for (size_t k = 0; k < sizeof(commands); k++)
			obey_group(exchange, values, i, commands[k]);
		obey_alone(&exchange->legacy.home[i], values->legacy.axis[i].command);
	}
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		drive(exchange, values, i);
}
