/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What the older scheme's names do beyond the canonical ones they stand beside.
 * Part of the exchange, and pure as it is: called by it after its own work.
 */
#ifndef HALBRIDGE_LEGACY_H
#define HALBRIDGE_LEGACY_H

#include <stdbool.h>
#include <stdint.h>
#include <pokeys/command.h>
#include <pokeys/state.h>
#include "halbridge/legacy_home.h"
#include "halbridge/refusal.h"
#include "halbridge/values.h"

struct exchange;

struct legacy {
	bool on;                  /* the scheme is exported */
	bool linked[POKEYS_AXES]; /* PEv2.N.joint-pos-cmd is: it drives the axis */
	/* clock */
	uint32_t reads, second, minute, waited;
	bool clock_known, waiting;
	uint64_t second_ns;
	/* encoders */
	struct factor encoder_scale[LEGACY_ENCODERS];
	bool encoder_factor; /* the choice, as last seen */
	/* buses */
	uint32_t brightness;
	bool brightness_known;
	/* analog outputs */
	bool value_bad[POKEYS_PWM];
	bool external_used; /* an external relay or output has been true */
	/* axes */
	struct legacy_home home[POKEYS_AXES];
	uint8_t mode[POKEYS_AXES];
	int32_t preset[POKEYS_AXES]; /* PositionSetup, as last acted upon */
	/* one-shots whose end is not known yet, bit = place in asked_id */
	uint64_t asked;
	uint32_t asked_id[POKEYS_ONE_SHOTS], asked_session;
	/* engine */
	uint32_t power_shown;
	uint64_t clear_ns; /* a fault is not cleared again before */
};

/* Begin; off until `on` is set. Cold. */
void legacy_init(struct legacy *legacy);

/* At the end of exchange_read. Realtime. */
void legacy_read(struct exchange *exchange, struct values *values, uint64_t now_ns);

/* Before the joints are written: who may move. Realtime. */
void legacy_enable(struct exchange *exchange, const struct values *values);

/* At the end of exchange_write, over the command it has made. Realtime. */
void legacy_write(struct exchange *exchange, struct values *values, uint64_t now_ns);

/* Queue it, its id to *id; how it ends will be counted. False: there is no room now. Realtime. */
bool legacy_ask(struct exchange *exchange, const struct pokeys_one_shot *shot, uint32_t *id);

/* How many of them are known since the last call to have ended badly. Realtime. */
uint32_t legacy_failed(struct exchange *exchange);

/* Parts of the above, a file each. */
void legacy_read_axes(struct exchange *exchange, struct values *values);
void legacy_read_engine(struct exchange *exchange, struct values *values, bool fresh);
void legacy_write_outputs(struct exchange *exchange, struct values *values);
void legacy_write_engine(struct exchange *exchange, struct values *values, uint64_t now_ns);

#endif
