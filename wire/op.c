/* SPDX-License-Identifier: MIT */
/*
 * The operation table, and what follows from a row: the request's class, and
 * whether a reply belongs to a request.
 *
 * Class is a property of a packet, not of an operation: the same operation
 * reads or writes by a byte the device chose differently each time, and the
 * mailbox must know before it repeats anything. Reply matching compares the
 * operation as well as the id, which the vendor's library does not: with
 * eight bits of id and 3000 packets a second an id comes round every 85 ms
 * (protocol section 1.4). Echoes are demanded only where a device is known to
 * give them: one rule too many would cut off a real machine.
 */

#include "wire/op.h"
#include "wire/layout.h"

#define DECLARE(NAME, name, id, sub, class, rule, flags, req, rep) \
	extern const struct wire_layout wire_layout_##req; \
	extern const struct wire_layout wire_layout_##rep;
WIRE_OPS(DECLARE)
#undef DECLARE

const struct wire_layout wire_layout_nothing = { .size = sizeof(struct wire_nothing) };

#define ROW(NAME, name_, id_, sub_, class_, rule_, flags_, req_, rep_) \
	[WIRE_OP_##NAME] = { \
		.op = WIRE_OP_##NAME, .name = #name_, .id = (id_), .sub = sub_, \
		.class = (class_), .rule = rule_, .flags = (flags_), \
		.req = &wire_layout_##req_, .rep = &wire_layout_##rep_, \
	},
static const struct wire_op_row rows[WIRE_OP_COUNT] = { WIRE_OPS(ROW) };
#undef ROW

const struct wire_op_row *wire_op(enum wire_op op)
{
	return (unsigned int)op < WIRE_OP_COUNT ? &rows[op] : NULL;
}

static bool has_sub(const struct wire_op_row *row, uint8_t p1)
{
	return !row->sub.where || (p1 >= row->sub.first && p1 <= row->sub.last);
}

const struct wire_op_row *wire_op_find(uint8_t id, uint8_t p1)
{
	for (unsigned int i = 0; i < WIRE_OP_COUNT; i++) {
		if (rows[i].id == id && has_sub(&rows[i], p1))
			return &rows[i];
	}
	return NULL;
}

static enum wire_class ultra_class(const uint8_t *req)
{
	if (req[WIRE_AT_P1] == 0xFF)
		return WIRE_READ;
	return req[WIRE_AT_P3] ? WIRE_ONE_SHOT : WIRE_WRITE;
}

enum wire_class wire_request_class(const struct wire_op_row *row, const uint8_t req[WIRE_PK])
{
	const uint8_t v = req[row->rule.at];
	bool holds = true;

	switch ((enum wire_rule_kind)row->rule.kind) {
	case WIRE_RULE_ALWAYS:
		break;
	case WIRE_RULE_EQ:
		holds = v == row->rule.value;
		break;
	case WIRE_RULE_NE:
		holds = v != row->rule.value;
		break;
	case WIRE_RULE_GE:
		holds = v >= row->rule.value;
		break;
	case WIRE_RULE_LT:
		holds = v < row->rule.value;
		break;
	case WIRE_RULE_PIN_ALL:
		holds = req[WIRE_AT_P1] == 1 || req[WIRE_AT_P2] == 2;
		break;
	case WIRE_RULE_ULTRA:
		return ultra_class(req);
	case WIRE_RULE_STATE:
		return req[WIRE_AT_P2] ? WIRE_ONE_SHOT : WIRE_WRITE;
	}
	return holds ? row->class : WIRE_READ;
}

static bool echoes(const struct wire_op_row *row, const uint8_t *req, const uint8_t *rep)
{
	if ((row->flags & WIRE_P1) && rep[WIRE_AT_P1] != req[WIRE_AT_P1])
		return false;
	return !(row->flags & WIRE_P2) || rep[WIRE_AT_P2] == req[WIRE_AT_P2];
}

enum wire_reason wire_match_reply(const struct wire_op_row *row, const uint8_t req[WIRE_PK],
				  const uint8_t rep[WIRE_PK])
{
	if (rep[WIRE_AT_ID] != req[WIRE_AT_ID])
		return WIRE_ID;
	if (rep[WIRE_AT_OP] != req[WIRE_AT_OP])
		return WIRE_OPERATION;
	if (!echoes(row, req, rep))
		return WIRE_ECHO;
	if ((row->flags & WIRE_CHECK) &&
	    rep[WIRE_AT_CHECK] != (uint8_t)(WIRE_CHECK_BASE + req[WIRE_AT_P2]))
		return WIRE_CHECK_BYTE;
	return WIRE_OK;
}

static void encode(const struct wire_op_row *row, uint8_t *p, uint8_t magic)
{
	memset(p, 0, WIRE_PK);
	p[WIRE_AT_MAGIC] = magic;
	p[WIRE_AT_OP] = row->id;
	if (row->sub.where && !(magic == WIRE_REPLY && (row->flags & WIRE_BARE)))
		p[row->sub.where] = row->sub.first;
}

void wire_encode_req(enum wire_op op, uint8_t p[WIRE_PK], const void *value)
{
	encode(&rows[op], p, WIRE_REQUEST);
	wire_pack(rows[op].req, p, value);
}

void wire_decode_req(enum wire_op op, const uint8_t p[WIRE_PK], void *value)
{
	wire_unpack(rows[op].req, p, value);
}

void wire_encode_rep(enum wire_op op, uint8_t p[WIRE_PK], const void *value)
{
	encode(&rows[op], p, WIRE_REPLY);
	wire_pack(rows[op].rep, p, value);
}

void wire_decode_rep(enum wire_op op, const uint8_t p[WIRE_PK], void *value)
{
	wire_unpack(rows[op].rep, p, value);
}
