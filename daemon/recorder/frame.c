/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The daemon's sockets give away payloads and addresses, so the headers around
 * them are made anew: what no program looks at (identification, time to live) has
 * a plain value, all else is as it was. Checksums are right, or a reader would
 * mark every packet as damaged.
 */
#include <string.h>
#include "daemon/recorder/frame.h"

enum { IP = 14, UDP = 34, ETHERTYPE_IP = 0x0800, PROTOCOL_UDP = 17 };

static void put16(uint8_t *at, unsigned int value)
{
	at[0] = (uint8_t)(value >> 8);
	at[1] = (uint8_t)value;
}

static void put32(uint8_t *at, uint32_t value)
{
	put16(at, value >> 16);
	put16(at + 2, value & 0xffff);
}

static uint16_t get16(const uint8_t *at)
{
	return (uint16_t)(at[0] << 8 | at[1]);
}

static uint32_t get32(const uint8_t *at)
{
	return (uint32_t)get16(at) << 16 | get16(at + 2);
}

/* RFC 1071: 16-bit words, the last one filled up with 0. */
static uint32_t sum(uint32_t from, const uint8_t *bytes, size_t size)
{
	for (size_t i = 0; i + 1 < size; i += 2)
		from += get16(bytes + i);
	return size % 2 ? from + (uint32_t)(bytes[size - 1] << 8) : from;
}

static uint16_t folded(uint32_t total)
{
	while (total >> 16)
		total = (total & 0xffff) + (total >> 16);
	return (uint16_t)~total;
}

static void put_ip(const struct frame *frame, uint8_t *ip)
{
	ip[0] = 0x45;
	put16(ip + 2, (unsigned int)(frame->length + 28));
	put16(ip + 6, 0x4000);		/* not to be fragmented */
	ip[8] = 64;
	ip[9] = PROTOCOL_UDP;
	put32(ip + 12, frame->from.address);
	put32(ip + 16, frame->to.address);
	put16(ip + 10, folded(sum(0, ip, 20)));
}

static void put_udp(const struct frame *frame, uint8_t *udp, const uint8_t *addresses)
{
	const uint32_t pseudo = PROTOCOL_UDP + (uint32_t)frame->length + 8;
	uint16_t check;

	put16(udp, frame->from.port);
	put16(udp + 2, frame->to.port);
	put16(udp + 4, (unsigned int)(frame->length + 8));
	if (frame->kept < frame->length)
		return;
	check = folded(sum(sum(pseudo, addresses, 8), udp, 8 + frame->kept));
	put16(udp + 6, check ? check : 0xffff);	/* 0 stands for "none" */
}

size_t frame_build(const struct frame *frame, uint8_t *out, size_t size)
{
	if (size < FRAME_HEADERS + frame->kept || frame->kept > frame->length ||
	    frame->length > 65535 - 28)
		return 0;
	memset(out, 0, FRAME_HEADERS);
	memcpy(out, frame->to.mac, 6);
	memcpy(out + 6, frame->from.mac, 6);
	put16(out + 12, ETHERTYPE_IP);
	memcpy(out + FRAME_HEADERS, frame->data, frame->kept);
	put_ip(frame, out + IP);
	put_udp(frame, out + UDP, out + IP + 12);
	return FRAME_HEADERS + frame->kept;
}

bool frame_parse(const uint8_t *bytes, size_t size, struct frame *out)
{
	const uint8_t *ip = bytes + IP, *udp;
	size_t header, length;

	if (size < FRAME_HEADERS || get16(bytes + 12) != ETHERTYPE_IP || ip[0] >> 4 != 4 ||
	    ip[9] != PROTOCOL_UDP || get16(ip + 6) & 0x3fff)
		return false;
	header = (size_t)(ip[0] & 15) * 4;
	if (header < 20 || size < IP + header + 8)
		return false;
	udp = ip + header;
	length = get16(udp + 4);
	if (length < 8 || get16(ip + 2) < header + length)
		return false;
	*out = (struct frame){
		.from = { .address = get32(ip + 12), .port = get16(udp) },
		.to = { .address = get32(ip + 16), .port = get16(udp + 2) },
		.length = length - 8, .data = udp + 8,
	};
	memcpy(out->to.mac, bytes, 6);
	memcpy(out->from.mac, bytes + 6, 6);
	out->kept = size - IP - header - 8;
	if (out->kept > out->length)		/* short frames are filled up */
		out->kept = out->length;
	return true;
}
