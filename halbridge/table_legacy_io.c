/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The older userspace component's names: connection, clock, encoders, pins,
 * analog values, expansion buses.
 *
 * A row whose value means what a canonical one means stands on that member:
 * its OUT pin is written with it, its IN pin is one more hand on the same
 * wish, its parameter is the same storage. What the old component counted
 * backwards (PoExtBus) goes backwards through the member by a negative stride.
 *
 * Indices are never padded here, and begin where the users' files have them.
 */
#include "halbridge/table_legacy.h"

/* Bit 8-j of byte 9-i, for i from 0 and j from 1. */
#define BUS(name_, kind_, direction_, when_, member_, help_) {				\
	ROW_COMMON(name_, kind_, direction_, when_, member_[VALUES_BUS_BITS - 1]),	\
	.help = help_, LEGACY, .count = POKEYS_POEXTBUS,				\
	.stride = -8 * (int)sizeof(ROW_MEMBER(member_)[0]),				\
	.inner = 8, .inner_first = 1, .inner_stride = -(int)sizeof(ROW_MEMBER(member_)[0]) }

/* The byte of bus i is byte 9-i as well. */
#define BUS_BYTE(name_, direction_, member_, help_) {					\
	ROW_COMMON(name_, PARAM, direction_, READ, member_[POKEYS_POEXTBUS - 1]),	\
	.help = help_, LEGACY, .count = POKEYS_POEXTBUS,				\
	.stride = -(int)sizeof(ROW_MEMBER(member_)[0]) }

#define WORDS(name_, direction_, when_, member_, help_) {				\
	ROW_COMMON(name_, PIN, direction_, when_, member_[0][0]), .help = help_,	\
	.scheme = TABLE_PONET, .count = POKEYS_PONET,					\
	.stride = sizeof(ROW_MEMBER(member_)[0]), .inner = LEGACY_WORDS,		\
	.inner_stride = sizeof(ROW_MEMBER(member_)[0][0]) }

#define MODULE(name, member, help)	\
	LIST("PoNET.%u." name, PARAM, RO, READ, legacy.ponet.member, POKEYS_PONET, help, \
	     .scheme = TABLE_PONET)

/* From 26 on there is nothing behind a name. */
#define MORE(name, kind, direction, array, at_, member, ...) {				\
	ROW_COMMON("encoder.%u." name, kind, direction, READ, array[at_].member),		\
	.help = "without function", LEGACY, .first = POKEYS_ENCODERS,			\
	.count = LEGACY_ENCODERS - POKEYS_ENCODERS, .stride = sizeof(ROW_MEMBER(array)[0]),	\
	__VA_ARGS__ }
#define FACTOR(name, kind, direction, member, help_, ...) {				\
	ROW_COMMON("encoder.%u." name, kind, direction, READ, legacy.encoder[0].member),	\
	.help = help_, LEGACY, .count = POKEYS_ENCODERS,				\
	.stride = sizeof(struct legacy_encoder),					\
	__VA_ARGS__ }

