/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Requests and replies find each other by device, request id and operation, as
 * they do in the mailbox. Where the daemon has told what it made of a reply, that
 * counts and nothing is judged anew: a reply that it discarded has no request. In
 * a capture of somebody else's the first reply that fits is taken for the answer.
 *
 * A request that was sent again has a line for each try. The answer belongs to all
 * of them, for which try it answers nobody knows; its partner is the last one before it.
 */
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <pokeys/async.h>
#include "daemon/recorder/pcapng.h"
#include "daemon/recorder/replay.h"
#include "daemon/recorder/unpack.h"
#include "daemon/recorder/words.h"
#include "wire/op.h"

enum { LOOK_BACK = 8192 }; /* lines; some seconds of one device */

struct loader {
	struct replay *replay;
	bool no_memory;
};

/* A cleared line at the end; NULL without memory. */
static struct replay_line *append(struct loader *loader)
{
	struct replay *replay = loader->replay;

	if (replay->lines == replay->room) {
		size_t room = replay->room ? 2 * replay->room : 1024;
		void *line = realloc(replay->line, room * sizeof(*replay->line));

		if (!line) {
			loader->no_memory = true;
			return NULL;
		}
		replay->line = line;
		replay->room = room;
	}
	memset(&replay->line[replay->lines], 0, sizeof(*replay->line));
	replay->line[replay->lines].partner = REPLAY_NONE;
	replay->line[replay->lines].again = REPLAY_NONE;
	replay->line[replay->lines].before = REPLAY_NONE;
	return &replay->line[replay->lines++];
}

/* What the daemon has told in the comment. */
static void take_comment(struct replay_line *line, const char *comment)
{
	unsigned int tries;
	const char *words;

	if (line->kind == REPLAY_REQUEST) {
		line->known = sscanf(comment, "cycle %" SCNu32 ", try %u", &line->cycle, &tries) ==
			      2;
		line->tries = line->known ? (uint8_t)tries : 0;
		line->once = line->known && strstr(comment, WORDS_ONCE);
		return;
	}
	words = strstr(comment, ", ");
	if (!words || sscanf(comment, "cycle %" SCNu32, &line->cycle) != 1)
		return;
	line->verdict = words_find_verdict(words + 2);
	line->known = line->verdict != POKEYS_VERDICT_NONE;
	words = strstr(words, ", taken ");
	line->stamped = words && sscanf(words, ", taken %" SCNu64, &line->taken_ns) == 1;
}

/* Which way did it go? Without the writer's word, by its first byte. False: neither. */
static bool find_kind(const struct pcapng_packet *packet, const struct unpacked *frame,
		      enum replay_kind *kind)
{
	bool request = frame->kept && frame->data[0] == WIRE_REQUEST;
	bool reply = frame->kept && frame->data[0] == WIRE_REPLY;

	if (packet->outbound || packet->inbound) {
		*kind = packet->outbound ? REPLAY_REQUEST : REPLAY_REPLY;
		return true;
	}
	*kind = request ? REPLAY_REQUEST : REPLAY_REPLY;
	return (request || reply) && frame->length == WIRE_PK;
}

static bool take_packet(void *context, const char *interface, const struct pcapng_packet *packet)
{
	struct loader *loader = context;
	struct replay_line *line;
	enum replay_kind kind;
	struct unpacked frame;

	if (!unpack_frame(packet->data, packet->kept, &frame) ||
	    !find_kind(packet, &frame, &kind)) {
		loader->replay->others++;
		return true;
	}
	line = append(loader);
	if (!line)
		return false;
	line->t_ns = packet->t_ns;
	line->kind = kind;
	line->address = kind == REPLAY_REQUEST ? frame.to : frame.from;
	line->port = kind == REPLAY_REQUEST ? frame.to_port : frame.from_port;
	line->length = (uint16_t)frame.length;
	line->kept = (uint16_t)(frame.kept < REPLAY_DATA ? frame.kept : REPLAY_DATA);
	memcpy(line->data, frame.data, line->kept);
	snprintf(line->device, sizeof(line->device), "%.31s", interface);
	take_comment(line, packet->comment);
	return true;
}

static bool take_entry(void *context, const struct pcapng_entry *entry)
{
	struct loader *loader = context;
	struct replay_line *line = append(loader);

	if (!line)
		return false;
	line->t_ns = entry->t_ns;
	line->kind = REPLAY_EVENT;
	line->level = entry->level;
	snprintf(line->device, sizeof(line->device), "%.31s", entry->device);
	line->text = strdup(entry->text);
	loader->no_memory |= !line->text;
	return line->text;
}

