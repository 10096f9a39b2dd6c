// SPDX-License-Identifier: GPL-2.0-or-later
/* Print the servo motors as text and as JSON. A device without any prints none as text. */
#include <math.h>
#include <pokeys/names.h>
#include "settings/line.h"
#include "tools/print.h"

double print_rounded(double value, unsigned int digits)
{
	const double per = pow(10, digits);

	return round(value * per) / per + 0.0;
}

static void put_work(struct line *line, const struct pokeys_servo *servo)
{
	char why[PRINT_OBSTACLE_MAX];

	if (servo->state == POKEYS_SERVO_ENABLED)
		put(line, ", enabled, error %.4f, output %.0f %%",
		    print_rounded((double)servo->error, 4),
		    print_rounded((double)servo->output * 100, 0));
	else if (servo->fault)
		put(line, ", FAULT: %s, off until it is reset%s",
		    pokeys_servo_fault_name(servo->fault),
		    servo->condition == servo->fault ? print_obstacle(servo->obstacle, why) : "");
	else
		put(line, ", off");
	if (servo->state == POKEYS_SERVO_STOPPING)
		put(line, ", NOT ACKNOWLEDGED: it may still run");
}

/* Append why it cannot be enabled, and where it is. */
static void put_rest(struct line *line, const struct pokeys_servo *servo)
{
	char why[PRINT_OBSTACLE_MAX];

	if (servo->condition && servo->condition != servo->fault)
		put(line, ", NOT READY: %s%s", pokeys_servo_fault_name(servo->condition),
		    print_obstacle(servo->obstacle, why));
	if (servo->refused)
		put(line, ", not enabled: %s", pokeys_servo_refusal_name(servo->refused));
	if (servo->tuning == POKEYS_SERVO_TUNING_RUNS)
		put(line, ", searching for its gains");
	if (servo->homing)
		put(line, ", homing: %s", pokeys_servo_homing_name(servo->homing));
	if (servo->homed)
		put(line, ", homed");
	else if (servo->home_end > POKEYS_SERVO_HOME_DONE)
		put(line, ", NOT HOMED: %s", pokeys_servo_home_end_name(servo->home_end));
	if (servo->low)
		put(line, ", at the limit switch of the lower end");
	if (servo->high)
		put(line, ", at the limit switch of the upper end");
}

const char *print_servo(const struct pokeys_servo *servo, char text[PRINT_SERVO_MAX])
{
	struct line line = { .text = text, .size = PRINT_SERVO_MAX };
	char name[32];

	put(&line, "%s: at %.4f", print_clean(servo->name, sizeof(servo->name), name),
	    print_rounded(servo->position, 4));
	put_work(&line, servo);
	put_rest(&line, servo);
	return text;
}

const char *print_moves(const struct pokeys_moves *moves, char text[PRINT_SERVO_MAX])
{
	struct line line = { .text = text, .size = PRINT_SERVO_MAX };

	put(&line, "%s, %u waiting, %.2f units/s", pokeys_moves_state_name(moves->state),
	    moves->waiting, (double)moves->speed);
	if (moves->held)
		put(&line, ", held");
	if (fabs((double)moves->feed - 1) > 1e-6)
		put(&line, ", feed %.0f %%", (double)moves->feed * 100);
	return text;
}

bool print_has_servo(const struct pokeys_state *state, unsigned int servo)
{
	return state->servo[servo].state != POKEYS_SERVO_NONE;
}

void print_servos(const struct pokeys_state *state, FILE *to)
{
	char text[PRINT_SERVO_MAX];

	for (unsigned int i = 0; i < POKEYS_SERVOS; i++)
		if (print_has_servo(state, i))
			fprintf(to, "  servo %u     %s\n", i, print_servo(&state->servo[i], text));
	if (state->moves.state)
		fprintf(to, "  moves       %s\n", print_moves(&state->moves, text));
}

