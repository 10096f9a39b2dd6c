/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The exchange: what each period does, and what it must never do.
 *
 * Reading: the connection is judged first; only fresh data reach the pins, so
 * that pins never mix one cycle with another and keep their last values when
 * the device is silent. Identity is taken as soon as it is known. Each part
 * compares its piece of the image with the one before and marks its block of
 * values when it has changed: most of a machine stands still most of the time.
 *
 * Writing: the command image holds wishes, so it is filled completely each
 * time. No value that is not a number gets into it.
 *
 * Another daemon than before: a new one-shot session begins, see one_shot.c.
 *
 * A write that no read goes before commands from positions that are not those of the
 * axes: pos-fb stands still, or is 0, and LinuxCNC's command follows it. So after a few
 * of them machine-on and the axes' enables are not passed on, nothing is pressed, and
 * machine-is-on has to fall and rise again afterwards. Whether what was read was
 * fresh, the daemon asks at the edge.
 */
#include "halbridge/exchange.h"
#include <stddef.h>
#include <string.h>
#include "halbridge/clock.h"
#include "halbridge/diagnose.h"
#include "halbridge/engine.h"
#include "halbridge/news.h"

#define VOLTS_PER_COUNT	(3.3 / 4096)	/* protocol section 3.6 */

enum { DIAGNOSE_EVERY = 16 }; /* periods, a power of 2 */

void exchange_init(struct exchange *exchange, uint32_t session)
{
	memset(exchange, 0, sizeof(*exchange));
	exchange->state = &exchange->image[0];
	link_init(&exchange->link);
	one_shot_begin(&exchange->queue, &exchange->command, session);
	keys_init(&exchange->keys);
	pwm_init(&exchange->pwm);
	legacy_init(&exchange->legacy);
	joint_home_init(&exchange->home);
	probe_init(&exchange->probe);
	threading_init(&exchange->threading);
	heaters_init(&exchange->heaters);
	servos_init(&exchange->servos);
	for (unsigned int i = 0; i < POKEYS_ENCODERS; i++)
		encoder_init(&exchange->encoder[i]);
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		joint_init(&exchange->joint[i]);
	for (unsigned int i = 0; i < POKEYS_ANALOG; i++) {
		exchange->analog_scale[i] = (struct factor){ .used = 1, .seen = 1 };
		exchange->analog_offset[i] = (struct factor){ .may_be_zero = true };
	}
}

static void read_analog(struct exchange *exchange, struct values *values, unsigned int i,
			bool fresh)
{
	const size_t at = offsetof(struct values, analog) + i * sizeof(struct value_analog);
	struct value_analog *value = &values->analog[i];
	double scale = factor_take(&exchange->analog_scale[i], &exchange->refusals, value->scale,
				   at + offsetof(struct value_analog, scale));
	double offset = factor_take(&exchange->analog_offset[i], &exchange->refusals, value->offset,
				    at + offsetof(struct value_analog, offset));
	double shown;

	if (!fresh)
		return;
	shown = exchange->state->analog[i] * VOLTS_PER_COUNT * scale - offset;
	if (shown == value->value && value->raw == exchange->state->analog[i])
		return;
	value->raw = exchange->state->analog[i];
	value->value = shown;
	values_changed(values, BLOCK_ANALOG);
}

/* Returns true if that has changed the pin. */
static bool read_index(struct exchange *exchange, struct values *values, unsigned int i,
		       uint64_t now_ns)
{
	struct value_encoder *value = &values->encoder[i];
	bool wanted = value->index_enable;

	if (encoder_index_read(&exchange->encoder[i], value, i, exchange->state, &exchange->queue,
			       now_ns, &exchange->refusals))
		values->one_shot_failed_count++;
	return value->index_enable != wanted;
}

/* Returns true if that has changed a pin. */
static bool read_orders(struct exchange *exchange, struct values *values, unsigned int i,
			bool fresh, uint64_t now_ns)
{
	struct encoder *encoder = &exchange->encoder[i];
	const struct value_encoder *value = &values->encoder[i];
	const bool changed = fresh && !encoder_index_idle(encoder, value, i, exchange->state) &&
			     read_index(exchange, values, i, now_ns);

	if (!encoder_set_idle(encoder, value) &&
	    encoder_set_read(encoder, i, exchange->state, &exchange->queue))
		values->one_shot_failed_count++;
	encoder_settle(encoder);
	return changed;
}

