/* SPDX-License-Identifier: MIT */
/*
 * What the files of the mailbox share; the rest of the house uses
 * <pokeys/async.h>. Everything here is realtime safe and belongs to the thread
 * that owns the mailbox. Times are ns of the caller's monotonic clock.
 */
#ifndef ENGINE_MAILBOX_H
#define ENGINE_MAILBOX_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/async.h>
#include "wire/op.h"

/* A key that is like no other: of replies which carry their own check byte. */
#define MAILBOX_KEY_NONE 0xFFFFu

/* mailbox.c: the life of an entry */

/* The latest time seen: a clock that steps back stands still here. */
uint64_t mailbox_time(pokeys_device_t *dev, uint64_t now_ns);

/* True between creation and end. */
static inline bool mailbox_is_open(const mailbox_entry_t *entry)
{
	return entry->state == POKEYS_REQUEST_CREATED || entry->state == POKEYS_REQUEST_IN_FLIGHT;
}

void mailbox_fly(pokeys_device_t *dev, mailbox_entry_t *entry);
void mailbox_land(pokeys_device_t *dev, mailbox_entry_t *entry);

/*
 * End an open request: count it, block its id, tell the parser, free the
 * entry if it frees itself. The entry may be another request's afterwards.
 */
void mailbox_end(pokeys_device_t *dev, mailbox_entry_t *entry, enum pokeys_request_state state,
		 uint64_t now_ns);

/*
 * What becomes of a try whose deadline passed: it is *late* if its answer comes after all
 * (each good reply answers one try, whichever), and *lost* if the id is taken for another
 * request before. Which of several tries an answer belongs to is not known, but how many
 * were answered is.
 */
void mailbox_try_missed(pokeys_device_t *dev, mailbox_entry_t *entry);
void mailbox_try_late(pokeys_device_t *dev, mailbox_entry_t *entry);
void mailbox_tries_lost(pokeys_device_t *dev, mailbox_entry_t *entry);

/* request.c */

/*
 * Hand the packet of an entry in flight to the transport and start its
 * deadline. 0, or the transport's -errno: it was not sent then.
 */
int mailbox_transmit(pokeys_device_t *dev, mailbox_entry_t *entry, uint64_t now_ns);

/*
 * Before a write goes out again: let the caller put in the newest value. False: it cancelled
 * the request. Of a read nothing changes.
 */
bool mailbox_refresh(pokeys_device_t *dev, mailbox_entry_t *entry);

/* Header, id, check byte and checksum, over whatever stands there. `row` may be NULL. */
void mailbox_finish(pokeys_device_t *dev, mailbox_entry_t *entry, const struct wire_op_row *row);

/* id.c */

/* An id to use now, or -EAGAIN. `key` is what replies to the request look like. */
int mailbox_id_take(pokeys_device_t *dev, uint16_t key);

/* The request of this id ended: how long must the id rest? */
void mailbox_id_rest(pokeys_device_t *dev, const mailbox_entry_t *entry, uint64_t now_ns);

/* A copy of the answer came: rest anew. */
void mailbox_id_copy_seen(pokeys_device_t *dev, uint8_t id, uint64_t now_ns);

/* once.c; of requests that are not for once, these do nothing */

/* It is answered: older ones of its kind that are late end. */
void mailbox_once_answered(pokeys_device_t *dev, const mailbox_entry_t *entry, uint64_t now_ns);
/* No newer one of its kind is in flight. */
bool mailbox_once_is_newest(const pokeys_device_t *dev, const mailbox_entry_t *entry);
/* It is about to leave: of older ones that are late, only the newest waits on. */
void mailbox_once_sends(pokeys_device_t *dev, const mailbox_entry_t *entry, uint64_t now_ns);
/* The window is full: the oldest one of this kind ends. False: there is none. */
bool mailbox_once_makes_room(pokeys_device_t *dev, uint8_t command, const void *operation,
			     uint64_t now_ns);

/* budget.c */
void mailbox_budget_init(pokeys_device_t *dev);
void mailbox_budget_fill(pokeys_device_t *dev, uint64_t now_ns);
bool mailbox_budget_send(pokeys_device_t *dev);
bool mailbox_budget_resend(pokeys_device_t *dev);
/* Whether there is one to spare for what a newer request replaces in any case. */
bool mailbox_budget_spares_resend(const pokeys_device_t *dev);

/* deadline.c */

/* What a try of this request sent now gets; of any read or write if NULL. */
uint64_t mailbox_deadline(const pokeys_device_t *dev, const mailbox_entry_t *entry);

/* This request waits for its answer from this moment on. */
void mailbox_wait(const pokeys_device_t *dev, mailbox_entry_t *entry, uint64_t since_ns);

/* An answered request: learn from it, if it can teach anything. */
void mailbox_deadline_learn(pokeys_device_t *dev, const mailbox_entry_t *entry);

/* A deadline passed without answer. */
void mailbox_deadline_missed(pokeys_device_t *dev, const mailbox_entry_t *entry, uint64_t now_ns);

void mailbox_deadline_forget(pokeys_device_t *dev);

#endif
