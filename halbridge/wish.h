/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The device's settings between parameters, wish and report
 * (include/pokeys/settings.h).
 *
 * Cold: one thread that is not the servo thread calls all of this.
 */
#ifndef HALBRIDGE_WISH_H
#define HALBRIDGE_WISH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <pokeys/settings.h>
#include "halbridge/table.h"
#include "halbridge/values.h"

enum { WISH_ITEMS = 2048 }; /* parameters that are settings, at most */

/* What a conversion may need to know. */
struct wish_context {
	double scale;  /* of the joint, pulses per unit, never 0 */
	double pwm_hz; /* 0 = not known */
};

/*
 * How a parameter and its field in struct pokeys_settings go into each other.
 * `to` says false if the field could not hold it, or would mean nothing.
 */
struct wish_unit {
	bool (*to)(const struct wish_context *context, double value, double *raw);
	double (*from)(const struct wish_context *context, double raw);
	const char *wanted; /* what may be set, for a person; NULL = the row's range says it */
};

extern const struct wish_unit wish_plain, wish_not, wish_mode, wish_sampling, wish_fast,
	wish_terminal, wish_pump, wish_power, wish_100ms, wish_hz, wish_speed, wish_length,
	wish_play, wish_taking_up, wish_synced;

enum wish_form { WISH_UNSIGNED, WISH_SIGNED, WISH_REAL };

/* Part of a struct pokeys_settings. The parameter's index moves it by `stride`. */
struct wish_place {
	uint16_t offset, stride;
	uint8_t size;  /* bytes; 0 = one bit, the (shift + index)-th behind offset */
	uint8_t shift; /* of the lowest of `bits` */
	uint32_t bits; /* of it, 0 = all */
};

/* A parameter (of the row that begins at `value`), its field, and what says "meant". */
struct wish_row {
	uint16_t value; /* offset of the row's first member in struct values */
	struct wish_place field, flag;
	struct wish_place mirror, mirror_flag; /* instead, where the scale is negative */
	uint8_t form;                          /* enum wish_form */
	const struct wish_unit *unit;
	bool together; /* all rows of the flag are needed: no device tells one */
};

struct wish_group {
	const struct wish_row *rows;
	size_t count;
};

struct wish_item {
	const struct wish_row *row;
	const struct table_row *name; /* the row that makes its names */
	unsigned int index;
	double shown;      /* what we put into the parameter, or took from it */
	double refused;    /* the value at the last look */
	double scale;      /* of the joint when somebody set it; 0 = nobody has */
	bool bad, was_bad; /* it holds what is not used */
};

struct wish {
	struct pokeys_wish image;      /* to be sent when wish_look() says so */
	struct pokeys_settings device; /* as reported */
	bool known;                    /* the device's settings have been reported */
	bool any;                      /* something was set here */
	uint32_t bad;                  /* parameters that hold what is not used */
	size_t count;
	struct wish_item item[WISH_ITEMS];
};

typedef void (*wish_refuse)(void *argument, const struct wish_item *item, double value);

/* Begin. 0, or -ENOSPC if there are more parameters than items. */
int wish_init(struct wish *wish);

/* Take over what the daemon reported. */
void wish_report(struct wish *wish, const struct pokeys_report *report, struct values *values);

/*
 * Look at all parameters: take over what somebody has set, show what the
 * device has in all others. Returns true if the wish is another one than
 * before; its generation is another then. `refuse` is called once for each
 * value that is not used.
 */
bool wish_look(struct wish *wish, struct values *values, wish_refuse refuse, void *argument);

/* What a field makes of a number. */
double wish_round(const struct wish_row *row, double raw);

/* A field's number. */
double wish_load(const struct wish_row *row, const struct pokeys_settings *settings,
		 unsigned int index, const struct wish_context *context);
void wish_store(const struct wish_row *row, struct pokeys_settings *settings, unsigned int index,
		const struct wish_context *context, double raw);

/* Whether it is meant. */
bool wish_is_set(const struct wish_row *row, const struct pokeys_settings *settings,
		 unsigned int index, const struct wish_context *context);
void wish_flag(const struct wish_row *row, struct pokeys_settings *settings, unsigned int index,
	       const struct wish_context *context, bool meant);

#endif
