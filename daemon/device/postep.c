/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * What PoStep motor drivers say (protocol section 3.24.3, 0x85/51 to 54), as slow groups.
 *
 * The status is one request; what changes rarely takes turns in another group. Both are
 * asked for only while the device is set up to talk to drivers.
 */

#include <string.h>
#include "daemon/device/internal.h"

void postep_forget(struct device *device)
{
	memset(device->image.postep, 0, sizeof(device->image.postep));
	memset(device->image.backlash, 0, sizeof(device->image.backlash));
	device->image.t_postep_ns = 0;
}

bool postep_has(const struct device *device)
{
	const struct setting *comm = &device->configure.setting[SETTING_POSTEP];

	return comm->known && comm->value.postep.enable;
}

enum wire_op postep_ask(struct device *device, union slow_request *request)
{
	(void)device;
	(void)request;
	return WIRE_OP_POSTEP_STATUS;
}

static void count_update(struct pokeys_postep *driver, uint8_t updates, bool first, uint64_t t_ns)
{
	const uint8_t more = (uint8_t)(updates - driver->updates);

	driver->updates = updates;
	if (first || !more)
		return;
	driver->update_count += more;
	driver->t_update_ns = t_ns;
}

/* Each once, when it comes; that it is gone shows on the pin. */
static void say_faults(struct device *device, unsigned int axis, uint8_t faults)
{
	const uint8_t fresh = faults & (uint8_t)~device->image.postep[axis].faults;

	if (fresh)
		device_say(device, EVENT_POSTEP, EVENT_WARNING, axis, fresh, 0);
}

void postep_status(struct device *device, const mailbox_entry_t *entry)
{
	const bool first = !device->image.t_postep_ns;
	struct wire_postep_status_rep status;

	wire_postep_status_decode_rep(entry->response_buffer, &status);
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		struct pokeys_postep *driver = &device->image.postep[i];

		driver->supply = status.axis[i].supply;
		driver->temperature = status.axis[i].temperature;
		driver->inputs = status.axis[i].inputs;
		driver->state = status.axis[i].state;
		say_faults(device, i, status.axis[i].faults);
		driver->faults = status.axis[i].faults;
		count_update(driver, status.axis[i].updates, first, entry->timestamp_received);
	}
	device->image.t_postep_ns = entry->timestamp_received;
}

void postep_modes(struct device *device, const struct wire_postep_modes_req *modes)
{
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		struct pokeys_postep *driver = &device->image.postep[i];

		driver->mode = modes->axis[i].mode;
		driver->step_mode = modes->axis[i].step;
		driver->temperature_limit = modes->axis[i].temperature;
	}
}

static void take_currents(struct device *device, const uint8_t *reply)
{
	struct wire_postep_currents_req currents;

	wire_postep_currents_decode_rep(reply, &currents);
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		struct pokeys_postep *driver = &device->image.postep[i];

		driver->full_scale = currents.axis[i].full_scale;
		driver->idle = currents.axis[i].idle;
		driver->overheat = currents.axis[i].overheat;
	}
}

static void take_versions(struct device *device, const uint8_t *reply)
{
	struct wire_postep_versions_rep versions;

	wire_postep_versions_decode_rep(reply, &versions);
	for (unsigned int i = 0; i < POKEYS_AXES; i++) {
		struct pokeys_postep *driver = &device->image.postep[i];

		driver->hardware_major = versions.axis[i].hw_major;
		driver->hardware_minor = versions.axis[i].hw_minor;
		driver->firmware_major = versions.axis[i].fw_major;
		driver->firmware_minor = versions.axis[i].fw_minor;
	}
}

static void take_modes(struct device *device, const uint8_t *reply)
{
	struct wire_postep_modes_req modes;

	wire_postep_modes_decode_rep(reply, &modes);
	postep_modes(device, &modes);
	postep_look_again(device, &modes);
}

static const struct {
	enum wire_op op;
	void (*take)(struct device *device, const uint8_t *reply);
} rare[] = {
	{ WIRE_OP_POSTEP_CURRENTS, take_currents },
	{ WIRE_OP_POSTEP_MODES, take_modes },
	{ WIRE_OP_POSTEP_VERSIONS, take_versions },
};

enum { RARE = sizeof(rare) / sizeof(rare[0]) };

enum wire_op postep_ask_rare(struct device *device, union slow_request *request)
{
	struct plan *plan = &device->plan;

	(void)request;
	plan->postep_asked = plan->postep_next;
	plan->postep_next = (uint8_t)((plan->postep_next + 1) % RARE);
	return rare[plan->postep_asked].op;
}

void postep_take_rare(struct device *device, const mailbox_entry_t *entry)
{
	rare[device->plan.postep_asked].take(device, entry->response_buffer);
}
