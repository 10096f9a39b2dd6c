/* SPDX-License-Identifier: MIT */
/*
 * The header rules every packet keeps, in one place.
 *
 * The checksum covers @0..@6 only, never the payload: a receiver which sums
 * all 64 bytes rejects every packet a device sends (protocol section 1.3). So
 * a flipped payload bit is invisible here, and whoever uses a value must keep
 * its own sanity range.
 *
 * The vendor's library does not compare the operation of a reply, only its
 * request id, and is led astray by a late reply (section 1.4). The rules are
 * therefore split: here what any packet must satisfy, in op.c what a reply
 * must satisfy to belong to a given request.
 */

#include "wire/packet.h"

const char *wire_reason_name(enum wire_reason reason)
{
	static const char *const names[WIRE_REASONS] = {
		[WIRE_OK] = "ok",         [WIRE_LENGTH] = "length",
		[WIRE_MAGIC] = "header",  [WIRE_CHECKSUM] = "checksum",
		[WIRE_ID] = "request-id", [WIRE_OPERATION] = "operation",
		[WIRE_ECHO] = "echo",     [WIRE_CHECK_BYTE] = "check-byte",
	};

	if ((unsigned int)reason >= WIRE_REASONS)
		return "unknown";
	return names[reason];
}

uint8_t wire_checksum(const uint8_t p[WIRE_PK])
{
	unsigned int sum = 0;

	for (unsigned int i = 0; i < WIRE_AT_SUM; i++)
		sum += p[i];
	return (uint8_t)sum;
}

void wire_finish(uint8_t p[WIRE_PK], uint8_t id)
{
	p[WIRE_AT_ID] = id;
	p[WIRE_AT_SUM] = wire_checksum(p);
}

static enum wire_reason check(const uint8_t *p, size_t len, uint8_t magic)
{
	if (len != WIRE_PK)
		return WIRE_LENGTH;
	if (p[WIRE_AT_MAGIC] != magic)
		return WIRE_MAGIC;
	if (p[WIRE_AT_SUM] != wire_checksum(p))
		return WIRE_CHECKSUM;
	return WIRE_OK;
}

enum wire_reason wire_check_reply(const uint8_t *p, size_t len)
{
	return check(p, len, WIRE_REPLY);
}

enum wire_reason wire_check_request(const uint8_t *p, size_t len)
{
	return check(p, len, WIRE_REQUEST);
}
