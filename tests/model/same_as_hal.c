// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * A name that HAL has as well shows what HAL shows: the HAL component and the model read
 * the same images, full of numbers by chance, and every such pin is compared.
 */
#include <stdio.h>
#include <pokeys/shm.h>
#include "halbridge/diagnose.h"
#include "model/model.h"
#include "tests/halbridge/rig.h"

enum { ROUNDS = 100, PERIODS = 33 };

static uint64_t chance_state = 88172645463325252u;

static uint64_t chance(void)
{
	chance_state ^= chance_state << 13;
	chance_state ^= chance_state >> 7;
	chance_state ^= chance_state << 17;
	return chance_state;
}

/* Random values in all members, of a device that runs and is fresh. */
static void fill(struct rig *rig)
{
	struct pokeys_state *state = &rig->daemon;
	uint8_t *bytes = (uint8_t *)state;
	const struct pokeys_state well = *state;

	for (size_t i = 0; i < sizeof(*state); i++)
		bytes[i] = (uint8_t)(chance() >> 32);
	state->epoch = well.epoch;
	state->period_ns = well.period_ns;
	state->stale_after_ns = well.stale_after_ns;
	state->link = well.link;
	state->flags = (state->flags & ~(uint32_t)POKEYS_STATE_STALE) | POKEYS_STATE_COMMANDER;
	state->capability.pulse_engine = 2;
	state->identity.serial |= 1;
	state->kbd48_module %= POKEYS_PONET;
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		state->postep[i].t_update_ns = rig->now_ns - 5 * RIG_MS - i;
}

static double number(const struct model_value *value)
{
	switch (value->kind) {
	case MODEL_BOOLEAN:
		return value->boolean;
	case MODEL_NATURAL:
		return (double)(uint32_t)value->natural; /* HAL has no more */
	case MODEL_INTEGER:
		return (double)value->integer;
	case MODEL_REAL:
		return value->real;
	case MODEL_STRING:
	case MODEL_UNKNOWN:
		break;
	}
	return (double)NAN;
}

/* As the HAL component has it, of its exchange. */
static bool is_compared(const struct model_row *row, const struct table_row *hal)
{
	return hal && row->image == MODEL_STATE &&
	       (hal->direction == TABLE_OUT || hal->direction == TABLE_RO);
}

static unsigned int compare(const struct rig *rig)
{
	const struct model_images images = {
		.image = { [MODEL_STATE] = rig->exchange.state },
		.now_ns = rig->now_ns,
	};
	const struct model_row *row;
	unsigned int compared = 0;

	for (size_t i = 0; (row = model_row(i)); i++) {
		const struct table_row *hal = model_hal_row(row);

		if (!is_compared(row, hal))
			continue;
		for (unsigned int index = 0; index < model_names(row); index++) {
			const char *at = (const char *)&rig->values + table_offset(hal, index);
			const double theirs = table_get(hal, at);
			struct model_value value;
			double ours;

			model_read(row, index, &images, &value);
			ours = number(&value);
			if (isnan(ours) != isnan(theirs) ||
			    fabs(ours - theirs) > 1e-9 * fmax(1, fabs(theirs)))
				fail_msg("%s %u: HAL has %.17g, the model %.17g", row->name, index,
					 theirs, ours);
			compared++;
		}
	}
	return compared;
}

static void test_a_name_of_hal_shows_what_hal_shows(void **context)
{
	static struct rig rig;
	unsigned int compared = 0;

	(void)context;
	for (unsigned int round = 0; round < ROUNDS; round++) {
		rig_init(&rig);
		fill(&rig);
		/* of loops that are not there, HAL shows nothing */
		for (unsigned int i = 0; i < POKEYS_HEATERS; i++)
			rig.daemon.heater[i].state |= POKEYS_HEATER_OFF;
		for (unsigned int i = 0; i < POKEYS_SERVOS; i++)
			rig.daemon.servo[i].state |= POKEYS_SERVO_OFF;
		rig_periods(&rig, PERIODS);
		diagnose_read(&rig.values, rig.exchange.state);
		motor_drive_read(&rig.exchange.drive, &rig.values, rig.exchange.state, rig.now_ns);
		compared += compare(&rig);
	}
	printf("%u values\n", compared / ROUNDS);
	assert_in_range(compared / ROUNDS, 900, 5000);
}

/* The member of each pin that is commanded, by chance. */
static void press(struct rig *rig)
{
	const struct model_row *row;

	for (size_t i = 0; (row = model_row(i)); i++) {
		const struct table_row *hal = model_hal_row(row);

		if (row->image != MODEL_COMMAND || !hal || hal->kind != TABLE_PIN)
			continue;
		for (unsigned int index = 0; index < model_names(row); index++)
			table_put(hal, (char *)&rig->values + table_offset(hal, index),
				  hal->type == TABLE_BIT   ? (double)(chance() >> 40 & 1) :
				  hal->type == TABLE_FLOAT ? (double)(chance() >> 40) / (1 << 24) :
							     (double)(uint32_t)chance());
	}
	for (unsigned int i = 0; i < POKEYS_PWM; i++)
		rig->values.pwm[i].enable = true;
}

/* The bit that says that it is commanded. */
static bool is_commanded(const struct model_row *row, unsigned int index, const void *image)
{
	const unsigned int bit = row->mask_bit +
				 index / (row->inner ? row->inner : 1) * row->mask_stride;

	return !row->mask || ((const uint8_t *)image)[row->mask + bit / 8] >> bit % 8 & 1;
}

static void test_what_hal_commands_stands_where_the_model_has_it(void **context)
{
	static struct rig rig;
	const struct model_row *row;
	unsigned int compared = 0;

	(void)context;
	rig_init(&rig);
	rig.daemon.pwm_period = 1u << 24;
	memset(rig.daemon.digital_out_owned, 0xff, sizeof(rig.daemon.digital_out_owned));
	for (unsigned int i = 0; i < POKEYS_HEATERS; i++)
		rig.daemon.heater[i].state = POKEYS_HEATER_OFF;
	for (unsigned int i = 0; i < POKEYS_SERVOS; i++)
		rig.daemon.servo[i].state = POKEYS_SERVO_OFF;
	for (unsigned int round = 0; round < ROUNDS; round++) {
		const struct model_images images = {
			.image = { [MODEL_COMMAND] = &rig.exchange.command },
		};

		press(&rig);
		rig_periods(&rig, 2);
		/* HAL leaves the period as it is, and duties are a part of that */
		rig.exchange.command.pwm_period = rig.daemon.pwm_period;
		for (size_t i = 0; (row = model_row(i)); i++) {
			const struct table_row *hal = model_hal_row(row);

			if (row->image != MODEL_COMMAND || !hal || hal->kind != TABLE_PIN)
				continue;
			for (unsigned int k = 0; k < model_names(row); k++) {
				const char *at = (const char *)&rig.values + table_offset(hal, k);
				struct model_value value;

				model_read(row, k, &images, &value);
				if (fabs(number(&value) - table_get(hal, at)) > 1e-6)
					fail_msg("%s %u: HAL says %g, the image has %g", row->name,
						 k, table_get(hal, at), number(&value));
				if (!is_commanded(row, k, &rig.exchange.command))
					fail_msg("%s %u is not commanded", row->name, k);
				compared++;
			}
		}
	}
	assert_in_range(compared / ROUNDS, 250, 1000);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_a_name_of_hal_shows_what_hal_shows),
		cmocka_unit_test(test_what_hal_commands_stands_where_the_model_has_it),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
