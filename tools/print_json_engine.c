// SPDX-License-Identifier: GPL-2.0-or-later
/* The pulse engine for scripts: its axes, their PoStep drivers, its threading. */
#include <pokeys/names.h>
#include "tools/print.h"

/* null until the device has told something of a driver. */
static void put_postep(struct json *json, const struct pokeys_postep *driver)
{
	if (!driver->t_update_ns) {
		json_null(json, "postep");
		return;
	}
	json_object(json, "postep");
	json_unsigned(json, "state", driver->state);
	json_unsigned(json, "faults", driver->faults);
	json_unsigned(json, "inputs", driver->inputs);
	json_real(json, "supply_v", driver->supply / 4.0);
	json_unsigned(json, "temperature_c", driver->temperature);
	json_unsigned(json, "updates", driver->update_count);
	json_unsigned(json, "mode", driver->mode);
	json_unsigned(json, "step_mode", driver->step_mode);
	json_unsigned(json, "temperature_limit_c", driver->temperature_limit);
	json_end(json);
}

static void put_axis(struct json *json, const struct pokeys_axis *axis,
		     const struct pokeys_postep *driver)
{
	char name[32];

	json_object(json, NULL);
	json_text(json, "name", print_clean(axis->name, sizeof(axis->name), name));
	json_real(json, "pulses_per_unit", axis->pulses_per_unit);
	json_integer(json, "position", axis->position);
	json_integer(json, "reference", axis->reference);
	json_text(json, "state", pokeys_axis_state_name(axis->state));
	json_bool(json, "enabled", axis->enabled);
	json_bool(json, "in_position", axis->in_position);
	json_bool(json, "homed", axis->homed);
	json_bool(json, "limit_minus", axis->limit_minus);
	json_bool(json, "limit_plus", axis->limit_plus);
	json_bool(json, "home", axis->home);
	json_bool(json, "error", axis->error);
	json_bool(json, "soft_limit", axis->soft_limit);
	json_real(json, "max_speed", (double)axis->max_speed);
	json_real(json, "max_acceleration", (double)axis->max_acceleration);
	put_postep(json, driver);
	json_end(json);
}

static void put_threading(struct json *json, const struct pokeys_threading *threading)
{
	json_object(json, "threading");
	json_bool(json, "preparing", threading->preparing);
	json_bool(json, "prepared", threading->prepared);
	json_bool(json, "waiting", threading->waiting);
	json_bool(json, "active", threading->active);
	json_unsigned(json, "ignore_axes", threading->ignore_axes);
	json_unsigned(json, "behind", threading->behind);
	json_unsigned(json, "spindle_rpm", threading->spindle_rpm);
	json_unsigned(json, "index_count", threading->index_count);
	json_end(json);
}

void print_json_engine(struct json *json, const struct pokeys_state *state)
{
	const struct pokeys_engine *engine = &state->engine;

	json_object(json, "engine");
	json_text(json, "state", pokeys_engine_state_name(engine->state));
	json_bool(json, "activated", engine->activated);
	json_bool(json, "emergency", engine->emergency);
	json_unsigned(json, "axes_enabled", engine->axes_enabled);
	json_array(json, "axes");
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		put_axis(json, &engine->axis[i], &state->postep[i]);
	json_end(json);
	put_threading(json, &state->threading);
	json_end(json);
}
