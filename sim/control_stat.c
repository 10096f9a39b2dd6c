// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The statistics dump: what a test asserts on. Counters of operations are
 * listed only when they are not zero, as "op.cc" and, for the sub-commands of
 * the pulse engine, "pe.21".
 */
#include "sim/control_part.h"

static void count(struct sim_text *out, const char *name, uint64_t value)
{
	sim_text_add(out, "%s=%llu\n", name, (unsigned long long)value);
}

static void show_link(struct sim_order *order, enum sim_link_dir dir, const char *name)
{
	const struct sim_link_stats *s = &order->rig->link.way[dir].stats;
	const struct {
		const char *name;
		uint64_t value;
	} rows[] = {
		{ "pushed", s->pushed },
		{ "delivered", s->delivered },
		{ "lost", s->lost },
		{ "lost-burst", s->lost_burst },
		{ "lost-silence", s->lost_silence },
		{ "duplicated", s->duplicated },
		{ "reordered", s->reordered },
		{ "corrupted", s->corrupted },
		{ "truncated", s->truncated },
		{ "wrong-id", s->wrong_id },
		{ "wrong-op", s->wrong_op },
		{ "overflow", s->overflow },
	};

	for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++)
		sim_text_add(order->out, "link.%s.%s=%llu\n", name, rows[i].name,
			     (unsigned long long)rows[i].value);
}

static void show_operations(struct sim_order *order)
{
	const struct sim_device_stats *s = &order->dev->stats;

	for (unsigned int i = 0; i < 256; i++) {
		if (s->executed[i])
			sim_text_add(order->out, "op.%02x=%llu\n", i,
				     (unsigned long long)s->executed[i]);
	}
	for (unsigned int i = 0; i < 256; i++) {
		if (s->executed_pe[i])
			sim_text_add(order->out, "pe.%02x=%llu\n", i,
				     (unsigned long long)s->executed_pe[i]);
	}
}

static void show_axes(struct sim_order *order)
{
	for (unsigned int i = 0; i < order->dev->config.engine.axes && i < SIM_AXES; i++) {
		const struct sim_axis *ax = &order->dev->engine.axis[i];
		const struct sim_mechanics *m = &order->dev->bench.machine.axis[i];

		sim_text_add(order->out,
			     "axis.%u.position=%d\naxis.%u.machine=%lld\naxis.%u.steps=%llu\n", i,
			     sim_axis_position(ax), i, (long long)m->position, i,
			     (unsigned long long)m->steps);
	}
}

bool sim_control_stat(struct sim_order *order)
{
	const struct sim_device_stats *s = &order->dev->stats;
	const struct sim_rig_stats *r = &order->rig->stats;
	const struct sim_ring *ring = &order->dev->engine.ring;

	if (!sim_order_no_more(order, 0))
		return false;
	count(order->out, "requests", s->requests);
	count(order->out, "replies", s->replies);
	count(order->out, "unknown", s->unknown);
	for (unsigned int i = 0; i < SIM_DROPS; i++)
		sim_text_add(order->out, "dropped.%s=%llu\n", sim_drop_name((enum sim_drop)i),
			     (unsigned long long)s->dropped[i]);
	count(order->out, "queue.overflow", r->overflow);
	count(order->out, "queue.high-water", r->high_water);
	count(order->out, "saves", s->saves);
	count(order->out, "reboots", s->reboots);
	count(order->out, "failsafes", s->failsafes);
	count(order->out, "slots", s->slots);
	count(order->out, "engine.state", order->dev->engine.state);
	count(order->out, "ring.used", ring->used);
	count(order->out, "ring.accepted", ring->slots_accepted);
	count(order->out, "ring.taken", ring->slots_taken);
	count(order->out, "ring.underruns", ring->underruns);
	show_axes(order);
	show_link(order, SIM_LINK_REQUEST, "request");
	show_link(order, SIM_LINK_REPLY, "reply");
	show_operations(order);
	return true;
}
