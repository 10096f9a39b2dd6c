/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Settings are read in turns while the link runs, for another program may write them, too:
 * a client that reads an input makes an input of a terminal that was our output. Nothing
 * else would show it, and the terminal would float.
 *
 * What is not as wanted any more is told, counted, and written again as every setting is:
 * while motion is not permitted. Of what nobody wants only the functions of pins are read,
 * which say what there is to be seen and driven.
 */

#include "daemon/device/internal.h"

#define TURN_NS (500 * MS)	/* every other one is for the functions of pins */

static bool watchable(const struct device *device, unsigned int number)
{
	const struct setting *setting = &device->configure.setting[number];
	unsigned int index;
	const struct setting_kind *kind = setting_kind(number, &index);

	/* those cannot be read back, or need others to be talked to first (postep_talk.c) */
	if (kind->taken || kind->ready || number == SETTING_POSTEP)
		return false;
	if (number != SETTING_PINS && !kind->wanted(&device->wishes.wanted, index))
		return false;
	return setting->known && !setting->failures && kind->has(device, index) &&
	       (setting->state == SETTING_DONE || setting->state == SETTING_REFUSED);
}

static bool at_rest(const struct configure *configure)
{
	for (unsigned int i = 0; i < SETTINGS; i++)
		if (configure->setting[i].state != SETTING_DONE &&
		    configure->setting[i].state != SETTING_REFUSED)
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

	if (device->now_ns < configure->watch_ns || !at_rest(configure))
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

bool watch_settled(struct device *device, struct setting *setting, uint64_t differs)
{
	const uint64_t foreign = differs & ~setting->differed;

	setting->watched = false;
	if (differs == setting->differed) {
		setting->state = differs ? SETTING_REFUSED : SETTING_DONE;
		return true;
	}
	if (foreign) {
		device->image.config_foreign += setting_say_foreign(device, setting, foreign);
		setting->writes = setting->unanswered = 0;
	}
	return false;
}

void watch_unanswered(struct setting *setting)
{
	setting->watched = false;
	setting->failures = 0;
	setting->state = setting->differed ? SETTING_REFUSED : SETTING_DONE;
}
