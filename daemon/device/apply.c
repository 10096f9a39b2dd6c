/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * One setting on its way: read, compared, written, put into effect, refused.
 *
 * configure.c decides when; what is special to a setting is asked of its kind.
 * A setting of pokeysd.conf's that the device refuses, or that its lock forbids,
 * does not let the device run: an axis with the wrong direction is worse than a
 * machine that does not start. What only a commander wishes is refused and
 * reported instead; the commander is there to see it.
 */

#include <string.h>
#include "daemon/device/internal.h"

enum {
	ROUNDS = 3, /* reads without answer: then the device does not have it */
	WRITES = 3,
	UNANSWERED = 12, /* writes, each with all its retries */
};

#define REBOOT_NS (1200 * MS)	/* of the pulse engine, protocol section 3.24.3 */
#define AGAIN_NS (2 * SECOND)	/* what was not answered is asked again while the link runs */
#define STANDING_NS (5 * MS)	/* from look to look while the engine ramps down */

unsigned int setting_number(const struct device *device, const struct setting *setting)
{
	return (unsigned int)(setting - device->configure.setting);
}

/* One table for all axes. */
static bool by_axis(unsigned int number)
{
	return number == SETTING_BACKLASH || number == SETTING_POSTEP ||
	       number == SETTING_POSTEP_MODES;
}

/* What an event calls it: the pin, encoder or axis; -1 where there is one only. */
static int64_t event_index(unsigned int number, unsigned int which)
{
	if (number >= SETTING_AXIS)
		return number - SETTING_AXIS;
	if (number == SETTING_PINS)
		return which + 1;
	if (by_axis(number))
		return which < POKEYS_AXES ? (int64_t)which : -1;
	return number <= SETTING_ENCODER_PINS ? (int64_t)which : -1;
}

/* One event for each of these parts of a setting. Returns how many. */
static uint32_t say_each(struct device *device, const struct setting *setting, uint64_t parts,
			 enum event_code code, enum event_level level)
{
	const unsigned int number = setting_number(device, setting);
	unsigned int index;
	const struct setting_kind *kind = setting_kind(number, &index);
	uint32_t count = 0;

	for (unsigned int i = 0; i < 64; i++) {
		if (!(parts >> i & 1))
			continue;
		device_say(device, code, level, kind->write, event_index(number, i),
			   kind->written(&setting->value, i));
		count++;
	}
	return count;
}

static void say_changes(struct device *device, const struct setting *setting)
{
	say_each(device, setting, setting->changed, EVENT_CONFIG_CHANGED, EVENT_NOTICE);
}

uint32_t setting_say_foreign(struct device *device, const struct setting *setting, uint64_t foreign)
{
	return say_each(device, setting, foreign, EVENT_CONFIG_FOREIGN, EVENT_WARNING);
}

bool setting_blocks(const struct device *device, const struct setting *setting)
{
	const struct pokeys_settings *want = &device->config.settings;
	union setting_request request;
	unsigned int index;
	const struct setting_kind *kind = setting_kind(setting_number(device, setting), &index);

	if (running(device) || kind->dispensable)
		return false;
	if (!setting->known)
		return kind->vital || kind->wanted(want, index);
	return kind->merge(want, index, &setting->value, &request) != 0;
}

void setting_refuse(struct device *device, struct setting *setting, uint64_t differs)
{
	const bool silent = setting->failures >= ROUNDS || setting->unanswered >= UNANSWERED;
	const unsigned int number = setting_number(device, setting);
	const unsigned int none = by_axis(number) ? SETTING_ENGINE_BIT : 0;
	const unsigned int which = differs ? (unsigned int)__builtin_ctzll(differs) : none;
	unsigned int index;
	const struct setting_kind *kind = setting_kind(number, &index);

	setting->state = SETTING_REFUSED;
	wish_refuse(device, kind->name,
		    number >= SETTING_AXIS ? (uint8_t)index :
		    which < none || !none  ? (uint8_t)which :
					     0);
	setting->after_ns = device->now_ns + AGAIN_NS;
	if (device->life.fault != POKEYS_FAULT_CONFIG_REFUSED && !setting->said)
		device_say(device, EVENT_CONFIG_REFUSED, EVENT_ERROR, kind->write,
			   event_index(number, which),
			   silent                        ? SETTING_UNANSWERED :
			   device->image.identity.locked ? SETTING_LOCKED :
							   SETTING_UNTAKEN);
	setting->said = true;
}

