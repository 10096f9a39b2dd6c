/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * One way out for every request of a device, so that the budget of a cycle
 * holds whatever kind of request it is (protocol section 3.25: a device takes
 * two or three a millisecond). Several devices share one thread and one wire;
 * none of them may take more than its part, not even after a stall.
 *
 * One way out for its events as well: whatever a commander or a cable does
 * with the state thirty times a second, no kind of event may drive the others
 * out of the ring, or fill the journal.
 *
 * A request that cannot go now is withdrawn again. Nothing was sent then, so
 * even a one-shot may be tried in the next cycle (invariant I4).
 */

#include "daemon/device/internal.h"

enum {
	SAY_MAX = 20,          /* events of a kind in a second */
	SAY_CHANGED_MAX = 160, /* settings are many at once, when a device is set up anew */
	HELD_MOST = 2,         /* 0xCC and 0xCB */
};

_Static_assert((int)POKEYS_CLASS_READ == (int)WIRE_READ, "classes are one list");
_Static_assert((int)POKEYS_CLASS_WRITE == (int)WIRE_WRITE, "classes are one list");
_Static_assert((int)POKEYS_CLASS_ONESHOT == (int)WIRE_ONE_SHOT, "classes are one list");

/* What belongs to a request besides its packet. */
struct ends {
	pokeys_parser_t parser;
	pokeys_refresh_t refresh;
	void *context;
	uint64_t deadline_ns;
	bool first, once;
};

/*
 * Places that stay free of everything else: a heater or a motor that is to be off goes out with
 * 0xCC and 0xCB, and cannot wait until some other question is answered, or is not.
 */
static uint32_t held(const struct device *device)
{
	uint32_t places = 0;

	if (loops_pins(device))
		places += !fast_io_open(device);
	if (loops_channels(device))
		places += !device->outputs.output[OUTPUT_PWM].open;
	return places;
}

/* Asked for each request, so the loops are looked at only where it matters. */
static bool is_full(const struct device *device)
{
	const uint32_t open = device->mailbox.open_count, window = device->mailbox.options.window;

	return running(device) && open + HELD_MOST >= window && open + held(device) >= window;
}

static bool send(struct device *device, enum wire_op op, const void *value, const struct ends *ends)
{
	const struct wire_op_row *row = wire_op(op);
	uint8_t packet[WIRE_PK];
	enum wire_class class;
	int id;

	if (!device->budget || (!ends->first && is_full(device)))
		return false;
	wire_encode_req(op, packet, value);
	class = wire_request_class(row, packet);
	id = pokeys_request_create(&device->mailbox, packet, (enum pokeys_class) class,
				   ends->parser, ends->refresh, ends->context);
	if (id < 0)
		return false;
	if (ends->deadline_ns)
		pokeys_request_set_deadline(&device->mailbox, (uint8_t)id, ends->deadline_ns);
	if (ends->once)
		pokeys_request_set_once(&device->mailbox, (uint8_t)id);
	if (pokeys_request_send(&device->mailbox, (uint8_t)id, device->now_ns) < 0) {
		pokeys_request_cancel(&device->mailbox, (uint8_t)id, device->now_ns);
		return false;
	}
	device->budget--;
	life_asked(device);
	return true;
}

bool request_send(struct device *device, enum wire_op op, const void *value, pokeys_parser_t parser,
		  pokeys_refresh_t refresh, void *context)
{
	const struct ends ends = { .parser = parser, .refresh = refresh, .context = context };

	return send(device, op, value, &ends);
}

bool request_send_first(struct device *device, enum wire_op op, const void *value,
			pokeys_parser_t parser, pokeys_refresh_t refresh, void *context)
{
	const struct ends ends = {
		.parser = parser,
		.refresh = refresh,
		.context = context,
		.first = true,
	};

	return send(device, op, value, &ends);
}

bool request_send_once(struct device *device, enum wire_op op, const void *value,
		       pokeys_parser_t parser, pokeys_refresh_t refresh, void *context)
{
	const struct ends ends = {
		.parser = parser,
		.refresh = refresh,
		.context = context,
		.first = op == WIRE_OP_IO,
		.once = true,
	};

	return send(device, op, value, &ends);
}

bool request_send_patiently(struct device *device, enum wire_op op, const void *value,
			    pokeys_parser_t parser, uint64_t deadline_ns)
{
	const struct ends ends = { .parser = parser, .deadline_ns = deadline_ns };

	return send(device, op, value, &ends);
}

static const mailbox_entry_t *find(const struct device *device, pokeys_parser_t parser,
				   const void *context)
{
	const pokeys_device_t *mailbox = &device->mailbox;

	for (uint32_t i = 0; i < mailbox->in_flight_count; i++) {
		const mailbox_entry_t *entry = &mailbox->mailbox[mailbox->in_flight[i]];

		if (entry->parser == parser && entry->context == context)
			return entry;
	}
	return NULL;
}

bool request_unsent(const struct device *device, pokeys_parser_t parser, const void *context)
{
	const mailbox_entry_t *entry = find(device, parser, context);

	return entry && !entry->tries;
}

bool request_cancel(struct device *device, pokeys_parser_t parser, const void *context)
{
	const mailbox_entry_t *entry = find(device, parser, context);

	return entry && !pokeys_request_cancel(&device->mailbox, entry->request_id, device->now_ns);
}

bool request_again(struct device *device, pokeys_parser_t parser, const void *context)
{
	const mailbox_entry_t *entry = find(device, parser, context);

	if (!entry || !device->budget ||
	    pokeys_request_resend(&device->mailbox, entry->request_id, device->now_ns))
		return false;
	device->budget--;
	return true;
}

static bool may_say(struct device *device, enum event_code code)
{
	const uint32_t most = code == EVENT_CONFIG_CHANGED ? SAY_CHANGED_MAX : SAY_MAX;
	struct talk *talk = &device->talk[code];

	if (device->now_ns - talk->since_ns >= SECOND) {
		talk->since_ns = device->now_ns;
		talk->count = 0;
	}
	return talk->count++ < most;
}

void device_say(struct device *device, enum event_code code, enum event_level level, int64_t a,
		int64_t b, int64_t c)
{
	const struct event event = {
		.t_ns = device->now_ns,
		.code = (uint16_t)code,
		.level = (uint8_t)level,
		.device = device->config.index,
		.a = a,
		.b = b,
		.c = c,
	};

	if (may_say(device, code))
		event_push(device->events, &event);
}
