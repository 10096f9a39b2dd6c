/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Pins and encoders: what is read, what is wanted, what is written (protocol
 * sections 3.2 and 3.8).
 *
 * Each setting is one request that reads a whole table and one that replaces
 * it. So wanted values are merged into what the device has: bits that nobody
 * here knows of (key mappings, additional settings) go back as they came.
 */

#include <string.h>
#include "daemon/device/internal.h"

#define PIN_SET(config, pin) ((config)->pin_set[(pin) / 8] >> (pin) % 8 & 1)

static bool always(const struct device *device, unsigned int index)
{
	(void)device;
	(void)index;
	return true;
}

/* Pin functions, 0xC0. */

static bool pins_wanted(const struct device *device, unsigned int index)
{
	(void)index;
	return (pins_load(device->config.pin_set) & OUTPUT_PINS) != 0;
}

static void pins_ask(unsigned int index, union setting_request *request)
{
	(void)index;
	request->pins.option1 = 0;
	request->pins.option2 = 0;
}

static uint64_t pins_merge(const struct device *device, unsigned int index,
			   const union setting_value *value, union setting_request *request)
{
	uint64_t differs = 0;

	(void)index;
	memset(request, 0, sizeof(*request));
	request->pins.option1 = 1;
	memcpy(request->pins.value, value->pins.value, sizeof(request->pins.value));
	for (unsigned int i = 0; i < POKEYS_PINS; i++) {
		if (!PIN_SET(&device->config, i) ||
		    value->pins.value[i] == device->config.pin_function[i])
			continue;
		request->pins.value[i] = device->config.pin_function[i];
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
	pins_store(device->image.digital_out_owned, owned);
}

static int64_t pins_written(const union setting_value *value, unsigned int which)
{
	return value->pins.value[which];
}

static const struct setting_kind setting_pins = {
	.read = WIRE_OP_PIN_ALL, .write = WIRE_OP_PIN_ALL, .has = always, .wanted = pins_wanted,
	.ask = pins_ask, .merge = pins_merge, .learn = pins_learn, .written = pins_written,
};

/* Encoder options, 0xC4. */

static bool has_encoders(const struct device *device, unsigned int index)
{
	(void)index;
	return device->image.capability.basic_encoders > 0;
}

static bool encoders_wanted(const struct device *device, unsigned int index)
{
	(void)index;
	for (unsigned int i = 0; i < WIRE_ENCODER_BASIC; i++) {
		if (device->config.encoder[i].set)
			return true;
	}
	return false;
}

static void ask_by_zeros(unsigned int index, union setting_request *request)
{
	(void)index;
	memset(request, 0, sizeof(*request));
}

static uint8_t encoder_option(const struct device_encoder_config *encoder, uint8_t option)
{
	option &= (uint8_t)~(WIRE_ENC_ENABLE | WIRE_ENC_4X | WIRE_ENC_2X);
	if (encoder->enable)
		option |= WIRE_ENC_ENABLE;
	if (encoder->sampling == 4)
		option |= WIRE_ENC_4X;
	if (encoder->sampling == 2)
		option |= WIRE_ENC_2X;
	return option;
}

static uint64_t options_merge(const struct device *device, unsigned int index,
			      const union setting_value *value, union setting_request *request)
{
	uint64_t differs = 0;

	(void)index;
	memset(request, 0, sizeof(*request));
	request->options.write = 1;
	for (unsigned int i = 0; i < WIRE_ENCODER_BASIC; i++) {
		const uint8_t have = value->options.option[i];
		uint8_t want = have;

		if (device->config.encoder[i].set)
			want = encoder_option(&device->config.encoder[i], have);
		request->options.option[i] = want;
		differs |= (uint64_t)(want != have) << i;
	}
	return differs;
}

static void options_learn(struct device *device, unsigned int index,
			  const union setting_value *value)
{
	(void)index;
	for (unsigned int i = 0; i < WIRE_ENCODER_BASIC; i++) {
		if (value->options.option[i] & WIRE_ENC_ENABLE)
			device->image.encoder_enabled |= UINT32_C(1) << i;
	}
}

static int64_t options_written(const union setting_value *value, unsigned int which)
{
	return value->options.option[which];
}

static const struct setting_kind setting_encoder_options = {
	.read = WIRE_OP_ENCODER_OPTIONS, .write = WIRE_OP_ENCODER_OPTIONS, .has = has_encoders,
	.wanted = encoders_wanted, .ask = ask_by_zeros, .merge = options_merge,
	.learn = options_learn, .written = options_written,
};

/* Encoder pins, 0xC5. */

static uint64_t encoder_pins_merge(const struct device *device, unsigned int index,
				   const union setting_value *value,
				   union setting_request *request)
{
	uint64_t differs = 0;

	(void)index;
	memset(request, 0, sizeof(*request));
	request->encoder_pins.write = 1;
	for (unsigned int i = 0; i < WIRE_ENCODER_BASIC; i++) {
		const struct device_encoder_config *want = &device->config.encoder[i];
		uint8_t a = value->encoder_pins.a[i], b = value->encoder_pins.b[i];

		if (want->set && want->pin_a < POKEYS_PINS)
			a = want->pin_a;
		if (want->set && want->pin_b < POKEYS_PINS)
			b = want->pin_b;
		request->encoder_pins.a[i] = a;
		request->encoder_pins.b[i] = b;
		differs |= (uint64_t)(a != value->encoder_pins.a[i] ||
				      b != value->encoder_pins.b[i]) << i;
	}
	return differs;
}

static void learn_nothing(struct device *device, unsigned int index,
			  const union setting_value *value)
{
	(void)device;
	(void)index;
	(void)value;
}

static int64_t encoder_pins_written(const union setting_value *value, unsigned int which)
{
	return value->encoder_pins.a[which] | value->encoder_pins.b[which] << 8;
}

static const struct setting_kind setting_encoder_pins = {
	.read = WIRE_OP_ENCODER_PINS, .write = WIRE_OP_ENCODER_PINS, .has = has_encoders,
	.wanted = encoders_wanted, .ask = ask_by_zeros, .merge = encoder_pins_merge,
	.learn = learn_nothing, .written = encoder_pins_written,
};

/* Fast encoders, 0xCE: configuration in the low bits, flags of others above. */

#define FAST_CONFIGURATION 0x0F

static bool has_fast(const struct device *device, unsigned int index)
{
	(void)index;
	return device->image.capability.fast_encoders > 0;
}

static bool fast_wanted(const struct device *device, unsigned int index)
{
	(void)index;
	return device->config.fast_encoders >= 0;
}

static void fast_ask(unsigned int index, union setting_request *request)
{
	(void)index;
	request->fast.option = WIRE_FAST_READ;
}

static uint64_t fast_merge(const struct device *device, unsigned int index,
			   const union setting_value *value, union setting_request *request)
{
	const uint8_t flags = value->fast.status & (uint8_t)~FAST_CONFIGURATION;
	const bool on = (value->fast.status & FAST_CONFIGURATION) != WIRE_FAST_OFF;
	const bool want = device->config.fast_encoders > 0;

	(void)index;
	memset(request, 0, sizeof(*request));
	request->fast.option = want ? flags | WIRE_FAST_ON : flags;
	request->fast.index = value->fast.index;
	return on != want;
}

static void fast_learn(struct device *device, unsigned int index, const union setting_value *value)
{
	const uint32_t all = (UINT32_C(1) << device->image.capability.fast_encoders) - 1;

	(void)index;
	if (value->fast.status & FAST_CONFIGURATION)
		device->image.encoder_enabled |= all;
}

static int64_t fast_written(const union setting_value *value, unsigned int which)
{
	(void)which;
	return value->fast.status;
}

static const struct setting_kind setting_fast = {
	.read = WIRE_OP_FAST_ENCODERS, .write = WIRE_OP_FAST_ENCODERS, .has = has_fast,
	.wanted = fast_wanted, .ask = fast_ask, .merge = fast_merge, .learn = fast_learn,
	.written = fast_written,
};

/* Ultra-fast encoder, 0x1C: its own key decides, else that of encoder 25. */

static bool has_ultra(const struct device *device, unsigned int index)
{
	(void)index;
	return device->image.capability.ultra_fast_encoders > 0;
}

static bool ultra_wanted(const struct device *device, unsigned int index)
{
	(void)index;
	return device->config.ultra_fast_encoder >= 0 ||
	       device->config.encoder[WIRE_ENCODER_ULTRA].set;
}

static void ultra_ask(unsigned int index, union setting_request *request)
{
	(void)index;
	request->ultra.mode = WIRE_ULTRA_READ;
}

static uint64_t ultra_merge(const struct device *device, unsigned int index,
			    const union setting_value *value, union setting_request *request)
{
	const struct device_encoder_config *encoder = &device->config.encoder[WIRE_ENCODER_ULTRA];
	const int8_t key = device->config.ultra_fast_encoder;
	uint8_t options = value->ultra.options;
	bool on = value->ultra.status == WIRE_ULTRA_ON;

	(void)index;
	if (encoder->set) {
		on = encoder->enable;
		options &= (uint8_t)~WIRE_ULTRA_4X;
		if (encoder->sampling == 4)
			options |= WIRE_ULTRA_4X;
	}
	if (key >= 0)
		on = key > 0;
	memset(request, 0, sizeof(*request));
	request->ultra.mode = on ? WIRE_ULTRA_ON : WIRE_ULTRA_OFF;
	request->ultra.options = options;
	request->ultra.filter = value->ultra.filter;
	return on != (value->ultra.status == WIRE_ULTRA_ON) || options != value->ultra.options;
}

static void ultra_learn(struct device *device, unsigned int index,
			const union setting_value *value)
{
	(void)index;
	if (value->ultra.status == WIRE_ULTRA_ON)
		device->image.encoder_enabled |= UINT32_C(1) << WIRE_ENCODER_ULTRA;
}

static int64_t ultra_written(const union setting_value *value, unsigned int which)
{
	(void)which;
	return value->ultra.status | value->ultra.options << 8;
}

static const struct setting_kind setting_ultra = {
	.read = WIRE_OP_ULTRA_ENCODER, .write = WIRE_OP_ULTRA_ENCODER, .has = has_ultra,
	.wanted = ultra_wanted, .ask = ultra_ask, .merge = ultra_merge, .learn = ultra_learn,
	.written = ultra_written,
};

const struct setting_kind *setting_kind(unsigned int setting, unsigned int *index)
{
	static const struct setting_kind *const kinds[SETTING_AXIS] = {
		[SETTING_PINS] = &setting_pins,
		[SETTING_ENCODER_OPTIONS] = &setting_encoder_options,
		[SETTING_ENCODER_PINS] = &setting_encoder_pins,
		[SETTING_FAST_ENCODERS] = &setting_fast,
		[SETTING_ULTRA_ENCODER] = &setting_ultra,
		[SETTING_ENGINE] = &setting_engine,
		[SETTING_EMERGENCY] = &setting_emergency,
	};

	*index = setting < SETTING_AXIS ? 0 : setting - SETTING_AXIS;
	return setting < SETTING_AXIS ? kinds[setting] : &setting_axis;
}
