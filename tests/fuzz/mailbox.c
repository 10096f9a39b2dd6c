/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The mailbox driven by arbitrary bytes: each few bytes are a call, with
 * datagrams that are raw, or made nearly right (the id and operation of a
 * request in flight, a good sum), so that the fuzzer gets past the first
 * checks. After each call the mailbox must be in order, and what it accepted
 * must have been a right answer by rules written down here once more.
 */

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <pokeys/async.h>

#define WIRE_LENGTH_MAX 80

static void hold(bool fact)
{
	if (!fact)
		abort();
}

struct input {
	const uint8_t *at, *end;
};

static uint8_t take(struct input *in)
{
	return in->at < in->end ? *in->at++ : 0;
}

static pokeys_device_t dev;
static uint64_t now, ended, parsed;
static uint8_t target[POKEYS_PAYLOAD_SIZE + 8];
static int send_result;

static int fuzz_send(void *context, const uint8_t *packet, size_t length)
{
	(void)context;
	hold(length == POKEYS_PACKET_SIZE && packet[0] == 0xBB);
	return send_result;
}

static void parser(pokeys_device_t *d, const mailbox_entry_t *entry, void *context, uint64_t now_ns)
{
	uint8_t *what = context;

	parsed++;
	hold(entry->state >= POKEYS_REQUEST_DONE);
	if (*what & 1)
		pokeys_request_cancel(d, (uint8_t)(entry->request_id - 1), now_ns);
	if (*what & 2)
		pokeys_request_free(d, entry->request_id);
	if (*what & 4) {
		const int id = CreateRequestAsync(d, 0x31, NULL, 0, NULL, 0);

		if (id >= 0)
			pokeys_request_send(d, (uint8_t)id, now_ns);
	}
}

static void refresh(pokeys_device_t *d, mailbox_entry_t *entry, void *context)
{
	(void)d;
	memset(entry->request_buffer, *(uint8_t *)context, POKEYS_PACKET_SIZE);
}

static void create(struct input *in)
{
	static uint8_t habits[256];
	uint8_t packet[POKEYS_PACKET_SIZE] = { 0, take(in), take(in), take(in) };
	const uint8_t how = take(in);
	int id;

	habits[how] = how;
	if (how & 0x80)
		id = pokeys_request_create(&dev, packet, (enum pokeys_class)(how % 4),
					   how & 8 ? parser : NULL, refresh, &habits[how]);
	else
		id = CreateRequestAsync(&dev, packet[1], packet + 2, how % 6, target,
					how & 8 ? SIZE_MAX : how % 64);
	hold(id >= 0 || id == -EINVAL || id == -EBUSY || id == -EAGAIN);
	if (id >= 0 && how & 16)
		pokeys_request_set_deadline(&dev, (uint8_t)id, how * 100000u);
	if (id >= 0 && how & 32)
		pokeys_request_send(&dev, (uint8_t)id, now);
}

static uint8_t sum_of(const uint8_t *packet)
{
	unsigned int sum = 0;

	for (unsigned int i = 0; i < 7; i++)
		sum += packet[i];
	return (uint8_t)sum;
}

/* What must hold of a reply that was taken, from the packets alone. */
static void hold_right_answer(const uint8_t *reply, size_t length, const uint8_t *request)
{
	hold(length == POKEYS_PACKET_SIZE && reply[0] == 0xAA && reply[7] == sum_of(reply));
	hold(reply[1] == request[1] && reply[6] == request[6]);
	if (request[1] == 0x85 && request[2] == 0)
		hold(reply[2] == 0 && reply[63] == (uint8_t)(0x5A + request[3]));
}

