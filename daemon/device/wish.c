/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What is wanted of the device's own settings, by whom, and the report of it.
 *
 * pokeysd.conf says something, a commander may say more; the commander's goes
 * over it, because it is the later word of the one who runs the machine. The
 * commander's is judged part by part; a part that is out of range is refused
 * and its value of before stays. It is judged again when the device is known,
 * for only then it is known what a pin can do.
 *
 * A wish ends with the session of its commander: another one has not wished it,
 * and must not find it applied again after the next restart of the device. What
 * was applied stays in the device until somebody wants something else.
 *
 * The report is one struct that changes rarely, so it is told by a counter
 * whether it did, and nobody copies it for nothing.
 */

#include <errno.h>
#include <string.h>
#include "daemon/device/internal.h"
#include "daemon/device/wish.h"

void wish_refuse(struct device *device, enum pokeys_setting setting, uint8_t index)
{
	device->wishes.refused = (uint8_t)setting;
	device->wishes.refused_index = index;
	device->wishes.changed = true;
}

void wish_settled(struct device *device, enum pokeys_setting setting)
{
	if (device->wishes.refused != setting || device->wishes.out_of_range)
		return;
	wish_refuse(device, POKEYS_SETTING_NONE, 0);
}

static void out_of_range(void *context, enum pokeys_setting setting, uint8_t index, uint8_t part)
{
	struct device *device = context;

	wish_refuse(device, setting, index);
	device->wishes.out_of_range = true;
	device_say(device, EVENT_WISH_REFUSED, EVENT_WARNING, setting, index, part);
}

/*
 * Bits of the function byte that a pin can have; all while the device is not known.
 * About digital pins the sources contradict each other (protocol section 2.5), so
 * those are the device's to refuse.
 */
static uint8_t pin_can(const struct device *device, unsigned int pin)
{
	const struct pokeys_capability *c = &device->image.capability;
	const unsigned int first = WIRE_ANALOG_FIRST_PIN - 1;

	if (!c->pins)
		return UINT8_MAX;
	if (pin >= c->pins)
		return 0;
	if (pin < first || pin >= first + POKEYS_ANALOG || !c->analog_inputs)
		return (uint8_t)~WIRE_PIN_ANALOG_IN;
	return UINT8_MAX;
}

static void judge(struct device *device, struct pokeys_settings *now,
		  const struct pokeys_settings *old)
{
	struct wish_judge judge = {
		.now = now, .old = old, .refuse = out_of_range, .context = device
	};

	for (unsigned int i = 0; i < POKEYS_PINS; i++)
		judge.pin_can[i] = pin_can(device, i);
	wish_judge(&judge);
}

static void lay(struct device *device)
{
	struct wishes *wishes = &device->wishes;

	wishes->wanted = device->config.settings;
	wish_lay(&wishes->wanted, &wishes->accepted);
	wishes->changed = true;
}

void device_wish_init(struct device *device)
{
	lay(device);
}

void wish_begin(struct device *device)
{
	static const struct pokeys_settings nothing;
	struct wishes *wishes = &device->wishes;

	memset(&wishes->known, 0, sizeof(wishes->known));
	judge(device, &wishes->accepted, &nothing);
	lay(device);
}

void wish_session(struct device *device, uint32_t session)
{
	struct wishes *wishes = &device->wishes;

	if (!wishes->generation || wishes->session == session)
		return;
	memset(&wishes->accepted, 0, sizeof(wishes->accepted));
	wishes->generation = 0;
	device->image.config_generation = 0;
	wishes->out_of_range = false;
	wish_refuse(device, POKEYS_SETTING_NONE, 0);
	lay(device);
	configure_again(device, false);
}

void device_wish(struct device *device, const struct pokeys_wish *wish)
{
	struct wishes *wishes = &device->wishes;
	struct pokeys_settings now = wish->settings;

	wishes->session = wish->session;
	wishes->generation = wish->generation;
	device->image.config_generation = wish->generation;
	wishes->out_of_range = false;
	wish_refuse(device, POKEYS_SETTING_NONE, 0);
	judge(device, &now, &wishes->accepted);
	wishes->accepted = now;
	lay(device);
	configure_again(device, false);
}

void device_wanted(struct device *device, const struct pokeys_settings *wanted)
{
	device->config.settings = *wanted;
	lay(device);
	configure_again(device, false);
}

struct pokeys_settings *wish_known(struct device *device)
{
	device->wishes.changed = true;
	return &device->wishes.known;
}

bool device_report(struct device *device, struct pokeys_report *out)
{
	struct wishes *wishes = &device->wishes;
	const uint8_t state = (uint8_t)configure_state(device);

	if (!wishes->changed && state == wishes->state_reported)
		return false;
	wishes->changed = false;
	wishes->state_reported = state;
	device->image.report_count = ++wishes->count;
	memset(out, 0, sizeof(*out));
	out->count = wishes->count;
	out->generation = wishes->generation;
	out->state = state;
	out->refused = wishes->refused;
	out->refused_index = wishes->refused_index;
	out->device = wishes->known;
	out->wanted = wishes->wanted;
	shared_tell(device, out);
	return true;
}

int device_order(struct device *device, enum device_order order)
{
	if (order != DEVICE_ORDER_SAVE && order != DEVICE_ORDER_APPLY &&
	    order != DEVICE_ORDER_REBOOT)
		return -EINVAL;
	if (order == DEVICE_ORDER_APPLY) {
		configure_again(device, true);
		return running(device) || device->image.link == POKEYS_LINK_CONFIGURING ? 0 :
											  -ENOTCONN;
	}
	if (!running(device))
		return -ENOTCONN;
	if (device->safe.permitted || !motion_standing(device))
		return -EBUSY;
	if (order == DEVICE_ORDER_SAVE && operation_saved_just_now(device))
		return -EAGAIN;
	return one_shot_order(device, order == DEVICE_ORDER_SAVE ? POKEYS_ONE_SHOT_SAVE_CONFIG :
								   POKEYS_ONE_SHOT_REBOOT);
}
