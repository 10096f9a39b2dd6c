// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What a servo motor needs: an encoder that no other motor has, the wires that its amplifier
 * expects, and a device that switches it off by itself.
 *
 * Limits and gains are judged by the motor's controller itself (daemon/loops/servo.h). Its
 * terminals need not be in digital-inputs or digital-outputs: the daemon configures them.
 */
#include <string.h>
#include "daemon/control/config_judge.h"
#include "wire/encoder.h"
#include "wire/io.h"

#define COUNT(array)	(sizeof(array) / sizeof((array)[0]))
enum { ENCODER_COUNTS = 0x01 };

struct judged_part judge_servo_part(struct config_file *file, uint32_t servo)
{
	return (struct judged_part){ file, CONFIG_SERVO, "servo", file->servo[servo].name,
				     &file->servo_lines[servo] };
}

bool judge_has_servo(const struct judged *j, uint32_t servo)
{
	return j->file->servo[servo].of == (uint32_t)(j->raw - j->file->device);
}

static void judge_given(struct judged_part part)
{
	static const char *const needed[] = {
		"encoder", "counts-per-unit", "pwm", "max-speed", "pid-p",
	};

	for (size_t i = 0; i < COUNT(needed); i++)
		if (!judge_part_has(part, needed[i]))
			judge_part_fault(part, needed[i], "%s is not given", needed[i]);
}

/* Wires that an amplifier has or has not. */
static void judge_wires(struct judged_part part, const struct config_raw_servo *raw)
{
	enum {
		SIGN = 1u << DRIVE_SIGN,
		ANTIPHASE = 1u << DRIVE_ANTIPHASE,
		TWO_PWM = 1u << DRIVE_TWO_PWM
	};
	static const char *const drives[] = {
		[DRIVE_SIGN] = "sign-magnitude",
		[DRIVE_ANTIPHASE] = "antiphase",
		[DRIVE_TWO_PWM] = "two-pwm",
	};
	static const struct {
		const char *key;
		unsigned int takes, needs;
	} keys[] = {
		{ "direction-pin", SIGN, SIGN },
		{ "reverse-pwm", TWO_PWM, TWO_PWM },
		{ "enable-pin", SIGN | ANTIPHASE | TWO_PWM, ANTIPHASE },
		{ "dwell-ms", SIGN, 0 },
	};
	const unsigned int drive = 1u << raw->drive;

	for (size_t i = 0; i < COUNT(keys); i++) {
		const bool given = judge_part_has(part, keys[i].key);

		if (given && !(keys[i].takes & drive))
			judge_part_fault(part, keys[i].key, "%s has no effect with drive = %s",
					 keys[i].key, drives[raw->drive]);
		if (!given && keys[i].needs & drive)
			judge_part_fault(part, keys[i].key, "%s is not given; drive = %s needs it",
					 keys[i].key, drives[raw->drive]);
	}
	if (!raw->limit_minus_pin && judge_part_has(part, "limit-minus-invert"))
		judge_part_fault(part, "limit-minus-invert",
				 "limit-minus-invert has no effect without limit-minus-pin");
	if (!raw->limit_plus_pin && judge_part_has(part, "limit-plus-invert"))
		judge_part_fault(part, "limit-plus-invert",
				 "limit-plus-invert has no effect without limit-plus-pin");
}

