/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Settings are read in turns while the link runs, for another program may write them, too:
 * a client that reads an input makes an input of a terminal that was our output. Nothing
 * else would show it, and the terminal would float.
 *
 * What is not as wanted any more, twice in a row and in the same way, is told, counted, and
 * written again as every setting is: while motion is not permitted. Until then it is read
 * on, for the other program may put it back; a damaged packet is no other program. Of what
 * nobody wants only the functions of pins are read, which say what there is to be seen and
 * driven.
 */

#include "daemon/device/internal.h"

#define TURN_NS (500 * MS)	/* every other one is for the functions of pins */

/* To be written, and that has to wait for motion to end. */
static bool waits(const struct device *device, const struct setting *setting)
{
	return setting->state == SETTING_WRITE && !setting_may_write(device);
}

static bool rests(const struct device *device, const struct setting *setting)
{
	return setting->state == SETTING_DONE || setting->state == SETTING_REFUSED ||
	       waits(device, setting);
}

static bool watchable(const struct device *device, unsigned int number)
{
	const struct setting *setting = &device->configure.setting[number];
	unsigned int index;
	const struct setting_kind *kind = setting_kind(number, &index);

	/* those cannot be read back, or need others to be talked to first (postep_talk.c) */
	if (kind->taken || kind->ready || number == SETTING_POSTEP)
		return false;
	/* the commander's own period goes over the setting's */
	if (number == SETTING_PWM && device->intake.output.pwm_period)
		return false;
	if (number == SETTING_FAST_ENCODERS && operation_index_awaited(device))
		return false;
	if (number != SETTING_PINS && !kind->wanted(&device->wishes.wanted, index))
		return false;
	return setting->known && !setting->failures && kind->has(device, index) &&
	       rests(device, setting);
}

static bool at_rest(const struct device *device)
{
	for (unsigned int i = 0; i < SETTINGS; i++)
		if (!rests(device, &device->configure.setting[i]))
			return false;
	return true;
}

static void begin(struct device *device, unsigned int number)
{
	struct setting *setting = &device->configure.setting[number];
	union setting_request request;
	unsigned int index;
	const struct setting_kind *kind = setting_kind(number, &index);

	setting->differed = kind->merge(&device->wishes.wanted, index, &setting->value, &request);
	setting->waited = setting->state == SETTING_WRITE;
	setting->watched = true;
	setting->state = SETTING_READ;
}

/* After the last one it is the first one's turn. */
static unsigned int next(const struct device *device)
{
	const unsigned int last = device->configure.watch_last;

	for (unsigned int i = 1; i <= SETTINGS; i++) {
		const unsigned int number = (last + i) % SETTINGS;

		if (number != SETTING_PINS && watchable(device, number))
			return number;
	}
	return SETTING_PINS;
}

void watch_turn(struct device *device)
{
	struct configure *configure = &device->configure;
	unsigned int number;

	if (device->now_ns < configure->watch_ns || !at_rest(device))
		return;
	configure->watch_ns = device->now_ns + TURN_NS;
	configure->watch_pins = !configure->watch_pins;
	number = configure->watch_pins ? SETTING_PINS : next(device);
	if (!watchable(device, number))
		return;
	if (number != SETTING_PINS)
		configure->watch_last = (uint8_t)number;
	begin(device, number);
}

static void as_before(struct setting *setting)
{
	setting->watched = false;
	setting->state = setting->waited   ? SETTING_WRITE :
			 setting->differed ? SETTING_REFUSED :
					     SETTING_DONE;
}

bool watch_believes(struct device *device, struct setting *setting, const union setting_value *now)
{
	union setting_request request;
	unsigned int index;
	const unsigned int number = setting_number(device, setting);
	const struct setting_kind *kind = setting_kind(number, &index);
	const uint64_t differs = kind->merge(&device->wishes.wanted, index, now, &request);
	/* an index that is awaited shows in the answer, too */
	const bool armed = number == SETTING_FAST_ENCODERS && operation_index_awaited(device);
	const bool believed = !armed && (differs == setting->differed || differs == setting->odd);

	setting->odd = differs;
	if (!believed)
		as_before(setting);
	return believed;
}

bool watch_settled(struct device *device, struct setting *setting, uint64_t differs)
{
	const uint64_t foreign = differs & ~setting->differed;

	if (differs == setting->differed) {
		as_before(setting);
		return true;
	}
	setting->watched = false;
	setting->changed &= differs;
	if (foreign) {
		device->image.config_foreign += setting_say_foreign(device, setting, foreign);
		setting->writes = setting->unanswered = 0;
	}
	return false;
}

void watch_unanswered(struct setting *setting)
{
	setting->failures = 0;
	as_before(setting);
}
