/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * PoStep motor drivers: that the device talks to them, and what it fetches from each
 * (protocol section 3.24.3, 0x85/50). What they are set up for: setting_postep_modes.c.
 */

#include <string.h>
#include "daemon/device/internal.h"
#include "daemon/device/postep.h"

bool postep_has_tables(const struct device *device, unsigned int index)
{
	return setting_has_engine(device, index) &&
	       device->image.identity.hardware == WIRE_HW_57CNC &&
	       setting_since(device, setting_postep.since);
}

uint8_t postep_axes_with(const struct pokeys_settings *want, uint32_t bits)
{
	uint8_t axes = 0;

	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		axes |= (uint8_t)((want->axis[i].set & bits ? 1u : 0u) << i);
	return axes;
}

static bool comm_wanted(const struct pokeys_settings *want, unsigned int index)
{
	(void)index;
	return want->set & POKEYS_SET_POSTEP || postep_axes_with(want, POSTEP_COMM_BITS);
}

static uint64_t comm_merge(const struct pokeys_settings *want, unsigned int index,
			   const union setting_value *value, union setting_request *request)
{
	const struct wire_postep_comm_req *have = &value->postep;
	struct wire_postep_comm_req *set = &request->postep;
	uint64_t differs;

	(void)index;
	memset(request, 0, sizeof(*request));
	*set = *have;
	set->option = WIRE_POSTEP_WRITE;
	if (want->set & POKEYS_SET_POSTEP)
		set->enable = want->postep_enable;
	differs = (uint64_t)(!set->enable != !have->enable) << SETTING_ENGINE_BIT;
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		const struct pokeys_axis_settings *axis = &want->axis[i];
		const bool ours = set->enable && axis->set & (POSTEP_COMM_BITS | POSTEP_MODE_BITS);

		if (axis->set & POKEYS_AXIS_SET_POSTEP_TYPE)
			set->axis[i].type = axis->postep_type;
		if (axis->set & POKEYS_AXIS_SET_POSTEP_ADDRESS)
			set->axis[i].address = axis->postep_address;
		/* what it would do once more must not go back with the rest */
		if (have->axis[i].update & UPDATE_MODE ||
		    (ours && set->axis[i].type && !(have->axis[i].update & UPDATE_STATUS)))
			set->axis[i].update = UPDATE_ALL;
		differs |= (uint64_t)(set->axis[i].type != have->axis[i].type ||
				      set->axis[i].address != have->axis[i].address ||
				      (ours && set->axis[i].update != have->axis[i].update))
			   << i;
	}
	return differs;
}

static void comm_report(struct pokeys_settings *known, unsigned int index,
			const union setting_value *value)
{
	(void)index;
	known->set |= POKEYS_SET_POSTEP;
	known->postep_enable = value->postep.enable > 0;
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		known->axis[i].set |= POSTEP_COMM_BITS;
		known->axis[i].postep_type = value->postep.axis[i].type;
		known->axis[i].postep_address = value->postep.axis[i].address;
	}
}

static int64_t comm_written(const union setting_value *value, unsigned int which)
{
	return which < POKEYS_AXES ? value->postep.axis[which].type : value->postep.enable;
}

const struct setting_kind setting_postep = {
	.read = WIRE_OP_POSTEP_COMM,
	.write = WIRE_OP_POSTEP_COMM,
	.name = POKEYS_SETTING_POSTEP,
	.since = SETTING_VERSION(4, 1, 42),
	.only_57cnc = true,
	.has = postep_has_tables,
	.wanted = comm_wanted,
	.ask = setting_ask_zeros,
	.merge = comm_merge,
	.learn = setting_learn_nothing,
	.report = comm_report,
	.written = comm_written,
};