/* A switch to find, and keys that say how. */
static void judge_home(struct judged_part part, const struct config_raw_servo *raw)
{
	static const char *const keys[] = {
		"home-pin",    "home-invert",   "home-latch-speed", "home-acceleration",
		"home-offset", "home-position", "home-distance",
	};
	const bool low = raw->home_search < 0;
	const int64_t near = low ? raw->limit_minus_pin : raw->limit_plus_pin;
	const int64_t far = low ? raw->limit_plus_pin : raw->limit_minus_pin;
	const char *limit = low ? "limit-minus-pin" : "limit-plus-pin";

	if (raw->home_search == 0) {
		for (size_t i = 0; i < COUNT(keys); i++)
			if (judge_part_has(part, keys[i]))
				judge_part_fault(part, keys[i],
						 "%s has no effect without "
						 "home-search-speed",
						 keys[i]);
		return;
	}
	if (far && (raw->home_pin ? raw->home_pin : near) == far)
		judge_part_fault(part, "home-search-speed",
				 "home-search-speed: the home switch "
				 "has the terminal of the limit switch at the other end (%d), so "
				 "the axis would not stop there; give the home switch a terminal "
				 "of its own",
				 (int)far);
	if (raw->home_pin && raw->home_pin == near)
		judge_part_fault(part, "home-pin",
				 "home-pin: terminal %d is that of %s; leave "
				 "home-pin out",
				 (int)raw->home_pin, limit);
	if (raw->home_pin)
		return;
	if (judge_part_has(part, "home-invert"))
		judge_part_fault(part, "home-invert",
				 "home-invert has no effect without "
				 "home-pin");
	if (!near)
		judge_part_fault(part, "home-search-speed",
				 "home-search-speed needs a home "
				 "switch: home-pin, or %s in the direction of the search",
				 limit);
	else if ((raw->home_offset - raw->home_position) * (low ? -1 : 1) < raw->follow_least)
		judge_part_fault(part, "home-position",
				 "home-position = %g is on the limit "
				 "switch, which closes at %g (home-offset) and stops the motor; it "
				 "has to be %g or more off it (min-following-error)",
				 raw->home_position, raw->home_offset, raw->follow_least);
}

/* servo_init() is called only if the section has no other faults: its message would mislead. */
static void judge_servo(struct judged_part part, struct config_raw_servo *raw)
{
	const int faults = part.file->faults;
	struct servo_home home;
	struct servo trial;
	const char *wrong;

	judge_given(part);
	judge_wires(part, raw);
	judge_home(part, raw);
	config_convert_servo(raw, &raw->out);
	if (part.file->faults != faults || !judge_part_is_whole(part))
		return;
	wrong = servo_init(&trial, &raw->out.servo);
	if (!wrong)
		wrong = servo_home_init(&home, &raw->out.home, &raw->out.servo);
	if (wrong)
		judge_part_fault(part, judge_part_named(part, wrong, "encoder"), "%s", wrong);
}

/* Two loops with one encoder would pull at one axis. */
static void judge_encoders(struct config_file *file, uint32_t servo)
{
	const struct config_raw_servo *raw = &file->servo[servo];
	const struct judged_part part = judge_servo_part(file, servo);
	const uint32_t here = config_line_of(part.lines, "encoder", 0);
	char where[CONFIG_WHERE];

	for (uint32_t i = 0; i < servo && judge_part_has(part, "encoder"); i++)
		if (file->servo[i].of == raw->of && file->servo[i].encoder == raw->encoder &&
		    judge_part_has(judge_servo_part(file, i), "encoder"))
			judge_part_fault(part, "encoder",
					 "encoder %d is already that of [servo %s] (%s)",
					 (int)raw->encoder, file->servo[i].name,
					 config_where(file,
						      config_line_of(&file->servo_lines[i],
								     "encoder", 0),
						      here, where));
}

void judge_servos(struct config_file *file)
{
	uint32_t servos[TRANSPORT_CHANNELS] = { 0 };

	for (uint32_t i = 0; i < file->servos; i++) {
		struct config_raw_servo *raw = &file->servo[i];
		const struct judged_part part = judge_servo_part(file, i);

		raw->of = judge_part_device(part, raw->device);
		judge_servo(part, raw);
		if (raw->of == JUDGE_NOBODY)
			continue;
		judge_encoders(file, i);
		raw->number = servos[raw->of]++;
		if (raw->number == POKEYS_SERVOS)
			judge_part_fault(part, "device",
					 "[device %s] has more than %d servo motors",
					 file->device[raw->of].name, POKEYS_SERVOS);
	}
}

static bool ends_pwm(const struct judged *j, const struct servoing_config *config,
		     char why[JUDGE_WHY_MAX])
{
	return judge_part_covered(j, true, config->pwm, SERVOING_FAILSAFE_MOST, why) &&
	       (config->reverse_pwm == SERVOING_NONE ||
		judge_part_covered(j, true, config->reverse_pwm, SERVOING_FAILSAFE_MOST, why));
}

