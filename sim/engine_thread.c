// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * Threading: the ring played by the spindle's angle instead of by the
 * millisecond (protocol sections 3.24.3 and 5.3, "Threading", where it is said
 * which of all this is a choice).
 *
 * A slot is a millisecond at the target speed, that is target / 60000 of a turn.
 * From the index on, what has been played follows that angle: at the speed that is
 * measured, and a part of what it lags behind is made good in each millisecond.
 * A slot is played in parts, so an axis is nowhere further than half a pulse from
 * where the angle played wants it. The ring has no way back: a spindle that turns
 * backwards waits for the angle it has had.
 */
#include "sim/engine_part.h"

#include <math.h>

#define MODE_ENCODER 1		/* 1 and 3; 0 and 2 know the index alone */
#define GAIN_WHOLE 1000.0	/* gains are thousandths a millisecond */
#define SPEED_MOST 2.0		/* slots a millisecond */
#define RELEASE_RAMP 0.005	/* of them, more a millisecond */
#define NEARLY 1e-9

struct params {
	bool encoder;
	double ticks; /* of a turn */
	double slots; /* of a turn */
	double speed_gain, position_gain;
	uint8_t ignore;
};

static double gain(const uint8_t *at)
{
	return fmin(wire_get_u16(at) / GAIN_WHOLE, 1);
}

/* Bytes 8..20 of 0x36; a target or a turn of 0 leaves the spindle without effect. */
static struct params params_of(const struct sim_device *dev)
{
	const uint8_t *raw = dev->config.engine.thread;
	uint16_t rpm = wire_get_u16(raw + 6);

	return (struct params){
		.encoder = raw[0] & MODE_ENCODER,
		.ticks = wire_get_u16(raw + 4),
		.slots = rpm ? 60000.0 / rpm : 0,
		.speed_gain = gain(raw + 8),
		.position_gain = gain(raw + 10),
		.ignore = raw[12],
	};
}

static double turns_of(const struct sim_device *dev, const struct params *params, int64_t steps)
{
	return params->ticks > 0 ? sim_encoder_counts(dev, SIM_ULTRA_FAST, steps) / params->ticks :
				   0;
}

/* Turns a millisecond by the time of the last turn. */
static double index_speed(const struct sim_device *dev)
{
	uint32_t ticks = sim_spindle_ticks(dev);

	return ticks ? SIM_TICK_HZ / 1e3 / ticks : 0;
}

bool sim_thread_holds(const struct sim_device *dev)
{
	uint8_t state = dev->engine.thread.state;

	return state != SIM_THREAD_OFF && state != SIM_THREAD_PREPARING;
}

/* Turns that the spindle made in this millisecond, as it is measured in this mode. */
static double measure(struct sim_device *dev, const struct params *params)
{
	struct sim_thread *th = &dev->engine.thread;
	int64_t position = dev->bench.shaft[SIM_ULTRA_FAST].position;
	double turned = turns_of(dev, params, position - th->last);

	th->last = position;
	if (params->encoder) {
		th->turn = turns_of(dev, params, position - th->base);
		return th->first ? index_speed(dev) : turned;
	}
	/* between two indexes it is taken to turn as it did, but not beyond the next one */
	th->turn = fmin(th->turn + index_speed(dev), th->whole + 1);
	return index_speed(dev);
}

static bool next_slot(struct sim_device *dev)
{
	struct sim_thread *th = &dev->engine.thread;
	const struct sim_ring_slot *slot;

	if (th->has_slot)
		return true;
	slot = sim_ring_take(dev);
	if (!slot)
		return false;
	th->now = *slot;
	th->has_slot = true;
	th->part = 0;
	memset(th->done, 0, sizeof(th->done));
	return true;
}

static void make_part(struct sim_device *dev, uint8_t ignore)
{
	struct sim_thread *th = &dev->engine.thread;

	for (unsigned int i = 0; i < SIM_AXES; i++) {
		int32_t wanted = (int32_t)lround(th->now.magnitude[i] * th->part);

		if (th->now.negative >> i & 1)
			wanted = -wanted;
		if (wanted == th->done[i] || !sim_axis_usable(dev, i) ||
		    (dev->engine.axis[i].setup.options & SIM_AC_PLANNER))
			continue;
		if (ignore >> i & 1)
			th->ignored++;
		else
			sim_axis_jump(dev, i, wanted - th->done[i]);
		th->done[i] = wanted;
	}
}

/* Pulses of its fastest axis. */
static double pulses_of(const struct sim_ring_slot *slot)
{
	uint16_t most = 0;

	for (unsigned int i = 0; i < SIM_AXES; i++)
		most = slot->magnitude[i] > most ? slot->magnitude[i] : most;
	return most;
}

/* Goes on by so many slots, or as far as the generator and the ring allow. */
static void play(struct sim_device *dev, double slots, uint8_t ignore)
{
	struct sim_thread *th = &dev->engine.thread;
	double left = sim_engine_kilohertz(dev), part, most;

	while (slots > NEARLY) {
		if (!next_slot(dev)) {
			th->dry++;
			return;
		}
		most = pulses_of(&th->now);
		part = fmin(slots, 1 - th->part);
		if (part * most > left)
			part = left / most;
		if (part < NEARLY)
			return;
		th->part += part;
		th->played += part;
		slots -= part;
		left -= part * most;
		if (th->part > 1 - NEARLY)
			th->part = 1;
		make_part(dev, ignore);
		th->has_slot = th->part < 1;
	}
}

