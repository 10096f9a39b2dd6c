/* SPDX-License-Identifier: MIT */
/*
 * Create, send, cancel and free requests.
 *
 * Creating reserves a place in the window, so that sending has only the
 * budget and the transport to fear. The state is brought in order before the
 * transport is called: one that answers from inside its send function (a
 * memory transport in a test) finds the request in flight.
 *
 * A transmission that the transport refused has not happened. For a read or
 * write it is a lost packet like any other. For a one-shot the difference
 * matters: refused it may be sent later, but once it has left it never is
 * again (invariant I4).
 */

#include <errno.h>
#include <string.h>
#include "daemon/engine/mailbox.h"

#define DEADLINE_MAX_NS 60000000000ull

/* What distinguishes a reply to this packet, besides its id. */
static uint16_t reply_key(const struct wire_op_row *row, const uint8_t *packet)
{
	if (row && (row->flags & WIRE_CHECK))
		return MAILBOX_KEY_NONE;
	return (uint16_t)(packet[WIRE_AT_OP] << 8 |
			  (row && (row->flags & WIRE_P1) ? packet[WIRE_AT_P1] : 0));
}

/*
 * Differs for 255 turns of an id, so an old reply does not pass. Multiplied by
 * 163, because 163 x 97 = 1 (mod 255): two ids of the same turn never share a
 * check byte, and of neighbouring turns only if they are 97 apart, which is
 * more than the window. So a reply with the id of another request in flight
 * does not pass either. Never 0.
 */
static uint8_t check_byte(const pokeys_device_t *dev, uint8_t id)
{
	return (uint8_t)(1 + (dev->id_turn + id * 163u) % 255);
}

void mailbox_finish(pokeys_device_t *dev, mailbox_entry_t *entry, const struct wire_op_row *row)
{
	uint8_t *packet = entry->request_buffer;

	packet[WIRE_AT_MAGIC] = WIRE_REQUEST;
	packet[WIRE_AT_OP] = entry->command_sent;
	if (row && (row->flags & WIRE_CHECK) && !packet[WIRE_AT_P2])
		packet[WIRE_AT_P2] = check_byte(dev, entry->request_id);
	wire_finish(packet, entry->request_id);
	entry->operation = row;
}

/* A fresh entry for this packet, not open yet; NULL with *error set. */
static mailbox_entry_t *take_entry(pokeys_device_t *dev, const uint8_t *packet, int *error)
{
	const struct wire_op_row *row = wire_op_find(packet[WIRE_AT_OP], packet[WIRE_AT_P1]);
	mailbox_entry_t *entry;
	int id;

	if (dev->open_count >= dev->options.window &&
	    !mailbox_once_makes_room(dev, packet[WIRE_AT_OP], row, dev->now)) {
		dev->statistics.refused_window++;
		*error = -EBUSY;
		return NULL;
	}
	id = mailbox_id_take(dev, reply_key(row, packet));
	if (id < 0) {
		*error = id;
		return NULL;
	}
	entry = &dev->mailbox[id];
	mailbox_tries_lost(dev, entry);
	memset(entry, 0, sizeof(*entry));
	entry->request_id = (uint8_t)id;
	entry->command_sent = packet[WIRE_AT_OP];
	entry->serial = ++dev->serial;
	entry->timestamp_created = dev->now;
	memcpy(entry->request_buffer, packet, POKEYS_PACKET_SIZE);
	mailbox_finish(dev, entry, row);
	return entry;
}

static void open_entry(pokeys_device_t *dev, mailbox_entry_t *entry, enum pokeys_class class)
{
	entry->request_class = (uint8_t)class;
	entry->retries_left = class == POKEYS_CLASS_ONESHOT ? 0 : (int)dev->options.retries;
	entry->state = POKEYS_REQUEST_CREATED;
	dev->open_count++;
	dev->statistics.created++;
}

static enum pokeys_class class_of(const mailbox_entry_t *entry)
{
	const struct wire_op_row *row = entry->operation;

	if (!row || (row->flags & WIRE_NO_REPLY))
		return POKEYS_CLASS_ONESHOT;
	switch (wire_request_class(row, entry->request_buffer)) {
	case WIRE_READ:
		return POKEYS_CLASS_READ;
	case WIRE_WRITE:
		return POKEYS_CLASS_WRITE;
	case WIRE_ONE_SHOT:
		break;
	}
	return POKEYS_CLASS_ONESHOT;
}

int CreateRequestAsyncWithPayload(pokeys_device_t *dev, pokeys_command_t command,
				  const uint8_t *params, size_t params_len, const void *payload,
				  size_t payload_size, void *target, size_t target_size)
{
	uint8_t packet[POKEYS_PACKET_SIZE] = { WIRE_REQUEST, command };
	mailbox_entry_t *entry;
	int error;

	if (params_len > 4 || payload_size > POKEYS_PAYLOAD_SIZE || (params_len && !params) ||
	    (payload_size && !payload))
		return -EINVAL;
	if (params_len)
		memcpy(packet + WIRE_AT_P1, params, params_len);
	if (payload_size)
		memcpy(packet + POKEYS_PAYLOAD_OFFSET, payload, payload_size);
	entry = take_entry(dev, packet, &error);
	if (!entry)
		return error;
	entry->target_ptr = target;
	entry->target_size = target_size < POKEYS_PAYLOAD_SIZE ? target_size : POKEYS_PAYLOAD_SIZE;
	open_entry(dev, entry, class_of(entry));
	return entry->request_id;
}

int CreateRequestAsync(pokeys_device_t *dev, pokeys_command_t command, const uint8_t *params,
		       size_t params_len, void *target, size_t target_size)
{
	return CreateRequestAsyncWithPayload(dev, command, params, params_len, NULL, 0, target,
					     target_size);
}

