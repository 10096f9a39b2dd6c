/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Where the axes are, and whether their positions are still valid. Realtime thread only.
 */
#ifndef DEVICE_PLACE_H
#define DEVICE_PLACE_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/state.h>
#include "daemon/device/event.h"
#include "daemon/engine/mailbox.h"
#include "wire/pulse.h"

struct device;

/* The positions of one status. */
struct place_reading {
	uint8_t axes; /* of which it tells the position */
	bool stood;   /* the engine did, for long enough */
	int32_t position[POKEYS_AXES];
	uint64_t asked_ns, came_ns;
	uint64_t slept_ns; /* since then this computer was suspended for so long */
};

struct place {
	struct place_reading last; /* that was believed */
	struct place_reading odd;  /* the newest that did not fit it */
	uint8_t alike;             /* so many of them in a row fitted one another */
	uint8_t unlike;            /* so many have come since the last that was believed */
	uint8_t told;              /* axes whose count we have changed, by setting or homing */
	uint64_t told_ns;          /* ... for the last time */
	uint8_t jumped;            /* of these, axes that were seen to jump */
	uint8_t arrived;           /* of those that are being homed: they are */
	uint8_t lost, known;       /* axes of which the epoch has to change */
	uint8_t homed;             /* of the known ones: because the device has homed them */
	uint64_t changed_ns;       /* ... with the first reading after that */
	uint64_t moved_ns;         /* the engine may have moved an axis until then */
	bool ran;                  /* the link, at least once */
};

/*
 * May the positions of a status be taken? Call it once for each status, with the times of the
 * query and of the reply (ns).
 */
bool place_take(struct device *device, const struct wire_pulse_status_rep *status,
		uint64_t asked_ns, uint64_t came_ns);
/* The counts of these axes may have been changed by us; older readings do not show it. */
void place_told(struct device *device, uint8_t axes);
/*
 * This status shows the positions of these axes as they were set. Returns whether it is
 * believed; only then they are known.
 */
bool place_set(struct device *device, uint8_t axes, const mailbox_entry_t *status);
/* The device was asked to move axes; a reading of later does not show that they stood. */
void place_moves(struct device *device);
/* Homing of these axes begins; it has ended well; it has ended without success. */
void place_homing(struct device *device, uint8_t axes);
void place_homed(struct device *device, uint8_t axes);
void place_not_homed(struct device *device, uint8_t axes);
/* These axes have begun another count, and nobody knows from where. */
void place_lost(struct device *device, uint8_t axes, enum place_loss why);
/* No clock of ours went on for so long. */
void place_slept(struct device *device, uint64_t slept_ns);
/* The link runs (again). */
void place_begin(struct device *device);

#endif
