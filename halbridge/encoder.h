/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * One encoder of the HAL interface: from the device's 32-bit count to
 * position, velocity, reset and index.
 */
#ifndef HALBRIDGE_ENCODER_H
#define HALBRIDGE_ENCODER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "halbridge/one_shot.h"
#include "halbridge/press.h"
#include "halbridge/refusal.h"
#include "halbridge/values.h"
#include "halbridge/velocity.h"

/* Setting the device's counter. */
enum encoder_set {
	ENCODER_SET_NONE,
	ENCODER_SET_WAITS,   /* for its outcome: samples may be of before or after it */
	ENCODER_SET_DONE,    /* the next sample is of the new count */
	ENCODER_SET_UNKNOWN, /* ... or of the old one */
};

enum encoder_index { ENCODER_INDEX_OFF, ENCODER_INDEX_QUEUED, ENCODER_INDEX_ARMED };

struct encoder {       /* what each period needs stands first */
	int64_t total; /* counts since the start, does not wrap */
	int64_t zero;  /* total where the pins read 0 */
	uint64_t t_ns; /* of the last sample taken over, 0 = none yet */
	int32_t raw;
	uint32_t index_id;  /* of the one-shot that arms */
	uint64_t retry_ns;  /* not armed again before */
	uint8_t index;      /* enum encoder_index */
	bool index_flag;    /* of the state image, at the last look */
	bool stray;         /* armed, but nobody wants it any more */
	bool anew;          /* the next sample is of a counter that has begun again */
	bool keep;          /* ... and count and position stay where they are */
	bool lost;          /* ... since it was set, reset or zeroed by its index */
	uint8_t set;        /* enum encoder_set */
	uint64_t silent_ns; /* a later sample is the first one after a silence; 0 = was none */
	uint64_t set_t_ns;  /* of the sample that was there when its outcome came */
	struct press press;
	bool rests;         /* it stood at the last sample, and the pins say so */
	bool quiet;         /* no index and no setting of it is under way */
	int64_t shown;      /* counts that position was made of */
	double shown_scale; /* and the scale; 0 = not yet */
	struct factor scale;
	struct velocity velocity;
};

void encoder_init(struct encoder *encoder);

/* Where a member of this encoder's values stands in struct values. */
static inline size_t encoder_member(unsigned int number, size_t member)
{
	return offsetof(struct values, encoder) + number * sizeof(struct value_encoder) + member;
}

/*
 * Take over the sample of the state image (`fresh`: the image's data may be
 * used) and fill the pins. Returns true if one of them has changed. Realtime.
 */
bool encoder_read(struct encoder *encoder, struct value_encoder *value, unsigned int number,
		  const struct pokeys_state *state, bool fresh, struct refusals *refusals);

/*
 * True if the sample is one more of an encoder that stands, as most do most of the time:
 * it is taken over, and encoder_read() would change nothing. Realtime.
 */
static inline bool encoder_stands(struct encoder *encoder, const struct value_encoder *value,
				  int32_t raw, uint64_t t_ns)
{
	if (!encoder->rests || raw != encoder->raw || value->scale != encoder->scale.seen ||
	    value->reset || t_ns <= encoder->t_ns || t_ns - encoder->t_ns > VELOCITY_GAP_NS)
		return false;
	encoder->t_ns = t_ns;
	encoder->velocity.t_ns = t_ns;
	return true;
}

/* The pins are to be filled anew at the next read, whatever they show. Realtime. */
static inline void encoder_show_again(struct encoder *encoder)
{
	encoder->shown_scale = 0; /* no scale is */
	encoder->rests = false;
}

/*
 * See how arming stands; clears index_enable when the index has been seen.
 * Returns true if an arming ended badly. Realtime.
 */
bool encoder_index_read(struct encoder *encoder, struct value_encoder *value, unsigned int number,
			const struct pokeys_state *state, const struct one_shot_queue *queue,
			uint64_t now_ns, struct refusals *refusals);

/*
 * Ask for an index if index_enable wants one. Returns false if the queue is
 * full (it is tried again in the next period). Realtime.
 */
bool encoder_index_write(struct encoder *encoder, const struct value_encoder *value,
			 unsigned int number, struct one_shot_queue *queue,
			 struct pokeys_command *command, uint64_t now_ns);

/*
 * Nobody wants an index of this encoder and none comes: the two above have
 * nothing to do, as with most encoders most of the time. Realtime.
 */
static inline bool encoder_index_idle(const struct encoder *encoder,
				      const struct value_encoder *value, unsigned int number,
				      const struct pokeys_state *state)
{
	return !value->index_enable && encoder->index == ENCODER_INDEX_OFF &&
	       !encoder->index_flag && !(state->encoder_index >> number & 1);
}

/*
 * See how setting the counter stands. Returns true if it ended badly. Realtime.
 */
bool encoder_set_read(struct encoder *encoder, unsigned int number,
		      const struct pokeys_state *state, const struct one_shot_queue *queue);

/* Ask for it when the pin `set` rises; refused while data are not fresh. Realtime. */
struct press_news encoder_set_write(struct encoder *encoder, const struct value_encoder *value,
				    unsigned int number, struct one_shot_queue *queue,
				    struct pokeys_command *command, bool fresh);

/* Nobody sets this counter: the two above have nothing to do. Realtime. */
static inline bool encoder_set_idle(const struct encoder *encoder,
				    const struct value_encoder *value)
{
	return !value->set && encoder->press.up && encoder->press.state == PRESS_IDLE &&
	       encoder->set == ENCODER_SET_NONE;
}

/*
 * Nobody wants an index or sets the counter, and `encoder_index` of the state image has no
 * pulse: the four above have nothing to do. As the two, but at a glance; encoder_settle()
 * has to follow whenever one of the four was called. Realtime.
 */
static inline bool encoder_is_quiet(const struct encoder *encoder,
				    const struct value_encoder *value, unsigned int number,
				    uint32_t encoder_index)
{
	return encoder->quiet && !(value->index_enable | value->set) &&
	       !(encoder_index >> number & 1);
}

static inline void encoder_settle(struct encoder *encoder)
{
	encoder->quiet = encoder->index == ENCODER_INDEX_OFF && !encoder->index_flag &&
			 encoder->press.up && encoder->press.state == PRESS_IDLE &&
			 encoder->set == ENCODER_SET_NONE;
}

/* The daemon that was asked is gone: ask again. Realtime. */
void encoder_index_forget(struct encoder *encoder);

/*
 * The daemon that was asked to set the counter is gone, t_ns is the time of the sample that is
 * there. Returns true if it had been asked. Realtime.
 */
bool encoder_set_forget(struct encoder *encoder, uint64_t t_ns);

/*
 * The device was restarted, or it is another one: its counters begin again. The next sample
 * leaves count and position where they are; they follow its changes from there. Without
 * `keep` they are the device's again. Realtime.
 */
void encoder_restarted(struct encoder *encoder, bool keep);

/*
 * The device answers again after a silence of LINK_SILENCE_NS or more, which began at since_ns.
 * What was turned meanwhile is left out of count and position, as LinuxCNC would jog by it.
 * Realtime.
 */
void encoder_silent(struct encoder *encoder, uint64_t since_ns);

#endif
