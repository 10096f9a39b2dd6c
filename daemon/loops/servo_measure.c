/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Where the axis is, and how fast it moves.
 *
 * Speeds are those between the times of the readings, not between cycles: a reply that comes late
 * is no slow motor. Nor is it an encoder that jumps with the next reply, which comes in time: a
 * count may be as old as its question. Once the device was lost, its counters have begun anew, or
 * the encoder has jumped, nobody knows how much it has moved, and the axis is not homed any more.
 * Its position goes on from the last one, so that a position that is shown never jumps by itself.
 */

#include <math.h>

#include "daemon/loops/servo_part.h"

#define JUMP_COUNTS 4		/* more than the fastest speed explains: edges of one moment */
#define FUTURE_NS UINT64_C(1000000)	/* clocks and roundings of the caller */
#define KNOWN_MOST 1073741824.0	/* counts; what may be more may be anything */

static void keep_times(struct servo *servo, const struct servo_input *input, uint64_t read_ns)
{
	servo->read_ns = read_ns;
	servo->asked_ns = input->asked_ns && input->asked_ns < read_ns ? input->asked_ns : read_ns;
}

static void begin(struct servo *servo, const struct servo_input *input, uint64_t read_ns)
{
	servo->primed = true;
	servo->last = input->counts;
	servo->epoch = input->epoch;
	servo->slips = input->slips;
	keep_times(servo, input, read_ns);
	servo->rate = servo->raw_rate = 0;
}

static enum servo_fault lose(struct servo *servo, enum servo_fault found)
{
	servo->primed = servo->homed = false;
	servo->rate = servo->raw_rate = 0;
	return found;
}

/* A count that is newer than the last one. */
static enum servo_fault take(struct servo *servo, const struct servo_input *input, uint64_t read_ns,
			     struct servo_way *way)
{
	const struct servo_config *config = &servo->config;
	const int32_t moved = (int32_t)((uint32_t)input->counts - (uint32_t)servo->last);
	const double seconds = (double)(read_ns - servo->read_ns) / SECOND;
	const double since_s = (double)(read_ns - servo->asked_ns) / SECOND;
	const double explained = config->speed_jump * fabs(config->scale) * since_s + JUMP_COUNTS;

	if (fabs((double)moved) > explained || explained > KNOWN_MOST)
		return lose(servo, SERVO_JUMP);
	servo->last = input->counts;
	keep_times(servo, input, read_ns);
	servo->counts += moved;
	servo->position = (double)servo->counts / config->scale + servo->offset;
	way->moved = moved / config->scale;
	way->seconds = seconds;
	servo->raw_rate = way->moved / seconds;
	servo->rate += (servo->raw_rate - servo->rate) * seconds / (config->smooth + seconds);
	return SERVO_FINE;
}

enum servo_fault servo_stopped(const struct servo_input *input)
{
	if (input->emergency)
		return SERVO_EMERGENCY;
	return input->heater ? SERVO_HEATER : SERVO_FINE;
}

enum servo_fault servo_measure(struct servo *servo, const struct servo_input *input,
			       struct servo_way *way, uint64_t now_ns)
{
	/* One from the future would never be old; a little of it is that of two clocks. */
	const bool possible = input->read_ns && since(now_ns, input->read_ns) <= FUTURE_NS;
	const uint64_t read_ns = input->read_ns < now_ns ? input->read_ns : now_ns;
	enum servo_fault found = SERVO_FINE;

	*way = (struct servo_way){ 0 };
	if (!input->usable)
		return lose(servo, SERVO_DEVICE);
	if (servo->primed && servo->epoch != input->epoch)
		return lose(servo, SERVO_DEVICE);
	if (servo->primed && servo->slips != input->slips)
		return lose(servo, SERVO_JUMP);
	if (!servo->primed && possible)
		begin(servo, input, read_ns);
	else if (servo->primed && possible && read_ns > servo->read_ns)
		found = take(servo, input, read_ns, way);
	if (found)
		return found;
	if (!servo->primed || since(servo->read_ns, now_ns) > servo->config.stale_ns)
		return SERVO_STALE;
	return servo_stopped(input);
}
