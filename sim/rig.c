// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Device, link and the queue between them.
 *
 * The device is a serial server: it takes one request after another, in the
 * order they arrived, and each costs it some time. What arrives while it is
 * busy waits, and what does not fit is lost, as in the receive buffer of a
 * small controller; a stream is held up instead, for which it has places of its
 * own. A client which asks faster than it is served sees its replies later and
 * later, and that is the point of modelling it.
 *
 * Events are taken strictly in their order in time, whatever the step in
 * which the caller's clock moves. A run is therefore the same whether it is
 * advanced by microseconds or by seconds.
 */
#include "sim/rig.h"

#include <string.h>

void sim_rig_init(struct sim_rig *rig, const struct sim_rig_options *options)
{
	static const struct sim_rig_options none;

	if (!options)
		options = &none;
	sim_device_init(&rig->device, &options->device);
	sim_link_init(&rig->link, &options->link, options->seed);
	sim_prng_init(&rig->prng, ~options->seed);
	rig->service_ns = options->service_ns;
	rig->jitter_ns = options->jitter_ns;
	rig->hiccup = options->hiccup;
	rig->hiccup_ns = options->hiccup_ns;
	rig->save_ns = options->save_ns;
	rig->busy_ns = 0;
	rig->done_ns = 0;
	rig->head = 0;
	rig->used = 0;
	rig->streamed = 0;
	rig->replied = false;
	memset(&rig->stats, 0, sizeof(rig->stats));
}

/* When a request the device turns to at now_ns will have been served. */
static uint64_t served_at(struct sim_rig *rig, uint64_t now_ns)
{
	uint64_t ns = rig->service_ns + (rig->busy_ns > now_ns ? rig->busy_ns : now_ns);

	if (rig->jitter_ns)
		ns += sim_prng_below(&rig->prng, rig->jitter_ns + 1);
	if (sim_prng_chance(&rig->prng, rig->hiccup))
		ns += rig->hiccup_ns;
	return ns;
}

static bool is_streamed(const struct sim_rig_waiting *request)
{
	return request->peer & SIM_PEER_RELIABLE;
}

/* There always is one: room is kept for both kinds of request, and one place more. */
static struct sim_rig_waiting *tail(struct sim_rig *rig)
{
	return &rig->queue[(rig->head + rig->used) % SIM_RIG_PLACES];
}

/* Leaves what stands in the tail in the queue, or loses it when its kind is too many. */
static void enqueue(struct sim_rig *rig, uint64_t now_ns)
{
	bool streamed = is_streamed(tail(rig));

	if (streamed ? rig->streamed == SIM_RIG_STREAM :
		       rig->used - rig->streamed == SIM_RIG_QUEUE) {
		rig->stats.overflow++;
		return;
	}
	rig->streamed += streamed;
	if (!rig->used++)
		rig->done_ns = served_at(rig, now_ns);
	if (rig->used > rig->stats.high_water)
		rig->stats.high_water = rig->used;
}

/* Takes one packet which has reached the device; false when there is none by then. */
static bool arrive(struct sim_rig *rig, uint64_t now_ns)
{
	struct sim_rig_waiting *place = tail(rig);
	size_t len;

	if (!sim_link_pop_from(&rig->link, SIM_LINK_REQUEST, now_ns, &place->peer, place->bytes,
			       sizeof(place->bytes), &len))
		return false;
	place->len = (uint16_t)len;
	enqueue(rig, now_ns);
	return true;
}

static void reply_to(struct sim_rig *rig, uint64_t now_ns, uint64_t peer, const uint8_t *reply)
{
	rig->last_peer = peer;
	rig->replied = true;
	memcpy(rig->last_reply, reply, WIRE_PK);
	if (peer & SIM_PEER_RELIABLE)
		sim_link_inject(&rig->link, SIM_LINK_REPLY, now_ns, peer, reply, WIRE_PK);
	else
		sim_link_push_from(&rig->link, SIM_LINK_REPLY, now_ns, peer, reply, WIRE_PK);
}