static void read_encoders(struct exchange *exchange, struct values *values, bool fresh,
			  uint64_t now_ns)
{
	const struct pokeys_state *state = exchange->state;

	exchange->encoders_moved = 0;
	for (unsigned int i = 0; i < POKEYS_ENCODERS; i++) {
		struct encoder *encoder = &exchange->encoder[i];
		struct value_encoder *value = &values->encoder[i];
		bool changed = false;

		if (!encoder_is_quiet(encoder, value, i, state->encoder_index))
			changed = read_orders(exchange, values, i, fresh, now_ns);
		if (fresh &&
		    encoder_stands(encoder, value, state->encoder[i], state->encoder_t_ns[i]) &&
		    !changed)
			continue;
		changed |= encoder_read(encoder, value, i, state, fresh, &exchange->refusals);
		exchange->encoders_lost = (exchange->encoders_lost & ~(UINT32_C(1) << i)) |
					  (uint32_t)encoder->lost << i;
		if (!changed)
			continue;
		exchange->encoders_moved |= UINT32_C(1) << i;
		values_touched(values, encoder_member(i, 0), sizeof(*value));
	}
	values->encoder_count_lost = exchange->encoders_lost & state->encoder_enabled;
	if (fresh && news(&exchange->encoder_enabled, &state->encoder_enabled,
			  sizeof(exchange->encoder_enabled), false)) {
		for (unsigned int i = 0; i < POKEYS_ENCODERS; i++)
			values->encoder[i].enabled = state->encoder_enabled >> i & 1;
		values_changed(values, BLOCK_ENCODER);
	}
}

static void read_flags(struct exchange *exchange, struct values *values, bool fresh)
{
	const struct pokeys_state *state = exchange->state;
	uint32_t flags = fresh ? state->flags : 0;

	values->machine_on_permitted = flags & POKEYS_STATE_MACHINE_ON;
	values->needs_edge = flags & POKEYS_STATE_NEEDS_EDGE || exchange->machine_off;
	values->outputs_held = flags & POKEYS_STATE_OUTPUTS_HELD;
	values->commander = values->daemon_alive && exchange->written &&
			    state->flags & POKEYS_STATE_COMMANDER;
	values_changed(values, BLOCK_MACHINE);
	if (!exchange->have_state)
		return;
	values->safe_state = state->flags & POKEYS_STATE_SAFE;
	values->command_refused = state->flags & POKEYS_STATE_BAD_COMMAND;
	values->command_refused_count = (uint32_t)state->statistics.refused_command;
}

/* A joint's pins depend on the command and on the scale as well as on the engine. */
static void read_engine(struct exchange *exchange, struct values *values, bool fresh,
			bool restarted, uint64_t now_ns)
{
	const struct pokeys_engine *engine = &exchange->state->engine;
	bool changed = fresh &&
		       news(&exchange->engine, engine, sizeof(*engine), !exchange->engine_begun);

	if (changed)
		engine_read(values, engine);
	changed |= positions_read(&exchange->positions, exchange->joint, values, engine, fresh,
				  restarted, now_ns);
	legacy_enable(exchange, values);
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		changed |= joint_settings(&exchange->joint[i], &values->joint[i], i,
					  &exchange->refusals);
	exchange->joints_due |= changed || exchange->motion_type != values->motion_type;
	exchange->motion_type = values->motion_type;
	if (!fresh || !exchange->joints_due)
		return;
	exchange->engine_begun = true;
	exchange->joints_due = false;
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		joint_leave_out_delay(&exchange->joint[i], &values->joint[i], &engine->axis[i],
				      values->motion_type);
		joint_read(&exchange->joint[i], &values->joint[i], i, engine);
	}
	values_changed(values, BLOCK_JOINT);
}

/*
 * The daemon itself stops a motor whose encoder it could not read for as long. Before that, a pause
 * of the daemon is no reason to stop the machine.
 */
static bool moves_motors(const struct exchange *exchange, const struct values *values,
			 uint64_t now_ns)
{
	return values->daemon_alive ||
	       pokeys_age_ns(exchange->state->t_publish_ns, now_ns) <= POKEYS_SERVO_STALE_MOST_NS;
}

