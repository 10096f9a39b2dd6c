/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Reading what somebody captured is not receiving: frames may be cut, and the
 * checksums of those that a machine sent itself are often not there yet, because its
 * network card makes them. So only lengths are judged here, and frame_read() of the
 * transports, which stands in for the kernel's own checks, is not what is wanted.
 */
#include "daemon/recorder/unpack.h"

enum { ETHERNET = 14, IP = 20, UDP = 8, TYPE_IP = 0x0800, PROTOCOL_UDP = 17, FRAGMENT = 0x3fff };

static uint16_t get16(const uint8_t *at)
{
	return (uint16_t)(at[0] << 8 | at[1]);
}

static uint32_t get32(const uint8_t *at)
{
	return (uint32_t)get16(at) << 16 | get16(at + 2);
}

bool unpack_frame(const uint8_t *frame, size_t size, struct unpacked *out)
{
	const uint8_t *ip = frame + ETHERNET, *udp;
	size_t header, length;

	if (size < ETHERNET + IP + UDP || get16(frame + 12) != TYPE_IP || ip[0] >> 4 != 4 ||
	    ip[9] != PROTOCOL_UDP || get16(ip + 6) & FRAGMENT)
		return false;
	header = (size_t)(ip[0] & 15) * 4;
	if (header < IP || size < ETHERNET + header + UDP)
		return false;
	udp = ip + header;
	length = get16(udp + 4);
	if (length < UDP || get16(ip + 2) < header + length)
		return false;
	*out = (struct unpacked){
		.from = get32(ip + 12),
		.to = get32(ip + 16),
		.from_port = get16(udp),
		.to_port = get16(udp + 2),
		.length = length - UDP,
		.data = udp + UDP,
		.kept = size - ETHERNET - header - UDP,
	};
	if (out->kept > out->length) /* short frames are filled up */
		out->kept = out->length;
	return true;
}
