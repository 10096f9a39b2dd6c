/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Whose is a parameter: the device's until somebody sets it.
 *
 * A parameter is memory that anybody writes; nobody tells us. So what we put
 * there is remembered, and a value that differs was set by somebody. From then
 * on the setting is wished, and the parameter is theirs; -1 (or nan) gives it
 * back. Two parameters may stand on one field; whichever is set is followed by
 * the other.
 *
 * Nothing is wished before the device's settings are known: several fields go
 * to the device together, and the ones nobody set have to be those it has.
 *
 * A value that cannot be used is said once and leaves the wish as it was.
 */
#include "halbridge/wish.h"
#include <math.h>

/* Fields that nobody wishes go along as the device has them: some are sent together. */
static void fill_up(struct wish *wish)
{
	const struct wish_context plain = { .scale = 1 };
	struct pokeys_settings filled = wish->device;
	const struct pokeys_settings *settings = &wish->image.settings;

	for (size_t i = 0; i < wish->count; i++) {
		const struct wish_item *item = &wish->item[i];
		bool is_set = wish_is_set(item->row, settings, item->index, &plain);

		wish_flag(item->row, &filled, item->index, &plain, is_set);
		if (is_set)
			wish_store(item->row, &filled, item->index, &plain,
				   wish_load(item->row, settings, item->index, &plain));
	}
	filled.set &= ~(uint32_t)POKEYS_SET_NAME; /* HAL has no text to set it with */
	wish->image.settings = filled;
}

void wish_report(struct wish *wish, const struct pokeys_report *report, struct values *values)
{
	wish->known = report->state != POKEYS_CONFIG_UNKNOWN;
	wish->device = report->device;
	values->diagnostics.config_refused = report->refused;
	values->diagnostics.config_refused_index = report->refused_index;
	if (wish->known)
		fill_up(wish);
}

static struct wish_context context_of(const struct wish_item *item, const struct values *values)
{
	double scale = values->joint[item->index % POKEYS_AXES].scale;

	return (struct wish_context){
		.scale = isfinite(scale) && scale != 0 ? scale : 1,
		.pwm_hz = values->info.pwm_hz,
	};
}

static bool same(double a, double b)
{
	return a == b || (isnan(a) && isnan(b));
}

/* "As the device has it". A bit that begins as false or true cannot say that. */
static bool is_left(const struct wish_item *item, double value)
{
	return same(value, item->name->initial) && (item->name->type != TABLE_BIT || value > 1);
}

static bool in_range(const struct wish_item *item, double value)
{
	const struct table_row *name = item->name;

	return isfinite(value) &&
	       (name->low == name->high || (value >= name->low && value <= name->high));
}

/* Returns true if that changes the wish. */
static bool put(struct wish *wish, const struct wish_item *item, const struct wish_context *context,
		double raw)
{
	struct pokeys_settings *settings = &wish->image.settings;
	bool was_set = wish_is_set(item->row, settings, item->index, context);
	double before = wish_load(item->row, settings, item->index, context);

	wish_store(item->row, settings, item->index, context, raw);
	wish_flag(item->row, settings, item->index, context, true);
	return !was_set || wish_load(item->row, settings, item->index, context) != before;
}

static bool same_flag(const struct wish_item *a, const struct wish_item *b)
{
	return a->row->together && b->row->together && a->row->flag.offset == b->row->flag.offset &&
	       a->row->flag.bits == b->row->flag.bits;
}

/* Another one that goes with it has neither been set nor reported: half of them is nothing. */
static bool lacks_others(const struct wish *wish, const struct wish_item *item,
			 const struct wish_context *context)
{
	if (!item->row->together || wish_is_set(item->row, &wish->device, item->index, context))
		return false;
	for (size_t i = 0; i < wish->count; i++) {
		if (same_flag(item, &wish->item[i]) && wish->item[i].scale == 0)
			return true;
	}
	return false;
}

static bool waits_for_others(const struct wish *wish, const struct wish_item *item,
			     const struct wish_context *context)
{
	return item->row->together && item->scale != 0 &&
	       !wish_is_set(item->row, &wish->image.settings, item->index, context);
}

