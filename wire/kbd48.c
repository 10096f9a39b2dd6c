/* SPDX-License-Identifier: MIT */
/*
 * kbd48CNC keys and lights: protocol section 3.13.
 *
 * The board wires two columns to a byte, bytes swapped in pairs and even
 * columns upside down. The map is computed in one place so that keys read and
 * lights written cannot differ, and a test holds that it is a bijection.
 */

#include "wire/bus.h"

int wire_kbd48_bit(unsigned int key)
{
	const unsigned int x = key / WIRE_KBD48_ROWS;
	const unsigned int y = key % WIRE_KBD48_ROWS;

	if (key >= WIRE_KBD48_KEYS)
		return -1;
	return (int)(((x >> 1) ^ 1u) * 8 + (x & 1 ? y : 7 - y));
}

uint64_t wire_kbd48_keys(const uint8_t data[WIRE_PONET_DATA])
{
	uint64_t keys = 0;

	for (unsigned int key = 0; key < WIRE_KBD48_KEYS; key++) {
		const int bit = wire_kbd48_bit(key);

		if (data[bit / 8] & (1u << (bit % 8)))
			keys |= UINT64_C(1) << key;
	}
	return keys;
}

void wire_kbd48_data(uint64_t keys, uint8_t data[WIRE_PONET_DATA])
{
	memset(data, 0, WIRE_PONET_DATA);
	for (unsigned int key = 0; key < WIRE_KBD48_KEYS; key++) {
		const int bit = wire_kbd48_bit(key);

		if (keys & (UINT64_C(1) << key))
			data[bit / 8] |= (uint8_t)(1u << (bit % 8));
	}
}
