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
		struct drive_wires wires = drive_step(&drive, &antiphase, outputs[i], true, true,
						      1);

		assert_true(is(wires.duty[0], 0.5 + limited / 2) && wires.enable);
		wires = drive_step(&drive, &two, outputs[i], true, true, 1);
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
			const struct drive_wires wires = drive_step(&drive, &config, outputs[i],
								    false, true, i + 1);

			assert_true(is(wires.duty[0], nothing) && wires.duty[1] == 0);
			assert_false(wires.enable);
		}
		/* nor is what is no number */
		assert_true(is(drive_step(&drive, &config, NAN, true, true, 9).duty[0], nothing));
	}
}

/* The device of this test: it has what was sent, or what was sent before. */
struct amplifier {
	struct drive_wires has, sent;
	uint64_t on_ns, changed_ns; /* the PWM was on, the direction has changed */
	unsigned int changes, forward, reverse;
};

static void deliver(struct amplifier *amplifier, uint64_t dwell_ns, uint64_t now_ns)
{
	const struct drive_wires before = amplifier->has;

	amplifier->has = amplifier->sent;
	if (amplifier->has.reverse != before.reverse) {
		assert_true(now_ns - amplifier->on_ns >= dwell_ns + CYCLE_NS);
		amplifier->changed_ns = now_ns;
		amplifier->changes++;
	}
	if (amplifier->has.duty[0] > 0) {
		assert_true(now_ns - amplifier->changed_ns >= dwell_ns + CYCLE_NS);
		amplifier->on_ns = now_ns;
	}
}

/* A duty of 0 would be full speed backwards, and so it may be what the device has. */
static void antiphase_is_enabled_after_standstill_was_acknowledged(void **state)
{
	const struct drive_config config = { .kind = DRIVE_ANTIPHASE };
	struct drive drive = { .reverse = false };

	(void)state;
	for (uint64_t i = 1; i < 10; i++) {
		struct drive_wires wires = drive_step(&drive, &config, 0.3, true, false, i);

		assert_true(is(wires.duty[0], 0.5) && !wires.enable);
	}
	assert_true(drive_step(&drive, &config, 0.3, true, true, 10).enable);
	/* what is under way does not disable it */
	assert_true(is(drive_step(&drive, &config, -0.3, true, false, 11).duty[0], 0.35));
	assert_true(drive_step(&drive, &config, -0.3, true, false, 12).enable);
	assert_false(drive_step(&drive, &config, 0, false, true, 13).enable);
	assert_false(drive_step(&drive, &config, 0.3, true, false, 14).enable);
}

static void no_direction_changes_under_a_pwm(void **state)
{
	static const uint64_t dwells[] = { 0, 3 * CYCLE_NS };
	struct sim_prng prng;

	(void)state;
	sim_prng_init(&prng, 20055);
	for (size_t k = 0; k < sizeof(dwells) / sizeof(dwells[0]); k++) {
		const struct drive_config config = { .kind = DRIVE_SIGN, .dwell_ns = dwells[k] };
		/* nobody knows what the wire was */
		struct amplifier amplifier = { .has = { .reverse = true } };
		struct drive drive = { .reverse = false };
		bool settled = true;
		double output = 0.5;

		for (uint64_t cycle = 10; cycle < 200000; cycle++) {
			const uint64_t now_ns = cycle * CYCLE_NS;
			const bool enabled = sim_prng_unit(&prng) < 0.99;

			/* what was sent in the last cycle arrives now, or is lost */
			settled = sim_prng_unit(&prng) < 0.9;
			if (settled)
				deliver(&amplifier, dwells[k], now_ns);
			if (sim_prng_unit(&prng) < 0.05)
				output = 2 * sim_prng_unit(&prng) - 1;
			amplifier.sent = drive_step(&drive, &config, output, enabled, settled,
						    now_ns);
			if (amplifier.sent.duty[0] > 0) {
				assert_true(is(amplifier.sent.duty[0], fabs(output)) && enabled);
				assert_true(amplifier.sent.reverse == (output < 0));
				amplifier.forward += output > 0;
				amplifier.reverse += output < 0;
			}
		}
		/* most of the time there is an output, in both directions */
		assert_true(amplifier.changes > 1000);
		assert_true(amplifier.forward > 40000 && amplifier.reverse > 40000);
	}
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(each_kind_has_its_duties),
		cmocka_unit_test(off_is_nothing),
		cmocka_unit_test(antiphase_is_enabled_after_standstill_was_acknowledged),
		cmocka_unit_test(no_direction_changes_under_a_pwm),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
