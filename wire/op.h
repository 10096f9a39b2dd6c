/* SPDX-License-Identifier: MIT */
#ifndef WIRE_OP_H
#define WIRE_OP_H

/*
 * Operations (protocol sections 1.10 to 3.24 and 4): their enum, their rows,
 * and the functions made from them. The table itself is wire/ops.h.
 *
 * A row names an operation, says how to tell it from others, in which class
 * of the mailbox it falls, what its reply must echo, and which struct its
 * request and its reply have. Enum, table, and the typed functions of the
 * subject headers are generated from the rows, so a new operation is one row
 * there, a struct in its header and a layout in its .c file.
 *
 *   header            operations
 *   wire/system.h     identification, network, security, failsafe, clock, log
 *   wire/io.h         pins, digital, analog, counters, PWM, 0xCC
 *   wire/encoder.h    encoders
 *   wire/pulse.h      pulse engine v2 (0x85 and 0xB0)
 *   wire/bus.h        PoExtBus, PoNET, I2C, 1-Wire, SPI, UART, CAN, sensors
 *   wire/panel.h      matrix keyboard, matrix LED, LCD, LED strip
 *
 * For a row X(NAME, name, ...) with request struct REQ and reply struct REP
 * there are, in the subject's header:
 *
 *   wire_<name>_encode_req(uint8_t p[64], const struct wire_<REQ> *)
 *   wire_<name>_decode_req(const uint8_t p[64], struct wire_<REQ> *)
 *   wire_<name>_encode_rep(uint8_t p[64], const struct wire_<REP> *)
 *   wire_<name>_decode_rep(const uint8_t p[64], struct wire_<REP> *)
 *
 * REQ is <name>_req and REP is <name>_rep unless operations share a layout;
 * a row with "nothing" carries no fields and its functions take NULL too.
 * Encode writes all 64 bytes; wire_finish() then sets request id and
 * checksum. Decode fills the whole struct, padding included, reads only the
 * 64 bytes, and limits every count to what its array holds; it does not
 * validate (wire_check_reply(), wire_match_reply() do).
 *
 * All functions are realtime safe: bounded loops, no allocation, no state.
 */

#include "wire/packet.h"

/* How the mailbox may repeat a request. */
enum wire_class {
	WIRE_READ,     /* changes nothing: resend freely */
	WIRE_WRITE,    /* twice is as good as once: resend the newest value */
	WIRE_ONE_SHOT, /* never twice unless known not to have been executed */
};

/* Where an operation's sub-id sits. A range is one layout under many ids. */
struct wire_sub {
	uint8_t where;       /* 0: none, WIRE_AT_P1: byte @2 */
	uint8_t first, last; /* inclusive */
};

#define WIRE_NO_SUB { 0, 0, 0 }
#define WIRE_SUB(id) { WIRE_AT_P1, (id), (id) }
#define WIRE_SUBS(first, last) { WIRE_AT_P1, (first), (last) }

/*
 * When a request of this row is of the row's class; otherwise it is a mere
 * read. The device puts "read or write" into different bytes for each
 * operation, this says into which.
 */
enum wire_rule_kind {
	WIRE_RULE_ALWAYS,
	WIRE_RULE_EQ,      /* p[at] == value */
	WIRE_RULE_NE,      /* p[at] != value */
	WIRE_RULE_GE,      /* p[at] >= value */
	WIRE_RULE_LT,      /* p[at] < value */
	WIRE_RULE_PIN_ALL, /* 0xC0: p1 == 1 or p2 == 2 */
	WIRE_RULE_ULTRA,   /* 0x1C: one-shot only when it arms the index reset */
	WIRE_RULE_STATE,   /* 0x85/02: stopping may be repeated, starting not */
};

struct wire_rule {
	uint8_t kind, at, value;
};

