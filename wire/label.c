/* SPDX-License-Identifier: MIT */
/*
 * Nothing of this is in the protocol: the relays are bits of one byte, in an order that is
 * another one on each board, and terminals lead to connectors with names of their own.
 */
#include "wire/label.h"
#include <stddef.h>
#include "wire/model.h"

static const struct wire_labels boards[] = {
	{
		.hardware = WIRE_HW_57CNC,
		.output = { "SSR2", "Relay 2", "Relay 1", "OC1", "OC2", "OC3", "OC4", "SSR1" },
		.terminal = {
			[9] = "pendant connector", [10] = "pendant connector",
			[11] = "pendant connector", [14] = "spindle error",
			[15] = "pendant connector", [16] = "pendant connector",
			[17] = "0-10 V output", [18] = "LCD contrast", [19] = "probe",
			[21] = "pendant LED", [22] = "LCD backlight",
			[23] = "LCD", [24] = "LCD", [25] = "LCD", [26] = "LCD", [28] = "LCD",
			[29] = "LCD", [30] = "LCD",
			[31] = "PoExtension 2", [32] = "PoExtension 2", [33] = "PoExtension 2",
			[34] = "PoExtension 2", [35] = "PoExtension 2", [36] = "PoExtension 2",
			[37] = "PoExtension 2", [38] = "PoExtension 2",
		},
	},
	{
		.hardware = WIRE_HW_57CNCPRO4X25,
		.output = { "fan", "Relay 1", "Relay 2", "OC1", "OC2", "OC3", "OC4",
			    "plasma relay" },
	},
};

const struct wire_labels *wire_labels(uint8_t hardware)
{
	for (size_t i = 0; i < sizeof(boards) / sizeof(boards[0]); i++)
		if (boards[i].hardware == hardware)
			return &boards[i];
	return NULL;
}
