/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Reading pcapng: a block at a time into memory, and from there with every length
 * checked against the block it is in. A file may come from anywhere; a wrong
 * length ends the reading with a reason and never leads out of the block. Either
 * byte order is read, as the format wants it.
 */
#include <errno.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include "daemon/recorder/pcapng.h"
#include "daemon/recorder/pcapng_block.h"

enum { BLOCK_MAX = 1 << 20 };

struct interface {
	bool ethernet;
	uint64_t ticks; /* a second */
	char name[PCAPNG_TEXT];
};

struct reader {
	FILE *from;
	const struct pcapng_take *take;
	bool swapped, begun, ended;
	uint32_t interfaces;
	struct interface *interface;
	uint8_t *block;  /* a whole one, BLOCK_MAX at most */
	uint32_t length; /* of it */
	const char *fault;
};

static uint32_t get32(const struct reader *r, const uint8_t *at)
{
	uint32_t value;

	memcpy(&value, at, sizeof(value));
	return r->swapped ? __builtin_bswap32(value) : value;
}

static uint16_t get16(const struct reader *r, const uint8_t *at)
{
	uint16_t value;

	memcpy(&value, at, sizeof(value));
	return r->swapped ? __builtin_bswap16(value) : value;
}

/* The first option of that code from `at` on: its length, -1 if there is none. */
static int find_option(const struct reader *r, uint32_t at, uint16_t code, const uint8_t **value)
{
	const uint32_t end = r->length - 4;

	while (at + 4 <= end) {
		const uint16_t this = get16(r, r->block + at), length = get16(r, r->block + at + 2);

		if (!this || at + 4 + length > end)
			return -1;
		*value = r->block + at + 4;
		if (this == code)
			return length;
		at += 4 + ((length + 3u) & ~3u);
	}
	return -1;
}

/* The same as text; empty if there is none. */
static void find_text(const struct reader *r, uint32_t at, uint16_t code, char text[PCAPNG_TEXT])
{
	const uint8_t *value;
	int length = find_option(r, at, code, &value);

	if (length < 0)
		length = 0;
	if (length > PCAPNG_TEXT - 1)
		length = PCAPNG_TEXT - 1;
	if (length)
		memcpy(text, value, (size_t)length);
	text[length] = '\0';
}

static const char *take_interface(struct reader *r)
{
	struct interface *interface = &r->interface[r->interfaces];
	const uint8_t *resolution;

	if (r->length < 20)
		return "an interface block is too short";
	if (r->interfaces == PCAPNG_INTERFACES)
		return "it has too many interfaces";
	interface->ethernet = get16(r, r->block + 8) == PCAPNG_ETHERNET;
	interface->ticks = 1000000;
	find_text(r, 16, PCAPNG_NAME, interface->name);
	if (find_option(r, 16, PCAPNG_RESOLUTION, &resolution) >= 1) {
		if (*resolution & 0x80 ? *resolution > 0x80 + 40 : *resolution > 12)
			return "its time stamps have a resolution that is none";
		interface->ticks = *resolution & 0x80 ? UINT64_C(1) << (*resolution & 0x7f) : 1;
		for (int i = 0; !(*resolution & 0x80) && i < *resolution; i++)
			interface->ticks *= 10;
	}
	r->interfaces++;
	return NULL;
}

static uint64_t to_ns(uint64_t stamp, uint64_t ticks)
{
	const uint64_t second = stamp / ticks, rest = stamp % ticks;

	return second * 1000000000 + (uint64_t)((double)rest * 1e9 / (double)ticks + 0.5);
}

static const char *take_packet(struct reader *r)
{
	struct pcapng_packet packet = { 0 };
	const struct interface *interface;
	char comment[PCAPNG_TEXT];
	const uint8_t *direction;
	uint32_t options, way = 0;

	if (r->length < 32)
		return "a packet block is too short";
	packet.interface = get32(r, r->block + 8);
	packet.kept = get32(r, r->block + 20);
	packet.length = get32(r, r->block + 24);
	packet.data = r->block + 28;
	if (packet.interface >= r->interfaces || packet.kept > r->length - 32)
		return "a packet block is damaged";
	interface = &r->interface[packet.interface];
	packet.t_ns = to_ns((uint64_t)get32(r, r->block + 12) << 32 | get32(r, r->block + 16),
			    interface->ticks);
	options = 28 + ((packet.kept + 3) & ~3u);
	find_text(r, options, PCAPNG_COMMENT, comment);
	packet.comment = comment;
	if (find_option(r, options, PCAPNG_DIRECTION, &direction) == 4)
		way = get32(r, direction) & 3;
	packet.inbound = way == 1;
	packet.outbound = way == 2;
	if (interface->ethernet && r->take->packet)
		r->ended = !r->take->packet(r->take->context, interface->name, &packet);
	return NULL;
}

