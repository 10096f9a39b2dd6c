// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Scripts. Times are settled when the file is read, so a bad one is found
 * before anything has moved; what a command says is for the control language.
 */
#include "sim/script.h"

#include <string.h>

#include "sim/parse.h"

#define MOST_MS 86400000

/* Cuts the first word off a line; returns it, or NULL at the end or at a comment. */
static char *cut_word(char **line)
{
	char *word = *line + strspn(*line, " \t\r");

	if (!*word || *word == '#')
		return NULL;
	*line = word + strcspn(word, " \t\r");
	if (**line)
		*(*line)++ = '\0';
	return word;
}

/* A leading "wait MS" or "at MS" moves the clock; the rest of the line stays. */
static bool take_time(char **line, uint64_t *clock_ns, struct sim_text *why)
{
	char *rest = *line;
	char *word = rest + strspn(rest, " \t\r");
	bool at = !strncmp(word, "at", 2) && strchr(" \t", word[2]);
	bool wait = !strncmp(word, "wait", 4) && strchr(" \t", word[4]);
	uint64_t then_ns;
	int64_t ms;

	if (!at && !wait)
		return true;
	cut_word(&rest);
	if (!sim_parse_integer(why, at ? "at" : "wait", cut_word(&rest), 0, MOST_MS, &ms))
		return false;
	then_ns = UINT64_C(1000000) * (uint64_t)ms + (wait ? *clock_ns : 0);
	if (then_ns < *clock_ns) {
		sim_text_add(why, "at: %lld is earlier than the line before", (long long)ms);
		return false;
	}
	*clock_ns = then_ns;
	*line = rest;
	return true;
}

static bool is_blank(const char *line)
{
	line += strspn(line, " \t\r");
	return !*line || *line == '#';
}

bool sim_script_parse(struct sim_script *script, char *text, struct sim_text *why)
{
	uint64_t clock_ns = 0;
	unsigned int number = 0;

	script->text = text;
	script->count = 0;
	script->next = 0;
	while (text) {
		char *line = strsep(&text, "\n");
		char reason[160];
		struct sim_text bad;

		number++;
		sim_text_init(&bad, reason, sizeof(reason));
		if (!take_time(&line, &clock_ns, &bad)) {
			sim_text_add(why, "line %u: %s", number, reason);
			return false;
		}
		if (is_blank(line))
			continue;
		if (script->count == SIM_SCRIPT_LINES) {
			sim_text_add(why, "line %u: more than %d commands", number,
				     SIM_SCRIPT_LINES);
			return false;
		}
		script->line[script->count++] = (struct sim_script_line){
			.at_ns = clock_ns,
			.number = number,
			.command = line,
		};
	}
	return true;
}

uint64_t sim_script_next(const struct sim_script *script)
{
	return script->next < script->count ? script->line[script->next].at_ns : UINT64_MAX;
}

bool sim_script_run(struct sim_script *script, struct sim_control *control, uint64_t since_ns,
		    uint64_t now_ns, struct sim_text *why)
{
	while (sim_script_next(script) <= since_ns) {
		const struct sim_script_line *line = &script->line[script->next++];
		char buffer[1024];
		struct sim_text out;

		sim_text_init(&out, buffer, sizeof(buffer));
		if (!sim_control_run(control, now_ns, line->command, &out)) {
			sim_text_add(why, "line %u: %.*s", line->number, (int)strcspn(buffer, "\n"),
				     buffer);
			return false;
		}
	}
	return true;
}
