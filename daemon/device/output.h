/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Outputs that do not travel with 0xCC: PWM, PoExtBus, external outputs and
 * relays, modules on PoNET. One place for each request that writes some of them.
 */
#ifndef DEVICE_OUTPUT_H
#define DEVICE_OUTPUT_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/command.h>
#include "daemon/device/setting.h"
#include "daemon/engine/mailbox.h"
#include "wire/bus.h"
#include "wire/io.h"
#include "wire/pulse.h"

struct device;

enum output_place {
	OUTPUT_PWM,
	OUTPUT_POEXTBUS,
	OUTPUT_EXTERNAL,
	OUTPUT_PONET,                                    /* and each further module */
	OUTPUT_BRIGHTNESS = OUTPUT_PONET + POKEYS_PONET, /* likewise */
	OUTPUTS = OUTPUT_BRIGHTNESS + POKEYS_PONET
};

union output_value {
	struct wire_pwm_req pwm;
	struct wire_poextbus_req poextbus;
	struct wire_pulse_outputs_req external;
	struct wire_ponet_set_data_req ponet;
	struct wire_ponet_pwm_req brightness;
};

/* What a commander wants of them; only what is in range comes in here. */
struct output_wish {
	bool pwm; /* this session has commanded PWM */
	uint32_t pwm_duty[POKEYS_PWM], pwm_period, pwm_enable;
	uint8_t poextbus[POKEYS_POEXTBUS], poextbus_mask[POKEYS_POEXTBUS];
	uint8_t external, external_mask, relays, relays_mask;
	uint8_t ponet_data[POKEYS_PONET][16];
	uint8_t ponet_brightness[POKEYS_PONET];
	uint32_t ponet_mask;
	uint8_t kbd48_flags, kbd48_brightness;
	uint64_t kbd48_leds;
};

struct output {
	bool open;
	bool mixed;  /* resent with other values; sent has the newest */
	bool known;  /* have is what the device has acknowledged */
	bool driven; /* a commander ever drove it */
	uint8_t failures;
	uint64_t ended_ns; /* when the last write ended */
	uint64_t after_ns; /* not again before */
	union output_value have, sent;
	/* PWM: the period goes on with what is under way, and with it the pulses of this period */
	bool gentle;
	uint64_t pulse_until_ns[POKEYS_PWM]; /* one of before `have` may go on until then */
};

struct output_kind {
	enum wire_op op;
	uint8_t part;    /* DEVICE_RESUME_*, 0 = comes back with all others */
	uint8_t carrier; /* the setting that writes it as well; SETTINGS = none */
	/* What it shall be now, all other bytes 0; false = nobody wants anything of it. */
	bool (*want)(const struct device *device, unsigned int index, union output_value *want);
	/* Into the image. NULL = nothing of it is there. */
	void (*learn)(struct device *device, const union output_value *value);
	/* The answer says that it was done. NULL = any answer does. */
	bool (*done)(const mailbox_entry_t *entry);
};

/* All the outputs of a device. */
struct outputs {
	struct output output[OUTPUTS];
	uint8_t next; /* whose turn it is */
};

/* output_kind.c */
/* Whether the image shows this value; true where it cannot show any. */
bool output_is_shown(const struct device *device, unsigned int place,
		     const union output_value *value);
const struct output_kind *output_kind(unsigned int place, unsigned int *index);

/* output.c */
void output_begin(struct device *device);
/* The next write that is due; true if one was sent. */
bool output_send(struct device *device);
/* PWM, if it is due, or an off in it cannot wait; true if it was sent. */
bool output_send_loops(struct device *device);
/*
 * A setting is written by the same request: what this output shall be now; without a
 * wish *now stays. False while a write of ours is under way. It is written again by itself
 * when the setting has been.
 */
bool output_take_along(struct device *device, unsigned int place, union output_value *now);
/* All of them are as wanted. */
bool output_settled(const struct device *device);
/* A reading that was asked for at asked_ns is not older than the last write. */
bool output_readable(const struct device *device, unsigned int place, uint64_t asked_ns);
/* It was read and stands in the image: what is not as acknowledged is written again. */
void output_seen(struct device *device, unsigned int place);

#endif
