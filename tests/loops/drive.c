/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Outputs on the wires of three kinds of amplifiers: each its duty, nothing while the axis is off,
 * and no direction that changes under a PWM.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
#include <math.h>
#include "daemon/loops/drive.h"
#include "sim/prng.h"

#define CYCLE_NS UINT64_C(1000000)

static bool is(double have, double want)
{
	return fabs(have - want) < 1e-12;
}

static void each_kind_has_its_duties(void **state)
{
	static const double outputs[] = { 0, 0.25, 1, 3, -0.25, -1, -3 };
	const struct drive_config antiphase = { .kind = DRIVE_ANTIPHASE };
	const struct drive_config two = { .kind = DRIVE_TWO_PWM };
	struct drive drive = { .reverse = false };

	(void)state;
	for (size_t i = 0; i < sizeof(outputs) / sizeof(outputs[0]); i++) {
		const double limited = fmax(fmin(outputs[i], 1), -1);
		struct drive_wires wires = drive_step(&drive, &antiphase, outputs[i], true, 1);

		assert_true(is(wires.duty[0], 0.5 + limited / 2) && wires.enable);
		wires = drive_step(&drive, &two, outputs[i], true, 1);
		assert_true(is(wires.duty[0], fmax(limited, 0)));
		assert_true(is(wires.duty[1], fmax(-limited, 0)) && wires.enable);
	}
}

static void off_is_nothing(void **state)
{
	const double outputs[] = { 0.7, -0.7, NAN, INFINITY };

	(void)state;
	for (int kind = DRIVE_SIGN; kind <= DRIVE_TWO_PWM; kind++) {
		const struct drive_config config = { .kind = (enum drive_kind)kind };
		const double nothing = kind == DRIVE_ANTIPHASE ? 0.5 : 0;
		struct drive drive = { .reverse = false };

		for (size_t i = 0; i < sizeof(outputs) / sizeof(outputs[0]); i++) {
			const struct drive_wires wires =
				drive_step(&drive, &config, outputs[i], false, i + 1);

			assert_true(is(wires.duty[0], nothing) && wires.duty[1] == 0);
			assert_false(wires.enable);
		}
		/* nor is what is no number */
		assert_true(is(drive_step(&drive, &config, NAN, true, 9).duty[0], nothing));
	}
}

static void no_direction_changes_under_a_pwm(void **state)
{
	const struct drive_config config = { .kind = DRIVE_SIGN, .dwell_ns = 3 * CYCLE_NS };
	struct drive drive = { .reverse = false };
	struct drive_wires before = { .reverse = false };
	uint64_t now_ns = CYCLE_NS, on_ns = 0, changed_ns = 0;
	unsigned int changes = 0, forward = 0, reverse = 0;
	struct sim_prng prng;
	double output = 0.5;

	(void)state;
	sim_prng_init(&prng, 20055);
	for (int i = 0; i < 100000; i++, now_ns += CYCLE_NS) {
		struct drive_wires wires;

		if (sim_prng_unit(&prng) < 0.1)
			output = 2 * sim_prng_unit(&prng) - 1;
		wires = drive_step(&drive, &config, output, sim_prng_unit(&prng) < 0.99, now_ns);
		if (wires.reverse != before.reverse) {
			assert_true(now_ns - on_ns >= config.dwell_ns);
			changed_ns = now_ns;
			changes++;
		}
		if (wires.duty[0] > 0) {
			assert_true(!changed_ns || now_ns - changed_ns >= config.dwell_ns);
			assert_true(is(wires.duty[0], fabs(output)));
			assert_true(wires.reverse == (output < 0));
			on_ns = now_ns;
		}
		forward += wires.duty[0] > 0 && !wires.reverse;
		reverse += wires.duty[0] > 0 && wires.reverse;
		before = wires;
	}
	/* most of the time there is an output, in both directions */
	assert_true(changes > 1000 && forward > 20000 && reverse > 20000);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(each_kind_has_its_duties),
		cmocka_unit_test(off_is_nothing),
		cmocka_unit_test(no_direction_changes_under_a_pwm),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
