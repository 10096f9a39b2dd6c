/* SPDX-License-Identifier: MIT */
/*
 * The life of an entry, from the moment it is in flight to its end.
 *
 * A request ends exactly once (invariant I3): there is one function that ends
 * requests, and it takes the entry out of every list before it calls the
 * parser. So the parser sees a mailbox in order and may create, send and
 * cancel from inside. The entry keeps its ended state until the parser has
 * returned, so a request made there cannot get the same entry, unless the
 * parser gave it back itself; the serial number tells that case.
 *
 * in_flight[] is ordered by age: resends go to the oldest first. Its length is
 * bounded by the window, so taking an id out of the middle is a short move.
 */

#include <errno.h>
#include <string.h>
#include "daemon/engine/mailbox.h"

uint64_t mailbox_time(pokeys_device_t *dev, uint64_t now_ns)
{
	if (now_ns > dev->now)
		dev->now = now_ns;
	return dev->now;
}

void mailbox_try_missed(pokeys_device_t *dev, mailbox_entry_t *entry)
{
	/* A resend that was refused leaves the try that has been counted already. */
	if (entry->missed >= entry->tries)
		return;
	entry->missed++;
	dev->statistics.missed++;
}

void mailbox_try_late(pokeys_device_t *dev, mailbox_entry_t *entry)
{
	if (!entry->missed)
		return;
	entry->missed--;
	dev->statistics.late++;
}

void mailbox_tries_lost(pokeys_device_t *dev, mailbox_entry_t *entry)
{
	dev->statistics.lost += entry->missed;
	entry->missed = 0;
}

void mailbox_fly(pokeys_device_t *dev, mailbox_entry_t *entry)
{
	entry->state = POKEYS_REQUEST_IN_FLIGHT;
	dev->in_flight[dev->in_flight_count++] = entry->request_id;
	dev->statistics.in_flight = dev->in_flight_count;
	if (dev->in_flight_count > dev->statistics.in_flight_high)
		dev->statistics.in_flight_high = dev->in_flight_count;
}

void mailbox_land(pokeys_device_t *dev, mailbox_entry_t *entry)
{
	uint32_t i = 0;

	while (i < dev->in_flight_count && dev->in_flight[i] != entry->request_id)
		i++;
	if (i == dev->in_flight_count)
		return;
	dev->in_flight_count--;
	memmove(&dev->in_flight[i], &dev->in_flight[i + 1], dev->in_flight_count - i);
	dev->statistics.in_flight = dev->in_flight_count;
	entry->state = POKEYS_REQUEST_CREATED;
}

static void count_end(struct pokeys_statistics *statistics, enum pokeys_request_state state)
{
	if (state == POKEYS_REQUEST_DONE)
		statistics->done++;
	else if (state == POKEYS_REQUEST_TIMED_OUT)
		statistics->timed_out++;
	else if (state == POKEYS_REQUEST_UNKNOWN)
		statistics->unknown++;
	else
		statistics->cancelled++;
}

void mailbox_end(pokeys_device_t *dev, mailbox_entry_t *entry, enum pokeys_request_state state,
		 uint64_t now_ns)
{
	const uint64_t serial = entry->serial;

	mailbox_land(dev, entry);
	dev->open_count--;
	entry->state = (uint8_t)state;
	count_end(&dev->statistics, state);
	mailbox_id_rest(dev, entry, now_ns);
	if (!entry->parser)
		return;
	entry->parser(dev, entry, entry->context, now_ns);
	if (entry->auto_free && entry->serial == serial && !mailbox_is_open(entry))
		entry->state = POKEYS_REQUEST_FREE;
}
