/* SPDX-License-Identifier: MIT */
/*
 * Which of the 256 request ids comes next, and how long a used one rests.
 *
 * The id and the operation are all that ties a reply to its request (protocol
 * section 1.4), so whatever could still answer an earlier use of an id must
 * be impossible, or at least of another operation, when the id is used again:
 *
 * - A try without answer may be answered as long as a packet can live. The id
 *   is blocked for reply_lifetime_ns, hard: if no id is left the request is
 *   refused. At a low rate a packet that outlives even that would find its id
 *   in its next turn, so such an id is also passed over for two turns while
 *   there are others.
 * - After the one answer to the one try, only a copy of the packet made by
 *   the network can come. Copies follow closely, so the id rests for
 *   id_rest_ns after the last of them. Blocking for the whole lifetime would
 *   be safer yet and allow 512 requests a second, a sixth of what is needed.
 * - A copy that comes still later is harmless if the id is then in flight for
 *   another operation, for its reply does not fit. So an id whose last use
 *   looked alike is passed over if one of the next few did not; where two
 *   operations take turns, this alone doubles the distance. Replies with a
 *   check byte never look alike.
 *
 * - Of what is asked in every cycle, a third may go unanswered on a bad link: a
 *   thousand ids a second. These rest for 100 ms at least, and longer as long as
 *   there are others. An answer that is older than that, and to the same
 *   operation, shows old inputs for a cycle, or acknowledges a write that was lost;
 *   a status has its check byte.
 *
 * An ended request keeps its entry, and so its id, until its caller gives it
 * back. One that never does must not run out of ids after 256 requests: where
 * no other id is free, the entry is taken from a request that has ended and
 * that is POKEYS_KEPT_REQUESTS old.
 *
 * Going round in order keeps the distance between two uses as long as it can
 * be, 256 requests, and makes the search short.
 */

#include <errno.h>
#include "daemon/engine/mailbox.h"

#define ONCE_REST_NS UINT64_C(100000000)

enum {
	LOOK_AHEAD = 8,      /* free ids looked at for one of another operation */
	SHUN_REQUESTS = 512, /* two turns of all ids */
};

static bool entry_is_free(const pokeys_device_t *dev, const mailbox_entry_t *entry)
{
	(void)dev;
	return entry->state == POKEYS_REQUEST_FREE;
}

/* One with a parser is not left: its parser runs now, and may be who wants an id. */
static bool entry_is_left(const pokeys_device_t *dev, const mailbox_entry_t *entry)
{
	return !mailbox_is_open(entry) && !entry->auto_free &&
	       dev->serial - entry->serial >= POKEYS_KEPT_REQUESTS;
}

/* The best id of one turn from next_id on whose entry may be taken, -1 if there is none. */
static int best_id(const pokeys_device_t *dev, uint16_t key,
		   bool (*may_take)(const pokeys_device_t *dev, const mailbox_entry_t *entry))
{
	int alike = -1, shunned = -1;
	unsigned int looked = 0;

	for (unsigned int i = 0; i < POKEYS_MAILBOX_SIZE && looked < LOOK_AHEAD; i++) {
		const uint8_t id = (uint8_t)(dev->next_id + i);

		if (!may_take(dev, &dev->mailbox[id]) || dev->now < dev->id_free_after[id])
			continue;
		if (dev->serial < dev->id_shun_until[id]) {
			shunned = shunned < 0 ? id : shunned;
			continue;
		}
		if (key == MAILBOX_KEY_NONE || key != dev->id_key[id])
			return id;
		alike = alike < 0 ? id : alike;
		looked++;
	}
	return alike >= 0 ? alike : shunned;
}

int mailbox_id_take(pokeys_device_t *dev, uint16_t key)
{
	int id = best_id(dev, key, entry_is_free);

	if (id < 0)
		id = best_id(dev, key, entry_is_left);
	if (id < 0) {
		dev->statistics.refused_id++;
		return -EAGAIN;
	}
	dev->id_key[id] = key;
	if (id < dev->next_id || dev->next_id == 0)
		dev->id_turn = (uint8_t)((dev->id_turn + 1) % 255);
	dev->next_id = (uint8_t)(id + 1);
	return id;
}

static void block_until(pokeys_device_t *dev, uint8_t id, uint64_t until_ns)
{
	if (until_ns > dev->id_free_after[id])
		dev->id_free_after[id] = until_ns;
}

void mailbox_id_rest(pokeys_device_t *dev, const mailbox_entry_t *entry, uint64_t now_ns)
{
	const uint64_t lifetime_ns = dev->options.reply_lifetime_ns;
	const uint8_t id = entry->request_id;

	if (!entry->tries)
		return; /* it never left: nothing can answer it */
	if (entry->tries == 1 && entry->state == POKEYS_REQUEST_DONE) {
		block_until(dev, id, now_ns + dev->options.id_rest_ns);
		return;
	}
	block_until(dev, id,
		    now_ns + (entry->once && ONCE_REST_NS < lifetime_ns ? ONCE_REST_NS :
									  lifetime_ns));
	dev->id_shun_until[id] = dev->serial + SHUN_REQUESTS;
}

void mailbox_id_copy_seen(pokeys_device_t *dev, uint8_t id, uint64_t now_ns)
{
	block_until(dev, id, now_ns + dev->options.id_rest_ns);
}
