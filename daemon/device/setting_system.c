/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Name and failsafe: what is read, what is wanted, what is written (protocol
 * sections 2.1 and 3.21).
 *
 * The failsafe is the device's own watchdog: whatever becomes of this daemon or
 * of the cable, the device itself takes its outputs back when nobody talks to
 * it. So it is set up before the link runs and read back like everything else;
 * the state image says whether it is as wanted. It is not saved to flash. A
 * device that does not take it, because it is locked or of old, runs without: it
 * is a second net, and wanted unless somebody says otherwise.
 */

#include <string.h>
#include "daemon/device/internal.h"

/* 0x06 */

static bool has_name(const struct device *device, unsigned int index)
{
	(void)index;
	return device->image.capability.custom_name > 0;
}

static bool name_wanted(const struct pokeys_settings *want, unsigned int index)
{
	(void)index;
	return want->set & POKEYS_SET_NAME;
}

static uint64_t name_merge(const struct pokeys_settings *want, unsigned int index,
			   const union setting_value *value, union setting_request *request)
{
	struct wire_device_name_req *name = &request->name;
	char label[sizeof(name->long_name)];

	memset(request, 0, sizeof(*request));
	if (!name_wanted(want, index))
		return 0;
	name->flags = WIRE_NAME_WRITE;
	name->use_long = 1;
	name->product_offset = value->name.product_offset;
	memcpy(name->joystick, value->name.joystick, sizeof(name->joystick));
	memcpy(name->long_name, want->name, strnlen(want->name, sizeof(name->long_name) - 1));
	memcpy(name->name, name->long_name, sizeof(name->name) - 1);
	wire_device_label(&value->name, label);
	return strncmp(label, name->long_name, sizeof(label)) != 0;
}

static void name_learn(struct device *device, unsigned int index, const union setting_value *value)
{
	char label[21];

	(void)index;
	wire_device_label(&value->name, label);
	memset(device->image.identity.name, 0, sizeof(device->image.identity.name));
	memcpy(device->image.identity.name, label, sizeof(label));
}

static void name_report(struct pokeys_settings *known, unsigned int index,
			const union setting_value *value)
{
	char label[21];

	(void)index;
	known->set |= POKEYS_SET_NAME;
	wire_device_label(&value->name, label);
	memset(known->name, 0, sizeof(known->name));
	memcpy(known->name, label, sizeof(label));
}

static int64_t name_written(const union setting_value *value, unsigned int which)
{
	(void)value;
	(void)which;
	return 0;
}

const struct setting_kind setting_name = {
	.read = WIRE_OP_DEVICE_NAME,
	.write = WIRE_OP_DEVICE_NAME,
	.name = POKEYS_SETTING_NAME,
	.has = has_name,
	.wanted = name_wanted,
	.ask = setting_ask_zeros,
	.merge = name_merge,
	.learn = name_learn,
	.report = name_report,
	.written = name_written,
};

/* 0x81 */

static bool has_failsafe(const struct device *device, unsigned int index)
{
	(void)index;
	return device->image.capability.failsafe > 0;
}

static bool failsafe_wanted(const struct pokeys_settings *want, unsigned int index)
{
	(void)index;
	return want->set & POKEYS_SET_FAILSAFE;
}

static uint64_t failsafe_merge(const struct pokeys_settings *want, unsigned int index,
			       const union setting_value *value, union setting_request *request)
{
	struct wire_failsafe_req *failsafe = &request->failsafe;
	const struct wire_failsafe_req *have = &value->failsafe;

	memset(request, 0, sizeof(*request));
	if (!failsafe_wanted(want, index))
		return 0;
	failsafe->write = 1;
	failsafe->timeout = want->failsafe_timeout;
	failsafe->peripherals = want->failsafe_peripherals;
	failsafe->outputs = pins_load(want->failsafe_outputs) & OUTPUT_PINS;
	memcpy(failsafe->poextbus, want->failsafe_poextbus, sizeof(failsafe->poextbus));
	memcpy(failsafe->pwm_percent, want->failsafe_pwm, sizeof(failsafe->pwm_percent));
	return failsafe->timeout != have->timeout || failsafe->peripherals != have->peripherals ||
	       failsafe->outputs != (have->outputs & OUTPUT_PINS) ||
	       memcmp(failsafe->poextbus, have->poextbus, sizeof(have->poextbus)) != 0 ||
	       memcmp(failsafe->pwm_percent, have->pwm_percent, sizeof(have->pwm_percent)) != 0;
}

static bool failsafe_take_along(struct device *device, union setting_request *request)
{
	life_failsafe_sent(device, &request->failsafe);
	return true;
}

static void failsafe_learn(struct device *device, unsigned int index,
			   const union setting_value *value)
{
	(void)index;
	life_failsafe_read(device, &value->failsafe);
}

static void failsafe_report(struct pokeys_settings *known, unsigned int index,
			    const union setting_value *value)
{
	const struct wire_failsafe_req *have = &value->failsafe;

	(void)index;
	known->set |= POKEYS_SET_FAILSAFE;
	known->failsafe_timeout = have->timeout;
	known->failsafe_peripherals = have->peripherals;
	pins_store(known->failsafe_outputs, have->outputs & OUTPUT_PINS);
	memcpy(known->failsafe_poextbus, have->poextbus, sizeof(have->poextbus));
	memcpy(known->failsafe_pwm, have->pwm_percent, sizeof(have->pwm_percent));
}

static int64_t failsafe_written(const union setting_value *value, unsigned int which)
{
	(void)which;
	return value->failsafe.timeout | value->failsafe.peripherals << 8;
}

const struct setting_kind setting_failsafe = {
	.read = WIRE_OP_FAILSAFE,
	.write = WIRE_OP_FAILSAFE,
	.name = POKEYS_SETTING_FAILSAFE,
	.dispensable = true,
	.has = has_failsafe,
	.wanted = failsafe_wanted,
	.ask = setting_ask_zeros,
	.merge = failsafe_merge,
	.take_along = failsafe_take_along,
	.learn = failsafe_learn,
	.report = failsafe_report,
	.written = failsafe_written,
};

const struct wire_failsafe_req *failsafe_known(const struct device *device)
{
	const struct setting *setting = &device->configure.setting[SETTING_FAILSAFE];

	return setting->known ? &setting->value.failsafe : NULL;
}

enum pokeys_failsafe failsafe_state(const struct device *device)
{
	const struct setting *setting = &device->configure.setting[SETTING_FAILSAFE];
	const struct wire_failsafe_req *have = failsafe_known(device);
	const struct pokeys_settings *wanted = &device->wishes.wanted;
	union setting_request request;

	if (!have)
		return POKEYS_FAILSAFE_UNKNOWN;
	if (!have->timeout || !have->peripherals)
		return POKEYS_FAILSAFE_OFF;
	return failsafe_wanted(wanted, 0) && !failsafe_merge(wanted, 0, &setting->value, &request) ?
		       POKEYS_FAILSAFE_ARMED :
		       POKEYS_FAILSAFE_OTHER;
}
