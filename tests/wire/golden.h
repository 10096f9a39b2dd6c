/* SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef TESTS_WIRE_GOLDEN_H
#define TESTS_WIRE_GOLDEN_H

/*
 * What each row of golden-packets.tsv means, in values written by hand from
 * protocol section 7 and the description of the call. Never derived from our
 * own decoder: a wrong offset would then agree with itself.
 */

#include "wire/bus.h"
#include "wire/encoder.h"
#include "wire/io.h"
#include "wire/model.h"
#include "wire/panel.h"
#include "wire/pulse.h"
#include "wire/system.h"

enum golden_kind {
	GOLDEN_PACKET,    /* req and rep are structs of the operation */
	GOLDEN_MULTI,     /* req is struct golden_multi, rep wire_pulse_fill_rep */
	GOLDEN_DISCOVERY, /* rep is struct wire_discovery */
};

struct golden {
	const char *name; /* first column */
	enum golden_kind kind;
	enum wire_op op;
	const void *req; /* NULL where there is nothing */
	const void *rep; /* NULL where there is nothing, or no reply */
};

/* The bytes of a multi-part fill in the rows count up from 0, len of them. */
struct golden_multi {
	struct wire_multi fill;
	size_t len;
};

/* Tables, each ended by a row without name. */
extern const struct golden golden_system[];
extern const struct golden golden_io[];
extern const struct golden golden_encoder[];
extern const struct golden golden_pulse[];
extern const struct golden golden_bus[];
extern const struct golden golden_panel[];

#define G(name_, OP, req_, rep_) \
	{ .name = (name_), .kind = GOLDEN_PACKET, .op = WIRE_OP_##OP, .req = (req_), \
	  .rep = (rep_) }
#define V(tag, ...) &(const struct wire_##tag){ __VA_ARGS__ }
#define PIN(n) (UINT64_C(1) << ((n) - 1))
#define X4(v) v, v, v, v
#define X8(v) X4(v), X4(v)

#endif
