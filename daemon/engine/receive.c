/* SPDX-License-Identifier: MIT */
/*
 * From a datagram to a completed request, or to the counter that says why not.
 *
 * Nothing is copied out before every check has passed (invariant I1): source,
 * length, header, checksum, an open request of that id which has been sent,
 * operation and what the operation echoes, and age. The order decides only
 * which counter a packet with several faults gets; the source comes first, so
 * that the noise of strangers does not look like a bad link to the device.
 *
 * Age: the transport's time stamp says when the kernel took the packet. One
 * taken before the request was sent answers something else. One that has
 * waited in the socket while we were stalled is judged by its stamp, not by
 * when we got round to it, but without a stamp it must be taken for as old as
 * it may be: the value would be published as fresh. A stamp that is not
 * believable (a stepped clock behind it) counts as none.
 *
 * wire/ says "echo" both for a sub-operation and for an echoed parameter; they
 * are told apart here, because a differing sub-operation is a late answer of
 * another request, and a differing parameter is a confused device.
 */

#include <errno.h>
#include <string.h>
#include "daemon/engine/mailbox.h"

/* More than a packet, so that a transport which cuts datagrams shows it. */
enum { RECEIVE_SIZE = 72 };

static bool from_peer(const pokeys_device_t *dev, const struct pokeys_rx *rx)
{
	const struct pokeys_options *o = &dev->options;

	if (!rx)
		return true;
	if (o->peer_address && rx->address && rx->address != o->peer_address)
		return false;
	return !o->peer_port || !rx->port || rx->port == o->peer_port;
}

/* What is wrong with the packet by itself; ACCEPTED if nothing is. */
static enum pokeys_verdict judge_packet(const pokeys_device_t *dev, const uint8_t *packet,
					size_t length, const struct pokeys_rx *rx)
{
	if (!from_peer(dev, rx))
		return POKEYS_VERDICT_BAD_SOURCE;
	switch (wire_check_reply(packet, length)) {
	case WIRE_OK:
		return POKEYS_VERDICT_ACCEPTED;
	case WIRE_LENGTH:
		return POKEYS_VERDICT_BAD_LENGTH;
	case WIRE_MAGIC:
		return POKEYS_VERDICT_BAD_MAGIC;
	case WIRE_CHECKSUM:
	case WIRE_ID:
	case WIRE_OPERATION:
	case WIRE_ECHO:
	case WIRE_CHECK_BYTE:
	case WIRE_REASONS:
		break;
	}
	return POKEYS_VERDICT_BAD_CHECKSUM;
}

static bool sub_differs(const struct wire_op_row *row, const uint8_t *request, const uint8_t *reply)
{
	return row->sub.where && reply[row->sub.where] != request[row->sub.where];
}

/* Does a reply answer the request of its id? */
static enum pokeys_verdict judge_match(const mailbox_entry_t *entry, const uint8_t *reply)
{
	const struct wire_op_row *row = entry->operation;

	if (reply[WIRE_AT_OP] != entry->command_sent)
		return POKEYS_VERDICT_BAD_OPERATION;
	if (!row)
		return POKEYS_VERDICT_ACCEPTED;
	switch (wire_match_reply(row, entry->request_buffer, reply)) {
	case WIRE_OK:
		return POKEYS_VERDICT_ACCEPTED;
	case WIRE_ECHO:
		return sub_differs(row, entry->request_buffer, reply) ?
			       POKEYS_VERDICT_BAD_OPERATION :
			       POKEYS_VERDICT_BAD_CHECK;
	case WIRE_OPERATION:
	case WIRE_ID:
		return POKEYS_VERDICT_BAD_OPERATION;
	case WIRE_LENGTH:
	case WIRE_MAGIC:
	case WIRE_CHECKSUM:
	case WIRE_CHECK_BYTE:
	case WIRE_REASONS:
		break;
	}
	return POKEYS_VERDICT_BAD_CHECK;
}

/* When the reply came in, as far as it can be believed. */
static uint64_t arrival(const pokeys_device_t *dev, const mailbox_entry_t *entry,
			const struct pokeys_rx *rx, uint64_t now_ns)
{
	const uint64_t stamp = rx ? rx->t_ns : 0;

	if (!stamp || stamp > now_ns)
		return now_ns;
	if (stamp + dev->options.reply_lifetime_ns < entry->timestamp_first_sent)
		return now_ns;
	return stamp;
}

static bool is_young(const pokeys_device_t *dev, const mailbox_entry_t *entry, uint64_t came)
{
	uint64_t limit = entry->deadline - entry->timestamp_sent;

	if (limit < dev->options.reply_lifetime_ns)
		limit = dev->options.reply_lifetime_ns;
	return came >= entry->timestamp_first_sent && came <= entry->timestamp_sent + limit;
}

