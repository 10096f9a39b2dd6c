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

/* The counter of what is wrong with the packet by itself, NULL if nothing is. */
static uint64_t *packet_fault(pokeys_device_t *dev, const uint8_t *packet, size_t length,
			      const struct pokeys_rx *rx)
{
	struct pokeys_statistics *s = &dev->statistics;

	if (!from_peer(dev, rx))
		return &s->bad_source;
	switch (wire_check_reply(packet, length)) {
	case WIRE_OK:
		return NULL;
	case WIRE_LENGTH:
		return &s->bad_length;
	case WIRE_MAGIC:
		return &s->bad_magic;
	case WIRE_CHECKSUM:
	case WIRE_ID:
	case WIRE_OPERATION:
	case WIRE_ECHO:
	case WIRE_CHECK_BYTE:
	case WIRE_REASONS:
		break;
	}
	return &s->bad_checksum;
}

static bool sub_differs(const struct wire_op_row *row, const uint8_t *request,
			const uint8_t *reply)
{
	return row->sub.where && reply[row->sub.where] != request[row->sub.where];
}

/* The counter of why a reply does not answer the request of its id. */
static uint64_t *match_fault(pokeys_device_t *dev, const mailbox_entry_t *entry,
			     const uint8_t *reply)
{
	const struct wire_op_row *row = entry->operation;
	struct pokeys_statistics *s = &dev->statistics;

	if (reply[WIRE_AT_OP] != entry->command_sent)
		return &s->bad_operation;
	if (!row)
		return NULL;
	switch (wire_match_reply(row, entry->request_buffer, reply)) {
	case WIRE_OK:
		return NULL;
	case WIRE_ECHO:
		return sub_differs(row, entry->request_buffer, reply) ? &s->bad_operation :
									&s->bad_check;
	case WIRE_OPERATION:
	case WIRE_ID:
		return &s->bad_operation;
	case WIRE_LENGTH:
	case WIRE_MAGIC:
	case WIRE_CHECKSUM:
	case WIRE_CHECK_BYTE:
	case WIRE_REASONS:
		break;
	}
	return &s->bad_check;
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
static void count_stray(pokeys_device_t *dev, const mailbox_entry_t *entry, const uint8_t *reply,
			uint64_t now_ns)
{
	const bool copy = entry->timestamp_received && entry->command_sent == reply[WIRE_AT_OP] &&
			  now_ns - entry->timestamp_received <= dev->options.reply_lifetime_ns;

	if (!copy) {
		dev->statistics.not_in_flight++;
		return;
	}
	dev->statistics.duplicate++;
	mailbox_id_copy_seen(dev, entry->request_id, now_ns);
}

static void accept(pokeys_device_t *dev, mailbox_entry_t *entry, const uint8_t *reply,
		   uint64_t came, uint64_t now_ns)
{
	memcpy(entry->response_buffer, reply, POKEYS_PACKET_SIZE);
	entry->timestamp_received = came;
	entry->response_ready = true;
	if (entry->target_ptr && entry->target_size)
		memcpy(entry->target_ptr, reply + POKEYS_PAYLOAD_OFFSET, entry->target_size);
	dev->statistics.accepted++;
	if (entry->tries > 1)
		dev->statistics.accepted_earlier_try++;
	mailbox_deadline_learn(dev, entry);
	mailbox_end(dev, entry, POKEYS_REQUEST_DONE, now_ns);
}

int pokeys_device_deliver(pokeys_device_t *dev, const uint8_t *packet, size_t length,
			  const struct pokeys_rx *rx, uint64_t now_ns)
{
	const uint64_t now = mailbox_time(dev, now_ns);
	mailbox_entry_t *entry;
	uint64_t *fault, came;

	dev->statistics.received++;
	fault = packet_fault(dev, packet, length, rx);
	if (fault) {
		(*fault)++;
		return 0;
	}
	entry = &dev->mailbox[wire_packet_id(packet)];
	if (entry->state != POKEYS_REQUEST_IN_FLIGHT || !entry->tries) {
		count_stray(dev, entry, packet, now);
		return 0;
	}
	came = arrival(dev, entry, rx, now);
	fault = match_fault(dev, entry, packet);
	if (!fault && !is_young(dev, entry, came))
		fault = &dev->statistics.stale;
	if (fault) {
		(*fault)++;
		return 0;
	}
	accept(dev, entry, packet, came, now);
	return 1;
}

int PK_ReceiveAndDispatch(pokeys_device_t *dev, uint64_t now_ns)
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
