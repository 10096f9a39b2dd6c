// SPDX-License-Identifier: GPL-2.0-or-later
/* Print the heaters as text and as JSON. A device without heaters prints none as text. */
#include <math.h>
#include <pokeys/names.h>
#include "settings/line.h"
#include "tools/print.h"

const char *print_obstacle(uint8_t obstacle, char text[PRINT_OBSTACLE_MAX])
{
	if (!obstacle)
		return "";
	snprintf(text, PRINT_OBSTACLE_MAX, " (%s)", pokeys_obstacle_name(obstacle));
	return text;
}

static void put_work(struct line *line, const struct pokeys_heater *heater)
{
	const double power = (double)heater->power * 100;
	char why[PRINT_OBSTACLE_MAX];

	if (heater->state == POKEYS_HEATER_TUNING)
		put(line, ", searching for gains at %.1f C, oscillation %u, power %.0f %%",
		    (double)heater->target, heater->tune_cycles, power);
	else if (heater->state == POKEYS_HEATER_HEATING)
		put(line, ", target %.1f C, power %.0f %%%s%s", (double)heater->target, power,
		    heater->limited ? " (limited)" : "",
		    heater->at_temperature ? ", at temperature" : "");
	else if (heater->fault)
		put(line, ", FAULT: %s, off until it is reset%s",
		    pokeys_heater_fault_name(heater->fault),
		    heater->condition == heater->fault ? print_obstacle(heater->obstacle, why) :
							 "");
	else
		put(line, ", off");
	if (heater->state == POKEYS_HEATER_STOPPING)
		put(line, ", NOT ACKNOWLEDGED: it may still heat");
}

/* Append its fan, why the heater cannot heat, and the gains that were found. */
static void put_rest(struct line *line, const struct pokeys_heater *heater)
{
	char why[PRINT_OBSTACLE_MAX];

	if (heater->fan == POKEYS_HEATER_FAN_ON)
		put(line, ", fan on");
	if (heater->condition && heater->condition != heater->fault)
		put(line, ", NOT READY: %s%s", pokeys_heater_fault_name(heater->condition),
		    print_obstacle(heater->obstacle, why));
	if (heater->refused)
		put(line, ", target refused: %s", pokeys_heater_refusal_name(heater->refused));
	if (heater->tuning == POKEYS_HEATER_TUNING_DONE)
		put(line, ", gains found: pid-p = %.4g, pid-i = %.4g, pid-d = %.4g",
		    (double)heater->tuned_p, (double)heater->tuned_i, (double)heater->tuned_d);
	else if (heater->tuning == POKEYS_HEATER_TUNING_FAILED)
		put(line, ", no gains found");
}

const char *print_heater(const struct pokeys_heater *heater, char text[PRINT_HEATER_MAX])
{
	struct line line = { .text = text, .size = PRINT_HEATER_MAX };
	char name[32];

	put(&line, "%s: ", print_clean(heater->name, sizeof(heater->name), name));
	if (isfinite(heater->temperature))
		put(&line, "%.1f C", (double)heater->temperature);
	else
		put(&line, "temperature unknown");
	put_work(&line, heater);
	put_rest(&line, heater);
	return text;
}

bool print_has_heater(const struct pokeys_state *state, unsigned int heater)
{
	return state->heater[heater].state != POKEYS_HEATER_NONE;
}

void print_heaters(const struct pokeys_state *state, FILE *to)
{
	char text[PRINT_HEATER_MAX];

	for (unsigned int i = 0; i < POKEYS_HEATERS; i++)
		if (print_has_heater(state, i))
			fprintf(to, "  heater %u    %s\n", i,
				print_heater(&state->heater[i], text));
}

static void put_gains(struct json *json, const char *key, float p, float i, float d)
{
	json_object(json, key);
	json_real(json, "p", (double)p);
	json_real(json, "i", (double)i);
	json_real(json, "d", (double)d);
	json_end(json);
}

static void put_heater(struct json *json, unsigned int index, const struct pokeys_heater *heater)
{
	char name[32];

	json_object(json, NULL);
	json_unsigned(json, "index", index);
	json_text(json, "name", print_clean(heater->name, sizeof(heater->name), name));
	json_text(json, "state", pokeys_heater_state_name(heater->state));
	json_real(json, "temperature", (double)heater->temperature);
	json_real(json, "target", (double)heater->target);
	json_real(json, "power", (double)heater->power);
	json_bool(json, "at_temperature", heater->at_temperature);
	json_bool(json, "power_limited", heater->limited);
	json_text(json, "fan", pokeys_heater_fan_name(heater->fan));
	json_text(json, "fault", pokeys_heater_fault_name(heater->fault));
	json_text(json, "condition", pokeys_heater_fault_name(heater->condition));
	json_text(json, "obstacle", pokeys_obstacle_name(heater->obstacle));
	json_text(json, "refused", pokeys_heater_refusal_name(heater->refused));
	json_unsigned(json, "faults", heater->fault_count);
	json_real(json, "min_temperature", (double)heater->minimum);
	json_real(json, "max_temperature", (double)heater->maximum);
	json_real(json, "max_target", (double)heater->target_maximum);
	put_gains(json, "pid", heater->p, heater->i, heater->d);
	json_text(json, "tuning", pokeys_heater_tuning_name(heater->tuning));
	put_gains(json, "tuned", heater->tuned_p, heater->tuned_i, heater->tuned_d);
	json_end(json);
}

void print_json_heaters(struct json *json, const struct pokeys_state *state)
{
	json_array(json, "heaters");
	for (unsigned int i = 0; i < POKEYS_HEATERS; i++)
		if (print_has_heater(state, i))
			put_heater(json, i, &state->heater[i]);
	json_end(json);
}