static void take_news(struct exchange *exchange, struct values *values,
		      const struct link_news *news, uint64_t now_ns)
{
	if (news->new_daemon) {
		exchange->resumed |= news->restarted;
		one_shot_begin(&exchange->queue, &exchange->command, exchange->queue.session + 1);
		buttons_forget(&exchange->buttons, values);
		joint_home_forget(&exchange->home, values);
		probe_forget(&exchange->probe, values);
		threading_forget(&exchange->threading, values);
		heaters_forget(&exchange->heaters, values);
		servos_forget(&exchange->servos, values);
	}
	for (unsigned int i = 0; i < POKEYS_ENCODERS; i++) {
		if (news->new_daemon &&
		    encoder_set_forget(&exchange->encoder[i], exchange->state->encoder_t_ns[i]))
			values->one_shot_failed_count++;
		if (news->counts_anew)
			encoder_restarted(&exchange->encoder[i], values->encoder_keep_count);
		else if (news->new_daemon)
			encoder_index_forget(&exchange->encoder[i]);
		if (news->silent_ns && values->encoder_keep_count)
			encoder_silent(&exchange->encoder[i], news->silent_ns);
	}
	one_shot_acknowledge(&exchange->queue, exchange->state);
	buttons_read(&exchange->buttons, values, &exchange->queue, exchange->state);
	joint_home_read(&exchange->home, values, &exchange->queue, exchange->state, news->fresh);
	probe_read(&exchange->probe, values, &exchange->queue, exchange->state, news->fresh);
	threading_read(&exchange->threading, values, &exchange->queue, exchange->state,
		       news->fresh);
	heaters_read(&exchange->heaters, values, &exchange->queue, exchange->state,
		     values->daemon_alive);
	servos_read(&exchange->servos, values, &exchange->queue, exchange->state,
		    moves_motors(exchange, values, now_ns));
}

/* For the daemon's histogram; more than four seconds are as good as four. */
static uint32_t read_age(const struct link *link, bool fresh, uint64_t now_ns)
{
	uint64_t age_ns = now_ns - link->data_ns;

	if (!fresh)
		return 0;
	return age_ns > UINT32_MAX ? UINT32_MAX : age_ns ? (uint32_t)age_ns : 1;
}

/* Nobody closes a loop over these. */
static void read_seldom(struct exchange *exchange, struct values *values, uint64_t now_ns)
{
	diagnose_read(values, exchange->state);
	motor_drive_read(&exchange->drive, values, exchange->state, now_ns);
}

void exchange_read(struct exchange *exchange, struct values *values, enum exchange_got got,
		   uint64_t now_ns)
{
	const struct pokeys_state *state = exchange->state;
	struct link_news news;

	exchange->have_state = got == EXCHANGE_STATE;
	if (exchange->have_state)
		exchange->t_read_ns = now_ns;
	exchange->unread_writes = 0;
	news = link_read(&exchange->link, values, exchange->have_state ? state : NULL,
			 got == EXCHANGE_REFUSED, now_ns, &exchange->refusals);
	values_changed(values, BLOCK_LINK);
	exchange->fresh = news.fresh;
	exchange->read_age_ns = read_age(&exchange->link, news.fresh, now_ns);
	if (exchange->have_state) {
		take_news(exchange, values, &news, now_ns);
		info_read(&exchange->known, values, state);
		if (exchange->reads++ % DIAGNOSE_EVERY == 0)
			read_seldom(exchange, values, now_ns);
	} else {
		servos_alone(values);
	}
	if (news.fresh) {
		digital_read(&exchange->digital, values, state);
		keys_read(&exchange->keys, values, state);
		pwm_read(&exchange->pwm, values, state);
		clock_read(&exchange->rtc, &exchange->rtc_begun, values, &state->rtc);
	}
	for (unsigned int i = 0; i < POKEYS_ANALOG; i++)
		read_analog(exchange, values, i, news.fresh);
	read_encoders(exchange, values, news.fresh, now_ns);
	read_flags(exchange, values, news.fresh);
	trouble_read(&exchange->trouble, values, state, news.fresh);
	read_engine(exchange, values, news.fresh, news.restarted, now_ns);
	legacy_read(exchange, values, now_ns);
}