int pokeys_request_create(pokeys_device_t *dev, const uint8_t packet[POKEYS_PACKET_SIZE],
			  enum pokeys_class request_class, pokeys_parser_t parser,
			  pokeys_refresh_t refresh, void *context)
{
	mailbox_entry_t *entry;
	int error;

	if (!packet || (unsigned int)request_class > POKEYS_CLASS_ONESHOT)
		return -EINVAL;
	entry = take_entry(dev, packet, &error);
	if (!entry)
		return error;
	entry->parser = parser;
	entry->auto_free = parser != NULL;
	entry->refresh = refresh;
	entry->context = context;
	open_entry(dev, entry, request_class);
	return entry->request_id;
}

int mailbox_transmit(pokeys_device_t *dev, mailbox_entry_t *entry, uint64_t now_ns)
{
	const uint64_t serial = entry->serial;
	const uint64_t sent_before = entry->timestamp_sent;
	const bool again = entry->tries > 0;
	int r;

	mailbox_wait(dev, entry, now_ns);
	entry->timestamp_sent = now_ns;
	if (!entry->tries)
		entry->timestamp_first_sent = now_ns;
	entry->tries++;
	r = dev->io.send(dev->io.context, entry->request_buffer, POKEYS_PACKET_SIZE);
	if (r >= 0) {
		dev->statistics.sent++;
		dev->statistics.resent += again;
		return 0;
	}
	dev->statistics.send_failed++;
	if (entry->serial == serial && entry->state == POKEYS_REQUEST_IN_FLIGHT) {
		entry->tries--;
		entry->timestamp_sent = sent_before;
	}
	return r;
}

bool mailbox_refresh(pokeys_device_t *dev, mailbox_entry_t *entry)
{
	const uint64_t serial = entry->serial;

	if (entry->request_class != POKEYS_CLASS_WRITE || !entry->refresh)
		return true;
	entry->refresh(dev, entry, entry->context);
	if (entry->serial != serial || entry->state != POKEYS_REQUEST_IN_FLIGHT)
		return false;
	mailbox_finish(dev, entry,
		       wire_op_find(entry->command_sent, entry->request_buffer[WIRE_AT_P1]));
	return true;
}

int pokeys_request_send(pokeys_device_t *dev, uint8_t request_id, uint64_t now_ns)
{
	const uint64_t now = mailbox_time(dev, now_ns);
	mailbox_entry_t *entry = &dev->mailbox[request_id];
	int r;

	if (entry->state == POKEYS_REQUEST_FREE)
		return -ENOENT;
	if (entry->state != POKEYS_REQUEST_CREATED)
		return -EALREADY;
	mailbox_budget_fill(dev, now);
	if (!mailbox_budget_send(dev)) {
		dev->statistics.refused_budget++;
		return -EAGAIN;
	}
	mailbox_once_sends(dev, entry, now);
	mailbox_fly(dev, entry);
	r = mailbox_transmit(dev, entry, now);
	if (r >= 0 || entry->request_class != POKEYS_CLASS_ONESHOT)
		return 0;
	mailbox_land(dev, entry);
	return r;
}

int pokeys_request_resend(pokeys_device_t *dev, uint8_t request_id, uint64_t now_ns)
{
	const uint64_t now = mailbox_time(dev, now_ns);
	mailbox_entry_t *entry = &dev->mailbox[request_id];

	if (entry->state == POKEYS_REQUEST_FREE)
		return -ENOENT;
	if (entry->state != POKEYS_REQUEST_IN_FLIGHT)
		return -EALREADY;
	if (entry->request_class == POKEYS_CLASS_ONESHOT)
		return -EINVAL;
	mailbox_budget_fill(dev, now);
	if (!mailbox_budget_send(dev)) {
		dev->statistics.refused_budget++;
		return -EAGAIN;
	}
	if (!mailbox_refresh(dev, entry))
		return -ECANCELED;
	return mailbox_transmit(dev, entry, now);
}

int pokeys_request_set_deadline(pokeys_device_t *dev, uint8_t request_id, uint64_t deadline_ns)
{
	mailbox_entry_t *entry = &dev->mailbox[request_id];

	if (entry->state == POKEYS_REQUEST_FREE)
		return -ENOENT;
	if (entry->state != POKEYS_REQUEST_CREATED)
		return -EALREADY;
	if (!deadline_ns || deadline_ns > DEADLINE_MAX_NS)
		return -EINVAL;
	entry->fixed_deadline_ns = deadline_ns;
	return 0;
}

enum pokeys_request_state pokeys_request_state(const pokeys_device_t *dev, uint8_t request_id)
{
	return (enum pokeys_request_state)dev->mailbox[request_id].state;
}

const mailbox_entry_t *pokeys_request_get(const pokeys_device_t *dev, uint8_t request_id)
{
	const mailbox_entry_t *entry = &dev->mailbox[request_id];

	return entry->state == POKEYS_REQUEST_FREE ? NULL : entry;
}

int pokeys_request_cancel(pokeys_device_t *dev, uint8_t request_id, uint64_t now_ns)
{
	const uint64_t now = mailbox_time(dev, now_ns);
	mailbox_entry_t *entry = &dev->mailbox[request_id];

	if (!mailbox_is_open(entry))
		return -ENOENT;
	mailbox_end(dev, entry, POKEYS_REQUEST_CANCELLED, now);
	return 0;
}

int pokeys_request_free(pokeys_device_t *dev, uint8_t request_id)
{
	mailbox_entry_t *entry = &dev->mailbox[request_id];

	if (entry->state == POKEYS_REQUEST_FREE)
		return -ENOENT;
	if (mailbox_is_open(entry))
		return -EBUSY;
	entry->state = POKEYS_REQUEST_FREE;
	return 0;
}