/* The value of a line "name=value" in the entry, cut to size; empty if it is not there. */
static void find_field(const struct reader *r, const char *name, char value[PCAPNG_TEXT])
{
	const char *at = (const char *)r->block + 8, *end = (const char *)r->block + r->length - 4;
	const size_t length = strlen(name);

	value[0] = '\0';
	while (at < end) {
		const char *line_end = memchr(at, '\n', (size_t)(end - at));
		size_t room;

		if (!line_end)
			line_end = end;
		room = (size_t)(line_end - at);
		if (room > length && !memcmp(at, name, length) && at[length] == '=') {
			room -= length + 1;
			if (room > PCAPNG_TEXT - 1)
				room = PCAPNG_TEXT - 1;
			memcpy(value, at + length + 1, room);
			value[room] = '\0';
			return;
		}
		at = line_end + 1;
	}
}

static const char *take_entry(struct reader *r)
{
	char text[PCAPNG_TEXT], device[PCAPNG_TEXT], number[PCAPNG_TEXT];
	struct pcapng_entry entry = { .text = text, .device = device };

	find_field(r, "MESSAGE", text);
	find_field(r, "POKEYS_DEVICE", device);
	find_field(r, "PRIORITY", number);
	entry.level = atoi(number);
	find_field(r, "POKEYS_TIME_NS", number);
	entry.t_ns = strtoull(number, NULL, 10);
	if (!entry.t_ns) {
		find_field(r, "__REALTIME_TIMESTAMP", number);
		entry.t_ns = strtoull(number, NULL, 10) * 1000;
	}
	if (r->take->entry)
		r->ended = !r->take->entry(r->take->context, &entry);
	return NULL;
}

/* A section begins: its byte order holds from here on, and its interfaces count anew. */
static const char *begin_section(struct reader *r)
{
	uint32_t order;

	if (fread(r->block + 8, 1, 4, r->from) != 4)
		return "it ends within its first block";
	memcpy(&order, r->block + 8, sizeof(order));
	if (order != PCAPNG_BYTE_ORDER && order != __builtin_bswap32(PCAPNG_BYTE_ORDER))
		return "it is not pcapng";
	r->swapped = order != PCAPNG_BYTE_ORDER;
	r->begun = true;
	r->interfaces = 0;
	return NULL;
}

/* The next block whole; false at the end of the file, or at a fault. */
static bool read_block(struct reader *r)
{
	size_t have = fread(r->block, 1, 8, r->from);
	uint32_t type;

	if (!have && !ferror(r->from))
		return false;
	memcpy(&type, r->block, sizeof(type));
	if (have < 8)
		r->fault = "it ends within a block";
	else if (type == PCAPNG_SECTION)
		r->fault = begin_section(r);
	else if (!r->begun)
		r->fault = "it is not pcapng";
	if (r->fault)
		return false;
	have = type == PCAPNG_SECTION ? 12 : 8;
	r->length = get32(r, r->block + 4);
	if (r->length < (type == PCAPNG_SECTION ? 28 : 12) || r->length % 4 ||
	    r->length > BLOCK_MAX)
		r->fault = "a block has an impossible length";
	else if (fread(r->block + have, 1, r->length - have, r->from) != r->length - have)
		r->fault = "it ends within a block";
	else if (get32(r, r->block + r->length - 4) != r->length)
		r->fault = "a block ends with another length than it begins with";
	return !r->fault;
}

static const char *take_block(struct reader *r)
{
	switch (get32(r, r->block)) {
	case PCAPNG_INTERFACE:
		return take_interface(r);
	case PCAPNG_PACKET:
		return take_packet(r);
	case PCAPNG_JOURNAL:
		return take_entry(r);
	default:
		return NULL;
	}
}

int pcapng_read(FILE *from, const struct pcapng_take *take, char *why, size_t size)
{
	struct reader r = { .from = from, .take = take };

	r.block = malloc(BLOCK_MAX);
	r.interface = calloc(PCAPNG_INTERFACES, sizeof(*r.interface));
	if (r.block && r.interface)
		while (!r.ended && !r.fault && read_block(&r))
			r.fault = take_block(&r);
	else
		r.fault = "no memory";
	if (!r.fault && !r.begun)
		r.fault = "it is empty";
	free(r.block);
	free(r.interface);
	if (!r.fault)
		return 0;
	snprintf(why, size, "%s", ferror(from) ? strerror(errno) : r.fault);
	return -EPROTO;
}
