/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What each of those outputs shall be: the commander's wish, or the safe state
 * (protocol sections 3.7, 3.12, 3.13 and 3.24.3).
 *
 * Safe is off: PWM channels are disabled at duty 0, PoExtBus, external outputs
 * and relays are all zero, and so are the data of PoNET modules with outputs;
 * the brightness of a module is nobody's danger and stays. After a loss they are held
 * off likewise (safe.c).
 * What the device has switched on is switched off even if no commander of this
 * daemon's did it: the daemon before may have been killed. What is off already
 * is not touched, so a bus that nobody uses stays as it is; only of a PoNET
 * module nobody can tell what it puts out, so that is written once.
 *
 * Bits that nobody commands keep the value that the device has.
 */

#include <string.h>
#include "daemon/device/internal.h"

/* By the commander that there is. Parts: DEVICE_RESUME_*. */
static bool commanded(const struct device *device, unsigned int part)
{
	return device->intake.fresh && !safe_part(device, part);
}

static bool any(const uint8_t *bytes, size_t count)
{
	for (size_t i = 0; i < count; i++) {
		if (bytes[i])
			return true;
	}
	return false;
}

static uint8_t by_mask(uint8_t have, uint8_t want, uint8_t mask)
{
	return (uint8_t)((have & ~mask) | (want & mask));
}

/* PWM, 0xCB. */

/* A channel that follows an axis is the device's: it keeps the duty that it was seen with. */
static void leave_synced(const struct device *device, union output_value *want)
{
	const struct output *output = &device->outputs.output[OUTPUT_PWM];
	const int channel = setting_synced_channel(device);

	if (channel >= 0)
		want->pwm.duty[channel] = output->known ? output->have.pwm.duty[channel] :
							  device->image.pwm_duty[channel];
}

static bool pwm_commanded(const struct device *device, union output_value *want)
{
	const struct output_wish *wish = &device->intake.output;

	if (wish->pwm_period)
		want->pwm.period = wish->pwm_period;
	want->pwm.enabled = (uint8_t)wish->pwm_enable;
	for (unsigned int i = 0; i < POKEYS_PWM; i++) {
		const uint32_t most = want->pwm.period;

		want->pwm.duty[i] = wish->pwm_duty[i] < most ? wish->pwm_duty[i] : most;
	}
	leave_synced(device, want);
	return want->pwm.period > 0;
}

/* Nobody commands the channels beside those of heaters and servo motors. */
static void pwm_as_it_is(const struct device *device, union output_value *want)
{
	const struct output *output = &device->outputs.output[OUTPUT_PWM];

	want->pwm.enabled = (uint8_t)device->image.pwm_enabled;
	memcpy(want->pwm.duty, device->image.pwm_duty, sizeof(want->pwm.duty));
	if (output->known) {
		want->pwm.enabled = output->have.pwm.enabled;
		memcpy(want->pwm.duty, output->have.pwm.duty, sizeof(want->pwm.duty));
	}
}

static bool pwm_want(const struct device *device, unsigned int index, union output_value *want)
{
	const struct output_wish *wish = &device->intake.output;
	const struct pokeys_state *image = &device->image;
	/* by another program, or from the device's flash memory */
	const unsigned int forbidden = loops_channels_forbidden(device) & image->pwm_enabled;
	bool wanted = false;

	(void)index;
	if (!image->capability.pwm)
		return false;
	want->pwm.write = 1;
	want->pwm.period = image->pwm_period;
	if (safe_part(device, DEVICE_RESUME_PWM))
		wanted = image->pwm_enabled || device->outputs.output[OUTPUT_PWM].driven;
	else if (commanded(device, DEVICE_RESUME_PWM) && wish->pwm)
		wanted = pwm_commanded(device, want);
	else if (loops_channels(device) || forbidden)
		pwm_as_it_is(device, want);
	loops_pwm(device, &want->pwm);
	return wanted || forbidden || (loops_channels(device) && want->pwm.period > 0);
}

static void pwm_learn(struct device *device, const union output_value *value)
{
	struct wire_pwm_rep pwm = { .enabled = value->pwm.enabled, .period = value->pwm.period };

	memcpy(pwm.duty, value->pwm.duty, sizeof(pwm.duty));
	decode_pwm(device, &pwm);
}

/* PoExtBus, 0xDA. */

static bool bus_want(const struct device *device, unsigned int index, union output_value *want)
{
	const struct output_wish *wish = &device->intake.output;
	const struct setting *setup = &device->configure.setting[SETTING_POEXTBUS];
	const uint8_t *have = device->image.poextbus;

	(void)index;
	if (!device->image.capability.poextbus)
		return false;
	want->poextbus.option = WIRE_POEXTBUS_WRITE;
	want->poextbus.connector = setup->value.poextbus.connector;
	want->poextbus.no_crc = setup->value.poextbus.no_crc;
	if (safe_part(device, DEVICE_RESUME_POEXTBUS))
		return any(have, POKEYS_POEXTBUS) || device->outputs.output[OUTPUT_POEXTBUS].driven;
	for (unsigned int i = 0; i < POKEYS_POEXTBUS; i++)
		want->poextbus.data[i] = by_mask(have[i], wish->poextbus[i],
						 wish->poextbus_mask[i]);
	return commanded(device, DEVICE_RESUME_POEXTBUS) &&
	       any(wish->poextbus_mask, POKEYS_POEXTBUS);
}

static void bus_learn(struct device *device, const union output_value *value)
{
	memcpy(device->image.poextbus, value->poextbus.data, sizeof(value->poextbus.data));
}

