/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Which block a member of struct values belongs to.
 *
 * A row does not say it: the blocks lie one behind the other, so the member's
 * place says it, for a second name of the same member as well. A block begins
 * with the member named here and ends where the next one begins.
 */
#include "halbridge/values.h"

static const uint16_t begins[VALUES_BLOCKS] = {
	[BLOCK_LINK] = 0,
	[BLOCK_MACHINE] = offsetof(struct values, command_refused_count),
	[BLOCK_ENGINE] = offsetof(struct values, engine),
	[BLOCK_INFO] = offsetof(struct values, device_serial),
	[BLOCK_RTC] = offsetof(struct values, rtc),
	[BLOCK_PIN] = offsetof(struct values, pin),
	[BLOCK_ANALOG] = offsetof(struct values, analog),
	[BLOCK_COUNTER] = offsetof(struct values, counter),
	[BLOCK_PWM] = offsetof(struct values, pwm),
	[BLOCK_ENCODER] = offsetof(struct values, encoder),
	[BLOCK_JOINT] = offsetof(struct values, joint),
	[BLOCK_EXTERNAL] = offsetof(struct values, external),
	[BLOCK_POEXTBUS] = offsetof(struct values, poextbus),
	[BLOCK_MATRIX] = offsetof(struct values, matrix),
	[BLOCK_KBD48] = offsetof(struct values, kbd48),
	[BLOCK_PONET] = offsetof(struct values, ponet),
	[BLOCK_DRIVE] = offsetof(struct values, drive),
	[BLOCK_HEATER] = offsetof(struct values, heater),
	[BLOCK_SERVO] = offsetof(struct values, servo),
	[BLOCK_DIAGNOSTICS] = offsetof(struct values, diagnostics),
	[BLOCK_SETTINGS] = offsetof(struct values, set),
	[BLOCK_LEGACY_LINK] = offsetof(struct values, legacy),
	[BLOCK_LEGACY_ENCODER] = offsetof(struct values, legacy.encoder),
	[BLOCK_LEGACY_IO] = offsetof(struct values, legacy.encoder_unused),
	[BLOCK_LEGACY_PONET] = offsetof(struct values, legacy.ponet),
	[BLOCK_LEGACY_AXIS] = offsetof(struct values, legacy.axis),
	[BLOCK_LEGACY_ENGINE] = offsetof(struct values, legacy.engine),
};

_Static_assert(VALUES_BLOCKS < 32, "struct values marks changes in 32 bits");
_Static_assert(offsetof(struct values, changed) <= 64 * VALUES_TOUCHED * VALUES_CHUNK,
	       "struct values has a bit for each of its chunks");

enum values_block values_block_of(size_t offset)
{
	unsigned int block = VALUES_BLOCKS - 1;

	while (offset < begins[block])
		block--;
	return (enum values_block)block;
}

size_t values_block_begin(enum values_block block)
{
	return begins[block];
}

size_t values_block_end(enum values_block block)
{
	return block + 1 == VALUES_BLOCKS ? offsetof(struct values, changed) : begins[block + 1];
}
