// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * LED matrices (protocol section 3.10) and LED strips (0x4B). The data packet
 * of a strip is the one request which has no reply at all (6-D39).
 */
#include "sim/request.h"

#define STRIP_LEDS_PER_PACKET 18

SIM_HANDLER(sim_do_led_setup)
{
	struct sim_panel_config *panel = &dev->config.panel;

	if (rq[P1] == 0 && !sim_locked(dev)) {
		panel->led_on = rq[P2] & 3;
		panel->led_size[0] = rq[P3];
		panel->led_size[1] = rq[P4];
	}
	rp[P2] = panel->led_on;
	rp[P3] = panel->led_size[0];
	rp[P4] = panel->led_size[1];
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_led)
{
	uint8_t *rows = dev->panel.led[rq[P1] >= 10];
	uint8_t row = rq[P2] & 7;
	uint8_t bit = (uint8_t)(1u << (rq[P3] & 7));

	(void)rp;
	switch (rq[P1] % 10) {
	case 1:
		memcpy(rows, rq + 8, 8);
		break;
	case 5:
		rows[row] |= bit;
		break;
	case 6:
		rows[row] &= (uint8_t)~bit;
		break;
	default:
		return SIM_ANSWER_UNKNOWN;
	}
	return SIM_ANSWER;
}

SIM_HANDLER(sim_do_strip)
{
	struct sim_bus *bus = &dev->bus;
	unsigned int first = wire_get_u16(rq + 3);
	unsigned int count = rq[P4];

	if (rq[P1] == 0x00) {
		bus->strip_count = wire_get_u16(rq + 3);
		bus->strip_refresh = rq[P4];
		rp[P1] = rq[P1];
		memcpy(rp + 3, rq + 3, 3);
		return SIM_ANSWER;
	}
	if (rq[P1] != 0x10)
		return SIM_ANSWER_UNKNOWN;
	for (unsigned int i = 0; i < count && i < STRIP_LEDS_PER_PACKET; i++) {
		if (first + i < SIM_STRIP_LEDS)
			memcpy(bus->strip[first + i], rq + 8 + 3 * i, 3);
	}
	return SIM_ANSWER_NONE;
}
