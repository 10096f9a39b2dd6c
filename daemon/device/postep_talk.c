/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * PoStep motor drivers: how a setting gets to them (protocol section 3.24.3, 0x85/50, 51
 * and 53).
 *
 * The device asks a driver over I2C when it likes. So a step mode or temperature limit is
 * only on its way when it stands in the device's table: the device has to be told, one
 * number at a time, to pass it on, and what the driver made of it shows when the device
 * has fetched everything from the driver again. What shows that the device has talked to
 * a driver is a counter. A driver that is not talked to in time has not taken it.
 *
 * Nothing is ever saved in a driver's own memory, and currents are not touched: their
 * unit is documented nowhere.
 */

#include <string.h>
#include "daemon/device/internal.h"
#include "daemon/device/postep.h"

#define TALK_NS (2 * SECOND)	/* until a driver has been talked to */
#define LOOK_NS (20 * MS)	/* from look to look at the counters */
enum { TALKED = 2 }; /* the first one may have begun before */

/* The counters, by a request of our own: the slow groups wait for the link to run. */
static void counters_came(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
			  uint64_t now_ns)
{
	struct device *device = device_of(mailbox);
	struct postep_talk *talk = &device->configure.postep;

	(void)context;
	device->now_ns = now_ns;
	talk->open = false;
	if (!answered(entry))
		return;
	postep_status(device, entry);
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		const uint8_t updates = device->image.postep[i].updates;

		if (!talk->counted)
			talk->updates[i] = updates;
		else if ((uint8_t)(updates - talk->updates[i]) >= TALKED)
			talk->awaited &= (uint8_t)~(1u << i);
	}
	talk->counted = true;
}

static void await(struct device *device, uint8_t axes)
{
	struct postep_talk *talk = &device->configure.postep;

	talk->awaited = axes;
	talk->waiting = true;
	talk->counted = false;
	talk->until_ns = device->now_ns + TALK_NS;
	talk->again_ns = 0;
}

/* True when the drivers have been talked to, or it has taken too long. */
static bool waited(struct device *device)
{
	struct postep_talk *talk = &device->configure.postep;

	if (talk->open)
		return false;
	if (!talk->awaited || device->now_ns >= talk->until_ns) {
		talk->waiting = false;
		return true;
	}
	if (device->now_ns >= talk->again_ns &&
	    request_send(device, WIRE_OP_POSTEP_STATUS, NULL, counters_came, NULL, NULL)) {
		talk->open = true;
		talk->again_ns = device->now_ns + LOOK_NS;
	}
	return false;
}

/*
 * What these drivers have, and what the device is told to do with them, is to be looked at
 * anew: of what the device's table says nobody knows whether they have heard it.
 */
static void begin_anew(struct device *device, uint8_t axes)
{
	struct postep_talk *talk = &device->configure.postep;

	talk->step = 0;
	talk->waiting = false;
	talk->fetched &= (uint8_t)~axes;
	device->configure.setting[SETTING_POSTEP].state = SETTING_READ;
	device->configure.setting[SETTING_POSTEP_MODES].state = SETTING_READ;
}

/* Drivers that the device is set up to talk to. */
static uint8_t talkative(const struct device *device, uint8_t axes)
{
	const struct wire_postep_comm_req *comm =
		&device->configure.setting[SETTING_POSTEP].value.postep;

	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		if (!comm->enable || !comm->axis[i].type)
			axes &= (uint8_t)~(1u << i);
	}
	return axes;
}

/* A driver is silent: say so, and let the device fetch again from those that talk. */
static void not_taken(struct device *device, uint8_t axes)
{
	begin_anew(device, axes);
	setting_refuse(device, &device->configure.setting[SETTING_POSTEP_MODES], axes);
}

/*
 * What the drivers have themselves is read first, where something is wanted of them. The
 * device's table may say what is wanted while a driver, which was switched off, has not
 * heard of it: so of one that is silent nothing is believed.
 */
