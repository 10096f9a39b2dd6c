// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What [heater NAME] and [servo NAME] have in common: each belongs to a device, and its closed loop
 * judges itself, in the words of pokeysd.conf(5).
 */
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include "daemon/control/config_judge.h"
#include "wire/system.h"

void judge_part_fault(struct judged_part part, const char *key, const char *format, ...)
{
	char text[400];
	va_list arguments;

	va_start(arguments, format);
	vsnprintf(text, sizeof(text), format, arguments);
	va_end(arguments);
	config_fault(part.file, config_line_of(part.lines, key, 0), "[%s %s]: %s", part.word,
		     part.name, text);
}

bool judge_part_has(struct judged_part part, const char *key)
{
	return config_is_set(part.lines, key, 0);
}

bool judge_part_is_faulty(struct judged_part part, const char *name)
{
	return config_is_faulty(part.lines, name);
}

bool judge_part_is_whole(struct judged_part part)
{
	for (size_t i = 0; i < CONFIG_KEYS_MAX; i++)
		if (part.lines->faulty[i])
			return false;
	return true;
}

const char *judge_part_named(struct judged_part part, const char *text, const char *otherwise)
{
	static const char letters[] = "abcdefghijklmnopqrstuvwxyz0123456789-";
	char word[40], why[200];
	const struct config_key *key;
	uint32_t index;

	for (; *text; text += strcspn(text, " ") + (text[strcspn(text, " ")] == ' ')) {
		const size_t length = strspn(text, letters);

		if (length >= sizeof(word))
			continue;
		memcpy(word, text, length);
		word[length] = '\0';
		key = config_find(part.section, word, &index, why, sizeof(why));
		if (key && judge_part_has(part, key->name))
			return key->name;
	}
	return otherwise;
}

uint32_t judge_part_device(struct judged_part part, const char *name)
{
	const struct config_file *file = part.file;

	for (uint32_t i = 0; i < file->devices; i++)
		if (!strcmp(file->device[i].name, name))
			return i;
	if (!*name && file->devices == 1)
		return 0;
	if (*name)
		judge_part_fault(part, "device", "device: there is no [device %s]", name);
	else if (file->devices)
		judge_part_fault(part, "device",
				 "device is not given; it is needed if there are "
				 "several devices");
	return JUDGE_NOBODY;
}

bool judge_part_covered(const struct judged *j, bool pwm, unsigned int output, unsigned int most,
			char why[JUDGE_WHY_MAX])
{
	const struct pokeys_settings *settings = &j->raw->settings;
	const uint8_t kind = pwm ? WIRE_FAILSAFE_PWM : WIRE_FAILSAFE_DIGITAL;
	const char *wrong = NULL;

	if (!j->raw->failsafe || !settings->failsafe_timeout)
		wrong = "the failsafe of its device is off";
	else if (!(settings->failsafe_peripherals & kind))
		wrong = pwm ? "failsafe-parts of its device does not include PWM outputs (4)" :
			      "failsafe-parts of its device does not include digital outputs (1)";
	else if (pwm && settings->failsafe_pwm[output] > 0)
		wrong = "failsafe-pwm of its device keeps this output on";
	else if (!pwm && settings->failsafe_outputs[output / 8] >> output % 8 & 1)
		wrong = config_is_set(j->lines, "failsafe-on", 0) ?
				"failsafe-on of its device keeps this output on" :
				"safe-on of its device keeps this output on";
	if (wrong)
		snprintf(why, JUDGE_WHY_MAX, "%s", wrong);
	else if (settings->failsafe_timeout > most)
		snprintf(why, JUDGE_WHY_MAX, "failsafe-timeout-ms of its device is longer than %u",
			 most * 100);
	return !wrong && settings->failsafe_timeout <= most;
}

void judge_part_pwm(struct judged_part part, const char *key, const struct judged *j,
		    uint32_t least, uint32_t most, const char *example)
{
	const struct pokeys_settings *settings = &j->raw->settings;

	if (!(settings->set & POKEYS_SET_PWM_PERIOD))
		judge_part_fault(part, key,
				 "%s needs pwm-period in [device %s], in ticks of "
				 "25 MHz (%s)",
				 key, j->raw->name, example);
	else if (settings->pwm_period < least || settings->pwm_period > most)
		judge_part_fault(part, key, "pwm-period of its device has to be %u to %u", least,
				 most);
}

void judge_make_pin(struct pokeys_settings *settings, unsigned int pin, uint8_t function)
{
	settings->pin_function[pin] |= function;
	settings->pin_set[pin / 8] |= (uint8_t)(1u << pin % 8);
}
