/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Encoders: what is read, what is wanted, what is written (protocol section
 * 3.8).
 *
 * Options are wanted bit by bit, because a key mapping in the upper ones is
 * somebody else's. The fast and the ultra-fast encoders have one byte each
 * and are wanted as a whole: bits 4 to 7 of fast_options travel beside the
 * configuration, bit 0 is the byte that lets the index inputs zero a count.
 */

#include <string.h>
#include "daemon/device/internal.h"

#define FAST_CONFIGURATION 0x0F
#define FAST_INDEX 0x01

static bool has_encoders(const struct device *device, unsigned int index)
{
	(void)index;
	return device->image.capability.basic_encoders > 0;
}

/*
 * Which encoders count, from all three settings that say so. One that begins or
 * ends to count is not known any more.
 */
static void learn_enabled(struct device *device, unsigned int index,
			  const union setting_value *value)
{
	const struct setting *setting = device->configure.setting;
	const uint32_t before = device->image.encoder_enabled;
	uint32_t now = 0;

	(void)index;
	(void)value;
	for (unsigned int i = 0; i < WIRE_ENCODER_BASIC; i++) {
		if (setting[SETTING_ENCODER_OPTIONS].value.options.option[i] & WIRE_ENC_ENABLE)
			now |= UINT32_C(1) << i;
	}
	if (setting[SETTING_FAST_ENCODERS].value.fast.status & FAST_CONFIGURATION)
		now |= (UINT32_C(1) << device->image.capability.fast_encoders) - 1;
	if (setting[SETTING_ULTRA_ENCODER].value.ultra.status == WIRE_ULTRA_ON)
		now |= UINT32_C(1) << WIRE_ENCODER_ULTRA;
	device->image.encoder_enabled = now;
	for (unsigned int i = 0; i < POKEYS_ENCODERS; i++) {
		if ((now ^ before) >> i & 1)
			encoder_forget(&device->encoder[i]);
	}
}

static uint32_t basic_changed(unsigned int number, const union setting_value *before,
			      const union setting_value *now)
{
	uint32_t changed = 0;

	for (unsigned int i = 0; i < WIRE_ENCODER_BASIC; i++) {
		const bool differs = number == SETTING_ENCODER_OPTIONS ?
					     before->options.option[i] != now->options.option[i] :
					     before->encoder_pins.a[i] != now->encoder_pins.a[i] ||
						     before->encoder_pins.b[i] !=
							     now->encoder_pins.b[i];

		changed |= (uint32_t)differs << i;
	}
	return changed;
}

uint32_t setting_encoders_changed(const struct device *device, unsigned int number,
				  const union setting_value *before, const union setting_value *now)
{
	switch (number) {
	case SETTING_ENCODER_OPTIONS:
	case SETTING_ENCODER_PINS:
		return basic_changed(number, before, now);
	case SETTING_FAST_ENCODERS:
		return before->fast.status == now->fast.status ?
			       0 :
			       (UINT32_C(1) << device->image.capability.fast_encoders) - 1;
	case SETTING_ULTRA_ENCODER:
		return before->ultra.status == now->ultra.status &&
				       before->ultra.options == now->ultra.options ?
			       0 :
			       UINT32_C(1) << WIRE_ENCODER_ULTRA;
	default:
		return 0;
	}
}

/* Options, 0xC4. */

static bool options_wanted(const struct pokeys_settings *want, unsigned int index)
{
	(void)index;
	for (unsigned int i = 0; i < WIRE_ENCODER_BASIC; i++) {
		if (want->encoder[i].options_mask)
			return true;
	}
	return false;
}

