/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The world, see world.h.
 *
 * Stamp and its complement stand in the payload of every request, and the
 * device copies them into the reply. A flipped payload bit makes the two
 * disagree: that is the damage an 8-bit header sum cannot see (protocol
 * section 1.3), and it is counted. A stamp that agrees with itself and not
 * with the request it completed is a wrong answer published.
 */

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include "tests/engine/world.h"

enum { AT_STAMP = 8, AT_COMPLEMENT = 16, AT_VALUE = 32 };

#define CHECK(w, condition) \
	do { \
		if (!(condition)) \
			fail_msg("%s at %" PRIu64 " ns, seed %" PRIu64 " (%s:%d)", \
				 #condition, (w)->now, (w)->seed, __FILE__, __LINE__); \
	} while (0)

uint64_t world_seed(uint64_t seed)
{
	const char *given = getenv("POKEYS_SEED");

	if (given && *given)
		seed = strtoull(given, NULL, 0);
	print_message("POKEYS_SEED=%" PRIu64 "\n", seed);
	return seed;
}

static void put_u64(uint8_t *p, uint64_t v)
{
	memcpy(p, &v, sizeof(v));
}

static uint64_t get_u64(const uint8_t *p)
{
	uint64_t v;

	memcpy(&v, p, sizeof(v));
	return v;
}

/* The request a packet is stamped with, NULL if the stamp is damaged or very old. */
static struct world_request *stamped(struct world *w, const uint8_t *packet)
{
	const uint64_t stamp = get_u64(packet + AT_STAMP);
	struct world_request *r;

	if (get_u64(packet + AT_COMPLEMENT) != ~stamp)
		return NULL;
	r = &w->request[stamp % WORLD_REQUESTS];
	return r->number == stamp ? r : NULL;
}

const struct world_request *world_request(const struct world *w, uint64_t number)
{
	const struct world_request *r = &w->request[number % WORLD_REQUESTS];

	assert_true(r->number == number && r->world == w);
	return r;
}

/* I5: no second sees more than the budget. */
static void check_budget(struct world *w, uint64_t *times, uint64_t count, uint32_t budget)
{
	CHECK(w, budget <= WORLD_BUDGET_MAX);
	CHECK(w, count < budget || w->now - times[count % budget] >= S);
	times[count % budget] = w->now;
}

static int world_send(void *context, const uint8_t *packet, size_t length)
{
	struct world *w = context;
	struct world_request *r = stamped(w, packet);

	CHECK(w, r != NULL);
	CHECK(w, !r->ends);
	check_budget(w, w->send_times, w->sends++, w->dev.options.send_budget);
	if (r->sends++)
		check_budget(w, w->resend_times, w->resends++, w->dev.options.retry_budget);
	CHECK(w, !r->oneshot || r->sends == 1); /* I4 */
	sim_link_push(&w->link, SIM_LINK_REQUEST, w->now, packet, length);
	return 0;
}

static int world_receive(void *context, uint8_t *packet, size_t size, struct pokeys_rx *rx)
{
	struct world *w = context;
	uint64_t peer;
	size_t length;

	rx->t_ns = sim_link_next(&w->link, SIM_LINK_REPLY);
	if (!sim_link_pop_from(&w->link, SIM_LINK_REPLY, w->now, &peer, packet, size, &length))
		return -EAGAIN;
	w->arrived_ns = rx->t_ns;
	return (int)length;
}

/* I1 to I3 at the end of a request. */
static void ended(pokeys_device_t *dev, const mailbox_entry_t *entry, void *context,
		  uint64_t now_ns)
{
	struct world_request *r = context;
	struct world *w = r->world;

	(void)dev;
	CHECK(w, ++r->ends == 1);
	CHECK(w, now_ns == w->now);
	w->ended++;
	r->ended_ns = now_ns;
	r->state = entry->state;
	if (entry->state != POKEYS_REQUEST_DONE)
		return;
	w->last_done_ns = now_ns;
	if (get_u64(entry->response_buffer + AT_COMPLEMENT) !=
	    ~get_u64(entry->response_buffer + AT_STAMP)) {
		w->corrupt_payloads++;
		return;
	}
	CHECK(w, stamped(w, entry->response_buffer) == r);
	/* I2: the age is right */
	CHECK(w, entry->timestamp_received == w->arrived_ns);
	CHECK(w, entry->timestamp_received >= r->served_ns);
	CHECK(w, entry->timestamp_received <= now_ns);
}

static void refresh(pokeys_device_t *dev, mailbox_entry_t *entry, void *context)
{
	const struct world_request *r = context;

	(void)dev;
	put_u64(entry->request_buffer + AT_VALUE, r->world->cycle);
}

static void create(struct world *w, uint8_t op, uint8_t p1, enum pokeys_class request_class)
{
	uint8_t packet[POKEYS_PACKET_SIZE] = { 0xBB, op, p1 };
	struct world_request *r = &w->request[w->requests % WORLD_REQUESTS];
	int id;

	CHECK(w, !r->world || r->ends == 1); /* I3 */
	put_u64(packet + AT_STAMP, w->requests);
	put_u64(packet + AT_COMPLEMENT, ~w->requests);
	*r = (struct world_request){
		.world = w,
		.number = w->requests,
		.created_ns = w->now,
	};
	r->oneshot = request_class == POKEYS_CLASS_ONESHOT;
	id = pokeys_request_create(&w->dev, packet, request_class, ended, refresh, r);
	if (id < 0) {
		r->ends = 1;
		return;
	}
	w->requests++;
	if (pokeys_request_send(&w->dev, (uint8_t)id, w->now) < 0)
		pokeys_request_cancel(&w->dev, (uint8_t)id, w->now);
	else if (w->options.cancel_every && w->requests % w->options.cancel_every == 0)
		pokeys_request_cancel(&w->dev, (uint8_t)id, w->now);
}

static void cycle(struct world *w)
{
	static const uint8_t slow[][2] = {
		{ 0x3A, 0 }, { 0x05, 0 }, { 0xCD, 0 }, { 0xCD, 1 }, { 0x85, 0x08 }, { 0x31, 0 },
	};
	const uint64_t n = w->cycle++;

	if (w->options.status_only) {
		for (unsigned int i = 0; i < w->options.per_cycle; i++)
			create(w, OP_PULSE, SUB_STATUS, POKEYS_CLASS_READ);
		return;
	}
	create(w, OP_IO, 1, POKEYS_CLASS_WRITE);
	if (w->options.per_cycle > 1)
		create(w, OP_PULSE, SUB_STATUS, POKEYS_CLASS_READ);
	if (w->options.per_cycle > 2)
		create(w, slow[n % 6][0], slow[n % 6][1], POKEYS_CLASS_READ);
	if (w->options.oneshot_every && n % w->options.oneshot_every == 0)
		create(w, OP_PULSE, SUB_HOME, POKEYS_CLASS_ONESHOT);
}

static void reply_to(struct world *w, const uint8_t *request)
{
	uint8_t reply[POKEYS_PACKET_SIZE];

	script_reply_to(request, reply);
	memcpy(reply + AT_STAMP, request + AT_STAMP, 16);
	memcpy(w->last_replies[w->replies++ % 256], reply, sizeof(reply));
	if (w->hold_for && !w->held && get_u64(request + AT_STAMP) == w->hold_request) {
		memcpy(w->held_reply, reply, sizeof(reply));
		w->held = true;
		if (!w->hold_copy)
			return;
	}
	sim_link_push(&w->link, SIM_LINK_REPLY, w->now, reply, sizeof(reply));
}

/* As a device does: what is not a request is dropped (protocol section 1.5). */
static void arrive(struct world *w)
{
	struct world_waiting *place = &w->queue[(w->queue_head + w->queue_count) % WORLD_QUEUE];
	const uint64_t busy_until =
		w->queue_count ?
			w->queue[(w->queue_head + w->queue_count - 1) % WORLD_QUEUE].done_ns :
			w->now;
	size_t length;
	uint64_t peer;

	while (sim_link_pop_from(&w->link, SIM_LINK_REQUEST, w->now, &peer, place->bytes,
				 sizeof(place->bytes), &length)) {
		if (wire_check_request(place->bytes, length) != WIRE_OK ||
		    w->queue_count == WORLD_QUEUE)
			continue;
		place->done_ns = busy_until + w->options.service_ns;
		w->queue_count++;
		arrive(w);
		return;
	}
}

static void serve(struct world *w)
{
	arrive(w);
	while (w->queue_count && w->queue[w->queue_head].done_ns <= w->now) {
		const uint8_t *request = w->queue[w->queue_head].bytes;
		struct world_request *r = stamped(w, request);

		if (r) {
			if (!r->executed++)
				r->served_ns = w->now;
			/* I4, unless the network itself made two of one */
			CHECK(w, !r->oneshot || r->executed == 1 ||
					 w->options.way[SIM_LINK_REQUEST].duplicate > 0);
		}
		reply_to(w, request);
		w->queue_head = (w->queue_head + 1) % WORLD_QUEUE;
		w->queue_count--;
	}
}

static void check_invariants(struct world *w)
{
	const pokeys_device_t *dev = &w->dev;
	const struct pokeys_statistics *s = &dev->statistics;

	CHECK(w, dev->in_flight_count <= dev->options.window); /* I5 */
	CHECK(w, dev->open_count == w->requests - w->ended);   /* I3 */
	CHECK(w, s->created == w->requests);
	CHECK(w, s->done + s->timed_out + s->unknown + s->cancelled == w->ended);
	CHECK(w, s->sent == w->sends && s->resent == w->resends);
	CHECK(w, s->received == s->accepted + s->bad_length + s->bad_magic + s->bad_checksum +
					s->bad_source + s->bad_operation + s->bad_check +
					s->not_in_flight + s->duplicate + s->stale);
	for (uint32_t i = 0; i < dev->in_flight_count; i++) {
		const mailbox_entry_t *entry = &dev->mailbox[dev->in_flight[i]];

		CHECK(w, entry->state == POKEYS_REQUEST_IN_FLIGHT);
		CHECK(w, entry->deadline > w->now);
		CHECK(w, i == 0 || dev->mailbox[dev->in_flight[i - 1]].serial < entry->serial);
	}
}

void world_tick(struct world *w)
{
	w->now += w->options.tick_ns;
	serve(w);
	pokeys_device_receive(&w->dev, w->now);
	pokeys_device_check(&w->dev, w->now);
	if (!w->idle && w->now >= w->next_cycle_ns) {
		w->next_cycle_ns += w->options.period_ns;
		cycle(w);
	}
	if (w->held && (w->idle || w->requests >= w->hold_request + w->hold_for)) {
		sim_link_inject(&w->link, SIM_LINK_REPLY, w->now, 0, w->held_reply,
				sizeof(w->held_reply));
		w->held = false;
		w->hold_for = 0;
	}
	check_invariants(w);
}

void world_run(struct world *w, uint64_t for_ns)
{
	const uint64_t end = w->now + for_ns;

	while (w->now < end)
		world_tick(w);
}

void world_drain(struct world *w)
{
	w->idle = true;
	world_run(w, 3 * S);
	CHECK(w, w->ended == w->requests);
	for (uint32_t i = 0; i < WORLD_REQUESTS; i++)
		CHECK(w, !w->request[i].world || w->request[i].ends == 1);
}

void world_stall(struct world *w, uint64_t for_ns)
{
	const uint64_t end = w->now + for_ns;

	for (; w->now < end; w->now += w->options.tick_ns)
		serve(w);
	w->next_cycle_ns = w->now;
}

unsigned int world_answered_permille(const struct world *w)
{
	return (unsigned int)(w->dev.statistics.done * 1000 / w->requests);
}

void world_open(struct world *w, const struct world_options *options, uint64_t seed)
{
	const struct pokeys_io io = { world_send, world_receive, w };
	struct sim_link_options link;

	memset(w, 0, sizeof(*w));
	w->options = *options;
	w->seed = seed;
	w->options.period_ns = options->period_ns ? options->period_ns : 1 * MS;
	w->options.tick_ns = options->tick_ns ? options->tick_ns : 100 * US;
	w->options.per_cycle = options->per_cycle ? options->per_cycle : 2;
	memcpy(link.faults, options->way, sizeof(link.faults));
	sim_link_init(&w->link, &link, seed);
	sim_prng_init(&w->prng, ~seed);
	assert_int_equal(pokeys_device_init(&w->dev, &io, &options->mailbox), 0);
	w->now = S;
	w->next_cycle_ns = w->now;
}