#define WIRE_ALWAYS { WIRE_RULE_ALWAYS, 0, 0 }
#define WIRE_IF_EQ(at, value) { WIRE_RULE_EQ, (at), (value) }
#define WIRE_IF_NE(at, value) { WIRE_RULE_NE, (at), (value) }
#define WIRE_IF_GE(at, value) { WIRE_RULE_GE, (at), (value) }
#define WIRE_IF_LT(at, value) { WIRE_RULE_LT, (at), (value) }
#define WIRE_IF_PIN_ALL { WIRE_RULE_PIN_ALL, 0, 0 }
#define WIRE_IF_ULTRA { WIRE_RULE_ULTRA, 0, 0 }
#define WIRE_IF_STATE { WIRE_RULE_STATE, 0, 0 }

/* What a reply must repeat of its request, where the device is known to. */
enum wire_flags {
	WIRE_P1 = 1,        /* reply @2 == request @2 */
	WIRE_P2 = 2,        /* reply @3 == request @3 */
	WIRE_CHECK = 4,     /* reply @63 == 0x5A + request @3 */
	WIRE_BARE = 8,      /* the device does not put the sub-id into the reply */
	WIRE_NO_REPLY = 16, /* the device never answers this request */
};

#include "wire/ops.h"

#define WIRE_OP_ENUM(NAME, name, id, sub, class, rule, flags, req, rep) WIRE_OP_##NAME,
enum wire_op { WIRE_OPS(WIRE_OP_ENUM) WIRE_OP_COUNT };
#undef WIRE_OP_ENUM

struct wire_layout; /* wire/layout.h */

struct wire_op_row {
	enum wire_op op;
	const char *name; /* "pulse_status" */
	uint8_t id;       /* @1 */
	struct wire_sub sub;
	enum wire_class class; /* of a request for which rule holds */
	struct wire_rule rule;
	uint8_t flags; /* enum wire_flags */
	const struct wire_layout *req;
	const struct wire_layout *rep;
};

/* The row of an operation; NULL when op is out of range. */
const struct wire_op_row *wire_op(enum wire_op op);

/* The row for bytes @1 and @2 of a request; NULL when there is none. */
const struct wire_op_row *wire_op_find(uint8_t id, uint8_t p1);

/* The class of this very request: a row's class, or WIRE_READ by its rule. */
enum wire_class wire_request_class(const struct wire_op_row *row, const uint8_t req[WIRE_PK]);

/*
 * Whether a reply, already good by wire_check_reply(), answers the request:
 * request id, operation, and what the row says is echoed, in that order. For
 * a multi-part fill req is the last part (protocol section 1.6).
 */
enum wire_reason wire_match_reply(const struct wire_op_row *row, const uint8_t req[WIRE_PK],
				  const uint8_t rep[WIRE_PK]);

/*
 * The untyped pair below the typed functions. value is the row's struct, or
 * NULL where the row has "nothing". op must be below WIRE_OP_COUNT.
 */
void wire_encode_req(enum wire_op op, uint8_t p[WIRE_PK], const void *value);
void wire_decode_req(enum wire_op op, const uint8_t p[WIRE_PK], void *value);
void wire_encode_rep(enum wire_op op, uint8_t p[WIRE_PK], const void *value);
void wire_decode_rep(enum wire_op op, const uint8_t p[WIRE_PK], void *value);

/* The struct of requests and replies without fields; pass NULL. */
struct wire_nothing {
	uint8_t unused;
};

/* Generates the four typed functions of one row; used by the subject headers. */
#define WIRE_TYPED(NAME, name, id, sub, class, rule, flags, req, rep) \
	static inline void wire_##name##_encode_req(uint8_t p[WIRE_PK], \
						    const struct wire_##req *value) \
	{ \
		wire_encode_req(WIRE_OP_##NAME, p, value); \
	} \
	static inline void wire_##name##_decode_req(const uint8_t p[WIRE_PK], \
						    struct wire_##req *value) \
	{ \
		wire_decode_req(WIRE_OP_##NAME, p, value); \
	} \
	static inline void wire_##name##_encode_rep(uint8_t p[WIRE_PK], \
						    const struct wire_##rep *value) \
	{ \
		wire_encode_rep(WIRE_OP_##NAME, p, value); \
	} \
	static inline void wire_##name##_decode_rep(const uint8_t p[WIRE_PK], \
						    struct wire_##rep *value) \
	{ \
		wire_decode_rep(WIRE_OP_##NAME, p, value); \
	}

#endif