/* This one, and those that have waited for it. */
static bool put_together(struct wish *wish, const struct wish_item *item,
			 const struct wish_context *context)
{
	bool changed = false;
	double raw;

	if (lacks_others(wish, item, context))
		return false;
	for (size_t i = 0; i < wish->count; i++) {
		const struct wish_item *other = &wish->item[i];

		if (other == item || (same_flag(item, other) && other->scale != 0))
			changed |= other->row->unit->to(context, other->shown, &raw) &&
				   put(wish, other, context, raw);
	}
	return changed;
}

/* Somebody has set the parameter. Returns true if that changes the wish. */
static bool take(struct wish *wish, struct wish_item *item, const struct wish_context *context,
		 double value)
{
	double raw;

	if (is_left(item, value)) {
		wish_flag(item->row, &wish->image.settings, item->index, context, false);
		item->shown = value;
		item->scale = 0;
		return true;
	}
	item->bad = !in_range(item, value) || !item->row->unit->to(context, value, &raw);
	if (item->bad)
		return false;
	item->shown = value;
	item->scale = context->scale;
	return item->row->together ? put_together(wish, item, context) :
				     put(wish, item, context, raw);
}

/* What the parameter should show: the wish, else the device, else nothing. */
static double effective(const struct wish *wish, const struct wish_item *item,
			const struct wish_context *context)
{
	const struct pokeys_settings *from = &wish->image.settings;

	if (!wish_is_set(item->row, from, item->index, context))
		from = &wish->device;
	if (!wish_is_set(item->row, from, item->index, context))
		return item->name->initial;
	return item->row->unit->from(context, wish_load(item->row, from, item->index, context));
}

/* Does the parameter say what the wish says, as exactly as the field can? */
static bool agrees(const struct wish *wish, const struct wish_item *item,
		   const struct wish_context *context)
{
	const struct pokeys_settings *settings = &wish->image.settings;
	double raw;

	return wish_is_set(item->row, settings, item->index, context) &&
	       !is_left(item, item->shown) && item->row->unit->to(context, item->shown, &raw) &&
	       wish_round(item->row, raw) == wish_load(item->row, settings, item->index, context);
}

static bool look_at(struct wish *wish, struct wish_item *item, struct values *values)
{
	void *at = (unsigned char *)values + table_offset(item->name, item->index);
	struct wish_context context = context_of(item, values);
	double value = table_get(item->name, at), shown;

	item->bad = false;
	if (!same(value, item->shown) || (item->scale != 0 && item->scale != context.scale))
		return take(wish, item, &context, value);
	if (waits_for_others(wish, item, &context))
		return put_together(wish, item, &context);
	if (agrees(wish, item, &context))
		return false;
	shown = effective(wish, item, &context);
	if (!same(shown, value))
		table_put(item->name, at, shown);
	item->shown = table_get(item->name, at);
	return false;
}

/* An axis turned round: what was the one limit is the other, so both are set anew. */
static void turn_round(struct wish *wish, const struct wish_item *item, const struct values *values)
{
	const struct wish_context now = context_of(item, values), then = { .scale = item->scale };

	if (item->scale * now.scale < 0 && item->row->mirror.size)
		wish_flag(item->row, &wish->image.settings, item->index, &then, false);
}

static void judge(struct wish *wish, struct wish_item *item, const struct values *values,
		  wish_refuse refuse, void *argument)
{
	double value = table_get(item->name, (const unsigned char *)values +
						     table_offset(item->name, item->index));

	wish->bad += item->bad;
	if (item->bad && !(item->was_bad && same(value, item->refused)))
		refuse(argument, item, value);
	item->was_bad = item->bad;
	item->refused = value;
}

bool wish_look(struct wish *wish, struct values *values, wish_refuse refuse, void *argument)
{
	bool changed = false;

	wish->bad = 0;
	if (!wish->known)
		return false;
	for (size_t i = 0; i < wish->count; i++)
		turn_round(wish, &wish->item[i], values);
	for (size_t i = 0; i < wish->count; i++) {
		changed |= look_at(wish, &wish->item[i], values);
		judge(wish, &wish->item[i], values, refuse, argument);
	}
	values->diagnostics.config_input_refused = wish->bad;
	if (!changed)
		return false;
	wish->any = true;
	wish->image.generation += wish->image.generation == UINT32_MAX ? 2 : 1;
	values->diagnostics.config_generation = wish->image.generation;
	return true;
}
