/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The simulated device under any sequence of requests and any gaps between
 * them: nothing is touched outside it (the sanitizers watch), and each request
 * has one well-formed reply or none.
 *
 * Input: records of 16 bytes - a gap of up to 31 ms, operation, four parameters, and
 * ten bytes which fill the payload over and over. Records alone would never
 * make a fill of eight parts or a packet of a wrong length, so the whole input
 * is also sent as one datagram.
 */

#include <stdlib.h>

#include "sim/device.h"

#define RECORD 16

static struct sim_device dev;

static void hold(bool fact)
{
	if (!fact)
		abort();
}

static void ask(uint64_t now_ns, const uint8_t *rq, size_t len)
{
	uint8_t *exact = malloc(len ? len : 1);
	uint8_t rp[WIRE_PK];
	size_t got;

	hold(exact != NULL);
	memcpy(exact, rq, len);
	got = sim_device_request(&dev, now_ns, exact, len, rp);
	hold(got == 0 || got == WIRE_PK);
	if (got) {
		hold(wire_check_reply(rp, got) == WIRE_OK);
		hold(rp[WIRE_AT_OP] == rq[WIRE_AT_OP]);
	}
	free(exact);
}

static void record(uint64_t now_ns, const uint8_t *data)
{
	uint8_t rq[WIRE_PK] = { WIRE_REQUEST };

	memcpy(rq + WIRE_AT_OP, data + 1, 5);
	for (unsigned int i = 0; i < WIRE_PAYLOAD_LEN; i++)
		rq[WIRE_PAYLOAD_AT + i] = data[6 + i % 10];
	wire_finish(rq, data[0]);
	ask(now_ns, rq, sizeof(rq));
}

/* The input as a datagram of whole parts, with the header made good. */
static void whole(uint64_t now_ns, const uint8_t *data, size_t len)
{
	uint8_t rq[SIM_MULTI] = { 0 };

	if (len > sizeof(rq))
		len = sizeof(rq);
	memcpy(rq, data, len);
	ask(now_ns, rq, len);
	for (unsigned int part = 0; part < sizeof(rq); part += WIRE_PK) {
		rq[part] = WIRE_REQUEST;
		wire_finish(rq + part, (uint8_t)part);
	}
	ask(now_ns, rq, sizeof(rq));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t len);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t len)
{
	static const uint8_t hardware[] = { WIRE_HW_57CNC, WIRE_HW_57E_V11, WIRE_HW_57CNCPRO4X25,
					    WIRE_HW_56E };
	struct sim_device_options options = { .hardware = hardware[len % 4] };
	uint64_t now_ns = 1;

	sim_device_init(&dev, &options);
	whole(now_ns, data, len);
	for (size_t at = 0; at + RECORD <= len; at += RECORD) {
		now_ns += UINT64_C(1000000) * (data[at] % 32);
		record(now_ns, data + at);
	}
	sim_device_advance(&dev, now_ns + UINT64_C(30000000));
	return 0;
}
