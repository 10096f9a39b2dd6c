/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The physics go on in steps of a reading, the controller in steps of a period, as in the daemon.
 */
#include "tests/loops/oven.h"

#include <math.h>
#include <pokeys/names.h>

#define READINGS 10
#define FULL_SCALE 4095.0

void oven_init(struct oven *oven, const struct heater_config *config,
	       const struct sim_heat_config *heat)
{
	const char *why;

	*oven = (struct oven){ .now_ns = UINT64_C(1000000000), .device = true, .commander = true };
	sim_heat_init(&oven->heat, heat, 20055);
	why = heater_init(&oven->heater, config);
	if (why)
		fail_msg("%s", why);
	oven_mark(oven);
	/* Nobody has read anything before the first step. */
	oven_step(oven);
}

void oven_mark(struct oven *oven)
{
	oven->most = oven->least = oven->heat.sensor;
	oven->energy = 0;
}

void oven_step(struct oven *oven)
{
	const uint64_t step_ns = HEATER_PERIOD_NS / READINGS;

	for (int i = 0; i < READINGS; i++) {
		sim_heat_run(&oven->heat, (double)step_ns / 1e9, oven->power, oven->fan);
		oven->now_ns += step_ns;
		if (!oven->silent)
			heater_sample(&oven->heater, sim_heat_reading(&oven->heat) / FULL_SCALE,
				      oven->now_ns);
	}
	oven->energy += oven->power * oven->heat.config.watts * 0.1;
	heater_device(&oven->heater, oven->device);
	heater_commander(&oven->heater, oven->commander, oven->now_ns);
	heater_command(&oven->heater, oven->target);
	oven->power = heater_step(&oven->heater, oven->now_ns);
	oven->most = fmax(oven->most, oven->heat.sensor);
	oven->least = fmin(oven->least, oven->heat.sensor);
}

void oven_run(struct oven *oven, double seconds)
{
	for (long i = lround(seconds * 10); i > 0; i--)
		oven_step(oven);
}

double oven_until_fault(struct oven *oven, double seconds)
{
	for (long i = 1; i <= lround(seconds * 10); i++) {
		oven_step(oven);
		if (oven->heater.fault)
			return (double)i / 10;
	}
	return -1;
}

void oven_warm(struct oven *oven, double target)
{
	oven->target = target;
	oven_run(oven, 600);
	oven_expect_fault(oven, HEATER_FINE);
	assert_true(heater_is_at(&oven->heater, 2));
}

void oven_expect_fault(const struct oven *oven, enum heater_fault fault)
{
	if (oven->heater.fault != fault)
		fail_msg("the fault is \"%s\", not \"%s\"",
			 pokeys_heater_fault_name((uint8_t)oven->heater.fault),
			 pokeys_heater_fault_name((uint8_t)fault));
	if (fault)
		assert_true(oven->power == 0 && oven->heater.target == 0);
}
