/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A device behind a password (protocol section 1.11): its level is read first,
 * and if it is not open it is asked to open, before anything else is believed.
 *
 * Which commands a locked device refuses, and how, no source says; an empty
 * answer would look like a device without settings. So nothing is read from it,
 * and the link does not run, until it says that it is open. The hash is made
 * from a seed that the device chooses anew, so a refused one is not repeated:
 * level and seed are read again, slowly, for every wrong answer may be counted
 * somewhere. A firmware that does not know the question has no password.
 *
 * The answer is not believed, the level that is read afterwards is. So it does
 * no harm if the network delivers it twice or not at all.
 *
 * Nor is a single reply: its payload has no checksum, and what it says here decides
 * for ten seconds. A level counts when it was said three times in a row, for two may be
 * damaged in the same bit; and a refusal when a second answer, to another seed, was
 * refused as well.
 */

#include <string.h>
#include "daemon/device/internal.h"
#include "wire/sha1.h"

enum {
	ROUNDS = 3, /* questions without answer: then there is no password */
	TRIES = 5,  /* answers that nobody answered to */
	ALIKE = 3,  /* answers in a row that tell the same level */
};

#define AGAIN_NS (10 * SECOND)

static void open_up(struct device *device)
{
	device->access.phase = ACCESS_OPEN;
}

static void shut(struct device *device, enum lock_reason reason)
{
	struct access *access = &device->access;

	if (!access->said || device->life.fault != POKEYS_FAULT_LOCKED)
		device_say(device, EVENT_LOCKED, EVENT_ERROR, reason, device->image.access, 0);
	access->said = true;
	life_block(device, POKEYS_FAULT_LOCKED);
	access->phase = ACCESS_SHUT;
	access->tries = 0;
	access->again_ns = device->now_ns + AGAIN_NS;
}

/* The answers before this one said the same. */
static bool is_confirmed(struct access *access, uint8_t level)
{
	if (access->level != level)
		access->alike = 0;
	access->level = level;
	access->alike = (uint8_t)(access->alike + (access->alike < ALIKE));
	return access->alike >= ALIKE;
}

static void judge(struct device *device, const uint8_t *reply)
{
	struct access *access = &device->access;
	struct wire_security_rep security;

	wire_security_decode_rep(reply, &security);
	access->failures = 0;
	if (!is_confirmed(access, security.level)) {
		access->phase = ACCESS_ASK;
		return;
	}
	device->image.access = security.level;
	memcpy(access->seed, security.seed, sizeof(access->seed));
	if (security.level == WIRE_LEVEL_UNLOCKED)
		open_up(device);
	else if (!device->config.have_password)
		shut(device, LOCK_NO_PASSWORD);
	else if (access->tries >= TRIES)
		shut(device, LOCK_WRONG_PASSWORD);
	else
		access->phase = ACCESS_ANSWER;
}

static void asked(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
		  uint64_t now_ns)
{
	struct device *device = device_of(mailbox);
	struct access *access = &device->access;

	(void)context;
	device->now_ns = now_ns;
	access->open = false;
	if (entry->state == POKEYS_REQUEST_CANCELLED)
		return;
	if (answered(entry))
		judge(device, entry->response_buffer);
	else if (++access->failures >= ROUNDS)
		open_up(device);
}

static void answered_to(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
			uint64_t now_ns)
{
	struct device *device = device_of(mailbox);
	struct access *access = &device->access;
	struct wire_authorise_rep reply;

	(void)context;
	device->now_ns = now_ns;
	access->open = false;
	if (entry->state == POKEYS_REQUEST_CANCELLED)
		return;
	access->phase = ACCESS_ASK;
	if (!answered(entry))
		return;
	wire_authorise_decode_rep(entry->response_buffer, &reply);
	if (reply.result == WIRE_AUTHORISED)
		return;
	if (access->refused)
		shut(device, LOCK_WRONG_PASSWORD);
	access->refused = true;
}

static void ask(struct device *device)
{
	device->access.open = request_send(device, WIRE_OP_SECURITY, NULL, asked, NULL, NULL);
}

static void answer(struct device *device)
{
	struct wire_authorise_req request = { .level = WIRE_LEVEL_UNLOCKED };
	struct access *access = &device->access;

	wire_password_hash(device->config.password, access->seed, request.hash);
	access->open = request_send(device, WIRE_OP_AUTHORISE, &request, answered_to, NULL, NULL);
	access->tries = (uint8_t)(access->tries + access->open);
}

bool access_cycle(struct device *device)
{
	struct access *access = &device->access;

	if (access->open)
		return false;
	switch ((enum access_phase)access->phase) {
	case ACCESS_SHUT:
		if (device->now_ns < access->again_ns)
			break;
		access->phase = ACCESS_ASK;
		ask(device);
		break;
	case ACCESS_ASK:
		ask(device);
		break;
	case ACCESS_ANSWER:
		answer(device);
		break;
	case ACCESS_OPEN:
		return true;
	}
	return false;
}

void access_begin(struct device *device)
{
	memset(&device->access, 0, sizeof(device->access));
	device->image.access = 0;
}
