/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Encoders as LinuxCNC expects them, from a device that can do less.
 *
 * Position is kept in 64 bits: the device's count wraps at 2^32, so only
 * differences of it are believed, and a spindle that has turned for a week
 * does not jump.
 *
 * reset is done here, by moving our own zero. The device has no command that
 * zeroes one 32-bit counter: it would rewrite thirteen of them with values
 * read before, and counts that arrive in between would be lost (protocol
 * section 3.8). So reset is exact, immediate, and leaves the neighbours alone.
 * set does rewrite them, for whoever needs the device's own count. Until its outcome is
 * known a sample may be of before or after it, so none is taken.
 *
 * index-enable is the device's: it is armed by a one-shot and zeroes the count
 * itself at the pulse, at full resolution. We wait for the arming to be
 * acknowledged before believing the index flag, which may still be set from
 * the time before. Then our zero is the device's zero, and the pin is cleared.
 * A device cannot be disarmed: if the wish is withdrawn, the pulse still zeroes
 * its count, and then the position is carried over the jump.
 *
 * A device that is restarted counts from 0, and a wheel may be turned while its cable is out.
 * LinuxCNC jogs by the count of a hand wheel and would move the machine when the device is back, so
 * the count goes on from where it was, and count-lost says that nobody knows what was turned
 * meanwhile.
 */
#include "halbridge/encoder.h"
#include <math.h>
#include <stddef.h>
#include <string.h>
#include "halbridge/link.h"

#define RETRY_NS	UINT64_C(100000000)	/* a refused arming is tried again after */

void encoder_init(struct encoder *encoder)
{
	memset(encoder, 0, sizeof(*encoder));
	encoder->scale = (struct factor){ .used = 1, .seen = 1 };
}

static void restart_at(struct encoder *encoder, int32_t raw, uint64_t t_ns)
{
	encoder->raw = raw;
	encoder->total = raw;
	encoder->t_ns = t_ns;
	encoder->silent_ns = 0;
	encoder->rests = encoder->anew = false;
	velocity_rebase(&encoder->velocity, raw, t_ns);
}

static void go_on_at(struct encoder *encoder, int64_t total, int32_t raw, uint64_t t_ns)
{
	restart_at(encoder, raw, t_ns);
	encoder->total = total;
	velocity_rebase(&encoder->velocity, total, t_ns);
}

/* What it has turned meanwhile is unknown: count and position stay where they are. */
static void stay(struct encoder *encoder, int32_t raw, uint64_t t_ns)
{
	go_on_at(encoder, encoder->total, raw, t_ns);
	encoder->velocity.slope = encoder->velocity.rate = 0;
}

/* Zeroed or set by what nobody waited for: go on from where motion has led since. */
static void carry_over(struct encoder *encoder, int32_t raw, uint64_t t_ns)
{
	const uint64_t since_ns = t_ns - encoder->t_ns;
	const double moved = encoder->velocity.rate * (double)since_ns / 1e9;

	if (since_ns < LINK_SILENCE_NS) {
		go_on_at(encoder, encoder->total + llrint(moved), raw, t_ns);
		return;
	}
	encoder->lost = true;
	stay(encoder, raw, t_ns);
}

/* The first sample after the counter was set, or may have been. */
static void take_set(struct encoder *encoder, int32_t raw, uint64_t t_ns)
{
	if (encoder->set == ENCODER_SET_WAITS || t_ns <= encoder->set_t_ns)
		return;
	if (encoder->set == ENCODER_SET_DONE) {
		encoder->zero = 0;
		encoder->lost = false;
		restart_at(encoder, raw, t_ns);
	} else {
		carry_over(encoder, raw, t_ns);
	}
	encoder->set = ENCODER_SET_NONE;
}

static void take_anew(struct encoder *encoder, int32_t raw, uint64_t t_ns)
{
	if (encoder->keep) {
		stay(encoder, raw, t_ns);
		return;
	}
	restart_at(encoder, raw, t_ns);
	encoder->zero = 0;
}

