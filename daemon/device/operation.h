/* SPDX-License-Identifier: GPL-2.0-or-later */
/* What a one-shot of a commander does. Realtime thread only. */
#ifndef DEVICE_OPERATION_H
#define DEVICE_OPERATION_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/command.h>
#include "daemon/device/event.h"
#include "daemon/engine/mailbox.h"

struct device;

/* Why a one-shot is not valid or not permitted now; its reason is REFUSAL_NONE if it is. */
struct refusal {
	uint8_t reason; /* enum one_shot_refusal */
	uint8_t part;   /* axis or encoder */
};

static inline struct refusal refusal(enum one_shot_refusal reason, unsigned int part)
{
	return (struct refusal){ (uint8_t)reason, (uint8_t)part };
}

struct operation {
	/* NULL: always permitted. */
	struct refusal (*why_not)(const struct device *device, const struct pokeys_one_shot *shot);
	/* Send the request of one_shots.step; false = not now. NULL: nothing is sent. */
	bool (*send)(struct device *device);
	/* It was answered: one_shot_end(), or a further step. */
	void (*answered)(struct device *device, const mailbox_entry_t *entry);
	/* It acted or not, nobody knows: one_shot_end(), or a step that reads back. */
	void (*unknown)(struct device *device);
	/* Done here and now, with nothing to send; false = refused. */
	bool (*act)(struct device *device, const struct pokeys_one_shot *shot);
};

/* NULL for an operation that does not exist or is not offered. */
const struct operation *operation_find(uint8_t operation);

/* REFUSAL_NO_ENGINE if the device has no pulse engine. */
struct refusal operation_needs_engine(const struct device *device,
				      const struct pokeys_one_shot *shot);

/* The device's flash was written so short a time ago that another save is refused. */
bool operation_saved_just_now(const struct device *device);

/* operation_encoder.c */
/* Whether this new count of an armed encoder says that its index zeroed it. */
bool operation_index_seen(struct device *device, unsigned int encoder, int32_t count,
			  uint64_t t_ns);
/* The fast encoders' index inputs are on, or about to be, for a one-shot. */
bool operation_index_awaited(const struct device *device);
/* Switch the fast encoders' index inputs back, if that is due; true if it was sent. */
bool operation_disarm(struct device *device);
extern const struct operation operation_set_encoder, operation_arm_index;
/* operation_task.c */
extern const struct operation operation_home, operation_home_cancel, operation_home_finish,
	operation_probe, operation_probe_finish, operation_jog, operation_jog_end;
/* operation_heater.c */
extern const struct operation operation_heater_reset, operation_heater_tune, operation_heater_gain;
/* operation_servo.c */
extern const struct operation operation_servo_reset, operation_servo_place, operation_servo_gain,
	operation_servo_home, operation_servo_tune, operation_move, operation_moves_control;
/* operation_thread.c */
extern const struct operation operation_thread_begin, operation_thread_arm,
	operation_thread_release, operation_thread_cancel;

#endif