bool postep_modes_ready(struct device *device)
{
	const uint8_t comm = device->configure.setting[SETTING_POSTEP].state;
	struct postep_talk *talk = &device->configure.postep;
	const uint8_t axes = postep_axes_with(&device->wishes.wanted, POSTEP_MODE_BITS) &
			     (uint8_t)~talk->fetched;
	uint8_t silent;

	if (!axes)
		return true;
	if (comm != SETTING_DONE && comm != SETTING_REFUSED)
		return false;
	if (!talk->waiting)
		await(device, talkative(device, axes));
	if (!waited(device))
		return false;
	silent = talk->awaited | (uint8_t)(axes & ~talkative(device, axes));
	talk->fetched |= axes & (uint8_t)~silent;
	if (silent)
		not_taken(device, silent);
	return !silent;
}

static void passed_on(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
		      uint64_t now_ns)
{
	struct device *device = device_of(mailbox);
	struct setting *setting = context;
	struct postep_talk *talk = &device->configure.postep;

	device->now_ns = now_ns;
	setting->state = SETTING_EFFECT;
	if (answered(entry)) {
		await(device, talk->passing);
		return;
	}
	begin_anew(device, talk->passing);
	setting->unanswered++;
}

/* Tell the device what to do with these drivers; true if that was sent. */
static bool pass_on(struct device *device, struct setting *setting, uint8_t axes, uint8_t update)
{
	struct wire_postep_comm_req comm = device->configure.setting[SETTING_POSTEP].value.postep;

	comm.option = WIRE_POSTEP_WRITE;
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		if (axes >> i & 1)
			comm.axis[i].update = update;
		else if (comm.axis[i].update & UPDATE_MODE)
			comm.axis[i].update = UPDATE_ALL;
	}
	if (!request_send(device, WIRE_OP_POSTEP_COMM, &comm, passed_on, NULL, setting))
		return false;
	device->configure.postep.passing = axes;
	if (update == (UPDATE_WRITE | NUMBER_STEP))
		device->configure.postep.turning |= axes;
	setting->state = SETTING_WRITING;
	return true;
}

/* Whose step mode, or temperature limit, is another one than the driver's. */
static uint8_t axes_to_pass(const struct setting *setting, unsigned int step)
{
	const struct wire_postep_modes_req *have = &setting->value.modes;
	const struct wire_postep_modes_req *set = &setting->write.modes;
	uint8_t axes = 0;

	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		const bool turn = have->axis[i].step != set->axis[i].step;
		const bool heat = have->axis[i].temperature != set->axis[i].temperature;

		axes |= (uint8_t)(((turn && step != 1) || (heat && step != 0) ? 1u : 0u) << i);
	}
	return axes;
}

/*
 * Step mode, temperature limit, then everything is fetched from the driver again. Motion
 * that is permitted meanwhile (of a step mode it is not) does not wait for that.
 */
bool postep_modes_effect(struct device *device, struct setting *setting)
{
	static const uint8_t updates[] = {
		UPDATE_WRITE | NUMBER_STEP,
		UPDATE_WRITE | NUMBER_TEMPERATURE,
		UPDATE_ALL,
	};
	struct postep_talk *talk = &device->configure.postep;
	const unsigned int steps = sizeof(updates);

	if (device->safe.permitted) {
		if (!talk->open)
			begin_anew(device, axes_to_pass(setting, steps));
		return false;
	}
	if (talk->waiting) {
		if (!waited(device))
			return talk->open;
		if (talk->awaited) {
			not_taken(device, talk->awaited);
			return false;
		}
		talk->step++;
	}
	while (talk->step < steps && !axes_to_pass(setting, talk->step))
		talk->step++;
	if (talk->step == steps) {
		talk->step = 0;
		setting->state = SETTING_READ;
		return false;
	}
	return setting_may_write(device) &&
	       pass_on(device, setting, axes_to_pass(setting, talk->step), updates[talk->step]);
}
