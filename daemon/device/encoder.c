/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A 32-bit count out of 8-bit samples.
 *
 * 0xCC carries only the low byte of each counter, so a sample says where the
 * encoder is modulo 256 and something else must say in which turn. Taking the
 * nearest value to the last count works up to 127 counts a sample. Taking the
 * nearest value to where the encoder would be if it went on as before works
 * up to any steady speed, and is what is done here: only a change of speed
 * within one sample matters then.
 *
 * The trap is that a wrong turn looks like a right one. So a sample counts
 * only if it lies within a quarter turn (64) of the prediction, in time not
 * too far after the last one; else it is not published at all, and neither is
 * any later one until all 32 bits were read (0xCD). A reader then sees a
 * count that is old, with its age, instead of a jump. What slips through all
 * the same is found and mended at the next periodic 32-bit read, and counted.
 *
 * A 32-bit read has a trap of its own: its answer may have been under way for
 * long. While the count is certain it is only compared, against where the
 * count was from the question to the answer, so that a late answer never
 * moves it back. To end a doubt the answer must have come fast enough for
 * this encoder's speed, or it is asked for again (LATE_MAX times, then any
 * will do).
 *
 * All arithmetic is modulo 2^32, as the device's counter is.
 */

#include <math.h>
#include "daemon/device/encoder.h"

#define QUARTER_TURN 64
#define HALF_TURN 128
#define FASTEST 0.01		/* counts per ns: no input follows more */
#define LATE_MAX 3

/* Counts that go by in dt at the present rate. */
static int32_t travel(const struct encoder *encoder, uint64_t dt_ns)
{
	const double counts = encoder->rate * (double)dt_ns;

	return fabs(counts) < 1e9 ? (int32_t)lround(counts) : 0;
}

static int32_t difference(int32_t a, int32_t b)
{
	return (int32_t)((uint32_t)a - (uint32_t)b);
}

static int32_t sum(int32_t a, int32_t b)
{
	return (int32_t)((uint32_t)a + (uint32_t)b);
}

/* Samples come with jitter, and a short interval makes much of it: it weighs less. */
static void learn_rate(struct encoder *encoder, int32_t counts, uint64_t dt_ns, uint64_t usual_ns)
{
	const double fresh = (double)counts / (double)dt_ns;
	double weight = (double)dt_ns / (double)(usual_ns ? usual_ns : 1);

	if (weight > 1)
		weight = 1;
	encoder->rate += (fresh - encoder->rate) * weight;
	if (fabs(encoder->rate) > FASTEST)
		encoder->rate = 0;
}

/*
 * A sample that is missing leaves twice the time for a change of speed. Slow
 * encoders cannot go astray by that, fast ones can.
 */
static bool bridgeable(const struct encoder *encoder, uint64_t dt_ns, uint64_t nominal_ns)
{
	const int32_t speed = travel(encoder, nominal_ns);

	if (dt_ns <= nominal_ns * 3 / 2)
		return true;
	return dt_ns <= nominal_ns * 5 / 2 && speed <= QUARTER_TURN && speed >= -QUARTER_TURN;
}

enum encoder_verdict encoder_low_byte(struct encoder *encoder, uint8_t low, uint64_t t_ns,
				      uint64_t nominal_ns)
{
	int32_t guess, count;
	int8_t off;
	uint64_t dt;

	if (!encoder->known || encoder->doubt)
		return ENCODER_HELD;
	if (t_ns <= encoder->t_ns)
		return ENCODER_TAKEN;
	dt = t_ns - encoder->t_ns;
	guess = sum(encoder->count, travel(encoder, dt));
	off = (int8_t)(uint8_t)(low - (uint8_t)guess);
	if (!bridgeable(encoder, dt, nominal_ns) || off > QUARTER_TURN || off < -QUARTER_TURN) {
		encoder->doubt = true;
		return ENCODER_HELD;
	}
	count = sum(guess, off);
	learn_rate(encoder, difference(count, encoder->count), dt, nominal_ns);
	encoder->count = count;
	encoder->t_ns = t_ns;
	return dt > nominal_ns * 3 / 2 ? ENCODER_CHECK : ENCODER_TAKEN;
}