/* Only the device's failsafe stops the motor when this computer fails. */
static void judge_covered(const struct judged *j, struct judged_part part,
			  const struct config_raw_servo *raw)
{
	const struct servoing_config *config = &raw->out;
	const bool enables = config->enable != SERVOING_NONE;
	char why[JUDGE_WHY_MAX], why_pwm[JUDGE_WHY_MAX];
	bool covered;

	if (config->without_failsafe || raw->pwm < 0)
		return;
	covered = enables &&
		  judge_part_covered(j, false, config->enable, SERVOING_FAILSAFE_MOST, why);
	/* with antiphase a duty of 0 is full speed backwards; that it needs a wire is said above */
	if (config->drive.kind != DRIVE_ANTIPHASE)
		covered = covered || ends_pwm(j, config, enables ? why_pwm : why);
	else if (!enables)
		return;
	if (!covered)
		judge_part_fault(part, "without-failsafe",
				 "%s: the motor would keep running if "
				 "this computer fails; without-failsafe = yes accepts that",
				 why);
}

static bool is_switched_off(const struct pokeys_settings *settings, unsigned int encoder)
{
	const struct pokeys_encoder_settings *of = &settings->encoder[encoder];
	const bool fast = encoder < 3 && settings->set & POKEYS_SET_FAST_ENCODERS &&
			  settings->fast_configuration != WIRE_FAST_OFF;

	if (encoder == POKEYS_ENCODERS - 1)
		return settings->set & POKEYS_SET_ULTRA_FAST && !settings->ultra_enable;
	return !fast && of->options_mask & ENCODER_COUNTS && !(of->options & ENCODER_COUNTS);
}

static bool is_reset_by_index(const struct pokeys_settings *settings, int64_t encoder)
{
	return encoder < 3 && settings->set & POKEYS_SET_FAST_ENCODERS &&
	       settings->fast_configuration != WIRE_FAST_OFF && settings->fast_options & 1;
}

/* Settings of the device with which the motor could not be controlled. */
static void judge_device_of(const struct judged *j, struct judged_part part,
			    const struct config_raw_servo *raw)
{
	const double twice_ms = 2 * (double)j->file->daemon.period_us *
				(double)j->raw->fast_divider / 1000;

	if (twice_ms > raw->stale_ms)
		judge_part_fault(part, "max-age-ms",
				 "max-age-ms = %g has to be at least two "
				 "readings of its device, which are %g ms (period-us, "
				 "fast-divider)",
				 raw->stale_ms, twice_ms);
	if (judge_part_has(part, "encoder") &&
	    is_switched_off(&j->raw->settings, (unsigned int)raw->encoder))
		judge_part_fault(part, "encoder", "encoder %d is switched off in [device %s]",
				 (int)raw->encoder, j->raw->name);
	if (judge_part_has(part, "encoder") && is_reset_by_index(&j->raw->settings, raw->encoder))
		judge_part_fault(part, "encoder",
				 "encoder %d is set to 0 by its index input "
				 "(fast-encoder-index of [device %s]): the axis would lose its "
				 "position",
				 (int)raw->encoder, j->raw->name);
	if (raw->pwm < 0)
		return;
	judge_part_pwm(part, "pwm", j, SERVOING_PERIOD_LEAST, SERVOING_PERIOD_MOST,
		       "1250 is 20 kHz");
	if (j->raw->settings.set & POKEYS_SET_SYNC_PWM && j->raw->settings.sync_pwm_enable)
		judge_part_fault(part, "pwm",
				 "pwm and synced-pwm of its device exclude each "
				 "other");
}

void judge_servos_of(const struct judged *j)
{
	struct pokeys_settings *settings = &j->raw->settings;

	for (uint32_t i = 0; i < j->file->servos; i++) {
		const struct config_raw_servo *raw = &j->file->servo[i];
		const struct judged_part part = judge_servo_part(j->file, i);
		const int64_t outputs[] = { raw->direction_pin, raw->enable_pin };
		const int64_t inputs[] = {
			raw->limit_minus_pin,
			raw->limit_plus_pin,
			raw->home_pin,
		};

		if (!judge_has_servo(j, i))
			continue;
		judge_covered(j, part, raw);
		judge_device_of(j, part, raw);
		for (size_t k = 0; k < COUNT(outputs); k++)
			if (outputs[k])
				judge_make_pin(settings, (unsigned int)outputs[k] - 1,
					       WIRE_PIN_OUTPUT);
		for (size_t k = 0; k < COUNT(inputs); k++)
			if (inputs[k])
				judge_make_pin(settings, (unsigned int)inputs[k] - 1,
					       WIRE_PIN_INPUT);
	}
}
