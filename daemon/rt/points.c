/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The points at which somebody may watch: what the flight recorder keeps, and the
 * probes.
 *
 * Everything that is told here is known already; nothing is measured for it. A
 * request's time is the mailbox's own (the last time that the loop has read), so
 * the round trips in a record are those that the mailbox counted. It leaves the
 * machine a little later, when the transport hands its queue to the kernel.
 */
#include "daemon/rt/internal.h"
#include "daemon/rt/probes.h"

enum { AT_OPERATION = 1, AT_SUB = 2, AT_ID = 6 }; /* protocol section 1.2 */

void point_woke(struct loop *loop, uint64_t tick_ns, uint64_t woke_ns, uint64_t skipped)
{
	struct loop_private *own = loop->own;

	own->points = (struct recorder_cycle){
		.cycle = own->cycle,
		.tick_ns = tick_ns,
		.woke_ns = woke_ns,
		.asked_ns = woke_ns,
		.published_ns = woke_ns,
		.skipped = (uint32_t)skipped,
	};
	PROBE3(wakeup, own->cycle, tick_ns, woke_ns);
	if (skipped)
		PROBE3(skipped, own->cycle, skipped, woke_ns - tick_ns);
}

void point_sent(struct loop *loop, uint32_t channel, const uint8_t *packet, size_t length)
{
	const struct loop_private *own = loop->own;
	const struct transport_address *local = &loop->transport->local[channel];
	const pokeys_device_t *mailbox = device_mailbox(loop->devices[channel].device);
	const mailbox_entry_t *entry = &mailbox->mailbox[packet[AT_ID]];
	const uint8_t tries = entry->tries;
	const struct recorder_slot slot = {
		.t_ns = own->now_ns,
		.peer = (uint32_t)(own->member[channel].address >> 16),
		.peer_port = (uint16_t)own->member[channel].address,
		.local = local->address,
		.local_port = local->port,
		.length = (uint16_t)length,
		.kind = RECORDER_SENT,
		.device = (uint8_t)channel,
		.tries = tries,
		.once = entry->once,
		.cycle = (uint32_t)own->cycle,
	};

	recorder_write(&loop->recorder, &slot, packet, length);
	if (tries > 1)
		PROBE5(retry, channel, packet[AT_OPERATION], packet[AT_ID], tries, own->now_ns);
	else
		PROBE5(send, channel, packet[AT_OPERATION], packet[AT_SUB], packet[AT_ID],
		       own->now_ns);
}

void point_received(struct loop *loop, const struct transport_packet *p, uint64_t now_ns)
{
	const struct transport_address *local = &loop->transport->local[p->channel];
	const pokeys_device_t *mailbox = device_mailbox(loop->devices[p->channel].device);
	const mailbox_entry_t *entry = &mailbox->mailbox[p->length > AT_ID ? p->data[AT_ID] : 0];
	const bool stamped = p->t_ns && p->t_ns <= now_ns;
	const struct recorder_slot slot = {
		.t_ns = stamped ? p->t_ns : now_ns,
		.taken_ns = now_ns,
		.stamped = stamped,
		.peer = p->address,
		.peer_port = p->port,
		.local = local->address,
		.local_port = local->port,
		.length = (uint16_t)(p->length < UINT16_MAX ? p->length : UINT16_MAX),
		.kind = RECORDER_RECEIVED,
		.device = (uint8_t)p->channel,
		.verdict = mailbox->verdict,
		.cycle = (uint32_t)loop->own->cycle,
	};

	recorder_write(&loop->recorder, &slot, p->data, p->length);
	PROBE5(dispatch, p->channel, entry->command_sent, entry->request_id, mailbox->verdict,
	       entry->timestamp_received - entry->timestamp_sent);
}

void point_published(struct loop *loop, uint32_t i, uint64_t began_ns, uint64_t ended_ns)
{
	loop->own->points.published_ns = ended_ns;
	PROBE4(publish, i, loop->own->cycle, began_ns, ended_ns);
}

void point_ended(struct loop *loop, uint64_t end_ns)
{
	struct loop_private *own = loop->own;
	const struct recorder_slot slot = {
		.t_ns = end_ns,
		.length = sizeof(own->points),
		.kind = RECORDER_CYCLE,
		.device = 255,
		.cycle = (uint32_t)own->cycle,
	};

	own->points.end_ns = end_ns;
	recorder_write(&loop->recorder, &slot, &own->points, sizeof(own->points));
	PROBE3(cycle_end, own->cycle, own->points.tick_ns, end_ns);
}
