/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Between the images in shared memory and the values of the HAL interface.
 *
 * Pure: no HAL call, no system call, no clock, no allocation. The two shells
 * (realtime and tests) copy images and pins around these two functions.
 */
#ifndef HALBRIDGE_EXCHANGE_H
#define HALBRIDGE_EXCHANGE_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/command.h>
#include <pokeys/state.h>
#include "halbridge/buttons.h"
#include "halbridge/digital.h"
#include "halbridge/encoder.h"
#include "halbridge/heaters.h"
#include "halbridge/servos.h"
#include "halbridge/info.h"
#include "halbridge/joint.h"
#include "halbridge/joint_home.h"
#include "halbridge/keys.h"
#include "halbridge/legacy.h"
#include "halbridge/link.h"
#include "halbridge/motor_drive.h"
#include "halbridge/one_shot.h"
#include "halbridge/position.h"
#include "halbridge/probe.h"
#include "halbridge/pwm.h"
#include "halbridge/refusal.h"
#include "halbridge/threading.h"
#include "halbridge/trouble.h"
#include "halbridge/values.h"

enum { EXCHANGE_UNREAD_MOST = 4 };

struct exchange {
	struct pokeys_state *state;    /* the newest whole image, one of these: the next one is */
	struct pokeys_state image[2];  /* ... read into the other one (exchange_spare()) */
	struct pokeys_command command; /* for the shell to hand over after exchange_write */
	bool have_state, fresh;        /* of the last exchange_read */
	uint32_t unread_writes;        /* since then */
	bool machine_off;              /* until machine-is-on falls */
	bool resumed;                  /* the daemon was started again meanwhile */
	bool written;                  /* the last command image was taken by shared memory */
	uint64_t t_read_ns;            /* of the last one that found an image, 0 = none did */
	uint32_t read_age_ns;          /* of the last read, until written; 0 = was not fresh */
	struct link link;
	struct one_shot_queue queue;
	struct refusals refusals;
	struct encoder encoder[POKEYS_ENCODERS];
	struct joint joint[POKEYS_AXES];
	struct factor analog_scale[POKEYS_ANALOG], analog_offset[POKEYS_ANALOG];
	struct info_known known;
	struct digital digital;
	struct keys keys;
	struct pwm pwm;
	struct buttons buttons;
	struct joint_home home;
	struct probe probe;
	struct motor_drive drive;
	struct threading threading;
	struct heaters heaters;
	struct servos servos;
	struct trouble trouble;
	struct positions positions;
	/* what the pins were last filled from */
	struct pokeys_engine engine;
	struct pokeys_rtc rtc;
	uint32_t encoder_enabled;
	uint32_t encoders_moved; /* bit = encoder whose pins have changed at this read */
	uint32_t encoders_lost;  /* bit = an encoder whose count is lost */
	bool engine_begun, joints_due, rtc_begun;
	int32_t motion_type; /* at the last update of the joints' pins */
	uint32_t reads;
	struct legacy legacy;
};

/* What reading shared memory gave. */
enum exchange_got {
	EXCHANGE_NOTHING, /* not attached */
	EXCHANGE_STATE,   /* exchange->state is a whole image */
	EXCHANGE_REFUSED, /* something is there that is not one of ours */
};

/* Where the next image goes; if it is whole, that becomes exchange->state. Realtime. */
static inline struct pokeys_state *exchange_spare(struct exchange *exchange)
{
	return &exchange->image[exchange->state == &exchange->image[0]];
}

/* Begin; `session` is the commander's, differs for each start, 0 becomes 1. Cold. */
void exchange_init(struct exchange *exchange, uint32_t session);

/*
 * From exchange->state to the values. Without fresh data the values keep what
 * they had; the connection's pins say so. Realtime.
 */
void exchange_read(struct exchange *exchange, struct values *values, enum exchange_got got,
		   uint64_t now_ns);

/*
 * From the values to exchange->command, with a new heartbeat. `period_ns` is
 * the servo thread's. Who writes more than EXCHANGE_UNREAD_MOST times without
 * a read drives no axis, and finds values->read_missing and not connected: values
 * that a read shows. Realtime.
 */
void exchange_write(struct exchange *exchange, struct values *values, uint64_t now_ns,
		    uint64_t period_ns);

/* Whether shared memory took the command of the last exchange_write. Realtime. */
void exchange_written(struct exchange *exchange, bool taken);

#endif
