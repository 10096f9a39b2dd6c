/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * An exchange with a made-up daemon in front of it, in virtual time.
 */
#ifndef TESTS_HALBRIDGE_RIG_H
#define TESTS_HALBRIDGE_RIG_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "halbridge/exchange.h"
#include "halbridge/table.h"

#define RIG_MS		UINT64_C(1000000)
#define RIG_EPOCH	UINT64_C(4711)

struct rig {
	struct exchange exchange;
	struct values values;
	struct pokeys_state daemon; /* what the daemon would publish */
	uint64_t now_ns;
	bool daemon_dead, device_silent;
	bool unread; /* the thread runs write alone */
};

static inline void rig_init(struct rig *rig)
{
	memset(rig, 0, sizeof(*rig));
	rig->now_ns = 1000 * RIG_MS;
	exchange_init(&rig->exchange, 7);
	table_set_parameters(&rig->values);
	rig->daemon.epoch = RIG_EPOCH;
	rig->daemon.period_ns = RIG_MS;
	rig->daemon.stale_after_ns = 5 * RIG_MS;
	rig->daemon.link = POKEYS_LINK_RUNNING;
	rig->daemon.capability.pulse_engine = 2;
	rig->daemon.flags = POKEYS_STATE_COMMANDER;
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		rig->daemon.engine.axis[i].mode = POKEYS_AXIS_POSITION;
}

/* What a daemon does in a cycle, as far as the exchange can see. */
static inline void rig_daemon(struct rig *rig)
{
	if (rig->daemon_dead)
		return;
	rig->daemon.cycle++;
	rig->daemon.t_publish_ns = rig->now_ns;
	rig->daemon.one_shot_session = rig->exchange.command.session;
	if (rig->device_silent)
		return;
	rig->daemon.t_digital_ns = rig->now_ns - 200000;
	rig->daemon.t_motion_ns = rig->now_ns - 100000;
	for (unsigned int i = 0; i < POKEYS_ENCODERS; i++)
		rig->daemon.encoder_t_ns[i] = rig->daemon.t_digital_ns;
}

static inline void rig_read(struct rig *rig)
{
	*exchange_spare(&rig->exchange) = rig->daemon;
	rig->exchange.state = exchange_spare(&rig->exchange);
	exchange_read(&rig->exchange, &rig->values, EXCHANGE_STATE, rig->now_ns);
}

static inline void rig_write(struct rig *rig)
{
	exchange_write(&rig->exchange, &rig->values, rig->now_ns, RIG_MS);
	exchange_written(&rig->exchange, true);
}

/* One servo period: the daemon publishes, we read and write. */
static inline void rig_period(struct rig *rig)
{
	rig->now_ns += RIG_MS;
	rig_daemon(rig);
	if (!rig->unread)
		rig_read(rig);
	rig_write(rig);
}

static inline void rig_periods(struct rig *rig, unsigned int count)
{
	while (count--)
		rig_period(rig);
}

/* One refusal is to be said, with this text, where these names are loaded. */
static inline void rig_expect_note(struct rig *rig, unsigned int names, const char *text)
{
	struct refusal_note note;
	char line[256];

	assert_true(refusal_take(&rig->exchange.refusals, &note));
	refusal_line(&note, "pokeys.0", names, line, sizeof(line));
	assert_non_null(strstr(line, text));
	assert_false(refusal_take(&rig->exchange.refusals, &note));
}

/* With the older scheme's names, a few periods on. */
static inline void rig_init_older(struct rig *rig)
{
	rig_init(rig);
	rig->exchange.legacy.on = true;
	rig_periods(rig, 2);
}

/* As a machine of the older component has axis 0. */
static inline void rig_drive_older(struct rig *rig)
{
	rig->exchange.legacy.linked[0] = true;
	rig->values.legacy.axis_set[0].enabled = 1;
	rig->values.machine_is_on = true;
}

/* The daemon says how a one-shot ended, and the task that it began is over. */
static inline void rig_end(struct rig *rig, uint32_t id, enum pokeys_outcome outcome,
			   enum pokeys_task_result result)
{
	rig->daemon.one_shot[id % POKEYS_ONE_SHOT_RESULTS] = (struct pokeys_one_shot_result){
		.id = id,
		.outcome = (uint8_t)outcome,
		.operation = rig->exchange.command.one_shot[id % POKEYS_ONE_SHOTS].operation,
	};
	rig->daemon.one_shot_ack = id + 1;
	rig->daemon.engine.task_result = (uint8_t)result;
	rig->daemon.engine.task_phase = POKEYS_TASK_IDLE;
	rig_periods(rig, 2);
}

#endif
