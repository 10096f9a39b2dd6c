// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Reading values. Every message names what was read, what stood there and
 * what is allowed, for the reader has only this one line to mend his mistake.
 */
#include "sim/parse.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MOST_US 3600000000LL	/* an hour */

static bool refuse(struct sim_text *why, const char *what, const char *word, const char *want)
{
	if (word && *word)
		sim_text_add(why, "%s: '%.60s' is not %s", what, word, want);
	else
		sim_text_add(why, "%s: missing, want %s", what, want);
	return false;
}

bool sim_parse_integer(struct sim_text *why, const char *what, const char *word, int64_t low,
		       int64_t high, int64_t *value)
{
	char want[64];
	char *end;
	long long read;

	snprintf(want, sizeof(want), "%lld..%lld", (long long)low, (long long)high);
	if (!word || !*word || strchr(" \t\n", *word))
		return refuse(why, what, word, want);
	errno = 0;
	read = strtoll(word, &end, strncmp(word, "0x", 2) == 0 ? 16 : 10);
	if (errno || *end || read < low || read > high)
		return refuse(why, what, word, want);
	*value = read;
	return true;
}

bool sim_parse_number(struct sim_text *why, const char *what, const char *word, double low,
		      double high, double *value)
{
	char want[64];
	char *end;
	double read;

	snprintf(want, sizeof(want), "%.10g..%.10g", low, high);
	if (!word || !*word || strchr(" \t\n", *word))
		return refuse(why, what, word, want);
	read = strtod(word, &end);
	if (*end || !isfinite(read) || read < low || read > high)
		return refuse(why, what, word, want);
	*value = read;
	return true;
}

bool sim_parse_choice(struct sim_text *why, const char *what, const char *word, const char *choices,
		      unsigned int *value)
{
	size_t len = word ? strlen(word) : 0;
	unsigned int place = 0;
	const char *at = choices;

	while (len) {
		size_t choice = strcspn(at, "|");

		if (choice == len && !memcmp(at, word, len)) {
			*value = place;
			return true;
		}
		at += choice;
		if (!*at)
			break;
		at++;
		place++;
	}
	return refuse(why, what, word, choices);
}

#define WANT_DELAY "US, LOW-HIGH or heavy:LOW:HIGH[:ALPHA]"

/* A number of microseconds which ends at `stop` ('\0' too); NULL if it does not. */
static const char *take_us(const char *at, char stop, uint64_t *ns)
{
	char *end;
	double us = strtod(at, &end);

	if (end == at || *end != stop || !isfinite(us) || us < 0 || us > MOST_US)
		return NULL;
	*ns = (uint64_t)llround(us * 1000);
	return stop ? end + 1 : end;
}

static bool heavy(const char *at, struct sim_delay *delay)
{
	char *end;

	at = take_us(at, ':', &delay->low_ns);
	if (!at || !delay->low_ns)
		return false;
	if (!strchr(at, ':'))
		return take_us(at, '\0', &delay->high_ns) && delay->high_ns >= delay->low_ns;
	at = take_us(at, ':', &delay->high_ns);
	if (!at || delay->high_ns < delay->low_ns)
		return false;
	delay->alpha = strtod(at, &end);
	return end != at && !*end && delay->alpha >= 0.5 && delay->alpha <= 10;
}

bool sim_parse_delay(struct sim_text *why, const char *what, const char *word,
		     struct sim_delay *delay)
{
	struct sim_delay read = { .kind = SIM_DELAY_CONSTANT };
	const char *high;
	bool good;

	if (!word || !*word)
		return refuse(why, what, word, WANT_DELAY);
	if (!strncmp(word, "heavy:", 6)) {
		read.kind = SIM_DELAY_HEAVY_TAIL;
		good = heavy(word + 6, &read);
	} else if (strchr(word, '-') && *word != '-') {
		read.kind = SIM_DELAY_UNIFORM;
		high = take_us(word, '-', &read.low_ns);
		good = high && take_us(high, '\0', &read.high_ns) && read.high_ns >= read.low_ns;
	} else {
		good = take_us(word, '\0', &read.low_ns);
	}
	if (!good)
		return refuse(why, what, word, WANT_DELAY);
	*delay = read;
	return true;
}

void sim_print_delay(struct sim_text *text, const struct sim_delay *delay)
{
	double low = (double)delay->low_ns / 1000;
	double high = (double)delay->high_ns / 1000;

	if (delay->kind == SIM_DELAY_UNIFORM)
		sim_text_add(text, "%g-%g", low, high);
	else if (delay->kind == SIM_DELAY_HEAVY_TAIL)
		sim_text_add(text, "heavy:%g:%g:%g", low, high,
			     delay->alpha > 0 ? delay->alpha : 1.5);
	else
		sim_text_add(text, "%g", low);
}

bool sim_parse_address(struct sim_text *why, const char *what, const char *word, uint8_t address[4])
{
	unsigned int part[4];
	char rest;

	if (!word ||
	    sscanf(word, "%3u.%3u.%3u.%3u%c", &part[0], &part[1], &part[2], &part[3], &rest) != 4)
		return refuse(why, what, word, "an address as 127.0.0.1");
	for (int i = 0; i < 4; i++) {
		if (part[i] > 255)
			return refuse(why, what, word, "an address as 127.0.0.1");
	}
	for (int i = 0; i < 4; i++)
		address[i] = (uint8_t)part[i];
	return true;
}

int sim_parse_words(char *line, char **words, int most)
{
	int count = 0;

	for (;;) {
		line += strspn(line, " \t\r\n");
		if (!*line || *line == '#')
			return count;
		if (count == most)
			return -1;
		if (*line == '"') {
			words[count++] = ++line;
			line += strcspn(line, "\"");
		} else {
			words[count++] = line;
			line += strcspn(line, " \t\r\n");
		}
		if (*line)
			*line++ = '\0';
	}
}
