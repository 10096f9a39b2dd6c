// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * What the kernel's network stack does for a socket has to be done here for
 * AF_XDP: headers (RFC 791, RFC 768) and their checks.
 *
 * The checks are as strict as the kernel's, for nothing stands behind them but
 * the mailbox's own 8-bit checksum: header checksum, lengths that fit into
 * one another and into the frame, the UDP checksum if the sender made one.
 * A frame may be longer than its datagram (Ethernet pads to 60 bytes), never
 * shorter. Fragments and tagged frames are not read: the XDP program leaves
 * them to the kernel. A checksum that the sender's kernel has left to a card is as good
 * as a wrong one, for nobody completes it on a wire that is none (veth, virtio); but it can
 * be told from damage, and who reads of it can switch it off.
 *
 * Frames leave with "do not fragment" and identification 0 (RFC 6864), and
 * with a UDP checksum, which AF_XDP has no card compute.
 *
 * Read and written byte by byte: no field is aligned in a frame, and the order
 * of bytes is the network's on every machine.
 */
#include <string.h>
#include "daemon/transport/frame.h"

enum {
	ETHERNET = 14,
	IP = 20,
	UDP = 8,
	TYPE_IP = 0x0800,
	PROTOCOL_UDP = 17,
	TTL = 64,
	DONT_FRAGMENT = 0x4000,
	FRAGMENT = 0x3fff, /* more to come, or not the first */
};

static void put16(uint8_t *at, uint32_t value)
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

/* Sum of 16-bit words, not folded; an odd byte counts as the high one (RFC 1071). */
static uint32_t sum(const uint8_t *at, size_t length, uint32_t so_far)
{
	size_t i;

	for (i = 0; i + 1 < length; i += 2)
		so_far += get16(at + i);
	if (i < length)
		so_far += (uint32_t)at[i] << 8;
	return so_far;
}

static uint16_t fold(uint32_t total)
{
	while (total >> 16)
		total = (total & 0xffff) + (total >> 16);
	return (uint16_t)~total;
}

/* Addresses, protocol, length. */
static uint32_t pseudo_header(const uint8_t *ip, size_t length)
{
	return sum(ip + 12, 8, PROTOCOL_UDP + (uint32_t)length);
}

/* Over the pseudo header and the datagram. */
static uint16_t udp_checksum(const uint8_t *ip, const uint8_t *udp, size_t length)
{
	return fold(sum(udp, length, pseudo_header(ip, length)));
}

size_t frame_make(uint8_t *out, const struct frame_path *path, const uint8_t *data, size_t length)
{
	return frame_make_cut(out, path, data, length, length);
}

size_t frame_make_cut(uint8_t *out, const struct frame_path *path, const uint8_t *data, size_t kept,
		      size_t length)
{
	uint8_t *ip = out + ETHERNET, *udp = ip + IP;
	uint16_t checksum;

	memcpy(out, path->to_mac, FRAME_MAC);
	memcpy(out + FRAME_MAC, path->from_mac, FRAME_MAC);
	put16(out + 12, TYPE_IP);
	memset(ip, 0, IP);
	ip[0] = 0x45;
	put16(ip + 2, (uint32_t)(IP + UDP + length));
	put16(ip + 6, DONT_FRAGMENT);
	ip[8] = TTL;
	ip[9] = PROTOCOL_UDP;
	put32(ip + 12, path->from);
	put32(ip + 16, path->to);
	put16(ip + 10, fold(sum(ip, IP, 0)));
	put16(udp, path->from_port);
	put16(udp + 2, path->to_port);
	put16(udp + 4, (uint32_t)(UDP + length));
	put16(udp + 6, 0);
	memcpy(udp + UDP, data, kept);
	if (kept < length)
		return FRAME_HEAD + kept;
	checksum = udp_checksum(ip, udp, UDP + length);
	/* 0 would say that there is none */
	put16(udp + 6, checksum ? checksum : 0xffff);
	return FRAME_HEAD + length;
}

/* Length of the IP header, 0 if this is not one that we read. `left` bytes follow. */
static size_t ip_header(const uint8_t *ip, size_t left)
{
	size_t header, total;

	if (left < IP || ip[0] >> 4 != 4)
		return 0;
	header = (size_t)(ip[0] & 15) * 4;
	total = get16(ip + 2);
	if (header < IP || total < header + UDP || total > left)
		return 0;
	if (ip[9] != PROTOCOL_UDP || get16(ip + 6) & FRAGMENT)
		return 0;
	return fold(sum(ip, header, 0)) == 0 ? header : 0;
}

/* The UDP header and, in *datagram, the length with it; NULL if there is none to be read. */
static const uint8_t *udp_header(const uint8_t *frame, size_t length, size_t *datagram)
{
	const uint8_t *ip = frame + ETHERNET, *udp;
	size_t header;

	if (length < ETHERNET || get16(frame + 12) != TYPE_IP)
		return NULL;
	header = ip_header(ip, length - ETHERNET);
	if (!header)
		return NULL;
	udp = ip + header;
	*datagram = get16(udp + 4);
	return *datagram < UDP || *datagram > get16(ip + 2) - header ? NULL : udp;
}

bool frame_read(const uint8_t *frame, size_t length, struct frame_datagram *out)
{
	const uint8_t *ip = frame + ETHERNET, *udp;
	size_t datagram;

	udp = udp_header(frame, length, &datagram);
	if (!udp || (get16(udp + 6) && udp_checksum(ip, udp, datagram) != 0))
		return false;
	out->data = udp + UDP;
	out->length = datagram - UDP;
	out->from = get32(ip + 12);
	out->to = get32(ip + 16);
	out->from_port = get16(udp);
	out->to_port = get16(udp + 2);
	return true;
}

bool frame_half_summed(const uint8_t *frame, size_t length)
{
	const uint8_t *udp;
	size_t datagram;

	udp = udp_header(frame, length, &datagram);
	/* fold() gives the complement, as a whole checksum is */
	return udp && get16(udp + 6) + fold(pseudo_header(frame + ETHERNET, datagram)) == 0xffff;
}
