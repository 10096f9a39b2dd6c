// SPDX-License-Identifier: GPL-2.0-or-later
/* A servo motor of a program that commands it: off, enabled, commanded, and off again. */
#include "tools/servo_run.h"
#include <pokeys/names.h>
#include "tools/print.h"

const struct pokeys_servo *servo_run_of(const struct loop_run *run)
{
	return &run->state.servo[run->index];
}

bool servo_run_is_enabled(const struct loop_run *run)
{
	return servo_run_of(run)->state == POKEYS_SERVO_ENABLED;
}

static bool is_off(const struct loop_run *run)
{
	return servo_run_of(run)->state == POKEYS_SERVO_OFF ||
	       servo_run_of(run)->state == POKEYS_SERVO_FAULT;
}

static bool is_decided(const struct loop_run *run)
{
	return servo_run_is_enabled(run) || servo_run_of(run)->refused || servo_run_of(run)->fault;
}

void servo_run_want(struct loop_run *run, bool enable, double position, double velocity)
{
	struct pokeys_servo_command *servo = &run->command.servo[run->index];

	servo->enable = enable;
	servo->position = position;
	servo->velocity = (float)velocity;
	run->command.t_thread_ns = run->fresh_ms * 1000000;
	pokeys_client_command(run->client, &run->command);
}

bool servo_run_begin(struct loop_run *run)
{
	servo_run_want(run, false, servo_run_of(run)->position, 0);
	if (!loop_is_ready(run))
		return false;
	servo_run_want(run, true, servo_run_of(run)->position, 0);
	if (!loop_await(run, "the daemon does not enable the motor", is_decided))
		return false;
	return servo_run_is_enabled(run) || loop_explain(run);
}

bool servo_run_finish(struct loop_run *run)
{
	loop_end_line(run);
	servo_run_want(run, false, servo_run_of(run)->position, 0);
	return loop_await(run, "the daemon does not confirm that it is off", is_off);
}

static struct loop_trouble trouble(const struct pokeys_state *state, unsigned int index)
{
	const struct pokeys_servo *servo = &state->servo[index];

	return (struct loop_trouble){
		.fault = servo->fault ? pokeys_servo_fault_name(servo->fault) : NULL,
		.condition = servo->condition ? pokeys_servo_fault_name(servo->condition) : NULL,
		.obstacle = servo->obstacle,
		.refusal = servo->refused ? pokeys_servo_refusal_name(servo->refused) : NULL,
	};
}

static const char *name(const struct pokeys_state *state, unsigned int index)
{
	return state->servo[index].name;
}

static void csv_line(FILE *to, const struct pokeys_state *state, unsigned int index)
{
	const struct pokeys_servo *servo = &state->servo[index];

	fprintf(to, "%.6f,%.6f,%.6f,%.4f,%.4f,%.5f\n", servo->commanded, servo->position,
		(double)servo->error, (double)servo->commanded_velocity, (double)servo->velocity,
		(double)servo->output);
}

const struct loop_kind servo_run_kind = {
	.word = "servo",
	.most = POKEYS_SERVOS,
	.turn_ms = 1,
	.gains = POKEYS_GAINS,
	.gain_most = 1e6,
	.lapsed = "this program was suspended, or pokeysd was away; the motor was switched off",
	.silent = "the device or pokeysd does not answer any more; the daemon or the device's "
		  "failsafe switches the motor off",
	.is_there = print_has_servo,
	.name = name,
	.trouble = trouble,
	.csv_head = "commanded,position,error,commanded_velocity,velocity,output",
	.csv_line = csv_line,
};