/* Index and setting of a counter; returns true if the queue was full. */
static bool write_orders(struct exchange *exchange, struct values *values, unsigned int i,
			 uint64_t now_ns)
{
	struct encoder *encoder = &exchange->encoder[i];
	const struct value_encoder *value = &values->encoder[i];
	struct press_news news = { 0 };
	bool full = false;

	if (exchange->fresh && !encoder_index_idle(encoder, value, i, exchange->state))
		full = !encoder_index_write(encoder, value, i, &exchange->queue, &exchange->command,
					    now_ns);
	if (!encoder_set_idle(encoder, value))
		news = encoder_set_write(encoder, value, i, &exchange->queue, &exchange->command,
					 exchange->fresh);
	values->one_shot_failed_count += news.failed;
	encoder_settle(encoder);
	return full || news.full;
}

static bool write_encoders(struct exchange *exchange, struct values *values, uint64_t now_ns)
{
	const uint32_t index = exchange->state->encoder_index;
	bool full = false;

	for (unsigned int i = 0; i < POKEYS_ENCODERS; i++)
		if (!encoder_is_quiet(&exchange->encoder[i], &values->encoder[i], i, index))
			full |= write_orders(exchange, values, i, now_ns);
	return full;
}

static uint32_t flags_of(const struct exchange *exchange, const struct values *values)
{
	return (values->machine_is_on && !exchange->machine_off ? POKEYS_COMMAND_MACHINE_ON : 0u) |
	       (values->engine.limit_override ? POKEYS_COMMAND_LIMIT_OVERRIDE : 0u) |
	       (values->emergency_stop ? POKEYS_COMMAND_EMERGENCY : 0u) |
	       (exchange->resumed ? POKEYS_COMMAND_RESUMED : 0u);
}

/* Returns false if nobody reads. */
static bool judge_reading(struct exchange *exchange, struct values *values)
{
	const bool read = exchange->unread_writes < EXCHANGE_UNREAD_MOST;

	values->read_missing = !read;
	exchange->machine_off = values->machine_is_on && (exchange->machine_off || !read);
	if (read) {
		exchange->unread_writes++;
		return true;
	}
	exchange->fresh = false;
	values->connected = false;
	values->stale = true;
	values_changed(values, BLOCK_LINK);
	read_flags(exchange, values, false);
	trouble_read(&exchange->trouble, values, exchange->state, false);
	return false;
}

void exchange_write(struct exchange *exchange, struct values *values, uint64_t now_ns,
		    uint64_t period_ns)
{
	struct pokeys_command *command = &exchange->command;
	struct refusals *refusals = &exchange->refusals;
	const bool read = judge_reading(exchange, values);
	bool full;

	command->heartbeat++;
	command->t_ns = now_ns;
	command->t_thread_ns = exchange->t_read_ns;
	command->period_ns = period_ns;
	command->read_age_ns[command->heartbeat % POKEYS_READ_AGES] = exchange->read_age_ns;
	exchange->read_age_ns = 0;
	command->flags = flags_of(exchange, values);
	digital_write(&exchange->digital, values, exchange->state, exchange->fresh, command,
		      refusals);
	keys_write(&exchange->keys, values, command, refusals);
	pwm_write(&exchange->pwm, values, exchange->state, command, refusals);
	legacy_enable(exchange, values);
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		joint_write(&exchange->joint[i], &values->joint[i], i, &values->set.axis[i],
			    &(struct joint_device){ &exchange->state->engine.axis[i],
						    exchange->fresh && exchange->engine_begun },
			    &command->axis[i], refusals);
	for (unsigned int i = 0; i < POKEYS_AXES; i++)
		command->axis[i].enable &= read;
	full = write_encoders(exchange, values, now_ns);
	full |= joint_home_write(&exchange->home, values, exchange->joint, &exchange->queue,
				 command, &exchange->state->engine, exchange->fresh, refusals);
	full |= probe_write(&exchange->probe, values, exchange->joint, &exchange->queue, command,
			    exchange->fresh, refusals);
	full |= threading_write(&exchange->threading, values, &exchange->queue, command,
				exchange->fresh, refusals);
	full |= heaters_write(&exchange->heaters, values, &exchange->queue, command,
			      exchange->fresh, refusals);
	full |= servos_write(&exchange->servos, values, &exchange->queue, command, exchange->fresh,
			     read, refusals);
	full |= buttons_write(&exchange->buttons, values, &exchange->queue, command,
			      exchange->fresh, refusals);
	legacy_write(exchange, values, now_ns);
	values->one_shot_full = full;
	values->input_refused = refusals->now || values->diagnostics.config_input_refused;
	values->input_refused_count = refusals->total;
}

void exchange_written(struct exchange *exchange, bool taken)
{
	exchange->written = taken;
}
