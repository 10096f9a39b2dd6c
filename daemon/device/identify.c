/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Who is it: device data, clock, name, lock, options (protocol sections 1.8,
 * 2.1 to 2.4).
 *
 * The device data comes first and alone: only when serial number and type are
 * right may anything else be asked. What the firmware of an odd type does not
 * answer is left out after a few rounds, except the device data itself; that
 * goes on being asked meanwhile, or its silence would look like a lost device.
 *
 * A reply's payload has no checksum of its own, and what it says here decides over
 * the whole link. So device data is believed when it came twice alike in a row, and three
 * times where it says another device: two may be damaged in the same bit.
 */

#include <string.h>
#include "daemon/device/internal.h"

#define ALIVE_NS (50 * MS)

enum {
	ROUNDS = 3,      /* of one request with all its retries */
	ALIKE = 2,       /* answers in a row that say who it is */
	ALIKE_OTHER = 3, /* ... another one than before, or none that can be used */
};

static void take_name(struct device *device, const uint8_t *reply)
{
	struct wire_device_name_rep name;
	char label[21];

	wire_device_name_decode_rep(reply, &name);
	wire_device_label(&name, label);
	memset(device->image.identity.name, 0, sizeof(device->image.identity.name));
	memcpy(device->image.identity.name, label, sizeof(label));
}

static void take_user(struct device *device, const uint8_t *reply)
{
	struct wire_user_id_rep user;

	wire_user_id_decode_rep(reply, &user);
	device->image.identity.user_id = user.user_id;
	device->image.identity.locked = user.locked;
}

static void take_options(struct device *device, const uint8_t *reply)
{
	struct wire_options_rep options;

	wire_options_decode_rep(reply, &options);
	device->image.identity.options = options.active;
}

static void take_capability(struct device *device, const struct wire_identity *identity)
{
	struct pokeys_capability *c = &device->image.capability;
	const struct wire_model *m = identity->model;
	const uint32_t has = m->features;

	*c = (struct pokeys_capability){
		.pins = m->pins,
		.pwm = m->pwm_channels,
		.basic_encoders = m->basic_encoders,
		.encoders = m->encoders,
		.fast_encoders = m->fast_encoders,
		.ultra_fast_encoders = m->ultra_encoders,
		.matrix_led = m->matrix_leds,
		.poextbus = m->poextbus_bytes,
		.easy_sensors = m->easy_sensors,
		.pulse_engine = (uint8_t)wire_pulse_version(identity),
		.pwm_hz = m->pwm_hz,
		.axes = m->pulse_axes,
		.analog_inputs = !!(has & WIRE_HAS_ANALOG),
		.analog_filtering = !!(has & WIRE_HAS_ANALOG),
		.digital_counters = !!(has & WIRE_HAS_COUNTERS),
		.key_mapping = !!(has & WIRE_HAS_KEYBOARD),
		.triggered_key_mapping = !!(has & WIRE_HAS_KEYBOARD),
		.key_repeat_delay = !!(has & WIRE_HAS_KEYBOARD),
		.joystick = !!(has & WIRE_HAS_KEYBOARD),
		.macros = !!(has & WIRE_HAS_KEYBOARD),
		.matrix_keyboard = !!(has & WIRE_HAS_MATRIX_KB),
		.lcd = !!(has & WIRE_HAS_LCD),
		.connection_signal = !!(has & WIRE_HAS_CONNECTION_SIGNAL),
		.ponet = !!(has & WIRE_HAS_PONET),
		.i2c = !!(has & WIRE_HAS_I2C),
		.init_outputs = !!(has & WIRE_HAS_STARTUP_OUTPUTS),
		.one_wire = !!(has & WIRE_HAS_1WIRE),
		.failsafe = !!(has & WIRE_HAS_NAMES),
		.custom_name = !!(has & WIRE_HAS_NAMES),
		.additional_options = !!(has & WIRE_HAS_NAMES),
		.load_status = !!(has & WIRE_HAS_LOAD),
		.sensor_list = !!(has & WIRE_HAS_SENSOR_LIST),
		.web_interface = !!(has & WIRE_HAS_WEB),
		.potlog27 = !!(has & WIRE_HAS_TLOG27),
		.digital_in = m->pinmap->digital_in,
		.digital_out = m->pinmap->digital_out,
		.analog_in = m->pinmap->analog_in,
		.counter = m->pinmap->counter,
		.pwm_pins = m->pinmap->pwm,
	};
}

