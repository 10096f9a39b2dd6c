/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The life of a device: searched, found, run, lost, left to its own failsafe. Realtime thread only.
 */
#ifndef DEVICE_LIFE_H
#define DEVICE_LIFE_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/state.h>
#include "wire/system.h"

struct device;

struct life {
	uint32_t address; /* 0 = none yet */
	uint16_t port;
	uint8_t fault; /* what was said last */
	bool probing;  /* a probe is open */
	bool ran;      /* was running since it was last found */
	bool foreign;  /* somebody else answers there */
	bool asked;    /* something was asked since the last answer */
	bool rebooted; /* to be acted upon in the next cycle */
	bool began;    /* ... and it has just begun, or is about to: outputs off */
	bool blocked;  /* found, but it may not run */
	bool in_use;   /* somebody else drives it */
	/* of the failsafe's turn in a loss */
	struct wire_failsafe_req failsafe; /* what can be relied on of it */
	uint64_t failsafe_ns;              /* it waits at most so long; 0 = none, or not known */
	uint64_t left_ns;          /* when it ran last, or was looked for first; 0 = not yet */
	uint64_t waits_ns;         /* it is, or was, left alone for so long */
	uint64_t alone_until_ns;   /* nothing is asked until then; 0 = it had no turn yet */
	bool cooled;               /* it has or had, or needs none */
	bool left_alone;           /* until then its loops may be on */
	uint64_t quiet_since_ns;   /* the last answer, or the first question after it */
	uint64_t patient_until_ns; /* silence is expected (flash is written) */
	uint64_t probe_after_ns;
	uint64_t failed_sends; /* statistics.send_failed when the probe began */
	uint64_t foreign_said_ns;
	uint32_t foreign_serial;
};

void life_cycle(struct device *device);
/* The device's own failsafe, or what can be relied on of it; NULL: none, or none is known. */
const struct wire_failsafe_req *life_failsafe(const struct device *device);
/* It was read; it is about to be written. */
void life_failsafe_read(struct device *device, const struct wire_failsafe_req *have);
void life_failsafe_sent(struct device *device, const struct wire_failsafe_req *want);
void life_enter(struct device *device, enum pokeys_link link, enum pokeys_fault fault);
void life_fault(struct device *device, enum pokeys_fault fault);
/* Found, but it may not run: locked, or a setting is refused. */
void life_block(struct device *device, enum pokeys_fault fault);
void life_refuse(struct device *device, enum pokeys_fault fault);
void life_asked(struct device *device);
void life_heard(struct device *device, uint64_t t_ns);

#endif
