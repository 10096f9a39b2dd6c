// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * One axis for one slot: planner, soft limits, pulses, and what the pulses do
 * to the machine (protocol section 5.3).
 *
 * Pulses are the change of the rounded position, so the counter, the motor
 * and an encoder on it can never drift apart by a fraction. The way round the
 * motor turns depends on two inversions; the counter does not know of them.
 *
 * Soft limits are kept by going to the limit instead of beyond it, with the
 * same braking law as any other target. They never move an axis which stands
 * outside back in, and do not act while homing.
 */
#include "sim/engine_part.h"

#include <math.h>

#define SIGNAL_INVERT_DIRECTION 0x02

/* Steps of an encoder driven by the motor, with the fraction carried on. */
static void turn_encoder(struct sim_device *dev, struct sim_mechanics *m, int64_t pulses)
{
	int64_t before = m->position - pulses;
	int64_t steps;

	m->ratio_rest += pulses * m->ratio_num;
	steps = m->ratio_rest / m->ratio_den;
	m->ratio_rest %= m->ratio_den;
	sim_encoder_turn(dev, (unsigned int)m->encoder, steps);
	if (m->index_every > 0 &&
	    sim_floor_div(before, m->index_every) != sim_floor_div(m->position, m->index_every))
		sim_encoder_index(dev, (unsigned int)m->encoder);
}

static void move_motor(struct sim_device *dev, unsigned int axis, int64_t pulses)
{
	const struct sim_axis_setup *setup = &dev->engine.axis[axis].setup;
	struct sim_mechanics *m = &dev->bench.machine.axis[axis];
	bool inverted = !!(setup->options & SIM_AC_INVERTED) !=
			!!(setup->signals & SIGNAL_INVERT_DIRECTION);

	if (inverted)
		pulses = -pulses;
	m->position += pulses;
	m->steps += (uint64_t)(pulses < 0 ? -pulses : pulses);
	if (m->encoder >= 0)
		turn_encoder(dev, m, pulses);
	if (dev->bench.machine.any_on_pin)
		dev->dirty = true;
}

/* Extra pulses on a change of direction, which take up the play (section 3.24.3, 0x40). */
static int64_t backlash(struct sim_device *dev, unsigned int axis, int64_t pulses)
{
	const struct sim_engine_config *config = &dev->config.engine;
	const uint8_t *row = config->backlash + 4 * axis;
	struct sim_axis *ax = &dev->engine.axis[axis];
	int32_t half = wire_get_u16(row);
	int32_t most = row[2] ? row[2] : 1;
	int32_t target, step;

	if (!config->backlash_enable || !half)
		return 0;
	if (pulses)
		ax->back_way = pulses > 0 ? 1 : -1;
	target = ax->back_way * half;
	step = target - ax->back_compensation;
	if (step > most)
		step = most;
	if (step < -most)
		step = -most;
	ax->back_compensation += step;
	return step;
}

static void make_pulses(struct sim_device *dev, unsigned int axis)
{
	struct sim_axis *ax = &dev->engine.axis[axis];
	int64_t now = llround(ax->planner.position);
	int64_t pulses = now - ax->pulses;

	ax->pulses = now;
	pulses += backlash(dev, axis, pulses);
	if (pulses)
		move_motor(dev, axis, pulses);
}

void sim_axis_halt(struct sim_axis *axis)
{
	axis->planner.speed = 0;
	axis->planner.position = (double)axis->pulses;
}

void sim_axis_set_position(struct sim_axis *axis, int32_t position)
{
	axis->planner.position = position;
	axis->pulses = position;
}

static bool has_soft_limits(const struct sim_device *dev, const struct sim_axis *ax)
{
	return (ax->setup.options & SIM_AC_SOFT_LIMIT) && dev->engine.state != SIM_PE_HOMING;
}

/* Brings a target inside the soft limits, or to where the axis stands if it is outside. */
static double soft_target(struct sim_device *dev, unsigned int axis, double target)
{
	const struct sim_axis *ax = &dev->engine.axis[axis];
	double position = ax->planner.position;
	double allowed = target;
	uint8_t bit = (uint8_t)(1u << axis);

	if (target > ax->setup.soft_max)
		allowed = fmax(ax->setup.soft_max, fmin(position, target));
	if (target < ax->setup.soft_min)
		allowed = fmin(ax->setup.soft_min, fmax(position, target));
	if (allowed != target && fabs(allowed - position) < 0.5)
		dev->engine.soft_limited |= bit;
	return allowed;
}

static void clear_soft(struct sim_device *dev, unsigned int axis)
{
	dev->engine.soft_limited &= (uint8_t)~(1u << axis);
}

void sim_axis_go(struct sim_device *dev, unsigned int axis, double target, double ratio)
{
	struct sim_axis *ax = &dev->engine.axis[axis];
	struct sim_planner_limits limits = ax->setup.limits;

	clear_soft(dev, axis);
	limits.speed *= ratio;
	if (has_soft_limits(dev, ax))
		target = soft_target(dev, axis, target);
	sim_planner_go(&ax->planner, target, &limits);
	make_pulses(dev, axis);
}

void sim_axis_run(struct sim_device *dev, unsigned int axis, double speed)
{
	struct sim_axis *ax = &dev->engine.axis[axis];
	struct sim_planner_limits limits = ax->setup.limits;

	clear_soft(dev, axis);
	if (speed != 0 && has_soft_limits(dev, ax)) {
		double far = speed > 0 ? INT32_MAX : INT32_MIN;

		limits.speed = fmin(limits.speed, fabs(speed));
		sim_planner_go(&ax->planner, soft_target(dev, axis, far), &limits);
	} else {
		sim_planner_run(&ax->planner, speed, &limits);
	}
	make_pulses(dev, axis);
}

void sim_axis_jump(struct sim_device *dev, unsigned int axis, int32_t pulses)
{
	struct sim_axis *ax = &dev->engine.axis[axis];

	ax->planner.speed = 0;
	ax->planner.position += pulses;
	clear_soft(dev, axis);
	if (has_soft_limits(dev, ax) && (ax->planner.position > ax->setup.soft_max ||
					 ax->planner.position < ax->setup.soft_min))
		dev->engine.soft_limited |= (uint8_t)(1u << axis);
	make_pulses(dev, axis);
}
