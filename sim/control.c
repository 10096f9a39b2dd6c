// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The control language. Commands stand in tables, one per subject; help is
 * printed from them, so no command can be there without its line of help.
 *
 * Whatever comes in may be nonsense: every word is checked before anything is
 * changed, and a command which is refused has changed nothing.
 */
#include "sim/control_part.h"

#include <string.h>

static const struct sim_command *const tables[] = {
	sim_commands_io,     sim_commands_motion, sim_commands_bus,
	sim_commands_system, sim_commands_field,
};

#define TABLES (sizeof(tables) / sizeof(tables[0]))

bool sim_order_integer(struct sim_order *order, int i, const char *what, int64_t low, int64_t high,
		       int64_t *value)
{
	return sim_parse_integer(order->why, what, order->word[i], low, high, value);
}

bool sim_order_choice(struct sim_order *order, int i, const char *what, const char *choices,
		      unsigned int *value)
{
	return sim_parse_choice(order->why, what, order->word[i], choices, value);
}

bool sim_order_no_more(struct sim_order *order, int most)
{
	if (!order->word[most])
		return true;
	sim_text_add(order->why, "'%.60s': one word too many", order->word[most]);
	return false;
}

static const struct sim_command *find(const char *name)
{
	for (size_t t = 0; t < TABLES; t++) {
		for (const struct sim_command *c = tables[t]; c->name; c++) {
			if (!strcmp(c->name, name))
				return c;
		}
	}
	return NULL;
}

static void help(struct sim_text *out)
{
	for (size_t t = 0; t < TABLES; t++) {
		for (const struct sim_command *c = tables[t]; c->name; c++)
			sim_text_add(out, "%s%s%s - %s\n", c->name, *c->arguments ? " " : "",
				     c->arguments, c->help);
	}
}

static bool run(struct sim_order *order, const char *name)
{
	const struct sim_command *command;
	size_t usage;

	if (!strcmp(name, "help")) {
		help(order->out);
		return true;
	}
	command = find(name);
	if (!command) {
		sim_text_add(order->why, "'%.60s' is no command; try help", name);
		return false;
	}
	if (command->run(order))
		return true;
	usage = order->why->used;
	sim_text_add(order->why, "%susage: %s %s", usage ? "; " : "", name, command->arguments);
	return false;
}

/* Room kept for the last line of a reply, however long the rest is. */
static size_t reserve(struct sim_text *out, size_t bytes)
{
	size_t size = out->size;

	if (size - out->used > bytes)
		out->size -= bytes;
	return size;
}

bool sim_control_run(struct sim_control *control, uint64_t now_ns, char *line, struct sim_text *out)
{
	struct sim_order order = {
		.control = control,
		.rig = control->rig,
		.dev = &control->rig->device,
		.out = out,
	};
	char *words[SIM_CONTROL_WORDS];
	int count = sim_parse_words(line, words, SIM_CONTROL_WORDS);
	char reason[512];
	struct sim_text why;
	size_t size = reserve(out, sizeof(reason) + 16);
	bool good = true;

	sim_text_init(&why, reason, sizeof(reason));
	order.why = &why;
	control->now_ns = now_ns;
	sim_rig_run(control->rig, now_ns);
	if (count < 0) {
		sim_text_add(&why, "more than %d words", SIM_CONTROL_WORDS);
		good = false;
	} else if (count > 0) {
		for (int i = 1; i < count; i++)
			order.word[i - 1] = words[i];
		good = run(&order, words[0]);
	}
	out->size = size;
	if (good)
		sim_text_add(out, "ok\n");
	else
		sim_text_add(out, "error: %s\n", reason);
	return good;
}