int32_t encoder_travel(const struct encoder *encoder, uint64_t t_ns)
{
	return t_ns > encoder->t_ns ? travel(encoder, t_ns - encoder->t_ns) : 0;
}

void encoder_mark(struct encoder *encoder)
{
	encoder->mark = encoder->count;
	encoder->marked = encoder->known && !encoder->doubt;
}

/*
 * Further than half a turn from everywhere the count was since the mark, and
 * from where it must be by now if no sample came lately.
 */
static bool slipped(const struct encoder *encoder, int32_t count, uint64_t t_ns)
{
	const int32_t moved = difference(encoder->count, encoder->mark);
	const int32_t by_now = sum(moved, encoder_travel(encoder, t_ns));
	const int32_t off = difference(count, encoder->mark);
	int32_t low = moved < 0 ? moved : 0, high = moved > 0 ? moved : 0;

	low = by_now < low ? by_now : low;
	high = by_now > high ? by_now : high;
	return off <= low - HALF_TURN || off >= high + HALF_TURN;
}

/* A certain count whose speed is not known: hold until a second one tells it. */
static enum encoder_verdict begin(struct encoder *encoder, int32_t count, uint64_t t_ns)
{
	encoder->count = count;
	encoder->t_ns = t_ns;
	encoder->known = true;
	encoder->doubt = true;
	encoder->begun = true;
	encoder->rate = 0;
	return ENCODER_HELD;
}

/* Would the 8-bit samples have led elsewhere? */
static bool was_lost(const struct encoder *encoder, int32_t count, uint64_t t_ns)
{
	const int32_t gone = travel(encoder, t_ns - encoder->t_ns);
	const int32_t off = difference(difference(count, encoder->count), gone);

	return off >= HALF_TURN || off <= -HALF_TURN;
}

/*
 * To end a doubt the speed must be known well enough to predict the next
 * sample: the moment of sampling is uncertain by the time the answer took.
 */
static bool ends_doubt(struct encoder *encoder, int32_t count, uint64_t took_ns, uint64_t t_ns,
		       uint64_t nominal_ns)
{
	const double dt = (double)(t_ns - encoder->t_ns);
	const double moved = fabs((double)difference(count, encoder->count));

	if (t_ns <= encoder->t_ns || t_ns - encoder->t_ns < nominal_ns)
		return false;
	return moved * (double)took_ns / dt <= QUARTER_TURN || encoder->late++ >= LATE_MAX;
}

enum encoder_verdict encoder_exact(struct encoder *encoder, int32_t count, uint64_t asked_ns,
				   uint64_t t_ns, uint64_t nominal_ns)
{
	const uint64_t took = t_ns > asked_ns ? t_ns - asked_ns : 0;

	if (!encoder->known)
		return begin(encoder, count, t_ns);
	if (!encoder->doubt && encoder->marked) {
		if (!slipped(encoder, count, t_ns))
			return ENCODER_TAKEN;
		encoder->resync++;
		encoder->slips++;
		return begin(encoder, count, t_ns);
	}
	encoder->doubt = true;
	if (!ends_doubt(encoder, count, took, t_ns, nominal_ns))
		return ENCODER_HELD;
	encoder->resync += !encoder->begun && was_lost(encoder, count, t_ns);
	learn_rate(encoder, difference(count, encoder->count), t_ns - encoder->t_ns, 1);
	encoder->count = count;
	encoder->t_ns = t_ns;
	encoder->doubt = false;
	encoder->begun = false;
	encoder->late = 0;
	return ENCODER_CHECK;
}

void encoder_whole(struct encoder *encoder, int32_t count, uint64_t t_ns)
{
	if (encoder->known && t_ns <= encoder->t_ns)
		return;
	if (encoder->known)
		learn_rate(encoder, difference(count, encoder->count), t_ns - encoder->t_ns, 1);
	encoder->count = count;
	encoder->t_ns = t_ns;
	encoder->known = true;
}

void encoder_forget(struct encoder *encoder)
{
	encoder->known = false;
	encoder->doubt = false;
	encoder->marked = false;
	encoder->rate = 0;
	encoder->late = 0;
}
