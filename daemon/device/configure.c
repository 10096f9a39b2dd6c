/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * The device's own settings: read, compare, write what differs, read again.
 *
 * Every setting goes the same way, whatever it is (setting_*.c say what is read,
 * wanted and written):
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
 * A setting that pokeysd.conf wants and the device refuses, or its lock forbids,
 * keeps the link from running. It is tried again every second, as somebody may
 * be unlocking it just now. Flash is never written here (protocol section 1.12).
 *
 * While the link runs, all this goes on beside the fast requests, one request at
 * a time. Reading is always allowed; a write waits until motion is not permitted
 * and the engine is seen to stand, and until it has ended nothing may begin to
 * move.
 */

#include <string.h>
#include "daemon/device/internal.h"

#define AGAIN_NS (1 * SECOND)

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
	life_block(device, fault);
	device->configure.again_ns = device->now_ns + AGAIN_NS;
}

void configure_begin(struct device *device)
{
	struct configure *configure = &device->configure;

	memset(configure, 0, sizeof(*configure));
	device->image.encoder_enabled = 0;
	decode_encoders_forget(device);
	device_threading_forget(device);
	for (unsigned int i = 0; i < SETTINGS; i++) {
		unsigned int index;
		const struct setting_kind *kind = setting_kind(i, &index);

		configure->setting[i].state = kind->has(device, index) ? SETTING_READ :
									 SETTING_DONE;
		if (configure->setting[i].state == SETTING_DONE)
			setting_missing(device, &configure->setting[i]);
	}
}

/* Whether a setting that is at rest has to be looked at once more. */
static bool look_again(const struct device *device, const struct setting *setting, bool all)
{
	union setting_request request;
	unsigned int index;
	const struct setting_kind *kind = setting_kind(setting_number(device, setting), &index);

	if (!kind->has(device, index))
		return false;
	/* of what has to be made ready, what is known may not be the device's last word */
	return all || !setting->known || kind->ready ||
	       kind->merge(&device->wishes.wanted, index, &setting->value, &request) != 0;
}

void configure_again(struct device *device, bool all)
{
	struct configure *configure = &device->configure;

	for (unsigned int i = 0; i < SETTINGS; i++) {
		struct setting *setting = &configure->setting[i];
		unsigned int index;

		if (setting->watched) {
			setting->watched = setting->said = false;
			setting->writes = setting->unanswered = 0;
			setting->changed = 0;
		}
		if (setting->state != SETTING_DONE && setting->state != SETTING_REFUSED &&
		    setting->state != SETTING_WRITE)
			continue;
		setting->state = look_again(device, setting, all) ? SETTING_READ : SETTING_DONE;
		setting->failures = 0;
		setting->writes = setting->unanswered = 0;
		setting->changed = 0;
		setting->said = false;
		if (!setting_kind(i, &index)->has(device, index))
			setting_missing(device, setting);
	}
	if (configure->again_ns)
		configure->again_ns = device->now_ns;
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
	const unsigned int number = setting_number(device, setting);
	const uint8_t engine = device->configure.setting[SETTING_ENGINE].state;

	if (number < SETTING_AXIS || setting->state != SETTING_READ)
		return false;
	if (engine != SETTING_DONE && engine != SETTING_REFUSED)
		return true;
	if (number - SETTING_AXIS >= device->image.capability.axes)
		setting->state = SETTING_DONE;
	return false;
}

/* The lock forbids what is wanted. */
static void step_locked(struct device *device, struct setting *setting)
{
	if (!setting_blocks(device, setting)) {
		setting_refuse(device, setting, setting->changed);
		return;
	}
	if (device->life.fault != POKEYS_FAULT_LOCKED)
		device_say(device, EVENT_LOCKED, EVENT_ERROR, LOCK_CONFIGURATION, 0, 0);
	block(device, POKEYS_FAULT_LOCKED);
}

