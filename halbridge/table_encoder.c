/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Encoders: 0..24 basic (0..2 are the fast ones when those are on), 25 ultra-fast.
 *
 * Conventions of LinuxCNC's canonical encoder: scale is counts per unit, and
 * index-enable is set by the reader and cleared by us.
 */
#include "halbridge/table_rows.h"

#define ENCODER(name, member, low, high, help)						\
	ROWS("encoder.%02u." name, PARAM, RW, READ, set.encoder, member,		\
	     "device setting: " help, SETTING(low, high))
#define SPECIAL(name, member, low, high, help)						\
	ROW("encoder." name, PARAM, RW, READ, set.member, "device setting: " help,	\
	    SETTING(low, high))

static const struct table_row rows[] = {
	ROWS("encoder.%02u.count", PIN, OUT, READ, encoder, count,
	     "counts since reset or index; 25 is the ultra-fast encoder"),
	ROWS("encoder.%02u.position", PIN, OUT, READ, encoder, position,
	     "counts / scale; does not wrap with count"),
	ROWS("encoder.%02u.velocity", PIN, OUT, READ, encoder, velocity,
	     "units per second, from the times the counts were sampled"),
	ROWS("encoder.%02u.reset", PIN, IN, READ, encoder, reset,
	     "while true, count and position are held at 0 (the device's counter runs on)"),
	ROWS("encoder.%02u.index-enable", PIN, IO, READ, encoder, index_enable,
	     "set it: at the next index pulse the device zeroes the count and the pin is cleared"),
	ROWS("encoder.%02u.set", PIN, IN, WRITE, encoder, set,
	     "a rising edge sets the device's counter to set-value; this also rewrites the other "
	     "counters of its group (0 to 12 or 13 to 25): use it while none of them turns",
	     APART),
	ROWS("encoder.%02u.set-value", PIN, IN, WRITE, encoder, set_value,
	     "value for encoder.NN.set, counts", APART),
	ROWS("encoder.%02u.scale", PARAM, RW, READ, encoder, scale, "counts per unit, not 0",
	     PARAMETER(1, 0, 0)),
	ROWS("encoder.%02u.enabled", PIN, OUT, READ, encoder, enabled,
	     "the device counts it, as basic, fast or ultra-fast encoder"),

	ROWS("encoder.%02u.count-lost", PIN, OUT, READ, encoder, count_lost,
	     "the device was restarted, replaced or silent for 0.5 s: count does not contain what "
	     "was turned meanwhile; until reset, set or the index",
	     APART),
	ROW("encoder-count-lost", PIN, OUT, READ, encoder_count_lost,
	    "count-lost of at least one encoder that is enabled"),
	ROW("encoder-keep-count", PARAM, RW, READ, encoder_keep_count,
	    "after a restart or a silence of the device, count and position go on from where they "
	    "were; 0: they jump to the device's count",
	    PARAMETER(1, 0, 1)),

	ENCODER("sampling", sampling, 0, 4, "0 off, 1, 2 or 4 counts per line"),
	ENCODER("pin-a", pin_a, 0, POKEYS_PINS - 1, "pin of channel A, 0 is pin 1"),
	ENCODER("pin-b", pin_b, 0, POKEYS_PINS - 1, "pin of channel B"),
	SPECIAL("fast.configuration", fast_configuration, 0, 10,
		"0 off, 1 pins 1-2, 3-4, 15-16, 10 pins 1-2, 5-6, 15-16"),
	SPECIAL("fast.4x", fast_4x, 0, 1, "4 counts per line"),
	LIST("encoder.fast.%02u.invert", PARAM, RW, READ, set.fast_invert, SETTINGS_FAST,
	     "device setting: count the other way", SETTING(0, 1)),
	SPECIAL("fast.index", fast_index, 0, 1,
		"the index inputs zero the counters at each pulse, requested or not"),
	SPECIAL("ultra.enable", ultra_enable, 0, 1, "the ultra-fast encoder is on"),
	SPECIAL("ultra.invert", ultra_invert, 0, 1, "count the other way"),
	SPECIAL("ultra.signal-mode", ultra_signal_mode, 0, 1, "A is direction, B is clock"),
	SPECIAL("ultra.4x", ultra_4x, 0, 1, "4 counts per line"),
	SPECIAL("ultra.filter", ultra_filter, 0, INT32_MAX, "filter delay, the device's units"),
};

TABLE_GROUP(table_encoder, rows);