static void take_sample(struct encoder *encoder, int32_t raw, uint64_t t_ns)
{
	if (!t_ns || t_ns == encoder->t_ns)
		return;
	if (encoder->set != ENCODER_SET_NONE) {
		take_set(encoder, raw, t_ns);
		return;
	}
	if (!encoder->t_ns) {
		restart_at(encoder, raw, t_ns);
		return;
	}
	if (encoder->anew) {
		take_anew(encoder, raw, t_ns);
		return;
	}
	if (encoder->silent_ns && t_ns > encoder->silent_ns) {
		encoder->lost |= raw != encoder->raw;
		stay(encoder, raw, t_ns);
		return;
	}
	encoder->total += (int32_t)((uint32_t)raw - (uint32_t)encoder->raw);
	encoder->raw = raw;
	encoder->t_ns = t_ns;
	velocity_sample(&encoder->velocity, encoder->total, t_ns);
}

/* Divisions are the dear part, and most encoders stand still most of the time. */
static bool show(struct encoder *encoder, struct value_encoder *value, double scale)
{
	int64_t counts = encoder->total - encoder->zero;
	double rate = encoder->velocity.rate, velocity = rate == 0 ? 0 : rate / scale;
	bool changed = velocity != value->velocity;

	if (counts != encoder->shown || scale != encoder->shown_scale) {
		encoder->shown = counts;
		encoder->shown_scale = scale;
		value->count = (int32_t)(uint32_t)counts;
		value->position = (double)counts / scale;
		changed = true;
	}
	value->velocity = velocity;
	return changed;
}

bool encoder_read(struct encoder *encoder, struct value_encoder *value, unsigned int number,
		  const struct pokeys_state *state, bool fresh, struct refusals *refusals)
{
	double scale = factor_take(&encoder->scale, refusals, value->scale,
				   encoder_member(number, offsetof(struct value_encoder, scale)));
	bool changed;

	if (fresh)
		take_sample(encoder, state->encoder[number], state->encoder_t_ns[number]);
	if (value->reset) {
		encoder->zero = encoder->total;
		encoder->lost = false;
	}
	changed = show(encoder, value, scale);
	changed |= value->count_lost != encoder->lost;
	value->count_lost = encoder->lost;
	encoder->rests = !changed && encoder->set == ENCODER_SET_NONE && !encoder->anew &&
			 value->velocity == 0 &&
			 velocity_rests(&encoder->velocity, encoder->total, encoder->t_ns);
	return changed;
}

static void read_outcome(struct encoder *encoder, enum pokeys_outcome outcome, uint64_t now_ns)
{
	if (outcome == POKEYS_OUTCOME_DONE) {
		encoder->index = ENCODER_INDEX_ARMED;
		encoder->stray = false;
	} else {
		encoder->index = ENCODER_INDEX_OFF;
		encoder->retry_ns = now_ns + RETRY_NS;
	}
}

static void take_pulse(struct encoder *encoder, struct value_encoder *value, int32_t raw,
		       uint64_t t_ns)
{
	if (encoder->index == ENCODER_INDEX_ARMED) {
		encoder->index = ENCODER_INDEX_OFF;
		encoder->zero = 0;
		encoder->lost = false;
		restart_at(encoder, raw, t_ns);
		value->index_enable = false;
	} else if (encoder->stray && t_ns > encoder->t_ns) {
		encoder->stray = false;
		carry_over(encoder, raw, t_ns);
	}
}

bool encoder_index_read(struct encoder *encoder, struct value_encoder *value, unsigned int number,
			const struct pokeys_state *state, const struct one_shot_queue *queue,
			uint64_t now_ns, struct refusals *refusals)
{
	enum pokeys_outcome outcome = POKEYS_OUTCOME_NONE;
	bool flag = state->encoder_index >> number & 1;

	if (encoder->index == ENCODER_INDEX_QUEUED)
		outcome = one_shot_outcome(queue, state, encoder->index_id);
	if (outcome != POKEYS_OUTCOME_NONE)
		read_outcome(encoder, outcome, now_ns);
	if (flag && (!encoder->index_flag || encoder->index == ENCODER_INDEX_ARMED))
		take_pulse(encoder, value, state->encoder[number], state->encoder_t_ns[number]);
	encoder->index_flag = flag;
	if (outcome == POKEYS_OUTCOME_NONE || outcome == POKEYS_OUTCOME_DONE)
		return false;
	refusal_once(refusals, encoder_member(number, offsetof(struct value_encoder, index_enable)),
		     REFUSAL_NO_INDEX, outcome);
	return true;
}

