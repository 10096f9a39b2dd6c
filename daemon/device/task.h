/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What the device does by itself on behalf of a one-shot: homing, probing, jogging by
 * hand wheels, threading. One state machine for all; a row says what differs.
 */
#ifndef DEVICE_TASK_H
#define DEVICE_TASK_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/command.h>
#include "daemon/engine/mailbox.h"

struct device;

struct task {
	struct pokeys_one_shot shot; /* what it does, and whose it is */
	uint32_t session;
	uint64_t since_ns; /* in this phase */
	uint64_t limit_ns; /* for the device's work */
	bool asked;        /* the request of this phase was sent */
	bool open;         /* ... is under way */
	bool answered;     /* ... was answered */
	bool told;         /* its outcome has been given */
	bool powered;      /* outputs of its axes are on (ENABLED_MASKED) */
	bool finish;       /* the commander wants it finished */
	uint8_t parked;    /* axes that do not follow yet */
};

struct task_kind {
	uint64_t limit_ns; /* if the one-shot names none */
	bool beside;       /* the engine runs, and axes follow the command meanwhile */
	bool (*is_working)(uint8_t engine_state);
	bool (*is_complete)(uint8_t engine_state);
	bool waits;         /* complete, until the commander finishes it */
	bool endless;       /* at work until the commander ends it */
	bool scrap;         /* neither done nor cancelled: the permission goes */
	uint64_t finish_ns; /* to finish it, if that takes longer than a request */
	/* Send the request that begins it, that ends it; false = not now. */
	bool (*start)(struct device *device, pokeys_parser_t parser);
	bool (*finish)(struct device *device, pokeys_parser_t parser);
	/* The answer to the latter; how it went: enum pokeys_task_result. */
	uint8_t (*take)(struct device *device, const mailbox_entry_t *entry);

	/* These may be NULL. It was begun although that was not answered. */
	bool (*begun)(const struct device *device);
	/* Once a cycle while it works. */
	void (*work)(struct device *device);
	/* Finished, and the axes follow on. */
	bool (*released)(struct device *device);
	/* Beside the engine's stop: nothing of it is left in the device. */
	bool (*stopped)(const struct device *device);
	void (*ended)(struct device *device);
};

extern const struct task_kind task_homing, task_probing, task_hybrid, task_jogging, task_threading;

/* task.c; all realtime, `device` is the one. */

/* A one-shot that has been found good; no task is at work. */
void task_begin(struct device *device, uint8_t task, const struct pokeys_one_shot *shot);
bool task_idle(const struct device *device);
/*
 * Another one may begin: none is at work, and no axis is moved along a path. `beside`: one during
 * which the commander moves axes; then none is held at its end.
 */
bool task_may_begin(const struct device *device, bool beside);
/* Why this one-shot may not begin a task. Its parameter[0] is the time limit. */
struct refusal task_why_not(const struct device *device, bool beside,
			    const struct pokeys_one_shot *shot);
/* Once a cycle, before motion decides. */
void task_update(struct device *device);
/* The next request, if one is due; true if one was sent. */
bool task_send(struct device *device);
/* It ends as soon as the engine stands. */
void task_cancel(struct device *device);
/* For kinds: out of whatever it is in. A result that is there stays. */
void task_stop(struct device *device, uint8_t result);
/* ... the outcome of its one-shot, once. */
void task_tell(struct device *device, enum pokeys_outcome outcome);
/* It is to be finished; false if there is nothing to finish now. */
bool task_finish(struct device *device);
/* The link is gone, nobody knows what becomes of it. */
void task_lost(struct device *device);

/* The engine must stand for it. */
bool task_wants_stand(const struct device *device);
/* It stands; true if the engine belongs to the task from now on. */
bool task_take_engine(struct device *device);
/* Axes whose outputs have to be on although they do not follow the command. */
uint8_t task_powers(const struct device *device);
/* A stop with those outputs was answered. */
void task_powered(struct device *device, uint8_t axes);
/* This state of a running engine is the task's doing. */
bool task_explains(const struct device *device, uint8_t engine_state);

/* homing.c: a time limit of a one-shot, seconds; 0 = the usual one. */
bool task_limit_good(float seconds);

/* homing.c, probing.c, jogging.c: why it is not valid or not permitted now. */
struct refusal homing_why_not(const struct device *device, const struct pokeys_one_shot *shot);
struct refusal probing_why_not(const struct device *device, const struct pokeys_one_shot *shot);
struct refusal jogging_why_not(const struct device *device, const struct pokeys_one_shot *shot);

/* jogging.c: the axes that have a hand wheel. */
uint8_t jogging_axes(const struct device *device);

#endif
