// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * pokeysctl replay: a record as text, a line for each packet and event, or as JSON.
 * Names of operations come from the wire's table.
 */
#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <pokeys/async.h>
#include "daemon/recorder/replay.h"
#include "daemon/recorder/words.h"
#include "tools/json.h"
#include "tools/pokeysctl.h"
#include "wire/op.h"

static void print_time(uint64_t t_ns)
{
	const time_t second = (time_t)(t_ns / 1000000000);
	struct tm parts;
	char text[16] = "";

	if (localtime_r(&second, &parts))
		strftime(text, sizeof(text), "%H:%M:%S", &parts);
	printf("%s.%09llu ", text, (unsigned long long)(t_ns % 1000000000));
}

static double microseconds(uint64_t from_ns, uint64_t to_ns)
{
	return ((double)to_ns - (double)from_ns) / 1e3;
}

static const struct replay_line *partner(const struct replay *replay,
					 const struct replay_line *line)
{
	return line->partner == REPLAY_NONE ? NULL : &replay->line[line->partner];
}

/* "0xcc device_io id 17", as far as the packet goes. */
static void print_operation(const struct replay *replay, const struct replay_line *line)
{
	if (line->kept <= WIRE_AT_ID) {
		printf("%u bytes", line->length);
		return;
	}
	printf("0x%02x %s id %u", line->data[WIRE_AT_OP], replay_operation(replay, line),
	       line->data[WIRE_AT_ID]);
	if (line->length != WIRE_PK)
		printf(" (%u bytes)", line->length);
}

/* Nobody knows which try was answered. */
static void print_since_first(const struct replay *replay, const struct replay_line *request,
			      const struct replay_line *reply)
{
	const struct replay_line *first = replay_first_try(replay, request);

	if (first != request)
		printf(" (%.1f us after try %u)", microseconds(first->t_ns, reply->t_ns),
		       first->tries);
}

static void print_request(const struct replay *replay, const struct replay_line *line)
{
	const struct replay_line *reply = replay_answer(replay, line);

	printf("-> ");
	print_operation(replay, line);
	if (line->tries > 1)
		printf(", try %u", line->tries);
	if (line->again != REPLAY_NONE)
		printf(", sent again after %.1f us",
		       microseconds(line->t_ns, replay->line[line->again].t_ns));
	if (reply && reply->t_ns < line->t_ns) {
		printf(", its answer was there already");
	} else if (reply) {
		printf(", answered after %.1f us", microseconds(line->t_ns, reply->t_ns));
		print_since_first(replay, line, reply);
	} else if (line->again == REPLAY_NONE) {
		printf(", no answer in this record");
	}
	putchar('\n');
}

static void print_reply(const struct replay *replay, const struct replay_line *line)
{
	const struct replay_line *request = partner(replay, line);

	printf("<- ");
	print_operation(replay, line);
	if (line->known)
		printf(", %s", words_verdict(line->verdict));
	if (request) {
		printf(", %.1f us after ", microseconds(request->t_ns, line->t_ns));
		if (request->tries > 1)
			printf("try %u", request->tries);
		else
			printf("the request");
		print_since_first(replay, request, line);
	}
	if (line->stamped)
		printf(", taken %.1f us later", (double)line->taken_ns / 1e3);
	putchar('\n');
}

/* A record may come from anywhere: nothing in it is to command a terminal. */
static void print_text(const char *text)
{
	for (; *text; text++)
		putchar((unsigned char)*text < ' ' || (unsigned char)*text >= 0x7f ? '?' : *text);
}

static void print_event(const struct replay_line *line)
{
	printf("** ");
	print_text(line->text);
	putchar('\n');
}

static void print_line(const struct replay *replay, const struct replay_line *line)
{
	print_time(line->t_ns);
	if (line->kind != REPLAY_EVENT) { /* those name theirs */
		print_text(line->device);
		putchar(' ');
	}
	if (line->kind == REPLAY_REQUEST)
		print_request(replay, line);
	else if (line->kind == REPLAY_REPLY)
		print_reply(replay, line);
	else
		print_event(line);
}

/* From one to the other, null if that is not in the record. */
static void json_span(struct json *json, const char *key, const struct replay_line *from,
		      const struct replay_line *to)
{
	if (from && to)
		json_real(json, key, microseconds(from->t_ns, to->t_ns));
	else
		json_null(json, key);
}

static void json_request(struct json *json, const struct replay *replay,
			 const struct replay_line *line)
{
	if (line->known)
		json_unsigned(json, "try", line->tries);
	json_span(json, "round_trip_us", line, partner(replay, line));
	if (line->again == REPLAY_NONE)
		return;
	json_span(json, "again_us", line, &replay->line[line->again]);
	json_span(json, "answered_us", line, replay_answer(replay, line));
}

static void json_packet(struct json *json, const struct replay *replay,
			const struct replay_line *line)
{
	char data[2 * REPLAY_DATA + 1] = "";

	for (size_t i = 0; i < line->kept; i++)
		snprintf(data + 2 * i, 3, "%02x", line->data[i]);
	json_text(json, "operation", replay_operation(replay, line));
	if (line->kept > WIRE_AT_ID)
		json_unsigned(json, "id", line->data[WIRE_AT_ID]);
	else
		json_null(json, "id");
	json_unsigned(json, "length", line->length);
	if (line->kind == REPLAY_REQUEST) {
		json_request(json, replay, line);
	} else {
		json_text(json, "verdict", line->known ? words_verdict(line->verdict) : "unknown");
		json_span(json, "round_trip_us", partner(replay, line), line);
	}
	if (line->stamped)
		json_real(json, "taken_us", (double)line->taken_ns / 1e3);
	if (line->known)
		json_unsigned(json, "cycle", line->cycle);
	json_text(json, "data", data);
}

static void print_json_line(const struct replay *replay, const struct replay_line *line)
{
	static const char *const kinds[] = { "request", "reply", "event" };
	struct json json;

	json_init(&json, stdout);
	json_object(&json, NULL);
	json_unsigned(&json, "t_ns", line->t_ns);
	json_text(&json, "device", line->device);
	json_text(&json, "kind", kinds[line->kind]);
	if (line->kind == REPLAY_EVENT) {
		json_integer(&json, "level", line->level);
		json_text(&json, "text", line->text);
	} else {
		json_packet(&json, replay, line);
	}
	json_end(&json);
}

int command_replay(const struct options *options)
{
	const char *path = options->name_count == 1 ? options->names[0] : NULL;
	struct replay replay;
	char why[128] = "";
	FILE *from;
	int rc;

	if (!path) {
		complain("usage: pokeysctl replay [--json] FILE");
		return STATUS_USAGE;
	}
	from = fopen(path, "re");
	if (!from) {
		complain("%s: %s", path, strerror(errno));
		return STATUS_FAILED;
	}
	rc = replay_load(&replay, from, why, sizeof(why));
	fclose(from);
	for (size_t i = 0; i < replay.lines; i++)
		(options->json ? print_json_line : print_line)(&replay, &replay.line[i]);
	if (rc)
		complain("%s: %s", path, why);
	else if (replay.others)
		complain("%s: %zu other packets are left out", path, replay.others);
	replay_free(&replay);
	return rc ? STATUS_FAILED : STATUS_OK;
}