/* External outputs and relays, 0x85/04. */

static bool external_want(const struct device *device, unsigned int index, union output_value *want)
{
	const struct output_wish *wish = &device->intake.output;
	const struct pokeys_engine *engine = &device->image.engine;

	(void)index;
	if (device->image.capability.pulse_engine < 2)
		return false;
	if (safe_part(device, DEVICE_RESUME_EXTERNAL))
		return engine->relays || engine->outputs ||
		       device->outputs.output[OUTPUT_EXTERNAL].driven;
	want->external.relays = by_mask(engine->relays, wish->relays, wish->relays_mask);
	want->external.oc = by_mask(engine->outputs, wish->external, wish->external_mask);
	/* the bits beside the commanded ones must be known first */
	return commanded(device, DEVICE_RESUME_EXTERNAL) &&
	       (wish->relays_mask || wish->external_mask) &&
	       (device->plan.slow[SLOW_EXTERNAL].answered ||
		(wish->relays_mask & wish->external_mask) == UINT8_MAX);
}

static void external_learn(struct device *device, const union output_value *value)
{
	device->image.engine.relays = value->external.relays;
	device->image.engine.outputs = value->external.oc;
}

/* PoNET: data 0xDD/55, brightness 0xDD/70. */

static bool writable(const struct device *device, unsigned int module)
{
	const struct pokeys_ponet_module *m = &device->image.ponet[module];

	return m->type && m->options & WIRE_PONET_OPT_OUTPUTS;
}

static bool is_keyboard(const struct device *device, unsigned int module, uint8_t flag)
{
	return device->image.kbd48_module == module && device->intake.output.kbd48_flags & flag;
}

static bool ponet_want(const struct device *device, unsigned int index, union output_value *want)
{
	const struct output_wish *wish = &device->intake.output;

	if (!writable(device, index))
		return false;
	want->ponet.module = (uint8_t)index;
	if (safe_part(device, DEVICE_RESUME_PONET))
		return true;
	if (is_keyboard(device, index, POKEYS_KBD48_LEDS))
		wire_kbd48_data(wish->kbd48_leds, want->ponet.data);
	else if (wish->ponet_mask >> index & 1)
		memcpy(want->ponet.data, wish->ponet_data[index], sizeof(want->ponet.data));
	else
		return false;
	return commanded(device, DEVICE_RESUME_PONET);
}

static bool brightness_want(const struct device *device, unsigned int index,
			    union output_value *want)
{
	const struct output_wish *wish = &device->intake.output;

	if (!device->intake.fresh || device->safe.wanted || !device->image.ponet[index].type)
		return false;
	want->brightness.module = (uint8_t)index;
	want->brightness.brightness = wish->ponet_brightness[index];
	if (is_keyboard(device, index, POKEYS_KBD48_BRIGHTNESS))
		want->brightness.brightness = wish->kbd48_brightness;
	else if (!(wish->ponet_mask >> index & 1))
		return false;
	return true;
}

static bool ponet_done(const mailbox_entry_t *entry)
{
	struct wire_bus_result_rep reply;

	wire_ponet_set_data_decode_rep(entry->response_buffer, &reply);
	return reply.result == WIRE_BUS_OK;
}

const struct output_kind *output_kind(unsigned int place, unsigned int *index)
{
	static const struct output_kind single[OUTPUT_PONET] = {
		[OUTPUT_PWM] = {
			.op = WIRE_OP_PWM, .part = DEVICE_RESUME_PWM, .carrier = SETTING_PWM,
			.want = pwm_want, .learn = pwm_learn,
		},
		[OUTPUT_POEXTBUS] = {
			.op = WIRE_OP_POEXTBUS, .part = DEVICE_RESUME_POEXTBUS,
			.carrier = SETTING_POEXTBUS, .want = bus_want, .learn = bus_learn,
		},
		[OUTPUT_EXTERNAL] = {
			.op = WIRE_OP_PULSE_OUTPUTS, .part = DEVICE_RESUME_EXTERNAL,
			.carrier = SETTINGS, .want = external_want, .learn = external_learn,
		},
	};
	static const struct output_kind ponet = {
		.op = WIRE_OP_PONET_SET_DATA,
		.part = DEVICE_RESUME_PONET,
		.carrier = SETTINGS,
		.want = ponet_want,
		.done = ponet_done,
	};
	static const struct output_kind brightness = {
		.op = WIRE_OP_PONET_PWM,
		.part = DEVICE_RESUME_PONET,
		.carrier = SETTINGS,
		.want = brightness_want,
		.done = ponet_done,
	};

	*index = place < OUTPUT_PONET ? 0 : (place - OUTPUT_PONET) % POKEYS_PONET;
	if (place < OUTPUT_PONET)
		return &single[place];
	return place < OUTPUT_BRIGHTNESS ? &ponet : &brightness;
}

bool output_is_shown(const struct device *device, unsigned int place,
		     const union output_value *value)
{
	const struct pokeys_state *image = &device->image;

	switch (place) {
	case OUTPUT_PWM:
		return value->pwm.enabled == image->pwm_enabled &&
		       value->pwm.period == image->pwm_period &&
		       !memcmp(value->pwm.duty, image->pwm_duty, sizeof(image->pwm_duty));
	case OUTPUT_POEXTBUS:
		return !memcmp(value->poextbus.data, image->poextbus, POKEYS_POEXTBUS);
	case OUTPUT_EXTERNAL:
		return value->external.relays == image->engine.relays &&
		       value->external.oc == image->engine.outputs;
	default:
		return true;
	}
}
