/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Whether it is still the same start of the same device. Realtime thread only.
 */
#ifndef DEVICE_RESTART_H
#define DEVICE_RESTART_H

#include <stdbool.h>
#include <stdint.h>
#include "daemon/engine/mailbox.h"
#include "wire/packet.h"

struct device;

/* The device's clock, read at some time from asked_ns to came_ns. */
struct reading {
	bool known;
	uint32_t ms;
	uint32_t blur_ms; /* ... or so much less or more */
	uint64_t asked_ns, came_ns;
};

struct restart {
	struct reading last;            /* that was believed */
	struct reading odd;             /* the newest that did not fit it */
	bool clock_known;               /* since it was last identified */
	uint64_t fit_ns;                /* the newest reading that fitted was asked for then */
	uint8_t odd_ticks;              /* in a row */
	uint8_t odd_alike;              /* ... of which so many fit one another */
	uint8_t odd_identity;           /* so often the same other serial number or lock was said */
	uint8_t data_alike;             /* so often in a row, up to 255 */
	uint8_t data[WIRE_PAYLOAD_LEN]; /* ... the newest device data was said */
};

/* The device data once more: another one in its place is as good as a restart. */
void restart_identity(struct device *device, const mailbox_entry_t *entry);
/* Its clock. Both set life.rebooted when there is no doubt any more. */
void restart_tick(struct device *device, const mailbox_entry_t *entry);
/* An answer did not fit; until it was asked again only questions may be sent. */
bool restart_doubted(const struct device *device);
/* The device has reported its clock since identify_begin(), so a restart would be known. */
bool restart_clock_known(const struct device *device);
/* A clock reading asked for after that moment showed no restart. */
bool restart_judged(const struct device *device, uint64_t since_ns);
/* How many answers in a row had just this device data, this one among them. */
uint8_t restart_data_alike(struct device *device, const uint8_t reply[WIRE_PK]);
/* For how long this computer slept is known from a clock of whole seconds. */
#define SLEPT_BLUR_NS UINT64_C(2000000000)
/* The device's clock has gone on by so much while ours stood still. */
void restart_slept(struct device *device, uint64_t slept_ns);
/* Another device: nothing is known of its clock. */
void restart_forget(struct device *device);

#endif
