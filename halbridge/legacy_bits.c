/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Parameters of an axis that stand in a byte as well.
 */
#include "halbridge/legacy_bits.h"
#include <string.h>

#define BIT(bit_, member_) {								\
	bit_, offsetof(struct legacy_axis_settings, member_),				\
	sizeof(((struct legacy_axis_settings *)0)->member_) }

const struct legacy_bits legacy_options = { 7,
					    { BIT(1, enabled), BIT(2, inverted), BIT(4, planner),
					      BIT(8, position_mode), BIT(16, home_inverted),
					      BIT(32, soft_limits), BIT(128, masked) } };
const struct legacy_bits legacy_switches = {
	8,
	{ BIT(1, limit_minus), BIT(2, limit_plus), BIT(4, home_switch), BIT(8, home_on_minus),
	  BIT(16, home_on_plus), BIT(32, limit_minus_invert), BIT(64, limit_plus_invert),
	  BIT(128, home_invert) }
};
const struct legacy_bits legacy_homing = {
	8,
	{ BIT(1, on_home[0]), BIT(2, on_home[1]), BIT(4, on_home[2]), BIT(8, on_home[3]),
	  BIT(16, off_home[0]), BIT(32, off_home[1]), BIT(64, off_home[2]), BIT(128, off_home[3]) }
};

int32_t legacy_load(const struct legacy_axis_settings *set, size_t at, size_t size)
{
	const unsigned char *from = (const unsigned char *)set + at;
	int32_t value = *from;

	if (size > 1)
		memcpy(&value, from, sizeof(value));
	return value;
}

void legacy_store(struct legacy_axis_settings *set, size_t at, size_t size, int32_t value)
{
	unsigned char *to = (unsigned char *)set + at;

	if (size > 1)
		memcpy(to, &value, sizeof(value));
	else
		*to = value != 0;
}

uint32_t legacy_build(const struct legacy_axis_settings *set, const struct legacy_bits *bits)
{
	uint32_t built = 0;

	for (unsigned int i = 0; i < bits->count; i++) {
		if (legacy_load(set, bits->of[i].at, bits->of[i].size) > 0)
			built |= bits->of[i].bit;
	}
	return built;
}

uint32_t legacy_settle(struct legacy_axis_settings *set, const struct legacy_bits *bits,
		       uint32_t byte)
{
	uint32_t built = legacy_build(set, bits);

	for (unsigned int i = 0; !built && i < bits->count; i++) {
		if (byte & bits->of[i].bit)
			legacy_store(set, bits->of[i].at, bits->of[i].size, 1);
	}
	return built ? built : byte;
}
