/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Values a person set that are not used: which, how many, since when.
 */
#ifndef HALBRIDGE_REFUSAL_H
#define HALBRIDGE_REFUSAL_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { REFUSAL_NOTES = 16 };

enum refusal_reason {
	REFUSAL_NOT_FINITE, /* NaN or infinite */
	REFUSAL_ZERO,
	REFUSAL_RANGE,
	REFUSAL_ENABLED, /* may not change while the joint is enabled */
	REFUSAL_SPEED,   /* above the axis' highest */
	REFUSAL_SOFT_LIMIT,
	REFUSAL_NO_AXIS,   /* the device has none of this number */
	REFUSAL_NO_INDEX,  /* the device did not arm this encoder's index */
	REFUSAL_NO_OUTPUT, /* the terminal is no digital output of the device */
	REFUSAL_NO_PWM,    /* the device has no such channel */
	REFUSAL_NO_HEATER, /* pokeysd.conf has none of this number */
	REFUSAL_TARGET,    /* of a heater: NaN or infinite */
	REFUSAL_NO_SERVO,  /* pokeysd.conf has none of this number */
	REFUSAL_POSITION,  /* of a servo motor: NaN or infinite */
	REFUSAL_GAIN,      /* by the daemon */
};

struct refusal_note {
	uint16_t offset; /* of the member in struct values: names the pin, see table.h */
	uint8_t reason;  /* enum refusal_reason */
	double value;
};

/* One writer (the servo thread), one reader of the notes (the monitor thread). */
struct refusals {
	uint32_t now; /* values refused at this moment */
	uint32_t total;
	_Atomic uint32_t head, tail;
	struct refusal_note note[REFUSAL_NOTES];
};

/* The same, when it has changed. Realtime; a full ring drops the note, never the count. */
void refusal_changed(struct refusals *refusals, bool *was, bool bad, size_t offset,
		     enum refusal_reason reason, double value);

/*
 * The value at `offset` is used (bad = false) or not. `was` remembers, so
 * that only a change counts and makes a note. Realtime.
 */
static inline void refusal_mark(struct refusals *refusals, bool *was, bool bad, size_t offset,
				enum refusal_reason reason, double value)
{
	if (bad != *was)
		refusal_changed(refusals, was, bad, offset, reason, value);
}

/* Something failed once: count it and leave a note. Realtime. */
void refusal_once(struct refusals *refusals, size_t offset, enum refusal_reason reason,
		  double value);

/* A parameter that is a factor or an addend: what was seen, and what is used. */
struct factor {
	double used, seen;
	bool may_be_zero, bad;
};

/* Judge a value that differs from the one seen before. Realtime. */
double factor_judge(struct factor *factor, struct refusals *refusals, double wanted, size_t offset);

/*
 * The value to use: `wanted` if it is finite, of a size with which results are
 * finite as well, and not 0 where that cannot be; else the last good one. Realtime.
 */
static inline double factor_take(struct factor *factor, struct refusals *refusals, double wanted,
				 size_t offset)
{
	return wanted == factor->seen ? factor->used :
					factor_judge(factor, refusals, wanted, offset);
}

/* The oldest note, for the log: true if there was one. Not realtime's. */
bool refusal_take(struct refusals *refusals, struct refusal_note *out);

/*
 * One line for a person about a note: the pin or parameter of <prefix>
 * in these schemes, its value, and what is wrong with it. Not realtime's.
 */
void refusal_line(const struct refusal_note *note, const char *prefix, unsigned int schemes,
		  char *line, size_t size);

#endif