static void take_identity(struct device *device, const struct wire_device_data_rep *data)
{
	const struct wire_identity *who = &device->identify.identity;
	struct pokeys_identity *identity = &device->image.identity;

	*identity = (struct pokeys_identity){
		.serial = who->serial,
		.address = device->life.address,
		.hardware = who->hardware,
		.firmware_major = who->firmware.major,
		.firmware_minor = who->firmware.minor,
		.firmware_revision = who->firmware.revision,
		.user_id = data->user_id,
		.locked = data->locked,
	};
	memcpy(identity->name, data->name, sizeof(data->name));
	memcpy(identity->build, data->build_date, sizeof(data->build_date));
	memcpy(identity->type, who->model->name,
	       strnlen(who->model->name, sizeof(identity->type) - 1));
}

static bool is_supported(const struct wire_device_data_rep *data, const struct wire_identity *who)
{
	return who->extended && who->model->known && !data->bootloader;
}

bool identify_believed(struct device *device, const uint8_t reply[WIRE_PK])
{
	const uint32_t known = device->config.serial ? device->config.serial :
						       device->identify.identity.serial;
	const unsigned int alike = restart_data_alike(device, reply);
	struct wire_device_data_rep data;
	struct wire_identity who;

	wire_device_data_decode_rep(reply, &data);
	wire_identify(&data, &who);
	return alike >= (who.serial == known && is_supported(&data, &who) ? ALIKE : ALIKE_OTHER);
}

enum pokeys_fault identify_take(struct device *device, const uint8_t reply[WIRE_PK])
{
	struct identify *identify = &device->identify;
	struct wire_device_data_rep data;
	struct wire_identity who;

	wire_device_data_decode_rep(reply, &data);
	wire_identify(&data, &who);
	if (who.serial != identify->identity.serial) {
		restart_forget(device);
		if (identify->identity.serial)
			place_lost(device, UINT8_MAX, PLACE_RESTART);
	}
	identify->identity = who;
	if (device->config.serial && who.serial != device->config.serial)
		return POKEYS_FAULT_WRONG_SERIAL;
	if (!is_supported(&data, &who))
		return POKEYS_FAULT_UNSUPPORTED;
	take_identity(device, &data);
	take_capability(device, &who);
	identify->step[IDENTIFY_DATA].done = true;
	return POKEYS_FAULT_NONE;
}

static void take(struct device *device, enum identify_step step, const mailbox_entry_t *entry)
{
	enum pokeys_fault fault;

	device->identify.step[step].done = true;
	switch (step) {
	case IDENTIFY_DATA:
		device->identify.step[step].done = false;
		if (!identify_believed(device, entry->response_buffer))
			break;
		fault = identify_take(device, entry->response_buffer);
		if (fault)
			life_refuse(device, fault);
		break;
	case IDENTIFY_TICK:
		restart_tick(device, entry);
		device->identify.step[step].done = !restart_doubted(device);
		device->life.rebooted = false; /* all is read anew anyway */
		break;
	case IDENTIFY_NAME:
		take_name(device, entry->response_buffer);
		break;
	case IDENTIFY_USER:
		take_user(device, entry->response_buffer);
		break;
	case IDENTIFY_OPTIONS:
		take_options(device, entry->response_buffer);
		break;
	case IDENTIFY_STEPS:
		break;
	}
}

