/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Where the axis is, and how fast it moves.
 *
 * Speeds are those between the times of the readings, not between cycles: a reply that comes late
 * is no slow motor. Once the device was lost or the encoder has jumped, nobody knows how much it
 * moved meanwhile, and the axis is not homed any more. Its position goes on from the last one, so
 * that a position that is shown never jumps by itself.
 */

#include <math.h>

#include "daemon/loops/servo_part.h"

#define JUMP_COUNTS 4		/* more than the fastest speed explains: edges of one moment */

static void begin(struct servo *servo, const struct servo_input *input)
{
	servo->primed = true;
	servo->last = input->counts;
	servo->read_ns = input->read_ns;
	servo->rate = servo->raw_rate = 0;
}

/* One from the future would never be old. */
static bool is_old(const struct servo *servo, uint64_t read_ns, uint64_t now_ns)
{
	return !read_ns || since(now_ns, read_ns) > servo->config.stale_ns ||
	       since(read_ns, now_ns) > servo->config.stale_ns;
}

/* A count that is newer than the last one. */
static enum servo_fault take(struct servo *servo, const struct servo_input *input,
			     struct servo_way *way)
{
	const struct servo_config *config = &servo->config;
	const int32_t moved = (int32_t)((uint32_t)input->counts - (uint32_t)servo->last);
	const double seconds = (double)(input->read_ns - servo->read_ns) / SECOND;
	const double explained = config->speed_jump * fabs(config->scale) * seconds;

	servo->last = input->counts;
	servo->read_ns = input->read_ns;
	servo->counts += moved;
	servo->counted = servo->counted || moved;
	servo->position = (double)servo->counts / config->scale + servo->offset;
	if (fabs((double)moved) > explained + JUMP_COUNTS) {
		servo->homed = false;
		return SERVO_JUMP;
	}
	way->moved = moved / config->scale;
	way->seconds = seconds;
	servo->raw_rate = way->moved / seconds;
	servo->rate += (servo->raw_rate - servo->rate) * seconds / (config->smooth + seconds);
	return SERVO_FINE;
}

enum servo_fault servo_measure(struct servo *servo, const struct servo_input *input,
			       struct servo_way *way, uint64_t now_ns)
{
	*way = (struct servo_way){ 0 };
	if (!input->usable) {
		servo->primed = servo->homed = false;
		servo->rate = servo->raw_rate = 0;
		return SERVO_DEVICE;
	}
	if (is_old(servo, input->read_ns, now_ns))
		return SERVO_STALE;
	if (!servo->primed)
		begin(servo, input);
	if (input->read_ns > servo->read_ns) {
		const enum servo_fault found = take(servo, input, way);

		if (found)
			return found;
	}
	return input->emergency ? SERVO_EMERGENCY : SERVO_FINE;
}
