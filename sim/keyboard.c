// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Matrix keyboard (protocol section 3.9). One operation, its option chooses
 * among eleven. The reply has the keyboard's number at @2 and not the option,
 * so it alone does not tell what it answers.
 */
#include "sim/request.h"

#define CONFIG_LEN 43	/* @8..50 */
#define CODES_LEN 34	/* @8..41 */

static void put_config(const struct sim_panel_config *panel, uint8_t *rp)
{
	memcpy(rp + 8, panel->keyboard, CONFIG_LEN);
	rp[51] = panel->scan;
}

static bool within(uint8_t option, uint8_t first, uint8_t last)
{
	return option >= first && option <= last;
}

/* Blocks of codes: 2..9 write and 12..19 read, 22..29 and 32..39 the same for key up. */
static bool codes(struct sim_device *dev, const uint8_t *rq, uint8_t *rp)
{
	struct sim_panel_config *panel = &dev->config.panel;
	uint8_t option = rq[P1];
	uint8_t(*table)[CODES_LEN] = option < 20 ? panel->key_codes : panel->up_codes;
	uint8_t base = option < 20 ? 0 : 20;

	if (within(option, (uint8_t)(base + 2), (uint8_t)(base + 9))) {
		if (!sim_locked(dev))
			memcpy(table[option - base - 2], rq + 8, CODES_LEN);
		memcpy(rp + 8, table[option - base - 2], CODES_LEN);
		return true;
	}
	if (within(option, (uint8_t)(base + 12), (uint8_t)(base + 19))) {
		memcpy(rp + 8, table[option - base - 12], CODES_LEN);
		return true;
	}
	return false;
}

SIM_HANDLER(sim_do_keyboard)
{
	struct sim_panel_config *panel = &dev->config.panel;
	uint8_t option = rq[P1];

	rp[P1] = rq[P2];
	if (option == 20) {
		if (panel->keyboard[0] & 1)
			memcpy(rp + 8, dev->bench.keys, sizeof(dev->bench.keys));
		return SIM_ANSWER;
	}
	if (option == 50) {
		if (rq[8] <= 50 && !sim_locked(dev))
			panel->scan = rq[8];
		rp[8] = panel->scan;
		return SIM_ANSWER;
	}
	if (codes(dev, rq, rp))
		return SIM_ANSWER;
	if (option > 12)
		return SIM_ANSWER_UNKNOWN;
	if (option == 1 && !sim_locked(dev))
		memcpy(panel->keyboard, rq + 8, CONFIG_LEN);
	put_config(panel, rp);
	return SIM_ANSWER;
}
