/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Encoders' settings under their older names.
 *
 * An encoder's pins are handed on only if they differ from each other: 0 and 0
 * is what stands there if nobody has given any. Encoder 25 is the ultra-fast
 * one, its `enable` switches it on; 26 to 28 do not exist.
 */
#include "halbridge/legacy_settings.h"

enum {
	UNKNOWN = -1,
	ENABLED = 1,
	TIMES_4 = 2,
	TIMES_2 = 4,
	ULTRA = 25,
	PINS_OLD = 1,
	PINS_NEW = 10,
	NO_TIMES_4 = 16,
	INVERT_FIRST = 32
};

static uint8_t bits_of(const struct legacy_encoder_settings *set)
{
	return (uint8_t)((set->enable ? ENABLED : 0) | (set->x4 ? TIMES_4 : 0) |
			 (set->x2 ? TIMES_2 : 0));
}

static void show_encoder(const struct value_encoder_settings *device,
			 struct legacy_encoder_settings *now)
{
	if (device->sampling == UNKNOWN)
		return;
	now->enable = device->sampling > 0;
	now->x4 = device->sampling == 4;
	now->x2 = device->sampling == 2;
	now->options = bits_of(now);
	if (device->pin_a != UNKNOWN)
		now->pin_a = (uint32_t)device->pin_a;
	if (device->pin_b != UNKNOWN)
		now->pin_b = (uint32_t)device->pin_b;
}

/* The byte, in which a bit that somebody has just set to false stands still. */
static uint32_t byte_of(const struct legacy_encoder_settings *now,
			const struct legacy_encoder_settings *before)
{
	bool cleared = before->enable || before->x4 || before->x2;

	return cleared && now->options == before->options ? 0 : now->options;
}

static void derive_encoder(struct legacy_encoder_settings *now,
			   const struct legacy_encoder_settings *before)
{
	uint32_t built = bits_of(now);
	uint32_t byte = built ? now->options : byte_of(now, before);

	now->options = built ? built | (byte & 0xf0) : byte;
	if (built)
		return;
	now->enable = byte & ENABLED;
	now->x4 = (byte & TIMES_4) != 0;
	now->x2 = (byte & TIMES_2) != 0;
}

/* What has been set to false in place of true. */
static void note_zeros(uint8_t *zeroed, const struct legacy_encoder_settings *before,
		       const struct legacy_encoder_settings *now, bool counts)
{
	if (counts)
		*zeroed |= bits_of(before);
	*zeroed &= (uint8_t)~bits_of(now);
}

/* Counts of a step; -1 where the device's stay. */
static int32_t sampling_of(int32_t device, const struct legacy_encoder_settings *now,
			   uint8_t zeroed)
{
	if (!now->enable)
		return zeroed & ENABLED ? 0 : UNKNOWN;
	if (now->x4 || now->x2)
		return now->x4 ? 4 : 2;
	return zeroed & (TIMES_4 | TIMES_2) || !device ? 1 : device;
}

/* False if it has to wait for what the device has. */
static bool put_encoder(struct value_settings *set, unsigned int i,
			const struct legacy_encoder_settings *now, uint8_t zeroed)
{
	int32_t sampling;

	if (i == ULTRA) {
		legacy_put(&set->ultra_enable, now->enable);
		legacy_put(&set->ultra_4x, now->x4);
	}
	if (i >= SETTINGS_ENCODERS)
		return true;
	sampling = sampling_of(set->encoder[i].sampling, now, zeroed);
	if (sampling != UNKNOWN)
		legacy_put(&set->encoder[i].sampling, sampling);
	if (now->pin_a != now->pin_b) {
		legacy_put(&set->encoder[i].pin_a, (int32_t)now->pin_a);
		legacy_put(&set->encoder[i].pin_b, (int32_t)now->pin_b);
	}
	return sampling != UNKNOWN || !now->enable;
}

