/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Conversions between a parameter and the field the device understands.
 *
 * Each goes both ways, and what one way refuses the other never produces: a
 * setting shown can be set back. The row's range has been checked before, so
 * a conversion refuses only what lies between: a sampling of 3, or a pin code
 * the protocol leaves out. A joint's lengths and speeds go through its scale,
 * a negative one turns the axis round and leaves speeds what they are.
 */
#include <math.h>
#include <pokeys/command.h>
#include "halbridge/wish.h"

static bool plain_to(const struct wish_context *context, double value, double *raw)
{
	(void)context;
	*raw = value;
	return true;
}

static double plain_from(const struct wish_context *context, double raw)
{
	(void)context;
	return raw;
}

static bool not_to(const struct wish_context *context, double value, double *raw)
{
	(void)context;
	*raw = value == 0;
	return true;
}

static double not_from(const struct wish_context *context, double raw)
{
	(void)context;
	return raw == 0;
}

/* Axis options: 1 internal planner, 2 position mode. */
static const uint8_t mode_options[] = {
	[POKEYS_AXIS_POSITION] = 3,
	[POKEYS_AXIS_VELOCITY] = 1,
	[POKEYS_AXIS_BUFFERED] = 0,
};

static bool mode_to(const struct wish_context *context, double value, double *raw)
{
	(void)context;
	*raw = mode_options[(int)value];
	return true;
}

static double mode_from(const struct wish_context *context, double raw)
{
	int options = (int)raw;

	(void)context;
	if (!(options & 1))
		return POKEYS_AXIS_BUFFERED;
	return options & 2 ? POKEYS_AXIS_POSITION : POKEYS_AXIS_VELOCITY;
}

/* Encoder options: 1 on, 2 four counts, 4 two counts a line. */
static const uint8_t sampling_options[] = { [0] = 0, [1] = 1, [2] = 5, [4] = 3 };

static bool sampling_to(const struct wish_context *context, double value, double *raw)
{
	(void)context;
	*raw = sampling_options[(int)value];
	return value == 0 || *raw != 0;
}

static double sampling_from(const struct wish_context *context, double raw)
{
	int options = (int)raw;

	(void)context;
	if (!(options & 1))
		return 0;
	return options & 2 ? 4 : options & 4 ? 2 : 1;
}

static bool fast_to(const struct wish_context *context, double value, double *raw)
{
	(void)context;
	*raw = value;
	return value == 0 || value == 1 || value == 10;
}

static bool terminal_to(const struct wish_context *context, double value, double *raw)
{
	(void)context;
	*raw = value;
	return value <= 1 || value > 10;
}

static bool pump_to(const struct wish_context *context, double value, double *raw)
{
	(void)context;
	*raw = value;
	return value <= 1 || value >= 10;
}

static bool power_to(const struct wish_context *context, double value, double *raw)
{
	(void)context;
	*raw = value;
	return !((int)value & 0x88);
}

static bool timeout_to(const struct wish_context *context, double value, double *raw)
{
	(void)context;
	*raw = value / 100;
	return fmod(value, 100) == 0;
}

static double timeout_from(const struct wish_context *context, double raw)
{
	(void)context;
	return raw * 100;
}

static bool hz_to(const struct wish_context *context, double value, double *raw)
{
	if (context->pwm_hz <= 0)
		return false;
	*raw = rint(context->pwm_hz / value);
	return *raw >= 1 && *raw <= UINT32_MAX;
}

static double hz_from(const struct wish_context *context, double raw)
{
	return raw > 0 && context->pwm_hz > 0 ? context->pwm_hz / raw : (double)NAN;
}

static bool speed_to(const struct wish_context *context, double value, double *raw)
{
	*raw = value * fabs(context->scale);
	return *raw > 0 && *raw <= 1e9;
}

static double speed_from(const struct wish_context *context, double raw)
{
	return raw / fabs(context->scale);
}

static bool length_to(const struct wish_context *context, double value, double *raw)
{
	*raw = rint(value * context->scale);
	return fabs(*raw) <= INT32_MAX;
}

static double length_from(const struct wish_context *context, double raw)
{
	return raw == 0 ? 0 : raw / context->scale;
}

/* The device has half of the play, in pulses. */
static bool play_to(const struct wish_context *context, double value, double *raw)
{
	*raw = rint(value * fabs(context->scale) / 2);
	return *raw <= UINT16_MAX;
}

static double play_from(const struct wish_context *context, double raw)
{
	return 2 * raw / fabs(context->scale);
}

#define PULSES_MS2	1e6	/* pulses/s^2 */

/* Coarse: what is not none must not become it. */
static bool taking_up_to(const struct wish_context *context, double value, double *raw)
{
	*raw = rint(value * fabs(context->scale) / PULSES_MS2);
	if (value > 0 && *raw < 1)
		*raw = 1;
	return *raw <= UINT8_MAX;
}

static double taking_up_from(const struct wish_context *context, double raw)
{
	return raw * PULSES_MS2 / fabs(context->scale);
}

static bool synced_to(const struct wish_context *context, double value, double *raw)
{
	(void)context;
	*raw = value;
	return value <= POKEYS_PINS || value >= 92;
}

const struct wish_unit wish_plain = { plain_to, plain_from, NULL };
const struct wish_unit wish_not = { not_to, not_from, NULL };
const struct wish_unit wish_mode = { mode_to, mode_from, "1, 2 or 3" };
const struct wish_unit wish_sampling = { sampling_to, sampling_from, "0, 1, 2 or 4" };
const struct wish_unit wish_fast = { fast_to, plain_from, "0, 1 or 10" };
const struct wish_unit wish_terminal = { terminal_to, plain_from, "0, 1 or 11 to 65" };
const struct wish_unit wish_pump = { pump_to, plain_from, "0, 1 or 10 to 65" };
const struct wish_unit wish_power = { power_to, plain_from, "a sum of 1, 2, 4, 16, 32, 64" };
const struct wish_unit wish_100ms = { timeout_to, timeout_from, "a multiple of 100" };
const struct wish_unit wish_hz = { hz_to, hz_from, "a frequency that the device's clock can make" };
const struct wish_unit wish_speed = { speed_to, speed_from, "more than 0, at most 1e9 pulses" };
const struct wish_unit wish_length = { length_to, length_from, "at most 2^31 pulses either way" };
const struct wish_unit wish_play = { play_to, play_from, "at most 131070 pulses" };
const struct wish_unit wish_taking_up = { taking_up_to, taking_up_from,
					  "at most 255000000 pulses per second^2" };
const struct wish_unit wish_synced = { synced_to, plain_from, "0 to 55 or 92 to 99" };
