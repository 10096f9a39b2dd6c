// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * The questions of one cycle (protocol section 3.25): 0xCC and the pulse
 * engine's status, and with ask_all() what the daemon reads besides from a
 * simulated device with the preset demo when it asks for everything in one
 * cycle (slow = together). How many the daemon asks is counted beside it by
 * the section that compares them, so a list that no longer is the daemon's
 * shows.
 */
#include <string.h>
#include "bench/ask.h"
#include "wire/bus.h"
#include "wire/encoder.h"
#include "wire/io.h"
#include "wire/packet.h"
#include "wire/pulse.h"
#include "wire/system.h"

static void add(struct ask *ask, enum wire_op op, const void *value)
{
	wire_encode_req(op, ask->question[ask->count++], value);
}

void ask_fast(struct ask *ask)
{
	const struct wire_io_req io = { .ignore = (UINT64_C(1) << 56) - 1 };
	const struct wire_pulse_status_req status = { 0 };

	ask->count = 0;
	add(ask, WIRE_OP_IO, &io);
	add(ask, WIRE_OP_PULSE_STATUS, &status);
}

void ask_all(struct ask *ask)
{
	const struct wire_encoders_req encoders = { .option = WIRE_ENCODERS_READ_LOW };
	const struct wire_poextbus_req bus = { .option = WIRE_POEXTBUS_READ };
	const struct wire_pulse_outputs_req outputs = { .read_only = 1 };
	const struct wire_pulse_status_req dedicated = { 0 };
	const struct wire_analog_req analog = { 0 };
	const struct wire_pwm_req pwm = { 0 };
	const struct wire_rtc_req clock = { 0 };

	ask_fast(ask);
	add(ask, WIRE_OP_ENCODERS, &encoders);
	add(ask, WIRE_OP_ANALOG, &analog);
	add(ask, WIRE_OP_POEXTBUS, &bus);
	add(ask, WIRE_OP_TICK, NULL);
	add(ask, WIRE_OP_PWM, &pwm);
	add(ask, WIRE_OP_SYSTEM_LOAD, NULL);
	add(ask, WIRE_OP_RTC, &clock);
	add(ask, WIRE_OP_PULSE_OUTPUTS, &outputs);
	add(ask, WIRE_OP_DEVICE_DATA, NULL);
	add(ask, WIRE_OP_PULSE_STATUS2, &dedicated);
}

void ask_stamp(struct ask *ask, int i)
{
	wire_finish(ask->question[i], ++ask->id);
}

int ask_match(const struct ask *ask, const uint8_t *packet, ssize_t length)
{
	for (int i = 0; length == ASK_PACKET && packet[0] == 0xaa && i < ask->count; i++)
		if (packet[1] == ask->question[i][1] && packet[6] == ask->question[i][6])
			return i;
	return -1;
}
