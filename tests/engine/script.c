/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The string, see script.h. The reply is built here byte by byte and not by
 * the encoders of wire/: a test of matching must not inherit their mistakes.
 */

#include "tests/engine/script.h"

static int script_send(void *context, const uint8_t *packet, size_t length)
{
	struct script *s = context;

	assert_int_equal(length, POKEYS_PACKET_SIZE);
	s->sends_tried++;
	if (s->send_error && (!s->fail_send || s->fail_send == s->sends_tried))
		return s->send_error;
	if (s->times)
		s->times[s->sent] = s->dev.now;
	memcpy(s->packets[s->sent++ % SCRIPT_SENT], packet, length);
	return 0;
}

static int script_receive(void *context, uint8_t *packet, size_t size, struct pokeys_rx *rx)
{
	struct script *s = context;
	const struct script_datagram *d = &s->inbox[s->inbox_head % SCRIPT_INBOX];

	if (!s->inbox_count)
		return -EAGAIN;
	s->inbox_head++;
	s->inbox_count--;
	memcpy(packet, d->bytes, d->length < size ? d->length : size);
	*rx = d->rx;
	return (int)d->length;
}

void script_init(struct script *s, const struct pokeys_options *options)
{
	struct pokeys_io io = { script_send, script_receive, s };

	memset(s, 0, sizeof(*s));
	s->now = S;
	assert_int_equal(pokeys_device_init(&s->dev, &io, options), 0);
	pokeys_device_check(&s->dev, s->now);
}

uint8_t script_request(struct script *s, uint8_t op, uint8_t p1, void *target, size_t size)
{
	const int id = CreateRequestAsync(&s->dev, op, &p1, 1, target, size);

	assert_in_range(id, 0, 255);
	assert_int_equal(pokeys_request_send(&s->dev, (uint8_t)id, s->now), 0);
	return (uint8_t)id;
}

const uint8_t *script_last(const struct script *s)
{
	assert_true(s->sent > 0);
	return s->packets[(s->sent - 1) % SCRIPT_SENT];
}

void script_reply_to(const uint8_t *request, uint8_t reply[POKEYS_PACKET_SIZE])
{
	unsigned int sum = 0;

	for (unsigned int i = 0; i < POKEYS_PACKET_SIZE; i++)
		reply[i] = (uint8_t)(i * 7 + 1);
	reply[0] = 0xAA;
	reply[1] = request[1];
	reply[2] = request[2];
	reply[3] = reply[4] = reply[5] = 0;
	reply[6] = request[6];
	if (request[1] == OP_PULSE && request[2] == SUB_STATUS)
		reply[63] = (uint8_t)(0x5A + request[3]);
	for (unsigned int i = 0; i < 7; i++)
		sum += reply[i];
	reply[7] = (uint8_t)sum;
}

int script_deliver(struct script *s, const uint8_t *bytes, size_t length)
{
	return pokeys_device_deliver(&s->dev, bytes, length, NULL, s->now);
}

int script_answer(struct script *s, uint8_t id)
{
	uint8_t reply[POKEYS_PACKET_SIZE];

	script_reply_to(s->dev.mailbox[id].request_buffer, reply);
	return script_deliver(s, reply, sizeof(reply));
}

void script_post(struct script *s, const uint8_t *bytes, size_t length)
{
	struct script_datagram *d = &s->inbox[(s->inbox_head + s->inbox_count) % SCRIPT_INBOX];

	assert_true(s->inbox_count < SCRIPT_INBOX && length <= SCRIPT_BYTES);
	s->inbox_count++;
	d->length = length;
	memset(&d->rx, 0, sizeof(d->rx));
	memcpy(d->bytes, bytes, length);
}

int script_after(struct script *s, uint64_t ns)
{
	s->now += ns;
	return pokeys_device_check(&s->dev, s->now);
}
