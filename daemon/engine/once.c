/* SPDX-License-Identifier: MIT */
/*
 * Requests that a newer one of their kind replaces (pokeys_request_set_once()).
 *
 * They are of one kind if they are the same operation. One that is late is sent once more if
 * it is still the newest: the next one may not come for a whole cycle. What a late answer
 * says is worth something as long as no newer one was answered. So when one is answered,
 * older ones are not sent again, and those that are late end. Of those that are late when the
 * next is sent, only the newest waits on, and none in a small window, so that they never fill
 * it. If it is full nevertheless, the next one takes the place of the oldest of its kind.
 */

#include <errno.h>
#include "daemon/engine/mailbox.h"

enum { ROOMY = 16 };

static bool is_of_kind(const mailbox_entry_t *entry, const mailbox_entry_t *other)
{
	return entry->once && entry->operation == other->operation &&
	       entry->command_sent == other->command_sent;
}

/* The oldest one of the kind of `of`, before it, and late if that is asked for. */
static mailbox_entry_t *oldest(pokeys_device_t *dev, const mailbox_entry_t *of, bool late)
{
	for (uint32_t i = 0; i < dev->in_flight_count; i++) {
		mailbox_entry_t *entry = &dev->mailbox[dev->in_flight[i]];

		if (entry->serial < of->serial && is_of_kind(entry, of) && (!late || entry->missed))
			return entry;
	}
	return NULL;
}

bool mailbox_once_is_newest(const pokeys_device_t *dev, const mailbox_entry_t *entry)
{
	for (uint32_t i = 0; i < dev->in_flight_count; i++) {
		const mailbox_entry_t *other = &dev->mailbox[dev->in_flight[i]];

		if (other->serial > entry->serial && is_of_kind(other, entry))
			return false;
	}
	return true;
}

static unsigned int count_late(const pokeys_device_t *dev, const mailbox_entry_t *of)
{
	unsigned int late = 0;

	for (uint32_t i = 0; i < dev->in_flight_count; i++) {
		const mailbox_entry_t *entry = &dev->mailbox[dev->in_flight[i]];

		late += entry->serial < of->serial && is_of_kind(entry, of) && entry->missed;
	}
	return late;
}

void mailbox_once_answered(pokeys_device_t *dev, const mailbox_entry_t *entry, uint64_t now_ns)
{
	mailbox_entry_t *older;

	if (!entry->once)
		return;
	for (uint32_t i = 0; i < dev->in_flight_count; i++) {
		older = &dev->mailbox[dev->in_flight[i]];
		if (older->serial < entry->serial && is_of_kind(older, entry))
			older->retries_left = 0;
	}
	while ((older = oldest(dev, entry, true)))
		mailbox_end(dev, older, POKEYS_REQUEST_CANCELLED, now_ns);
}

void mailbox_once_sends(pokeys_device_t *dev, const mailbox_entry_t *entry, uint64_t now_ns)
{
	const unsigned int kept = dev->options.window >= ROOMY;

	if (!entry->once)
		return;
	while (count_late(dev, entry) > kept)
		mailbox_end(dev, oldest(dev, entry, true), POKEYS_REQUEST_CANCELLED, now_ns);
}

bool mailbox_once_makes_room(pokeys_device_t *dev, uint8_t command, const void *operation,
			     uint64_t now_ns)
{
	const mailbox_entry_t next = {
		.command_sent = command,
		.operation = operation,
		.serial = UINT64_MAX,
	};
	mailbox_entry_t *entry = oldest(dev, &next, false);

	if (!entry)
		return false;
	mailbox_end(dev, entry, POKEYS_REQUEST_CANCELLED, now_ns);
	return dev->open_count < dev->options.window;
}

int pokeys_request_set_once(pokeys_device_t *dev, uint8_t request_id)
{
	mailbox_entry_t *entry = &dev->mailbox[request_id];

	if (entry->state == POKEYS_REQUEST_FREE)
		return -ENOENT;
	if (entry->state != POKEYS_REQUEST_CREATED)
		return -EALREADY;
	if (entry->request_class == POKEYS_CLASS_ONESHOT)
		return -EINVAL;
	entry->once = true;
	return 0;
}