static void follow(struct sim_device *dev, const struct params *params)
{
	struct sim_thread *th = &dev->engine.thread;
	double turned = measure(dev, params);
	double lag = th->turn * params->slots - th->played;

	th->first = false;
	th->speed += (turned * params->slots - th->speed) * params->speed_gain;
	play(dev, fmin(fmax(th->speed + lag * params->position_gain, 0), SPEED_MOST),
	     params->ignore);
}

/* Back to a slot a millisecond; the slot that is under way is ended first. */
static void release(struct sim_device *dev, const struct params *params)
{
	struct sim_thread *th = &dev->engine.thread;
	double way = 1 - th->speed;

	th->speed += fmax(fmin(way, RELEASE_RAMP), -RELEASE_RAMP);
	if (fabs(1 - th->speed) > NEARLY) {
		play(dev, th->speed, params->ignore);
		return;
	}
	if (th->has_slot)
		play(dev, 1 - th->part, params->ignore);
	th->state = SIM_THREAD_OFF;
}

void sim_thread_slot(struct sim_device *dev)
{
	struct sim_engine *pe = &dev->engine;
	const struct params params = params_of(dev);

	if (pe->thread.state == SIM_THREAD_PREPARING && !pe->ring.used)
		pe->thread.state = SIM_THREAD_PREPARED;
	else if (pe->thread.state == SIM_THREAD_ACTIVE)
		follow(dev, &params);
	else if (pe->thread.state == SIM_THREAD_RELEASING)
		release(dev, &params);
}

/* Where the shaft was at the index that has just passed. */
static int64_t index_position(const struct sim_device *dev)
{
	const struct sim_shaft *shaft = &dev->bench.shaft[SIM_ULTRA_FAST];
	int64_t every = shaft->index_every;

	return every > 0 ? sim_floor_div(shaft->position + every / 2, every) * every :
			   shaft->position;
}

void sim_thread_index(struct sim_device *dev)
{
	struct sim_thread *th = &dev->engine.thread;
	const struct params params = params_of(dev);

	th->index_count++;
	th->whole++;
	if (!params.encoder)
		th->turn = th->whole;
	if (th->state != SIM_THREAD_WAITING)
		return;
	th->state = SIM_THREAD_ACTIVE;
	th->base = index_position(dev);
	th->last = dev->bench.shaft[SIM_ULTRA_FAST].position;
	th->turn = th->whole = 0;
	th->played = 0;
	th->speed = index_speed(dev) * params.slots;
	th->has_slot = false;
	th->first = true;
}

/* Neither what is left of the slot under way nor what is in the ring is played. */
static void cancel(struct sim_device *dev)
{
	sim_ring_clear(&dev->engine.ring);
	dev->engine.thread.has_slot = false;
	dev->engine.thread.state = SIM_THREAD_OFF;
}

SIM_HANDLER(sim_pe_thread)
{
	struct sim_engine *pe = &dev->engine;
	struct sim_thread *th = &pe->thread;

	(void)rp;
	switch (rq[P1]) {
	case 0x30:
		if (th->state == SIM_THREAD_OFF)
			th->state = pe->ring.used ? SIM_THREAD_PREPARING : SIM_THREAD_PREPARED;
		break;
	case 0x31:
		if (th->state == SIM_THREAD_OFF || th->state == SIM_THREAD_PREPARING)
			th->state = SIM_THREAD_PREPARED;
		break;
	case 0x32:
		if (th->state == SIM_THREAD_PREPARED)
			th->state = SIM_THREAD_WAITING;
		break;
	case 0x33:
		th->state = th->state == SIM_THREAD_ACTIVE || th->state == SIM_THREAD_RELEASING ?
				    SIM_THREAD_RELEASING :
				    SIM_THREAD_OFF;
		break;
	default:
		cancel(dev);
		break;
	}
	return SIM_ANSWER;
}

static int32_t lag_in_ticks(const struct sim_device *dev, const struct params *params)
{
	const struct sim_thread *th = &dev->engine.thread;

	if (th->state != SIM_THREAD_ACTIVE || params->slots <= 0)
		return 0;
	return (int32_t)lround((th->turn - th->played / params->slots) * params->ticks);
}

SIM_HANDLER(sim_pe_thread_status)
{
	const struct sim_thread *th = &dev->engine.thread;
	uint8_t *raw = dev->config.engine.thread;
	struct params params;

	if (rq[P1] == 0x36 && !sim_locked(dev))
		memcpy(raw, rq + 8, sizeof(dev->config.engine.thread));
	params = params_of(dev);
	rp[8] = th->state == SIM_THREAD_PREPARING;
	rp[9] = th->state == SIM_THREAD_PREPARED;
	rp[10] = th->state == SIM_THREAD_WAITING;
	rp[11] = th->state == SIM_THREAD_ACTIVE || th->state == SIM_THREAD_RELEASING;
	wire_put_i32(rp + 12, dev->encoders.ultra_speed);
	wire_put_i32(rp + 16, lag_in_ticks(dev, &params));
	wire_put_u32(rp + 20, (uint32_t)lround(60000 * index_speed(dev)));
	rp[24] = params.ignore;
	wire_put_u32(rp + 25, th->index_count);
	return SIM_ANSWER;
}

SIM_HANDLER(sim_pe_encoder_test)
{
	const struct sim_encoders *enc = &dev->encoders;

	(void)rq;
	wire_put_u32(rp + 8, enc->raw[SIM_ULTRA_FAST]);
	wire_put_u32(rp + 12, enc->index_count);
	wire_put_u32(rp + 16, enc->index_ticks);
	wire_put_u32(rp + 20, (uint32_t)enc->ultra_speed);
	return SIM_ANSWER;
}
