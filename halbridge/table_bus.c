/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * PoExtBus and PoNET.
 *
 * PoExtBus is one shift register of ten bytes: bit 8 * byte + bit of the data the
 * device is sent. PoRelay8.00 is the module next to the device, which has the
 * last byte (protocol section 3.12), relay 1 its bit 0; its names stand on the
 * same members. PoNET modules have 16 bytes each way, as four words.
 */
#include "halbridge/table_rows.h"

#define MODULE(name, member, help)	\
	ROWS("PoNET.%02u." name, PIN, OUT, READ, ponet.module, member, help)
#define LAST_BYTE	(8 * (POKEYS_POEXTBUS - 1))
#define WORDS(member_, direction_, when_, name_, help_) {				\
	ROW_COMMON(name_, PIN, direction_, when_, ponet.module[0].member_[0]),		\
	.stride = sizeof(struct value_ponet_module), .count = POKEYS_PONET,		\
	.inner = VALUES_PONET_WORDS, .inner_stride = sizeof(uint32_t), .help = help_ }

static const struct table_row rows[] = {
	LIST("PoExtBus.%02u.out", PIN, IN, WRITE, poextbus.out, VALUES_BUS_BITS,
	     "output; the eight of a byte are commanded once one of them has been true"),
	LIST("PoExtBus.%02u.in", PIN, OUT, READ, poextbus.in, VALUES_BUS_BITS,
	     "as the device has it"),
	LIST("PoExtBus.%02u.in-not", PIN, OUT, READ, poextbus.in_not, VALUES_BUS_BITS,
	     "its inverse"),
	LIST("PoExtBus.%02u.out-invert", PARAM, RW, WRITE, poextbus.out_invert, VALUES_BUS_BITS,
	     "the output is 1 where PoExtBus.NN.out is false", PARAMETER(0, 0, 1)),
	ROW("PoExtBus.connector", PARAM, RW, WRITE, set.poextbus_connector,
	    "device setting: 0 dedicated, 1 pins 35 to 37", SETTING(0, 1)),
	ROW("PoExtBus.crc", PARAM, RW, WRITE, set.poextbus_crc,
	    "device setting: 1 with a check byte, as PoRelay8 needs it", SETTING(0, 1)),
	{ ROW_COMMON("PoRelay8.%02u.relay-%u", PIN, IN, WRITE, poextbus.out[LAST_BYTE]),
	  .stride = -8, .count = POKEYS_POEXTBUS, .inner = 8, .inner_stride = 1, .inner_first = 1,
	  .help = "relay of a PoRelay8; another name for a PoExtBus output, 00 is next to the "
		  "device" },

	ROW("PoNET.state", PIN, OUT, READ, ponet.state, "state of the bus: 10 ready, 0 inactive"),
	ROW("PoNET.count", PIN, OUT, READ, ponet.count, "modules found"),
	MODULE("present", present, "a module is there and its data are good"),
	MODULE("type", type, "0 none, 16 kbd48CNC"),
	MODULE("address", address, "address on the bus"),
	MODULE("size", size, "bytes of data"),
	MODULE("options", options,
	       "sum of 1 inputs, 2 outputs, 4 rotated, 8 light sensor, 16 mapped, 32 read, "
	       "64 configured, 128 present"),
	MODULE("status", status, "0 data are good"),
	MODULE("light", light, "ambient light, 0..255"),
	MODULE("version", version, "version of the module's firmware"),
	MODULE("failures", failures, "consecutive exchanges without data"),
	WORDS(in, OUT, READ, "PoNET.%02u.in-%u", "inputs: bytes 4 * n to 4 * n + 3, least first"),
	WORDS(out, IN, WRITE, "PoNET.%02u.out-%u",
	      "outputs, in the same order; commanded once one of the module's words is not 0"),
	ROWS("PoNET.%02u.brightness", PARAM, RW, WRITE, ponet.module, brightness,
	     "of the module's lamps, commanded together with its outputs; -1 is full",
	     PARAMETER(-1, -1, 255)),
};

TABLE_GROUP(table_bus, rows);
