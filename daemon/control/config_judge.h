/* SPDX-License-Identifier: GPL-2.0-or-later */
/* A device while it is judged. For the files that judge. */
#ifndef CONTROL_CONFIG_JUDGE_H
#define CONTROL_CONFIG_JUDGE_H

#include "daemon/control/config_key.h"

struct judged {
	struct config_file *file;
	struct config_raw_device *raw;
	const struct config_lines *lines;
};

/* A complaint about a key of a device, at the key's line. */
void judge_fault(const struct judged *j, const char *key, uint32_t index, const char *format, ...)
	__attribute__((format(printf, 4, 5)));

/* A section whose loop belongs to a device: a heater or a servo motor. */
struct judged_part {
	struct config_file *file;
	enum config_section section;
	const char *word, *name; /* "heater", and that of the section */
	const struct config_lines *lines;
};

#define JUDGE_NOBODY	UINT32_MAX

struct judged_part judge_heater_part(struct config_file *file, uint32_t heater);
struct judged_part judge_servo_part(struct config_file *file, uint32_t servo);

/* A complaint about a key of it, at the key's line. */
void judge_part_fault(struct judged_part part, const char *key, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

/* The section has this key; what it has there was refused; nothing of it was. */
bool judge_part_has(struct judged_part part, const char *key);
bool judge_part_is_faulty(struct judged_part part, const char *name);
bool judge_part_is_whole(struct judged_part part);

/* Of the keys that a complaint names, the first one that the section has. */
const char *judge_part_named(struct judged_part part, const char *text, const char *otherwise);

/* Index of the device that it names or that is the only one, or JUDGE_NOBODY after a complaint. */
uint32_t judge_part_device(struct judged_part part, const char *name);

enum { JUDGE_WHY_MAX = 120 };

/*
 * Does the device's failsafe switch off this PWM output, or this digital output, after at most
 * `most` x 100 ms? If not, `why` says why.
 */
bool judge_part_covered(const struct judged *j, bool pwm, unsigned int output, unsigned int most,
			char why[JUDGE_WHY_MAX]);

/* The device has a PWM period, from `least` to `most` ticks, for what `key` says. */
void judge_part_pwm(struct judged_part part, const char *key, const struct judged *j,
		    uint32_t least, uint32_t most, const char *example);

/* Make a terminal (from 0) what a loop needs. */
void judge_make_pin(struct pokeys_settings *settings, unsigned int pin, uint8_t function);

/* Heaters: of which devices they are; before the devices are judged. */
void judge_heaters(struct config_file *file);

/* Apply what the heaters of this device need to its settings; after its terminals were judged. */
void judge_heaters_of(const struct judged *j);

/* A heater of this device: index < file->heaters. */
bool judge_has_heater(const struct judged *j, uint32_t heater);

/* The same of servo motors. */
void judge_servos(struct config_file *file);
void judge_servos_of(const struct judged *j);
bool judge_has_servo(const struct judged *j, uint32_t servo);

/* Scales and names of axes. */
void judge_axes(const struct judged *j);

/* Rules about terminals. */
void judge_terminals(const struct judged *j);

/* Rules between the settings of one device, terminals among them. */
void judge_settings(const struct judged *j);

#endif
