/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The device's own settings: read, compare, write what differs, read again.
 *
 * Every setting goes the same way, whatever it is (setting.c, setting_axis.c
 * say what is read, wanted and written):
 *
 *	read -> (same) ---------------------------------> done
 *	     -> (differs) -> write -> read -> (same) ---> done
 *	                                   -> (differs) -> write ... -> refused
 *
 * What counts is what the device says afterwards, not that it answered the
 * write. So an ambiguous end of a write needs no care of its own.
 *
 * Nothing is written while the pulse engine moves. It may do so from before:
 * the daemon was killed, or the cable was out, in the middle of a move. The
 * engine is stopped first, always, because whoever commanded that move is not
 * there any more; motion begins again with a fresh edge of machine-on.
 *
 * A setting that the device refuses, or that its lock forbids, does not let
 * the device run: an axis with the wrong direction is worse than a machine
 * that does not start. It is tried again every second, as somebody may be
 * unlocking it just now. Flash is never written here (protocol section 1.12).
 */

#include <string.h>
#include "daemon/device/internal.h"

enum {
	ROUNDS = 3,		/* reads without answer: then the device does not have it */
	WRITES = 3,
};

#define AGAIN_NS (1 * SECOND)
#define STANDING_NS (5 * MS)	/* from look to look while the engine ramps down */

static unsigned int number_of(const struct device *device, const struct setting *setting)
{
	return (unsigned int)(setting - device->configure.setting);
}

/* What an event calls it: the pin, encoder or axis; -1 where there is one only. */
static int64_t event_index(unsigned int number, unsigned int which)
{
	if (number >= SETTING_AXIS)
		return number - SETTING_AXIS;
	if (number == SETTING_PINS)
		return which + 1;
	return number <= SETTING_ENCODER_PINS ? (int64_t)which : -1;
}

static void say_changes(struct device *device, const struct setting *setting)
{
	const unsigned int number = number_of(device, setting);
	unsigned int index;
	const struct setting_kind *kind = setting_kind(number, &index);

	for (unsigned int i = 0; i < 64; i++) {
		if (setting->changed >> i & 1)
			device_say(device, EVENT_CONFIG_CHANGED, EVENT_NOTICE, kind->write,
				   event_index(number, i), kind->written(&setting->value, i));
	}
}

static void refuse(struct device *device, struct setting *setting, uint64_t differs)
{
	const unsigned int number = number_of(device, setting);
	const unsigned int which = differs ? (unsigned int)__builtin_ctzll(differs) : 0;
	unsigned int index;

	setting->state = SETTING_REFUSED;
	if (device->life.fault != POKEYS_FAULT_CONFIG_REFUSED)
		device_say(device, EVENT_CONFIG_REFUSED, EVENT_ERROR,
			   setting_kind(number, &index)->write, event_index(number, which), 0);
}

/* What the device has is known: is it what we want? */
static void compare(struct device *device, struct setting *setting)
{
	unsigned int index;
	const struct setting_kind *kind = setting_kind(number_of(device, setting), &index);
	uint64_t differs = 0;

	if (kind->wanted(device, index))
		differs = kind->merge(device, index, &setting->value, &setting->write);
	if (!differs) {
		setting->state = SETTING_DONE;
		kind->learn(device, index, &setting->value);
		say_changes(device, setting);
	} else if (setting->writes >= WRITES) {
		refuse(device, setting, differs);
	} else {
		setting->changed |= differs;
		setting->state = SETTING_WRITE;
	}
}

/* The engine's status is also how we see that it stands. */
static bool ramping(struct device *device, struct setting *setting)
{
	struct configure *configure = &device->configure;

	if (number_of(device, setting) != SETTING_ENGINE)
		return false;
	switch (setting->value.engine.engine_state) {
	case WIRE_ENGINE_STOPPED:
	case WIRE_ENGINE_STOP_LIMIT:
	case WIRE_ENGINE_STOP_EMERGENCY:
		configure->standing = true;
		return false;
	default:
		configure->standing = false;
		setting->state = SETTING_READ;
		setting->after_ns = device->now_ns + STANDING_NS;
		return true;
	}
}

static void read_ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
		       uint64_t now_ns)
{
	struct device *device = device_of(mailbox);
	struct setting *setting = context;
	unsigned int index;
	const struct setting_kind *kind = setting_kind(number_of(device, setting), &index);

	device->now_ns = now_ns;
	setting->state = SETTING_READ;
	if (entry->state == POKEYS_REQUEST_CANCELLED)
		return;
	if (answered(entry)) {
		memset(&setting->value, 0, sizeof(setting->value));
		wire_decode_rep(kind->read, entry->response_buffer, &setting->value);
		if (!ramping(device, setting))
			compare(device, setting);
		return;
	}
	if (++setting->failures < ROUNDS)
		return;
	if (kind->wanted(device, index))
		refuse(device, setting, 0);
	else
		setting->state = SETTING_DONE;
}

