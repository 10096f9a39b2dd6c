/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Parameters that are settings, with a made-up device behind them.
 */
#ifndef TESTS_HALBRIDGE_WISH_RIG_H
#define TESTS_HALBRIDGE_WISH_RIG_H

#include "tests/halbridge/rig.h"
#include "halbridge/wish.h"

static struct wish wish;
static struct values values;
static struct pokeys_report report;
static unsigned int refusals;
static const struct wish_item *refused;

static inline void rig_refuse(void *argument, const struct wish_item *item, double value)
{
	(void)argument;
	(void)value;
	refusals++;
	refused = item;
}

static inline bool rig_look(void)
{
	return wish_look(&wish, &values, rig_refuse, NULL);
}

static inline int rig_setup(void **state)
{
	(void)state;
	memset(&values, 0, sizeof(values));
	memset(&report, 0, sizeof(report));
	table_set_parameters(&values);
	refusals = 0;
	values.info.pwm_hz = 25000000;
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		values.joint[i].scale = 200;
	return wish_init(&wish);
}

/* A device whose settings all are known; those with a name are 1. */
static inline void rig_know(void)
{
	const struct wish_context context = { .scale = 1, .pwm_hz = 25e6 };

	report.state = POKEYS_CONFIG_APPLIED;
	for (size_t i = 0; i < wish.count; i++) {
		const struct wish_item *item = &wish.item[i];

		wish_store(item->row, &report.device, item->index, &context, 1);
		wish_flag(item->row, &report.device, item->index, &context, true);
	}
	report.device.pwm_period = 2500;
	wish_report(&wish, &report, &values);
}

static inline double rig_parameter(const struct wish_item *item)
{
	return table_get(item->name,
			 (unsigned char *)&values + table_offset(item->name, item->index));
}

static inline void rig_set(const struct wish_item *item, double value)
{
	table_put(item->name, (unsigned char *)&values + table_offset(item->name, item->index),
		  value);
}

/* Something else than what is shown, in range. */
static inline double rig_another(const struct wish_item *item)
{
	if (item->row->unit == &wish_mode)
		return 1 + (rig_parameter(item) == 1);
	if (item->row->unit == &wish_100ms)
		return 700;
	if (item->row->unit == &wish_hz)
		return 1000;
	if (item->name->type == TABLE_FLOAT)
		return 2.5;
	if (item->name->high == 1)
		return rig_parameter(item) == 0;
	if (item->row->unit == &wish_terminal)
		return 11;
	return item->row->unit == &wish_pump || item->row->unit == &wish_fast ? 10 : 2;
}

#endif