static void put_gains(struct json *json, const struct pokeys_servo *servo)
{
	json_object(json, "gains");
	json_real(json, "p", (double)servo->p);
	json_real(json, "i", (double)servo->i);
	json_real(json, "d", (double)servo->d);
	json_real(json, "velocity", (double)servo->velocity_gain);
	json_real(json, "acceleration", (double)servo->acceleration_gain);
	json_end(json);
}

static void put_tuned(struct json *json, const struct pokeys_servo *servo)
{
	json_object(json, "tuned");
	json_real(json, "p", (double)servo->tuned_p);
	json_real(json, "i", (double)servo->tuned_i);
	json_real(json, "d", (double)servo->tuned_d);
	json_real(json, "velocity", (double)servo->tuned_velocity_gain);
	json_real(json, "acceleration", (double)servo->tuned_acceleration_gain);
	json_real(json, "max_acceleration", (double)servo->tuned_acceleration);
	json_end(json);
}

static void put_servo(struct json *json, unsigned int index, const struct pokeys_servo *servo)
{
	char name[32];

	json_object(json, NULL);
	json_unsigned(json, "index", index);
	json_text(json, "name", print_clean(servo->name, sizeof(servo->name), name));
	json_text(json, "state", pokeys_servo_state_name(servo->state));
	json_real(json, "position", servo->position);
	json_real(json, "velocity", (double)servo->velocity);
	json_real(json, "commanded", servo->commanded);
	json_real(json, "commanded_velocity", (double)servo->commanded_velocity);
	json_real(json, "error", (double)servo->error);
	json_real(json, "output", (double)servo->output);
	json_text(json, "fault", pokeys_servo_fault_name(servo->fault));
	json_text(json, "condition", pokeys_servo_fault_name(servo->condition));
	json_text(json, "obstacle", pokeys_obstacle_name(servo->obstacle));
	json_text(json, "refused", pokeys_servo_refusal_name(servo->refused));
	json_unsigned(json, "faults", servo->fault_count);
	json_bool(json, "homed", servo->homed);
	json_bool(json, "limit_minus", servo->low);
	json_bool(json, "limit_plus", servo->high);
	json_text(json, "homing", pokeys_servo_homing_name(servo->homing));
	json_text(json, "home_end", pokeys_servo_home_end_name(servo->home_end));
	json_bool(json, "home_switch", servo->home);
	json_unsigned(json, "encoder", servo->encoder);
	json_real(json, "counts_per_unit", servo->counts_per_unit);
	json_real(json, "min_position", (double)servo->minimum);
	json_real(json, "max_position", (double)servo->maximum);
	json_real(json, "max_speed", (double)servo->max_speed);
	json_real(json, "max_acceleration", (double)servo->max_acceleration);
	json_text(json, "tuning", pokeys_servo_tuning_name(servo->tuning));
	json_text(json, "tune_reason", pokeys_servo_tune_reason_name(servo->tune_reason));
	put_gains(json, servo);
	put_tuned(json, servo);
	json_end(json);
}

void print_json_servos(struct json *json, const struct pokeys_state *state)
{
	const struct pokeys_moves *moves = &state->moves;

	json_array(json, "servos");
	for (unsigned int i = 0; i < POKEYS_SERVOS; i++)
		if (print_has_servo(state, i))
			put_servo(json, i, &state->servo[i]);
	json_end(json);
	json_object(json, "moves");
	json_text(json, "state", pokeys_moves_state_name(moves->state));
	json_unsigned(json, "waiting", moves->waiting);
	json_unsigned(json, "taken", moves->taken);
	json_real(json, "speed", (double)moves->speed);
	json_real(json, "feed", (double)moves->feed);
	json_bool(json, "on_hold", moves->held);
	json_text(json, "end", pokeys_moves_end_name(moves->end));
	json_text(json, "refused", pokeys_moves_refusal_name(moves->refused));
	json_unsigned(json, "motors", moves->motors);
	json_unsigned(json, "axes", moves->axes);
	json_end(json);
}
