/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A PWM channel and eight outputs that follow the slots of an axis in buffered mode
 * (protocol section 3.24.3, 0x85/0A and 0B).
 *
 * A request with option 2 reads. An answer that repeats the 2 tells nothing, neither
 * whether it is on nor of which axis. Of such a device what it has acknowledged since it was
 * found is what it has; so it is written once after each start and each loss of the link.
 */

#include <string.h>
#include "daemon/device/internal.h"

static bool is_other(uint8_t wanted, uint8_t option)
{
	return option == WIRE_SYNC_READ || !wanted != (option != WIRE_SYNC_ON);
}

static bool pwm_wanted(const struct pokeys_settings *want, unsigned int index)
{
	(void)index;
	return want->set & POKEYS_SET_SYNC_PWM;
}

static void pwm_ask(unsigned int index, union setting_request *request)
{
	setting_ask_zeros(index, request);
	request->sync_pwm.option = WIRE_SYNC_READ;
}

static uint64_t pwm_merge(const struct pokeys_settings *want, unsigned int index,
			  const union setting_value *value, union setting_request *request)
{
	const struct wire_pulse_sync_pwm_req *have = &value->sync_pwm;
	struct wire_pulse_sync_pwm_req *set = &request->sync_pwm;

	memset(request, 0, sizeof(*request));
	if (!pwm_wanted(want, index))
		return 0;
	set->option = want->sync_pwm_enable ? WIRE_SYNC_ON : WIRE_SYNC_OFF;
	set->axis = want->sync_pwm_axis;
	set->channel = want->sync_pwm_channel;
	return is_other(want->sync_pwm_enable, have->option) || set->axis != have->axis ||
	       set->channel != have->channel;
}

static void pwm_taken(struct device *device, const union setting_request *request)
{
	struct configure *configure = &device->configure;

	configure->synced.pwm = request->sync_pwm;
	configure->synced.pwm_taken = true;
	/* from now on that channel is the device's own */
	configure->setting[SETTING_SYNC_PWM].value.sync_pwm = request->sync_pwm;
}

static void pwm_learn(struct device *device, unsigned int index, const union setting_value *value)
{
	struct configure *configure = &device->configure;

	(void)index;
	if (value->sync_pwm.option == WIRE_SYNC_READ && configure->synced.pwm_taken)
		configure->setting[SETTING_SYNC_PWM].value.sync_pwm = configure->synced.pwm;
}

static void pwm_report(struct pokeys_settings *known, unsigned int index,
		       const union setting_value *value)
{
	(void)index;
	if (value->sync_pwm.option == WIRE_SYNC_READ)
		return;
	known->set |= POKEYS_SET_SYNC_PWM;
	known->sync_pwm_enable = value->sync_pwm.option == WIRE_SYNC_ON;
	known->sync_pwm_axis = value->sync_pwm.axis;
	known->sync_pwm_channel = value->sync_pwm.channel;
}

static int64_t pwm_written(const union setting_value *value, unsigned int which)
{
	(void)which;
	return value->sync_pwm.axis | value->sync_pwm.channel << 8;
}

const struct setting_kind setting_sync_pwm = {
	.read = WIRE_OP_PULSE_SYNC_PWM,
	.write = WIRE_OP_PULSE_SYNC_PWM,
	.name = POKEYS_SETTING_SYNC_PWM,
	.has = setting_has_engine,
	.wanted = pwm_wanted,
	.ask = pwm_ask,
	.merge = pwm_merge,
	.learn = pwm_learn,
	.report = pwm_report,
	.written = pwm_written,
	.taken = pwm_taken,
};

int setting_synced_channel(const struct device *device)
{
	const struct setting *setting = &device->configure.setting[SETTING_SYNC_PWM];

	if (!setting->known || setting->value.sync_pwm.option != WIRE_SYNC_ON ||
	    setting->value.sync_pwm.channel >= POKEYS_PWM)
		return -1;
	return setting->value.sync_pwm.channel;
}

static bool outputs_wanted(const struct pokeys_settings *want, unsigned int index)
{
	(void)index;
	return want->set & POKEYS_SET_SYNC_OUTPUTS;
}

static void outputs_ask(unsigned int index, union setting_request *request)
{
	setting_ask_zeros(index, request);
	request->sync_outputs.option = WIRE_SYNC_READ;
}

static uint64_t outputs_merge(const struct pokeys_settings *want, unsigned int index,
			      const union setting_value *value, union setting_request *request)
{
	const struct wire_pulse_sync_outputs_req *have = &value->sync_outputs;
	struct wire_pulse_sync_outputs_req *set = &request->sync_outputs;

	memset(request, 0, sizeof(*request));
	if (!outputs_wanted(want, index))
		return 0;
	set->option = want->sync_out_enable ? WIRE_SYNC_ON : WIRE_SYNC_OFF;
	set->axis = want->sync_out_axis;
	memcpy(set->pin, want->sync_out_pin, sizeof(set->pin));
	return is_other(want->sync_out_enable, have->option) || set->axis != have->axis ||
	       memcmp(set->pin, have->pin, sizeof(set->pin)) != 0;
}

static void outputs_taken(struct device *device, const union setting_request *request)
{
	device->configure.synced.outputs = request->sync_outputs;
	device->configure.synced.outputs_taken = true;
}

static void outputs_learn(struct device *device, unsigned int index,
			  const union setting_value *value)
{
	struct configure *configure = &device->configure;

	(void)index;
	if (value->sync_outputs.option == WIRE_SYNC_READ && configure->synced.outputs_taken)
		configure->setting[SETTING_SYNC_OUTPUTS].value.sync_outputs =
			configure->synced.outputs;
}

static void outputs_report(struct pokeys_settings *known, unsigned int index,
			   const union setting_value *value)
{
	(void)index;
	if (value->sync_outputs.option == WIRE_SYNC_READ)
		return;
	known->set |= POKEYS_SET_SYNC_OUTPUTS;
	known->sync_out_enable = value->sync_outputs.option == WIRE_SYNC_ON;
	known->sync_out_axis = value->sync_outputs.axis;
	memcpy(known->sync_out_pin, value->sync_outputs.pin, sizeof(known->sync_out_pin));
}

static int64_t outputs_written(const union setting_value *value, unsigned int which)
{
	(void)which;
	return value->sync_outputs.axis;
}

const struct setting_kind setting_sync_outputs = {
	.read = WIRE_OP_PULSE_SYNC_OUTPUTS,
	.write = WIRE_OP_PULSE_SYNC_OUTPUTS,
	.name = POKEYS_SETTING_SYNC_OUTPUTS,
	.has = setting_has_engine,
	.wanted = outputs_wanted,
	.ask = outputs_ask,
	.merge = outputs_merge,
	.learn = outputs_learn,
	.report = outputs_report,
	.written = outputs_written,
	.taken = outputs_taken,
};
