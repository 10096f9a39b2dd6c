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
#include "wire/slots.h"

struct device;
struct wire_pulse_status_rep;

#define BUFFER_SLOT_NS	UINT64_C(1000000)

enum {
	BUFFER_PENDING = 4096, /* room for slots made and not known to be in the device */
	BUFFER_USUAL = 128,    /* most of them that wait to be sent */
	BUFFER_PATH = 256,     /* slots sent: where the axes are after each */
	BUFFER_FILL_MOST = 64, /* slots of one fill; the device has room for 128 */
	/* ... while the spindle plays them: those of a fill that is lost wait again */
	BUFFER_STRETCHED = BUFFER_PENDING - BUFFER_FILL_MOST,
};

/* Does the device take a fill of eight parts (protocol section 1.6)? */
enum buffer_parts { BUFFER_PARTS_UNKNOWN, BUFFER_PARTS_TAKEN, BUFFER_PARTS_NOT };

struct buffer_slot {
	int32_t position[POKEYS_AXES];
};

struct buffer {
	bool clear_open, cleared;      /* emptied before the engine may run */
	bool synced;                   /* path ends where the device will stand when it is empty */
	bool open;                     /* a fill is under way */
	bool doubt;                    /* ... was not answered: executed or not? */
	bool busy;                     /* slots are being made */
	bool tells_free;               /* the status counts free slots, not all */
	uint8_t slots_high;            /* most that a status has named */
	uint8_t sent;                  /* slots of the newest fill */
	uint8_t parts;                 /* enum buffer_parts */
	uint8_t parts_lost;            /* of those fills, in a row, as long as none was taken */
	struct wire_multi fill;        /* the newest fill */
	bool in_parts;                 /* ... needed more than one packet */
	uint8_t data[WIRE_MULTI_DATA]; /* ... its steps */
	uint8_t lead;                  /* slots that the device is ahead of the wire */
	uint64_t led_ns;               /* when it was changed */
	uint64_t sent_ns;              /* when the newest fill was sent */
	uint64_t ended_ns;             /* when it ended */
	uint64_t asked_ns;             /* when the newest status that came was asked for */
	uint64_t disorder_ns;          /* by so much statuses have overtaken each other lately */
	uint64_t came_ns;              /* the last reply to a status or a fill */
	uint64_t silence_ns;           /* the longest time between two of them lately */
	uint64_t empty_ns;             /* by then the device has executed all of it */
	uint64_t pace;                 /* slots executed at pace_ns, and one more each ms */
	uint64_t pace_ns;              /* when that was known */
	uint64_t still_ns;             /* since then no position has changed */
	uint64_t made_ns;              /* slots are made up to here */
	uint64_t tick_ns;              /* of wish_before */
	int32_t still[POKEYS_AXES];
	int32_t wish_before[POKEYS_AXES];
	int32_t step[POKEYS_AXES]; /* of the last slot */
	uint32_t first, pending;   /* pending slots */
	uint64_t rest, begun;      /* the slots that only fill it: behind rest, to begun */
	/* path: the slot executed last, the last one accepted; 32 bits are 49.7 days of motion */
	uint64_t seen, end;
	uint64_t dry;  /* the end after which it was last seen to run dry; 0 = not on this path */
	uint64_t last; /* motion has ended on the path: `end` then, if a fill under way came */
	bool leaving;  /* ... and nobody knows yet whether all was played before */
	struct buffer_slot slot[BUFFER_PENDING];
	struct buffer_slot path[BUFFER_PATH];
	struct buffer_slot wished[BUFFER_PATH]; /* the command of each slot of the path */
};

/* The device is there, or there again: what it had is not known. */
void buffer_begin(struct device *device);
/* buffer.c: once a cycle, after motion has decided; then the request that is due. */
void buffer_update(struct device *device);
bool buffer_send(struct device *device);
/* Motion has ended, perhaps on the path: a status will show whether all of it was played before. */
void buffer_leave(struct device *device);
/* The device plays what it has, and gets no more of it: the axes stop where that ends. */
void buffer_abandon(struct device *device);
/* From now on nothing is filled until it is known where the axes stand. */
void buffer_lose_sync(struct device *device);
/* The engine may run. */
bool buffer_ready(const struct device *device);
/* A status came, to a request of asked_ns. */
void buffer_status(struct device *device, const struct wire_pulse_status_rep *status,
		   uint64_t asked_ns);