/* One step of one setting; false when it needs no more. */
static bool step(struct device *device, struct setting *setting)
{
	if (axis_waits(device, setting))
		return true;
	switch ((enum setting_state)setting->state) {
	case SETTING_READ:
		setting_read(device, setting);
		return true;
	case SETTING_WRITE:
		if (device->image.identity.locked)
			step_locked(device, setting);
		else
			setting_write(device, setting);
		return true;
	case SETTING_EFFECT:
		setting_effect(device, setting);
		return true;
	case SETTING_REFUSED:
		if (setting_blocks(device, setting))
			block(device, POKEYS_FAULT_CONFIG_REFUSED);
		return false;
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
	if (restart_doubted(device))
		return;
	if (device->life.blocked)
		plan_blocked(device);
	if (!access_cycle(device))
		return;
	if (configure->again_ns && (device->now_ns < configure->again_ns || !idle(configure)))
		return;
	if (configure->again_ns)
		configure_begin(device);
	if (device->image.capability.pulse_engine >= 2)
		stop_engine(device);
	for (unsigned int i = 0; i < SETTINGS && !configure->again_ns; i++)
		busy = step(device, &configure->setting[i]) || busy;
	if (!busy && !configure->again_ns && !plan_busy(device))
		life_enter(device, POKEYS_LINK_RUNNING, POKEYS_FAULT_NONE);
}

/* Beside the fast requests: whether this setting wants a request, and could send it. */
static bool send_one(struct device *device, struct setting *setting)
{
	if (axis_waits(device, setting))
		return false;
	switch ((enum setting_state)setting->state) {
	case SETTING_READ:
		return setting_read(device, setting);
	case SETTING_WRITE:
		if (!device->image.identity.locked)
			return setting_write(device, setting);
		step_locked(device, setting);
		return false;
	case SETTING_EFFECT:
		return setting_effect(device, setting);
	case SETTING_REFUSED:
		/* that nobody answered may have been the cable's fault */
		if (setting->failures && device->now_ns >= setting->after_ns)
			return setting_read(device, setting);
		break;
	case SETTING_READING:
	case SETTING_WRITING:
	case SETTING_DONE:
		break;
	}
	return false;
}

bool configure_send(struct device *device)
{
	struct configure *configure = &device->configure;

	if (!idle(configure))
		return false;
	watch_turn(device);
	for (unsigned int i = 0; i < SETTINGS; i++) {
		if (send_one(device, &configure->setting[i]))
			return true;
	}
	return false;
}

bool configure_writing(const struct device *device)
{
	const struct setting *engine = &device->configure.setting[SETTING_ENGINE];

	/* what is yet to take effect cannot once motion is permitted, and waits for its end */
	for (unsigned int i = 0; i < SETTINGS; i++) {
		const uint8_t state = device->configure.setting[i].state;

		if (state == SETTING_WRITING ||
		    (state == SETTING_EFFECT && setting_may_write(device)))
			return true;
	}
	return engine->state == SETTING_READ && device->now_ns < engine->after_ns;
}

enum pokeys_config_state configure_state(const struct device *device)
{
	const struct configure *configure = &device->configure;
	unsigned int busy = 0, refused = device->wishes.refused != POKEYS_SETTING_NONE;
	bool waits = false;

	if (device->image.link != POKEYS_LINK_CONFIGURING && !running(device))
		return POKEYS_CONFIG_UNKNOWN;
	for (unsigned int i = 0; i < SETTINGS; i++) {
		const struct setting *setting = &configure->setting[i];
		const uint8_t state = setting->state;

		if (setting->watched) {
			refused += setting->differed != 0;
			continue;
		}
		busy += state != SETTING_DONE && state != SETTING_REFUSED;
		refused += state == SETTING_REFUSED;
		waits = waits || state == SETTING_WRITE || state == SETTING_EFFECT;
	}
	if (configure->again_ns)
		return POKEYS_CONFIG_REFUSED;
	if (busy && waits && running(device) && !setting_may_write(device))
		return POKEYS_CONFIG_WAITING;
	if (busy)
		return POKEYS_CONFIG_APPLYING;
	return refused ? POKEYS_CONFIG_REFUSED : POKEYS_CONFIG_APPLIED;
}