static uint64_t options_merge(const struct pokeys_settings *want, unsigned int index,
			      const union setting_value *value, union setting_request *request)
{
	uint64_t differs = 0;

	(void)index;
	memset(request, 0, sizeof(*request));
	request->options.write = 1;
	for (unsigned int i = 0; i < WIRE_ENCODER_BASIC; i++) {
		const struct pokeys_encoder_settings *encoder = &want->encoder[i];
		const uint8_t have = value->options.option[i];

		request->options.option[i] = (uint8_t)((have & ~encoder->options_mask) |
						       (encoder->options & encoder->options_mask));
		differs |= (uint64_t)(request->options.option[i] != have) << i;
	}
	return differs;
}

static void options_report(struct pokeys_settings *known, unsigned int index,
			   const union setting_value *value)
{
	(void)index;
	for (unsigned int i = 0; i < WIRE_ENCODER_BASIC; i++) {
		known->encoder[i].options = value->options.option[i];
		known->encoder[i].options_mask = UINT8_MAX;
	}
}

static int64_t options_written(const union setting_value *value, unsigned int which)
{
	return value->options.option[which];
}

const struct setting_kind setting_encoder_options = {
	.read = WIRE_OP_ENCODER_OPTIONS,
	.write = WIRE_OP_ENCODER_OPTIONS,
	.name = POKEYS_SETTING_ENCODER,
	.has = has_encoders,
	.wanted = options_wanted,
	.ask = setting_ask_zeros,
	.merge = options_merge,
	.learn = learn_enabled,
	.report = options_report,
	.written = options_written,
};

/* Pins, 0xC5. */

static bool encoder_pins_wanted(const struct pokeys_settings *want, unsigned int index)
{
	(void)index;
	for (unsigned int i = 0; i < WIRE_ENCODER_BASIC; i++) {
		if (want->encoder[i].pins_set)
			return true;
	}
	return false;
}

static uint64_t encoder_pins_merge(const struct pokeys_settings *want, unsigned int index,
				   const union setting_value *value, union setting_request *request)
{
	const struct wire_encoder_pins_rep *have = &value->encoder_pins;
	uint64_t differs = 0;

	(void)index;
	memset(request, 0, sizeof(*request));
	request->encoder_pins.write = 1;
	for (unsigned int i = 0; i < WIRE_ENCODER_BASIC; i++) {
		const struct pokeys_encoder_settings *encoder = &want->encoder[i];
		const uint8_t a = encoder->pins_set ? encoder->pin_a : have->a[i];
		const uint8_t b = encoder->pins_set ? encoder->pin_b : have->b[i];

		request->encoder_pins.a[i] = a;
		request->encoder_pins.b[i] = b;
		differs |= (uint64_t)(a != have->a[i] || b != have->b[i]) << i;
	}
	return differs;
}

static void encoder_pins_report(struct pokeys_settings *known, unsigned int index,
				const union setting_value *value)
{
	(void)index;
	for (unsigned int i = 0; i < WIRE_ENCODER_BASIC; i++) {
		known->encoder[i].pins_set = 1;
		known->encoder[i].pin_a = value->encoder_pins.a[i];
		known->encoder[i].pin_b = value->encoder_pins.b[i];
	}
}

static int64_t encoder_pins_written(const union setting_value *value, unsigned int which)
{
	return value->encoder_pins.a[which] | value->encoder_pins.b[which] << 8;
}

const struct setting_kind setting_encoder_pins = {
	.read = WIRE_OP_ENCODER_PINS,
	.write = WIRE_OP_ENCODER_PINS,
	.name = POKEYS_SETTING_ENCODER_PINS,
	.has = has_encoders,
	.wanted = encoder_pins_wanted,
	.ask = setting_ask_zeros,
	.merge = encoder_pins_merge,
	.learn = setting_learn_nothing,
	.report = encoder_pins_report,
	.written = encoder_pins_written,
};

/* Fast encoders, 0xCE. */

static bool has_fast(const struct device *device, unsigned int index)
{
	(void)index;
	return device->image.capability.fast_encoders > 0;
}

static bool fast_wanted(const struct pokeys_settings *want, unsigned int index)
{
	(void)index;
	return want->set & POKEYS_SET_FAST_ENCODERS;
}