/* What the device has is known: is it what we want? */
static void compare(struct device *device, struct setting *setting)
{
	unsigned int index;
	const struct setting_kind *kind = setting_kind(setting_number(device, setting), &index);
	const uint64_t differs = kind->merge(&device->wishes.wanted, index, &setting->value,
					     &setting->write);

	if (setting->watched && watch_settled(device, setting, differs))
		return;
	if (!differs) {
		setting->state = SETTING_DONE;
		wish_settled(device, kind->name);
		say_changes(device, setting);
		setting->changed = 0;
		setting->writes = setting->unanswered = 0;
		setting->said = false;
	} else if (setting->writes >= WRITES || setting->unanswered >= UNANSWERED) {
		setting_refuse(device, setting, differs);
	} else {
		setting->changed |= differs;
		setting->state = SETTING_WRITE;
	}
}

/*
 * The engine's status is also how we see that it stands; while the link runs
 * motion.c sees to that.
 */
static bool ramping(struct device *device, struct setting *setting)
{
	struct configure *configure = &device->configure;

	if (setting_number(device, setting) != SETTING_ENGINE || running(device))
		return false;
	switch (setting->value.engine.engine_state) {
	case WIRE_ENGINE_STOPPED:
	case WIRE_ENGINE_STOP_LIMIT:
	case WIRE_ENGINE_STOP_EMERGENCY:
		configure->standing = true;
		return false;
	default:
		configure->standing = false;
		configure->found_running |= setting->value.engine.engine_state ==
					    WIRE_ENGINE_RUNNING;
		setting->state = SETTING_READ;
		setting->after_ns = device->now_ns + STANDING_NS;
		return true;
	}
}

/*
 * An axis that is set up as before is homed as before: settings are read again while the
 * machine is on, and that must not touch it.
 */
static void judge_homed(struct device *device, const struct setting *setting,
			const union setting_value *before)
{
	const unsigned int number = setting_number(device, setting);

	if (number >= SETTING_AXIS &&
	    (!setting->known || memcmp(before, &setting->value, sizeof(*before)) != 0))
		device->image.engine.axis[number - SETTING_AXIS].homed = 0;
}

/* What an encoder with other terminals or edges counts does not go on from before. */
static void judge_counts(struct device *device, const struct setting *setting,
			 const union setting_value *before)
{
	if (setting->known)
		servoing_written(device,
				 setting_encoders_changed(device, setting_number(device, setting),
							  before, &setting->value));
}

/* One that is read in its turn is reported if it says something else than before. */
static void report(struct device *device, const struct setting *setting,
		   const union setting_value *before)
{
	unsigned int index;
	const struct setting_kind *kind = setting_kind(setting_number(device, setting), &index);
	struct pokeys_settings was = { 0 }, is = { 0 };

	if (setting->watched) {
		kind->report(&was, index, before);
		kind->report(&is, index, &setting->value);
		if (!memcmp(&was, &is, sizeof(is)))
			return;
	}
	kind->report(wish_known(device), index, &setting->value);
}

/* False: it is not believed yet. */
static bool learn(struct device *device, struct setting *setting, const mailbox_entry_t *entry)
{
	const union setting_value before = setting->value;
	union setting_value now;
	unsigned int index;
	const struct setting_kind *kind = setting_kind(setting_number(device, setting), &index);

	memset(&now, 0, sizeof(now));
	wire_decode_rep(kind->read, entry->response_buffer, &now);
	setting->failures = 0;
	if (setting->watched && !watch_believes(device, setting, &now))
		return false;
	setting->value = now;
	judge_homed(device, setting, &before);
	judge_counts(device, setting, &before);
	setting->known = true;
	setting->asked_ns = entry->timestamp_first_sent;
	kind->learn(device, index, &setting->value);
	report(device, setting, &before);
	return true;
}

static void read_ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
		       uint64_t now_ns)
{
	struct device *device = device_of(mailbox);
	struct setting *setting = context;
	unsigned int index;
	const struct setting_kind *kind = setting_kind(setting_number(device, setting), &index);

	device->now_ns = now_ns;
	setting->state = SETTING_READ;
	if (entry->state == POKEYS_REQUEST_CANCELLED)
		return;
	if (answered(entry)) {
		if (learn(device, setting, entry) && !ramping(device, setting))
			compare(device, setting);
		return;
	}
	if (++setting->failures < ROUNDS)
		return;
	if (setting->watched) {
		watch_unanswered(setting);
		return;
	}
	if (kind->vital || kind->wanted(&device->wishes.wanted, index))
		setting_refuse(device, setting, 0);
	else
		setting->state = SETTING_DONE;
}

