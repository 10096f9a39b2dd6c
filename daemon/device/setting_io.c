/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * PWM period, analog filter and PoExtBus: what is read, what is wanted, what is
 * written (protocol sections 3.6, 3.7 and 3.12).
 *
 * Period and duties of the PWM travel in one request, and so do PoExtBus' setup
 * and its data. So a write carries outputs: those that are wanted when it is sent, for
 * it may have waited for the machine to be switched off, and the spindle with it. Duties
 * above a new period end at it, for the sources do not say what a device makes of them.
 */

#include <string.h>
#include "daemon/device/internal.h"

/* 0xCB */

static bool has_pwm(const struct device *device, unsigned int index)
{
	(void)index;
	return device->image.capability.pwm > 0;
}

static bool pwm_wanted(const struct pokeys_settings *want, unsigned int index)
{
	(void)index;
	return want->set & POKEYS_SET_PWM_PERIOD;
}

static uint64_t pwm_merge(const struct pokeys_settings *want, unsigned int index,
			  const union setting_value *value, union setting_request *request)
{
	struct wire_pwm_req *pwm = &request->pwm;

	memset(request, 0, sizeof(*request));
	if (!pwm_wanted(want, index))
		return 0;
	pwm->write = 1;
	pwm->period = want->pwm_period;
	return pwm->period != value->pwm.period;
}

static bool pwm_take_along(struct device *device, union setting_request *request)
{
	struct wire_pwm_req *pwm = &request->pwm;
	union output_value now = { .pwm.enabled = (uint8_t)device->image.pwm_enabled };

	memcpy(now.pwm.duty, device->image.pwm_duty, sizeof(now.pwm.duty));
	if (!output_take_along(device, OUTPUT_PWM, &now))
		return false;
	pwm->enabled = now.pwm.enabled;
	for (unsigned int i = 0; i < WIRE_PWMS; i++)
		pwm->duty[i] = now.pwm.duty[i] < pwm->period ? now.pwm.duty[i] : pwm->period;
	loops_pwm(device, pwm); /* for this period */
	return true;
}

/* What it says about outputs is not older than their last write. */
static bool shows_outputs(const struct device *device, enum output_place place,
			  enum setting_index number)
{
	return output_readable(device, place, device->configure.setting[number].asked_ns);
}

static void pwm_learn(struct device *device, unsigned int index, const union setting_value *value)
{
	(void)index;
	if (!shows_outputs(device, OUTPUT_PWM, SETTING_PWM)) {
		/* outputs are written with the period that there is, if no other is commanded */
		if (!device->intake.output.pwm_period)
			device->image.pwm_period = value->pwm.period;
		return;
	}
	decode_pwm(device, &value->pwm);
	output_seen(device, OUTPUT_PWM);
}

/* Outputs that are written from now on have this period, also before it is read back. */
static void pwm_taken(struct device *device, const union setting_request *request)
{
	device->image.pwm_period = request->pwm.period;
}

static void pwm_report(struct pokeys_settings *known, unsigned int index,
		       const union setting_value *value)
{
	(void)index;
	known->set |= POKEYS_SET_PWM_PERIOD;
	known->pwm_period = value->pwm.period;
}

static int64_t pwm_written(const union setting_value *value, unsigned int which)
{
	(void)which;
	return value->pwm.period;
}

const struct setting_kind setting_pwm = {
	.read = WIRE_OP_PWM,
	.write = WIRE_OP_PWM,
	.name = POKEYS_SETTING_PWM,
	.has = has_pwm,
	.wanted = pwm_wanted,
	.ask = setting_ask_zeros,
	.merge = pwm_merge,
	.take_along = pwm_take_along,
	.taken = pwm_taken,
	.learn = pwm_learn,
	.report = pwm_report,
	.written = pwm_written,
};

/* 0x38 and 0x39 */

static bool has_filter(const struct device *device, unsigned int index)
{
	(void)index;
	return device->image.capability.analog_filtering > 0;
}

