/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * PoStep motor drivers: what the table of 0x50 and that of 0x53 have in common.
 */
#ifndef DEVICE_POSTEP_H
#define DEVICE_POSTEP_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/settings.h>

struct device;
struct setting;

#define POSTEP_COMM_BITS (POKEYS_AXIS_SET_POSTEP_TYPE | POKEYS_AXIS_SET_POSTEP_ADDRESS)
#define POSTEP_MODE_BITS (POKEYS_AXIS_SET_POSTEP_STEP | POKEYS_AXIS_SET_POSTEP_TEMPERATURE)

/* What the device is to do with a driver (@10 of 0x50). */
enum {
	UPDATE_MODE = 0xC0,
	UPDATE_WRITE = 0x80,
	UPDATE_STATUS = 0x1F, /* fetch supply, temperature, inputs, state, faults */
	UPDATE_ALL = 0x3F,    /* and what it is set up for */
	NUMBER_STEP = 6,
	NUMBER_TEMPERATURE = 7,
};

/* This device has PoStep drivers; `index` is not used. */
bool postep_has_tables(const struct device *device, unsigned int index);

/* Bit = axis of which any of these is wanted (POKEYS_AXIS_SET_*). */
uint8_t postep_axes_with(const struct pokeys_settings *want, uint32_t bits);

/* postep_talk.c: of 0x53, for struct setting_kind */
bool postep_modes_ready(struct device *device);
bool postep_modes_effect(struct device *device, struct setting *setting);

#endif
