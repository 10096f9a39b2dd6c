/* SPDX-License-Identifier: MIT */
/*
 * Set up, aim and reset a mailbox.
 *
 * Options are checked once, here, and stored complete, so that nothing below
 * has to know what a zero stands for. A reset ends what is open but forgets
 * neither counters nor the rest of used ids: answers to what was sent before
 * may still arrive after it.
 */

#include <errno.h>
#include <string.h>
#include "daemon/engine/mailbox.h"

#define US 1000u
#define MS 1000000u
#define S 1000000000ull

static bool in_range(uint64_t value, uint64_t low, uint64_t high)
{
	return value >= low && value <= high;
}

static uint64_t lesser(uint64_t a, uint64_t b)
{
	return a < b ? a : b;
}

/* Defaults give way where the other option of a pair was set. */
static void default_times(struct pokeys_options *o)
{
	if (!o->deadline_floor_ns)
		o->deadline_floor_ns = o->deadline_ceiling_ns ?
					       lesser(300 * US, o->deadline_ceiling_ns) :
					       300 * US;
	if (!o->deadline_ceiling_ns)
		o->deadline_ceiling_ns = o->deadline_floor_ns > 50 * MS ? o->deadline_floor_ns :
									  50 * MS;
	if (!o->deadline_initial_ns) {
		o->deadline_initial_ns = lesser(10 * MS, o->deadline_ceiling_ns);
		if (o->deadline_initial_ns < o->deadline_floor_ns)
			o->deadline_initial_ns = o->deadline_floor_ns;
	}
	if (!o->reply_lifetime_ns)
		o->reply_lifetime_ns = 500 * MS;
	if (!o->id_rest_ns)
		o->id_rest_ns = lesser(20 * MS, o->reply_lifetime_ns);
}

static void default_counts(struct pokeys_options *o)
{
	if (!o->retries)
		o->retries = 3;
	else if (o->retries == POKEYS_NO_RETRIES)
		o->retries = 0;
	if (!o->window)
		o->window = 8;
	if (!o->retry_budget)
		o->retry_budget = 200;
	if (!o->send_budget)
		o->send_budget = 8000;
}

static bool options_are_sane(const struct pokeys_options *o)
{
	return in_range(o->deadline_floor_ns, 50 * US, 1 * S) &&
	       in_range(o->deadline_ceiling_ns, o->deadline_floor_ns, 5 * S) &&
	       in_range(o->deadline_initial_ns, o->deadline_floor_ns, o->deadline_ceiling_ns) &&
	       in_range(o->reply_lifetime_ns, 1 * MS, 60 * S) &&
	       in_range(o->id_rest_ns, 1, o->reply_lifetime_ns) && in_range(o->retries, 0, 20) &&
	       in_range(o->window, 1, POKEYS_WINDOW_MAX) && in_range(o->retry_budget, 1, 100000) &&
	       in_range(o->send_budget, 1, 1000000);
}

int pokeys_device_init(pokeys_device_t *dev, const struct pokeys_io *io,
		       const struct pokeys_options *options)
{
	struct pokeys_options o = { 0 };

	if (!dev || !io || !io->send)
		return -EINVAL;
	if (options)
		o = *options;
	default_times(&o);
	default_counts(&o);
	if (!options_are_sane(&o))
		return -EINVAL;
	memset(dev, 0, sizeof(*dev));
	dev->io = *io;
	dev->options = o;
	dev->next_id = o.first_id;
	for (unsigned int id = 0; id < POKEYS_MAILBOX_SIZE; id++) {
		dev->mailbox[id].request_id = (uint8_t)id;
		dev->id_key[id] = MAILBOX_KEY_NONE;
	}
	mailbox_budget_init(dev);
	return 0;
}

/* Requests that parsers create meanwhile are of the time after the reset. */
void pokeys_device_reset(pokeys_device_t *dev, uint64_t now_ns)
{
	const uint64_t newest = dev->serial;
	const uint64_t now = mailbox_time(dev, now_ns);

	mailbox_deadline_forget(dev);
	for (unsigned int id = 0; id < POKEYS_MAILBOX_SIZE; id++) {
		mailbox_entry_t *entry = &dev->mailbox[id];

		if (mailbox_is_open(entry) && entry->serial <= newest)
			mailbox_end(dev, entry, POKEYS_REQUEST_CANCELLED, now);
	}
}

void pokeys_device_set_peer(pokeys_device_t *dev, uint32_t address, uint16_t port)
{
	dev->options.peer_address = address;
	dev->options.peer_port = port;
}

void pokeys_device_statistics(const pokeys_device_t *dev, struct pokeys_statistics *out)
{
	*out = dev->statistics;
	out->in_flight = dev->in_flight_count;
	out->deadline_ns = mailbox_deadline(dev, NULL);
}
