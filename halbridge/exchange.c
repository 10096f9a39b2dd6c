/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The exchange: what each period does, and what it must never do.
 *
 * Reading: the connection is judged first; only fresh data reach the pins, so
 * that pins never mix one cycle with another and keep their last values when
 * the device is silent. Identity is taken as soon as it is known.
 *
 * Writing: the command image holds wishes, so it is filled completely each
 * time. Outputs: exactly those pins that the device has configured as outputs
 * are commanded, with the value of their .out pin, connected or not; a pin
 * that is an input there stays untouched whatever its .out pin says. No value
 * that is not a number gets into the image.
 *
 * Another daemon than before: a new one-shot session begins, see one_shot.c.
 */
#include "halbridge/exchange.h"
#include <stddef.h>
#include <string.h>

#define VOLTS_PER_COUNT	(3.3 / 4096)	/* protocol section 3.6 */

void exchange_init(struct exchange *exchange, uint32_t session)
{
	memset(exchange, 0, sizeof(*exchange));
	link_init(&exchange->link);
	one_shot_begin(&exchange->queue, &exchange->command, session);
	for (unsigned int i = 0; i < POKEYS_ENCODERS; i++)
		encoder_init(&exchange->encoder[i]);
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		joint_init(&exchange->joint[i]);
	for (unsigned int i = 0; i < POKEYS_ANALOG; i++) {
		exchange->analog_scale[i] = (struct factor){ .used = 1, .seen = 1 };
		exchange->analog_offset[i] = (struct factor){ .may_be_zero = true };
	}
}

static void read_pins(struct values *values, const struct pokeys_state *state)
{
	for (unsigned int i = 0; i < POKEYS_PINS; i++) {
		bool in = state->digital_in[i / 8] >> i % 8 & 1;

		values->pin.in[i] = in;
		values->pin.in_not[i] = !in;
	}
}

static void read_analog(struct exchange *exchange, struct values *values, unsigned int i,
			bool fresh)
{
	const size_t at = offsetof(struct values, analog) + i * sizeof(struct value_analog);
	struct value_analog *value = &values->analog[i];
	double scale = factor_take(&exchange->analog_scale[i], &exchange->refusals, value->scale,
				   at + offsetof(struct value_analog, scale));
	double offset = factor_take(&exchange->analog_offset[i], &exchange->refusals,
				    value->offset, at + offsetof(struct value_analog, offset));

	if (!fresh)
		return;
	value->raw = exchange->state.analog[i];
	value->value = value->raw * VOLTS_PER_COUNT * scale - offset;
}

static void read_encoders(struct exchange *exchange, struct values *values, bool fresh,
			  uint64_t now_ns)
{
	for (unsigned int i = 0; i < POKEYS_ENCODERS; i++) {
		struct encoder *encoder = &exchange->encoder[i];
		struct value_encoder *value = &values->encoder[i];

		if (fresh && encoder_index_read(encoder, value, i, &exchange->state,
						&exchange->queue, now_ns, &exchange->refusals))
			values->one_shot_failed_count++;
		encoder_read(encoder, value, i, &exchange->state, fresh, &exchange->refusals);
	}
}

static void read_machine(struct exchange *exchange, struct values *values, bool fresh)
{
	const struct pokeys_state *state = &exchange->state;
	uint32_t flags = fresh ? state->flags : 0;

	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		joint_settings(&exchange->joint[i], &values->joint[i], i, &exchange->refusals);
	values->machine_on_permitted = flags & POKEYS_STATE_MACHINE_ON;
	values->needs_edge = flags & POKEYS_STATE_NEEDS_EDGE;
	values->commander = values->daemon_alive && exchange->written &&
			    state->flags & POKEYS_STATE_COMMANDER;
	if (!exchange->have_state)
		return;
	values->safe_state = state->flags & POKEYS_STATE_SAFE;
	values->command_refused = state->flags & POKEYS_STATE_BAD_COMMAND;
	values->command_refused_count = (uint32_t)state->statistics.refused_command;
	if (!fresh)
		return;
	values->engine.state = state->engine.state;
	values->engine.emergency = state->engine.emergency;
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		joint_read(&exchange->joint[i], &values->joint[i], &state->engine.axis[i]);
}

static void take_news(struct exchange *exchange, const struct link_news *news)
{
	if (news->new_daemon)
		one_shot_begin(&exchange->queue, &exchange->command, exchange->queue.session + 1);
	for (unsigned int i = 0; i < POKEYS_ENCODERS; i++) {
		if (news->rebooted)
			encoder_rebooted(&exchange->encoder[i]);
		else if (news->new_daemon)
			encoder_index_forget(&exchange->encoder[i]);
	}
	one_shot_acknowledge(&exchange->queue, &exchange->state);
}

void exchange_read(struct exchange *exchange, struct values *values, enum exchange_got got,
		   uint64_t now_ns)
{
	struct link_news news;

	exchange->have_state = got == EXCHANGE_STATE;
	exchange->t_read_ns = now_ns;
	news = link_read(&exchange->link, values, exchange->have_state ? &exchange->state : NULL,
			 got == EXCHANGE_REFUSED, now_ns, &exchange->refusals);
	exchange->fresh = news.fresh;
	if (exchange->have_state) {
		take_news(exchange, &news);
		info_read(&exchange->known, values, &exchange->state);
	}
	if (news.fresh)
		read_pins(values, &exchange->state);
	for (unsigned int i = 0; i < POKEYS_ANALOG; i++)
		read_analog(exchange, values, i, news.fresh);
	read_encoders(exchange, values, news.fresh, now_ns);
	read_machine(exchange, values, news.fresh);
	values->changed = UINT32_MAX;
}

static void write_pins(struct exchange *exchange, const struct values *values)
{
	struct pokeys_command *command = &exchange->command;
	uint64_t outputs = 0;

	for (unsigned int i = 0; i < POKEYS_PINS; i++)
		outputs |= (uint64_t)values->pin.out[i] << i;
	for (unsigned int i = 0; i < POKEYS_PIN_BYTES; i++)
		command->digital_out[i] = (uint8_t)(outputs >> 8 * i);
	memcpy(command->digital_out_mask, exchange->state.digital_out_owned,
	       sizeof(command->digital_out_mask));
}

static void write_index(struct exchange *exchange, struct values *values, uint64_t now_ns)
{
	bool full = false;

	for (unsigned int i = 0; exchange->fresh && i < POKEYS_ENCODERS; i++)
		full |= !encoder_index_write(&exchange->encoder[i], &values->encoder[i], i,
					     &exchange->queue, &exchange->command, now_ns);
	values->one_shot_full = full;
}

void exchange_write(struct exchange *exchange, struct values *values, uint64_t now_ns,
		    uint64_t period_ns)
{
	struct pokeys_command *command = &exchange->command;

	command->heartbeat++;
	command->t_ns = now_ns;
	command->t_thread_ns = exchange->t_read_ns;
	command->period_ns = period_ns;
	command->flags = values->machine_is_on ? POKEYS_COMMAND_MACHINE_ON : 0;
	write_pins(exchange, values);
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		joint_write(&exchange->joint[i], &values->joint[i], i, &command->axis[i],
			    &exchange->refusals);
	write_index(exchange, values, now_ns);
	values->input_refused = exchange->refusals.now;
	values->input_refused_count = exchange->refusals.total;
}

void exchange_written(struct exchange *exchange, bool taken)
{
	exchange->written = taken;
}