static void serve(struct sim_rig *rig)
{
	struct sim_rig_waiting *first = &rig->queue[rig->head];
	uint64_t now_ns = rig->done_ns;
	uint64_t saves = rig->device.stats.saves;
	uint8_t reply[WIRE_PK];

	rig->head = (rig->head + 1) % SIM_RIG_PLACES;
	rig->used--;
	rig->streamed -= is_streamed(first);
	rig->stats.served++;
	if (sim_device_request(&rig->device, now_ns, first->bytes, first->len, reply))
		reply_to(rig, now_ns, first->peer, reply);
	if (rig->device.stats.saves != saves)
		rig->busy_ns = now_ns + rig->save_ns;
	if (rig->used)
		rig->done_ns = served_at(rig, now_ns);
}

void sim_rig_run(struct sim_rig *rig, uint64_t now_ns)
{
	for (;;) {
		uint64_t arrival = sim_link_next(&rig->link, SIM_LINK_REQUEST);
		uint64_t done = rig->used ? rig->done_ns : SIM_RIG_NEVER;

		if (done <= arrival && done <= now_ns)
			serve(rig);
		else if (arrival > now_ns || !arrive(rig, arrival))
			break;
	}
	sim_device_advance(&rig->device, now_ns);
}

unsigned int sim_rig_waiting(const struct sim_rig *rig, uint64_t peer, uint64_t mask)
{
	unsigned int count = 0;

	for (unsigned int i = 0; i < rig->used; i++)
		count += !((rig->queue[(rig->head + i) % SIM_RIG_PLACES].peer ^ peer) & mask);
	return count;
}

/* Nothing happens to a stream on its way: it is there at once, after what came before. */
static void send_streamed(struct sim_rig *rig, uint64_t now_ns, uint64_t peer, const uint8_t *bytes,
			  size_t len)
{
	struct sim_rig_waiting *place;

	sim_rig_run(rig, now_ns);
	place = tail(rig);
	place->peer = peer;
	place->len = (uint16_t)len;
	memcpy(place->bytes, bytes, len);
	enqueue(rig, now_ns);
}

void sim_rig_send_from(struct sim_rig *rig, uint64_t now_ns, uint64_t peer, const uint8_t *bytes,
		       size_t len)
{
	if (peer & SIM_PEER_RELIABLE)
		send_streamed(rig, now_ns, peer, bytes, len);
	else
		sim_link_push_from(&rig->link, SIM_LINK_REQUEST, now_ns, peer, bytes, len);
}

void sim_rig_send(struct sim_rig *rig, uint64_t now_ns, const uint8_t *bytes, size_t len)
{
	sim_rig_send_from(rig, now_ns, 0, bytes, len);
}

bool sim_rig_receive_for(struct sim_rig *rig, uint64_t now_ns, uint64_t *peer, uint8_t *bytes,
			 size_t cap, size_t *len)
{
	sim_rig_run(rig, now_ns);
	while (sim_link_pop_from(&rig->link, SIM_LINK_REPLY, now_ns, peer, bytes, cap, len)) {
		if (*len)
			return true;
	}
	return false;
}

size_t sim_rig_receive(struct sim_rig *rig, uint64_t now_ns, uint8_t *bytes, size_t cap)
{
	uint64_t peer;
	size_t len;

	return sim_rig_receive_for(rig, now_ns, &peer, bytes, cap, &len) ? len : 0;
}

static uint64_t earlier(uint64_t a, uint64_t b)
{
	return a < b ? a : b;
}

uint64_t sim_rig_next(const struct sim_rig *rig)
{
	uint64_t next = earlier(sim_link_next(&rig->link, SIM_LINK_REQUEST),
				sim_link_next(&rig->link, SIM_LINK_REPLY));

	return rig->used ? earlier(next, rig->done_ns) : next;
}

void sim_rig_reboot(struct sim_rig *rig, uint64_t now_ns, bool lose_config)
{
	sim_rig_run(rig, now_ns);
	rig->used = 0;
	rig->streamed = 0;
	sim_device_reboot(&rig->device, now_ns, lose_config);
}

bool sim_rig_stray(struct sim_rig *rig, uint64_t now_ns)
{
	if (!rig->replied)
		return false;
	sim_link_inject(&rig->link, SIM_LINK_REPLY, now_ns, rig->last_peer, rig->last_reply,
			WIRE_PK);
	return true;
}

void sim_rig_silence(struct sim_rig *rig, uint64_t now_ns, uint64_t for_ns)
{
	for (unsigned int dir = 0; dir < SIM_LINK_DIRS; dir++)
		sim_link_silence(&rig->link, (enum sim_link_dir)dir, now_ns, now_ns + for_ns);
}
