/* SPDX-License-Identifier: GPL-2.0-or-later */
/* PoExtBus, PoNET, keyboards, and the measured polling rates. */
#include "model/rows.h"

#define MODULE(name_, member_, ...)	\
	EACH_NUMBER("PoNET.%02u." name_, ponet, member_, __VA_ARGS__)
#define RATE(name_, group_)	\
	NUMBER("rate." name_, slow_millihertz[POKEYS_SLOW_##group_], "Hz", FACTOR(1e-3))

static const struct model_row rows[] = {
	BITS("PoExtBus.%02u.in", poextbus, 8 * POKEYS_POEXTBUS, ""),
	NUMBER("PoNET.state", ponet_state, ""),
	NUMBER("PoNET.count", ponet_count, ""),
	MODULE("type", type, ""),
	MODULE("address", address, ""),
	MODULE("size", size, ""),
	MODULE("options", options, ""),
	MODULE("status", status, ""),
	MODULE("light", light, ""),
	MODULE("version", version, ""),
	MODULE("failures", failures, ""),
	{ .name = "PoNET.%02u.in-%u",
	  .image = MODEL_STATE,
	  .type = MODEL_UNSIGNED,
	  .offset = offsetof(struct pokeys_state, ponet[0].data),
	  .size = sizeof(uint32_t),
	  .stride = sizeof(struct pokeys_ponet_module),
	  .count = POKEYS_PONET,
	  .inner = 4,
	  .inner_stride = sizeof(uint32_t),
	  .unit = "" },

	{ PLACE("matrix.%02u.%02u", MODEL_BIT, matrix), .stride = 8, .count = POKEYS_MATRIX_BYTES,
	  .inner = 8, .inner_stride = 1, .unit = "" },
	FLAG("matrix.enabled", matrix_enabled, ""),
	BITS("kbd48CNC.%02u.Button", kbd48_keys, 48, ""),
	NUMBER("kbd48CNC.module", kbd48_module, ""),

	RATE("encoders-low", ENCODERS_LOW),
	RATE("encoders-high", ENCODERS_HIGH),
	RATE("analog", ANALOG),
	RATE("counters", COUNTERS),
	RATE("PoExtBus", POEXTBUS),
	RATE("tick", TICK),
	RATE("pwm", PWM),
	RATE("load", LOAD),
	RATE("rtc", CLOCK),
	RATE("external", EXTERNAL),
	RATE("identity", IDENTITY),
	RATE("PoNET", PONET),
	RATE("dedicated", DEDICATED),
	RATE("matrix", MATRIX),
	RATE("backlash", BACKLASH),
	RATE("postep", POSTEP),
	RATE("postep-rare", POSTEP_RARE),
};

MODEL_GROUP(model_bus, rows);
