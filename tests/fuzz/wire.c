/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Every decoder of wire/ over arbitrary bytes: whatever arrives, nothing is
 * read outside the packet (the sanitizers watch a buffer of exactly its
 * length), no count exceeds its array, and a value once decoded is encoded to
 * something which decodes to the same.
 */

#include <stdlib.h>

#include "wire/bus.h"
#include "wire/layout.h"
#include "wire/model.h"
#include "wire/pulse.h"

#define STRUCT_MAX 512

static void hold(bool fact)
{
	if (!fact)
		abort();
}

static void counts_are_limited(const struct wire_layout *layout, const uint8_t *value)
{
	for (unsigned int i = 0; i < layout->count; i++) {
		const struct wire_field *f = &layout->fields[i];

		for (unsigned int rep = 0; f->max && rep < f->reps; rep++)
			hold(value[f->offset + rep * f->step] <= f->max);
	}
}

static void one_operation(enum wire_op op, const uint8_t *p)
{
	const struct wire_op_row *row = wire_op(op);
	uint8_t a[STRUCT_MAX], b[STRUCT_MAX], q[WIRE_PK];

	hold(row->req->size <= STRUCT_MAX && row->rep->size <= STRUCT_MAX);
	wire_decode_req(op, p, a);
	counts_are_limited(row->req, a);
	wire_encode_req(op, q, a);
	wire_decode_req(op, q, b);
	hold(!memcmp(a, b, row->req->size));

	wire_decode_rep(op, p, a);
	counts_are_limited(row->rep, a);
	wire_encode_rep(op, q, a);
	wire_decode_rep(op, q, b);
	hold(!memcmp(a, b, row->rep->size));

	hold(wire_request_class(row, p) <= WIRE_ONE_SHOT);
	hold(wire_match_reply(row, p, q) < WIRE_REASONS);
}

static void slots(const uint8_t *data, size_t len, uint8_t width, uint8_t count, uint8_t axes)
{
	const bool fits = wire_fill_fits(width, count, axes, len);

	for (unsigned int slot = 0; slot < count; slot++) {
		for (unsigned int axis = 0; axis < axes; axis++) {
			const int steps = wire_slot_get(data, len, width, axes, slot, axis);

			hold(abs(steps) <= WIRE_SLOT16_MAX);
		}
	}
	hold(!fits || (size_t)count * axes * (width == WIRE_SLOTS_16BIT ? 2 : 1) <= len);
}

static void packet(const uint8_t *p)
{
	struct wire_device_data_rep data;
	struct wire_device_name_rep name;
	struct wire_pulse_fill_req fill;
	struct wire_ponet_data_rep keys;
	struct wire_identity identity;
	char label[21];

	for (unsigned int op = 0; op < WIRE_OP_COUNT; op++)
		one_operation((enum wire_op)op, p);
	wire_device_data_decode_rep(p, &data);
	wire_identify(&data, &identity);
	hold(identity.model && identity.model->name);
	wire_device_name_decode_rep(p, &name);
	wire_device_label(&name, label);
	hold(strlen(label) <= 20);
	wire_pulse_fill8_decode_req(p, &fill);
	slots(fill.data, sizeof(fill.data), p[0], fill.slots, fill.axes);
	wire_ponet_data_decode_rep(p, &keys);
	hold(wire_kbd48_keys(keys.data) >> WIRE_KBD48_KEYS == 0);
}

static void multi(const uint8_t *p)
{
	uint8_t data[WIRE_MULTI_DATA], q[WIRE_MULTI_BYTES];
	struct wire_multi fill;

	if (!wire_multi_parse(p, &fill, data))
		return;
	slots(data, sizeof(data), fill.width, fill.slots, fill.axes);
	hold(wire_multi_build(q, wire_packet_id(p), &fill, data, sizeof(data)));
	/* the numbers in later parts do not count, everything else must be the same */
	hold(!memcmp(p, q, WIRE_PK));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t len);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t len)
{
	uint8_t *exact = malloc(len ? len : 1);
	struct wire_discovery discovery;

	hold(exact != NULL);
	if (len)
		memcpy(exact, data, len);
	hold(wire_check_reply(exact, len) < WIRE_REASONS);
	hold(wire_check_request(exact, len) < WIRE_REASONS);
	wire_discovery_decode(exact, len, &discovery);
	if (len == WIRE_PK)
		packet(exact);
	if (len == WIRE_MULTI_BYTES)
		multi(exact);
	free(exact);
	return 0;
}
