/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * PoStep motor drivers: what they are set up for (protocol section 3.24.3, 0x85/53). The
 * way there is postep_talk.c's.
 *
 * Another step mode than wanted makes another distance of each command. So motion is not
 * permitted before every driver is known to have what is wanted of it, and no longer when
 * one turns out to have forgotten it.
 */

#include <string.h>
#include "daemon/device/internal.h"
#include "daemon/device/postep.h"

static bool modes_wanted(const struct pokeys_settings *want, unsigned int index)
{
	(void)index;
	return postep_axes_with(want, POSTEP_MODE_BITS);
}

static uint64_t modes_merge(const struct pokeys_settings *want, unsigned int index,
			    const union setting_value *value, union setting_request *request)
{
	const struct wire_postep_modes_req *have = &value->modes;
	struct wire_postep_modes_req *set = &request->modes;
	uint64_t differs = 0;

	(void)index;
	memset(request, 0, sizeof(*request));
	*set = *have;
	set->option = WIRE_POSTEP_WRITE;
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		const struct pokeys_axis_settings *axis = &want->axis[i];

		if (axis->set & POKEYS_AXIS_SET_POSTEP_STEP)
			set->axis[i].step = axis->postep_step;
		if (axis->set & POKEYS_AXIS_SET_POSTEP_TEMPERATURE)
			set->axis[i].temperature = axis->postep_temperature;
		differs |=
			(uint64_t)(memcmp(&set->axis[i], &have->axis[i], sizeof(set->axis[i])) != 0)
			<< i;
	}
	return differs;
}

static void say_step(struct device *device, unsigned int axis, int64_t step)
{
	const struct pokeys_axis_settings *want = &device->wishes.wanted.axis[axis];

	device_say(device, EVENT_STEP_MODE, EVENT_ERROR, axis, step,
		   want->set & POKEYS_AXIS_SET_POSTEP_STEP ? want->postep_step : -1);
}

/* One has another step mode than when motion was permitted: from now on all ways are wrong. */
static void judge_steps(struct device *device, const struct wire_postep_modes_req *modes)
{
	for (unsigned int i = 0; device->safe.permitted && i < POKEYS_AXES; i++) {
		const struct pokeys_axis_settings *want = &device->wishes.wanted.axis[i];
		const uint8_t step = modes->axis[i].step;
		const uint8_t then = device->configure.postep.permitted[i];

		if (!(want->set & POKEYS_AXIS_SET_POSTEP_STEP) || step == want->postep_step ||
		    step == then || then == UINT8_MAX)
			continue;
		say_step(device, i, step);
		safe_permit_drop(device);
	}
}

static void modes_learn(struct device *device, unsigned int index, const union setting_value *value)
{
	(void)index;
	device->configure.postep.turning &= (uint8_t)~device->configure.postep.fetched;
	judge_steps(device, &value->modes);
	postep_modes(device, &value->modes);
}

static void modes_report(struct pokeys_settings *known, unsigned int index,
			 const union setting_value *value)
{
	(void)index;
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		known->axis[i].set |= POSTEP_MODE_BITS;
		known->axis[i].postep_step = value->modes.axis[i].step;
		known->axis[i].postep_temperature = value->modes.axis[i].temperature;
	}
}

static int64_t modes_written(const union setting_value *value, unsigned int which)
{
	return which < POKEYS_AXES ? value->modes.axis[which].step : 0;
}

static bool modes_needs_effect(const union setting_value *value,
			       const union setting_request *request)
{
	(void)value;
	(void)request;
	return true;
}

bool postep_permits(struct device *device)
{
	const struct setting *setting = &device->configure.setting[SETTING_POSTEP_MODES];
	struct postep_talk *talk = &device->configure.postep;
	const bool busy = setting->state == SETTING_EFFECT || setting->state == SETTING_WRITING;

	if (!setting_postep_modes.has(device, 0))
		return true;
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		const struct pokeys_axis_settings *want = &device->wishes.wanted.axis[i];
		const uint8_t step = setting->value.modes.axis[i].step;
		const bool told = setting->known && talk->fetched >> i & 1;
		const bool turning = talk->turning >> i & 1;
		const bool wanted = want->set & POKEYS_AXIS_SET_POSTEP_STEP;
		const bool same = wanted && step == want->postep_step;

		talk->permitted[i] = setting->known ? step : UINT8_MAX;
		if (wanted ? told && !turning && same : !turning || !busy)
			continue;
		say_step(device, i, told && !same ? step : -1);
		return false;
	}
	return true;
}

/* One that does not have what is wanted has been talked to since it was refused. */
static bool talks_again(const struct device *device, const struct setting *setting,
			uint64_t differs)
{
	const uint8_t axes = postep_axes_with(&device->wishes.wanted, POSTEP_MODE_BITS) &
			     (uint8_t)(~device->configure.postep.fetched | differs);

	if (device->now_ns < setting->after_ns || device->image.identity.locked)
		return false;
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		if (axes >> i & 1 && device->image.postep[i].t_update_ns >= setting->after_ns)
			return true;
	}
	return false;
}

void postep_look_again(struct device *device, const struct wire_postep_modes_req *modes)
{
	struct setting *setting = &device->configure.setting[SETTING_POSTEP_MODES];
	const bool other = memcmp(&setting->value.modes, modes, sizeof(*modes)) != 0;
	union setting_request request;
	uint64_t differs;

	judge_steps(device, modes);
	if (!setting->known || (setting->state != SETTING_DONE && setting->state != SETTING_WRITE &&
				setting->state != SETTING_REFUSED))
		return;
	setting->value.modes = *modes;
	differs = modes_merge(&device->wishes.wanted, 0, &setting->value, &request);
	differs |= postep_axes_with(&device->wishes.wanted, POSTEP_MODE_BITS) &
		   (uint8_t)~device->configure.postep.fetched;
	if (setting->state == SETTING_REFUSED && talks_again(device, setting, differs)) {
		setting->writes = setting->unanswered = 0;
		setting->state = SETTING_READ;
	}
	if ((setting->state == SETTING_WRITE && other) ||
	    (setting->state == SETTING_DONE && differs))
		setting->state = SETTING_READ;
}

const struct setting_kind setting_postep_modes = {
	.read = WIRE_OP_POSTEP_MODES,
	.write = WIRE_OP_POSTEP_MODES,
	.name = POKEYS_SETTING_POSTEP_MODES,
	.since = SETTING_VERSION(4, 1, 42),
	.only_57cnc = true,
	.has = postep_has_tables,
	.ready = postep_modes_ready,
	.wanted = modes_wanted,
	.ask = setting_ask_zeros,
	.merge = modes_merge,
	.learn = modes_learn,
	.report = modes_report,
	.written = modes_written,
	.needs_effect = modes_needs_effect,
	.effect = postep_modes_effect,
};
