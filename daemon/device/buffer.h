/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Axes in buffered mode: steps of each millisecond, streamed into the device's
 * motion buffer.
 */
#ifndef DEVICE_BUFFER_H
#define DEVICE_BUFFER_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/state.h>

struct device;
struct wire_pulse_status_rep;

enum {
	BUFFER_PENDING = 128,	/* slots made and not sent */
	BUFFER_PATH = 256,	/* slots sent: where the axes are after each */
	BUFFER_SLOTS_MAX = 56,	/* of one request: one axis, a byte each */
};

struct buffer_slot {
	int32_t position[POKEYS_AXES];
};

struct buffer {
	bool clear_open, cleared;	/* emptied before the engine may run */
	bool synced;			/* path ends where the device will stand when it is empty */
	bool open;			/* a fill is under way */
	bool doubt;			/* ... was not answered: executed or not? */
	bool busy;			/* slots are being made */
	bool tells_free;		/* the status counts free slots, not all */
	uint8_t slots_high;		/* most that a status has named */
	uint8_t sent;			/* slots of the newest fill */
	uint8_t lead;			/* slots that the device is ahead of the wire */
	uint64_t ended_ns;		/* when that fill ended */
	uint64_t empty_ns;		/* by then the device has executed all of it */
	uint64_t still_ns;		/* since then no position has changed */
	uint64_t made_ns;		/* slots are made up to here */
	uint64_t tick_ns;		/* of wish_before */
	int32_t still[POKEYS_AXES];
	int32_t wish_before[POKEYS_AXES];
	int32_t step[POKEYS_AXES];	/* of the last slot */
	uint32_t first, pending;	/* pending slots */
	uint32_t seen, end;		/* path: the slot executed last, the last one accepted */
	struct buffer_slot slot[BUFFER_PENDING];
	struct buffer_slot path[BUFFER_PATH];
};

/* buffer.c: once a cycle, after motion has decided; then the request that is due. */
void buffer_update(struct device *device);
bool buffer_send(struct device *device);
/* From now on nothing is filled until it is known where the axes stand. */
void buffer_lose_sync(struct device *device);
/* The engine may run. */
bool buffer_ready(const struct device *device);
/* A status came, to a request of asked_ns. */
void buffer_status(struct device *device, const struct wire_pulse_status_rep *status,
		   uint64_t asked_ns);
/* Bit = axis that is set up for it. */
uint8_t buffer_axes(const struct device *device);

/* buffer_path.c */
void buffer_path_begin(struct device *device, const int32_t position[POKEYS_AXES]);
/* The next slot of the path, towards these positions; no longer than an axis may step. */
void buffer_path_step(struct device *device, uint32_t after, const struct buffer_slot *to);
/* The k slots behind the end have been accepted. */
void buffer_path_accept(struct device *device, uint32_t k);
/* Into *at, the slot after which the axes stand there; false if there is none. */
bool buffer_path_find(const struct device *device, const int32_t position[POKEYS_AXES],
		      uint32_t first, uint32_t last, uint32_t *at);
bool buffer_path_is(const struct device *device, const int32_t position[POKEYS_AXES], uint32_t at);

#endif