/* The context is the step's number. */
static void step_ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
		       uint64_t now_ns)
{
	struct device *device = device_of(mailbox);
	const enum identify_step step = (enum identify_step)(uintptr_t)context;
	struct identify *identify = &device->identify;

	device->now_ns = now_ns;
	identify->step[step].open = false;
	if (entry->state == POKEYS_REQUEST_CANCELLED)
		return;
	if (answered(entry)) {
		take(device, step, entry);
	} else if (step != IDENTIFY_DATA && ++identify->step[step].failures >= ROUNDS) {
		identify->step[step].done = true;
	}
}

static void alive_ended(pokeys_device_t *mailbox, const mailbox_entry_t *entry, void *context,
			uint64_t now_ns)
{
	struct device *device = device_of(mailbox);

	(void)context;
	device->now_ns = now_ns;
	device->identify.alive_open = false;
	if (!answered(entry))
		return;
	if (entry->command_sent == wire_op(WIRE_OP_TICK)->id)
		restart_tick(device, entry);
	else
		restart_identity(device, entry);
}

void identify_alive(struct device *device)
{
	struct identify *identify = &device->identify;
	const uint64_t usual = device->config.lost_after_ns / 4;

	if (identify->alive_open ||
	    (device->now_ns < identify->alive_ns && !restart_doubted(device)))
		return;
	if (!request_send(device, identify->alive_tick ? WIRE_OP_TICK : WIRE_OP_DEVICE_DATA, NULL,
			  alive_ended, NULL, NULL))
		return;
	identify->alive_open = true;
	identify->alive_tick = !identify->alive_tick;
	identify->alive_ns = device->now_ns + (usual < ALIVE_NS ? usual : ALIVE_NS);
}

void identify_begin(struct device *device)
{
	struct identify *identify = &device->identify;

	memset(identify->step, 0, sizeof(identify->step));
	identify->alive_ns = device->now_ns + ALIVE_NS;
	identify->alive_tick = false;
	device->restart.clock_known = false;
}

static void send_step(struct device *device, enum identify_step step)
{
	static const enum wire_op ops[IDENTIFY_STEPS] = {
		[IDENTIFY_DATA] = WIRE_OP_DEVICE_DATA, [IDENTIFY_TICK] = WIRE_OP_TICK,
		[IDENTIFY_NAME] = WIRE_OP_DEVICE_NAME, [IDENTIFY_USER] = WIRE_OP_USER_ID,
		[IDENTIFY_OPTIONS] = WIRE_OP_OPTIONS,
	};
	static const union {
		struct wire_device_name_req name;
		struct wire_options_req options;
	} reading; /* all zero: a read, whatever it is */

	if (request_send(device, ops[step], &reading, step_ended, NULL, (void *)(uintptr_t)step))
		device->identify.step[step].open = true;
}

static void finish(struct device *device)
{
	const struct pokeys_identity *who = &device->image.identity;

	device_say(device, EVENT_IDENTIFIED, EVENT_NOTICE, who->serial, who->hardware,
		   who->firmware_major << 16 | who->firmware_minor << 8 | who->firmware_revision);
	wish_begin(device);
	postep_forget(device);
	access_begin(device);
	configure_begin(device);
	plan_begin(device);
	safe_begin(device);
	motion_begin(device);
	life_enter(device, POKEYS_LINK_CONFIGURING, POKEYS_FAULT_NONE);
}

void identify_cycle(struct device *device)
{
	struct identify *identify = &device->identify;
	bool done = true;

	for (unsigned int i = 0; i < IDENTIFY_STEPS; i++) {
		if (!identify->step[i].done && !identify->step[i].open)
			send_step(device, (enum identify_step)i);
		done = done && identify->step[i].done;
		if (i == IDENTIFY_DATA && !done)
			return;
	}
	if (done)
		finish(device);
	else
		identify_alive(device);
}
