/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * From an output of -1 to 1 to the wires of a motor's amplifier. Pure; realtime.
 */
#ifndef LOOPS_DRIVE_H
#define LOOPS_DRIVE_H

#include <stdbool.h>
#include <stdint.h>

enum drive_kind {
	DRIVE_SIGN,      /* a PWM, and a direction */
	DRIVE_ANTIPHASE, /* a PWM whose middle is standstill; needs an enable wire */
	DRIVE_TWO_PWM,   /* a PWM for each direction */
};

struct drive_config {
	enum drive_kind kind;
	/*
	 * SIGN: the PWM is 0 so long before and after the direction changes, from when the device
	 * has acknowledged that; a cycle at least.
	 */
	uint64_t dwell_ns;
};

/* It begins with zeros. The direction of before is not known then. */
struct drive {
	bool ready;  /* it was enabled, at standstill */
	bool known;  /* the direction was set, and has been for the dwell */
	bool turned; /* it was set, and the dwell after that is not over */
	bool reverse;
	uint64_t since_ns; /* the device has had the PWM off, or the direction; 0: not yet */
};

/* What goes to the amplifier. */
struct drive_wires {
	double duty[2]; /* of the PWMs, 0 to 1; the second one of TWO_PWM only */
	bool reverse;   /* the direction */
	bool enable;
};

/* The last output, this one, is on the wires: none but 0 is while the direction changes. */
bool drive_passes(const struct drive *drive, const struct drive_config *config, double output);

/*
 * One cycle. An axis that is not enabled has no output, whatever `output` is. `settled`: the device
 * has acknowledged what the last cycle had on the wires.
 */
struct drive_wires drive_step(struct drive *drive, const struct drive_config *config, double output,
			      bool enabled, bool settled, uint64_t now_ns);

#endif
