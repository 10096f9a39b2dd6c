/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The parts of struct pokeys_settings: which bit, which members, what is in
 * range. One table serves both to lay one struct over another and to refuse a
 * single part, so neither can forget one.
 *
 * What is judged here is only what would be nonsense for any device. What this
 * one does not take shows when the setting is read back.
 */

#include <string.h>
#include "daemon/device/wish.h"
#include "wire/encoder.h"
#include "wire/pulse.h"
#include "wire/system.h"

/* Neighbouring members that one bit of `set` stands for. */
struct part {
	uint32_t bit;
	uint16_t offset, size;
	uint8_t name; /* enum pokeys_setting */
	bool (*good)(const struct pokeys_settings *);
};

static bool fast_good(const struct pokeys_settings *s)
{
	return (s->fast_configuration == WIRE_FAST_OFF || s->fast_configuration == WIRE_FAST_OLD ||
		s->fast_configuration == WIRE_FAST_ON) &&
	       !(s->fast_options & 0x0E);
}

static bool ultra_good(const struct pokeys_settings *s)
{
	return s->ultra_enable <= 1 && s->ultra_options <= 7;
}

static bool period_good(const struct pokeys_settings *s)
{
	return s->pwm_period > 0;
}

static bool axes_good(const struct pokeys_settings *s)
{
	return s->axes <= POKEYS_AXES;
}

static bool pump_good(const struct pokeys_settings *s)
{
	return s->charge_pump <= 1 || (s->charge_pump >= 10 && s->charge_pump <= POKEYS_PINS + 10);
}

static bool generator_good(const struct pokeys_settings *s)
{
	return (s->generator & WIRE_GENERATOR_TYPE) <= WIRE_GENERATOR_SMART &&
	       !(s->generator & 0x30);
}

static bool invert_good(const struct pokeys_settings *s)
{
	return s->emergency_invert <= 1;
}

static bool emergency_good(const struct pokeys_settings *s)
{
	return s->emergency_pin <= 1 || (s->emergency_pin > WIRE_EMERGENCY_PIN_BASE &&
					 s->emergency_pin <= WIRE_EMERGENCY_PIN_BASE + POKEYS_PINS);
}

static bool power_good(const struct pokeys_settings *s)
{
	return !(s->power_states & 0x88);
}

static bool failsafe_good(const struct pokeys_settings *s)
{
	for (unsigned int i = 0; i < POKEYS_PWM; i++) {
		if (s->failsafe_pwm[i] > 100)
			return false;
	}
	return s->failsafe_peripherals <= 0x0F && !(s->failsafe_outputs[6] & 0x80) &&
	       !s->failsafe_outputs[7];
}

static bool matrix_good(const struct pokeys_settings *s)
{
	if (s->matrix_enable > 1 || s->matrix_rows < 1 || s->matrix_rows > 16 ||
	    s->matrix_columns < 1 || s->matrix_columns > 8)
		return false;
	for (unsigned int i = 0; i < s->matrix_rows; i++) {
		if (s->matrix_row_pin[i] >= POKEYS_PINS)
			return false;
	}
	for (unsigned int i = 0; i < s->matrix_columns; i++) {
		if (s->matrix_column_pin[i] >= POKEYS_PINS)
			return false;
	}
	return true;
}

static bool name_good(const struct pokeys_settings *s)
{
	const size_t length = strnlen(s->name, sizeof(s->name));

	for (size_t i = 0; i < length; i++) {
		if (s->name[i] < ' ' || s->name[i] > '~')
			return false;
	}
	return length > 0 && length <= 20;
}

static bool bus_good(const struct pokeys_settings *s)
{
	return s->poextbus_connector <= 1 && s->poextbus_no_crc <= 1;
}

static bool backlash_good(const struct pokeys_settings *s)
{
	return s->backlash_enable <= 1;
}

static bool postep_good(const struct pokeys_settings *s)
{
	return s->postep_enable <= 1;
}

static bool sync_pwm_good(const struct pokeys_settings *s)
{
	return s->sync_pwm_enable <= 1 && s->sync_pwm_axis < POKEYS_AXES &&
	       s->sync_pwm_channel < POKEYS_PWM;
}

static bool sync_outputs_good(const struct pokeys_settings *s)
{
	for (unsigned int i = 0; i < sizeof(s->sync_out_pin); i++) {
		const uint8_t pin = s->sync_out_pin[i];

		if (pin > POKEYS_PINS &&
		    (pin < WIRE_SYNC_EXTERNAL_FIRST || pin > WIRE_SYNC_EXTERNAL_LAST))
			return false;
	}
	return s->sync_out_enable <= 1 && s->sync_out_axis < POKEYS_AXES;
}

static bool threading_good(const struct pokeys_settings *s)
{
	return s->threading_mode <= 3;
}