static bool filter_wanted(const struct pokeys_settings *want, unsigned int index)
{
	(void)index;
	return want->set & POKEYS_SET_ANALOG_FILTER;
}

static uint64_t filter_merge(const struct pokeys_settings *want, unsigned int index,
			     const union setting_value *value, union setting_request *request)
{
	memset(request, 0, sizeof(*request));
	request->filter.rc = want->analog_filter;
	return filter_wanted(want, index) && want->analog_filter != value->filter.rc;
}

static void filter_report(struct pokeys_settings *known, unsigned int index,
			  const union setting_value *value)
{
	(void)index;
	known->set |= POKEYS_SET_ANALOG_FILTER;
	known->analog_filter = value->filter.rc;
}

static int64_t filter_written(const union setting_value *value, unsigned int which)
{
	(void)which;
	return value->filter.rc;
}

const struct setting_kind setting_filter = {
	.read = WIRE_OP_FILTER_GET,
	.write = WIRE_OP_FILTER_SET,
	.name = POKEYS_SETTING_ANALOG_FILTER,
	.has = has_filter,
	.wanted = filter_wanted,
	.ask = setting_ask_zeros,
	.merge = filter_merge,
	.learn = setting_learn_nothing,
	.report = filter_report,
	.written = filter_written,
};

/* 0xDA */

static bool has_bus(const struct device *device, unsigned int index)
{
	(void)index;
	return device->image.capability.poextbus > 0;
}

static bool bus_wanted(const struct pokeys_settings *want, unsigned int index)
{
	(void)index;
	return want->set & POKEYS_SET_POEXTBUS;
}

static void bus_ask(unsigned int index, union setting_request *request)
{
	setting_ask_zeros(index, request);
	request->poextbus.option = WIRE_POEXTBUS_READ;
}

static uint64_t bus_merge(const struct pokeys_settings *want, unsigned int index,
			  const union setting_value *value, union setting_request *request)
{
	const struct wire_poextbus_rep *have = &value->poextbus;

	memset(request, 0, sizeof(*request));
	if (!bus_wanted(want, index))
		return 0;
	request->poextbus.option = WIRE_POEXTBUS_WRITE;
	request->poextbus.connector = want->poextbus_connector;
	request->poextbus.no_crc = want->poextbus_no_crc;
	return want->poextbus_connector != have->connector ||
	       !want->poextbus_no_crc != !have->no_crc;
}

static bool bus_take_along(struct device *device, union setting_request *request)
{
	union output_value now;

	memcpy(now.poextbus.data, device->image.poextbus, sizeof(now.poextbus.data));
	if (!output_take_along(device, OUTPUT_POEXTBUS, &now))
		return false;
	memcpy(request->poextbus.data, now.poextbus.data, sizeof(now.poextbus.data));
	return true;
}

static void bus_learn(struct device *device, unsigned int index, const union setting_value *value)
{
	(void)index;
	if (!shows_outputs(device, OUTPUT_POEXTBUS, SETTING_POEXTBUS))
		return;
	memcpy(device->image.poextbus, value->poextbus.data, sizeof(value->poextbus.data));
	output_seen(device, OUTPUT_POEXTBUS);
}

static void bus_report(struct pokeys_settings *known, unsigned int index,
		       const union setting_value *value)
{
	(void)index;
	known->set |= POKEYS_SET_POEXTBUS;
	known->poextbus_connector = value->poextbus.connector;
	known->poextbus_no_crc = value->poextbus.no_crc > 0;
}

static int64_t bus_written(const union setting_value *value, unsigned int which)
{
	(void)which;
	return value->poextbus.connector | value->poextbus.no_crc << 8;
}

const struct setting_kind setting_poextbus = {
	.read = WIRE_OP_POEXTBUS,
	.write = WIRE_OP_POEXTBUS,
	.name = POKEYS_SETTING_POEXTBUS,
	.has = has_bus,
	.wanted = bus_wanted,
	.ask = bus_ask,
	.merge = bus_merge,
	.take_along = bus_take_along,
	.learn = bus_learn,
	.report = bus_report,
	.written = bus_written,
};
