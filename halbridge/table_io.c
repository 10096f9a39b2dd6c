/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Digital pins and counters.
 *
 * pin.00 is the terminal the device calls pin 1. Inversion of an output is made
 * here, in the servo thread, and does not touch the device; the device's own
 * inversion is bit 7 of the pin's function (protocol section 3.2).
 */
#include "halbridge/table_rows.h"

static const struct table_row rows[] = {
	LIST("pin.%02u.in", PIN, OUT, READ, pin.in, POKEYS_PINS, "digital input; pin.00 is pin 1"),
	LIST("pin.%02u.in-not", PIN, OUT, READ, pin.in_not, POKEYS_PINS, "its inverse"),
	LIST("pin.%02u.out", PIN, IN, WRITE, pin.out, POKEYS_PINS,
	     "digital output; followed if the device has the pin configured as an output"),
	LIST("pin.%02u.out-fb", PIN, OUT, READ, pin.out_fb, POKEYS_PINS,
	     "the output as the device has acknowledged it, before out-invert"),
	LIST("pin.%02u.out-invert", PARAM, RW, WRITE, pin.out_invert, POKEYS_PINS,
	     "the output is 1 where pin.NN.out is false", PARAMETER(0, 0, 1)),
	LIST("pin.%02u.function", PARAM, RW, WRITE, set.pin_function, POKEYS_PINS,
	     "device setting: sum of 2 digital input, 4 digital output, 8 analog input, "
	     "16 analog output, 32 triggered input, 64 counter, 128 inverted; 0 inactive",
	     SETTING(0, 255)),

	LIST("counter.%02u.value", PIN, OUT, READ, counter.value, POKEYS_PINS,
	     "digital counter of the pin, wraps at 2^32"),
	ROW("counter.reset", PIN, IN, WRITE, counter.reset,
	    "its rising edge zeroes all digital counters, in the device"),
};

TABLE_GROUP(table_io, rows);