static void fast_ask(unsigned int index, union setting_request *request)
{
	(void)index;
	request->fast.option = WIRE_FAST_READ;
}

static uint64_t fast_merge(const struct pokeys_settings *want, unsigned int index,
			   const union setting_value *value, union setting_request *request)
{
	struct wire_fast_encoders_req *fast = &request->fast;

	memset(request, 0, sizeof(*request));
	fast->option = value->fast.status;
	fast->index = value->fast.index;
	if (!fast_wanted(want, index))
		return 0;
	fast->option = (uint8_t)((want->fast_configuration & FAST_CONFIGURATION) |
				 (want->fast_options & ~FAST_CONFIGURATION));
	fast->index = want->fast_options & FAST_INDEX;
	return fast->option != value->fast.status ||
	       fast->index != (value->fast.index & FAST_INDEX);
}

static void fast_report(struct pokeys_settings *known, unsigned int index,
			const union setting_value *value)
{
	(void)index;
	known->set |= POKEYS_SET_FAST_ENCODERS;
	known->fast_configuration = value->fast.status & FAST_CONFIGURATION;
	known->fast_options = (uint8_t)((value->fast.status & ~FAST_CONFIGURATION) |
					(value->fast.index & FAST_INDEX));
}

static int64_t fast_written(const union setting_value *value, unsigned int which)
{
	(void)which;
	return value->fast.status;
}

const struct setting_kind setting_fast = {
	.read = WIRE_OP_FAST_ENCODERS,
	.write = WIRE_OP_FAST_ENCODERS,
	.name = POKEYS_SETTING_FAST_ENCODERS,
	.has = has_fast,
	.wanted = fast_wanted,
	.ask = fast_ask,
	.merge = fast_merge,
	.learn = learn_enabled,
	.report = fast_report,
	.written = fast_written,
};

/* Ultra-fast encoder, 0x1C. */

static bool has_ultra(const struct device *device, unsigned int index)
{
	(void)index;
	return device->image.capability.ultra_fast_encoders > 0;
}

static bool ultra_wanted(const struct pokeys_settings *want, unsigned int index)
{
	(void)index;
	return want->set & POKEYS_SET_ULTRA_FAST;
}

static void ultra_ask(unsigned int index, union setting_request *request)
{
	(void)index;
	request->ultra.mode = WIRE_ULTRA_READ;
}

static uint64_t ultra_merge(const struct pokeys_settings *want, unsigned int index,
			    const union setting_value *value, union setting_request *request)
{
	const struct wire_ultra_encoder_rep *have = &value->ultra;

	memset(request, 0, sizeof(*request));
	if (!ultra_wanted(want, index))
		return 0;
	request->ultra.mode = want->ultra_enable ? WIRE_ULTRA_ON : WIRE_ULTRA_OFF;
	request->ultra.options = want->ultra_options;
	request->ultra.filter = want->ultra_filter;
	return request->ultra.mode != have->status || want->ultra_options != have->options ||
	       want->ultra_filter != have->filter;
}

static void ultra_report(struct pokeys_settings *known, unsigned int index,
			 const union setting_value *value)
{
	(void)index;
	known->set |= POKEYS_SET_ULTRA_FAST;
	known->ultra_enable = value->ultra.status;
	known->ultra_options = value->ultra.options;
	known->ultra_filter = value->ultra.filter;
}

static int64_t ultra_written(const union setting_value *value, unsigned int which)
{
	(void)which;
	return value->ultra.status | value->ultra.options << 8;
}

const struct setting_kind setting_ultra = {
	.read = WIRE_OP_ULTRA_ENCODER,
	.write = WIRE_OP_ULTRA_ENCODER,
	.name = POKEYS_SETTING_ULTRA_FAST,
	.has = has_ultra,
	.wanted = ultra_wanted,
	.ask = ultra_ask,
	.merge = ultra_merge,
	.learn = learn_enabled,
	.report = ultra_report,
	.written = ultra_written,
};
