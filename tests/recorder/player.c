/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Requests and replies are taken in the order in which the daemon saw them: a reply
 * when it was looked at, which may be long after the kernel had it.
 *
 * The account of what is open, what ended and what was accepted is kept here, not
 * asked of the mailbox: by it, each request ends once (invariant I3), and what is
 * accepted answers an open request of its id and operation (I1).
 *
 * A reset of the mailbox is not in the record, but what it follows from is: the
 * device was lost or restarted.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>
#include "tests/recorder/player.h"
#include "wire/op.h"

struct step {
	uint64_t t_ns;
	size_t line;
};

struct player {
	pokeys_device_t mailbox;
	const struct replay *record;
	const struct player_options *options;
	struct played *out;
	struct step *step;
	size_t to_send; /* step: the next one that has to leave the mailbox */
	uint64_t now;
	bool open[POKEYS_MAILBOX_SIZE];
	size_t last_try[POKEYS_MAILBOX_SIZE]; /* line */
	size_t delivering;                    /* line of the reply */
	unsigned int ended_now;               /* requests that this delivery has answered */
};

enum { NOBODY = -1 };

static const size_t NOTHING = (size_t)-1;

static void differ(struct player *p, const char *what, size_t line)
{
	const struct replay_line *l = &p->record->line[line];

	if (!p->out->differences++)
		snprintf(p->out->first, sizeof(p->out->first),
			 "%s: line %zu, kind %d, operation 0x%02x, id %u, try %u, verdict %u", what,
			 line, (int)l->kind, l->data[WIRE_AT_OP], l->data[WIRE_AT_ID], l->tries,
			 l->verdict);
}

static int by_time(const void *a, const void *b)
{
	const struct step *one = a, *other = b;

	if (one->t_ns != other->t_ns)
		return one->t_ns < other->t_ns ? -1 : 1;
	return one->line < other->line ? -1 : 1;
}

static void put_in_order(struct player *p)
{
	p->step = calloc(p->record->lines + 1, sizeof(*p->step));
	assert_non_null(p->step);
	for (size_t i = 0; i < p->record->lines; i++) {
		const struct replay_line *line = &p->record->line[i];

		p->step[i].line = i;
		p->step[i].t_ns = line->t_ns + (line->kind == REPLAY_REPLY ? line->taken_ns : 0);
	}
	qsort(p->step, p->record->lines, sizeof(*p->step), by_time);
}

/* What leaves the mailbox is what left the daemon, byte for byte and at its time. */
static int sent(void *context, const uint8_t *packet, size_t length)
{
	struct player *p = context;
	const struct replay_line *line;

	while (p->to_send < p->record->lines &&
	       p->record->line[p->step[p->to_send].line].kind != REPLAY_REQUEST)
		p->to_send++;
	if (p->to_send == p->record->lines) {
		differ(p, "sent after the end", p->record->lines - 1);
		return 0;
	}
	line = &p->record->line[p->step[p->to_send].line];
	if (length != WIRE_PK || memcmp(packet, line->data, WIRE_PK) || line->t_ns != p->now)
		differ(p, "sent another packet, or at another time", p->step[p->to_send].line);
	p->last_try[packet[WIRE_AT_ID]] = p->step[p->to_send].line;
	p->to_send++;
	return 0;
}

static void ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
		  uint64_t now_ns)
{
	struct player *p = context;
	const struct replay_line *line = &p->record->line[p->last_try[entry->request_id]];

	(void)mailbox;
	(void)now_ns;
	if (!p->open[entry->request_id])
		differ(p, "ended twice", p->last_try[entry->request_id]);
	p->open[entry->request_id] = false;
	if (entry->state != POKEYS_REQUEST_DONE) {
		p->out->unanswered += entry->state != POKEYS_REQUEST_CANCELLED;
		p->out->cancelled += entry->state == POKEYS_REQUEST_CANCELLED;
		if (replay_answer(p->record, line))
			differ(p, "not answered", p->last_try[entry->request_id]);
		return;
	}
	p->out->accepted++;
	p->ended_now++;
	if (p->delivering == NOTHING)
		differ(p, "answered by nothing", p->last_try[entry->request_id]);
	else if (replay_answer(p->record, line) != &p->record->line[p->delivering] ||
		 memcmp(entry->response_buffer, p->record->line[p->delivering].data, WIRE_PK))
		differ(p, "answered by another reply", p->delivering);
}

