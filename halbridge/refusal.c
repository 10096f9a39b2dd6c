/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Refusing a value must be seen and must not be noisy.
 *
 * A NaN on a pin stays there for thousands of periods, so what counts is the
 * edge from usable to not usable. The servo thread can neither format nor
 * print: it leaves a note (which member, why, what value), and the monitor
 * thread makes a line of it. The notes go through a ring with one writer and
 * one reader; when nobody reads, they are dropped, the counters are not.
 */
#include "halbridge/refusal.h"
#include <math.h>
#include <stdio.h>
#include "halbridge/table.h"

/* Whatever is multiplied or divided by a factor between these stays finite. */
#define FACTOR_LEAST	1e-100
#define FACTOR_MOST	1e100

static void leave_note(struct refusals *refusals, size_t offset, enum refusal_reason reason,
		       double value)
{
	uint32_t head = atomic_load_explicit(&refusals->head, memory_order_relaxed);
	uint32_t tail = atomic_load_explicit(&refusals->tail, memory_order_acquire);

	if (head - tail >= REFUSAL_NOTES)
		return;
	refusals->note[head % REFUSAL_NOTES] = (struct refusal_note){
		.offset = (uint16_t)offset,
		.reason = (uint8_t)reason,
		.value = value,
	};
	atomic_store_explicit(&refusals->head, head + 1, memory_order_release);
}

void refusal_once(struct refusals *refusals, size_t offset, enum refusal_reason reason,
		  double value)
{
	refusals->total++;
	leave_note(refusals, offset, reason, value);
}

void refusal_changed(struct refusals *refusals, bool *was, bool bad, size_t offset,
		     enum refusal_reason reason, double value)
{
	*was = bad;
	if (bad) {
		refusals->now++;
		refusal_once(refusals, offset, reason, value);
	} else {
		refusals->now--;
	}
}

/* What is wrong with it; *bad = false if nothing is. */
static enum refusal_reason judge(const struct factor *factor, double wanted, bool *bad)
{
	*bad = true;
	if (!isfinite(wanted))
		return REFUSAL_NOT_FINITE;
	if (wanted == 0 && !factor->may_be_zero)
		return REFUSAL_ZERO;
	*bad = fabs(wanted) > FACTOR_MOST || (!factor->may_be_zero && fabs(wanted) < FACTOR_LEAST);
	return REFUSAL_RANGE;
}

double factor_judge(struct factor *factor, struct refusals *refusals, double wanted, size_t offset)
{
	bool bad;
	enum refusal_reason reason = judge(factor, wanted, &bad);

	refusal_mark(refusals, &factor->bad, bad, offset, reason, wanted);
	factor->seen = wanted;
	if (!bad)
		factor->used = wanted;
	return factor->used;
}

bool refusal_take(struct refusals *refusals, struct refusal_note *out)
{
	uint32_t tail = atomic_load_explicit(&refusals->tail, memory_order_relaxed);

	if (tail == atomic_load_explicit(&refusals->head, memory_order_acquire))
		return false;
	*out = refusals->note[tail % REFUSAL_NOTES];
	atomic_store_explicit(&refusals->tail, tail + 1, memory_order_release);
	return true;
}

static const char *refusal_text(unsigned int reason)
{
	switch ((enum refusal_reason)reason) {
	case REFUSAL_NOT_FINITE:
		return "not a finite number; the last good value stays in use";
	case REFUSAL_ZERO:
		return "must not be 0; the last good value stays in use";
	case REFUSAL_RANGE:
		return "out of range; the last good value stays in use";
	case REFUSAL_ENABLED:
		return "may not change while the joint is enabled; taken over when it is not";
	case REFUSAL_SPEED:
		return "above the maximum speed configured for this axis; the axis stops";
	case REFUSAL_SOFT_LIMIT:
		return "beyond the soft limits; the last good value stays in use";
	case REFUSAL_NO_AXIS:
		return "the device has no such axis, or it is not set up (axes, axis.N.mode)";
	case REFUSAL_NO_PWM:
		return "drives nothing: this device has no such PWM output (pokeysctl terminals "
		       "lists them)";
	case REFUSAL_NO_HEATER:
		return "has no effect: pokeysd.conf has no such heater of this device";
	case REFUSAL_TARGET:
		return "not a finite number; the heater is off until 0 was commanded";
	case REFUSAL_NO_SERVO:
		return "has no effect: pokeysd.conf has no such servo of this device";
	case REFUSAL_POSITION:
		return "not a finite number; the motor is stopped by a fault";
	case REFUSAL_GAIN:
		return "the daemon refuses this gain: it is too large, pid-p and pid-i would both "
		       "be 0, or a search for gains runs; the previous one stays in use";
	case REFUSAL_NO_OUTPUT: /* with its terminal, refusal_line() */
		break;
	case REFUSAL_NO_INDEX:
		return "the device did not arm an index for this encoder; tried again";
	}
	return "refused";
}

/* Whose member stands at this offset; false: nobody's with a name. */
static bool find(struct table_cursor *at, size_t offset)
{
	while (table_next(at)) {
		if (at->offset == offset)
			return true;
	}
	return false;
}

void refusal_line(const struct refusal_note *note, const char *prefix, unsigned int schemes,
		  char *line, size_t size)
{
	struct table_cursor at = table_walk(schemes);
	const struct table_row *row = find(&at, note->offset) ? at.row : NULL;
	char name[TABLE_NAME_MAX + 1];

	if (row)
		table_full_name(row, prefix, at.index, name);
	else
		snprintf(name, sizeof(name), "%s", prefix);
	if (note->reason == REFUSAL_RANGE && row && row->low < row->high)
		snprintf(line, size, "%s = %g: must be %g to %g; the old value stays in use", name,
			 note->value, row->low, row->high);
	else if (note->reason == REFUSAL_NO_OUTPUT && row)
		snprintf(line, size,
			 "%s = 1: drives nothing: terminal %u is not a digital output "
			 "(add it to digital-outputs in pokeysd.conf, then pokeysctl config "
			 "apply)",
			 name, at.index + 1);
	else
		snprintf(line, size, "%s = %g: %s", name, note->value, refusal_text(note->reason));
}