#define FROM(member) offsetof(struct pokeys_settings, member)
#define END(member) (FROM(member) + sizeof(((struct pokeys_settings *)0)->member))
#define PART(NAME, first, last, setting, good) \
	{ POKEYS_SET_##NAME, FROM(first), END(last) - FROM(first), POKEYS_SETTING_##setting, good }

static const struct part parts[] = {
	PART(FAST_ENCODERS, fast_configuration, fast_options, FAST_ENCODERS, fast_good),
	PART(ULTRA_FAST, ultra_enable, ultra_filter, ULTRA_FAST, ultra_good),
	PART(PWM_PERIOD, pwm_period, pwm_period, PWM, period_good),
	PART(ANALOG_FILTER, analog_filter, analog_filter, ANALOG_FILTER, NULL),
	PART(AXES, axes, axes, ENGINE, axes_good),
	PART(CHARGE_PUMP, charge_pump, charge_pump, ENGINE, pump_good),
	PART(GENERATOR, generator, generator, ENGINE, generator_good),
	PART(EMERGENCY_INVERT, emergency_invert, emergency_invert, ENGINE, invert_good),
	PART(EMERGENCY_PIN, emergency_pin, emergency_pin, EMERGENCY, emergency_good),
	PART(POWER_STATES, power_states, power_states, ENGINE, power_good),
	PART(FAILSAFE, failsafe_timeout, failsafe_pwm, FAILSAFE, failsafe_good),
	PART(MATRIX, matrix_enable, matrix_column_pin, MATRIX, matrix_good),
	PART(NAME, name, name, NAME, name_good),
	PART(POEXTBUS, poextbus_connector, poextbus_no_crc, POEXTBUS, bus_good),
	PART(BACKLASH, backlash_enable, backlash_enable, BACKLASH, backlash_good),
	PART(BACKLASH_SPEED, backlash_speed, backlash_speed, BACKLASH, NULL),
	PART(POSTEP, postep_enable, postep_enable, POSTEP, postep_good),
	PART(SYNC_PWM, sync_pwm_enable, sync_pwm_channel, SYNC_PWM, sync_pwm_good),
	PART(SYNC_OUTPUTS, sync_out_enable, sync_out_pin, SYNC_OUTPUTS, sync_outputs_good),
	PART(THREADING, threading_mode, threading_position_gain, THREADING, threading_good),
};

enum { PARTS = sizeof(parts) / sizeof(parts[0]) };

static void lay_encoder(struct pokeys_encoder_settings *to,
			const struct pokeys_encoder_settings *from)
{
	to->options = wish_lay_bits(to->options, from->options, from->options_mask);
	to->options_mask |= from->options_mask;
	if (!from->pins_set)
		return;
	to->pins_set = 1;
	to->pin_a = from->pin_a;
	to->pin_b = from->pin_b;
}

void wish_lay(struct pokeys_settings *to, const struct pokeys_settings *from)
{
	for (unsigned int i = 0; i < PARTS; i++) {
		if (from->set & parts[i].bit)
			wish_lay_span(to, from, parts[i].offset, parts[i].size);
	}
	to->set |= from->set;
	for (unsigned int i = 0; i < POKEYS_PINS; i++) {
		if (!(from->pin_set[i / 8] >> i % 8 & 1))
			continue;
		to->pin_set[i / 8] |= (uint8_t)(1u << i % 8);
		to->pin_function[i] = from->pin_function[i];
	}
	for (unsigned int i = 0; i < WIRE_ENCODER_BASIC; i++)
		lay_encoder(&to->encoder[i], &from->encoder[i]);
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		wish_lay_axis(&to->axis[i], &from->axis[i]);
}

static void judge_pin(struct wish_judge *judge, unsigned int i)
{
	const uint8_t bit = (uint8_t)(1u << i % 8);
	struct pokeys_settings *now = judge->now;

	if (!(now->pin_set[i / 8] & bit))
		return;
	if (i < POKEYS_PINS && !(now->pin_function[i] & ~judge->pin_can[i]))
		return;
	now->pin_set[i / 8] = wish_lay_bits(now->pin_set[i / 8], judge->old->pin_set[i / 8], bit);
	if (i < POKEYS_PINS)
		now->pin_function[i] = judge->old->pin_function[i];
	judge->refuse(judge->context, POKEYS_SETTING_PIN, (uint8_t)i, 0);
}

static bool encoder_pin_good(uint8_t pin)
{
	return pin < POKEYS_PINS || pin == UINT8_MAX;
}

static void judge_encoder(struct wish_judge *judge, unsigned int i)
{
	struct pokeys_encoder_settings *encoder = &judge->now->encoder[i];
	const struct pokeys_encoder_settings *old = &judge->old->encoder[i];

	if (!encoder->pins_set ||
	    (encoder_pin_good(encoder->pin_a) && encoder_pin_good(encoder->pin_b)))
		return;
	encoder->pins_set = old->pins_set;
	encoder->pin_a = old->pin_a;
	encoder->pin_b = old->pin_b;
	judge->refuse(judge->context, POKEYS_SETTING_ENCODER_PINS, (uint8_t)i, 0);
}

void wish_judge(struct wish_judge *judge)
{
	struct pokeys_settings *now = judge->now;

	for (unsigned int i = 0; i < PARTS; i++) {
		if (!(now->set & parts[i].bit) || !parts[i].good || parts[i].good(now))
			continue;
		wish_lay_span(now, judge->old, parts[i].offset, parts[i].size);
		wish_restore(&now->set, judge->old->set, parts[i].bit);
		judge->refuse(judge->context, (enum pokeys_setting)parts[i].name, 0, 0);
	}
	for (unsigned int i = 0; i < POKEYS_PIN_BYTES * 8; i++)
		judge_pin(judge, i);
	for (unsigned int i = 0; i < WIRE_ENCODER_BASIC; i++)
		judge_encoder(judge, i);
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		wish_judge_axis(judge, i);
}