static void look_at_encoder(struct legacy_settings *own, struct values *values, unsigned int i)
{
	struct legacy_encoder_settings *live = &values->legacy.encoder_set[i], now;
	const struct legacy_encoder_settings before = own->encoder[i];
	struct legacy_group *group = &own->encoder_group[i];

	legacy_group_begin(group, live, &now, &own->encoder[i], sizeof(now));
	note_zeros(&own->encoder_zeroed[i], &before, &now, own->apply && own->applied);
	if (!group->touched && i < SETTINGS_ENCODERS)
		show_encoder(&values->set.encoder[i], &now);
	else if (own->apply)
		derive_encoder(&now, &before);
	legacy_group_end(live, &now, &own->encoder[i], sizeof(now));
	if (own->apply && group->touched && !group->put)
		group->put = put_encoder(&values->set, i, &now, own->encoder_zeroed[i]);
	group->put = group->put && own->apply;
}

static uint32_t fast_byte(const struct legacy_fast_encoders *now)
{
	uint32_t byte = now->no_x4 ? NO_TIMES_4 : 0;

	for (unsigned int i = 0; i < SETTINGS_FAST; i++)
		byte |= now->invert[i] ? (uint32_t)INVERT_FIRST << i : 0;
	return byte;
}

static void show_fast(const struct value_settings *set, struct legacy_fast_encoders *now)
{
	if (set->fast_configuration == UNKNOWN)
		return;
	now->configuration = (uint32_t)set->fast_configuration;
	now->enable = now->configuration != 0;
	now->alternative = now->configuration == PINS_NEW;
	now->no_x4 = set->fast_4x == 0;
	for (unsigned int i = 0; i < SETTINGS_FAST; i++)
		now->invert[i] = set->fast_invert[i] == 1;
	now->options = fast_byte(now);
	now->ultra_invert = set->ultra_invert == 1;
	now->ultra_signal_mode = set->ultra_signal_mode == 1;
	now->ultra_x4 = set->ultra_4x == 1;
	now->ultra_filter = set->ultra_filter > 0 ? set->ultra_filter : 0;
}

/* 16 is what the older component called the second choice of pins. */
static void derive_fast(struct legacy_fast_encoders *now)
{
	uint32_t byte = now->options;

	if (now->enable)
		now->configuration = now->alternative ? PINS_NEW : PINS_OLD;
	else if (now->configuration)
		now->enable = true;
	if (now->configuration == 16)
		now->configuration = PINS_NEW;
	if (!fast_byte(now)) {
		now->no_x4 = (byte & NO_TIMES_4) != 0;
		for (unsigned int i = 0; i < SETTINGS_FAST; i++)
			now->invert[i] = byte >> i & INVERT_FIRST;
	}
	now->options = fast_byte(now);
}

/* Two kinds in one group: what is all false of one kind was set for the other's sake. */
static void put_fast(struct value_settings *set, const struct legacy_fast_encoders *now)
{
	if (now->configuration || fast_byte(now)) {
		legacy_put(&set->fast_configuration, (int32_t)now->configuration);
		legacy_put(&set->fast_4x, !now->no_x4);
		for (unsigned int i = 0; i < SETTINGS_FAST; i++)
			legacy_put(&set->fast_invert[i], now->invert[i]);
	}
	if (!now->ultra_invert && !now->ultra_signal_mode && !now->ultra_x4 && !now->ultra_filter)
		return;
	legacy_put(&set->ultra_invert, now->ultra_invert);
	legacy_put(&set->ultra_signal_mode, now->ultra_signal_mode);
	legacy_put(&set->ultra_4x, now->ultra_x4);
	legacy_put(&set->ultra_filter, now->ultra_filter);
}

void legacy_settings_encoders(struct legacy_settings *own, struct values *values)
{
	struct legacy_fast_encoders *live = &values->legacy.fast_set, now;
	struct legacy_group *group = &own->fast_group;

	for (unsigned int i = 0; i < LEGACY_ENCODERS; i++)
		look_at_encoder(own, values, i);
	legacy_group_begin(group, live, &now, &own->fast, sizeof(now));
	if (!group->touched)
		show_fast(&values->set, &now);
	else if (own->apply)
		derive_fast(&now);
	legacy_group_end(live, &now, &own->fast, sizeof(now));
	if (own->apply && group->touched && !group->put)
		put_fast(&values->set, &now);
	group->put = own->apply;
}
