/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Positions go into the command image unchanged, and the daemon judges them. A position that is not
 * a number is a fault of an enabled motor. A speed of 0 is passed on as "not known", so that
 * pos-cmd alone is enough; the daemon then finds the speed from the positions.
 *
 * `fault` is for amp-fault-in: whatever keeps a motor that is to be enabled from following is one,
 * also a daemon that is gone or an enable that it has refused.
 */
#include "halbridge/servos.h"
#include <math.h>
#include <stddef.h>
#include <string.h>

#define OFFSET(number, member)	\
	(offsetof(struct values, servo) + (number) * sizeof(struct value_servo) +	\
	 offsetof(struct value_servo, member))

/* What others set meanwhile, the gains, comes after these. */
#define PINS	offsetof(struct value_servo, gain)

void servos_init(struct servos *servos)
{
	memset(servos, 0, sizeof(*servos));
	servos->busy = (UINT32_C(1) << POKEYS_SERVOS) - 1; /* their pins are looked at once */
	for (unsigned int i = 0; i < POKEYS_SERVOS; i++)
		gains_init(&servos->gains[i], POKEYS_ONE_SHOT_SERVO_GAIN, i, POKEYS_GAINS);
}

/* True if a pin has changed. */
static bool show(struct value_servo *value, const struct pokeys_servo *servo, bool alive, bool held)
{
	struct value_servo now;

	memcpy(&now, value, PINS);
	now.enabled = alive && (servo->state == POKEYS_SERVO_ENABLED ||
				servo->state == POKEYS_SERVO_STOPPING);
	now.homing = alive && servo->homing;
	now.fault = servo->fault || (value->enable && (!alive || held || servo->refused));
	if (alive) {
		now.pos_fb = servo->position;
		now.vel_fb = (double)servo->velocity;
		now.error = (double)servo->error;
		now.output = (double)servo->output;
		now.fault_code = servo->fault;
		now.condition = servo->condition;
		now.refused = servo->refused;
		now.homed = servo->homed;
		now.home_end = servo->home_end;
		now.limit_minus = servo->low;
		now.limit_plus = servo->high;
	}
	if (!memcmp(&now, value, PINS))
		return false;
	memcpy(value, &now, PINS);
	return true;
}

static void read_gains(struct gains *gains, struct value_servo *value,
		       const struct pokeys_servo *servo, const struct one_shot_queue *queue,
		       const struct pokeys_state *state)
{
	const float have[POKEYS_GAINS] = {
		servo->p, servo->i, servo->d, servo->velocity_gain, servo->acceleration_gain,
	};

	gains_read(gains, value->gain, have, queue, state);
}

/* Nobody moves these. True if a pin has changed. */
static bool show_none(struct values *values, uint32_t motors)
{
	uint32_t wrong = 0;

	for (unsigned int i = 0; i < POKEYS_SERVOS; i++) {
		const struct value_servo *value = &values->servo[i];

		wrong |= (uint32_t)(value->enabled | value->homing | (value->fault ^ value->enable))
			 << i;
	}
	wrong &= motors;
	for (uint32_t left = wrong; left; left &= left - 1) {
		struct value_servo *value = &values->servo[__builtin_ctz(left)];

		value->enabled = value->homing = false;
		value->fault = value->enable;
	}
	return wrong;
}

void servos_alone(struct values *values)
{
	if (show_none(values, UINT32_MAX))
		values_changed(values, BLOCK_SERVO);
}

void servos_read(struct servos *servos, struct values *values, const struct one_shot_queue *queue,
		 const struct pokeys_state *state, bool alive)
{
	bool changed = !servos->begun;
	uint32_t there = 0;

	for (unsigned int i = 0; i < POKEYS_SERVOS; i++)
		there |= (uint32_t)(state->servo[i].state != POKEYS_SERVO_NONE) << i;
	for (uint32_t left = servos->busy; left; left &= left - 1) {
		const unsigned int i = (unsigned int)__builtin_ctz(left);

		values->one_shot_failed_count += press_read(&servos->reset[i], queue, state);
		values->one_shot_failed_count += press_read(&servos->home[i], queue, state);
	}
	/* those that are gone are shown once more */
	changed |= show_none(values, ~(there | servos->there));
	for (uint32_t left = there | servos->there; left; left &= left - 1) {
		const unsigned int i = (unsigned int)__builtin_ctz(left);

		changed |= show(&values->servo[i], &state->servo[i], alive, servos->held[i]);
		if (alive)
			read_gains(&servos->gains[i], &values->servo[i], &state->servo[i], queue,
				   state);
	}
	servos->begun |= alive;
	servos->there = there;
	if (changed)
		values_changed(values, BLOCK_SERVO);
}

