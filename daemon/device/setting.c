/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The table of settings, and what several kinds have in common.
 *
 * Each setting is one request that reads a whole table and one that replaces
 * it. So wanted values are merged into what the device has: bits that nobody
 * here knows of (key mappings, additional settings) go back as they came. All
 * of them are read even if nobody wants anything, so that a report shows what
 * the device has.
 */

#include <string.h>
#include "daemon/device/internal.h"

bool setting_always(const struct device *device, unsigned int index)
{
	(void)device;
	(void)index;
	return true;
}

void setting_ask_zeros(unsigned int index, union setting_request *request)
{
	(void)index;
	memset(request, 0, sizeof(*request));
}

void setting_learn_nothing(struct device *device, unsigned int index,
			   const union setting_value *value)
{
	(void)device;
	(void)index;
	(void)value;
}

const struct setting_kind *setting_kind(unsigned int setting, unsigned int *index)
{
	static const struct setting_kind *const kinds[SETTING_AXIS] = {
		[SETTING_PINS] = &setting_pins,
		[SETTING_ENCODER_OPTIONS] = &setting_encoder_options,
		[SETTING_ENCODER_PINS] = &setting_encoder_pins,
		[SETTING_FAST_ENCODERS] = &setting_fast,
		[SETTING_ULTRA_ENCODER] = &setting_ultra,
		[SETTING_PWM] = &setting_pwm,
		[SETTING_FILTER] = &setting_filter,
		[SETTING_POEXTBUS] = &setting_poextbus,
		[SETTING_MATRIX] = &setting_matrix,
		[SETTING_NAME] = &setting_name,
		[SETTING_FAILSAFE] = &setting_failsafe,
		[SETTING_ENGINE] = &setting_engine,
		[SETTING_EMERGENCY] = &setting_emergency,
	};

	*index = setting < SETTING_AXIS ? 0 : setting - SETTING_AXIS;
	return setting < SETTING_AXIS ? kinds[setting] : &setting_axis;
}