static const struct table_row rows[] = {
	L_OUT("enum-usb-dev", legacy.connection.usb, "0: no USB device is used"),
	L_OUT("enum-fusb-dev", legacy.connection.fast_usb, "0: no fast USB device is used"),
	L_OUT("enum-udp-dev", legacy.connection.udp, "1 when the device has been found"),
	L_OUT("deb.out", legacy.connection.step, "-1 no daemon, otherwise link-state"),
	L_OUT("err", legacy.connection.error, "no fresh data, as stale"),
	L_OUT("connected.usb", legacy.connection.usb_open, "always false"),
	L_OUT("connected.fusb", legacy.connection.fast_usb_open, "always false"),
	L_OUT("connected.udp", connected, "as connected: the daemon speaks UDP"),
	L_OUT("connected.net", legacy.connection.tcp_open, "always false"),
	L_OUT("alive", connected, "as connected: false when the device stops answering"),

	L_OUT("rtc.tmp", legacy.clock.unnamed, "the additional byte that the device sends"),
	L_OUT("rtc.loopcount", legacy.clock.loops, "reads since the last change of rtc.sec"),
	L_OUT("rtc.lastmin", legacy.clock.last_minute, "rtc.min before it last changed"),
	L_OUT("rtc.lastsec", legacy.clock.last_second, "rtc.sec before it last changed"),
	L_OUT("rtc.loop-frequ", legacy.clock.rate, "reads per second, Hz"),
	L_IN("rtc.loop-frequ-demand", legacy.clock.rate_demand,
	     "requested rate of the userspace component, 100 to 2000 Hz; 0 = 1000; in "
	     "pokeys_shm the thread's period applies"),
	ROW("rtc.sec-ret", PIN, IN, READ, legacy.clock.second_back,
	    "rtc.sec returned through HAL, to measure rtc.hal-latency", LEGACY),
	L_OUT("rtc.hal-latency", legacy.clock.latency,
	      "number of reads until sec-ret has followed a change of sec"),

	L_OUT("encoder.deb.out", legacy.encoder_step, "age of the encoders' data, us"),
	ROWS("encoder.%u.count", PIN, OUT, READ, encoder, count,
	     "counts since reset or index; 25 is the ultra-fast encoder", LEGACY),
	FACTOR("position", PIN, OUT, position, "counts * scale"),
	FACTOR("velocity", PIN, OUT, velocity, "counts per second * scale"),
	ROWS("encoder.%u.reset", PIN, IN, READ, encoder, reset,
	     "while true, count and position are held at 0; no other channel is touched", LEGACY),
	L_IOS("encoder.%u.index-enable", encoder, index_enable,
	      "set it: at the next index pulse the device zeroes the count and the pin is cleared"),
	FACTOR("scale", PARAM, RW, scale, "units per count (a factor)", PARAMETER(1, -1e12, 1e12)),
	MORE("count", PIN, OUT, legacy.encoder_unused, 0, count),
	MORE("position", PIN, OUT, legacy.encoder, POKEYS_ENCODERS, position),
	MORE("velocity", PIN, OUT, legacy.encoder, POKEYS_ENCODERS, velocity),
	MORE("reset", PIN, IN, legacy.encoder_unused, 0, reset),
	MORE("index-enable", PIN, IO, legacy.encoder_unused, 0, index_enable),
	MORE("scale", PARAM, RW, legacy.encoder, POKEYS_ENCODERS, scale, PARAMETER(1, -1e12, 1e12)),
	L_SETS("encoder.%u.encoderOptions", legacy.encoder_set, options,
	       "1 enabled, 2 4x, 4 2x sampling, 16 to 128 key maps; computed from the single-bit "
	       "parameters",
	       PARAMETER(0, 0, 255)),
	L_SETS("encoder.%u.enable", legacy.encoder_set, enable,
	       "count; false = as the device has it", ANY_BIT),
	L_SETS("encoder.%u.4x_sampling", legacy.encoder_set, x4,
	       "4x sampling; false = as the device has it", ANY_BIT),
	L_SETS("encoder.%u.2x_sampling", legacy.encoder_set, x2,
	       "2x sampling; false = as the device has it", ANY_BIT),
	L_SETS("encoder.%u.channelApin", legacy.encoder_set, pin_a, "pin of channel A, from 0",
	       PARAMETER(0, 0, 54)),
	L_SETS("encoder.%u.channelBpin", legacy.encoder_set, pin_b, "pin of channel B, from 0",
	       PARAMETER(0, 0, 54)),
	L_SET("encoder.FastEncoders.Options", legacy.fast_set.options,
	      "16 no 4x sampling, 32, 64, 128 invert an encoder; computed from the single-bit "
	      "parameters",
	      PARAMETER(0, 0, 255)),
	L_SET("encoder.FastEncoders.Configuration", legacy.fast_set.configuration,
	      "0 off, 1 pins 1-2, 3-4, 15-16, 10 (or 16) pins 1-2, 5-6, 15-16",
	      PARAMETER(0, 0, 255)),
	L_SET("encoder.FastEncoders.Enable", legacy.fast_set.enable, "fast encoders on", ANY_BIT),
	L_SET("encoder.FastEncoders.AlternativeConfig", legacy.fast_set.alternative,
	      "use the alternative pins", ANY_BIT),
	L_SET("encoder.FastEncoders.InvertE1", legacy.fast_set.invert[0], "invert encoder 1",
	      ANY_BIT),
	L_SET("encoder.FastEncoders.InvertE2", legacy.fast_set.invert[1], "invert encoder 2",
	      ANY_BIT),
	L_SET("encoder.FastEncoders.InvertE3", legacy.fast_set.invert[2], "invert encoder 3",
	      ANY_BIT),
	L_SET("encoder.FastEncoders.Disable4xSampling", legacy.fast_set.no_x4, "no 4x sampling",
	      ANY_BIT),
	L_SET("encoder.UltraFastEncoder.Options", legacy.fast_set.ultra_invert,
	      "invert the encoder", ANY_BIT),
	L_SET("encoder.UltraFastEncoder.SignalMode", legacy.fast_set.ultra_signal_mode,
	      "clock and direction instead of two phases", ANY_BIT),
	L_SET("encoder.UltraFastEncoder.4xSampling", legacy.fast_set.ultra_x4, "4x sampling",
	      ANY_BIT),
	L_SET("encoder.UltraFastEncoder.Filter", legacy.fast_set.ultra_filter, "digital filter",
	      PARAMETER(0, 0, 2147483647)),

	L_OUT("PoExtBus.deb.out", legacy.poextbus.step, "reads of the bus in 1000 s"),
	L_SET("PoExtBus.count", legacy.poextbus.count, "bytes handled; 0 leaves the bus alone",
	      PARAMETER(POKEYS_POEXTBUS, 0, POKEYS_POEXTBUS)),
	BUS("PoExtBus.%u.digin.%u.in", PIN, OUT, READ, poextbus.in, "bit of the bus, actual value"),
	BUS("PoExtBus.%u.digin.%u.in_not", PIN, OUT, READ, poextbus.in_not, "its inverse"),
	BUS("PoExtBus.%u.digout.%u.out", PIN, IN, WRITE, poextbus.out,
	    "bit of the bus, commanded value"),
	BUS("PoExtBus.%u.digout.%u.invert", PARAM, RW, WRITE, poextbus.out_invert,
	    "send the inverse"),
	BUS_BYTE("PoExtBus.%u.digin.byte", RO, legacy.poextbus.in, "byte of the bus, actual value"),
	BUS_BYTE("PoExtBus.%u.digout.byte", RW, legacy.poextbus.out,
		 "byte last sent; what is written here has no effect"),

	L_OUT("PoNET.PoNETstatus", ponet.state, "state of the bus, 10 = ready"),
	L_SET("PoNET.DevCount", legacy.ponet.found, "modules found", ANY_VALUE),
	L_SET("kbd48CNC.available", legacy.ponet.available, "a kbd48CNC was found", ANY_BIT),
	L_SET("kbd48CNC.PoNetID", legacy.ponet.keyboard, "number of the kbd48CNC's module",
	      ANY_VALUE),
	L_OUT("PoNET.Deb.Out", legacy.ponet.step, "reads of the modules in 1000 s"),
	L_OUT("kbd48CNC.lightValue", kbd48.light, "ambient light, 0 to 255"),
	ROW("kbd48CNC.KeyBrightness", PIN, OUT, WRITE, kbd48.brightness_sent,
	    "brightness of the keys", LEGACY),
	L_OUT("kbd48CNC.prevBrightness", legacy.ponet.brightness_before,
	      "brightness before it last changed"),
	LIST("kbd48CNC.%u.LED", PIN, IN, WRITE, kbd48.led, VALUES_KEYS,
	     "light of the key; a pressed key is lit as well", LEGACY),
	LIST("kbd48CNC.%u.Button", PIN, OUT, READ, kbd48.button, VALUES_KEYS, "key is pressed",
	     LEGACY),

	L_OUTS("adcout.%u.deb.out", legacy.adcout, step, "duty the device has, ticks"),
	L_OUTS("adcout.%u.deb.setval", legacy.adcout, duty, "duty computed from value, ticks"),
	L_INS("adcout.%u.value", legacy.adcout, value,
	      "output, units; has effect with legacy.adcout-follows"),
	L_INS("adcout.%u.enable", legacy.adcout, enable,
	      "output on; has effect with legacy.adcout-follows"),
	L_SETS("adcout.%u.offset", legacy.adcout, offset, "added to value * scale",
	       PARAMETER(0, -1e9, 1e9)),
	L_SETS("adcout.%u.scale", legacy.adcout, scale, "factor; 0 = 1", PARAMETER(1, -1e9, 1e9)),
	L_SETS("adcout.%u.high-limit", legacy.adcout, high, "upper limit; both limits 0: max-v",
	       PARAMETER(0, -1e9, 1e9)),
	L_SETS("adcout.%u.low-limit", legacy.adcout, low, "lower limit", PARAMETER(0, -1e9, 1e9)),
	L_SETS("adcout.%u.max-v", legacy.adcout, full,
	       "value of full duty; 0 = 5, but 10 for adcout.0 of a 57CNC", PARAMETER(0, 0, 1e9)),
	L_FACTS("adcout.%u.PinId", legacy.adcout, pin, "physical pin, 17 to 22"),
	L_OUT("adcout.deb.outv", legacy.adcout_step, "channels the device has on, bits"),
	L_SET("adcout.pwm.period", legacy.pwm_period, "ticks; 0 = as the device has it, or 2500",
	      ANY_VALUE),

	L_OUTS("adcin.%u.value-raw", legacy.adcin, volts, "volts at the pin; adcin.0 is pin 41"),
	L_OUTS("adcin.%u.value", analog, value, "volts * scale - offset"),
	ROWS("adcin.%u.scale", PARAM, RW, READ, analog, scale, "units per volt", LEGACY,
	     PARAMETER(1, 0, 0)),
	ROWS("adcin.%u.offset", PARAM, RW, READ, analog, offset, "units, subtracted", LEGACY),

	LIST("pins.%u.PinFunction", PARAM, RW, READ, legacy.pin_set.function, POKEYS_PINS,
	     "2 input, 4 output, 8 analog input, 16 analog output, 32 trigger, 64 counter, "
	     "128 inverted; 0 = as the device has it",
	     LEGACY, PARAMETER(0, 0, 255)),
	LIST("digin.%u.in", PIN, OUT, READ, pin.in, POKEYS_PINS, "digital input; digin.0 is pin 1",
	     LEGACY),
	LIST("digin.%u.in-not", PIN, OUT, READ, pin.in_not, POKEYS_PINS, "its inverse", LEGACY),
	LIST("digin.%u.invert", PARAM, RW, READ, legacy.pin_set.in_invert, POKEYS_PINS,
	     "inverted in the device, as 128 in PinFunction", LEGACY),
	LIST("digout.%u.out", PIN, IN, WRITE, pin.out, POKEYS_PINS,
	     "digital output; followed if the pin is an output in the device", LEGACY),
	LIST("digout.%u.invert", PARAM, RW, READ, legacy.pin_set.out_invert, POKEYS_PINS,
	     "inverted in the device, as 128 in PinFunction", LEGACY),
	LIST("counter.%u.value", PIN, OUT, READ, counter.value, POKEYS_PINS, "digital counter",
	     LEGACY),
	L_OUT("digin.deb.out", legacy.digin_step, "age of the inputs, us"),
};

/*
 * Sixteen modules times 37 names, of which those that carry data never did
 * anything: they are exported only if asked for, because of HAL's memory.
 */
static const struct table_row modules[] = {
	MODULE("moduleID", id, "its number"),
	MODULE("i2cAddress", address, "its I2C address"),
	MODULE("moduleType", type, "0 none, 16 kbd48CNC"),
	MODULE("moduleSize", size, "bytes of data"),
	MODULE("moduleOptions", options, "options"),
	WORDS("PoNET.%u.digin.%u.in", OUT, READ, legacy.ponet.in, "byte of the module's inputs"),
	WORDS("PoNET.%u.digout.%u.out", IN, WRITE, legacy.ponet.out,
	      "byte of its outputs, sent if legacy.ponet-out-follows"),
};

TABLE_GROUP(table_legacy_io, rows);
TABLE_GROUP(table_legacy_ponet, modules);