static void write_ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
			uint64_t now_ns)
{
	struct setting *setting = context;

	(void)entry;
	device_of(mailbox)->now_ns = now_ns;
	setting->state = SETTING_READ;
	setting->failures = 0;
}

static void read_setting(struct device *device, struct setting *setting)
{
	union setting_request request;
	unsigned int index;
	const struct setting_kind *kind = setting_kind(number_of(device, setting), &index);

	if (device->now_ns < setting->after_ns)
		return;
	memset(&request, 0, sizeof(request));
	kind->ask(index, &request);
	if (request_send(device, kind->read, &request, read_ended, NULL, setting))
		setting->state = SETTING_READING;
}

static void write_setting(struct device *device, struct setting *setting)
{
	unsigned int index;
	const struct setting_kind *kind = setting_kind(number_of(device, setting), &index);

	if (device->image.capability.pulse_engine >= 2 && !device->configure.standing)
		return;
	if (!request_send(device, kind->write, &setting->write, write_ended, NULL, setting))
		return;
	setting->state = SETTING_WRITING;
	setting->writes++;
}

static void stop_ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
		       uint64_t now_ns)
{
	struct device *device = device_of(mailbox);

	(void)entry;
	(void)context;
	device->now_ns = now_ns;
	device->configure.stop_open = false;
}

static void stop_engine(struct device *device)
{
	static const struct wire_pulse_state_req stop = { .state = WIRE_ENGINE_STOPPED };
	struct configure *configure = &device->configure;
	const struct setting *engine = &configure->setting[SETTING_ENGINE];

	if (configure->standing || configure->stop_open || engine->state != SETTING_READ ||
	    !engine->after_ns || engine->value.engine.engine_state == WIRE_ENGINE_STOPPING)
		return;
	configure->stop_open = request_send(device, WIRE_OP_PULSE_STATE, &stop, stop_ended, NULL,
					    NULL);
}

static void block(struct device *device, enum pokeys_fault fault)
{
	life_fault(device, fault);
	device->configure.again_ns = device->now_ns + AGAIN_NS;
}

void configure_begin(struct device *device)
{
	struct configure *configure = &device->configure;

	memset(configure, 0, sizeof(*configure));
	device->image.encoder_enabled = 0;
	decode_encoders_forget(device);
	for (unsigned int i = 0; i < SETTINGS; i++) {
		unsigned int index;
		const struct setting_kind *kind = setting_kind(i, &index);

		configure->setting[i].state = kind->has(device, index) ? SETTING_READ : SETTING_DONE;
	}
}

/* Nothing is open that would end in settings begun anew. */
static bool idle(const struct configure *configure)
{
	for (unsigned int i = 0; i < SETTINGS; i++) {
		const uint8_t state = configure->setting[i].state;

		if (state == SETTING_READING || state == SETTING_WRITING)
			return false;
	}
	return !configure->stop_open;
}

/* How many axes there are, the engine's status says. */
static bool axis_waits(struct device *device, struct setting *setting)
{
	const unsigned int number = number_of(device, setting);

	if (number < SETTING_AXIS || setting->state != SETTING_READ)
		return false;
	if (device->configure.setting[SETTING_ENGINE].state != SETTING_DONE)
		return true;
	if (number - SETTING_AXIS >= device->image.capability.axes)
		setting->state = SETTING_DONE;
	return false;
}

/* One step of one setting; false when it needs no more. */
static bool step(struct device *device, struct setting *setting)
{
	if (axis_waits(device, setting))
		return true;
	switch ((enum setting_state)setting->state) {
	case SETTING_READ:
		read_setting(device, setting);
		return true;
	case SETTING_WRITE:
		if (device->image.identity.locked)
			block(device, POKEYS_FAULT_LOCKED);
		else
			write_setting(device, setting);
		return true;
	case SETTING_REFUSED:
		block(device, POKEYS_FAULT_CONFIG_REFUSED);
		return true;
	case SETTING_READING:
	case SETTING_WRITING:
		return true;
	case SETTING_DONE:
		return false;
	}
	return false;
}

void configure_cycle(struct device *device)
{
	struct configure *configure = &device->configure;
	bool busy = configure->stop_open;

	identify_alive(device);
	if (configure->again_ns && (device->now_ns < configure->again_ns || !idle(configure)))
		return;
	if (configure->again_ns)
		configure_begin(device);
	if (device->image.capability.pulse_engine >= 2)
		stop_engine(device);
	for (unsigned int i = 0; i < SETTINGS && !configure->again_ns; i++)
		busy = step(device, &configure->setting[i]) || busy;
	if (!busy && !configure->again_ns)
		life_enter(device, POKEYS_LINK_RUNNING, POKEYS_FAULT_NONE);
}