/* A write that is sent again has the newest values: those that were recorded. */
static void refresh(pokeys_device_t *mailbox, mailbox_entry_t *entry, void *context)
{
	struct player *p = context;
	const size_t again = (size_t)p->record->line[p->last_try[entry->request_id]].again;

	(void)mailbox;
	if (again == (size_t)REPLAY_NONE)
		return;
	memcpy(entry->request_buffer + WIRE_AT_P1, p->record->line[again].data + WIRE_AT_P1, 4);
	memcpy(entry->request_buffer + WIRE_PAYLOAD_AT,
	       p->record->line[again].data + WIRE_PAYLOAD_AT, WIRE_PAYLOAD_LEN);
}

/*
 * The record says when the daemon looked at its deadlines only where something left
 * then. Until that moment nothing is due; of what was neither sent again nor answered
 * the end is not known, but from here on it is not open.
 */
static void steer(struct player *p, int closed)
{
	for (uint32_t i = 0; i < p->mailbox.in_flight_count; i++) {
		mailbox_entry_t *entry = &p->mailbox.mailbox[p->mailbox.in_flight[i]];
		const struct replay_line *line = &p->record->line[p->last_try[entry->request_id]];

		entry->deadline = UINT64_MAX;
		if (line->again != REPLAY_NONE && closed == NOBODY)
			entry->deadline = p->record->line[line->again].t_ns;
		if (line->again == REPLAY_NONE && entry->request_id == closed &&
		    !replay_answer(p->record, line)) {
			entry->deadline = entry->waiting_since = 0;
			entry->retries_left = 0;
		}
	}
	if (closed != NOBODY)
		pokeys_device_check(&p->mailbox, p->now);
}

/*
 * What a newer one replaces, and was neither sent again nor answered, has ended at the ceiling
 * at the latest; or before that, so those that are in the way do.
 */
static void end_replaced(struct player *p)
{
	for (uint32_t i = p->mailbox.in_flight_count; i-- > 0;) {
		const mailbox_entry_t *entry = &p->mailbox.mailbox[p->mailbox.in_flight[i]];
		const struct replay_line *line = &p->record->line[p->last_try[entry->request_id]];
		const uint64_t end = entry->waiting_since + p->mailbox.options.deadline_ceiling_ns;

		if (entry->once && line->again == REPLAY_NONE && !replay_answer(p->record, line) &&
		    (end <= p->now || p->mailbox.open_count == POKEYS_WINDOW_MAX))
			pokeys_request_cancel(&p->mailbox, entry->request_id, p->now);
	}
}

/* Deadlines that pass before this step. */
static void pass(struct player *p, uint64_t t_ns)
{
	uint64_t due;

	if (!p->options->exact)
		steer(p, NOBODY);
	while ((due = pokeys_device_next_deadline(&p->mailbox)) < t_ns) {
		p->now = due;
		pokeys_device_check(&p->mailbox, due);
		if (!p->options->exact)
			steer(p, NOBODY);
	}
	p->now = t_ns;
}

static int create(struct player *p, const struct replay_line *line, size_t number)
{
	const struct wire_op_row *row = wire_op_find(line->data[WIRE_AT_OP],
						     line->data[WIRE_AT_P1]);
	const uint8_t id = line->data[WIRE_AT_ID];
	uint8_t packet[WIRE_PK];
	enum wire_class class;

	memcpy(packet, line->data, sizeof(packet));
	if (!row) {
		differ(p, "no such operation", number);
		return -1;
	}
	class = wire_request_class(row, packet);
	if (!p->options->exact) {
		steer(p, id);
		end_replaced(p);
		if (p->mailbox.mailbox[id].state != POKEYS_REQUEST_FREE)
			differ(p, "its id was still in use", number);
		p->mailbox.next_id = id;
		p->mailbox.id_free_after[id] = p->mailbox.id_shun_until[id] = 0;
		p->mailbox.id_key[id] = UINT16_MAX;
	} else if (row->flags & WIRE_CHECK) {
		packet[WIRE_AT_P2] = 0; /* the mailbox' own */
	}
	return pokeys_request_create(&p->mailbox, packet, (enum pokeys_class) class, ended, refresh,
				     p);
}

