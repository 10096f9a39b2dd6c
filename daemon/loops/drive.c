/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * PWM and direction go to the device by different requests, so one arrives before the other, or is
 * lost and sent again. If the direction changed while the PWM is on, the motor would get the full
 * voltage the wrong way for that time. So the PWM is 0 before and after, and time counts only from
 * the device's acknowledgement. The first direction is a change as well: nobody knows what the wire
 * was before.
 *
 * What is on the wires before the amplifier is enabled is not known either: a write may have been
 * lost, and with ANTIPHASE a duty of 0 is full speed backwards. So it is enabled only after the
 * device has acknowledged the duty of standstill.
 */

#include "daemon/loops/drive.h"

#include <math.h>

#include "daemon/loops/duration.h"

/* The device has had it for the dwell, and a cycle at least. */
static bool dwelt(struct drive *drive, const struct drive_config *config, bool settled,
		  uint64_t now_ns)
{
	if (!settled)
		drive->since_ns = 0;
	else if (!drive->since_ns)
		drive->since_ns = now_ns;
	return drive->since_ns && now_ns > drive->since_ns &&
	       since(drive->since_ns, now_ns) >= config->dwell_ns;
}

/* The duty of SIGN. */
static double signed_duty(struct drive *drive, const struct drive_config *config, double output,
			  bool settled, uint64_t now_ns)
{
	const bool reverse = output < 0;

	if (drive->known && (output == 0 || reverse == drive->reverse))
		return fabs(output);
	if (drive->known) {
		*drive = (struct drive){ .ready = drive->ready, .reverse = drive->reverse };
		return 0; /* what is settled is still the PWM of before */
	}
	if (!dwelt(drive, config, settled, now_ns))
		return 0;
	drive->since_ns = 0;
	if (drive->turned && reverse == drive->reverse) {
		drive->turned = false;
		drive->known = true;
		return fabs(output);
	}
	drive->turned = true;
	drive->reverse = reverse;
	return 0;
}

bool drive_passes(const struct drive *drive, const struct drive_config *config, double output)
{
	return drive->ready && (config->kind != DRIVE_SIGN || output == 0 ||
				(drive->known && drive->reverse == (output < 0)));
}

struct drive_wires drive_step(struct drive *drive, const struct drive_config *config, double output,
			      bool enabled, bool settled, uint64_t now_ns)
{
	struct drive_wires wires = { .enable = false };

	drive->ready = enabled && (drive->ready || settled);
	wires.enable = drive->ready;
	/* what is no number would be a limit for fmin() */
	output = drive->ready && isfinite(output) ? fmax(fmin(output, 1), -1) : 0;
	switch (config->kind) {
	case DRIVE_SIGN:
		wires.duty[0] = signed_duty(drive, config, output, settled, now_ns);
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
