// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Faults by name. The names of the command line and of the control socket are
 * the same by being the same table.
 */
#include "sim/fault.h"

#include <math.h>
#include <string.h>

#include "sim/parse.h"

#define FIELD(name) offsetof(struct sim_link_faults, name)

const struct sim_fault_row sim_fault_rows[] = {
	{ "loss", SIM_FAULT_PROBABILITY, FIELD(loss), "P", "lose a packet" },
	{ "burst-every-us", SIM_FAULT_MICROSECONDS, FIELD(burst_every_ns), "US",
	  "mean time between bursts of loss" },
	{ "burst-length-us", SIM_FAULT_MICROSECONDS, FIELD(burst_length_ns), "US",
	  "mean length of a burst" },
	{ "burst-loss", SIM_FAULT_PROBABILITY, FIELD(burst_loss), "P",
	  "lose a packet while in a burst" },
	{ "delay-us", SIM_FAULT_DELAY, FIELD(delay), "DIST", "travel time" },
	{ "duplicate", SIM_FAULT_PROBABILITY, FIELD(duplicate), "P", "deliver a packet again" },
	{ "copies", SIM_FAULT_COUNT, FIELD(copies), "N", "how often again" },
	{ "copy-gap-us", SIM_FAULT_MICROSECONDS, FIELD(copy_gap_ns), "US",
	  "time between the copies" },
	{ "reorder", SIM_FAULT_PROBABILITY, FIELD(reorder), "P",
	  "hold a packet back behind later ones" },
	{ "reorder-us", SIM_FAULT_MICROSECONDS, FIELD(reorder_ns), "US", "for how long" },
	{ "corrupt", SIM_FAULT_PROBABILITY, FIELD(corrupt), "P", "flip one bit of a packet" },
	{ "truncate", SIM_FAULT_PROBABILITY, FIELD(truncate), "P", "cut a packet short" },
	{ "wrong-id", SIM_FAULT_PROBABILITY, FIELD(wrong_id), "P",
	  "replace the request id, with a good checksum" },
	{ "wrong-op", SIM_FAULT_PROBABILITY, FIELD(wrong_op), "P",
	  "replace the operation, with a good checksum" },
};
const unsigned int sim_fault_count = sizeof(sim_fault_rows) / sizeof(sim_fault_rows[0]);

static const struct sim_fault_row *find(const char *name)
{
	for (unsigned int i = 0; i < sim_fault_count; i++) {
		if (!strcmp(sim_fault_rows[i].name, name))
			return &sim_fault_rows[i];
	}
	return NULL;
}

static bool set(void *field, const struct sim_fault_row *row, const char *value,
		struct sim_text *why)
{
	double number = 0;
	int64_t count = 0;

	switch (row->unit) {
	case SIM_FAULT_PROBABILITY:
		if (!sim_parse_number(why, row->name, value, 0, 1, &number))
			return false;
		*(double *)field = number;
		return true;
	case SIM_FAULT_COUNT:
		if (!sim_parse_integer(why, row->name, value, 0, 1000, &count))
			return false;
		*(unsigned int *)field = (unsigned int)count;
		return true;
	case SIM_FAULT_MICROSECONDS:
		if (!sim_parse_number(why, row->name, value, 0, 3.6e9, &number))
			return false;
		*(uint64_t *)field = (uint64_t)llround(number * 1000);
		return true;
	case SIM_FAULT_DELAY:
	default:
		return sim_parse_delay(why, row->name, value, field);
	}
}

bool sim_fault_set(struct sim_link_faults *faults, const char *name, const char *value,
		   struct sim_text *why)
{
	const struct sim_fault_row *row = name ? find(name) : NULL;

	if (row)
		return set((char *)faults + row->offset, row, value, why);
	sim_text_add(why, "fault: '%.60s' is not", name ? name : "");
	for (unsigned int i = 0; i < sim_fault_count; i++)
		sim_text_add(why, "%s%s", i ? "|" : " ", sim_fault_rows[i].name);
	return false;
}

void sim_fault_print(const struct sim_link_faults *faults, const char *prefix,
		     struct sim_text *text)
{
	for (unsigned int i = 0; i < sim_fault_count; i++) {
		const struct sim_fault_row *row = &sim_fault_rows[i];
		const void *field = (const char *)faults + row->offset;

		sim_text_add(text, "%s%s=", prefix, row->name);
		if (row->unit == SIM_FAULT_PROBABILITY)
			sim_text_add(text, "%g", *(const double *)field);
		else if (row->unit == SIM_FAULT_COUNT)
			sim_text_add(text, "%u", *(const unsigned int *)field);
		else if (row->unit == SIM_FAULT_MICROSECONDS)
			sim_text_add(text, "%g", (double)*(const uint64_t *)field / 1000);
		else
			sim_print_delay(text, field);
		sim_text_add(text, "\n");
	}
}
