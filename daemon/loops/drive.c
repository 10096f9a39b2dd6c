/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * PWM and direction go to the device by different requests, so one arrives before the other. If
 * the direction changed while the PWM is on, the motor would get the full voltage the wrong way
 * for that time. So the PWM is 0 for the dwell before and after.
 */

#include "daemon/loops/drive.h"

#include <math.h>

#include "daemon/loops/duration.h"

/* The duty of SIGN: 0 while the direction is not right, or has just changed. */
static double signed_duty(struct drive *drive, const struct drive_config *config, double output,
			  uint64_t now_ns)
{
	const bool reverse = output < 0;

	if (output != 0 && reverse != drive->reverse && drive->quiet_ns &&
	    since(drive->quiet_ns, now_ns) >= config->dwell_ns) {
		drive->reverse = reverse;
		drive->changed_ns = now_ns;
	}
	if (reverse != drive->reverse ||
	    (drive->changed_ns && since(drive->changed_ns, now_ns) < config->dwell_ns))
		return 0;
	return fabs(output);
}

struct drive_wires drive_step(struct drive *drive, const struct drive_config *config,
			      double output, bool enabled, uint64_t now_ns)
{
	struct drive_wires wires = { .enable = enabled };

	/* what is no number would be a limit for fmin() */
	output = enabled && isfinite(output) ? fmax(fmin(output, 1), -1) : 0;
	switch (config->kind) {
	case DRIVE_SIGN:
		wires.duty[0] = signed_duty(drive, config, output, now_ns);
		if (wires.duty[0] > 0)
			drive->quiet_ns = 0;
		else if (!drive->quiet_ns)
			drive->quiet_ns = now_ns;
		wires.reverse = drive->reverse;
		break;
	case DRIVE_ANTIPHASE:
		wires.duty[0] = (1 + output) / 2;
		break;
	case DRIVE_TWO_PWM:
		wires.duty[output < 0] = fabs(output);
		break;
	}
	return wires;
}
