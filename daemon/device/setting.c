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

bool setting_has_engine(const struct device *device, unsigned int index)
{
	(void)index;
	return device->image.capability.pulse_engine >= 2;
}

bool setting_since(const struct device *device, uint32_t version)
{
	return wire_firmware_at_least(&device->identify.identity.firmware, (uint8_t)(version >> 16),
				      (uint8_t)(version >> 8), (uint8_t)version);
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
		[SETTING_BACKLASH] = &setting_backlash,
		[SETTING_SYNC_PWM] = &setting_sync_pwm,
		[SETTING_SYNC_OUTPUTS] = &setting_sync_outputs,
		[SETTING_POSTEP] = &setting_postep,
		[SETTING_POSTEP_MODES] = &setting_postep_modes,
		[SETTING_THREADING] = &setting_thread,
	};

	*index = setting < SETTING_AXIS ? 0 : setting - SETTING_AXIS;
	return setting < SETTING_AXIS ? kinds[setting] : &setting_axis;
}
