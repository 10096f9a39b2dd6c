/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Settings laid over each other, and those of a commander judged.
 */
#ifndef DEVICE_WISH_H
#define DEVICE_WISH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <pokeys/settings.h>

/* What `from` says goes over what `to` says. Any thread. */
void wish_lay(struct pokeys_settings *to, const struct pokeys_settings *from);

struct wish_judge {
	struct pokeys_settings *now;
	const struct pokeys_settings *old; /* takes the place of what is refused */
	uint8_t pin_can[POKEYS_PINS];      /* bits of the function byte that the pin has */
	/* `part`: of an axis, see wish_axis_part(); else 0 */
	void (*refuse)(void *context, enum pokeys_setting setting, uint8_t index, uint8_t part);
	void *context;
};

/* Each part of `now` that is out of range is refused by itself. Any thread. */
void wish_judge(struct wish_judge *judge);

/* Bits of a mask, neighbouring members, and back to the old value or to none. */
static inline uint8_t wish_lay_bits(uint8_t below, uint8_t above, uint8_t mask)
{
	return (uint8_t)((below & ~mask) | (above & mask));
}

static inline void wish_lay_span(void *to, const void *from, size_t offset, size_t size)
{
	memcpy((uint8_t *)to + offset, (const uint8_t *)from + offset, size);
}

static inline void wish_restore(uint32_t *set, uint32_t old_set, uint32_t bit)
{
	*set = (*set & ~bit) | (old_set & bit);
}

/* wish_axis.c */
void wish_lay_axis(struct pokeys_axis_settings *to, const struct pokeys_axis_settings *from);
void wish_judge_axis(struct wish_judge *judge, unsigned int index);

/* What a part of an axis is called, in capitals; "" for 0 and what is none. Any thread. */
const char *wish_axis_part(long long part);

#endif
