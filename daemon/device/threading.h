/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Threading by the device: the motion buffer played by the spindle's turns.
 */
#ifndef DEVICE_THREADING_H
#define DEVICE_THREADING_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/state.h>
#include "wire/pulse.h"

struct device;

/* What the device says of itself, in the order in which it gets there. */
enum thread_step {
	THREAD_NONE,
	THREAD_PREPARING,
	THREAD_PREPARED,
	THREAD_WAITING,
	THREAD_ACTIVE,
};

/* A one-shot whose outcome comes later. */
struct thread_shot {
	bool open;
	uint8_t operation;
	uint32_t id;
	uint64_t since_ns;
};

struct threading {
	bool open; /* a status is under way */
	bool turn; /* the next fast status is threading's */
	bool arm_open, cancel_open;
	bool cancelled; /* a cancel was answered since it is dirty */
	bool dirty;     /* the device may be in it */
	bool stretched; /* slots are no milliseconds: buffer.c */
	bool released;  /* ... but are made as if they were again */
	uint8_t step;   /* enum thread_step */
	uint8_t arm_tries;
	uint8_t spoilt;    /* enum pokeys_task_result: it cannot go on */
	uint64_t known_ns; /* when the newest answered status was asked for */
	uint64_t heard_ns; /* ... and when its answer came */
	uint64_t step_ns;  /* since then in this step */
	uint64_t acted_ns; /* arm or cancel was answered, or given up */
	uint64_t cancel_after_ns;
	uint64_t watch_until_ns; /* a late copy of a request may still come */
	struct thread_shot arm, release;
	bool written; /* the device has taken these: they cannot be read */
	struct wire_thread_params_req params;
};

/* threading.c; all realtime, `device` is the one. */

/* The link runs (again). */
void threading_begin(struct device *device);
/* The device says, before the link runs, that it is in it: from somebody before us. */
void threading_found(struct device *device);
/* It was found running with axes in buffered mode: ask it whether it is in it, once. */
void threading_suspect(struct device *device);
/* The device may have forgotten its parameters. */
void device_threading_forget(struct device *device);
/* Once a cycle, before motion decides. */
void threading_update(struct device *device);
/* The next request, if one is due; true if one was sent. */
bool threading_send(struct device *device);
/* This cycle's status is to be threading's; then ask for it. */
bool threading_asks(struct device *device);
void threading_ask(struct device *device);

/* Its task is at work, and not on its way out. */
bool threading_ours(const struct device *device);
/* The newest status is of after all that was asked. */
bool threading_known(const struct device *device);
/* enum thread_step, by that status. */
uint8_t threading_step_seen(const struct device *device);
/* The axes that the spindle leads, or would. */
uint8_t threading_axes_of(const struct device *device);
/* The outcome of a one-shot that waits for it. */
void threading_answer(struct device *device, struct thread_shot *shot, enum pokeys_outcome outcome);

/* What was sent is played by the spindle, or was until just now. */
bool threading_stretched(const struct device *device);
/* ... and slots are made by our clock alone, however many wait. */
bool threading_paces(const struct device *device);
/* The device takes none now. */
bool threading_holds(const struct device *device);
/* It is not known, or known otherwise, that the device plays by the millisecond. */
bool threading_dirty(const struct device *device);
/* It plays them; false: they wait. */
bool threading_active(const struct device *device);
/* It cannot go on: enum pokeys_task_result. */
void threading_spoil(struct device *device, uint8_t result);

#endif
