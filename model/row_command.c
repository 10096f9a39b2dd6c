/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What may be commanded: the places in the command image, with the bit that says that it is.
 *
 * Motion is not among it. An axis follows a stream of references that somebody computes; a name
 * and a value are no such thing.
 */
#include <pokeys/command.h>
#include "model/rows.h"

#define COMMAND_MEMBER(member_)	(((struct pokeys_command *)0)->member_)
#define COMMAND(name_, type_, member_)							\
	.name = name_, .image = MODEL_COMMAND, .type = type_,				\
	.offset = offsetof(struct pokeys_command, member_),				\
	.size = sizeof(COMMAND_MEMBER(member_))
#define MASK(member_, bit_, stride_)							\
	.mask = offsetof(struct pokeys_command, member_), .mask_bit = (bit_),		\
	.mask_stride = (stride_)
#define RANGE(low_, high_)	.low = (low_), .high = (high_)

/* Bits, each with a bit of the same number in a mask. */
#define OUTPUTS(name_, member_, mask_, count_, ...) {					\
	COMMAND(name_, MODEL_BIT, member_), .stride = 1, .count = (count_),		\
	MASK(mask_, 0, 1), .unit = __VA_ARGS__ }
#define ASKED(name_, bit_) {								\
	COMMAND(name_, MODEL_BIT, flags), .count = 1, .unit = "",			\
	.first_bit = __builtin_ctz(POKEYS_COMMAND_##bit_) }

static const struct model_row rows[] = {
	OUTPUTS("pin.%02u.out", digital_out, digital_out_mask, POKEYS_PINS, "", TERMINAL(PIN)),
	{ COMMAND("pwm.%02u.value", MODEL_UNSIGNED, pwm_duty[0]), .stride = sizeof(uint32_t),
	  .count = POKEYS_PWM, .whole = offsetof(struct pokeys_command, pwm_period),
	  MASK(pwm_enable, 0, 1), .unit = "", TERMINAL(PWM), RANGE(0, 1),
	  HELP("duty as a part of the period; LinuxCNC has a scale and an offset besides") },
	OUTPUTS("external.%02u.out", external_outputs, external_outputs_mask, 8, "",
		TERMINAL(OUTPUT), HELP("output or relay of the board, see pokeys_terminals(7)")),
	OUTPUTS("external-relay.%02u.out", relays, relays_mask, 8, "",
		HELP("relay of the engine's connector, not of the board")),
	OUTPUTS("PoExtBus.%02u.out", poextbus, poextbus_mask, 8 * POKEYS_POEXTBUS, "",
		HELP("output of the bus")),
	{ .name = "PoNET.%02u.out-%u",
	  .image = MODEL_COMMAND,
	  .type = MODEL_UNSIGNED,
	  .offset = offsetof(struct pokeys_command, ponet_data),
	  .size = sizeof(uint32_t),
	  .stride = sizeof(COMMAND_MEMBER(ponet_data)[0]),
	  .count = POKEYS_PONET,
	  .inner = 4,
	  .inner_stride = sizeof(uint32_t),
	  MASK(ponet_mask, 0, 1),
	  .unit = "",
	  RANGE(0, UINT32_MAX),
	  HELP("outputs: bytes 4 * n to 4 * n + 3, least first") },
	{ COMMAND("PoNET.%02u.brightness", MODEL_UNSIGNED, ponet_brightness[0]),
	  .stride = sizeof(uint8_t), .count = POKEYS_PONET, MASK(ponet_mask, 0, 1), .unit = "",
	  RANGE(0, UINT8_MAX), HELP("of the module's lamps, 255 is full") },
	{ COMMAND("kbd48CNC.%02u.LED", MODEL_BIT, kbd48_leds), .stride = 1, .count = 48,
	  MASK(kbd48_flags, __builtin_ctz(POKEYS_KBD48_LEDS), 0), .unit = "",
	  HELP("lamp of the key; all are commanded together") },
	{ COMMAND("kbd48CNC.brightness", MODEL_UNSIGNED, kbd48_brightness), .count = 1,
	  MASK(kbd48_flags, __builtin_ctz(POKEYS_KBD48_BRIGHTNESS), 0), .unit = "",
	  RANGE(0, UINT8_MAX), HELP("brightness of its lamps, 255 is full") },
	{ COMMAND("heater.%02u.target", MODEL_FLOAT, heater_target[0]), .stride = sizeof(float),
	  .count = POKEYS_HEATERS, MASK(heater_mask, 0, 1), .unit = "deg C", RANGE(0, 2000) },
	ASKED("machine-is-on", MACHINE_ON),
	ASKED("emergency-stop", EMERGENCY),
	ASKED("engine.limit-override", LIMIT_OVERRIDE),
};

MODEL_GROUP(model_command, rows);
