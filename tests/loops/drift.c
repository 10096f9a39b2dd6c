/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * A long run: an axis that turns in one direction for so many cycles, while its counter wraps again
 * and again, is where it is commanded to be, to a count.
 *
 * usage: drift CYCLES
 */
#include <errno.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include "daemon/loops/servo.h"

#define CYCLE_NS UINT64_C(1000000)
#define SPEED 123456.7		/* counts a second */
#define FULL 400000.0		/* ... at an output of 1 */

int main(int argc, char **argv)
{
	struct servo_config config = servo_usual;
	struct servo_input input = { .usable = true };
	struct servo_wish wish = { .alive = true, .velocity = SPEED };
	const uint64_t cycles = argc > 1 ? strtoull(argv[1], NULL, 10) : 0;
	struct servo servo;
	double place = 0, most = 0, output = 0, read = 0;

	config.scale = 1;
	config.speed_most = 2 * SPEED;
	config.speed_jump = 2 * FULL;
	config.gains = (struct servo_gains){ .p = 1e-4, .i = 1e-4, .velocity = 1 / FULL };
	config.follow_least = config.follow_most = 5000;
	config.stall_move = config.runaway_move = 10;
	if (!cycles || errno || servo_init(&servo, &config))
		return 2;
	for (uint64_t i = 1; i <= cycles; i++) {
		const double whole = SPEED / 1000 * (double)i;

		place += output * FULL / 1000;
		read = floor(place);
		input.counts = (int32_t)(uint32_t)(uint64_t)(int64_t)read;
		input.read_ns = i * CYCLE_NS;
		wish.enable = i > 1;
		wish.position = whole - SPEED / 1000;
		output = servo_step(&servo, &input, &wish, i * CYCLE_NS);
		if (i > 100000)
			most = fmax(most, fabs(servo.error));
		if (servo.fault) {
			printf("fault %d after %" PRIu64 " cycles\n", (int)servo.fault, i);
			return 1;
		}
	}
	printf("%" PRIu64 " cycles: error at most %.3f counts, position %.0f\n", cycles, most,
	       servo.position);
	/* no count is lost on the way */
	if (servo.position != read) {
		printf("but it has read %.0f\n", read);
		return 1;
	}
	return !(most < 2);
}
