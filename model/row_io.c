/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Terminals: digital, analog, counters, encoders, PWM; and the outputs of the board.
 *
 * HAL's encoder counts and positions are relative to an offset that only LinuxCNC knows. The
 * device's own count is rawcounts, as in LinuxCNC's encoder components.
 */
#include "model/rows.h"

#define VOLTS_PER_COUNT	(3.3 / 4096)	/* as adc.NN.value in HAL, with a scale of 1 */
#define CAN(name_, member_, help_)	\
	BITS("pin.%02u.can-" name_, capability.member_, POKEYS_PINS, "", TERMINAL(PIN), HELP(help_))

static const struct model_row rows[] = {
	BITS("pin.%02u.in", digital_in, POKEYS_PINS, "", TERMINAL(PIN)),
	BITS("pin.%02u.out-fb", digital_out, POKEYS_PINS, "", TERMINAL(PIN),
	     HELP("state of the output, as acknowledged by the device")),
	BITS("pin.%02u.is-output", digital_out_owned, POKEYS_PINS, "", TERMINAL(PIN),
	     HELP("the device has the pin configured as an output")),
	NUMBERS("pin.%02u.function-in-effect", pin_function, POKEYS_PINS, "", TERMINAL(PIN),
		HELP("function in the device: sum of 2 digital input, 4 digital output, 8 analog "
		     "input, 16 analog output, 32 triggered input, 64 counter, 128 inverted")),
	CAN("input", digital_in, "the pin can be a digital input"),
	CAN("output", digital_out, "the pin can be a digital output"),
	CAN("analog", analog_in, "the pin can be an analog input"),
	CAN("count", counter, "the pin can be a digital counter"),
	CAN("pwm", pwm_pins, "the pin can be a PWM output"),
	NUMBERS("counter.%02u.value", counter, POKEYS_PINS, "", TERMINAL(PIN)),
	NUMBERS("adc.%02u.raw", analog, POKEYS_ANALOG, "", TERMINAL(ANALOG)),
	NUMBERS("adc.%02u.volts", analog, POKEYS_ANALOG, "V", TERMINAL(ANALOG),
		FACTOR(VOLTS_PER_COUNT), HELP("voltage at the pin; adc.00 is terminal 41")),

	NUMBERS("encoder.%02u.rawcounts", encoder, POKEYS_ENCODERS, "counts",
		HELP("the device's own count, wraps at 2^32; 25 is the ultra-fast encoder")),
	BITS("encoder.%02u.enabled", encoder_enabled, POKEYS_ENCODERS, ""),
	BITS("encoder.%02u.index-seen", encoder_index, POKEYS_ENCODERS, "",
	     HELP("an index pulse has arrived since the index was last armed")),
	AGES("encoder.%02u.age-us", encoder_t_ns, POKEYS_ENCODERS, US,
	     HELP("time since the count was sampled")),
	NUMBERS("encoder.%02u.resyncs", encoder_resync, POKEYS_ENCODERS, "",
		HELP("jumps of the count that were corrected")),
	NUMBER("encoder-epoch", encoder_epoch, "",
	       HELP("changes when the device may have restarted its counts")),

	{ PLACE("pwm.%02u.duty", MODEL_UNSIGNED, pwm_duty[0]), .stride = sizeof(uint32_t),
	  .count = POKEYS_PWM, .whole = offsetof(struct pokeys_state, pwm_period), .unit = "",
	  TERMINAL(PWM) },
	BITS("pwm.%02u.enabled", pwm_enabled, POKEYS_PWM, "", TERMINAL(PWM)),
	NUMBER("pwm.period-ticks", pwm_period, "ticks",
	       HELP("period of all PWM channels; see info.PWMinternalFrequency")),

	BITS("external.%02u.out-fb", engine.outputs, 8, "", TERMINAL(OUTPUT)),
	BITS("external-relay.%02u.out-fb", engine.relays, 8, ""),
};

MODEL_GROUP(model_io, rows);