/* No request of this id is in flight: is it a copy of the last answer? */
static enum pokeys_verdict judge_stray(pokeys_device_t *dev, const mailbox_entry_t *entry,
				       const uint8_t *reply, uint64_t now_ns)
{
	const bool copy = entry->timestamp_received && entry->command_sent == reply[WIRE_AT_OP] &&
			  now_ns - entry->timestamp_received <= dev->options.reply_lifetime_ns;

	if (!copy)
		return POKEYS_VERDICT_NOT_IN_FLIGHT;
	mailbox_id_copy_seen(dev, entry->request_id, now_ns);
	return POKEYS_VERDICT_DUPLICATE;
}

/* A good packet for a request that has ended: perhaps the late answer to one of its tries. */
static bool answers_ended(enum pokeys_verdict verdict)
{
	return verdict == POKEYS_VERDICT_NOT_IN_FLIGHT || verdict == POKEYS_VERDICT_DUPLICATE;
}

static void count(struct pokeys_statistics *s, enum pokeys_verdict verdict)
{
	uint64_t *const counter[POKEYS_VERDICTS] = {
		[POKEYS_VERDICT_ACCEPTED] = &s->accepted,
		[POKEYS_VERDICT_BAD_SOURCE] = &s->bad_source,
		[POKEYS_VERDICT_BAD_LENGTH] = &s->bad_length,
		[POKEYS_VERDICT_BAD_MAGIC] = &s->bad_magic,
		[POKEYS_VERDICT_BAD_CHECKSUM] = &s->bad_checksum,
		[POKEYS_VERDICT_NOT_IN_FLIGHT] = &s->not_in_flight,
		[POKEYS_VERDICT_DUPLICATE] = &s->duplicate,
		[POKEYS_VERDICT_BAD_OPERATION] = &s->bad_operation,
		[POKEYS_VERDICT_BAD_CHECK] = &s->bad_check,
		[POKEYS_VERDICT_STALE] = &s->stale,
	};

	(*counter[verdict])++;
}

static void accept(pokeys_device_t *dev, mailbox_entry_t *entry, const uint8_t *reply,
		   uint64_t came, uint64_t now_ns)
{
	memcpy(entry->response_buffer, reply, POKEYS_PACKET_SIZE);
	entry->timestamp_received = came;
	entry->response_ready = true;
	if (entry->target_ptr && entry->target_size)
		memcpy(entry->target_ptr, reply + POKEYS_PAYLOAD_OFFSET, entry->target_size);
	if (entry->tries > 1)
		dev->statistics.accepted_earlier_try++;
	if (entry->missed >= entry->tries)
		mailbox_try_late(dev, entry);
	mailbox_deadline_learn(dev, entry);
	mailbox_once_answered(dev, entry, now_ns);
	mailbox_end(dev, entry, POKEYS_REQUEST_DONE, now_ns);
}

/* A reply that is good by itself. *came: when, if it is accepted. */
static enum pokeys_verdict judge_reply(pokeys_device_t *dev, const mailbox_entry_t *entry,
				       const uint8_t *reply, const struct pokeys_rx *rx,
				       uint64_t now_ns, uint64_t *came)
{
	enum pokeys_verdict verdict;

	if (entry->state != POKEYS_REQUEST_IN_FLIGHT || !entry->tries)
		return judge_stray(dev, entry, reply, now_ns);
	*came = arrival(dev, entry, rx, now_ns);
	verdict = judge_match(entry, reply);
	if (verdict == POKEYS_VERDICT_ACCEPTED && !is_young(dev, entry, *came))
		return POKEYS_VERDICT_STALE;
	return verdict;
}

int pokeys_device_deliver(pokeys_device_t *dev, const uint8_t *packet, size_t length,
			  const struct pokeys_rx *rx, uint64_t now_ns)
{
	const uint64_t now = mailbox_time(dev, now_ns);
	mailbox_entry_t *entry = NULL;
	enum pokeys_verdict verdict;
	uint64_t came = now;

	dev->statistics.received++;
	verdict = judge_packet(dev, packet, length, rx);
	if (verdict == POKEYS_VERDICT_ACCEPTED) {
		entry = &dev->mailbox[wire_packet_id(packet)];
		verdict = judge_reply(dev, entry, packet, rx, now, &came);
	}
	dev->verdict = (uint8_t)verdict;
	count(&dev->statistics, verdict);
	if (verdict != POKEYS_VERDICT_ACCEPTED) {
		if (answers_ended(verdict) && judge_match(entry, packet) == POKEYS_VERDICT_ACCEPTED)
			mailbox_try_late(dev, entry);
		return 0;
	}
	accept(dev, entry, packet, came, now);
	return 1;
}

int pokeys_device_receive(pokeys_device_t *dev, uint64_t now_ns)
{
	const uint64_t now = mailbox_time(dev, now_ns);
	uint8_t packet[RECEIVE_SIZE];
	int completed = 0;

	if (!dev->io.receive)
		return 0;
	for (unsigned int i = 0; i < POKEYS_MAILBOX_SIZE; i++) {
		struct pokeys_rx rx = { 0 };
		const int r = dev->io.receive(dev->io.context, packet, sizeof(packet), &rx);

		if (r < 0)
			return r == -EAGAIN || completed ? completed : r;
		completed += pokeys_device_deliver(dev, packet, (size_t)r, &rx, now);
	}
	return completed;
}