static void write_ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
			uint64_t now_ns)
{
	struct device *device = device_of(mailbox);
	struct setting *setting = context;
	unsigned int index;
	const struct setting_kind *kind = setting_kind(setting_number(device, setting), &index);

	device->now_ns = now_ns;
	setting->state = SETTING_READ;
	setting->failures = 0;
	if (answered(entry) && kind->taken)
		kind->taken(device, &setting->write);
	if (answered(entry))
		setting->writes++;
	else
		setting->unanswered++;
	if (entry->state != POKEYS_REQUEST_CANCELLED && kind->needs_effect &&
	    kind->needs_effect(&setting->value, &setting->write))
		setting->state = SETTING_EFFECT;
}

/* It comes back with positions of its own, and perhaps with another number of axes. */
static void reboot_ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
			 uint64_t now_ns)
{
	struct device *device = device_of(mailbox);
	struct setting *setting = context;

	(void)entry;
	device->now_ns = now_ns;
	setting->state = SETTING_READ;
	setting->after_ns = now_ns + REBOOT_NS;
	for (unsigned int i = SETTING_EMERGENCY; i < SETTINGS; i++) {
		unsigned int index;

		if (device->configure.setting[i].state == SETTING_DONE &&
		    setting_kind(i, &index)->has(device, index))
			device->configure.setting[i].state = SETTING_READ;
		device->configure.setting[i].after_ns = setting->after_ns;
	}
	memset(&device->configure.synced, 0, sizeof(device->configure.synced));
	place_lost(device, UINT8_MAX, PLACE_ENGINE);
	device->life.patient_until_ns = setting->after_ns;
	device_threading_forget(device);
	motion_displaced(device);
}

bool setting_read(struct device *device, struct setting *setting)
{
	union setting_request request;
	unsigned int index;
	const struct setting_kind *kind = setting_kind(setting_number(device, setting), &index);

	/* while an index is awaited the device does not say what it was set up for */
	if (device->now_ns < setting->after_ns || (kind->ready && !kind->ready(device)) ||
	    (setting == &device->configure.setting[SETTING_FAST_ENCODERS] &&
	     operation_index_awaited(device)))
		return false;
	memset(&request, 0, sizeof(request));
	kind->ask(index, &request);
	if (!request_send(device, kind->read, &request, read_ended, NULL, setting))
		return false;
	setting->state = SETTING_READING;
	return true;
}

bool setting_may_write(const struct device *device)
{
	if (running(device))
		return !device->safe.permitted && motion_standing(device) &&
		       servoing_standing(device) && device->now_ns >= device->life.patient_until_ns;
	return device->image.capability.pulse_engine < 2 || device->configure.standing;
}

/* Sent again: an output that it carries may have to be off by now. */
static void refresh(pokeys_device_t *mailbox, mailbox_entry_t *entry, void *context)
{
	struct device *device = device_of(mailbox);
	struct setting *setting = context;
	unsigned int index;
	const struct setting_kind *kind = setting_kind(setting_number(device, setting), &index);

	if (kind->take_along && kind->take_along(device, &setting->write))
		wire_encode_req(kind->write, entry->request_buffer, &setting->write);
}

bool setting_write(struct device *device, struct setting *setting)
{
	unsigned int index;
	const struct setting_kind *kind = setting_kind(setting_number(device, setting), &index);

	if (!setting_may_write(device) ||
	    (kind->take_along && !kind->take_along(device, &setting->write)) ||
	    !request_send(device, kind->write, &setting->write, write_ended, refresh, setting))
		return false;
	setting->state = SETTING_WRITING;
	return true;
}

bool setting_effect(struct device *device, struct setting *setting)
{
	unsigned int index;

	return setting_kind(setting_number(device, setting), &index)->effect(device, setting);
}

void setting_missing(struct device *device, struct setting *setting)
{
	unsigned int index;
	const struct setting_kind *kind = setting_kind(setting_number(device, setting), &index);

	if (!kind->since || !kind->wanted(&device->wishes.wanted, index))
		return;
	wish_refuse(device, kind->name, 0);
	if (device->life.fault != POKEYS_FAULT_CONFIG_REFUSED &&
	    device->life.fault != POKEYS_FAULT_LOCKED && !setting->said)
		device_say(device, EVENT_CONFIG_MISSING, EVENT_ERROR, kind->write, kind->since,
			   kind->only_57cnc && device->image.identity.hardware != WIRE_HW_57CNC);
	setting->said = true;
}

bool setting_reboot(struct device *device, struct setting *setting)
{
	if (!setting_may_write(device) ||
	    !request_send(device, WIRE_OP_PULSE_REBOOT, NULL, reboot_ended, NULL, setting))
		return false;
	setting->state = SETTING_WRITING;
	return true;
}