static void ask(struct player *p, size_t number)
{
	const struct replay_line *line = &p->record->line[number];
	int id;

	if (!p->mailbox.in_flight_count)
		pokeys_device_check(&p->mailbox, p->now); /* as a cycle begins */
	id = create(p, line, number);
	if (id != line->data[WIRE_AT_ID])
		differ(p, "got another id, or none", number);
	if (id < 0)
		return;
	p->open[id] = true;
	p->last_try[id] = number;
	p->out->requests++;
	if (line->once)
		pokeys_request_set_once(&p->mailbox, (uint8_t)id);
	if (pokeys_request_send(&p->mailbox, (uint8_t)id, p->now) < 0)
		differ(p, "was not sent", number);
}

static void ask_again(struct player *p, size_t number, size_t step)
{
	if (p->to_send <= step)
		pokeys_device_check(&p->mailbox, p->now);
	if (p->to_send <= step)
		differ(p, "was not sent again", number);
	p->out->retries++;
}

static void deliver(struct player *p, size_t number)
{
	const struct replay_line *line = &p->record->line[number];
	const struct pokeys_rx rx = {
		.t_ns = line->stamped ? line->t_ns : 0,
		.address = line->address,
		.port = line->port,
	};
	const uint8_t id = line->data[WIRE_AT_ID];
	const bool was_open = line->kept > WIRE_AT_ID && p->open[id];

	if (!p->options->exact && (line->verdict == POKEYS_VERDICT_DUPLICATE ||
				   line->verdict == POKEYS_VERDICT_NOT_IN_FLIGHT))
		steer(p, id);
	p->out->replies++;
	p->delivering = number;
	p->ended_now = 0;
	pokeys_device_deliver(&p->mailbox, line->data, line->length, &rx, p->now);
	if (p->mailbox.verdict != line->verdict)
		differ(p, "another verdict", number);
	if (p->ended_now != (line->verdict == POKEYS_VERDICT_ACCEPTED) ||
	    (p->ended_now && !was_open))
		differ(p, "answered what is not open", number);
	for (unsigned int i = 0; i < p->options->copies; i++)
		if (pokeys_device_deliver(&p->mailbox, line->data, line->length, &rx, p->now))
			differ(p, "accepted twice", number);
	p->delivering = NOTHING;
}

static void happen(struct player *p, const char *text)
{
	if (!strstr(text, ": lost (was ") && !strstr(text, ": the device was restarted") &&
	    !(strstr(text, ": searching (was ") && strstr(text, "it does not answer")))
		return;
	pokeys_device_reset(&p->mailbox, p->now);
	p->out->resets++;
}

static void take(struct player *p, size_t step)
{
	const size_t number = p->step[step].line;
	const struct replay_line *line = &p->record->line[number];

	pass(p, p->step[step].t_ns);
	if (line->kind == REPLAY_EVENT)
		happen(p, line->text);
	else if (line->kind == REPLAY_REPLY)
		deliver(p, number);
	else if (line->tries == 1)
		ask(p, number);
	else
		ask_again(p, number, step);
}

static void set_peer(struct player *p)
{
	for (size_t i = 0; i < p->record->lines; i++) {
		const struct replay_line *line = &p->record->line[i];

		if (line->kind != REPLAY_REQUEST)
			continue;
		pokeys_device_set_peer(&p->mailbox, line->address, line->port);
		return;
	}
}

void player_play(const struct replay *record, const struct player_options *options,
		 struct played *out)
{
	struct player *p = calloc(1, sizeof(*p));
	const struct pokeys_io io = { .send = sent, .context = p };
	struct pokeys_options mailbox = *options->mailbox;

	assert_non_null(p);
	*out = (struct played){ 0 };
	*p = (struct player){
		.record = record,
		.options = options,
		.out = out,
		.delivering = NOTHING,
	};
	if (!options->exact)
		mailbox.window = POKEYS_WINDOW_MAX; /* what has ended unseen is in it */
	assert_int_equal(pokeys_device_init(&p->mailbox, &io, &mailbox), 0);
	set_peer(p);
	put_in_order(p);
	for (size_t i = 0; i < record->lines; i++)
		take(p, i);
	pokeys_device_reset(&p->mailbox, p->now);
	for (unsigned int id = 0; id < POKEYS_MAILBOX_SIZE; id++)
		if (p->open[id])
			differ(p, "never ended", p->last_try[id]);
	if (out->requests != out->accepted + out->unanswered + out->cancelled)
		differ(p, "the sum of the ends is another one", 0);
	free(p->step);
	free(p);
}
