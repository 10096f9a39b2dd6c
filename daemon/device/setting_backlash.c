/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Backlash compensation by the device (protocol section 3.24.3, 0x85/40 and 41).
 *
 * One table for all axes, always written as a whole: what nobody wants, and the byte
 * that no document names, go back as they came. What the compensation has added so far
 * (@40 of the answer) is no setting and stays zero in a write, as the vendor's library
 * sends it.
 */

#include <string.h>
#include "daemon/device/internal.h"

#define AXIS_BITS (POKEYS_AXIS_SET_BACKLASH_WIDTH | POKEYS_AXIS_SET_BACKLASH_ACCELERATION)
#define ENGINE_BITS (POKEYS_SET_BACKLASH | POKEYS_SET_BACKLASH_SPEED)

static bool has_backlash(const struct device *device, unsigned int index)
{
	return setting_has_engine(device, index) && setting_since(device, setting_backlash.since);
}

static bool backlash_wanted(const struct pokeys_settings *want, unsigned int index)
{
	(void)index;
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		if (want->axis[i].set & AXIS_BITS)
			return true;
	}
	return want->set & ENGINE_BITS;
}

static void merge_axis(const struct pokeys_axis_settings *want, struct wire_backlash *axis)
{
	if (want->set & POKEYS_AXIS_SET_BACKLASH_WIDTH)
		axis->half_width = want->backlash_half;
	if (want->set & POKEYS_AXIS_SET_BACKLASH_ACCELERATION)
		axis->accel = want->backlash_acceleration;
}

static uint64_t backlash_merge(const struct pokeys_settings *want, unsigned int index,
			       const union setting_value *value, union setting_request *request)
{
	const struct wire_pulse_backlash_rep *have = &value->backlash;
	struct wire_pulse_backlash_set_req *set = &request->backlash_set;
	uint64_t differs;

	(void)index;
	memset(request, 0, sizeof(*request));
	set->enable = want->set & POKEYS_SET_BACKLASH ? want->backlash_enable : have->enable;
	set->max_speed = want->set & POKEYS_SET_BACKLASH_SPEED ? want->backlash_speed :
								 have->max_speed;
	differs = (uint64_t)(!set->enable != !have->enable || set->max_speed != have->max_speed)
		  << SETTING_ENGINE_BIT;
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		set->axis[i] = have->axis[i];
		merge_axis(&want->axis[i], &set->axis[i]);
		if (memcmp(&set->axis[i], &have->axis[i], sizeof(have->axis[i])) != 0)
			differs |= UINT64_C(1) << i;
	}
	return differs;
}

static void backlash_learn(struct device *device, unsigned int index,
			   const union setting_value *value)
{
	(void)index;
	memcpy(device->image.backlash, value->backlash.compensation,
	       sizeof(device->image.backlash));
}

static void backlash_report(struct pokeys_settings *known, unsigned int index,
			    const union setting_value *value)
{
	(void)index;
	known->set |= ENGINE_BITS;
	known->backlash_enable = value->backlash.enable > 0;
	known->backlash_speed = value->backlash.max_speed;
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		known->axis[i].set |= AXIS_BITS;
		known->axis[i].backlash_half = value->backlash.axis[i].half_width;
		known->axis[i].backlash_acceleration = value->backlash.axis[i].accel;
	}
}

static int64_t backlash_written(const union setting_value *value, unsigned int which)
{
	return which < POKEYS_AXES ? value->backlash.axis[which].half_width :
				     value->backlash.enable;
}

bool backlash_has(const struct device *device)
{
	const struct setting *setting = &device->configure.setting[SETTING_BACKLASH];

	return setting->known && setting->value.backlash.enable;
}

enum wire_op backlash_ask(struct device *device, union slow_request *request)
{
	(void)device;
	(void)request;
	return WIRE_OP_PULSE_BACKLASH_GET;
}

void backlash_take(struct device *device, const mailbox_entry_t *entry)
{
	union setting_value value;

	wire_pulse_backlash_get_decode_rep(entry->response_buffer, &value.backlash);
	backlash_learn(device, 0, &value);
}

const struct setting_kind setting_backlash = {
	.read = WIRE_OP_PULSE_BACKLASH_GET,
	.write = WIRE_OP_PULSE_BACKLASH_SET,
	.name = POKEYS_SETTING_BACKLASH,
	.since = SETTING_VERSION(4, 1, 26),
	.has = has_backlash,
	.wanted = backlash_wanted,
	.ask = setting_ask_zeros,
	.merge = backlash_merge,
	.learn = backlash_learn,
	.report = backlash_report,
	.written = backlash_written,
};