static void deliver(struct input *in, bool nearly_right)
{
	const uint8_t how = take(in);
	size_t length = nearly_right ? POKEYS_PACKET_SIZE : take(in) % WIRE_LENGTH_MAX;
	uint8_t *bytes = malloc(length ? length : 1);
	struct pokeys_rx rx = { now - how * 1000u, how & 3 ? 0x7F000001 : 0, how & 1, 0 };
	uint8_t request[POKEYS_PACKET_SIZE], id;

	hold(bytes != NULL);
	for (size_t i = 0; i < length; i++)
		bytes[i] = take(in);
	if (nearly_right) {
		bytes[0] = 0xAA;
		bytes[6] = dev.in_flight[how % POKEYS_WINDOW_MAX];
		memcpy(request, dev.mailbox[bytes[6]].request_buffer, sizeof(request));
		if (how & 4)
			memcpy(bytes + 1, request + 1, 5);
		if (how & 8)
			bytes[63] = (uint8_t)(0x5A + request[3]);
		bytes[7] = sum_of(bytes);
	}
	id = length == POKEYS_PACKET_SIZE ? bytes[6] : 0;
	memcpy(request, dev.mailbox[id].request_buffer, sizeof(request));
	if (pokeys_device_deliver(&dev, bytes, length, how & 16 ? NULL : &rx, now))
		hold_right_answer(bytes, length, request);
	free(bytes);
}

static void control(struct input *in)
{
	const uint8_t what = take(in), id = take(in);

	switch (what % 8) {
	case 0:
		pokeys_request_cancel(&dev, id, now);
		break;
	case 1:
		pokeys_request_free(&dev, id);
		break;
	case 2:
		pokeys_request_send(&dev, id, now);
		break;
	case 3:
		pokeys_device_set_peer(&dev, id ? 0x7F000001 : 0, id & 1);
		break;
	case 4:
		send_result = id & 1 ? -EAGAIN : 0;
		break;
	case 5:
		pokeys_device_set_timeout(&dev, id == UINT8_MAX ? UINT64_MAX : id * 50000u);
		break;
	case 6:
		pokeys_request_resend(&dev, id, now);
		break;
	default:
		pokeys_device_reset(&dev, now);
	}
}

static void hold_in_order(void)
{
	const struct pokeys_statistics *s = &dev.statistics;
	unsigned int open = 0, flying = 0;

	for (unsigned int id = 0; id < POKEYS_MAILBOX_SIZE; id++) {
		const uint8_t state = dev.mailbox[id].state;

		hold(dev.mailbox[id].request_id == id && state <= POKEYS_REQUEST_CANCELLED);
		open += state == POKEYS_REQUEST_CREATED || state == POKEYS_REQUEST_IN_FLIGHT;
		flying += state == POKEYS_REQUEST_IN_FLIGHT;
	}
	hold(open == dev.open_count && flying == dev.in_flight_count);
	hold(open <= dev.options.window);
	for (unsigned int i = 0; i < flying; i++)
		hold(dev.mailbox[dev.in_flight[i]].state == POKEYS_REQUEST_IN_FLIGHT);
	ended = s->done + s->timed_out + s->unknown + s->cancelled;
	hold(s->created == ended + open && parsed <= ended && s->accepted == s->done);
	hold(s->received == s->accepted + s->bad_length + s->bad_magic + s->bad_checksum +
				    s->bad_source + s->bad_operation + s->bad_check +
				    s->not_in_flight + s->duplicate + s->stale);
	for (size_t i = POKEYS_PAYLOAD_SIZE; i < sizeof(target); i++)
		hold(target[i] == 0);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t len);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t len)
{
	struct pokeys_io io = { fuzz_send, NULL, NULL };
	struct pokeys_options options = { .window = 16, .reply_lifetime_ns = 5000000 };
	struct input in = { data, data + len };

	now = 1000000000;
	ended = parsed = 0;
	send_result = 0;
	options.first_id = take(&in);
	hold(pokeys_device_init(&dev, &io, &options) == 0);
	while (in.at < in.end) {
		const uint8_t call = take(&in);

		now += (call >> 3) * 30000u;
		switch (call & 7) {
		case 0:
		case 1:
			create(&in);
			break;
		case 2:
			deliver(&in, false);
			break;
		case 3:
		case 4:
			deliver(&in, true);
			break;
		case 5:
			control(&in);
			break;
		default:
			pokeys_device_check(&dev, now);
		}
		hold_in_order();
	}
	return 0;
}
