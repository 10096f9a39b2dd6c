/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What drivers of motors say comes some times a second at most, so it is looked at every
 * 16th period, with the diagnostics, and costs nothing where there is none.
 */
#include "halbridge/motor_drive.h"
#include "halbridge/news.h"

#define VOLTS	0.25		/* unit of the supply */

static void show_driver(struct value_postep *value, const struct pokeys_postep *driver)
{
	value->supply = driver->supply * VOLTS;
	value->temperature = driver->temperature;
	value->state = driver->state;
	value->faults = driver->faults;
	value->fault = driver->faults;
	value->inputs = driver->inputs;
	value->updates = driver->update_count;
	value->full_scale = driver->full_scale;
	value->idle = driver->idle;
	value->overheat = driver->overheat;
	value->hardware = driver->hardware_major * 100u + driver->hardware_minor;
	value->firmware = driver->firmware_major * 100u + driver->firmware_minor;
}

/* Another value in each period, but only where there is a driver. */
static bool show_ages(struct value_drive *value, const struct pokeys_state *state, uint64_t now_ns)
{
	bool changed = false;

	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		const uint64_t t_ns = state->postep[i].t_update_ns;
		const double age = t_ns ? (double)(int64_t)(now_ns - t_ns) / 1e6 : -1;

		changed |= value->postep[i].age_ms != age;
		value->postep[i].age_ms = age;
	}
	return changed;
}

void motor_drive_read(struct motor_drive *drive, struct values *values,
		      const struct pokeys_state *state, uint64_t now_ns)
{
	struct value_drive *value = &values->drive;
	bool changed = show_ages(value, state, now_ns);

	if (news(drive->postep, state->postep, sizeof(drive->postep), !drive->begun)) {
		for (unsigned int i = 0; i < POKEYS_AXES; i++)
			show_driver(&value->postep[i], &state->postep[i]);
		changed = true;
	}
	if (news(drive->backlash, state->backlash, sizeof(drive->backlash), !drive->begun)) {
		for (unsigned int i = 0; i < POKEYS_AXES; i++)
			value->backlash[i] = state->backlash[i];
		changed = true;
	}
	drive->begun = true;
	if (changed)
		values_changed(values, BLOCK_DRIVE);
}
