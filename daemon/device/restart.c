/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Is it still the same start of the same device? Another one has other settings and
 * other counts, so everything is read anew, and a machine that was on stops.
 *
 * The clock (0xCF, milliseconds since it was switched on) is what tells a restart
 * from a bad cable. Of each reading is known that it was made between question and
 * answer. So between two of them the clock must have gone on by at least the time
 * from the first answer to the second question, whatever the network did to the
 * packets, and by at most that from the first question to the second answer; less
 * means that it began anew in between, more that it is another one. Two questions may
 * be under way at once and be answered in either order, so "at least" may be
 * negative. The allowance is for rounding and a poor crystal.
 *
 * The checksum covers eight bits of the clock and nothing of serial number and lock, and
 * a copy that the network kept for too long passes for an answer (pokeys_async(3)).
 * So one answer that does not fit only raises a doubt: it is asked again at once,
 * until then nothing but questions is sent, and only a third answer is believed against
 * all that was known before, if each fits the one before it: two may be damaged in the
 * same bit, and that would stop a machine. The lock only shows: a second one is enough.
 */

#include <string.h>
#include "daemon/device/internal.h"

enum {
	SLACK_MS = 5,
	DRIFT = 64,          /* one part in so many */
	DRIFT_ASLEEP = 1024, /* for hours: what any crystal keeps */
	ODD_MAX = 3,         /* in a row, of which no three fit: no clock at all */
	ALIKE = 3,           /* answers in a row that tell the same other device */
};

/* Could one clock have said both? Its number wraps every 49 days. */
static bool fits(const struct reading *before, const struct reading *now)
{
	const int64_t least = ((int64_t)now->asked_ns - (int64_t)before->came_ns) / (int64_t)MS;
	const int64_t most = ((int64_t)now->came_ns - (int64_t)before->asked_ns) / (int64_t)MS;
	const int64_t slack = SLACK_MS + before->blur_ms + (most > 0 ? most : -most) / DRIFT;
	const int64_t more = (int32_t)(now->ms - before->ms - (uint32_t)least);

	return more >= -slack && more <= most - least + slack;
}

/*
 * Only an answer to the first try says closely when the clock was read; from
 * any other the next one could not be judged.
 */
static void keep(struct restart *restart, const struct reading *now, unsigned int tries)
{
	if (restart->last.known && (tries > 1 || now->asked_ns < restart->last.came_ns))
		return;
	restart->last = *now;
}

/* What was odd was a damaged or belated answer. */
static void reassure(struct device *device)
{
	struct restart *restart = &device->restart;

	device->meter.odd += restart->odd_ticks;
	restart->odd.known = false;
	restart->odd_ticks = restart->odd_alike = 0;
	plan_tick_right(device);
}

static bool is_confirmed(struct restart *restart, const struct reading *now)
{
	const bool alike = restart->odd.known && fits(&restart->odd, now);

	restart->odd_alike = alike ? (uint8_t)(restart->odd_alike + 1) : 1;
	restart->odd = *now;
	return restart->odd_alike >= ALIKE || restart->odd_ticks++ >= ODD_MAX;
}

/* Switched on since the last good reading, and not another clock, or three damaged answers. */
static bool has_begun(const struct reading *before, const struct reading *now)
{
	return now->ms <= (now->came_ns - before->asked_ns) / MS + SLACK_MS;
}

void restart_tick(struct device *device, const mailbox_entry_t *entry)
{
	struct restart *restart = &device->restart;
	struct reading now = {
		.known = true,
		.asked_ns = entry->timestamp_first_sent,
		.came_ns = entry->timestamp_received,
	};
	struct wire_tick_rep tick;

	wire_tick_decode_rep(entry->response_buffer, &tick);
	now.ms = tick.ms;
	if (!restart->last.known || fits(&restart->last, &now)) {
		reassure(device);
		keep(restart, &now, entry->tries);
		restart->clock_known = true;
		restart->fit_ns = now.asked_ns;
	} else if (is_confirmed(restart, &now)) {
		device_say(device, EVENT_REBOOTED, EVENT_WARNING, restart->last.ms, now.ms, 0);
		device->life.rebooted = true;
		device->life.began = has_begun(&restart->last, &now);
		restart_forget(device);
		restart->last = now;
		restart->clock_known = true;
		place_lost(device, UINT8_MAX, PLACE_RESTART);
	} else {
		return;
	}
	device->image.device_tick_ms = now.ms;
}

bool restart_clock_known(const struct device *device)
{
	return device->restart.clock_known;
}

bool restart_judged(const struct device *device, uint64_t since_ns)
{
	return device->restart.fit_ns > since_ns;
}

uint8_t restart_data_alike(struct device *device, const uint8_t reply[WIRE_PK])
{
	struct restart *restart = &device->restart;

	if (memcmp(restart->data, reply + WIRE_PAYLOAD_AT, WIRE_PAYLOAD_LEN))
		restart->data_alike = 0;
	memcpy(restart->data, reply + WIRE_PAYLOAD_AT, WIRE_PAYLOAD_LEN);
	restart->data_alike = (uint8_t)(restart->data_alike + (restart->data_alike < UINT8_MAX));
	return restart->data_alike;
}

void restart_identity(struct device *device, const mailbox_entry_t *entry)
{
	const bool again = restart_data_alike(device, entry->response_buffer) > 1;
	struct restart *restart = &device->restart;
	struct wire_device_data_rep data;
	struct wire_identity who;

	wire_device_data_decode_rep(entry->response_buffer, &data);
	wire_identify(&data, &who);
	if (who.serial == device->identify.identity.serial &&
	    (again || data.locked == device->image.identity.locked)) {
		device->image.identity.locked = data.locked;
		device->meter.odd += again ? 0 : restart->odd_identity;
		restart->odd_identity = 0;
		plan_identity_right(device);
		return;
	}
	restart->odd_identity = again ? (uint8_t)(restart->odd_identity + 1) : 1;
	if (restart->odd_identity >= ALIKE && !device->life.rebooted) {
		device->life.rebooted = true;
		device->life.began = false;
	}
}

bool restart_doubted(const struct device *device)
{
	return device->restart.odd.known || device->restart.odd_identity;
}

static void put_forward(struct reading *reading, uint64_t slept_ms)
{
	reading->ms += (uint32_t)slept_ms;
	reading->blur_ms += (uint32_t)(slept_ms / DRIFT_ASLEEP + SLEPT_BLUR_NS / MS);
}

void restart_slept(struct device *device, uint64_t slept_ns)
{
	struct restart *restart = &device->restart;
	const uint32_t before_ms = restart->last.ms;

	put_forward(&restart->last, slept_ns / MS);
	put_forward(&restart->odd, slept_ns / MS);
	/* begun so shortly before that a restart would make no difference */
	if (restart->last.known && before_ms <= restart->last.blur_ms)
		place_lost(device, UINT8_MAX, PLACE_NO_CLOCK);
}

void restart_forget(struct device *device)
{
	struct restart *restart = &device->restart;

	restart->last.known = restart->odd.known = false;
	restart->odd_ticks = restart->odd_alike = restart->odd_identity = 0;
}
