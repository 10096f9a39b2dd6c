/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A mailbox on a string: what it sends is kept, what it receives is put there
 * by the test, packet by packet.
 */
#ifndef TESTS_ENGINE_SCRIPT_H
#define TESTS_ENGINE_SCRIPT_H

#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <stdint.h>
#include <string.h>
#include <cmocka.h>
#include <errno.h>
#include <pokeys/async.h>
#include "wire/op.h"

#define US 1000ull
#define MS 1000000ull
#define S 1000000000ull

enum {
	SCRIPT_SENT = 1024, /* the last so many packets are kept */
	SCRIPT_INBOX = 512,
	SCRIPT_BYTES = 600,
	OP_READ = 0x31, /* a read without parameters */
	OP_IO = 0xCC,   /* p1 = 1: idempotent write, p1 = 0: read */
	OP_PULSE = 0x85,
	SUB_STATUS = 0x00, /* a read with a check byte */
	SUB_MOVE = 0x20,   /* an idempotent write that echoes its sub-id */
	SUB_HOME = 0x21,   /* a one-shot */
};

struct script_datagram {
	size_t length;
	uint8_t bytes[SCRIPT_BYTES];
	struct pokeys_rx rx;
};

struct script {
	pokeys_device_t dev;
	uint64_t now;
	unsigned int sent;
	uint8_t packets[SCRIPT_SENT][POKEYS_PACKET_SIZE];
	uint64_t *times;        /* of each packet sent, if not NULL */
	int send_error;         /* what send returns, 0 = takes the packet */
	unsigned int fail_send; /* 1-based number of the send that fails, 0 = none */
	unsigned int sends_tried;
	unsigned int inbox_head, inbox_count;
	struct script_datagram inbox[SCRIPT_INBOX];
};

/* A mailbox with these options (NULL = defaults) at a time of one second. */
void script_init(struct script *s, const struct pokeys_options *options);

/* Create and send; the id. Fails the test if either is refused. */
uint8_t script_request(struct script *s, uint8_t op, uint8_t p1, void *target, size_t size);

/* The newest packet that was sent. */
const uint8_t *script_last(const struct script *s);

/* The reply a device gives to this request: echo of p1 and check byte included. */
void script_reply_to(const uint8_t *request, uint8_t reply[POKEYS_PACKET_SIZE]);

/* Deliver bytes now, source and time stamp unknown. 1 if they completed a request. */
int script_deliver(struct script *s, const uint8_t *bytes, size_t length);

/* Answer the request of this id now. */
int script_answer(struct script *s, uint8_t id);

/* Put a datagram into the socket. */
void script_post(struct script *s, const uint8_t *bytes, size_t length);

/* Let time pass, then check deadlines. What the check returned. */
int script_after(struct script *s, uint64_t ns);

#endif