/* A status came, to a request of asked_ns; a newer one may have come before. */
void buffer_learn_order(struct device *device, uint64_t asked_ns);
/* A reply to a status or a fill came. */
void buffer_learn_silence(struct device *device);
/* ... and that came: is all of what was sent there? */
void buffer_watch(struct device *device, const struct wire_pulse_status_rep *status,
		  uint64_t asked_ns);
/* Bit = axis that is set up for it. */
uint8_t buffer_axes(const struct device *device);
/* All that is wished has been sent or stands still, and nothing moves any more. */
bool buffer_settled(const struct device *device);
/* All that is wished has been sent. */
bool buffer_arrived(const struct device *device);
/*
 * Set `delayed` (commanded since the time of the reported position) and following_error (the
 * command of that time less the position) of the driven axes in buffered mode.
 */
void buffer_tell_error(struct device *device);
/* The device has executed `at` slots at this time. */
void buffer_pace(struct device *device, uint64_t at, uint64_t t_ns);
/* Slots in the device, as far as known. */
uint32_t buffer_level(const struct device *device);
/* ... that it is to be ahead of the wire. */
uint8_t buffer_lead(const struct device *device);

/* An answer to a fill that has not come by then is not awaited, ns. */
uint64_t buffer_patience(const struct device *device);

/* A status that was sent so much later than a fill reaches the device after it, ns. */
uint64_t buffer_disorder(const struct device *device);

/* buffer_fill.c: slots into a fill. Send one; false: not now. */
bool buffer_fill(struct device *device);
/* A status shows that the fill under way was executed, or lost: its reply is not awaited. */
void buffer_fill_known(struct device *device, bool executed);
/* The last n slots that were sent are not in the device: they wait again. */
void buffer_take_back(struct device *device, uint32_t n);
/* The newest fill is not in the device, or nobody knows. */
void buffer_fill_failed(struct device *device);
/* A fill's packet of the mailbox is about to leave: if it needs more than one, all of them. */
bool buffer_in_parts(const struct device *device, const uint8_t packet[WIRE_PK],
		     uint8_t all[WIRE_MULTI_BYTES]);

/* buffer_stretch.c: from here on slots are not played by the millisecond; they are again. */
void buffer_stretch(struct device *device);
void buffer_unstretch(struct device *device);
/* Slots that are not played yet. */
uint16_t buffer_behind(const struct device *device);
/* ... are no more than usual. */
bool buffer_caught_up(const struct device *device);
/* What is to be played first lies in the device. */
bool buffer_loaded(const struct device *device);
/* The axes that the spindle leads are there already, or will be with what waits. */
bool buffer_stands(const struct device *device, const struct buffer_slot *slot);
/* A fill so small that nobody could tell whether it was executed waits for more. */
bool buffer_fill_worth_it(const struct device *device);
/* The fill in doubt; left: slots in the device, if it tells them. */
void buffer_judge_stretched(struct device *device, const int32_t position[POKEYS_AXES],
			    uint32_t left);
/* Has it run dry in the middle of a motion? Of a fill's answer, before that is counted in. */
void buffer_judge_dry(struct device *device, const int32_t position[POKEYS_AXES]);
/* The newest fill is in the device, or not: then its slots are sent again. */
void buffer_resolve(struct device *device, bool executed);

/* buffer_path.c */
void buffer_path_begin(struct device *device, const int32_t position[POKEYS_AXES]);
/*
 * The next slot of the path, towards these positions, which were `to_before` a slot before. It is
 * no longer than an axis may step.
 */
void buffer_path_step(struct device *device, uint64_t after, const struct buffer_slot *to,
		      const struct buffer_slot *to_before);
/* The axes that a task has may be there n slots after all that were sent, as fast as they can. */
bool buffer_path_reaches(const struct device *device, const struct buffer_slot *to, uint32_t n);
/* The k slots behind the end have been accepted. */
void buffer_path_accept(struct device *device, uint32_t k);
/* Into *at, the slot after which the axes stand there; false if there is none. */
bool buffer_path_find(const struct device *device, const int32_t position[POKEYS_AXES],
		      uint64_t first, uint64_t last, uint64_t *at);
bool buffer_path_is(const struct device *device, const int32_t position[POKEYS_AXES], uint64_t at);
/* They are at its end or between it and the one before. */
bool buffer_path_within(const struct device *device, const int32_t position[POKEYS_AXES],
			uint64_t at);

#endif
