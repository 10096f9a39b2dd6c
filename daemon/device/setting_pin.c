/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Pin functions: what is read, what is wanted, what is written (protocol
 * section 3.2).
 *
 * 0xC0 takes any byte for any pin, also one that the pin cannot do, and says
 * nothing. So what was written is read back as with every setting, and what a
 * pin can do is judged where the wish comes in.
 */

#include <string.h>
#include "daemon/device/internal.h"

static bool pins_wanted(const struct pokeys_settings *want, unsigned int index)
{
	(void)index;
	return (pins_load(want->pin_set) & OUTPUT_PINS) != 0;
}

static uint64_t pins_merge(const struct pokeys_settings *want, unsigned int index,
			   const union setting_value *value, union setting_request *request)
{
	const uint64_t set = pins_load(want->pin_set);
	uint64_t differs = 0;

	(void)index;
	memset(request, 0, sizeof(*request));
	request->pins.option1 = 1;
	memcpy(request->pins.value, value->pins.value, sizeof(request->pins.value));
	for (unsigned int i = 0; i < POKEYS_PINS; i++) {
		if (!(set >> i & 1) || value->pins.value[i] == want->pin_function[i])
			continue;
		request->pins.value[i] = want->pin_function[i];
		differs |= UINT64_C(1) << i;
	}
	return differs;
}

static void pins_learn(struct device *device, unsigned int index, const union setting_value *value)
{
	uint64_t owned = 0;

	(void)index;
	memcpy(device->image.pin_function, value->pins.value, sizeof(value->pins.value));
	for (unsigned int i = 0; i < POKEYS_PINS; i++)
		owned |= (uint64_t)!!(value->pins.value[i] & WIRE_PIN_OUTPUT) << i;
	pins_store(device->image.digital_out_owned, owned & ~loops_pins(device));
	slow_counters(device);
}

static void pins_report(struct pokeys_settings *known, unsigned int index,
			const union setting_value *value)
{
	(void)index;
	pins_store(known->pin_set, OUTPUT_PINS);
	memcpy(known->pin_function, value->pins.value, sizeof(value->pins.value));
}

static int64_t pins_written(const union setting_value *value, unsigned int which)
{
	return value->pins.value[which];
}

const struct setting_kind setting_pins = {
	.read = WIRE_OP_PIN_ALL,
	.write = WIRE_OP_PIN_ALL,
	.name = POKEYS_SETTING_PIN,
	.has = setting_always,
	.wanted = pins_wanted,
	.ask = setting_ask_zeros,
	.merge = pins_merge,
	.learn = pins_learn,
	.report = pins_report,
	.written = pins_written,
};