bool encoder_index_write(struct encoder *encoder, const struct value_encoder *value,
			 unsigned int number, struct one_shot_queue *queue,
			 struct pokeys_command *command, uint64_t now_ns)
{
	const struct pokeys_one_shot arm = {
		.operation = POKEYS_ONE_SHOT_ARM_INDEX,
		.index = (uint8_t)number,
	};
	enum one_shot_push pushed;

	if (!value->index_enable) {
		encoder->stray |= encoder->index != ENCODER_INDEX_OFF;
		encoder->index = ENCODER_INDEX_OFF;
		return true;
	}
	if (encoder->index != ENCODER_INDEX_OFF || now_ns < encoder->retry_ns)
		return true;
	pushed = one_shot_push(queue, command, &arm, &encoder->index_id);
	if (pushed == ONE_SHOT_QUEUED)
		encoder->index = ENCODER_INDEX_QUEUED;
	return pushed != ONE_SHOT_FULL;
}

bool encoder_set_read(struct encoder *encoder, unsigned int number,
		      const struct pokeys_state *state, const struct one_shot_queue *queue)
{
	const bool failed = press_read(&encoder->press, queue, state);

	if (encoder->set != ENCODER_SET_WAITS || encoder->press.state != PRESS_IDLE)
		return failed;
	encoder->set_t_ns = state->encoder_t_ns[number];
	switch (encoder->press.outcome) {
	case POKEYS_OUTCOME_DONE:
		encoder->set = ENCODER_SET_DONE;
		break;
	case POKEYS_OUTCOME_UNKNOWN:
		encoder->set = ENCODER_SET_UNKNOWN;
		break;
	default: /* it still counts from where it did */
		encoder->set = ENCODER_SET_NONE;
		break;
	}
	return failed;
}

struct press_news encoder_set_write(struct encoder *encoder, const struct value_encoder *value,
				    unsigned int number, struct one_shot_queue *queue,
				    struct pokeys_command *command, bool fresh)
{
	const struct pokeys_one_shot set = {
		.operation = POKEYS_ONE_SHOT_SET_ENCODER,
		.index = (uint8_t)number,
		.value = { value->set_value },
	};
	/* of two under way, the end of the last one would not tell which count it is */
	const bool may = fresh && encoder->press.state != PRESS_QUEUED;
	const struct press_news news = press_write(&encoder->press, value->set, may ? &set : NULL,
						   queue, command);

	if (encoder->press.state == PRESS_QUEUED) {
		encoder->set = ENCODER_SET_WAITS;
		encoder->rests = false;
	}
	return news;
}

void encoder_index_forget(struct encoder *encoder)
{
	encoder->index = ENCODER_INDEX_OFF;
	encoder->retry_ns = 0;
}

bool encoder_set_forget(struct encoder *encoder, uint64_t t_ns)
{
	const bool under_way = press_forget(&encoder->press);

	if (under_way) {
		encoder->set = ENCODER_SET_UNKNOWN;
		encoder->set_t_ns = t_ns;
	}
	return under_way;
}

void encoder_restarted(struct encoder *encoder, bool keep)
{
	encoder_index_forget(encoder);
	encoder->set = ENCODER_SET_NONE;
	encoder->stray = false;
	encoder->rests = false;
	if (!encoder->t_ns)
		return; /* there was no count that could be lost */
	encoder->lost = encoder->anew = true;
	encoder->keep = keep;
}

void encoder_silent(struct encoder *encoder, uint64_t since_ns)
{
	/* in the middle: a sample of before the silence may still come */
	encoder->silent_ns = since_ns + LINK_SILENCE_NS / 2;
	encoder->rests = false;
}