static bool may_answer(const struct replay_line *line)
{
	return line->kept >= WIRE_AT_SUM &&
	       (!line->known || line->verdict == POKEYS_VERDICT_ACCEPTED);
}

static bool same_request(const struct replay_line *reply, const struct replay_line *request)
{
	return request->kind == REPLAY_REQUEST && request->kept >= WIRE_AT_SUM &&
	       request->address == reply->address && request->port == reply->port &&
	       request->data[WIRE_AT_ID] == reply->data[WIRE_AT_ID] &&
	       !strcmp(request->device, reply->device);
}

/* The newest request before `at` of the same device and id. */
static ptrdiff_t find_newest(const struct replay *replay, ptrdiff_t at)
{
	const struct replay_line *line = &replay->line[at];
	const ptrdiff_t first = at > LOOK_BACK ? at - LOOK_BACK : 0;

	for (ptrdiff_t i = at - 1; i >= first; i--)
		if (same_request(line, &replay->line[i]))
			return i;
	return REPLAY_NONE;
}

/* ... if it is the one that is answered. */
static void pair_reply(struct replay *replay, ptrdiff_t at)
{
	struct replay_line *line = &replay->line[at];
	const ptrdiff_t i = find_newest(replay, at);
	struct replay_line *request = i == REPLAY_NONE ? NULL : &replay->line[i];

	if (!request || request->partner != REPLAY_NONE ||
	    request->data[WIRE_AT_OP] != line->data[WIRE_AT_OP])
		return;
	line->partner = i;
	request->partner = at;
}

/* ... if this is its next try. */
static void pair_try(struct replay *replay, ptrdiff_t at)
{
	struct replay_line *line = &replay->line[at];
	const ptrdiff_t i = find_newest(replay, at);
	struct replay_line *before = i == REPLAY_NONE ? NULL : &replay->line[i];

	if (!before || !before->known || before->tries + 1 != line->tries ||
	    before->data[WIRE_AT_OP] != line->data[WIRE_AT_OP])
		return;
	before->again = at;
	line->before = i;
}

static void pair(struct replay *replay)
{
	for (size_t i = 0; i < replay->lines; i++) {
		const struct replay_line *line = &replay->line[i];

		if (line->kind == REPLAY_REPLY && may_answer(line))
			pair_reply(replay, (ptrdiff_t)i);
		else if (line->kind == REPLAY_REQUEST && line->kept >= WIRE_AT_SUM && line->known &&
			 line->tries > 1)
			pair_try(replay, (ptrdiff_t)i);
	}
}

const struct replay_line *replay_first_try(const struct replay *replay,
					   const struct replay_line *line)
{
	while (line->before != REPLAY_NONE)
		line = &replay->line[line->before];
	return line;
}

const struct replay_line *replay_answer(const struct replay *replay, const struct replay_line *line)
{
	/* of an earlier try, if it came before the thread had looked and sent once more */
	line = replay_first_try(replay, line);
	while (line->partner == REPLAY_NONE && line->again != REPLAY_NONE)
		line = &replay->line[line->again];
	return line->partner == REPLAY_NONE ? NULL : &replay->line[line->partner];
}

int replay_load(struct replay *replay, FILE *from, char *why, size_t size)
{
	struct loader loader = { .replay = replay };
	const struct pcapng_take take = { take_packet, take_entry, &loader };
	int rc;

	*replay = (struct replay){ 0 };
	rc = pcapng_read(from, &take, why, size);
	if (loader.no_memory) {
		snprintf(why, size, "no memory");
		return -ENOMEM;
	}
	if (!rc)
		pair(replay);
	return rc;
}

void replay_free(struct replay *replay)
{
	for (size_t i = 0; i < replay->lines; i++)
		free(replay->line[i].text);
	free(replay->line);
	*replay = (struct replay){ 0 };
}

/* Not every device puts the sub-operation into its reply. */
const char *replay_operation(const struct replay *replay, const struct replay_line *line)
{
	static char number[8];
	const struct wire_op_row *row = NULL;

	if (line->kind == REPLAY_REPLY && line->partner != REPLAY_NONE)
		line = &replay->line[line->partner];
	if (line->kept <= WIRE_AT_P1)
		return "none";
	row = wire_op_find(line->data[WIRE_AT_OP], line->data[WIRE_AT_P1]);
	if (row)
		return row->name;
	snprintf(number, sizeof(number), "0x%02x", line->data[WIRE_AT_OP]);
	return number;
}
