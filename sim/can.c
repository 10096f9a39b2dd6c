// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * CAN and PoCAN (protocol sections 3.18 and 3.19). The bus has a plug which
 * returns every message; once filters are registered only what they name is
 * received.
 *
 * Two ways to read: 0x31 takes one message away; 0x30 shows up to three, which
 * go when the next 0x30 confirms the last one's number. Numbers begin at 1:
 * an old library always confirms 0, and is given one message at a time, which
 * is then gone (6-D31).
 */
#include "sim/request.h"

#define PER_REPLY 3

static bool passes(const struct sim_can *can, const uint8_t *message)
{
	if (!can->filters)
		return true;
	for (unsigned int i = 0; i < can->filters; i++) {
		if (can->filter_id[i] == wire_get_u32(message) &&
		    can->filter_format[i] == message[13])
			return true;
	}
	return false;
}

static void receive(struct sim_can *can, const uint8_t *message)
{
	if (!can->bitrate || !passes(can, message) || can->used == SIM_CAN_MESSAGES)
		return;
	memcpy(can->message[(can->head + can->used++) % SIM_CAN_MESSAGES], message, SIM_CAN_BYTES);
}

static void drop_first(struct sim_can *can)
{
	can->head = (uint8_t)((can->head + 1) % SIM_CAN_MESSAGES);
	can->used--;
	can->queue_id = can->queue_id >= 254 ? 1 : (uint8_t)(can->queue_id + 1);
}

static void confirm(struct sim_can *can, uint8_t id)
{
	unsigned int ahead = (id + 254u - can->queue_id) % 254u;

	if (!id || id == 0xFF || ahead >= can->used)
		return;
	for (unsigned int i = 0; i <= ahead; i++)
		drop_first(can);
}

static void read_queue(struct sim_can *can, uint8_t confirmed, uint8_t *rp)
{
	unsigned int most = confirmed ? PER_REPLY : 1;
	unsigned int last;

	confirm(can, confirmed);
	most = can->used < most ? can->used : most;
	for (unsigned int i = 0; i < most; i++)
		memcpy(rp + 8 + SIM_CAN_BYTES * i, can->message[(can->head + i) % SIM_CAN_MESSAGES],
		       SIM_CAN_BYTES);
	rp[P2] = (uint8_t)most;
	last = can->queue_id + most - 1;
	rp[P3] = most ? (uint8_t)(last > 254 ? last - 254 : last) : 0xFF;
	if (!confirmed && most)
		drop_first(can);
}

static void add_filter(struct sim_can *can, const uint8_t *rq)
{
	if (can->filters == SIM_CAN_FILTERS)
		return;
	can->filter_format[can->filters] = rq[P2];
	can->filter_id[can->filters++] = wire_get_u32(rq + 8);
}

SIM_HANDLER(sim_do_can)
{
	struct sim_can *can = &dev->bus.can;

	rp[P1] = rq[P1];
	switch (rq[P1]) {
	case 0x01:
		memset(can, 0, sizeof(*can));
		can->queue_id = 1;
		can->bitrate = wire_get_u32(rq + 8);
		break;
	case 0x10:
		add_filter(can, rq);
		break;
	case 0x20:
		receive(can, rq + 8);
		break;
	case 0x30:
		read_queue(can, rq[P3], rp);
		break;
	case 0x31:
		if (!can->used)
			break;
		rp[P2] = 1;
		memcpy(rp + 8, can->message[can->head], SIM_CAN_BYTES);
		drop_first(can);
		break;
	case 0x32:
		can->used = 0;
		break;
	default:
		return SIM_ANSWER_UNKNOWN;
	}
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_pocan)
{
	struct sim_bus_config *config = &dev->config.bus;

	rp[P1] = rq[P1];
	switch (rq[P1]) {
	case 0x00:
		break;
	case 0x01:
		if (!sim_locked(dev))
			config->pocan_on = rq[P2] == 1;
		break;
	case 0x02:
		if (!sim_locked(dev))
			memcpy(config->pocan_require, rq + 8, sizeof(config->pocan_require));
		break;
	default:
		return SIM_ANSWER_UNKNOWN;
	}
	rp[P2] = config->pocan_on;
	rp[P3] = dev->options.hardware == WIRE_HW_57CNC ||
		 dev->options.hardware == WIRE_HW_57CNCPRO4X25;
	/* No PoPendant and no kbd48CNC on this bus: the keyboard hangs on PoNET. */
	if (rq[P1] == 0x02)
		memcpy(rp + 8, config->pocan_require, sizeof(config->pocan_require));
	return SIM_ANSWER;
}