static void write_motor(struct servos *servos, unsigned int i, const struct value_servo *value,
			bool read, struct pokeys_command *command, struct refusals *refusals)
{
	const bool there = servos->there >> i & 1;
	const bool bad = !isfinite(value->pos_cmd) || !isfinite(value->vel_cmd);

	refusal_mark(refusals, &servos->bad[i], bad, OFFSET(i, pos_cmd), REFUSAL_POSITION,
		     value->pos_cmd);
	refusal_mark(refusals, &servos->absent[i], servos->begun && !there && value->enable,
		     OFFSET(i, enable), REFUSAL_NO_SERVO, 1);
	command->servo[i].position = bad ? (double)NAN : value->pos_cmd;
	command->servo[i].velocity = bad || value->vel_cmd == 0 ? NAN : (float)value->vel_cmd;
	servos->held[i] = value->enable && (servos->held[i] || !there || !read);
	command->servo[i].enable = value->enable && !servos->held[i];
}

/* A button. True if the queue was full. */
static bool write_press(struct press *press, bool pin, enum pokeys_one_shot_operation operation,
			unsigned int i, struct values *values, struct one_shot_queue *queue,
			struct pokeys_command *command, bool fresh)
{
	const struct pokeys_one_shot shot = {
		.operation = (uint8_t)operation,
		.index = (uint8_t)i,
	};
	const struct press_news news = press_write(press, pin, fresh ? &shot : NULL, queue,
						   command);

	values->one_shot_failed_count += news.failed;
	return news.full;
}

/* True if the queue was full. */
static bool write_servo(struct servos *servos, unsigned int i, struct values *values,
			struct one_shot_queue *queue, struct pokeys_command *command, bool fresh,
			bool read, struct refusals *refusals)
{
	bool full = write_press(&servos->reset[i], values->servo[i].reset,
				POKEYS_ONE_SHOT_SERVO_RESET, i, values, queue, command, fresh);

	full |= write_press(&servos->home[i], values->servo[i].home, POKEYS_ONE_SHOT_SERVO_HOME, i,
			    values, queue, command, fresh);
	write_motor(servos, i, &values->servo[i], read, command, refusals);
	return full | (fresh && servos->there >> i & 1 &&
		       gains_write(&servos->gains[i], values->servo[i].gain, OFFSET(i, gain), queue,
				   command, refusals));
}

static uint32_t is_busy(const struct servos *servos, unsigned int i)
{
	return !press_rests(&servos->reset[i]) || !press_rests(&servos->home[i]) ||
	       servos->bad[i] || servos->absent[i] || servos->held[i];
}

/* Most machines have no servo motors, and pay for none. */
static uint32_t wanted(const struct servos *servos, const struct values *values)
{
	uint32_t motors = servos->there | servos->busy;

	for (unsigned int i = 0; i < POKEYS_SERVOS; i++)
		motors |= (uint32_t)(values->servo[i].enable | values->servo[i].reset |
				     values->servo[i].home)
			  << i;
	return motors;
}

bool servos_write(struct servos *servos, struct values *values, struct one_shot_queue *queue,
		  struct pokeys_command *command, bool fresh, bool read, struct refusals *refusals)
{
	bool full = false;

	for (unsigned int i = 0; i < POKEYS_SERVOS; i++)
		command->servo[i].enable = 0;
	for (uint32_t left = wanted(servos, values); left; left &= left - 1) {
		const unsigned int i = (unsigned int)__builtin_ctz(left);

		full |= write_servo(servos, i, values, queue, command, fresh, read, refusals);
		servos->busy = (servos->busy & ~(UINT32_C(1) << i)) | is_busy(servos, i) << i;
	}
	return full;
}

void servos_forget(struct servos *servos, struct values *values)
{
	for (unsigned int i = 0; i < POKEYS_SERVOS; i++) {
		values->one_shot_failed_count += press_forget(&servos->reset[i]);
		values->one_shot_failed_count += press_forget(&servos->home[i]);
		gains_forget(&servos->gains[i]);
	}
	servos->begun = false;
}
